"""Two to four runs on one store at once: none may lose or mix anything, or wait for another.

Each starts at a random moment, as the real command or a fork of it, and must end with all that it
was asked for in the store, to the bit, whatever the others have done of it meanwhile.
"""

import itertools

from stores_compared import contents, damage

from chaos.common import FOREIGN, rods_file
from chaos.processes import MASSES, Run, hurried, undisturbed
from compressor.cases.load import load_studies
from compressor.store.studies import read_studies

WHAT = "two to four runs on one store at once"
KEEPS = ("metrics", "series")
LONGEST = 0.2  # s from one start to the next
REAL = 10  # one trial in so many is of real commands


def arrange(folder, draw):
    """Two to four commands, of one study or of some that share jobs, and the part each asks for."""
    count, files, commands, asked = draw.randint(2, 4), [], [], []
    for number in range(draw.choice((1, count))):
        first = draw.randrange(len(MASSES) // 2)
        masses = MASSES[first : first + len(MASSES) // 2]
        files.append(rods_file(folder, f"study-{number}", masses, draw.choice(KEEPS)))
    for number, file in zip(range(1, count + 1), itertools.cycle(files), strict=False):
        (study,), is_part = load_studies(file), draw.random() < 0.5
        asked.append(study.shard(number, count) if is_part else study)
        commands.append([file.name, *["--shard", f"{number}/{count}"][: 2 * is_part]])
    return commands, asked


def together(folder, commands, draw, real):
    """Start runs at random moments, and wait for all: the runs, and the exit code of each."""
    runs = []
    for command in commands:
        runs.append(Run(["run", *command, "-r", "out", "-j", "1"], folder, real, hurried))
        runs[-1].watch(draw.uniform(0, LONGEST))
    while [run for run in runs if run.watch(0.002)]:
        pass
    return runs, [run.finish() for run in runs]


def trial(place, draw, number, counts):
    """Start runs together."""
    (commands, studies), is_real = arrange(place, draw), number % REAL == 0
    runs, codes = together(place, commands, draw, is_real)
    problems = [
        f"{command}: {code}: {run.text()[-500:]}"
        for run, command, code in zip(runs, commands, codes, strict=True) if code
    ]  # fmt: skip
    problems += filter(None, [damage(place / "out")])
    found = contents(place / "out", FOREIGN)
    asked = {study.keys[number] for study in studies for number in study.selected}
    if found.keys() != asked:
        problems.append(f"{len(asked)} jobs were asked for, {len(found)} are stored")
    single = [undisturbed(place.parent, keep)[1] for keep in KEEPS]
    for key, content in found.items():
        if content not in {of.get(key) for of in single}:
            problems.append(f"job {key} is none that a single run stores")
    listed = {study.name: study.keys for study in read_studies(place / "out")}
    if listed != {study.name: study.keys for study in studies}:
        problems.append("a study lists other jobs than it has")
    _, again = together(place, commands, draw, False)
    if any(again) or contents(place / "out", FOREIGN) != found:
        problems.append("the same commands, once more, do not leave all as it was")
    counts.update("a shard" if "--shard" in command else "a whole run" for command in commands)
    counts["of real commands"] += is_real
    return "; ".join(problems)

"""Two to four runs on one store at once: none may lose or mix anything, or wait for another.

Each run starts at its own random moment, as the real command or a fork of it, and must end with all
that it was asked for in the store, to the bit, whatever the others have done of it meanwhile.
"""

from chaos.common import FOREIGN, contents, damage, rods_file
from chaos.processes import MASSES, Run, hurried, undisturbed
from compressor.cases.load import load_studies
from compressor.store.studies import read_studies

WHAT = "two to four runs on one store at once"
KEEPS = ("metrics", "series")
LONGEST = 0.2  # s from one start to the next
REAL = 10  # one trial in so many is of real commands


def arrange(folder, draw):
    """Two to four commands: of one study or of some that share jobs, whole or in shards."""
    count, commands = draw.randint(2, 4), []
    names = [f"study-{n}" for n in range(draw.choice((1, count)))]
    for name in names:
        first = draw.randrange(len(MASSES) // 2)
        rods_file(folder, name, MASSES[first : first + len(MASSES) // 2], draw.choice(KEEPS))
    for number in range(count):
        shard = ["--shard", f"{number + 1}/{count}"] if draw.random() < 0.5 else []
        commands.append([f"{names[number % len(names)]}.yaml", *shard])
    return commands


def together(folder, commands, draw, real):
    """Start runs at random moments, and wait for all: the runs, and the exit code of each."""
    runs = []
    for command in commands:
        runs.append(Run(["run", *command, "-r", "out", "-j", "1"], folder, real, hurried))
        runs[-1].watch(draw.uniform(0, LONGEST))
    while [run for run in runs if run.watch(0.002)]:
        pass
    return runs, [run.finish() for run in runs]


def requested(folder, command):
    """The keys of the jobs that a command asks for."""
    (study,) = load_studies(folder / command[0])
    if "--shard" in command:
        study = study.shard(*map(int, command[-1].split("/")))
    return {study.keys[number] for number in study.selected}


def trial(place, draw, number, counts):
    """Start runs together."""
    commands, is_real = arrange(place, draw), number % REAL == 0
    runs, codes = together(place, commands, draw, is_real)
    problems = [
        f"{command}: {code}: {run.text()[-500:]}"
        for run, command, code in zip(runs, commands, codes, strict=True) if code
    ]  # fmt: skip
    problems += [text for text in [damage(place / "out")] if text]
    found, asked = contents(place / "out", FOREIGN), set()
    asked.update(*(requested(place, command) for command in commands))
    if found.keys() != asked:
        problems.append(f"{len(asked)} jobs were asked for, {len(found)} are stored")
    single = [undisturbed(place.parent, keep)[1] for keep in KEEPS]
    for key, content in found.items():
        if content not in {of.get(key) for of in single}:
            problems.append(f"job {key} is none that a single run stores")
    names = {command[0].removesuffix(".yaml") for command in commands}
    manifests = {study.name: set(study.keys) for study in read_studies(place / "out")}
    if manifests != {name: set(load_studies(place / f"{name}.yaml")[0].keys) for name in names}:
        problems.append("a study lists other jobs than it has")
    _, again = together(place, commands, draw, False)
    if any(again) or contents(place / "out", FOREIGN) != found:
        problems.append("the same commands, once more, do not leave all as it was")
    counts.update("a shard" if "--shard" in command else "a whole run" for command in commands)
    counts["of real commands"] += is_real
    return "; ".join(problems)

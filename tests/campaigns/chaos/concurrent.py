"""Two to four runs on one store at once: none may lose or mix anything, or wait for another.

Each run starts at its own random moment, as the real command or a fork of it, and must end with all
that it was asked for in the store, to the bit, whatever the others have done of it meanwhile.
"""

import random
import shutil
import tempfile
import time
from pathlib import Path

from chaos.kill import hurried
from chaos.processes import Run
from chaos.stored import case_file, contents, damage
from chaos.tally import Tally
from compressor.cases.load import load_studies
from compressor.store.studies import read_studies

WHAT = "two to four runs on one store at once"
MASSES = [4 + n / 100 for n in range(24)]  # rod masses, kg; a study has a stretch of them
KEEPS = ("metrics", "series")
FOREIGN = ("case", "name")  # they tell which of the studies ran a job
LATEST = 0.4  # s after the first start
REAL = 10  # one trial in so many is of real commands


def one_study(folder, draw):
    """Every run has the same study."""
    case_file(folder, "one", MASSES, draw.choice(KEEPS))
    return [["one.yaml"]] * draw.randint(2, 4)


def overlapping(folder, draw):
    """Studies that share jobs, and keep more or less of them."""
    found = []
    for number in range(draw.randint(2, 4)):
        first = draw.randrange(len(MASSES) // 2)
        stretch = MASSES[first : first + len(MASSES) // 2]
        case_file(folder, f"study-{number}", stretch, draw.choice(KEEPS))
        found.append([f"study-{number}.yaml"])
    return found


def shards(folder, draw):
    """One study in shards."""
    case_file(folder, "one", MASSES, draw.choice(KEEPS))
    count = draw.randint(2, 4)
    return [["one.yaml", "--shard", f"{n}/{count}"] for n in range(1, count + 1)]


def shards_and_whole(folder, draw):
    """Shards of studies that share jobs, beside a run without shards."""
    files = overlapping(folder, draw)[:3]
    return [*([*name, "--shard", f"1/{n + 1}"] for n, name in enumerate(files)), files[0]]


ARRANGEMENTS = {
    "the same study": one_study,
    "overlapping studies": overlapping,
    "shards": shards,
    "shards and a whole run": shards_and_whole,
}


def together(folder, commands, draw, real):
    """Start runs at random moments, and wait for all: the runs, and the exit code of each."""
    began, runs = time.monotonic(), []
    moments = sorted(draw.uniform(0, LATEST) for _ in commands)
    for moment, command in zip(moments, commands, strict=True):
        while time.monotonic() - began < moment:
            for run in runs:
                run.read()
            time.sleep(0.002)
        runs.append(Run(["run", *command, "-r", "out", "-j", "1"], folder, real, hurried))
    while any(run.runs() for run in runs):
        for run in runs:
            run.read(0.002)
    return runs, [run.finish() for run in runs]


def requested(folder, command):
    """The keys of the jobs that a command asks for."""
    (study,) = load_studies(folder / command[0])
    if "--shard" in command:
        study = study.shard(*map(int, command[-1].split("/")))
    return {study.keys[number] for number in study.selected}


def trial(folder, expected, draw, counts, real):
    """Start runs together; what went wrong, in a line. expected: what a keep stores, by key."""
    name = draw.choice(list(ARRANGEMENTS))
    commands = ARRANGEMENTS[name](folder, draw)
    runs, codes = together(folder, commands, draw, real)
    problems = [
        f"{command}: {code}: {run.text()[-500:]}"
        for run, command, code in zip(runs, commands, codes, strict=True) if code
    ]  # fmt: skip
    problems += [text for text in [damage(folder / "out")] if text]
    found, asked = contents(folder / "out", FOREIGN), set()
    asked.update(*(requested(folder, command) for command in commands))
    if found.keys() != asked:
        problems.append(f"{len(asked)} jobs were asked for, {len(found)} are stored")
    for key, content in found.items():
        if content not in {expected[keep].get(key) for keep in KEEPS}:
            problems.append(f"job {key} is none that a single run stores")
    names = {command[0].removesuffix(".yaml") for command in commands}
    manifests = {study.name: set(study.keys) for study in read_studies(folder / "out")}
    if manifests != {name: set(load_studies(folder / f"{name}.yaml")[0].keys) for name in names}:
        problems.append("a study lists other jobs than it has")
    _, again = together(folder, commands, draw, False)
    if any(again) or contents(folder / "out", FOREIGN) != found:
        problems.append("the same commands, once more, do not leave all as it was")
    counts.update([name])
    return "; ".join(problems)


def campaign(trials, seed, folder):
    """Run `trials` arrangements of runs, every tenth with the real command."""
    tally, expected = Tally(WHAT, seed), {}
    place = Path(tempfile.mkdtemp(prefix="concurrent-", dir=folder))
    for keep in KEEPS:
        (place / keep).mkdir()
        case_file(place / keep, "one", MASSES, keep)
        _, codes = together(place / keep, [["one.yaml"]], random.Random(0), False)
        assert codes == [0]
        expected[keep] = contents(place / keep / "out", FOREIGN)
    for own in range(seed, seed + trials):
        (place / "trial").mkdir()
        real = own % REAL == 0
        if problem := trial(place / "trial", expected, random.Random(own), tally.counts, real):
            tally.failures.append(f"seed {own}: {problem}")
        tally.counts["of real commands"] += real
        shutil.rmtree(place / "trial")
        tally.trials += 1
    shutil.rmtree(place)
    return tally.result()

"""Two to four runs on one store at once: none may lose or mix anything, or wait for another.

Each run starts at its own random moment, as the real command or a fork of it, and must end with all
that it was asked for in the store, to the bit, whatever the others have done of it meanwhile.
"""

import random
import time

from chaos.common import FOREIGN, MASSES, Tally, contents, damage, fresh, rods_file
from chaos.kill import hurried
from chaos.processes import Run, undisturbed
from compressor.cases.load import load_studies
from compressor.store.studies import read_studies

WHAT = "two to four runs on one store at once"
KEEPS = ("metrics", "series")
LATEST = 0.4  # s after the first start
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
    commands = arrange(folder, draw)
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
    counts.update("a shard" if "--shard" in command else "a whole run" for command in commands)
    return "; ".join(problems)


def campaign(trials, seed, folder):
    """Run `trials` arrangements of runs, every tenth with the real command."""
    tally, expected = Tally(WHAT, seed), {keep: undisturbed(folder, keep) for keep in KEEPS}
    for own in range(seed, seed + trials):
        is_real = own % REAL == 0
        with fresh(folder) as place:
            problem = trial(place, expected, random.Random(own), tally.counts, is_real)
        tally.counts["of real commands"] += is_real
        tally.note(f"trial {own}", problem)
    return tally.result()

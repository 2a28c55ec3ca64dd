"""Two to four runs on one store at once: none may lose or mix anything, or end without a word.

Each run starts at its own random moment, as the real command or a fork of it. Without `--wait` it
may stop, with exit code 5 and the name of the run that is in its way; then it is started again when
all have ended, and must find done, to the bit, whatever the others had done of it.
"""

import random
import re
import shutil
import tempfile
import time
from pathlib import Path

from chaos.processes import Run
from chaos.stored import case_file, contents, damage, rows
from chaos.tally import Tally
from compressor.cases.load import load_studies
from compressor.store import writer
from compressor.store.reader import read_store
from compressor.store.studies import read_studies
from compressor.sweep.wanted import RequestedJobs, stored_ends

WHAT = "two to four runs on one store at once"
MASSES = [4 + n / 100 for n in range(24)]  # rod masses, kg; a study has a stretch of them
KEEPS = ("metrics", "series")
FOREIGN = ("case", "name")  # they tell which of the studies ran a job
IN_USE = re.compile(
    r"compsim: .*/writer\.lock: the store is in use by process (\d+) on \S+: compsim run .*; "
    r"wait for it to end, or choose another folder\n"
)
RUN_NOW = re.compile(r"(\d+) jobs? run in ")
ONCE = {"the same study", "shards"}  # in which no job need run twice
DONE, STORE = 0, 5
LATEST = 0.4  # s after the first start
REAL = 10  # one trial in so many is of real commands


def hurried():
    """Have a fork write and merge all the time."""
    writer.MAX_AGE, writer.MAX_SMALL, writer.MAX_SMALL_AT_END = 0.03, 4, 2


def one_study(folder, draw):
    """Every run has the same study; some may wait."""
    case_file(folder, "one", MASSES, draw.choice(KEEPS))
    return [["one.yaml", *draw.choice([[], ["--wait"]])] for _ in range(draw.randint(2, 4))]


def overlapping(folder, draw):
    """Studies that share jobs, and keep more or less of them; some runs may wait."""
    found = []
    for number in range(draw.randint(2, 4)):
        first = draw.randrange(len(MASSES) // 2)
        stretch = MASSES[first : first + len(MASSES) // 2]
        case_file(folder, f"study-{number}", stretch, draw.choice(KEEPS))
        found.append([f"study-{number}.yaml", *draw.choice([[], ["--wait"]])])
    return found


def waiting(folder, draw):
    """The same, but every run waits."""
    return [[name, "--wait"] for name, *_ in overlapping(folder, draw)]


def shards(folder, draw):
    """One study in shards, which need not wait for each other."""
    case_file(folder, "one", MASSES, draw.choice(KEEPS))
    count = draw.randint(2, 4)
    return [["one.yaml", "--shard", f"{n}/{count}"] for n in range(1, count + 1)]


def shards_and_whole(folder, draw):
    """Shards of studies that share jobs, beside a run without shards, all into the same folder."""
    found = [[name, "--shard", f"1/{n + 1}"] for n, (name, *_) in enumerate(waiting(folder, draw))]
    return [*found[:3], [found[0][0]]]


ARRANGEMENTS = {
    "the same study": one_study,
    "overlapping studies": overlapping,
    "--wait": waiting,
    "shards": shards,
    "shards and a whole run": shards_and_whole,
}


def together(folder, commands, draw, real):
    """Start runs at random moments, and wait for all: the runs, and the exit code of each."""
    began, runs = time.monotonic(), []
    for moment, command in zip(sorted(draw.uniform(0, LATEST) for _ in commands), commands,
                               strict=True):  # fmt: skip
        while time.monotonic() - began < moment:
            for run in runs:
                run.read()
            time.sleep(0.002)
        runs.append(Run(["run", *command, "-r", "out", "-j", "1"], folder, real, hurried))
    while any(run.runs() for run in runs):
        for run in runs:
            run.read(0.002)
    return runs, [run.finish() for run in runs]


def served(folder, command):
    """The jobs of a command that are stored as it asks for, and all that it has."""
    part = command[command.index("--shard") + 1].split("/") if "--shard" in command else None
    studies = load_studies(folder / command[0])
    if part:
        studies = [study.shard(int(part[0]), int(part[1])) for study in studies]
    cases = RequestedJobs(studies)
    return set(stored_ends(read_store(folder / "out"), cases)), set(cases)


def trial(folder, expected, draw, counts, real):
    """Start runs together, then those again that had to stop; what went wrong, in a line.

    `expected`: what is to be stored, by keep and key.
    """
    name = draw.choice(list(ARRANGEMENTS))
    commands = ARRANGEMENTS[name](folder, draw)
    runs, codes = together(folder, commands, draw, real)
    problems = [text for text in [damage(folder / "out")] if text]
    numbers = {run.pid for run in runs}
    for run, command, code in zip(runs, commands, codes, strict=True):
        found, asked = served(folder, command)
        if code == DONE and found != asked:
            problems.append(f"{command}: {len(asked - found)} of {len(asked)} jobs are lost")
        elif code == STORE:
            told = IN_USE.search(run.text())
            if not told or int(told[1]) not in numbers - {run.pid} or "--wait" in command:
                problems.append(f"{command} stopped: {run.text()[-300:]}")
        elif code != DONE:
            problems.append(f"{command}: {code}: {run.text()[-500:]}")
        counts["runs that stopped, with the message"] += code == STORE
        counts["runs that were done"] += code == DONE
    if DONE not in codes:
        problems.append("no run was done")
    before = rows(folder / "out")
    for command, code in zip(commands, codes, strict=True):
        if code == STORE:
            again, ended = together(folder, [command], draw, real)
            runs += again
            if ended != [DONE]:
                problems.append(f"{command}: not done when it ran again")
    jobs = sum(int(number) for run in runs for number in RUN_NOW.findall(run.text()))
    if name in ONCE and jobs != len(MASSES):
        problems.append(f"{jobs} jobs ran where there are {len(MASSES)}")
    problems += compared(folder, commands, expected, before)
    counts[name] += 1
    return "; ".join(problems)


def compared(folder, commands, expected, before):
    """What is wrong with a store when all its runs are done."""
    problems = [text for text in [damage(folder / "out")] if text]
    found, asked = contents(folder / "out", FOREIGN), set()
    for command in commands:
        has, needs = served(folder, command)
        asked |= needs
        if has != needs:
            problems.append(f"{command}: {len(needs - has)} jobs are missing in the end")
    if found.keys() != asked or not before.keys() <= found.keys():
        problems.append(f"{len(asked)} jobs were asked for, {len(found)} are stored")
    for key, content in found.items():
        if content not in {expected[keep].get(key) for keep in KEEPS}:
            problems.append(f"job {key} is none that a single run stores")
    names = {command[0].removesuffix(".yaml") for command in commands}
    manifests = {study.name: set(study.keys) for study in read_studies(folder / "out")}
    if manifests != {name: set(load_studies(folder / f"{name}.yaml")[0].keys) for name in names}:
        problems.append("a study lists other jobs than it has")
    return problems


def campaign(trials, seed, folder):
    """Run `trials` arrangements of runs, every tenth with the real command."""
    tally = Tally(WHAT, seed)
    place = Path(tempfile.mkdtemp(prefix="concurrent-", dir=folder))
    expected = {}
    for keep in KEEPS:
        (place / keep).mkdir()
        case_file(place / keep, "one", MASSES, keep)
        _, codes = together(place / keep, [["one.yaml"]], random.Random(0), False)
        assert codes == [DONE]
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

"""Jobs that crash, leave, hang, stand still or eat memory, among good ones, in a real sweep.

Every good job must be done, as in a sweep without bad ones; every bad one must be stored, and named
by the command, with its reason; and nothing of the sweep may run on five seconds later.
"""

import itertools
import os
import random
import re
import shutil
import signal
import sys
import tempfile
from functools import cache, partial
from pathlib import Path

from chaos.processes import Run
from chaos.stored import LEAN, case_file, contents, damage
from chaos.tally import Tally
from compressor.cases.load import load_studies
from compressor.store.reader import read_store
from compressor.sweep import pool

SWEEP = sys.modules["compressor.sweep.sweep"]  # the function of its name hides it
WHAT = "jobs that crash, leave, hang, stand still or eat memory, among good ones"
GOOD = [4 + n / 100 for n in range(24)]  # rod masses, kg
MAX_BAD = 5
SECONDS = 0.3  # that a job which never ends may take
LEAST = 300_000_000  # bytes that a job may add
FOREIGN = ("case", "name")  # they hold the time that a job may take, and its study
SOME_FAILED = 3


def spin():
    """Never end."""
    while True:
        pass


def deaf():
    """Never end, whatever signal asks for it."""
    signal.pthread_sigmask(signal.SIG_BLOCK, set(signal.valid_signals()))
    spin()


def swell():
    """Take all memory that there is, and try again when there is no more."""
    kept = []
    while True:
        kept.append(b"x" * 20_000_000)


# name: what the job does, the reason that is stored, part of the detail
KINDS = {
    "SIGSEGV": (lambda: os.kill(os.getpid(), signal.SIGSEGV), "worker_died", "SIGSEGV"),
    "SIGKILL": (lambda: os.kill(os.getpid(), signal.SIGKILL), "worker_died", "SIGKILL"),
    "_exit": (lambda: os._exit(3), "worker_died", "exit code 3"),
    "hang": (spin, "budget_seconds", "wall time"),
    "deaf hang": (deaf, "budget_seconds", "wall time"),
    "memory bomb": (swell, "out_of_memory", "0.3 GB"),
    "SIGSTOP": (lambda: os.kill(os.getpid(), signal.SIGSTOP), "budget_seconds", "wall time"),
}
ENDLESS = {name for name, (_, reason, _) in KINDS.items() if reason == "budget_seconds"}


def poisoned(kinds):
    """Returns what makes a fork's jobs of some keys do harm."""

    def prepare():
        SWEEP.run_job = partial(harmful, kinds)
        SWEEP.GRACE = 0.2
        pool.memory_share = lambda count: LEAST

    return prepare


def harmful(kinds, case):
    """Run a case, unless it is one that does harm: in a worker."""
    if case.key in kinds:
        KINDS[kinds[case.key]][0]()
    return SWEEP.run_job(case)


def mixed(folder, draw):
    """Case files with good and bad jobs in any order, which keep time series or not.

    Returns the files' names, what they keep, the keys of good jobs, the kinds of bad ones by key.
    """
    keep = draw.choice(["metrics", "series"])
    jobs = [(mass, "") for mass in draw.sample(GOOD, draw.randint(1, len(GOOD)))]
    kinds = [draw.choice(list(KINDS)) for _ in range(draw.randint(1, MAX_BAD))]
    jobs += [(5 + n / 100, kind) for n, kind in enumerate(kinds)]
    draw.shuffle(jobs)
    names, good, bad = [], set(), {}
    for endless, part in itertools.groupby(jobs, key=lambda job: job[1] in ENDLESS):
        masses, kinds = zip(*part, strict=True)
        solve = LEAN | {"timeout_s": SECONDS if endless else 600}
        path = case_file(folder, f"part-{len(names)}", masses, keep, solve=solve)
        names.append(path.name)
        (study,) = load_studies(path)
        bad |= {key: kind for key, kind in zip(study.keys, kinds, strict=True) if kind}
        good |= set(study.keys) - bad.keys()
    return names, keep, good, bad


def trial(folder, expected, draw, counts):
    """Run one mix; what went wrong, in a line.

    `expected`: what is to be stored of good jobs by key, for a keep.
    """
    names, keep, good, bad = mixed(folder, draw)
    workers = str(draw.randint(1, 3))
    run = Run(["run", *names, "-r", "out", "-j", workers], folder, prepare=poisoned(bad))
    code = run.finish()
    problems = [f"exit code {code}: {run.text()[-500:]}"] if code != SOME_FAILED else []
    found = contents(folder / "out", FOREIGN)
    problems += [f"job {key} is lost" for key in good - found.keys()]
    problems += [
        f"job {key} differs" for key in good & found.keys() if found[key] != expected(keep)[key]
    ]
    stored = read_store(folder / "out")
    for key, kind in bad.items():
        _, reason, detail = KINDS[kind]
        place = stored.position(key)
        end = None if place is None else stored.status_at(place)
        if not end or (end.status, end.reason) != ("failed", reason) or detail not in end.detail:
            how = f"{end.reason}: {end.detail}" if end else "missing"
            problems.append(f"{kind}, job {key}: {how}")
        if not re.search(rf": {reason}: .*; job {key}\n", run.text()):
            problems.append(f"{kind}, job {key}: not named on the terminal")
    problems += [text for text in [damage(folder / "out")] if text]
    counts.update(bad.values())
    counts["good jobs"] += len(good)
    return "; ".join(problems)


def undisturbed(folder, keep):
    """What is stored of the good jobs in a sweep without bad ones: key -> digest."""
    (folder / keep).mkdir(parents=True)
    case_file(folder / keep, "good", GOOD, keep)
    run = Run(["run", "good.yaml", "-r", "out", "-j", "2"], folder / keep)
    code = run.finish()
    assert code == 0, run.text()
    return contents(folder / keep / "out", FOREIGN)


def campaign(trials, seed, folder):
    """Run `trials` mixes of one to five bad jobs and up to forty good ones."""
    tally = Tally(WHAT, seed)
    place = Path(tempfile.mkdtemp(prefix="poison-", dir=folder))
    expected = cache(partial(undisturbed, place / "good"))
    for own in range(seed, seed + trials):
        (place / "trial").mkdir()
        if problem := trial(place / "trial", expected, random.Random(own), tally.counts):
            tally.failures.append(f"seed {own}: {problem}")
        shutil.rmtree(place / "trial")
        tally.trials += 1
    shutil.rmtree(place)
    return tally.result()

"""SIGKILL at a random moment: of the parent, of a worker, of all at once; then the same command.

Acknowledged is what the killed run has told on its terminal, and what could be read while all of it
stood still just before the kill. None of it may be lost or run again, no file may be torn, nothing
may run on, and the resumed study must equal an undisturbed one to the bit, timings apart. Jobs that
a killed worker has stored but not told of may run twice: the rest of the run cannot know of them.
"""

import os
import random
import signal
import time
from functools import cache, partial

import numpy as np

from chaos.common import SWEEP, TIMED, Tally, contents, damage, fresh, rods_file
from chaos.processes import Run
from compressor.store.stored import read_store
from compressor.sweep.worker import Workers

WHAT = "SIGKILL of the parent, a worker or both at a random moment, then resumed"
VICTIMS = ("parent", "worker", "both")
EARLY = 0.15  # share of the kills that may come before the first file
AMID = 0.5  # share of the later ones that wait for a file to be half-written
MAX_FILES = 8  # for one of which a later kill waits
REAL = 3  # one trial in so many is the real command
KINDS = {"metrics": (100, 600), "series": (12, 24)}  # jobs, of real ones


def hurried():
    """Have a fork's workers store all the time, on a slow disk: that is what kills should hit."""
    SWEEP.Workers = partial(Workers, target_seconds=0.02)
    SWEEP.store_outcomes = store_slowly


def store_slowly(folder, outcomes, real=SWEEP.store_outcomes, fsync=os.fsync):
    """Store a batch, in a worker, on a disk that takes its time."""
    os.fsync = lambda descriptor: (time.sleep(0.02), fsync(descriptor))
    return real(folder, outcomes)


def start(folder, keep, is_real):
    """Start a sweep in a folder."""
    jobs = KINDS[keep][is_real]
    rods_file(folder, "killed", [3 + n / 500 for n in range(jobs)], keep)
    return Run(["run", "killed.yaml", "-j", "2", "-r", "out"], folder, is_real, hurried)


@cache
def undisturbed(folder, keep, is_real):
    """The seconds of a sweep that nobody disturbs, and what is stored then."""
    with fresh(folder) as place:
        began, run = time.monotonic(), start(place, keep, is_real)
        code = run.finish(600)  # it may have to compile
        assert code == 0, f"{code}: {run.text()[-500:]}"
        return time.monotonic() - began, contents(place / "out")


def taken(folder):
    """Key -> the seconds that a stored job took: they change when it runs again."""
    stored = read_store(folder)
    seconds = stored.numbers(np.arange(len(stored)), [TIMED])[TIMED]
    return dict(zip(stored.columns["job"].tolist(), seconds.tolist(), strict=True))


def unfinished(folder):
    """Temporary files that a killed writer has left."""
    return [*folder.glob("**/.*.tmp")]


def strike(run, victim, draw):
    """Kill; whether it was a worker, and there was one."""
    if victim != "worker":
        run.send(signal.SIGKILL, whole=victim == "both")
        return False
    while run.watch(0.002):
        if workers := run.workers():
            os.kill(draw.choice(workers), signal.SIGKILL)
            return True
    return False


def trial(folder, expected, keep, is_real, draw, counts):
    """Kill a sweep and resume it; what went wrong, in a line."""
    seconds, whole = expected
    victim, early, amid = draw.choice(VICTIMS), draw.random() < EARLY, draw.random() < AMID
    run, files, out = start(folder, keep, is_real), draw.randint(1, MAX_FILES), folder / "out"
    if early:
        run.watch(draw.uniform(0, seconds))
    while not early and run.watch(0.001) and len([*out.glob("batches/*.h5")]) < files:
        pass
    run.send(signal.SIGSTOP, whole=True)
    before = taken(out)
    run.send(signal.SIGCONT, whole=True)
    while amid and not early and run.watch(0.0) and not unfinished(folder):
        pass
    worker_struck = strike(run, victim, draw)
    code = run.finish()
    struck = worker_struck or code == -signal.SIGKILL  # or it was leaving, with 0
    after, left, torn = taken(out), unfinished(folder), damage(out)
    anew = [key for key in before.keys() & after.keys() if before[key] != after[key]]
    again = start(folder, keep, is_real)
    resumed = again.finish()
    problems = {
        f"the killed run: {code}: {run.text()[-500:]}":
            code != (-signal.SIGKILL if struck and victim != "worker" else 0),
        "results that were read are lost": not before.keys() <= after.keys(),
        "results that were read ran again": anew and not worker_struck,
        f"told of {run.told()} jobs, {len(after)} are stored": len(after) < run.told(),
        "acknowledged results ran again": not after.items() <= taken(out).items(),
        f"after the kill: {torn}": torn,
        f"the resumed run: {resumed}: {again.text()[-500:]}": resumed != 0,
        f"after resuming: {damage(out)}": damage(out),
        "differs from an undisturbed study": contents(out) != whole,
    }  # fmt: skip
    moment = "after the end" if not struck else "amid the rows" if before else "before any row"
    counts.update([f"{victim} killed", f"killed {moment}"])
    counts["acknowledged results"] += max(len(before), run.told())
    counts["with half-written files"] += bool(left)
    counts["with jobs stored, not told of, that ran twice"] += bool(anew)
    return "; ".join(text for text, wrong in problems.items() if wrong)


def campaign(trials, seed, folder):
    """Kill `trials` sweeps, every third of them the real command; trial n has the seed seed + n."""
    tally = Tally(WHAT, seed)
    for own in range(seed, seed + trials):
        draw, is_real = random.Random(own), own % REAL == 0
        keep = draw.choice([*KINDS])
        expected = undisturbed(folder, keep, is_real)
        with fresh(folder) as place:
            problem = trial(place, expected, keep, is_real, draw, tally.counts)
        tally.counts["real commands"] += is_real
        tally.note(f"trial {own}, {keep}{', real' * is_real}", problem)
    return tally.result()

"""SIGKILL at a random moment: of the parent, of a worker, of all at once; then the same command.

Acknowledged is what the killed run has told, and what could be read while all stood still just
before. None of it may be lost or run again, no file be torn, nothing run on, and the resumed study
must equal an undisturbed one to the bit, timings apart. What a killed worker has stored, but not
told of, may run twice: the rest of the run cannot know of it.
"""

import os
import signal

import numpy as np
from stores_compared import TIMED, contents, damage

from chaos.common import FOREIGN
from chaos.processes import members, start, undisturbed
from compressor.store.stored import read_store

WHAT = "SIGKILL of the parent, a worker or both at a random moment, then resumed"
EARLY = 0.15  # share of the kills that may come before the first file
AMID = 0.5  # share of the later ones that wait for a file to be half-written
MAX_FILES = 8  # for one of which a later kill waits
UNFINISHED = "**/.*.tmp"  # files that a killed writer has left
REAL = 3  # one trial in so many is the real command


def taken(folder):
    """Key -> the seconds that a stored job took: they change when it runs again."""
    stored = read_store(folder)
    seconds = stored.numbers(np.arange(len(stored)), [TIMED])[TIMED]
    return dict(zip(stored.columns["job"].tolist(), seconds.tolist(), strict=True))


def strike(run, victim, draw):
    """Kill; whether it was a worker, and there was one."""
    if victim != "worker":
        run.send(signal.SIGKILL, whole=victim == "both")
    while victim == "worker" and run.watch(0.002):
        if workers := [pid for pid in members(run.pid) if pid != run.pid]:
            os.kill(draw.choice(workers), signal.SIGKILL)
            return True
    return False


def trial(place, draw, number, counts):
    """Kill a sweep and resume it."""
    keep, is_real = draw.choice(("metrics", "series")), number % REAL == 0
    seconds, whole = undisturbed(place.parent, keep, is_real)
    victim = draw.choice(("parent", "worker", "both"))
    early, amid = draw.random() < EARLY, draw.random() < AMID
    run, files, out = start(place, keep, is_real), draw.randint(1, MAX_FILES), place / "out"
    if early:
        run.watch(draw.uniform(0, seconds))
    while not early and run.watch(0.001) and len([*out.glob("batches/*.h5")]) < files:
        pass
    run.send(signal.SIGSTOP, whole=True)
    before = taken(out)
    run.send(signal.SIGCONT, whole=True)
    while amid and not early and run.watch(0.0) and not [*place.glob(UNFINISHED)]:
        pass
    worker_struck = strike(run, victim, draw)
    code = run.finish()
    struck = worker_struck or code == -signal.SIGKILL  # or it was leaving, with 0
    after, left, torn = taken(out), [*place.glob(UNFINISHED)], damage(out)
    anew = [key for key in before.keys() & after.keys() if before[key] != after[key]]
    again = start(place, keep, is_real)
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
        "differs from an undisturbed study": contents(out, FOREIGN) != whole,
    }  # fmt: skip
    moment = "after the end" if not struck else "amid the rows" if before else "before any row"
    counts.update([f"{victim} killed", f"killed {moment}", *["real commands"] * is_real])
    counts["acknowledged results"] += max(len(before), run.told())
    counts["with half-written files"] += bool(left)
    counts["with jobs stored, not told of, that ran twice"] += bool(anew)
    return "; ".join(text for text, wrong in problems.items() if wrong)

"""SIGKILL at a random moment: of the parent, of a worker, of all at once; then the same command.

Acknowledged is what the killed run has told on its terminal, and what could be read while all of it
stood still just before the kill. None of it may be lost or run again, no file may be torn, nothing
may run on, and the resumed study must equal an undisturbed one to the bit, timings apart.
"""

import os
import random
import shutil
import signal
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from chaos.processes import Run
from chaos.stored import case_file, contents, damage, seconds, unfinished
from chaos.tally import Tally
from compressor.sweep.worker import Workers

SWEEP = sys.modules["compressor.sweep.sweep"]  # the function of its name hides it
WHAT = "SIGKILL of the parent, a worker or both at a random moment, then resumed"
VICTIMS = ("parent", "worker", "both")
EARLY = 0.15  # share of the kills that may come before the first file
AMID = 0.5  # share of the later ones that wait for a file to be half-written
MAX_FILES = 8  # for one of which a later kill waits
REAL = 3  # one trial in so many is the real command
KINDS = {"metrics": ("metrics", 100, 600), "series": ("series", 12, 24)}  # keep, jobs, of real ones


def hurried():
    """Have a fork's workers store all the time, on a slow disk: that is what kills should hit."""
    SWEEP.Workers = partial(Workers, target_seconds=0.02)
    SWEEP.store_outcomes = store_slowly


def store_slowly(folder, ran, real=SWEEP.store_outcomes, fsync=os.fsync):
    """Store a batch, in a worker, on a disk that takes its time."""
    os.fsync = lambda descriptor: (time.sleep(0.02), fsync(descriptor))
    return real(folder, ran)


class Scene:
    """A kind of sweep that was run once undisturbed."""

    def __init__(self, folder, kind, real):
        keep, jobs, real_jobs = KINDS[kind]
        self.real, self.template = real, folder / "template"
        self.template.mkdir(parents=True)
        masses = [3 + n / 500 for n in range(real_jobs if real else jobs)]
        case_file(self.template, "killed", masses, keep)
        shutil.copytree(self.template, folder / "undisturbed")
        began = time.monotonic()
        run = self.run(folder / "undisturbed")
        code = run.finish()
        assert code == 0, run.text()
        self.seconds = time.monotonic() - began
        self.whole = contents(folder / "undisturbed" / "out")

    def run(self, folder):
        """Start the sweep in a folder."""
        return Run(["run", "killed.yaml", "-j", "2", "-r", "out"], folder, self.real, hurried)


def strike(run, victim, draw):
    """Kill; whether it was a worker, and there was one."""
    if victim != "worker":
        run.kill(whole=victim == "both")
        return False
    while run.watch(0.002):
        if workers := run.workers():
            os.kill(draw.choice(workers), signal.SIGKILL)
            return True
    return False


def trial(scene, folder, draw, counts):
    """Kill a sweep and resume it; what went wrong, in a line."""
    shutil.copytree(scene.template, folder)
    victim, early, amid = draw.choice(VICTIMS), draw.random() < EARLY, draw.random() < AMID
    run, files = scene.run(folder), draw.randint(1, MAX_FILES)
    if early:
        run.watch(draw.uniform(0, scene.seconds))
    else:
        while run.watch(0.001) and len(list(folder.glob("out/batches/*.h5"))) < files:
            pass
    run.send(signal.SIGSTOP, whole=True)
    before = seconds(folder / "out")
    run.send(signal.SIGCONT, whole=True)
    while amid and not early and run.watch(0.0) and not unfinished(folder):
        pass
    worker_struck = strike(run, victim, draw)
    code = run.finish()
    struck = worker_struck or code == -signal.SIGKILL  # or it was leaving, with 0
    after, left, torn = seconds(folder / "out"), unfinished(folder), damage(folder / "out")
    again = scene.run(folder)
    resumed = again.finish()
    now = seconds(folder / "out")
    expected = -signal.SIGKILL if struck and victim != "worker" else 0
    problems = {
        f"the killed run: {code}: {run.text()[-500:]}": code != expected,
        "results that were read are lost": not before.items() <= after.items(),
        f"told of {run.told()} jobs, {len(after)} are stored": len(after) < run.told(),
        "acknowledged results ran again": not after.items() <= now.items(),
        f"after the kill: {torn}": torn,
        f"the resumed run: {resumed}: {again.text()[-500:]}": resumed != 0,
        f"after resuming: {damage(folder / 'out')}": damage(folder / "out"),
        "differs from an undisturbed study": contents(folder / "out") != scene.whole,
    }
    moment = "after the end" if not struck else "amid the rows" if before else "before any row"
    counts.update([f"{victim} killed", f"killed {moment}"])
    counts["acknowledged results"] += max(len(before), run.told())
    counts["with half-written files"] += bool(left)
    return "; ".join(text for text, wrong in problems.items() if wrong)


def campaign(trials, seed, folder):
    """Kill `trials` sweeps, every third of them the real command; trial n has the seed seed + n."""
    tally, scenes = Tally(WHAT, seed), {}
    place = Path(tempfile.mkdtemp(prefix="kill-", dir=folder))
    for own in range(seed, seed + trials):
        draw = random.Random(own)
        name, real = draw.choice(list(KINDS)), own % REAL == 0
        if (name, real) not in scenes:
            scenes[name, real] = Scene(place / f"scene-{len(scenes)}", name, real)
        if problem := trial(scenes[name, real], place / "trial", draw, tally.counts):
            tally.failures.append(f"seed {own}, {name}{', real' if real else ''}: {problem}")
        shutil.rmtree(place / "trial")
        tally.trials += 1
        tally.counts["real commands"] += real
    shutil.rmtree(place)
    return tally.result()

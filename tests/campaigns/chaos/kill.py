"""SIGKILL at a random moment: of the parent, of a worker, of all at once; then the same command.

Acknowledged is what the killed run has told on its terminal, and what another process could read
just before the kill. None of it may be lost or run again, no file may be torn, nothing may run on,
and the resumed study must equal an undisturbed one to the bit, timings apart.
"""

import os
import random
import shutil
import signal
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from chaos.processes import Run
from chaos.stored import case_file, contents, damage, rows, unfinished
from chaos.tally import Tally
from compressor.cases.load import load_studies
from compressor.store import writer
from compressor.store.reader import read_store
from compressor.sweep.wanted import RequestedJobs, stored_ends

WHAT = "SIGKILL of the parent, a worker or both at a random moment, then resumed"
VICTIMS = ("parent", "worker", "both")
EARLY = 0.15  # share of the kills that come before the first file
AMID = 0.5  # share of the later ones that wait for a file to be half-written
REAL = 3  # one trial in so many is the real command


@dataclass(frozen=True)
class Kind:
    """A sweep to be killed."""

    keep: str
    jobs: int  # of a fork, whose writer is hurried
    real_jobs: int  # of the real command, which writes once a second
    upgraded: bool = False  # metrics of half its jobs are stored before


KINDS = {
    "metrics": Kind("metrics", 100, 600),
    "series": Kind("series", 12, 24),
    "series over metrics": Kind("series", 12, 24, upgraded=True),
}


def hurried():
    """Have a fork write and merge all the time, on a slow disk: that is what kills should hit."""
    writer.MAX_AGE, writer.MAX_SMALL, writer.MAX_SMALL_AT_END = 0.03, 4, 2
    fsync = os.fsync

    def slow(descriptor):
        time.sleep(0.01)
        fsync(descriptor)

    os.fsync = slow


class Scene:
    """A kind of sweep that was run once undisturbed; trials start from copies of its template."""

    def __init__(self, folder, kind, real):
        self.kind, self.real, self.template = kind, real, folder / "template"
        self.template.mkdir(parents=True)
        masses = [3 + n / 500 for n in range(kind.real_jobs if real else kind.jobs)]
        path = case_file(self.template, "killed", masses, kind.keep)
        self.studies = load_studies(path)
        self.cases = RequestedJobs(self.studies)
        if kind.upgraded:
            case_file(self.template, "before", masses[::2])
            self.complete(self.template, "before.yaml")
        shutil.copytree(self.template, folder / "undisturbed")
        self.before = published(self.template)
        began = time.monotonic()
        run = self.run(folder / "undisturbed")
        self.wait_for_files(run, folder / "undisturbed", 1)
        first = time.monotonic()
        code = run.finish()
        assert code == 0, run.text()
        self.starting, writing = first - began, time.monotonic() - first  # s
        self.files = published(folder / "undisturbed") - self.before
        self.between = writing / self.files  # s from file to file
        self.whole = contents(folder / "undisturbed" / "out")

    def run(self, folder, name="killed.yaml"):
        """Start the sweep in a folder."""
        return Run(["run", name, "-j", "2", "-r", "out"], folder, self.real, hurried)

    def complete(self, folder, name="killed.yaml"):
        """Run the sweep to its end; what went wrong."""
        run = self.run(folder, name)
        code = run.finish()
        return "" if code == 0 else f"the resumed run: {code}: {run.text()[-500:]}"

    def wait_for_files(self, run, folder, number):
        """Return when the run has published so many files, or ended."""
        while run.watch(0.001) and published(folder) - self.before < number:
            pass

    def served(self, folder):
        """The results that a run would not compute again: key -> row."""
        keys = stored_ends(read_store(folder / "out"), RequestedJobs(self.studies))
        found = rows(folder / "out")
        return {key: found[key] for key in keys}


def published(folder):
    """How many segments, merged ones too, and files of time series a sweep has published."""
    segments = (int(path.name[:9]) for path in folder.glob("out/rows/*.h5"))
    return max(segments, default=0) + len(list(folder.glob("out/jobs/*.h5")))


def strike(run, victim, draw):
    """Kill; whether it was a worker, and there was one."""
    if victim != "worker":
        run.kill(whole=victim == "both")
        return False
    while run.watch(0.002):
        if workers := run.workers():
            run.kill_one(draw.choice(workers))
            return True
    return False


def trial(scene, folder, draw, counts):
    """Kill a sweep and resume it; what went wrong, in a line."""
    shutil.copytree(scene.template, folder)
    victim = draw.choice(VICTIMS)
    run = scene.run(folder)
    early, amid = draw.random() < EARLY, draw.random() < AMID
    if early:
        run.watch(draw.uniform(0, scene.starting))
    else:
        scene.wait_for_files(run, folder, draw.randint(1, scene.files))
    with run.held():
        listed, before = rows(folder / "out"), scene.served(folder)
    if amid and not early:
        while run.watch(0.0) and not unfinished(folder):
            pass
    elif not early:
        run.watch(draw.uniform(0, scene.between))
    worker_struck = strike(run, victim, draw)
    code = run.finish()
    struck = worker_struck or code == -signal.SIGKILL  # or it was leaving, with 0
    after, left = scene.served(folder), unfinished(folder)
    whole = damage(folder / "out")
    found = read_store(folder / "out")
    twice = sum(map(len, found.segments)) - len(found.rows)
    resumed = scene.complete(folder)
    now = rows(folder / "out")
    problems = {
        f"the killed run: {code}: {run.text()[-500:]}": code
        != (-signal.SIGKILL if struck and victim != "worker" else 0),
        f"{len(before.keys() - after.keys())} results that were read are lost": not before.keys()
        <= after.keys(),
        f"told of {run.told()} jobs, {len(after)} are stored": len(after) < run.told(),
        "results that were stored are not there": not listed.keys() <= now.keys(),
        "acknowledged results ran again": any(now.get(key) != row for key, row in after.items()),
        f"after the kill: {whole}": whole,
        resumed: resumed,
        f"after resuming: {damage(folder / 'out')}": damage(folder / "out"),
        "differs from an undisturbed study": contents(folder / "out") != scene.whole,
    }
    moment = "after the end" if not struck else "amid the rows" if before else "before any row"
    counts.update([f"{victim} killed", f"killed {moment}"])
    counts["acknowledged results"] += max(len(before), run.told())
    counts["with half-written files"] += bool(left)
    counts["with a merge half done"] += twice > 0 and not scene.kind.upgraded
    return "; ".join(text for text, wrong in problems.items() if wrong)


def campaign(trials, seed, folder):
    """Kill `trials` sweeps, every third of them the real command; trial n has the seed seed + n."""
    tally, scenes = Tally(WHAT, seed), {}
    place = Path(tempfile.mkdtemp(prefix="kill-", dir=folder))
    for own in range(seed, seed + trials):
        draw = random.Random(own)
        name, real = draw.choice(list(KINDS)), own % REAL == 0
        if (name, real) not in scenes:
            scenes[name, real] = Scene(place / f"scene-{len(scenes)}", KINDS[name], real)
        problem = trial(scenes[name, real], place / "trial", draw, tally.counts)
        shutil.rmtree(place / "trial")
        tally.trials += 1
        tally.counts["real commands"] += real
        if problem:
            tally.failures.append(f"seed {own}, {name}{', real' if real else ''}: {problem}")
    shutil.rmtree(place)
    return tally.result()

"""What the campaigns share: small studies, forked processes, what a store holds.

A campaign is a module with WHAT is tried and `trial(place, draw, number, counts)`, which does harm
in an empty folder, as drawn, and returns what went wrong, or "". What trials share lies beside.
"""

import contextlib
import faulthandler
import itertools
import json
import multiprocessing
import signal
import subprocess
import sys
import tempfile
import traceback
from collections import namedtuple
from dataclasses import replace
from functools import cache
from pathlib import Path

from click.testing import CliRunner
from compsim import cli
from stores_compared import contents

from compressor.cases.load import load_studies
from compressor.store.stored import read_store
from compressor.store.studies import read_study, study_paths
from compressor.sweep.worker import End

SWEEP = sys.modules["compressor.sweep.sweep"]  # the function of its name hides it
FORK = multiprocessing.get_context("fork")
SECONDS = 60.0  # in which a trial must end; what hangs takes for ever
FOREIGN = ("case", "name")  # attributes that depend on which of several studies ran a job
LEAN = {  # of a quick job
    "duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9,
    "error_bars": False,
}  # fmt: skip


def rods_file(folder, name, masses, keep="metrics", **solve):
    """A case file of quick big-end jobs, one a rod mass (kg): its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.yaml"
    path.write_text(json.dumps({
        "joint": "big_end", "clearance_mm": 0.1, "machine": {"rod_mass_kg": [*masses]},
        "output": {"keep": keep}, "solve": LEAN | solve,
    }))  # fmt: skip
    return path


@cache
def complete_store(folder):
    """A store with series, metrics and a failed job, its case files, and all that is stored.

    It also compiles and imports what forks need.
    """
    cases = [
        rods_file(folder / "cases", "series", [4, 5], "series"),
        rods_file(folder / "cases", "metrics", [4.1, 4.2, 4.3, 4.4, 4.5, 4.6]),
        rods_file(folder / "cases", "failing", [4.7], max_steps=3),
    ]
    SWEEP.run_job(load_studies(cases[0])[0].cases[0])

    def fill():
        run_here()
        SWEEP.sweep(load_studies(*cases), folder / "complete", 1)

    assert not (ended := forked(fill, 600)).death, ended
    for words in (["plan", *cases], ["status"], ["export", "--force", "-o", folder / "out.csv"]):
        assert command(*words, "-r", folder / "complete").code == 0
    return folder / "complete", cases, whole(folder / "complete")


def whole(folder):
    """All that is stored, studies too; raises StoreError where any is damaged."""
    for error in read_store(folder).damaged:
        raise error
    studies = map(read_study, study_paths(folder))
    return contents(folder) | {one.name: replace(one, written="", command="") for one in studies}


@contextlib.contextmanager
def fresh(folder):
    """An empty folder for a trial, gone after it."""
    with tempfile.TemporaryDirectory(dir=folder, ignore_cleanup_errors=True) as place:
        yield Path(place)


def call(*words, good=(0,)):
    """Call a program; raises RuntimeError with what it says, OSError where it is not installed."""
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode not in good:
        raise RuntimeError(f"{words[0]}: {done.returncode}: {done.stdout}{done.stderr}")


@contextlib.contextmanager
def mounted(place, *words):
    """A file system on a folder, as words of mount say."""
    place.mkdir(exist_ok=True)
    call("mount", *words, place)
    try:
        yield place
    finally:
        call("umount", "-l", place)


# how a forked process ended: what its work gave, or how it died, else ""
Ended = namedtuple("Ended", "result death", defaults=[""])


def forked(work, seconds=SECONDS):
    """Do some work in a process of its own, which may crash or hang."""

    def begin():
        faulthandler.disable()  # of pytest: a death is reported as `Ended.death`
        try:
            theirs.send(Ended(work()))
        except Exception:
            theirs.send(Ended(None, traceback.format_exc()))

    ours, theirs = FORK.Pipe(duplex=False)
    child = FORK.Process(target=begin)
    child.start()
    theirs.close()
    try:
        ended = ours.recv() if ours.poll(seconds) else Ended(None, f"hangs: {seconds:.0f} s")
    except EOFError:
        ended = None
    child.kill()  # where it hangs
    child.join()
    code = child.exitcode
    died = signal.Signals(-code).name if code < 0 else f"exit code {code}"
    return ended or Ended(None, died)


Said = namedtuple("Said", "code out err")  # by a command


def command(*words):
    """What a command says, run in this process."""
    with CliRunner().isolation() as (out, err, _):
        code = cli.main([*map(str, words)])
        return Said(code, out.getvalue().decode(), err.getvalue().decode())


def run_here(size=2, stored=len):
    """Have sweeps run their jobs in this process, in batches; `stored` gets the keys of each."""

    def run_batches(work, jobs, workers, store):
        left = iter(jobs)
        while batch := [*itertools.islice(left, size)]:
            ends = store([work(job[1]) for job in batch])
            stored([job[0] for job in batch])
            yield from (End(job[0], end, 0.01) for job, end in zip(batch, ends, strict=True))

    SWEEP.run_batches = run_batches

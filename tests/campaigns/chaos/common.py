"""What the campaigns on files share: a small store, commands in forked processes, what it holds."""

import contextlib
import dataclasses
import faulthandler
import itertools
import json
import multiprocessing
import os
import shutil
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from click.testing import CliRunner
from compsim import cli

from compressor.cases.load import load_studies
from compressor.store.reader import open_study
from compressor.store.status import standings, verify
from compressor.sweep.worker import JobResult

SWEEP: Any = sys.modules["compressor.sweep.sweep"]  # the function of its name hides it
FORK = multiprocessing.get_context("fork")
SECONDS = 60.0  # in which a trial must end; what hangs takes for ever
SOLVE = {"duration_rev": 0.02, "settle_rev": 0, "output_step_deg": 0.72, "accuracy": "draft",
         "error_bars": False}  # fmt: skip
STUDIES = {
    "series": {"joint": "big_end", "clearance_mm": [0.1, 0.2]},
    "metrics": {
        "joint": "small_end", "clearance_mm": [0.1, 0.2, 0.3], "machine": {"rod_mass_kg": [4, 5]},
        "output": {"keep": "metrics"},
    },
    "failing": {
        "joint": "both", "clearance_mm": 0.1, "solve": {"max_steps": 3},
        "output": {"keep": "metrics"},
    },
}  # fmt: skip
TIMINGS = {"seconds"}  # what differs between two runs of a job


class Ended(NamedTuple):
    """How a forked process ended: what its work gave, or how it died."""

    result: Any
    death: str = ""  # "" where it gave a result


class Said(NamedTuple):
    """What a command said."""

    code: int
    out: str
    err: str


def run_here(size: int = 2, stored: Callable[[list[Any]], object] = len) -> None:
    """Have sweeps run their jobs in this process, in batches; `stored` gets the keys of each."""

    def run_batches(work: Any, jobs: Any, workers: Any, store: Any) -> Iterator[JobResult]:
        left = iter(jobs)
        while batch := [*itertools.islice(left, size)]:
            ends = store([work(job[1]) for job in batch])
            stored([job[0] for job in batch])
            yield from (JobResult(job[0], end, 0.01) for job, end in zip(batch, ends, strict=True))

    SWEEP.run_batches = run_batches


def complete_store(folder: Path) -> Path:
    """A store with all jobs of `STUDIES`; compiles all that forked processes need."""
    place = folder / "complete"

    def fill() -> None:
        run_here()
        SWEEP.sweep(load_studies(*case_files(folder / "cases")), place, 1)

    SWEEP.run_job(load_studies(*case_files(folder / "cases"))[0].cases[0])
    assert not (ended := forked(fill, 600)).death, ended
    return place


def case_files(folder: Path, studies: dict[str, Any] = STUDIES) -> list[Path]:
    """The case files of studies in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, values in studies.items():
        text = json.dumps(values | {"solve": SOLVE | values.get("solve", {})})
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return [folder / f"{name}.yaml" for name in studies]


def forked(work: Callable[[], Any], seconds: float = SECONDS) -> Ended:
    """Do some work in a process of its own, which may crash or hang."""

    def begin() -> None:
        os.setpgid(0, 0)
        faulthandler.disable()  # of pytest: a death is reported as `Ended.death`
        try:
            theirs.send(Ended(work()))
        except Exception:
            theirs.send(Ended(None, traceback.format_exc()))

    ours, theirs = FORK.Pipe(duplex=False)
    child: Any = FORK.Process(target=begin)
    child.start()
    theirs.close()
    ended = None
    with contextlib.suppress(EOFError):
        ended = ours.recv() if ours.poll(seconds) else Ended(None, f"hangs: {seconds:.0f} s")
    if ended and ended.death.startswith("hangs"):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)
    child.join()
    code = child.exitcode
    died = signal.Signals(-code).name if code < 0 else f"exit code {code}"
    return ended or Ended(None, died)


def command(*arguments: object) -> Said:
    """What a command says, run in this process."""
    with CliRunner().isolation() as (out, err, _):
        code = cli.main([str(argument) for argument in arguments])
        return Said(code, out.getvalue().decode(), err.getvalue().decode())


def contents(folder: Path) -> dict[str, Any]:
    """All that readers find in a store, to the bit, but for timings; `damage`: what `verify` says.

    Raises what they raise, and RuntimeError where they only warn.
    """
    found: dict[str, Any] = {"damage": [str(damage) for damage in verify(folder)]}
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        for standing in standings(folder):
            found[standing.study] = dataclasses.replace(standing, written="")  # when: a timing
            for name, item in open_study(folder, standing.study).load().variables.items():
                if name not in TIMINGS:
                    values = item.values
                    plain = values.tolist() if values.dtype.kind in "OU" else values.tobytes()
                    found[f"{standing.study}/{name}"] = (item.dims, values.shape, plain)
    return found


def differing(found: dict[str, Any], whole: dict[str, Any]) -> str:
    """The names of what differs, "" where nothing does."""
    names = sorted(found.keys() | whole.keys())
    return ", ".join(name for name in names if found.get(name) != whole.get(name))


@contextlib.contextmanager
def fresh(folder: Path, name: str = "trial") -> Iterator[Path]:
    """An empty folder for a trial, gone after it."""
    place = folder / name
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    try:
        yield place
    finally:
        shutil.rmtree(place, ignore_errors=True)

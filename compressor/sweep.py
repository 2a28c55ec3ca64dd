"""Run the jobs of studies that the store does not hold yet, in worker processes.

A worker stores its own job, so that what is finished stays finished however a sweep ends. A run
that fails, or breaks, is a result with a named reason. Only this module imports joblib.
"""

import contextlib
import json
import os
import signal
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

import xarray as xr
from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky.backend import resource_tracker as loky_tracker
from joblib.externals.loky.process_executor import BrokenProcessPool

import compressor
from compressor.case import Case
from compressor.plan import Study
from compressor.store import (
    Folder,
    JobStatus,
    StoreError,
    discard_leftovers,
    job_status,
    known_status,
    points,
    write_job,
    write_study,
)

Progress = Callable[[int, int, str], None]  # jobs done, jobs in all, a remark or ""

PATIENCE = 2.0  # s of compiling before a remark on it
SIGNAL_DELAY = 0.2  # s; what ended a worker may be a signal that is on its way to us, too
COMPILING = "compiling the equations (once per machine, under a minute)"
DIED = "a worker process died: killed from outside, or out of memory (-j 1 needs least)"


class WorkerDied(Exception):
    """A worker process was killed from outside, or crashed."""


@dataclass(frozen=True)
class Failure:
    """A failed job as one study sees it."""

    study: str
    coordinates: dict[str, Any]  # swept key -> value
    key: str
    reason: str
    detail: str


@dataclass(frozen=True)
class Count:
    """How many of a study's jobs ended well."""

    study: str
    jobs: int
    failed: int


@dataclass(frozen=True)
class Summary:
    """What a sweep did; `total`, `done_before` and `run_now` count a shared job once."""

    total: int
    done_before: int
    run_now: int
    counts: tuple[Count, ...]
    failed: tuple[Failure, ...]
    seconds: float


def silent(done: int, total: int, remark: str) -> None:
    """Progress that nobody watches."""


def sweep(
    studies: Sequence[Study],
    folder: Folder,
    workers: int = 2,
    progress: Progress = silent,
    command: str = "",
) -> Summary:
    """Run what is missing of some studies and store it in a folder.

    Raises StoreError, and WorkerDied; whatever ends a sweep early, finished jobs are stored and
    the same call goes on.
    """
    began = time.monotonic()
    folder = Path(folder).absolute()
    for study in studies:
        write_study(folder, study, command)
    discard_leftovers(folder)
    cases = wanted(studies)
    ends = stored(folder, cases)
    missing = [case for key, case in cases.items() if key not in ends]
    before = len(ends)
    if missing:
        progress(before, len(cases), "")
        warm_up(lambda: progress(before, len(cases), COMPILING))
        with contextlib.closing(run_jobs(folder, missing, workers)) as finished:
            for end in finished:
                ends[end.key] = end
                progress(len(ends), len(cases), "")
    counts, failed = outcome(studies, ends)
    seconds = time.monotonic() - began
    return Summary(len(cases), before, len(missing), counts, failed, seconds)


def wanted(studies: Sequence[Study]) -> dict[str, Case]:
    """Each job once, by key; where studies share one, the case that asks for most."""
    cases: dict[str, Case] = {}
    for case in (case for study in studies for case in study.cases):
        cases[case.key] = max(case, cases.get(case.key, case), key=_demand)
    return cases


def _demand(case: Case) -> tuple[bool, float]:
    return case.output.keep == "series", case.solve.timeout_s


def stored(folder: Folder, cases: dict[str, Case]) -> dict[str, JobStatus]:
    """The jobs that need no new run. A damaged file is no stored job: it will be replaced."""
    known = {key: known_status(folder, key) for key in cases}
    return {key: end for key, end in known.items() if end and end.serves(cases[key])}


def outcome(
    studies: Sequence[Study], ends: dict[str, JobStatus]
) -> tuple[tuple[Count, ...], tuple[Failure, ...]]:
    """How each study ended, and every job of it that failed."""
    counts, failures = [], []
    for study in studies:
        failed = [
            Failure(study.name, point, case.key, ends[case.key].reason, ends[case.key].detail)
            for case, point in zip(study.cases, points(study.axes), strict=True)
            if ends[case.key].status != "ok"
        ]
        counts.append(Count(study.name, len(study.cases), len(failed)))
        failures += failed
    return tuple(counts), tuple(failures)


def warm_up(remark: Callable[[], None]) -> None:
    """Compile the equations before the workers start, or each of them would do so."""
    from compressor.simulation import simulate  # needs numba: only where something is simulated

    timer = threading.Timer(PATIENCE, remark)
    timer.daemon = True
    timer.start()
    try:
        solve = {"duration_rev": 0.01, "settle_rev": 0, "output_step_deg": 0.36}
        simulate(Case.from_values({"solve": solve}))
        simulate(Case.from_values({"solve": solve, "joint": "both", "clearance_mm": 0.1}))
    finally:
        timer.cancel()


def run_jobs(
    folder: Folder, cases: Sequence[Case], workers: int
) -> Generator[JobStatus, None, None]:
    """Run cases in worker processes and yield how each ended, in the order in which they end.

    Closing the iterator, or an exception in it, kills the workers.
    """
    count = min(workers, len(cases))
    calls = (delayed(run_job)(os.fspath(folder), case, os.getpid()) for case in cases)
    with parallel_config(backend="loky", inner_max_num_threads=1):
        parallel = Parallel(count, return_as="generator_unordered", max_nbytes=None)
        with terminal_signals_blocked():
            results = parallel(calls)
    try:
        yield from results
    except BrokenProcessPool as error:
        time.sleep(SIGNAL_DELAY)
        raise WorkerDied(DIED) from error
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # joblib warns of what closing early is meant to do
            results.close()


@contextlib.contextmanager
def terminal_signals_blocked() -> Iterator[None]:
    """Processes started here ignore Ctrl-C and a closed terminal: it is ours to end them."""
    for tracker in (resource_tracker, loky_tracker):
        tracker.ensure_running()  # each unblocks SIGINT when it starts
    old = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, old)


def run_job(folder: str, case: Case, parent: int) -> JobStatus:
    """Simulate and store one case, in a worker; whatever breaks is a failed job, too."""
    follow(parent)
    try:
        from compressor.simulation import simulate

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a solver's remarks; what matters is in the result
            write_job(folder, simulate(case))
    except StoreError:
        raise
    except Exception as error:
        write_job(folder, broken(case, error))
    end = job_status(folder, case.key)
    assert end is not None
    return end


def broken(case: Case, error: Exception) -> xr.Dataset:
    """The Dataset of a job whose simulation raised an exception, which is a bug of ours."""
    attributes = {
        "key": case.key,
        "name": case.name,
        "case": json.dumps(case.values(), sort_keys=True),
        "complete": 0,
        "program": f"compsim {compressor.__version__}",
        "detail": f"{type(error).__name__}: {error}",
        "traceback": "".join(traceback.format_exception(error)),
    }
    return xr.Dataset({"status": "failed", "reason": "internal_error"}, attrs=attributes)


@cache
def follow(parent: int) -> None:
    """Have this process end when its parent does, even by SIGKILL."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    if os.getpid() != parent:
        threading.Thread(target=watch, daemon=True).start()

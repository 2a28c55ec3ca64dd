"""Run the jobs of studies that the store does not hold yet, in worker processes.

Workers get batches of jobs, store the time series that are kept, and send home the outcomes; this
process alone writes the rows that make them stored (`compressor.writer`). A run that fails, or
breaks, is a result with a named reason. Only this module imports joblib.
"""

import contextlib
import itertools
import json
import math
import os
import signal
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky.backend import resource_tracker as loky_tracker
from joblib.externals.loky.process_executor import BrokenProcessPool

import compressor
from compressor.case import Case
from compressor.plan import Study
from compressor.schema import ROW, Outcome
from compressor.store import Folder, Stored, StoreError, points, write_series, write_study
from compressor.writer import Writer

Progress = Callable[[int, int, str], None]  # jobs done, jobs in all, a remark or ""

BATCH_SECONDS = 0.2  # of work for a worker at a time
PATIENCE = 2.0  # s of compiling before a remark on it
SIGNAL_DELAY = 0.2  # s; what ended a worker may be a signal that is on its way to us, too
COMPILING = "compiling the equations (once per machine, under a minute)"
DIED = "a worker process died: killed from outside, or out of memory (-j 1 needs least)"


class WorkerDied(Exception):
    """A worker process was killed from outside, or crashed."""


class End(NamedTuple):
    """How a job ended."""

    status: str
    reason: str
    detail: str


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
    retry_failed: bool = False,
) -> Summary:
    """Run what is missing of some studies and store it in a folder; failed jobs only on request.

    Raises StoreError, and WorkerDied; whatever ends a sweep early, finished jobs are stored and
    the same call goes on.
    """
    began = time.monotonic()
    folder = Path(folder).absolute()
    cases = wanted(studies)
    with Writer(folder, command=command) as writer:
        ends = stored(writer.found, cases)
        if retry_failed:
            ends = {key: end for key, end in ends.items() if end.status == "ok"}
        missing = [case for key, case in cases.items() if key not in ends]
        for study in studies:
            write_study(folder, study, command)
        if missing:
            for damage in writer.found.damaged:
                progress(len(ends), len(cases), f"{damage.path}: {damage.problem}")
            run_missing(writer, missing, workers, ends, progress)
    counts, failed = endings(studies, ends)
    seconds = time.monotonic() - began
    return Summary(len(cases), len(cases) - len(missing), len(missing), counts, failed, seconds)


def run_missing(
    writer: Writer, missing: Sequence[Case], workers: int, ends: dict[str, End], progress: Progress
) -> None:
    """Run and store cases; `ends` gains how each ended, `progress` is told of what is on disk."""
    done, total = len(ends), len(ends) + len(missing)

    def tell(acknowledged: Sequence[str]) -> None:
        nonlocal done
        if acknowledged:
            done += len(acknowledged)
            progress(done, total, "")

    progress(done, total, "")
    warm_up(lambda: progress(done, total, COMPILING))
    with contextlib.closing(run_jobs(writer.place, missing, workers)) as batches:
        try:
            for outcome in itertools.chain.from_iterable(batches):
                ends[outcome.key] = End(outcome.status, outcome.reason, outcome.detail)
                tell(writer.add(outcome))
        finally:
            tell(writer.flush())


def wanted(studies: Sequence[Study]) -> dict[str, Case]:
    """Each job once, by key; where studies share one, the case that asks for most."""
    cases: dict[str, Case] = {}
    for case in (case for study in studies for case in study.cases):
        cases[case.key] = max(case, cases.get(case.key, case), key=_demand)
    return cases


def _demand(case: Case) -> tuple[bool, bool, float]:
    output = case.output
    return output.keep == "series", output.precision == "double", case.solve.timeout_s


def stored(store: Stored, cases: dict[str, Case]) -> dict[str, End]:
    """How the jobs ended that need no new run: stored ones that serve, with intact files."""
    found = {}
    positions = store.rows.find(list(cases)).tolist()
    for (key, case), position in zip(cases.items(), positions, strict=True):
        if position >= 0:
            end = store.status_at(position)
            if end.serves(case) and store.rows.intact(position):
                found[key] = End(end.status, end.reason, end.detail)
    return found


def endings(
    studies: Sequence[Study], ends: dict[str, End]
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


class Batches:
    """Cases in batches of about BATCH_SECONDS, by how long the jobs before them took."""

    def __init__(self, cases: Sequence[Case], workers: int):
        self.cases, self.workers = cases, workers
        self.pace = BATCH_SECONDS  # s a job

    def __iter__(self) -> Iterator[Sequence[Case]]:
        begin = 0
        while begin < len(self.cases):
            fair = math.ceil((len(self.cases) - begin) / (2 * self.workers))
            end = begin + max(1, min(fair, round(BATCH_SECONDS / self.pace)))
            yield self.cases[begin:end]
            begin = end

    def learn(self, jobs: int, seconds: float) -> None:
        """Take note of how long a batch took."""
        self.pace += 0.5 * (max(seconds / jobs, 1e-5) - self.pace)


def run_jobs(
    place: Path, cases: Sequence[Case], workers: int
) -> Generator[list[Outcome], None, None]:
    """Run cases in worker processes and yield how they ended, in batches as they end.

    Closing the iterator, or an exception in it, kills the workers.
    """
    count = min(workers, len(cases))
    batches = Batches(cases, count)
    calls = (delayed(timed_batch)(place, batch, os.getpid()) for batch in batches)
    with parallel_config(backend="loky", inner_max_num_threads=1):
        parallel = Parallel(count, return_as="generator_unordered", max_nbytes=None, batch_size=1)
        with terminal_signals_blocked():
            results = parallel(calls)
    try:
        for outcomes, seconds in results:
            batches.learn(len(outcomes), seconds)
            yield outcomes
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


def timed_batch(place: Path, cases: Sequence[Case], parent: int) -> tuple[list[Outcome], float]:
    """`run_batch` in a worker, and how long it took in s."""
    follow(parent)
    began = time.monotonic()
    return run_batch(place, cases), time.monotonic() - began


def run_batch(place: Path, cases: Sequence[Case]) -> list[Outcome]:
    """Simulate cases and store their time series in a place; the rows are left to the Writer."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a solver's remarks; what matters is in the result
        return [run_job(place, case) for case in cases]


def run_job(place: Path, case: Case) -> Outcome:
    """Simulate one case; whatever breaks is a failed job, too."""
    from compressor import simulation  # needs numba: only where something is simulated

    try:
        if case.output.keep == "metrics":
            return simulation.measure(case)
        found, dataset = simulation.observe(case)
        return replace(found, series=write_series(place, dataset, case.output))
    except StoreError:
        raise
    except Exception as error:
        return broken(case, error)


def broken(case: Case, error: Exception) -> Outcome:
    """The outcome of a job whose simulation raised an exception, which is a bug of ours."""
    attributes = {
        "key": case.key,
        "physics_key": case.physics_key,
        "name": case.name,
        "case": json.dumps(case.values(), sort_keys=True),
        "complete": 0,
        "program": f"compsim {compressor.__version__}",
        "detail": f"{type(error).__name__}: {error}",
        "traceback": "".join(traceback.format_exception(error)),
    }
    return Outcome("failed", "internal_error", np.full(1, math.nan, ROW)[0], attributes)


@cache
def follow(parent: int) -> None:
    """Have this process end when its parent does, even by SIGKILL."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    if os.getpid() != parent:
        threading.Thread(target=watch, daemon=True).start()

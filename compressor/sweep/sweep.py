"""Run the jobs of studies that the store does not hold yet, in worker processes.

Workers (`execution`, or those of a `cluster`) store the time series that are
kept and send home the outcomes; this process alone writes the rows that make them stored
(`Writer`). A run that fails, breaks, or takes its worker with it, is a result with a
named reason.
"""

import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from compressor.cases import Case, Study, points
from compressor.outcome import Outcome, without_run
from compressor.program import Progress, no_progress
from compressor.reasons import Reason
from compressor.store import Folder, StoreError, Writer, write_study
from compressor.sweep.execution import Input, drain, require_posix, run_batches
from compressor.sweep.run_job import run_job
from compressor.sweep.wanted import (
    JobEnd,
    PendingCases,
    RequestedJobs,
    stored_ends,
)
from compressor.sweep.warm_up import Needs, compile_once, load
from compressor.sweep.worker import JobLost, JobResult, Workers, describe_error

MANY_JOBS = 100_000  # jobs whose cases take a while to be made
GRACE = 5.0  # s beyond its time in which a job may end by itself, before its worker is killed


class Backend(Protocol):
    """Where jobs run: runs cases whose time series belong in a place, yields how each one ended.

    `remark` is called with what takes time, `pulse` several times a second. An exception that
    is thrown in ends the jobs, and is raised again after the results that had arrived.
    """

    def __call__(
        self,
        place: Path,
        cases: Sequence[Case],
        remark: Callable[[str], None],
        pulse: Callable[[], object],
    ) -> Generator[JobResult | JobLost, None, None]: ...


@dataclass(frozen=True)
class Options:
    """How to sweep.

    command: what the store says that it was made by; rerun_failed: failed jobs count as missing;
    part: (i, n) for shard i of n, which other processes may run at the same time, each its own;
    wait: until another run that writes there has ended; backend: where jobs run, if not here;
    failed: called with the number of failed jobs, before progress is.
    """

    command: str = ""
    rerun_failed: bool = False
    part: tuple[int, int] | None = None
    wait: bool = False
    backend: Backend | None = None
    failed: Callable[[int], object] = lambda count: None


@dataclass(frozen=True)
class JobFailure:
    """A failed job as one study sees it."""

    study: str
    coordinates: dict[str, Any]  # swept key -> value
    key: str
    reason: str
    detail: str


@dataclass(frozen=True)
class JobCount:
    """How many of a study's selected jobs ended well."""

    study: str
    jobs: int
    failed: int


@dataclass(frozen=True)
class Summary:
    """What a sweep did; `total`, `done_before` and `run_now` count a shared job once."""

    total: int
    done_before: int
    run_now: int
    counts: tuple[JobCount, ...]
    failed: tuple[JobFailure, ...]
    seconds: float


def sweep(
    studies: Sequence[Study],
    folder: Folder,
    workers: int = 2,
    progress: Progress = no_progress,
    options: Options | None = None,
) -> Summary:
    """Run what is missing of some studies and store it in a folder; failed jobs only on request.

    workers: processes of this machine. Raises StoreError, and WorkersFailed; whatever ends a sweep
    early, finished jobs are stored and the same call goes on. Raises UnsupportedSystem on Windows.
    """
    require_posix()
    options = options or Options()
    began = time.monotonic()
    folder = Path(folder).absolute()
    name = ""
    if options.part is not None:
        studies = [study.shard(*options.part) for study in studies]
        name = "{}-of-{}".format(*options.part)
    jobs = sum(len(study.selected) for study in studies)
    if jobs > MANY_JOBS:
        progress(0, jobs, f"preparing {jobs} jobs")
    cases = RequestedJobs(studies)
    with Writer(folder, name, options.wait, options.command) as writer:
        if writer.unowned:
            files = (
                f"{writer.place / 'jobs'}: no row knows the jobs of {writer.unowned} of its files"
            )
            progress(0, len(cases), f"{files}; they stay, and compsim verify shows what to do")
        ends = stored_ends(writer.found, cases)
        if options.rerun_failed:
            ends = {key: end for key, end in ends.items() if end.status == "ok"}
        missing = PendingCases(cases, [key for key in cases if key not in ends])
        for study in studies:
            write_study(folder, study, options.command, writer.found.keys)
        if missing:
            for damage in writer.found.damaged:
                progress(len(ends), len(cases), f"{damage.path}: {damage.problem}")
            running = options.backend or local(workers)
            run_missing(writer, missing, running, ends, (progress, options.failed))
    counts, failed = endings(studies, ends)
    return Summary(
        len(cases), len(cases) - len(missing), len(missing), counts, failed,
        time.monotonic() - began,
    )  # fmt: skip


def run_missing(
    writer: Writer,
    missing: Sequence[Case],
    backend: Backend,
    ends: dict[str, JobEnd],
    watchers: tuple[Progress, Callable[[int], object]],
) -> None:
    """Run and store cases; `ends` gains how each ended.

    watchers: progress, called with what is on disk, and what is called with the failed ones.
    """
    progress, tell_failed = watchers
    done, total = len(ends), len(ends) + len(missing)
    failed = sum(end.status != "ok" for end in ends.values())

    def acknowledge(keys: Sequence[str]) -> None:
        nonlocal done, failed
        if keys:
            done += len(keys)
            failed += sum(ends[key].status != "ok" for key in keys)
            tell_failed(failed)
            progress(done, total, "")

    def beat() -> None:
        acknowledge(writer.flush_if_due())

    def store(end: JobResult | JobLost) -> None:
        outcome = outcome_of(end)
        ends[outcome.key] = JobEnd(outcome.status, outcome.reason, outcome.detail)
        acknowledge(writer.add(outcome))

    tell_failed(failed)
    progress(done, total, "")
    running = backend(writer.place, missing, lambda text: progress(done, total, text), beat)
    try:
        for end in running:
            store(end)
    except BaseException as error:
        for end in drain(running, error):  # which raises it again
            store(end)
    finally:
        running.close()
        acknowledge(writer.flush())


def local(workers: int) -> Backend:
    """Return the worker processes of this machine."""

    def run(
        place: Path,
        cases: Sequence[Case],
        remark: Callable[[str], None],
        pulse: Callable[[], object],
    ) -> Generator[JobResult | JobLost, None, None]:
        needs, work = Needs.of(cases), partial(run_job, place)
        return run_here(work, LazyCases(cases), needs, workers, remark, pulse)

    return run


def in_this_process(
    place: Path,
    cases: Sequence[Case],
    remark: Callable[[str], None],
    pulse: Callable[[], object],
) -> Generator[JobResult | JobLost, None, None]:
    """Yield how jobs end in this process, one after the other; the backend for a few short ones.

    Starting workers takes longer than they do. A job that ends its process ends the sweep; one that
    raises an exception is lost, as in a worker.
    """
    compile_once(Needs.of(cases), remark)
    for case in cases:
        began = time.monotonic()
        try:
            result = run_job(place, case)
        except Exception as error:
            yield JobLost(case, Reason.INTERNAL_ERROR, *describe_error(error))
        else:
            yield JobResult(case, result, time.monotonic() - began)
        pulse()


def run_here(
    work: Callable[[Any], Any],
    jobs: Sequence[Input],
    needs: Needs,
    workers: int,
    remark: Callable[[str], None],
    pulse: Callable[[], object] = lambda: None,
) -> Generator[JobResult | JobLost, None, None]:
    """Return the generator of how jobs end in processes here, which load the equations first.

    They are compiled before, if there is a job. Raises what `run_batches` raises, and
    UnsupportedSystem on Windows.
    """
    require_posix()
    if jobs:
        compile_once(needs, remark)
    return run_batches(work, jobs, Workers(workers, partial(load, needs), grace=GRACE), pulse)


class LazyCases(Sequence[Any]):
    """Cases as workers take them, each made when it is taken."""

    def __init__(self, cases: Sequence[Case]):
        self.cases = cases

    def __len__(self) -> int:
        return len(self.cases)

    def __getitem__(self, index: Any) -> Any:
        case = self.cases[index]
        return case, case, case.solve.timeout_s


def endings(
    studies: Sequence[Study], ends: dict[str, JobEnd]
) -> tuple[tuple[JobCount, ...], tuple[JobFailure, ...]]:
    """Return how the selected jobs of each study ended, and every one that failed."""
    counts, failures = [], []
    for study in studies:
        selected = {*study.selected}
        failed = [
            JobFailure(study.name, point, key, ends[key].reason, ends[key].detail)
            for number, point in enumerate(points(study))
            if number in selected and ends[key := study.keys[number]].status != "ok"
        ]
        counts.append(JobCount(study.name, len(selected), len(failed)))
        failures += failed
    return tuple(counts), tuple(failures)


def outcome_of(end: JobResult | JobLost) -> Outcome:
    """Return the outcome of a job, also of one that raised an exception or lost its worker."""
    if isinstance(end, JobResult):
        if isinstance(end.result, StoreError):
            raise end.result
        return end.result
    more = {"traceback": end.traceback} if end.traceback else {}
    return without_run(end.id.attributes(), end.reason, end.detail, **more)

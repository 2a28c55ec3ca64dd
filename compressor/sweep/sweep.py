"""Run the jobs of studies that the store does not hold yet, in worker processes.

A worker writes the batch of jobs that it has run, which makes them stored, and sends home how they
ended. A run that fails, breaks, or takes its worker with it, is a result with a named reason.
"""

import time
from collections.abc import Callable, Container, Generator, Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from compressor.cases import Case, Study, points
from compressor.outcome import Outcome, without_run
from compressor.program import Progress, ignore_warnings, no_progress
from compressor.store import (
    Folder,
    FolderLost,
    Stored,
    encode_batch,
    make_batches,
    merge_batches,
    publish_batch,
    read_store,
    serving_both,
    write_study,
)
from compressor.sweep.pool import Input, Workers, cores, require_posix, run_batches
from compressor.sweep.warm_up import Part, compile_once, load, needed_parts
from compressor.sweep.worker import End, Store, attempt, store_results

GRACE = 5.0  # s beyond its time in which a job may end by itself, before its worker is killed
REPORT_SECONDS = 0.1  # s between two reports of progress, or more


class JobEnd(NamedTuple):
    """How a job ended."""

    status: str
    reason: str = ""
    detail: str = ""

    @classmethod
    def of(cls, outcome: Outcome) -> "JobEnd":
        return cls(outcome.status, outcome.reason, outcome.detail)


class RequestedJobs:
    """Jobs of studies, each once, by key; a case is built when it is used, since many take much.

    Where studies share a job, its case serves them all. Iterating gives jobs as workers take them:
    key, case and the time that it may take. `own`: cases that are shared, or were changed in what
    is no part of their key.
    """

    def __init__(self, studies: Sequence[Study]):
        self.places: dict[str, tuple[Study, int]] = {}
        self.own: dict[str, Case] = {}
        for study in studies:
            for number in study.selected:
                key = study.keys[number]
                if key in self.places:
                    self.own[key] = serving_both(self[key], study.cases[number])
                else:
                    self.places[key] = study, number

    def among(self, keys: Container[str]) -> "RequestedJobs":
        """Return those jobs with some keys."""
        found = RequestedJobs(())
        found.places = {key: place for key, place in self.places.items() if key in keys}
        found.own = self.own
        return found

    def __getitem__(self, key: str) -> Case:
        if key in self.own:
            return self.own[key]
        study, number = self.places[key]
        return study.cases[number]

    def __len__(self) -> int:
        return len(self.places)

    def __iter__(self) -> Iterator[Input]:
        return ((case.key, case, case.solve.timeout_s) for case in self.cases())

    def cases(self) -> Iterator[Case]:
        """Yield the cases of the jobs."""
        return (self[key] for key in self.places)

    def stored_ends(self, stored: Stored) -> dict[str, JobEnd]:
        """Return how the jobs ended that need no new run: stored ones that serve, and are intact.

        A case whose job is to be run again goes on keeping the time series that its job has, as
        exact as they are.
        """
        found: dict[str, JobEnd] = {}
        verdicts: dict[Hashable, bool] = {}  # by what a verdict depends on
        studies = {study.name: study for study, _ in self.places.values()}
        shared = {name for name, study in studies.items() if study.is_of_one_solver}
        columns = (stored.columns[name].tolist() for name in ("status", "reason", "kept"))
        ends = [*zip(*columns, strict=True)]
        positions = stored.find([*self.places]).tolist()
        for (key, (study, _)), position in zip(self.places.items(), positions, strict=True):
            if position < 0:
                continue
            kind = study.name if study.name in shared and key not in self.own else key
            about = kind, ends[position]
            if about not in verdicts:
                verdicts[about] = stored.status_at(position).satisfies(self[key])
            if not (verdicts[about] and stored.intact(position)):
                self.own[key] = stored.status_at(position).with_stored_outputs(self[key])
            elif ends[position][0] == b"ok":
                found[key] = JobEnd("ok")
            else:
                status, reason, _ = ends[position]
                found[key] = JobEnd(status.decode(), reason.decode(), stored.detail(position))
        return found


# Where jobs run: runs cases, the payloads of jobs, stores their outcomes in a folder of results,
# and yields how each job ended, with a JobEnd as its result; but lost ones are stored by the sweep.
# The last argument is called with what takes time.
Backend = Callable[[Path, RequestedJobs, Callable[[str], None]], Generator[End, None, None]]


@dataclass(frozen=True)
class JobFailure:
    """A failed job as one study sees it."""

    study: str
    coordinates: dict[str, Any]  # swept key -> value
    key: str
    reason: str
    detail: str


@dataclass(frozen=True)
class Summary:
    """What a sweep did; `done_before` and `run_now` count a shared job once."""

    done_before: int
    run_now: int
    counts: dict[str, int]  # selected jobs by study
    failed: tuple[JobFailure, ...]
    seconds: float


def sweep(
    studies: Sequence[Study],
    folder: Folder,
    workers: int = 2,
    progress: Progress = no_progress,
    command: str = "",
    overrides: Sequence[str] = (),
    rerun_failed: bool = False,
    backend: Backend | None = None,
    failed: Callable[[int], object] = lambda count: None,
) -> Summary:
    """Run what is missing of some studies and store it in a folder.

    workers: processes of this machine; command: what the store says that it was made by; overrides:
    KEY=VALUE that it set in the case files; rerun_failed: failed jobs count as missing; backend:
    where jobs run, if not here; failed: called with the number of failed jobs, before progress is.
    Raises StoreError, and WorkersFailed; whatever ends a sweep early, finished jobs are stored and
    the same call goes on. Raises UnsupportedSystem on Windows.
    """
    require_posix()
    began = time.monotonic()
    folder = Path(folder).absolute()
    wanted, stored = RequestedJobs(studies), read_store(folder)
    ends = wanted.stored_ends(stored)
    if rerun_failed:
        ends = {key: end for key, end in ends.items() if end.status == "ok"}
    missing = wanted.among(wanted.places.keys() - ends.keys())
    make_batches(folder)
    for study in studies:
        write_study(folder, study, command, overrides)
    if missing:
        for damage in stored.damaged:
            progress(len(ends), len(wanted), f"{damage}: its jobs count as missing")
        run_missing(folder, missing, ends, workers, progress, backend, failed)
    if missing or stored.damaged:
        held = merge_batches(folder)
        files = (folder / "studies" / f"{study.name}.json" for study in studies)
        if not (ends.keys() <= held and all(file.exists() for file in files)):
            raise FolderLost(folder)
    counts = {study.name: len(study.selected) for study in studies}
    failures, seconds = list_failures(studies, ends), time.monotonic() - began
    return Summary(len(wanted) - len(missing), len(missing), counts, failures, seconds)


def run_missing(
    folder: Path,
    jobs: RequestedJobs,
    ends: dict[str, JobEnd],
    workers: int,
    progress: Progress,
    backend: Backend | None,
    tell_failed: Callable[[int], object],
) -> None:
    """Run and store jobs; `ends` gains how each ended. Progress counts those that are stored."""
    total = len(ends) + len(jobs)
    failed = sum(end.status != "ok" for end in ends.values())
    told = -REPORT_SECONDS

    def tell(text: str = "") -> None:
        nonlocal told
        told = time.monotonic()
        tell_failed(failed)
        progress(len(ends), total, text)

    tell()
    if backend:
        running = backend(folder, jobs, tell)
    else:
        parts, store = needed_parts(jobs.cases()), partial(store_outcomes, folder)
        running = run_here(run_job, jobs, parts, workers, tell, store)
    try:
        for end in running:
            if end.reason:
                ends[end.id] = store_lost(folder, jobs[end.id], end)
            else:
                ends[end.id] = end.result
            failed += ends[end.id].status != "ok"
            if time.monotonic() - told > REPORT_SECONDS or len(ends) == total:
                tell()
    finally:
        running.close()


def store_lost(folder: Path, case: Case, end: End) -> JobEnd:
    """Store that a job has no result; return how it ended."""
    more = {"traceback": end.traceback} if end.traceback else {}
    outcome = without_run(case.attributes(), end.reason, end.detail, **more)
    return store_outcomes(folder, [outcome])[0]


def run_job(case: Case) -> Outcome:
    """Simulate a case, in a worker."""
    from compressor.solve import observe  # needs numba: only to simulate

    with ignore_warnings():  # a solver's remarks; what matters is in the result
        outcome, series = observe(case)
    return outcome.with_series(series, case.output.precision) if series else outcome


def store_outcomes(folder: Path, outcomes: Sequence[Outcome]) -> list[JobEnd]:
    """Store the outcomes of a batch of jobs; return how each ended. Raises StoreError."""
    publish_batch(folder, encode_batch(outcomes))
    return [JobEnd.of(outcome) for outcome in outcomes]


def in_this_process(
    folder: Path, jobs: RequestedJobs, remark: Callable[[str], None]
) -> Generator[End, None, None]:
    """Yield how jobs end that have run in this process; the backend for a few short ones.

    Starting workers takes longer than they do. A job that ends its process ends the sweep; one that
    raises an exception is lost, as in a worker.
    """
    compile_once(needed_parts(jobs.cases()), remark, cores())
    ran = [attempt(run_job, case) for case in jobs.cases()]
    ends = store_results(partial(store_outcomes, folder), ran)
    yield from (end._replace(id=key) for key, end in zip(jobs.places, ends, strict=True))


def run_here(
    work: Callable[[Any], Any],
    jobs: RequestedJobs | Sequence[Input],
    parts: tuple[Part, ...],
    workers: int,
    remark: Callable[[str], None],
    store: Store | None = None,
) -> Generator[End, None, None]:
    """Return the generator of how jobs end in processes here, which load the equations first.

    They are compiled before, if there is a job. Raises what `run_batches` raises, and
    UnsupportedSystem on Windows.
    """
    require_posix()
    if jobs:
        compile_once(parts, remark, workers)
    return run_batches(work, jobs, Workers(workers, partial(load, parts), grace=GRACE), store)


def list_failures(studies: Sequence[Study], ends: dict[str, JobEnd]) -> tuple[JobFailure, ...]:
    """Return every selected job of studies that failed."""
    failures: list[JobFailure] = []
    for study in studies:
        selected = {*study.selected}
        failures += [
            JobFailure(study.name, point, key, ends[key].reason, ends[key].detail)
            for number, (key, point) in enumerate(zip(study.keys, points(study), strict=True))
            if number in selected and ends[key].status != "ok"
        ]
    return tuple(failures)

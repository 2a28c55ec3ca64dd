"""The jobs that studies want, each once, how those stored ended, and how a sweep stands.

How a sweep stands, and how long it will still take: from what its own jobs have taken. Jobs of one
kind, by joints, method and accuracy, are taken to need the same time for a revolution. What has
been measured of each kind, and how many jobs ran at a time, gives the time that is left. The clock
starts with the first job, so that neither compiling nor the start of workers counts.
"""

import time
from collections.abc import Callable, Container, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, overload

import numpy as np

from compressor.cases import Case, Study
from compressor.store import Stored
from compressor.sweep.worker import JobLost, JobResult


class JobEnd(NamedTuple):
    """How a job ended."""

    status: str
    reason: str
    detail: str


OK_END = JobEnd("ok", "", "")


class RequestedJobs(Mapping[str, Case]):
    """Each selected job once, by key; its case is built when it is used.

    Where studies share a job, its case serves them all. A case can be changed in what is no part of
    its key. among: the keys of those that are wanted, if not all.
    """

    def __init__(self, studies: Sequence[Study], among: Container[str] | None = None):
        self.places: dict[str, tuple[Study, int]] = {}
        self.own: dict[str, Case] = {}  # of jobs that several studies share, or that were changed
        for study in studies:
            for number in study.selected:
                key = study.keys[number]
                if among is not None and key not in among:
                    continue
                if key in self.places:
                    self.own[key] = serving_both(self[key], study.cases[number])
                else:
                    self.places[key] = study, number

    def __getitem__(self, key: str) -> Case:
        if key in self.own:
            return self.own[key]
        study, number = self.places[key]
        return study.cases[number]

    def __setitem__(self, key: str, case: Case) -> None:
        self.own[key] = case

    def __iter__(self) -> Iterator[str]:
        return iter(self.places)

    def __len__(self) -> int:
        return len(self.places)

    def alike(self) -> Iterator[tuple[Case, list[str]]]:
        """Yield a case, and the keys of jobs whose `solve` and `output` are equal to its own."""
        found: dict[Hashable, list[str]] = {}
        for key, (study, number) in self.places.items():
            kind = key if key in self.own else (study.name, study.solver_of(number))
            found.setdefault(kind, []).append(key)
        for keys in found.values():
            yield self[keys[0]], keys


class PendingCases(Sequence[Case]):
    """The cases of some requested jobs, each built when it is used: many take much memory."""

    def __init__(self, wanted: RequestedJobs, keys: Sequence[str]):
        self.wanted, self.keys = wanted, keys

    def __len__(self) -> int:
        return len(self.keys)

    @overload
    def __getitem__(self, index: int) -> Case: ...
    @overload
    def __getitem__(self, index: slice) -> "PendingCases": ...
    def __getitem__(self, index: int | slice) -> "Case | PendingCases":
        if isinstance(index, slice):
            return PendingCases(self.wanted, self.keys[index])
        return self.wanted[self.keys[index]]


def serving_both(first: Case, second: Case) -> Case:
    """Return a case with all that two cases of one key ask for beside it."""
    keeping = [case.output for case in (first, second) if case.output.keep == "series"]
    output = replace(first.output, signals=first.output.signals or second.output.signals)
    if keeping:
        precision = max("single", *(o.precision for o in keeping), key=("single", "double").index)
        compress = all(o.compress for o in keeping)
        output = replace(output, keep="series", precision=precision, compress=compress)
    solve = replace(
        first.solve,
        error_bars=first.solve.error_bars or second.solve.error_bars,
        horizon=max(first.solve.horizon, second.solve.horizon, key=(False, "auto", True).index),
        timeout_s=max(first.solve.timeout_s, second.solve.timeout_s),
    )
    return replace(first, output=output, solve=solve)


def stored_ends(store: Stored, wanted: RequestedJobs) -> dict[str, JobEnd]:
    """Return how the jobs ended that need no new run: stored ones that serve, with intact files.

    A case whose job is to be run again goes on keeping the time series that its job has, as exact
    as they are.
    """
    found: dict[str, JobEnd] = {}
    rows = store.rows
    for case, keys in [*wanted.alike()]:
        places = rows.find(keys)
        indices = np.flatnonzero(places >= 0)
        satisfied = store.serving(places[indices], case)
        for at, position, serves in zip(
            indices.tolist(), places[indices].tolist(), satisfied.tolist(), strict=True
        ):
            key = keys[at]
            if serves and rows.intact(position):
                found[key] = OK_END
                if rows.columns["status"][position] != b"ok":
                    end = store.status_at(position)
                    found[key] = JobEnd(end.status, end.reason, end.detail)
            else:
                wanted[key] = store.status_at(position).with_stored_outputs(wanted[key])
    return found


MIN_JOBS_FOR_ETA = 5  # jobs that a guess rests on
MIN_SECONDS_FOR_ETA = 1.0  # s of work before there is one
MIN_MEASURED_SHARE = 0.5  # of the revolutions ahead must be of kinds that are measured


class SweepProgress(NamedTuple):
    """The progress of a sweep.

    done, failed, total: jobs, those stored before among them; failed ones are done, too. left: s
    until the end, None as long as that is not known; at_least: kinds of jobs are ahead that were
    not measured yet, so that it will take longer.
    """

    done: int
    failed: int
    total: int
    left: float | None = None
    at_least: bool = False


class RemainingWork(NamedTuple):
    """Seconds of work that are left, and whether unmeasured kinds come on top of them."""

    seconds: float
    at_least: bool


class SweepWork:
    """The work of a sweep: revolutions ahead, and what those behind have taken, by kind."""

    def __init__(self, cases: Iterable[Case], clock: Callable[[], float] = time.monotonic):
        self.clock = clock
        self.ahead: dict[Hashable, float] = {}  # revolutions
        self.behind: dict[Hashable, tuple[float, float]] = {}  # revolutions, s
        self.ends, self.seconds = 0, 0.0  # of jobs that were measured
        self.began = self.last = 0.0  # the first one's start; the last one's end
        for case in cases:
            self.ahead[kind(case)] = self.ahead.get(kind(case), 0.0) + revolutions(case)

    def add(self, end: JobResult | JobLost) -> None:
        """Count a job that has ended; the time of one that was lost is not known."""
        of, turns = kind(end.id), revolutions(end.id)
        self.ahead[of] = max(0.0, self.ahead[of] - turns)
        if isinstance(end, JobLost):
            return
        self.last = self.clock()
        if not self.ends:
            self.began = self.last - end.seconds
        self.ends += 1
        self.seconds += end.seconds
        known, took = self.behind.get(of, (0.0, 0.0))
        self.behind[of] = known + turns, took + end.seconds

    def left(self) -> RemainingWork | None:
        """Return what is left to do; None as long as too little is known to say."""
        elapsed = self.last - self.began
        if self.ends < MIN_JOBS_FOR_ETA or elapsed < MIN_SECONDS_FOR_ETA or not self.seconds:
            return None
        unknown = sum(turns for of, turns in self.ahead.items() if of not in self.behind)
        if unknown > (1.0 - MIN_MEASURED_SHARE) * sum(self.ahead.values()):
            return None
        seconds = sum(
            turns * self.behind[of][1] / self.behind[of][0]
            for of, turns in self.ahead.items()
            if of in self.behind
        )
        at_once = self.seconds / elapsed  # jobs at work at a time, in the mean
        since = self.clock() - self.last
        return RemainingWork(max(0.0, seconds / at_once - since), unknown > 0)


def kind(case: Case) -> Hashable:
    """Return what jobs that take about the same time for a revolution have in common."""
    how = case.solve
    return case.joint, how.method, how.accuracy, how.rtol, case.wants_bars, how.horizon


def revolutions(case: Case) -> float:
    """Return how many revolutions a run of a case is, at most."""
    return case.duration / case.turn

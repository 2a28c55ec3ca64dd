"""How a sweep stands, and how long it will still take: from what its own jobs have taken.

Jobs of one kind, by joints, method and accuracy, are taken to need the same time for a revolution.
What has been measured of each kind, and how many jobs ran at a time, gives the time that is left.
The clock starts with the first job, so that neither compiling nor the start of workers counts.
"""

import time
from collections.abc import Callable, Hashable, Iterable
from typing import NamedTuple

from compressor.cases import Case
from compressor.sweep.worker import Done, Lost

FEWEST = 5  # jobs that a guess rests on
SOONEST = 1.0  # s of work before there is one
KNOWN = 0.5  # of the revolutions ahead must be of kinds that are measured


class Now(NamedTuple):
    """How a sweep stands.

    done, failed, total: jobs, those stored before among them; failed ones are done, too. left: s
    until the end, None as long as that is not known; at_least: kinds of jobs are ahead that were
    not measured yet, so that it will take longer.
    """

    done: int
    failed: int
    total: int
    left: float | None = None
    at_least: bool = False


class Left(NamedTuple):
    """Seconds of work that are left, and whether unmeasured kinds come on top of them."""

    seconds: float
    at_least: bool


class Work:
    """The work of a sweep: revolutions ahead, and what those behind have taken, by kind."""

    def __init__(self, cases: Iterable[Case], clock: Callable[[], float] = time.monotonic):
        self.clock = clock
        self.ahead: dict[Hashable, float] = {}  # revolutions
        self.behind: dict[Hashable, tuple[float, float]] = {}  # revolutions, s
        self.ends, self.seconds = 0, 0.0  # of jobs that were measured
        self.began = self.last = 0.0  # the first one's start; the last one's end
        for case in cases:
            self.ahead[kind(case)] = self.ahead.get(kind(case), 0.0) + revolutions(case)

    def add(self, end: Done | Lost) -> None:
        """A job has ended; one that was lost tells nothing of the others."""
        of, turns = kind(end.id), revolutions(end.id)
        self.ahead[of] = max(0.0, self.ahead[of] - turns)
        if isinstance(end, Lost):
            return
        self.last = self.clock()
        if not self.ends:
            self.began = self.last - end.seconds
        self.ends += 1
        self.seconds += end.seconds
        known, took = self.behind.get(of, (0.0, 0.0))
        self.behind[of] = known + turns, took + end.seconds

    def left(self) -> Left | None:
        """Return what is left to do; None as long as too little is known to say."""
        elapsed = self.last - self.began
        if self.ends < FEWEST or elapsed < SOONEST or not self.seconds:
            return None
        unknown = sum(turns for of, turns in self.ahead.items() if of not in self.behind)
        if unknown > (1.0 - KNOWN) * sum(self.ahead.values()):
            return None
        seconds = sum(
            turns * self.behind[of][1] / self.behind[of][0]
            for of, turns in self.ahead.items()
            if of in self.behind
        )
        at_once = self.seconds / elapsed
        since = self.clock() - self.last
        return Left(max(0.0, seconds / at_once - since), unknown > 0)


def kind(case: Case) -> Hashable:
    """Return what jobs that take about the same time for a revolution have in common."""
    how = case.solve
    return case.joint, how.method, how.accuracy, how.rtol, case.wants_bars, how.horizon


def revolutions(case: Case) -> float:
    """Return how many revolutions a run of a case is, at most."""
    return case.duration / case.turn

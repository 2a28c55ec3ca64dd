"""How long a motion can be foretold: the time in which close motions part.

Beyond it two correct solutions differ by more than any error bar, so that a number that depends on
the course of the motion has none; statistics still have a meaning. Two runs are compared, one with
its journals shifted, each with steps of its own, at a tolerance of their own: their errors must be
small beside the shift that is followed. At 3e-13 the horizons of 14 of 16 clearances of the
machine of tests/solve/test_horizon.py were those at 1e-13 to a hundredth, two others' to a tenth;
at 1e-12 only seven were.
"""

import math
import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from compressor.cases import Case
from compressor.physics import COLUMNS, Coordinate, is_featured
from compressor.reasons import Reason
from compressor.solve.request import Request, Trajectory
from compressor.solve.run import integrate
from compressor.solve.series import block, rows_of
from compressor.solve.si_record import initial_state, is_ideal, record

SHIFT = 1e-9  # of the clearance: how far from the motion the other one starts
PARTED_DISTANCE = 1e-2  # of the clearance: how far apart they are no longer one motion
HORIZON_RTOL = 3e-13  # of both runs, whatever the case has
LOOKS_PER_REV = 720  # at which the two are compared
FIRST_SPAN_REV, SPAN_GROWTH = 0.5, 4.0  # most chaotic motions part early: short runs come first


def predictability_horizon(
    case: Case, timeout: float = math.inf, rtol: float = HORIZON_RTOL, shift: float = SHIFT
) -> float:
    """Return the time (s) until a motion shifted by 1e-9 of the clearance is 1 % of it away.

    The journal of each joint with clearance is shifted, as much along x as along y; the distance
    is that of the eccentricities at the worse joint, or of the crosshead in a guide with play, at
    every half degree. inf where the two are still close at the end of the case, or the joints are
    ideal. Where a run stops before, as by `timeout` (s) or the case's max_steps, the time up to
    there: no more is known.
    The case's own method and tolerance do not count: the horizon belongs to the motion.
    """
    found = compare_shifted(case, case.duration, rtol, shift, timeout)
    return math.inf if found.whole else found.time


class Parting(NamedTuple):
    """Up to when (s) two motions were compared, whether they parted there, or came to the end.

    `evaluations`: of all runs.
    """

    time: float
    parted: bool
    whole: bool
    evaluations: int = 0


def compare_shifted(case: Case, end: float, rtol: float, shift: float, timeout: float) -> Parting:
    """Compare a motion with one that is shifted, over ever longer spans up to an end (s).

    Each run of a span has the case's max_steps; all of them a wall time (s).
    """
    if is_ideal(case):
        return Parting(end, False, True)
    p, evaluations, deadline = record(case), 0, time.monotonic() + timeout
    starts = [
        initial_state(case, p, part * p["clearance"][:, None] / math.sqrt(2.0))
        for part in (0.0, shift)
    ]
    if is_featured(p) and p["tilting"]:
        starts[1][p["at"][Coordinate.GUIDE]] += shift * p["guide_clearance"]
    span = min(FIRST_SPAN_REV * case.turn, end)
    while True:
        times = np.linspace(0.0, span, math.ceil(LOOKS_PER_REV * span / case.turn) + 1)
        runs = []
        for start in starts:
            left, most = deadline - time.monotonic(), case.solve.max_steps
            runs.append(integrate(Request(p, start, times, 0.0, rtol, "auto", most, left)))
        evaluations += sum(run.evaluations for run in runs)
        parted = np.flatnonzero(distance_over_clearance(p, *runs) > PARTED_DISTANCE)
        if parted.size:
            return Parting(float(times[parted[0]]), True, False, evaluations)
        if any(run.reason for run in runs):
            reached = min(run.stop_time if run.reason else span for run in runs)
            return Parting(reached, False, False, evaluations)
        if span == end:
            return Parting(end, False, True, evaluations)
        span = min(SPAN_GROWTH * span, end)


def distance_over_clearance(p: np.record, one: Trajectory, other: Trajectory) -> np.ndarray:
    """Return the distance of two runs at their times, (m,), as a share of the clearance.

    At the worst joint, or in the guide where it has play; nan where one of them has stopped.
    """
    places = [block("eccentricity", rows_of(p, run, COLUMNS)) for run in (one, other)]
    worn = p["clearance"] > 0.0
    apart = np.linalg.norm(places[1] - places[0], axis=2)[:, worn] / p["clearance"][worn]
    if is_featured(p) and p["tilting"]:
        guide = p["at"][Coordinate.GUIDE]
        across = np.abs(other.states[:, guide] - one.states[:, guide]) / p["guide_clearance"]
        apart = np.column_stack((apart, across))
    return apart.max(axis=1)


WORK = 20.0  # times the evaluations of the first run: for all runs, and again for shifted ones
MIN_WORK = 20_000_000  # evaluations that they may take at least: about 2 s
LOOK_RTOL, LOOK_SHIFT = 1e-9, 1e-6  # of runs that are to tell whether a motion is chaotic
SURE_FACTOR = 10.0  # times tighter: where two motions part, these are to part as well
LATER_FACTOR = 1.5  # times the first horizon, within which they are to


class Search:
    """What the runs of a case took and may take, and what they tell of its horizon.

    The budget counts evaluations of the equations, so that results do not depend on how busy the
    machine is. `horizon`: time (s) at which motions part; inf where they do not, nan as long as
    that is not known; `stopped`: the budget ended the search before that was known. Where metrics
    settle: `settled` (rev), nan where that was not looked for, or not found; `period` (rev), after
    which they agree, nan where that is not known; `unsettled`: why they do not.
    """

    def __init__(self, case: Case):
        self.case = case
        self.began = time.monotonic()
        self.horizon = math.nan
        self.stopped = False
        self.settled = self.period = math.nan
        self.unsettled = ""
        self.first = 0  # evaluations of the first run
        self.evaluations = 0  # of all runs
        self.shifted_evaluations = 0  # of shifted runs, and those beside them
        self.per_step = 1.0  # evaluations of an attempt of a step, in the last run

    @property
    def left(self) -> float:
        """Return the wall time (s) that the case may still take."""
        return self.case.solve.timeout_s - (time.monotonic() - self.began)

    @property
    def work(self) -> float:
        """Return the evaluations that all runs may take together."""
        return max(WORK * self.first, MIN_WORK)

    def count(self, run: Trajectory) -> None:
        """Count the evaluations of a run."""
        self.first = self.first or run.evaluations
        self.evaluations += run.evaluations
        self.per_step = max(run.evaluations / max(run.steps + run.rejected, 1), 1.0)

    def within_budget(self) -> Case:
        """Return the case with no more steps than the budget still allows; all for a first run."""
        return self.limit_steps(self.work - self.evaluations) if self.first else self.case

    def limit_steps(self, evaluations: float) -> Case:
        """Return the case with no more steps than so many evaluations allow."""
        steps = min(self.case.solve.max_steps, max(1, int(evaluations / self.per_step)))
        return replace(self.case, solve=replace(self.case.solve, max_steps=steps))

    def limit_of(self, run: Trajectory) -> str:
        """Return the words for a run that the budget ended, "" for any other."""
        steps = run.steps + run.rejected
        if run.reason != Reason.BUDGET_STEPS or steps >= self.case.solve.max_steps:
            return ""
        return (
            f"more than {self.work:.3g} evaluations in all, the budget of a job's runs; "
            "solve.rtol sets a tolerance without it"
        )

    def parts(self, whole: bool) -> bool:
        """Return whether the motion parts from one that is shifted, as far as is known.

        A short span suffices for most chaotic motions; the whole one is followed only where
        `whole` says so. Where they part, tighter runs are to part there as well.
        """
        case = self.case
        if case.solve.horizon == "auto" and math.isnan(self.horizon) and not self.stopped:
            if self.left <= 0.0:
                self.stopped = True
                return False

            def compare(end: float, rtol: float) -> Parting:
                limited = self.limit_steps((self.work - self.shifted_evaluations) / 2)
                found = compare_shifted(limited, end, rtol, LOOK_SHIFT, self.left)
                self.shifted_evaluations += found.evaluations
                return found

            end = case.duration if whole else min(FIRST_SPAN_REV * case.turn, case.duration)
            found = compare(end, LOOK_RTOL)
            if found.parted:
                end = min(LATER_FACTOR * found.time, case.duration)
                found = compare(end, LOOK_RTOL / SURE_FACTOR)
                self.horizon = found.time if found.parted else math.nan
            elif found.whole and end == case.duration:
                self.horizon = math.inf
            self.stopped = not (found.parted or found.whole)
        return self.horizon < case.duration

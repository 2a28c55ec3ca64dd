"""What the runs of a case may take, how long its motion can be foretold, and when it has settled.

Beyond the time at which two motions that start close to each other part, the horizon, no number of
the course of a motion has an error bar. Two runs are compared, one with its journals shifted, each
with steps of its own, at a tolerance of their own: their errors must be small beside the shift that
is followed. At 3e-13 the horizons of 14 of 16 clearances were those at 1e-13 to a hundredth, at
1e-12 only of seven (tests/solve/test_regime.py).

Where a case leaves to the program from which revolution on metrics count, a run is followed until
those of several revolutions in a row agree within what accuracy promises, a period apart.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from compressor.cases import ACCURACY, Case
from compressor.metrics import METRICS
from compressor.physics import COLUMNS, Coordinate, is_featured, merge_tallies
from compressor.reasons import Reason
from compressor.solve.request import SAME_TIME, Metrics, Request, Trajectory, revolutions
from compressor.solve.run import Solution, integrate, is_sampled, output_times, run_at_tolerance
from compressor.solve.run_metrics import metrics
from compressor.solve.series import block, compared_per_rev, compared_times, distances, rows_of
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

    At the worse joint, or of the crosshead in a guide with play, at every half degree. inf where
    the two are close at the end, or joints are ideal; nan where a run stops before they part. The
    case's own method and tolerance do not count: the horizon belongs to the motion.
    """
    found = compare_shifted(case, case.duration, rtol, shift, timeout)
    return math.inf if found.whole else found.time if found.parted else math.nan


class Parting(NamedTuple):
    """Up to when (s) two motions were compared, whether they parted there, or came to the end."""

    time: float
    parted: bool
    whole: bool
    evaluations: int = 0


def compare_shifted(case: Case, end: float, rtol: float, shift: float, timeout: float) -> Parting:
    """Compare a motion with one that is shifted, over ever longer spans up to an end (s)."""
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
    """Return the distance of two runs, (m,), over the clearance, at the worst joint or guide."""
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
SURE_FACTOR = 100.0  # times tighter: where two motions part, these are to part as well
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

        A short span first; the whole where asked. Where they part, tighter runs are to part as
        well.
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


SAME_REVOLUTION = 1e-9  # relative distance of revolutions that rounding makes


def find_repetition(
    count: int, most: int, is_same: Callable[[int, int], bool], least: int = 1, more: int = 0
) -> tuple[int, int] | None:
    """Return the revolution from which on a motion repeats itself, and its shortest period.

    is_same: of a revolution and a period; as many as a period and `more`, and at least `least`,
    must be the same. None where no period up to `most` does.
    """
    for period in range(1, most + 1):
        first = count - period - max(least, period + more)
        if first >= 0 and all(is_same(k, period) for k in range(first, count - period)):
            return first, period
    return None


def repeats(case: Case, samples: np.ndarray, errors: Metrics) -> tuple[int | None, float]:
    """Return the period of a motion (rev), and the revolution from which on it repeats itself.

    Revolutions are the same if no series is farther apart than both its errors. None and nan
    without.
    """
    per_rev = compared_per_rev(case)
    count = len(samples) // per_rev if per_rev else 0
    turns = [samples[k * per_rev : (k + 1) * per_rev] for k in range(count)]

    def is_same(k: int, period: int) -> bool:
        return all(
            (distance <= 2.0 * np.asarray(errors[name]) + SAME_REVOLUTION).all()
            for name, distance in distances(turns[k], turns[k + period]).items()
        )

    repetition = find_repetition(count, count // 2, is_same)
    if repetition is None:
        return None, math.nan
    first, period = repetition
    while first > 0 and is_same(first - 1, period):
        first -= 1
    return period, case.settle / case.turn + first


MEASURED_REV = 3  # revolutions after settling with `duration_rev: auto`: as the default's
MAX_PERIOD_REV = 4  # rev: period that is looked for
AGREEMENTS = 2  # revolutions in a row, at least, that are to agree with earlier ones
SAMPLED_REV = 6.001  # rev: of a motion that settles later the run is made again, with samples
LOOKED_AT = 2 * MAX_PERIOD_REV  # revolutions, the last ones, by which that is seen


def find_span(search: Search) -> Solution | None:
    """Give the search's case numbers for `settle_rev: auto` and `duration_rev: auto`.

    Return the run by which they were found, if it is one of that case.
    """
    case = search.case
    if case.solve.settle_rev != "auto":
        search.case = with_settle_rev(case, float(case.solve.settle_rev), 1)
        search.period = 1.0 if is_ideal(case) else math.nan
        return None
    if is_ideal(case):  # a function of the crank angle
        search.case, search.settled, search.period = with_settle_rev(case, 0.0, 1), 0.0, 1.0
        return None
    max_revolutions = int(case.duration / case.turn * (1 + 1e-12))
    ends_settled = case.solve.duration_rev == "auto"
    longest = with_settle_rev(case, 0.0, 1, float(max_revolutions) if ends_settled else None)
    p, within = record(case), least_promise(case)
    turns: list[Metrics] = []
    found: list[tuple[int, int]] = []

    def is_settled(run: Trajectory) -> bool:
        """Note the revolution that has ended, and where the last ones agree for the first time."""
        turns.append(metrics(p, run.turns[-1]))
        if not found and (last := steady(turns[-LOOKED_AT:], within)):
            found.append((last[0] + max(0, len(turns) - LOOKED_AT), last[1]))
        return bool(found) and ends_settled

    run = run_at_tolerance(
        longest, case.rtol, search.left, is_sampled(case),
        cuts=revolutions(0.0, longest.duration, case.turn), enough=is_settled,
        sampled_until=SAMPLED_REV * case.turn if ends_settled else math.inf,
    )  # fmt: skip
    if not found:
        half = float(max_revolutions // 2)
        search.case = with_settle_rev(case, half, 1, float(max_revolutions))
        search.unsettled = (
            f"in {max_revolutions} revolutions no {AGREEMENTS + 1} agree within {within:.2g}"
        )
        return None
    first, period = found[0]
    search.settled, search.period = float(first), float(period)
    search.case = with_settle_rev(case, search.settled, period)
    return settled_part(run, longest, search.case)


def settled_part(run: Solution, longest: Case, case: Case) -> Solution | None:
    """Return a longer run as that of a case whose metrics count later; None where it is not."""
    times, trajectory = output_times(case, is_sampled(case)), run.trajectory
    first, last = (round(time / case.turn) for time in (case.settle, case.duration))
    count, per_rev = times.size, compared_per_rev(case)
    output = trajectory.times[:count] if is_sampled(case) else times
    same = output.size == count and np.allclose(output, times, rtol=1e-12)
    ends_whole = abs(case.duration - last * case.turn) < SAME_TIME * case.duration
    if run.reason or not same or not ends_whole or per_rev != compared_per_rev(longest):
        return None
    states, phases = trajectory.states[:count].copy(), trajectory.phases[:count].copy()
    states[-1] = trajectory.turn_states[last - 1]
    segment = np.searchsorted(trajectory.edges, case.duration * (1.0 - SAME_TIME)) - 1
    phases[-1] = trajectory.edge_phases[segment]
    tally = merge_tallies(trajectory.turns[first:last])
    part = replace(trajectory, times=output, states=states, phases=phases, tally=tally, turns=[])
    begin = first * per_rev
    samples = run.samples[begin : begin + compared_times(case).size]
    numbers = metrics(run.p, tally)
    return replace(run, trajectory=part, settle=case.settle, metrics=numbers, samples=samples)


def with_settle_rev(case: Case, settle: float, period: int, duration: float | None = None) -> Case:
    """Return a case that settles at a number (rev), and ends at one; period: whole ones count."""
    if duration is None and case.solve.duration_rev == "auto":
        duration = settle + period * math.ceil(MEASURED_REV / period)
    if duration is None and settle == case.solve.settle_rev:
        return case
    settings = replace(case.solve, settle_rev=settle)
    if duration is not None:
        steps = case.steps * duration * case.turn / case.duration
        step = 360.0 * duration / round(steps)
        settings = replace(settings, duration_rev=duration, duration_s=None, output_step_s=None,
                           output_step_deg=step)  # fmt: skip
    return replace(case, solve=settings)


def least_promise(case: Case) -> float:
    """Return the least relative error that a case's accuracy promises, or `standard` would."""
    if case.targets:
        return min(target for _, target in case.targets)
    return case.promise if math.isfinite(case.promise) else ACCURACY["standard"].promise


def steady(turns: Sequence[Metrics], within: float) -> tuple[int, int] | None:
    """Return the first of the last revolutions that agree, and their period (rev), or None."""

    def is_same(k: int, period: int) -> bool:
        return agree(turns[k], turns[k + period], within)

    return find_repetition(len(turns), MAX_PERIOD_REV, is_same, AGREEMENTS)


def agree(one: Metrics, other: Metrics, within: float) -> bool:
    """Return whether the metrics of two revolutions differ by less than a share, by joint."""
    for name, row in METRICS.items():
        difference, size = np.abs(np.subtract(one[name], other[name])), np.abs(one[name])
        if "axis" in row.dims:
            size = size.max(axis=-1, keepdims=True)
        if row.bar.relative and not (difference <= within * size).all():
            return False
    return True

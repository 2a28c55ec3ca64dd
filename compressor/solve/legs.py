"""Legs of a motion that goes on: whole revolutions from a state, Poincaré points, and wear.

A state is the motion as the solver holds it (`physics.state_names`) at top dead centre, where the
load's segments begin; the crank angle of the Poincaré section lies inside the revolutions. Steps
end on the section and at top dead centre, so that both are the solver's own numbers, and a leg that
is cut short and begun again at a revolution's end goes on like any other.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from compressor.cases import Case
from compressor.metrics import AXES, JOINTS
from compressor.outcome import DatasetParts
from compressor.physics import COLUMNS, FLOWS, Column, derivative_with_flows, observe_all
from compressor.solve.attempts import Solution, integrate, request, run_at_tolerance, times_of
from compressor.solve.error_bars import (
    Metrics,
    allowed_residual,
    audit_failure,
    audit_rungs,
    energy_residual,
)
from compressor.solve.regime import least_promise, steady, with_settle_rev
from compressor.solve.request import Cuts, Turns, merge_turns, passed_time, revolutions
from compressor.solve.run_metrics import metrics, statistics
from compressor.solve.si_record import record
from compressor.solve.simulate import with_series

RATE_SHIFT_REV = 1e-6  # rev: half the span that the rate of an eccentricity is a difference over

Enough = Callable[[Turns, np.ndarray], bool]  # of revolutions so far, and their Poincaré points


@dataclass
class Leg:
    """Some revolutions of a case.

    `turns`: a tally each; `points`: of the Poincaré section, (k, joint, 4), eccentricity x and y
    (m) and their rates (m/s), 0 at an ideal joint; `state`: at the end of the last revolution;
    `reason`, `detail`: why it ended early, empty if it did not.
    """

    p: np.record
    turns: Turns
    points: np.ndarray
    state: np.ndarray
    reason: str = ""
    detail: str = ""

    def numbers(self, last: int) -> Metrics:
        """Return the metrics of the last so many revolutions together."""
        return metrics(self.p, merge_turns(self.turns[-last:]))

    def rms_error(self, last: int) -> float:
        """Return the standard error of rms_acceleration over the last so many revolutions (m/s2).

        By batch means (`compressor.solve.run_metrics`); inf where there are too few.
        """
        found = statistics(self.p, self.turns[-last:])
        return float(found["rms_acceleration_standard_error"])


@dataclass(frozen=True)
class Stretch:
    """How long a leg is at most: revolutions, the section's crank angle (rad), wall time (s)."""

    revolutions: int
    section: float
    timeout: float


def follow_revolutions(
    case: Case,
    state: np.ndarray | None,
    span: Stretch,
    enough: Enough = lambda turns, points: False,
) -> Leg:
    """Follow a case from a state on, or from its own start, until enough is known.

    A leg whose energy does not balance is run again at a tenth of the tolerance, and at a
    hundredth, as any run (`compressor.solve.solution`).
    """
    deadline = time.monotonic() + span.timeout
    of = leg_case(case, span.revolutions)
    for rtol in audit_rungs(case.rtol):
        course = PoincareCuts(of, span.section, enough)
        left = max(deadline - time.monotonic(), 0.0)
        run = run_at_tolerance(of, rtol, left, False, course.cuts, state)
        found = course.leg(run)
        residual = energy_residual(run.trajectory.tally)
        most = allowed_residual(case.rtol, len(found.turns))
        if found.reason or residual <= most:
            return found
    found.reason, found.detail = audit_failure(residual, most, rtol)
    return found


def settle_motion(case: Case, state: np.ndarray | None, span: Stretch) -> tuple[Leg, float]:
    """Follow a case until the metrics of revolutions agree, as with `settle_rev: auto`.

    With the revolution from which on they do; nan where they do not within the span.
    """
    p, within = record(case), least_promise(case)
    each: list[Metrics] = []

    def enough(turns: Turns, points: np.ndarray) -> bool:
        each.append(metrics(p, turns[-1]))
        return steady(each, within) is not None

    found = follow_revolutions(case, state, span, enough)
    agreed = steady([metrics(p, turn) for turn in found.turns], within)
    return found, float(agreed[0]) if agreed else math.nan


def with_samples(case: Case, state: np.ndarray, span: Stretch) -> tuple[DatasetParts, str, str]:
    """Return a leg as a run with time series on the case's output grid, measured from its second
    turn on.

    What its Dataset is made of, and the reason and detail where it did not come to its end.
    """
    of = leg_case(case, span.revolutions)
    of = replace(of, solve=replace(of.solve, settle_rev=1.0))
    run = run_at_tolerance(of, case.rtol, span.timeout, True, None, state)
    return with_series(of, run)[1], run.reason, run.detail


def leg_case(case: Case, count: int) -> Case:
    """Return a case over so many revolutions, all of them measured, of which nothing else is
    wanted.
    """
    of = with_settle_rev(case, 0.0, 1, float(count))
    how = replace(of.solve, error_bars=False, accuracy="standard", horizon=False)
    return replace(of, solve=how, output=replace(of.output, keep="series", signals=False))


class PoincareCuts:
    """What a run passes: cuts at the section and at the end of each revolution.

    With a section of 0 the two are one.
    """

    def __init__(self, case: Case, section: float, enough: Enough):
        self.p, self.enough = record(case), enough
        ends = revolutions(0.0, case.duration, case.turn)
        inner = ends - case.turn * (1.0 - section / (2.0 * math.pi)) if section else ends[:0]
        self.step = 2 if section else 1
        self.cuts = Cuts(np.sort(np.concatenate((inner, ends))), self.at_cut)
        self.turns: Turns = []
        self.points: list[np.ndarray] = []

    def at_cut(self, turns: Turns) -> bool:
        """Take the point at the section, and at a revolution's end ask whether that is enough."""
        count = len(turns)
        if (count - 1) % self.step == 0:
            at = float(self.cuts.times[count - 1])
            self.points.append(eccentricities(self.p, at, self.cuts.states[-1]))
        if count % self.step:
            return False
        self.turns.append(merge_turns(turns[-self.step :]))
        return self.enough(self.turns, np.array(self.points))

    def leg(self, run: Solution) -> Leg:
        """Return the leg that a run along it has made."""
        count = len(self.turns)
        shape = (count, len(JOINTS), 2 * len(AXES))
        points = np.array(self.points[:count]).reshape(shape)
        nothing = np.full(run.trajectory.states.shape[1], math.nan)
        state = self.cuts.states[self.step * count - 1] if count else nothing
        return Leg(run.p, self.turns, points, state, run.reason, run.detail)


def eccentricities(p: np.record, at: float, state: np.ndarray) -> np.ndarray:
    """Return the eccentricity (m) and its rate (m/s) of both joints at a time (s), (joint, 4).

    The rate is the central difference of the eccentricity, which is geometry alone, along the
    motion: its error is that of the third derivative over a millionth of a revolution.
    """
    z = np.append(state, np.zeros(FLOWS))
    rates = np.empty_like(z)
    derivative_with_flows(at, z, 0, p, rates)
    span = RATE_SHIFT_REV * 2.0 * math.pi / float(p["omega"])
    shifts, rows = np.array([0.0, -span, span]), np.empty((3, COLUMNS))
    states = state + shifts[:, np.newaxis] * rates[:-FLOWS]
    observe_all(at + shifts, states, np.zeros(3, dtype=np.int64), p, rows)
    places = rows[:, Column.ECCENTRICITY : Column.ECCENTRICITY + 4].reshape(3, 2, 2)
    here, before, after = places
    return np.concatenate((here, (after - before) / (2.0 * span)), axis=1)


class Rubbed(NamedTuple):
    """A motion on bores that are given.

    `work`: pressing times sliding, J a revolution, by joint and node of the bore; `spread`: its
    standard deviation over the revolutions, by joint; `turn`: time of a revolution, s; `state`: the
    motion at the end; `reason`, `detail`: why it stopped early, empty if it did not.
    """

    work: np.ndarray
    spread: np.ndarray
    turn: float
    metrics: Metrics
    state: np.ndarray
    reason: str = ""
    detail: str = ""


def wear_bores(case: Case, worn: np.ndarray, state: np.ndarray | None) -> Rubbed:
    """Follow a case over its span on worn bores, and measure what rubs after it has settled.

    worn: (joint, sector), m; state: the motion to begin with, at top dead centre, or None for the
    case's own. The span is in whole revolutions. A run whose energy does not balance is run again
    at a tenth of the tolerance, as any other.
    """
    deadline = time.monotonic() + case.solve.timeout_s
    ends = revolutions(case.settle, case.duration, case.turn)
    for rtol in audit_rungs(case.rtol):
        p = record(case, worn)
        asked = request(case, rtol, p, times_of(case, False), state)
        cuts = Cuts(ends)
        asked.timeout, asked.cuts = max(deadline - time.monotonic(), 0.0), cuts
        run = integrate(asked)
        residual = energy_residual(run.tally)
        most = allowed_residual(case.rtol, case.duration / case.turn)
        if run.reason or residual <= most:
            break
    else:
        run.reason, run.detail = audit_failure(residual, most, rtol)
    turns = cuts.turns
    if run.reason or not turns:
        nothing = np.full((len(JOINTS), worn.shape[1]), np.nan)
        return Rubbed(nothing, nothing[:, 0], np.nan, {}, asked.start, run.reason, run.detail)
    slid = np.array([turn["slid"] for turn in turns])
    whole = merge_turns(turns)
    work = whole["worn"][:, : worn.shape[1]] / len(turns)
    began, ended = passed_time(p, run.times, run.states)[[0, -1]]
    turn = case.turn * float(ended - began) / case.duration
    return Rubbed(work, slid.std(axis=0), turn, metrics(p, whole), run.states[-1])

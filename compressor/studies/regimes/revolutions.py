"""Follow a motion that goes on: whole revolutions from a state, and their Poincaré points.

A state is the motion as the solver holds it (`physics.state_names`) at top dead centre, where the
load's segments begin; the crank angle of the Poincaré section lies inside the revolutions. Steps
end on the section and at top dead centre, so that both are the solver's own numbers, and a run that
is cut short and begun again at a revolution's end goes on like any other.
"""

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from compressor.cases import Case
from compressor.metrics import AXES, JOINTS
from compressor.outcome import DatasetParts
from compressor.physics import merge_tallies
from compressor.reasons import Reason
from compressor.solve import (
    Cuts,
    Metrics,
    Solution,
    Turns,
    allowed_residual,
    energy_residual,
    least_promise,
    metrics,
    next_audit_rtol,
    record,
    revolutions,
    run_at_tolerance,
    statistics,
    steady,
    with_series,
    with_settle_rev,
)

Enough = Callable[[Turns, np.ndarray], bool]  # of revolutions so far, and their Poincaré points


@dataclass
class RevolutionRun:
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
        return metrics(self.p, merge_tallies(self.turns[-last:]))

    def rms_error(self, last: int) -> float:
        """Return the standard error of rms_acceleration over the last so many revolutions (m/s2).

        By batch means (`compressor.solve.run_metrics`); inf where there are too few.
        """
        found = statistics(self.p, self.turns[-last:])
        return float(found["rms_acceleration_standard_error"])


@dataclass(frozen=True)
class RevolutionSpan:
    """How long a run is at most: revolutions, the section's crank angle (rad), wall time (s)."""

    revolutions: int
    section: float
    timeout: float


def follow_revolutions(
    case: Case,
    state: np.ndarray | None,
    span: RevolutionSpan,
    enough: Enough = lambda turns, points: False,
) -> RevolutionRun:
    """Follow a case from a state on, or from its own start, until enough is known.

    A run whose energy does not balance is made again at tenths of its tolerance.
    """
    deadline = time.monotonic() + span.timeout
    of, rtol = bare_case(case, span.revolutions), case.rtol
    for failures in itertools.count(1):
        recorder = PoincareRecorder(of, span.section, enough)
        left = max(deadline - time.monotonic(), 0.0)
        run = run_at_tolerance(of, rtol, left, False, recorder.cuts, state)
        residual = energy_residual(run.trajectory.tally)
        allowed = allowed_residual(case.rtol, len(recorder.turns))
        if run.reason or residual <= allowed:
            break
        tighter = next_audit_rtol(rtol, failures)
        if tighter is None:
            run.reason = Reason.ENERGY_AUDIT_FAILED
            text = f"energy residual {residual:.2g}, more than {allowed:.2g}, at rtol {rtol:.2g}"
            run.detail = text
            break
        rtol = tighter
    return recorder.revolution_run(run)


def settle_motion(
    case: Case, state: np.ndarray | None, span: RevolutionSpan
) -> tuple[RevolutionRun, float]:
    """Follow a case until the metrics of revolutions agree, as with `settle_rev: auto`.

    Return the run, and the revolution from which on they agree, nan if they do not in the span.
    """
    p, within = record(case), least_promise(case)
    each: list[Metrics] = []

    def enough(turns: Turns, points: np.ndarray) -> bool:
        each.append(metrics(p, turns[-1]))
        return steady(each, within) is not None

    found = follow_revolutions(case, state, span, enough)
    agreed = steady([metrics(p, turn) for turn in found.turns], within)
    return found, float(agreed[0]) if agreed else math.nan


def run_with_series(
    case: Case, state: np.ndarray, span: RevolutionSpan
) -> tuple[DatasetParts, str, str]:
    """Return revolutions from a state on with time series, measured from the second one on.

    The first value has the parts of the Dataset, on the case's output grid; the others are the
    reason and detail of a run that did not come to its end.
    """
    of = bare_case(case, span.revolutions)
    of = replace(of, solve=replace(of.solve, settle_rev=1.0))
    run = run_at_tolerance(of, case.rtol, span.timeout, True, None, state)
    found, variables = with_series(of, run)
    return found.table(variables), run.reason, run.detail


def bare_case(case: Case, count: int) -> Case:
    """Return a case over `count` revolutions, all measured, without any other output."""
    whole = with_settle_rev(case, 0.0, 1, float(count))
    solve = replace(whole.solve, error_bars=False, accuracy="standard", horizon=False)
    return replace(whole, solve=solve, output=replace(whole.output, keep="series", signals=False))


class PoincareRecorder:
    """Cuts of a run at the section and at the end of each revolution, and what is seen there.

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
        """Record the point at the section; return whether the points suffice.

        Within a revolution they do not.
        """
        count = len(turns)
        if (count - 1) % self.step == 0:
            self.points.append(eccentricities(self.p, self.cuts.states[-1]))
        if count % self.step:
            return False
        self.turns.append(merge_tallies(turns[-self.step :]))
        return self.enough(self.turns, np.array(self.points))

    def revolution_run(self, run: Solution) -> RevolutionRun:
        """Return the revolutions of the run that it has recorded."""
        count = len(self.turns)
        shape = (count, len(JOINTS), 2 * len(AXES))
        points = np.array(self.points[:count]).reshape(shape)
        nothing = np.full(run.trajectory.states.shape[1], math.nan)
        state = self.cuts.states[self.step * count - 1] if count else nothing
        return RevolutionRun(run.p, self.turns, points, state, run.reason, run.detail)


def eccentricities(p: np.record, state: np.ndarray) -> np.ndarray:
    """Return the eccentricity (m) and its rate (m/s) of both joints, (joint, 4), from a state."""
    n, place = int(p["freedoms"]), 0
    found = np.zeros((len(JOINTS), 2 * len(AXES)))
    for joint in np.flatnonzero(p["clearance"] > 0.0):
        found[joint] = *state[place : place + 2], *state[n + place : n + place + 2]
        place += 2
    return found

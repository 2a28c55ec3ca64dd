"""The motion that a machine settles to from a state on: Poincaré points, period, exponent, metrics.

A state is the motion as the solver holds it (`physics.state_names`) at top dead centre, where the
load's segments begin and Poincaré points are taken. Steps end there, so that both are the solver's
own numbers, and a run that begins at a revolution's end goes on like any other.
"""

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from compressor import cases, physics, solve
from compressor.cases import Case
from compressor.metrics import AXES, JOINTS
from compressor.outcome import Regime
from compressor.reasons import Reason
from compressor.studies import frame
from compressor.studies.follow.lyapunov import largest_exponent

SETTLE_REV = 50  # most revolutions dropped at each value
EXPONENT_REV = 16  # of a motion that repeats itself, for its exponent
TOLERANCE = 1e-3  # of the clearance: points so near to each other are one
# of the error of acceleration that accuracy allows: the tolerance, where it is more
OF_PROMISE = 0.2
MAX_PERIOD = 16  # rev: period that is looked for
MORE = 4  # revolutions, beyond two periods, in which points are to repeat
# tolerances: each of two sets may lie one, and a little more, beside its motion
APART_TOLERANCES = 3.0
APART_STANDARD_ERRORS = 3.0  # standard errors by which means of chaotic motions differ
COORDINATES = (*AXES, *(f"{axis}_rate" for axis in AXES))
MEASURED = (
    "peak_acceleration", "rms_acceleration", "peak_contact_force", "contact_loss_fraction",
)  # fmt: skip

# of the tallies of revolutions so far, and their Poincaré points
Enough = Callable[[list[np.record], np.ndarray], bool]
TEXTS = {
    "status": "ok or failed",
    "reason": "why the value failed, by a stable name",
    "detail": "what is known of a failure beyond its reason",
    "regime": "periodic, chaotic or undecided",
}
# beside the value: dims, unit, long name
NUMBERS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "section": (
        ("revolution", "joint", "coordinate"), "m",
        "Poincaré points: eccentricity at top dead centre, once a revolution; its rate in m/s",
    ),
    "period": ((), "rev", "period after which the Poincaré points repeat"),
    "lyapunov_exponent": ((), "1/rev", "largest Lyapunov exponent"),
    "lyapunov_exponent_error": ((), "1/rev", "error of the largest Lyapunov exponent"),
    "settled_rev": ((), "rev", "revolution at this value from which on metrics agree"),
    "revolutions": ((), "rev", "revolutions that the numbers are of"),
    **frame.metric_numbers(MEASURED),
    "rms_acceleration_standard_error": ((), "m/s2", "standard error of rms_acceleration"),
    "end_state": (("number",), "1", "motion at the end, as the solver holds it, in SI"),
}  # fmt: skip


@dataclass
class RevolutionRun:
    """Some revolutions of a case.

    `turns`: a tally each; `points`: Poincaré points, (k, joint, 4), eccentricity x and y (m) and
    their rates (m/s), 0 at an ideal joint; `state`: at the end of the last revolution; `reason`,
    `detail`: why it ended early, empty if it did not.
    """

    p: np.record
    turns: list[np.record]
    points: np.ndarray
    state: np.ndarray
    reason: str
    detail: str


def run_value(case: Case, state: np.ndarray | None, most: int, wants_exponent: bool) -> frame.Row:
    """Follow a case from a state on, or from its own start, until it settles, and measure it.

    most: Poincaré points of a motion that does not repeat itself; wants_exponent: whether the
    largest Lyapunov exponent is looked for. The row has the names of `TEXTS` and `NUMBERS`. A run
    that stops is a row too, with its reason and the state that it began from, so that the next
    value can go on from there. The wall time is the case's own. Nothing in a row depends on how
    long it took.
    """
    row, deadline = empty_row(case, most), time.monotonic() + case.solve.timeout_s
    if state is not None:
        row["end_state"] = state
    run, since = settle_motion(case, state, deadline)
    if run.reason:
        return failed_row(row, run)
    within, clearance = tolerance(case), solve.record(case)["clearance"].copy()

    def period_in(turns: list[np.record], points: np.ndarray) -> int | None:
        return period_of(places(points, clearance), within)

    run = follow_revolutions(
        case, run.state, most, deadline, lambda *so_far: period_in(*so_far) is not None
    )
    if run.reason:
        return failed_row(row, run)
    period = period_in(run.turns, run.points)
    exponent = error = math.nan
    if wants_exponent:
        left = max(deadline - time.monotonic(), 0.0)
        count = min(most, EXPONENT_REV) if period else most
        found = largest_exponent(case, run.state, count, left)
        # a motion that contracts so fast has an exponent that is at most this, of unknown error
        exponent, error = found.value, math.nan if found.at_most else found.error
    parts = exponent - error > 0.0  # close motions part, as far as is known
    if period:
        regime = Regime.UNDECIDED if parts else Regime.PERIODIC
        count, points = period * ((2 * period + MORE) // period), run.points[-period:]
    else:
        regime = Regime.CHAOTIC if parts else Regime.UNDECIDED
        count, points = len(run.turns), run.points
    worn = clearance > 0.0  # an ideal joint's journal does not move
    row["section"][: len(points), worn] = points[:, worn]
    measured = run.turns[-count:]
    together = solve.metrics(run.p, physics.merge_tallies(measured))
    known = {name: together[name] for name in MEASURED} | {
        "period": float(period or math.nan),
        "lyapunov_exponent": exponent,
        "lyapunov_exponent_error": error,
        "settled_rev": since,
        "revolutions": count,
        # by batch means (`compressor.solve.run_metrics`); inf where there are too few
        "rms_acceleration_standard_error": (
            solve.statistics(run.p, measured)["rms_acceleration_standard_error"]
        ),
        "end_state": run.state,
    }
    row |= {name: np.asarray(value, float) for name, value in known.items()}
    return row | {"status": "ok", "regime": regime}


def empty_row(case: Case, points: int) -> frame.Row:
    """Return a row without any known value."""
    lengths = {
        "revolution": points, "joint": len(JOINTS), "coordinate": len(COORDINATES),
        "number": len(physics.state_names(solve.record(case))),
    }  # fmt: skip
    numbers = {
        name: np.full([lengths[dim] for dim in dims], math.nan)
        for name, (dims, _, _) in NUMBERS.items()
    }
    return dict.fromkeys(TEXTS, "") | numbers


def failed_row(row: frame.Row, run: RevolutionRun) -> frame.Row:
    """Return a row of a value whose run stopped."""
    return row | {"status": "failed", "reason": str(run.reason), "detail": run.detail}


def settle_motion(
    case: Case, state: np.ndarray | None, deadline: float
) -> tuple[RevolutionRun, float]:
    """Follow a case until the metrics of revolutions agree, as with `settle_rev: auto`.

    Return the run, and the revolution from which on they agree, nan if they do not in
    `SETTLE_REV`.
    """
    p, within = solve.record(case), solve.least_promise(case)
    each: list[solve.Metrics] = []

    def enough(turns: list[np.record], points: np.ndarray) -> bool:
        each[len(turns) - 1 :] = [solve.metrics(p, turns[-1])]  # a run made again begins anew
        return solve.steady(each, within) is not None

    found = follow_revolutions(case, state, SETTLE_REV, deadline, enough)
    agreed = solve.steady([solve.metrics(p, turn) for turn in found.turns], within)
    return found, float(agreed[0]) if agreed else math.nan


def follow_revolutions(
    case: Case,
    state: np.ndarray | None,
    most: int,
    deadline: float,
    enough: Enough = lambda turns, points: False,
) -> RevolutionRun:
    """Follow a case over up to `most` revolutions, from a state on or from its own start.

    A run whose energy does not balance is made again at tenths of its tolerance.
    """
    bare, rtol = bare_case(case, most), case.rtol
    p, ends = solve.record(bare), solve.revolutions(0.0, bare.duration, bare.turn)

    def is_enough(run: solve.Trajectory) -> bool:
        return enough(run.turns, poincare_points(p, run.turn_states))

    for failures in itertools.count(1):
        left = max(deadline - time.monotonic(), 0.0)
        run = solve.run_at_tolerance(bare, rtol, left, False, state, ends, is_enough)
        trajectory = run.trajectory
        residual = solve.energy_residual(trajectory.tally)
        allowed = solve.allowed_residual(case.rtol, len(trajectory.turns))
        if run.reason or residual <= allowed:
            break
        tighter = solve.next_audit_rtol(rtol, failures)
        if tighter is None:
            run.reason = Reason.ENERGY_AUDIT_FAILED
            text = f"energy residual {residual:.2g}, more than {allowed:.2g}, at rtol {rtol:.2g}"
            run.detail = text
            break
        rtol = tighter
    states = trajectory.turn_states
    end = states[-1] if states else np.full(trajectory.states.shape[1], math.nan)
    points = poincare_points(p, states)
    return RevolutionRun(p, trajectory.turns, points, end, run.reason, run.detail)


def bare_case(case: Case, count: int) -> Case:
    """Return a case over `count` revolutions, all measured, without any other output."""
    whole = solve.with_settle_rev(case, 0.0, 1, float(count))
    settings = replace(whole.solve, error_bars=False, accuracy="standard", horizon=False)
    return replace(whole, solve=settings, output=cases.Output(signals=False))


def poincare_points(p: np.record, states: list[np.ndarray]) -> np.ndarray:
    """Return the eccentricity (m) and its rate (m/s) of both joints, (k, joint, 4), of states."""
    n, place = int(p["freedoms"]), 0
    found = np.zeros((len(states), len(JOINTS), len(COORDINATES)))
    for joint in np.flatnonzero(p["clearance"] > 0.0):
        for point, state in zip(found, states, strict=True):
            point[joint] = *state[place : place + 2], *state[n + place : n + place + 2]
        place += 2
    return found


def tolerance(case: Case) -> float:
    """Return the distance (of the clearance) below which two Poincaré points are one.

    At accuracy standard or better a thousandth: five times what the steps' own errors were seen to
    scatter them by, at both joints.
    """
    return max(TOLERANCE, OF_PROMISE * case.promise) if math.isfinite(case.promise) else TOLERANCE


def places(points: np.ndarray, clearance: np.ndarray) -> np.ndarray:
    """Return the eccentricities in units of the clearance, (k, joint, 2); 0 at an ideal joint.

    points: (k, joint, 4), m and m/s; clearance: (joint,), m.
    """
    worn = clearance > 0.0
    room = np.where(worn, clearance, math.inf)
    return np.where(worn[:, None], points[:, :, :2], 0.0) / room[:, None]


def period_of(found: np.ndarray, within: float) -> int | None:
    """Return the period (rev) of the last of some places, (k, joint, 2); None where there is none.

    The shortest one, up to 16, whose last two periods and four revolutions are the same, each to
    the last place of its phase.
    """
    end = len(found) - 1

    def is_same(k: int, period: int) -> bool:
        last = end - (end - k) % period  # a slow drift does not add up to a period
        return bool(distances(found[[k]], found[[last]]).item() <= within)

    repetition = solve.find_repetition(len(found), MAX_PERIOD, is_same, more=MORE)
    return repetition[1] if repetition else None


def distances(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the distance of every place from every other, (k, l), at the worse joint."""
    differences = one[:, None] - other[None, :]
    return np.linalg.norm(differences, axis=-1).max(axis=-1)


def hausdorff_distance(one: np.ndarray, other: np.ndarray) -> float:
    """Return the Hausdorff distance of two sets of places, (k, joint, 2) and (l, joint, 2)."""
    matrix = distances(one, other)
    return float(max(matrix.min(axis=1).max(), matrix.min(axis=0).max()))


def differ(case: Case, one: frame.Row, other: frame.Row) -> bool:
    """Return whether the motions of two rows of a case are different ones.

    Two periodic motions differ if their sets of Poincaré places are farther apart than three times
    the tolerance. Sets of different periods are, unless a period is doubled by less than that. A
    periodic and a chaotic motion differ. Two chaotic ones differ if their means of rms_acceleration
    are more than 3 standard errors of their difference apart. Other motions are not known well
    enough to differ.
    """
    regimes, clearance = {one["regime"], other["regime"]}, solve.record(case)["clearance"]
    if regimes == {Regime.PERIODIC}:
        sets = [places(row["section"][: int(row["period"])], clearance) for row in (one, other)]
        return hausdorff_distance(*sets) > APART_TOLERANCES * tolerance(case)
    if regimes == {Regime.CHAOTIC}:
        errors = [float(row["rms_acceleration_standard_error"]) for row in (one, other)]
        apart = abs(float(one["rms_acceleration"]) - float(other["rms_acceleration"]))
        return apart > APART_STANDARD_ERRORS * math.hypot(*errors)
    return regimes == {Regime.PERIODIC, Regime.CHAOTIC}

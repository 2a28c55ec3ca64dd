"""The largest Lyapunov exponent of a motion at a value."""

import math
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from compressor.analysis import MODES, contact_modes, impacts, mode_shares
from compressor.cases import Case
from compressor.metrics import AXES, JOINTS
from compressor.outcome import Regime
from compressor.physics import state_names
from compressor.solve import find_repetition, record
from compressor.studies.regimes.group import Regimes
from compressor.studies.regimes.lyapunov import largest_exponent
from compressor.studies.regimes.revolutions import (
    RevolutionRun,
    RevolutionSpan,
    follow_revolutions,
    run_with_series,
    settle_motion,
)

COUNTED = 16  # rev of a motion that repeats itself


def exponent(
    case: Case, state: np.ndarray, repeats: bool, most: int, timeout: float
) -> tuple[float, float]:
    """Return the largest Lyapunov exponent and its error (1/rev) from a state on; nan: not known.

    Over up to `most` revolutions; a few suffice where the motion repeats itself. The error is
    nan where the motion contracts so fast that the exponent is at most this. timeout: wall time (s)
    that it may take.
    """
    count = min(most, COUNTED) if repeats else most
    found = largest_exponent(case, state, count, timeout)
    return found.value, math.nan if found.at_most else found.error


TOLERANCE = 1e-3  # of the clearance: points so near to each other are one
# of the error of acceleration that accuracy allows: the tolerance, where it is more
OF_PROMISE = 0.2
MAX_PERIOD = 16  # rev: period that is looked for
MORE = 4  # revolutions, beyond two periods, in which points are to repeat


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

    repetition = find_repetition(len(found), MAX_PERIOD, is_same, more=MORE)
    return repetition[1] if repetition else None


def distances(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the distance of every place from every other, (k, l), at the worse joint."""
    differences = one[:, None] - other[None, :]
    return np.linalg.norm(differences, axis=-1).max(axis=-1)


def hausdorff_distance(one: np.ndarray, other: np.ndarray) -> float:
    """Return the Hausdorff distance of two sets of places, (k, joint, 2) and (l, joint, 2)."""
    matrix = distances(one, other)
    return float(max(matrix.min(axis=1).max(), matrix.min(axis=0).max()))


COORDINATES = (*AXES, *(f"{axis}_rate" for axis in AXES))
SAMPLED = 16  # rev, at most, whose contact modes and impacts are stored

Row = dict[str, Any]
SECTION = ("revolution", "joint", "coordinate")
TEXTS = {
    "status": "ok or failed",
    "reason": "why the value failed, by a stable name",
    "detail": "what is known of a failure beyond its reason",
    "regime": "periodic, chaotic or undecided",
}
# beside the value: dims, unit, long name
NUMBERS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "section": (SECTION, "m", "Poincaré points: eccentricity once a revolution; its rate in m/s"),
    "period": ((), "rev", "period after which the Poincaré points repeat"),
    "lyapunov_exponent": ((), "1/rev", "largest Lyapunov exponent"),
    "lyapunov_exponent_error": ((), "1/rev", "error of the largest Lyapunov exponent"),
    "settled_rev": ((), "rev", "revolution at this value from which on metrics agree"),
    "revolutions": ((), "rev", "revolutions that the numbers are of"),
    "mode_share": (("joint", "mode"), "1", "share of time in a contact mode"),
    "impacts_per_revolution": (("joint",), "1/rev", "impacts a revolution"),
    "mean_approach_speed": (("joint",), "m/s", "mean relative normal speed at first touch"),
    "peak_approach_speed": (("joint",), "m/s", "greatest relative normal speed at first touch"),
    "peak_acceleration": ((), "m/s2", "greatest |acceleration|"),
    "rms_acceleration": ((), "m/s2", "root mean square of acceleration"),
    "rms_acceleration_standard_error": ((), "m/s2", "standard error of rms_acceleration"),
    "peak_contact_force": (("joint",), "N", "greatest joint force on the rod"),
    "contact_loss_fraction": (("joint",), "1", "share of time without dry contact"),
    "end_state": (("number",), "1", "motion at the end, as the solver holds it, in SI"),
}
METRICS = (
    "peak_acceleration", "rms_acceleration", "peak_contact_force", "contact_loss_fraction",
)  # fmt: skip


@dataclass
class SettledMotion:
    """What a motion settles to.

    `regime`: of `Regime`; `period` (rev): nan where it does not repeat itself; `points`: of the
    section, (k, joint, 4), of one period or all; `run`: the revolutions that were measured;
    the last `count` are meant; `exponent`: the largest Lyapunov exponent and its error, 1/rev.
    """

    regime: str
    period: float
    points: np.ndarray
    run: RevolutionRun
    count: int
    exponent: tuple[float, float] = (math.nan, math.nan)
    reason: str = field(init=False)

    def __post_init__(self) -> None:
        self.reason = self.run.reason


class Clock:
    """The wall time (s) that a value may still take."""

    def __init__(self, timeout: float):
        self.deadline = time.monotonic() + timeout

    @property
    def left(self) -> float:
        return max(self.deadline - time.monotonic(), 0.0)


def sizes(request: Regimes, case: Case) -> dict[str, int]:
    """Return the lengths of the dimensions of a chain's variables."""
    return {
        "revolution": request.measure_rev,
        "joint": len(JOINTS),
        "coordinate": len(COORDINATES),
        "mode": len(MODES),
        "number": len(state_names(record(case))),
    }


def empty(request: Regimes, case: Case) -> Row:
    """Return a row without any known value."""
    lengths = sizes(request, case)
    row: Row = dict.fromkeys(TEXTS, "")
    for name, (dims, _, _) in NUMBERS.items():
        row[name] = np.full([lengths[dim] for dim in dims], math.nan)
    return row


def run_value(case: Case, state: np.ndarray | None, request: Regimes) -> Row:
    """Follow a case from a state on, or from its own start, until it settles, and measure it.

    The row has the names of `TEXTS` and `NUMBERS`. A run that stops is a row too, with its
    reason and the state that it began from, so that the chain can go on from there. The wall time
    is the case's own. Nothing in a row depends on how long it took.
    """
    row, clock = empty(request, case), Clock(case.solve.timeout_s)
    if state is not None:
        row["end_state"] = state
    settled, since = settle_motion(case, state, span_of(request, request.settle_rev, clock))
    if settled.reason:
        return failed_row(row, settled.reason, settled.detail)
    row["settled_rev"] = np.asarray(since)
    motion = measure_motion(case, settled.state, request, clock)
    if motion.reason:
        return failed_row(row, motion.run.reason, motion.run.detail)
    reason, detail = contacts(case, motion, request, clock, row)
    if reason:
        return failed_row(row, reason, detail)
    end, found = motion.run.state, motion.run.numbers(motion.count)
    worn = record(case)["clearance"] > 0.0  # an ideal joint's journal does not move
    row["section"][: len(motion.points), worn] = motion.points[:, worn]
    known = {name: found[name] for name in METRICS}
    known |= {
        "period": motion.period,
        "lyapunov_exponent": motion.exponent[0],
        "lyapunov_exponent_error": motion.exponent[1],
        "revolutions": motion.count,
        "rms_acceleration_standard_error": motion.run.rms_error(motion.count),
        "end_state": end,
    }
    row |= {name: np.asarray(value, float) for name, value in known.items()}
    return row | {"status": "ok", "regime": motion.regime}


def failed_row(row: Row, reason: str, detail: str) -> Row:
    """Return a row of a value whose run stopped."""
    return row | {"status": "failed", "reason": str(reason), "detail": detail}


def span_of(request: Regimes, revolutions: int, clock: Clock) -> RevolutionSpan:
    """Return a span of so many revolutions, at most, within the time that is left."""
    return RevolutionSpan(revolutions, math.radians(request.section_deg), clock.left)


def measure_motion(case: Case, state: np.ndarray, request: Regimes, clock: Clock) -> SettledMotion:
    """Return the motion from a settled state on.

    It is followed until its Poincaré points repeat, or there are enough of them.
    """
    within, clearance = tolerance(case), record(case)["clearance"].copy()

    def period(points: np.ndarray) -> int | None:
        return period_of(places(points, clearance), within)

    run = follow_revolutions(
        case, state, span_of(request, request.measure_rev, clock),
        lambda turns, points: period(points) is not None,
    )  # fmt: skip
    found = None if run.reason else period(run.points)
    if run.reason:
        return SettledMotion("", math.nan, run.points[:0], run, 0)
    exponents = math.nan, math.nan
    if request.exponent:
        exponents = exponent(case, run.state, found is not None, request.measure_rev, clock.left)
    parts = exponents[0] - exponents[1] > 0.0  # close motions part, as far as is known
    if found:
        count = found * ((2 * found + MORE) // found)
        points = run.points[-found:]
        word = Regime.UNDECIDED if parts else Regime.PERIODIC
        return SettledMotion(word, float(found), points, run, count, exponents)
    word = Regime.CHAOTIC if parts else Regime.UNDECIDED
    return SettledMotion(word, math.nan, run.points, run, len(run.turns), exponents)


def contacts(
    case: Case, motion: SettledMotion, request: Regimes, clock: Clock, row: Row
) -> tuple[str, str]:
    """Write contact modes and impacts of the revolutions that follow into a row.

    They are of one period, or of up to `SAMPLED` revolutions; one more goes before, so that
    contacts have begun. Return the reason and detail of a run that stopped, empty otherwise.
    """
    count = min(motion.count, SAMPLED) if math.isnan(motion.period) else int(motion.period)
    span = span_of(request, count + 1, clock)
    table, reason, detail = run_with_series(case, motion.run.state, span)
    if reason:
        return reason, detail
    run = xr.Dataset(table.variables, attrs=table.attrs)
    shares, struck = mode_shares(contact_modes(run))["share"], impacts(run)
    for joint in shares["joint"].values.tolist():
        at = JOINTS.index(joint)
        speeds = struck["approach_speed"].values[struck["joint"].values == joint]
        row["mode_share"][at] = shares.sel(joint=joint).values
        row["impacts_per_revolution"][at] = speeds.size / count
        if speeds.size:
            row["mean_approach_speed"][at] = speeds.mean()
            row["peak_approach_speed"][at] = speeds.max()
    return "", ""

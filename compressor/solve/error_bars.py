"""Energy audit and error bars: how far the numbers of a run may lie from the exact ones.

The energy audit: whether a run's energy balances as well as its tolerance lets one expect. The
flows (work of crank and load, losses of the contacts) are integrated beside the motion, so that
what they miss of the energy's change is error of the run itself, whatever its cause.

The difference from a tighter run is mostly the run's own error, and a little more than it bounds
that; of the difference from a looser run, which is mostly the looser one's error, a share does
(`closeness`). A metric's own difference may be small by chance: the distance of the time series
that it is taken from stands beside it. So may the moment of a change of contact: how far a state
that is wrong by some tolerances moves it is added to shares of time. The energy residual is a
floor. Where a motion enlarges the
errors of its steps (`is_amplified`), two runs may agree by chance in all numbers; there a third one
is made, and the longest bars count. Where a series or the acceleration may be wrong by all of
itself, no metric with a unit that is taken from it is known.

Shares stand in `compressor.metrics`; those and the ones below were chosen on random cases that
judge nothing (tests/results/calibration.md).
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from compressor.cases import TIGHTEST
from compressor.metrics import NUMBERS, SERIES

RESIDUAL_PER_REV = 10.0  # of rtol: the residual that a revolution may leave
ROUNDING = 1e-9  # a residual below it says nothing of a run
MAX_RESIDUAL = 0.05  # a residual above it is too large at any tolerance
MAX_AUDIT_REPEATS = 2  # by tens of the tolerance, for a run that fails its audit to be repeated at


def energy_residual(tally: np.record) -> float:
    """Return the worst imbalance of energy over what contacts take: losses, and what springs hold.

    That counts as at least 1e-3 of the greatest kinetic energy; where nothing is lost, as with
    ideal joints, whose motion is not integrated, as at least the crank's work.
    """
    lost = tally["contact_work"] + tally["friction_loss"]
    least = 1e-3 * tally["peak_kinetic"] if lost else abs(tally["crank_work"])
    return float(tally["worst_imbalance"] / max(lost, least, 1e-3 * tally["peak_kinetic"]))


def allowed_residual(rtol: float, revolutions: float) -> float:
    """Return the greatest energy residual of a run that can be trusted at a tolerance.

    The 200 random cases of tests/campaigns/random_cases.py leave a quarter of it at most at rtol
    1e-4, a tenth at tighter ones (tests/results/accuracy.json). Runs beyond it, of extremes of
    stiffness, stiction and mass ratio, mostly keep it at a tenth of the tolerance; those that never
    do are far off (mu 0.5 at rtol 2e-8: 1.6e-4 of the acceleration).
    """
    return min(max(RESIDUAL_PER_REV * rtol * max(revolutions, 1.0), ROUNDING), MAX_RESIDUAL)


Metrics = dict[str, Any]  # by name: a number, or an array over joints (and axes)
SIDES = "peak_rod_load_tension", "peak_rod_load_compression"

TIGHTER_DISTANCE_FACTOR = 3.0  # of the distance of a time series to a tighter run's
LOOSER, TEN, FALL = 0.37, 10.0, 0.65  # share of a run TEN times looser, and how it falls beyond
FLOOR = 0.1  # of the energy residual, relative to the metric
ORDER = 0.8  # power of the tolerance with which errors fall
# times rtol ** ORDER: a distance of accelerations beyond ten times the usual one
AMPLIFIED_FACTOR = 50.0


def next_audit_rtol(rtol: float, failures: int) -> float | None:
    """Return the tolerance at which a run is tried again whose energy does not balance.

    failures: runs of the case that did not, this one included. None where no more are tried.
    """
    return None if failures > MAX_AUDIT_REPEATS or rtol < 9.9 * TIGHTEST else rtol / 10.0


class Companion(NamedTuple):
    """Another run of a case, by which a run's errors are estimated.

    `ratio`: its tolerance over the run's; `apart`: the distance of each time series of the two
    (`compressor.solve.series.distances`).
    """

    metrics: Mapping[str, Any]
    ratio: float
    apart: Mapping[str, Any]

    @property
    def closeness(self) -> float:
        """Return the share of the difference from this run that counts; 1 of a tighter run."""
        return closeness(self.ratio)


def closeness(ratio: float) -> float:
    """Return the share of the distance to a run that bounds a run's own error.

    ratio: the other run's tolerance over the run's. 1 of a tighter run.
    """
    return 1.0 if ratio < 1.0 else LOOSER * (ratio / TEN) ** -FALL


def is_amplified(rtol: float, apart: Mapping[str, Any]) -> bool:
    """Return whether a motion enlarges errors, by its distance from a run at a like tolerance."""
    return bool(apart["acceleration"] > AMPLIFIED_FACTOR * rtol**ORDER)


def longest_bars(found: Sequence[Metrics]) -> Metrics:
    """Return the greatest of several bars or errors of each name."""
    return {name: np.maximum.reduce([one[name] for one in found]) for name in found[0]}


def ratio_of(share: float) -> float:
    """Return the ratio of tolerances with a closeness."""
    return TEN * (LOOSER / share) ** (1.0 / FALL)


def bars(
    metrics: Mapping[str, Any],
    other: Companion | None,
    residual: float,
    switching: Metrics | None = None,
) -> Metrics:
    """Return the error bar of each metric of a run's tally, in its unit and shape.

    residual: energy imbalance relative to what the contacts lose; switching: how far some of them
    move with changes of contact (`run_metrics.switch_errors`). All are inf without another run,
    and those of metrics with a unit also where their series, or the acceleration, may be wrong by
    all of itself.
    """
    if other is None:
        return {name: np.full(np.shape(value), np.inf) for name, value in metrics.items()}
    errors = {}
    for name, value in metrics.items():
        metric = NUMBERS[name]
        bar, size = metric.bar, np.ones(np.shape(value)) if metric.is_pure_number else np.abs(value)
        if name in SIDES:  # a small peak is as wrong as the force is
            size = max(metrics[side] for side in SIDES)
        apart = other.apart[metric.series]
        if np.ndim(apart) and "joint" not in metric.dims:
            apart = apart[metric.joint]
        # a metric's own difference may be small by chance, that of its series is not
        difference = bar.own * np.abs(np.asarray(value) - other.metrics[name])
        series_part = bar.path * to_metric_shape(apart, np.ndim(value)) * size
        errors[name] = other.closeness * np.hypot(difference, series_part)
        errors[name] = errors[name] + (switching or {}).get(name, 0.0)
        if not metric.is_pure_number:
            errors[name] = np.maximum(errors[name], max(FLOOR * residual, bar.least) * size)
            farthest = np.maximum(apart, other.apart["acceleration"])
            lost = TIGHTER_DISTANCE_FACTOR * other.closeness * farthest >= 1.0
            errors[name] = np.where(to_metric_shape(lost, np.ndim(value)), np.inf, errors[name])
    return errors


def to_metric_shape(apart: Any, ndim: int) -> np.ndarray:
    """Return a number, or one of each joint, in the shape of a metric over joints, and axes."""
    return np.reshape(apart, np.shape(apart) + (1,) * (ndim - np.ndim(apart)))


def series_errors(other: Companion | None) -> Metrics:
    """Return the relative L2 error of each time series of a run; inf without another run."""
    if other is None:
        shape = {name: (2,) if "joint" in dims else () for name, (dims, _, _) in SERIES.items()}
        return {name: np.full(shape[name], np.inf) for name in SERIES}
    return {
        name: TIGHTER_DISTANCE_FACTOR * other.closeness * value
        for name, value in other.apart.items()
    }


def missed_targets(
    targets: Sequence[tuple[str, float]], metrics: Mapping[str, Any], error: Mapping[str, Any]
) -> list[str]:
    """Return a message for each metric whose relative bar, at its worst joint, exceeds its target.

    A metric of 0, such as the penetration of an ideal joint, is met by a bar of 0 alone.
    """
    messages = []
    for name, target in targets:
        long = relative_bar(metrics[name], error[name])
        if long > target:
            messages.append(f"{name}: its error bar is {long:.2g} of it, not {target:g}")
    return messages


def relative_bar(metric: Any, bar: Any) -> float:
    """Return the relative length of a metric's error bar at its worst joint; 0 where both are 0."""
    size, length = np.ravel(np.abs(metric)), np.ravel(bar)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.where(length > 0.0, length / size, 0.0).max())

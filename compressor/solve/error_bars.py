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

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from compressor.cases import TIGHTEST, Case
from compressor.metrics import NUMBERS, SERIES
from compressor.solve.request import Metrics
from compressor.solve.run import Solution, run_at_tolerance
from compressor.solve.run_metrics import energy_residual
from compressor.solve.series import distances
from compressor.solve.si_record import is_oiled, length_and_speed

SIDES = "peak_rod_load_tension", "peak_rod_load_compression"

TIGHTER_DISTANCE_FACTOR = 3.0  # of the distance of a time series to a tighter run's
LOOSER, TEN, FALL = 0.37, 10.0, 0.65  # share of a run TEN times looser, and how it falls beyond
FLOOR = 0.1  # of the energy residual, relative to the metric
ORDER = 0.8  # power of the tolerance with which errors fall
# times rtol ** ORDER: a distance of accelerations beyond ten times the usual one
AMPLIFIED_FACTOR = 50.0


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


SWITCHING = 2.0  # times rtol ** ORDER: natural sizes of a state that it may be off by


def switch_errors(
    p: np.record, metrics: Mapping[str, Any], tally: np.record, rtol: float
) -> Metrics:
    """Return how far a run's changes of contact may move the metrics that are shares of time.

    Two runs may agree in the moment of one change by chance; how far a state that is off by the
    tolerance moves it (`physics.onset.shift_of_change`) is known of each. `SWITCHING` holds for 99
    of 100 changes at rtol 1e-5 to 1e-8, by runs at 1e-11.
    """
    if not metrics:
        return {}
    share = SWITCHING * rtol**ORDER * tally["switch_shift"] / (tally["seconds"] or math.nan)
    # the load of an oiled pin does not end where dry contact does
    reversal = 0.0 if is_oiled(p) else math.tau * share[1]
    return {"contact_loss_fraction": share, "rod_load_reversal_angle": reversal}


TIGHTER_FACTOR = 2.5  # times: the run that errors are estimated by
OVERRUN_RTOL = 2e-4  # tolerances from which on explicit steps may run over friction's fast modes
MAX_SPEED_ERROR = 0.02  # the same, of the journals' speed, over friction's stiction velocity
STIFF_TIGHTER = 10.0  # the same at loose tolerances
LOOSER_FACTOR = 3.0  # times: the third run that is compared where a motion enlarges errors


def companion_rtol(p: np.record, rtol: float) -> float | None:
    """Return the tolerance of a run's tighter `comparison_run` by its own method, or None."""
    fits = rtol >= 0.99 * TIGHTER_FACTOR * TIGHTEST and not overruns_friction(p, rtol)
    return rtol / TIGHTER_FACTOR if fits else None


def overruns_friction(p: np.record, rtol: float) -> bool:
    """Return whether explicit steps may run over friction's fast modes or its change of sign.

    Then two explicit runs may agree on a force that friction never has.
    """
    if rtol > OVERRUN_RTOL:
        return True
    rubs = bool(p["friction"]) and bool(p["clearance"].any())
    return rubs and rtol * length_and_speed(p)[1] > MAX_SPEED_ERROR * p["stiction_velocity"]


def comparison_run(case: Case, solution: Solution, timeout: float) -> Solution:
    """Return another run of a case, by which a run's errors are estimated.

    A tighter one; a looser one only where the tolerance leaves no room below it.
    Where explicit steps may run over friction, it is a run by the stiff method.
    """
    tighter, sampled = companion_rtol(solution.p, solution.rtol), case.body is not None
    if tighter is not None:
        return run_at_tolerance(case, tighter, timeout, sampled)
    if overruns_friction(solution.p, solution.rtol):
        stiff = replace(case, solve=replace(case.solve, method="RODAS"))
        return run_at_tolerance(stiff, solution.rtol / STIFF_TIGHTER, timeout, sampled)
    return run_at_tolerance(case, 10.0 * solution.rtol, timeout, sampled)


def looser_comparison_run(
    case: Case, solution: Solution, other: Solution, timeout: float
) -> Solution | None:
    """Return a looser run, by which errors are estimated as well where the motion enlarges them.

    other: its `comparison_run`. None where there is no need, or the run does not reach its end.
    """
    if other.reason or not is_amplified(solution.rtol, distances(solution.samples, other.samples)):
        return None
    looser = run_at_tolerance(case, LOOSER_FACTOR * solution.rtol, timeout, case.body is not None)
    return None if looser.reason else looser


def estimate_errors(solution: Solution, *others: Solution) -> None:
    """Write a run's error bars and the errors of its time series, by other runs of its case.

    The longest by any of them; inf without one that reached its end.
    """
    for one in others:
        one.companions = ()  # so that the runs of a long search are not all in memory
    solution.companions = others
    residual = energy_residual(solution.trajectory.tally)
    switching = switch_errors(
        solution.p, solution.metrics, solution.trajectory.tally, solution.rtol
    )
    companions = [compare_with_run(solution, one) for one in others if not one.reason]
    runs: list[Companion | None] = [*companions] or [None]
    found = [bars(solution.metrics, one, residual, switching) for one in runs]
    solution.bars = longest_bars(found)
    solution.series_errors = longest_bars([series_errors(one) for one in runs])


def compare_with_run(solution: Solution, other: Solution) -> Companion:
    """Return the `Companion` of a run: another one, which reached its end, and their distances."""
    apart = distances(solution.samples, other.samples)
    return Companion(other.metrics, other.rtol / solution.rtol, apart)

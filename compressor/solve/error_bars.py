"""Error bars: how far the numbers of a run may lie from the exact ones (solve/README.md).

The difference from a tighter run is mostly the run's own error; of the difference from a looser one
a share is (`closeness`). A metric's own difference may be small by chance, as may the moment of a
change of contact: the distance of the time series that it is taken from, and how far a state that
is wrong by some tolerances moves it, stand beside it. Shares stand in `compressor.metrics`; they
and the numbers below were chosen on random cases that judge nothing (tests/results/calibration.md).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

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
NOTHING: Metrics = {}
FLOOR = 0.1  # of the energy residual, relative to the metric
ORDER = 0.8  # power of the tolerance with which errors fall
# times rtol ** ORDER: a distance of accelerations beyond ten times the usual one
AMPLIFIED_FACTOR = 50.0


def closeness(ratio: float) -> float:
    """Return the share of the distance to a run that bounds a run's own error."""
    return 1.0 if ratio < 1.0 else LOOSER * (ratio / TEN) ** -FALL


def is_amplified(rtol: float, apart: Mapping[str, Any]) -> bool:
    """Return whether a motion enlarges errors, by its distance from a run at a like tolerance."""
    return bool(apart["acceleration"] > AMPLIFIED_FACTOR * rtol**ORDER)


def ratio_of(share: float) -> float:
    """Return the ratio of tolerances with a closeness; inf where that is 0, by an unknown error."""
    return math.inf if share == 0.0 else TEN * (LOOSER / share) ** (1.0 / FALL)


def bars(
    metrics: Mapping[str, Any], theirs: Mapping[str, Any], ratio: float, apart: Mapping[str, Any],
    residual: float, switching: Mapping[str, Any] = NOTHING,
) -> Metrics:  # fmt: skip
    """Return the error bar of each metric of a run's tally, in its unit and shape, by another run.

    ratio: of that run's tolerance; apart: the distance of each time series; residual: of energy;
    switching: as of `switch_errors`. inf where a series may be wrong by all of itself.
    """
    errors, share = {}, closeness(ratio)
    for name, value in metrics.items():
        metric, ndim = NUMBERS[name], np.ndim(value)
        bar, size = metric.bar, np.ones(np.shape(value)) if metric.is_pure_number else np.abs(value)
        if name in SIDES:  # a small peak is as wrong as the force is
            size = max(metrics[side] for side in SIDES)
        distance = apart[metric.series]
        if np.ndim(distance):  # by joint
            shape = (-1,) + (1,) * (ndim - 1)
            distance = distance.reshape(shape) if "joint" in metric.dims else distance[metric.joint]
        # a metric's own difference may be small by chance, that of its series is not
        difference = bar.own * np.abs(np.asarray(value) - theirs[name])
        error = share * np.hypot(difference, bar.path * distance * size) + switching.get(name, 0.0)
        if not metric.is_pure_number:
            error = np.maximum(error, max(FLOOR * residual, bar.least) * size)
            farthest = np.maximum(distance, apart["acceleration"])
            lost = TIGHTER_DISTANCE_FACTOR * share * farthest >= 1.0
            error = np.where(lost, np.inf, error)
        errors[name] = error
    return errors


def series_errors(ratio: float, apart: Mapping[str, Any]) -> Metrics:
    """Return the relative L2 error of each time series of a run by another: see `bars`."""
    return {
        name: TIGHTER_DISTANCE_FACTOR * closeness(ratio) * value for name, value in apart.items()
    }


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

    Two runs may agree in the moment of one change by chance; how far a state off by the tolerance
    moves it is known of each. `SWITCHING` holds for 99 of 100 changes at rtol 1e-5 to 1e-8.
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


def overruns_friction(p: np.record, rtol: float) -> bool:
    """Return whether explicit steps may run over friction's fast modes, and so agree by chance."""
    if rtol > OVERRUN_RTOL:
        return True
    rubs = bool(p["friction"]) and bool(p["clearance"].any())
    return rubs and rtol * length_and_speed(p)[1] > MAX_SPEED_ERROR * p["stiction_velocity"]


def make_comparison_run(case: Case, solution: Solution, timeout: float) -> Solution:
    """Return another run of a case, by which a run's errors are estimated: a tighter one.

    A looser one where no room is left; one by the stiff method where friction may be overrun.
    """
    rtol = solution.rtol
    if overruns_friction(solution.p, rtol):
        case, rtol = replace(case, solve=replace(case.solve, method="RODAS")), rtol / STIFF_TIGHTER
    elif rtol >= 0.99 * TIGHTER_FACTOR * TIGHTEST:
        rtol /= TIGHTER_FACTOR
    else:
        rtol *= 10.0
    return run_at_tolerance(case, rtol, timeout, case.body is not None)


def estimate_errors(solution: Solution, *others: Solution) -> None:
    """Write a run's error bars, the longest by any other run that reached its end; inf without."""
    for one in others:
        one.companions = ()  # so that the runs of a long search are not all in memory
    solution.companions = others
    numbers, tally, rtol = solution.metrics, solution.trajectory.tally, solution.rtol
    residual, switching = energy_residual(tally), switch_errors(solution.p, numbers, tally, rtol)
    found, errors = [], []
    for other in others:
        if not other.reason:
            ratio, apart = other.rtol / rtol, distances(solution.samples, other.samples)
            found.append(bars(numbers, other.metrics, ratio, apart, residual, switching))
            errors.append(series_errors(ratio, apart))
    shapes = {name: (2,) if "joint" in dims else () for name, (dims, _, _) in SERIES.items()}
    solution.bars = longest_bars(found, {name: np.shape(one) for name, one in numbers.items()})
    solution.series_errors = longest_bars(errors, shapes)


def longest_bars(found: Sequence[Metrics], shapes: Mapping[str, tuple[int, ...]]) -> Metrics:
    """Return the greatest of several bars of each name, inf where there is none."""
    return {
        name: np.maximum.reduce([one[name] for one in found]) if found else np.full(shape, np.inf)
        for name, shape in shapes.items()
    }

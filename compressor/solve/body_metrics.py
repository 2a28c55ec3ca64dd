"""Metrics of the body's motion and of its sensor's record, with error bars by another run.

They are of whole settled revolutions. Noise and jitter of the sensor are drawn by its seed, the
same ones for both runs: a bar measures numerics, not noise.
"""

import math
from dataclasses import replace

import numpy as np

from compressor.cases import Case
from compressor.metrics import NUMBERS
from compressor.outcome import Regime
from compressor.solve.error_bars import closeness, longest_bars
from compressor.solve.request import Metrics
from compressor.solve.run import Solution
from compressor.solve.run_metrics import (
    MAX_BATCHES,
    average_bar,
    count_bar,
    parts,
    standard_error,
)
from compressor.solve.series import rows_of, signals
from compressor.vibration import Forces, Monitored, shake_body


def first_sample(case: Case, solution: Solution) -> int:
    """Return the sample of a run from which on it moves the body: settled where that is steady."""
    assert case.body is not None
    steady = case.body.start == "steady"
    return round(solution.settle / solution.trajectory.times[1]) if steady else 0


def shake_by(case: Case, solution: Solution) -> Monitored:
    """Return what a run that reached its end does to the body, from `first_sample` on."""
    assert case.body is not None
    begin, guide = first_sample(case, solution), case.machine.rod_length_mm / 1e3
    found = signals(rows_of(solution.p, solution.trajectory, part=slice(begin, None)))
    forces = Forces(
        solution.trajectory.times[1], found["shaking_force"], found["guide_moment"],
        np.stack([np.zeros(len(found["guide_force"])), found["guide_force"]], axis=1),
        found["bearing_force"],
    )  # fmt: skip
    return shake_body(case.body, case.sensor, forces, case.turn, guide, solution.settle)


def thresholds(case: Case) -> tuple[float | None, ...]:
    """Return the thresholds over which peaks of the record count."""
    return case.sensor.thresholds if case.sensor else ()


def with_bars(case: Case, solution: Solution, ours: Monitored) -> Metrics:
    """Return the metrics of a run and, as `<metric>_error`, their bars; {} of one without metrics.

    Such is a run whose energy does not balance.
    """
    if not solution.metrics:
        return {}
    metrics: Metrics = {**ours.measure(thresholds(case))}
    errors = bars(case, solution, ours, metrics)
    return metrics | {f"{name}_error": error for name, error in errors.items()}


def bars(case: Case, solution: Solution, ours: Monitored, metrics: Metrics) -> Metrics:
    """Return the error bar of each metric of a run: by its companions, the longest.

    Of a chaotic motion they are 95 % intervals of averages over revolutions, and inf of all else;
    inf also without another run that reached its end. {} where no bars are wanted.
    """
    if not case.wants_bars:
        return {}
    if solution.regime == Regime.CHAOTIC:
        return scatter_bars(case, ours, metrics)
    size = solution.trajectory.times.size
    found = [
        bars_by(case, metrics, ours, shake_by(case, one), closeness(one.rtol / solution.rtol))
        for one in solution.companions if not one.reason and one.trajectory.times.size == size
    ]  # fmt: skip
    return longest_bars(found, {name: np.shape(value) for name, value in metrics.items()})


def bars_by(
    case: Case, metrics: Metrics, ours: Monitored, theirs: Monitored, share: float
) -> Metrics:
    """Return the bar of each metric by another run; share: of the difference that counts.

    As `compressor.solve.error_bars` makes others: of the metric's own difference, and of what the
    difference of the two signals measures. Of a share and of counts that is the record's distance.
    """
    difference = replace(
        ours, velocity=ours.velocity - theirs.velocity, record=ours.record - theirs.record
    )
    apart, other, found = difference.measure(()), theirs.measure(thresholds(case)), {}
    for name, value in metrics.items():
        metric, size = NUMBERS[name], np.abs(value)
        path = apart.get(name, 0.0)
        if metric.is_pure_number:
            path = size * apart["sensor_rms"] / (metrics["sensor_rms"] or math.inf)
        both = np.hypot(metric.bar.own * (value - other[name]), metric.bar.path * path)
        found[name] = np.maximum(share * both, metric.bar.least * size)
    return found


def scatter_bars(case: Case, found: Monitored, metrics: Metrics) -> Metrics:
    """Return the bars of a chaotic motion: of averages by batch means, inf of all else."""
    bars = {name: np.full(np.shape(value), math.inf) for name, value in metrics.items()}
    per_turn = [one.measure(thresholds(case)) for one in found.cut()]
    batches = parts(per_turn, MAX_BATCHES, 1)
    for name, value in metrics.items():
        kind = NUMBERS[name].kind
        if kind not in ("root", "rate") or len(per_turn) < 2:
            continue
        power = 2 if kind == "root" else 1  # of a root the mean square is what is averaged
        means = np.array([
            np.mean([np.asarray(one[name]) ** power for one in batch], axis=0) for batch in batches
        ])  # fmt: skip
        error = np.asarray(average_bar(standard_error(means), len(per_turn)))
        if power == 2:
            size = np.asarray(value)
            bars[name] = np.divide(error, 2.0 * size, out=error.copy(), where=size > 0.0)
        else:
            least = count_bar(np.asarray(value) * len(per_turn)) / len(per_turn)
            bars[name] = np.maximum(error, least)
    return bars

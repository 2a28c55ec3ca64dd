"""Metrics of the body's motion and of its sensor's record, with error bars by another run.

They are of whole settled revolutions. Noise and jitter of the sensor are drawn by its seed, the
same ones for both runs: a bar measures numerics, not noise. The other run's body is moved by
every second sample of its forces, so that what is lost between samples is in the bar, too.
"""

import math

import numpy as np

from compressor.cases import Case
from compressor.metrics import NUMBERS
from compressor.outcome import Regime
from compressor.solve.attempts import Solution
from compressor.solve.error_bars import LOOSER, Metrics, closeness
from compressor.solve.run_metrics import (
    MAX_BATCHES,
    average_bar,
    count_bar,
    parts,
    standard_error,
)
from compressor.solve.series import rows_of, signals
from compressor.vibration import Forces, Monitored, shake_body

THINNING = (2, 3, 5)  # of the other run's samples: the first that divides them, else all are taken


def first_sample(case: Case, solution: Solution) -> int:
    """Return the sample of a run from which on it moves the body: settled where that is steady."""
    assert case.body is not None
    steady = case.body.start == "steady"
    return round(solution.settle / solution.trajectory.times[1]) if steady else 0


def shake_by(case: Case, solution: Solution, rows: np.ndarray, thin: int = 1) -> Monitored:
    """Return what a run that reached its end does to the body, from `first_sample` on.

    rows: observed at all times of the run, (m, WIDE); thin: takes every second of them, and so on.
    """
    assert case.body is not None
    begin, guide = first_sample(case, solution), case.machine.rod_length_mm / 1e3
    found = {name: one[begin::thin] for name, one in signals(rows).items()}
    forces = Forces(
        solution.trajectory.times[1] * thin, found["shaking_force"], found["guide_moment"],
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
    longest = {name: np.zeros(np.shape(value)) for name, value in metrics.items()}
    times = solution.trajectory.times
    begin = round(solution.settle / times[1])
    companions = [
        one for one in solution.companions
        if not one.reason and one.trajectory.times.size == times.size
    ]  # fmt: skip
    for one in companions:
        rows = rows_of(one.p, one.trajectory)
        thin = next((n for n in THINNING if not ((len(rows) - 1) % n or begin % n)), 1)
        theirs = shake_by(case, one, rows, thin)
        share = max(closeness(one.rtol / solution.rtol), LOOSER)  # samples are lost at any rtol
        for name, bar in bars_by(case, metrics, ours, theirs, share).items():
            longest[name] = np.maximum(longest[name], bar)
    if not companions:
        return {name: np.full(np.shape(value), math.inf) for name, value in metrics.items()}
    return longest


def bars_by(
    case: Case, metrics: Metrics, ours: Monitored, theirs: Monitored, share: float
) -> Metrics:
    """Return the bar of each metric by another run; share: of the difference that counts.

    Of the metric's own difference, and of the distance of the signals where it is taken from: a
    segment's in the segment or a neighbour. Counts are made again with thresholds that are as much
    lower, and higher, as the record's peak may be wrong.
    """
    limits, found = thresholds(case), {}
    other = theirs.measure(limits)
    for name, value in metrics.items():
        bar = NUMBERS[name].bar
        apart = distance(name, ours, theirs)
        own = bar.own * (np.asarray(value) - other.get(name, math.nan))
        size = np.abs(value)
        least = bar.least * size if bar.relative else 0.0
        found[name] = np.maximum(share * np.hypot(own, bar.path * apart * size), least)
    if "sensor_counts_per_rev" in found and metrics["sensor_peak"]:
        wrong = found["sensor_peak"] / metrics["sensor_peak"]
        by_run = found["sensor_counts_per_rev"]
        for factor in (1.0 - wrong, 1.0 + wrong):
            moved = [None if one is None else one * factor for one in limits]
            change = np.abs(ours.counts(moved) - metrics["sensor_counts_per_rev"])
            by_run = np.maximum(by_run, change)
        found["sensor_counts_per_rev"] = by_run
    return found


def distance(name: str, ours: Monitored, theirs: Monitored) -> np.ndarray:
    """Return the relative distance of two runs' signals that a metric is taken from, in its shape.

    The velocity's over thinned samples, by which the other one may be given.
    """
    if name == "body_velocity_rms":
        thin = round(len(ours.velocity) / len(theirs.velocity))
        count = min(len(ours.velocity[::thin]), len(theirs.velocity))
        one = ours.velocity[::thin][:count]
        both = one - theirs.velocity[:count], one
        away, size = (np.sqrt(np.mean(v**2, axis=0)) for v in both)
    else:
        count = min(len(ours.record), len(theirs.record))
        one = ours.record[:count]
        both = one - theirs.record[:count], one
        if "segment" in NUMBERS[name].dims:
            # a peak is as wrong as the one sample, a root mean square as all of them
            place = 0 if NUMBERS[name].kind == "greatest" else 1
            away, size = (ours.segments(values)[place] for values in both)
            away = np.maximum(away, np.maximum(np.roll(away, 1), np.roll(away, -1)))
        else:
            away, size = (np.sqrt(np.mean(v**2)) for v in both)
    return np.divide(away, size, out=np.zeros_like(size), where=np.asarray(size) > 0.0)


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

"""The body's motion and its sensor's record, their metrics, and error bars by another run.

Metrics are of whole settled revolutions. Noise and jitter of the sensor are drawn by its seed, the
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
from compressor.solve.run_metrics import average_bar, count_bar, parts, standard_error
from compressor.solve.series import Variables, finer, rows_of, signals, variable
from compressor.vibration import Forces, Monitored, Record, shake_body

BODY = {  # over time and these dimensions: (dimensions, unit, long name)
    "body_displacement": (("axis",), "m", "displacement of the body's mass centre"),
    "body_velocity": (("axis",), "m/s", "velocity of the body's mass centre"),
    "body_acceleration": (("axis",), "m/s2", "acceleration of the body's mass centre"),
    "body_rocking": ((), "rad", "rotation of the body, counter-clockwise"),
}


def foundation(case: Case, solution: Solution) -> tuple[Variables, Metrics]:
    """Return the body's motion on the output grid, the sensor's record in time of its own, metrics.

    All is nan, without record and metrics, of a run that did not reach its end.
    """
    stride, times = finer(case), solution.trajectory.times
    shape = ((times.size - 1) // stride + 1, 2)
    values = {name: np.full(shape[: 1 + len(dims)], math.nan) for name, (dims, *_) in BODY.items()}
    variables: Variables = {
        name: variable(("time", *dims), values[name], unit, phrase)
        for name, (dims, unit, phrase) in BODY.items()
    }
    if solution.trajectory.reason:
        return variables, {}
    shaken, grid = shake_by(case, solution), slice(-first_sample(case, solution) % stride, None)
    motion, axes = shaken.motion, [shaken.motion[axis] for axis in "xy"]
    for name in ("displacement", "velocity", "acceleration"):
        both = np.stack([getattr(axis, name) for axis in axes], axis=1)[grid][::stride]
        values[f"body_{name}"][-len(both) :] = both
    rocking = motion["rocking"].displacement[grid][::stride]
    values["body_rocking"][-len(rocking) :] = rocking
    numbers = measure_body(case, solution, shaken)
    if shaken.recorded:
        variables |= sensor_variables(shaken.recorded)
        numbers["clipped_fraction"] = shaken.recorded.clipped
    return variables, numbers


def sensor_variables(record: Record) -> Variables:
    """Return a sensor's samples and the tacho's pulses, each with a dimension of its own."""
    times, since = ("sensor_time",), "time since the record's begin"
    passes = "times at which the crank passes top dead centre"
    return {
        "sensor_time": variable(times, record.times, "s", since),
        "sensor_acceleration": variable(
            times, record.values, "m/s2", "samples of the accelerometer"
        ),
        "tacho_time": variable(("pulse",), record.tacho, "s", passes),
    }


def first_sample(case: Case, solution: Solution) -> int:
    """Return the sample of a run from which on it moves the body: settled where that is steady."""
    steady = case.body is not None and case.body.start == "steady"
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


def measure_body(case: Case, solution: Solution, ours: Monitored) -> Metrics:
    """Return the metrics of a run and, as `<metric>_error`, their bars, the longest by companions.

    Of a chaotic motion 95 % intervals of averages; inf of all else, and without another run.
    """
    if not solution.metrics:
        return {}
    sensor = case.sensor
    counted = (sensor.threshold_m_per_s2, sensor.second_threshold_m_per_s2) if sensor else ()
    metrics: Metrics = {**ours.measure(counted)}
    if not case.wants_bars:
        return metrics
    if solution.regime == Regime.CHAOTIC:
        bars = scatter_bars(ours, metrics, counted)
    else:
        size, found = solution.trajectory.times.size, []
        for one in solution.companions:
            if not one.reason and one.trajectory.times.size == size:
                share = closeness(one.rtol / solution.rtol)
                found.append(bars_by(metrics, ours, shake_by(case, one), share, counted))
        bars = longest_bars(found, {name: np.shape(value) for name, value in metrics.items()})
    return metrics | {f"{name}_error": bar for name, bar in bars.items()}


def bars_by(
    metrics: Metrics, ours: Monitored, theirs: Monitored, share: float, counted: tuple
) -> Metrics:
    """Return the bar of each metric by another run; share: of the difference that counts.

    Of the metric's own difference, and of what the difference of the two signals measures.
    """
    difference = replace(
        ours, velocity=ours.velocity - theirs.velocity, record=ours.record - theirs.record
    )
    apart, other, found = difference.measure(()), theirs.measure(counted), {}
    for name, value in metrics.items():
        metric, size = NUMBERS[name], np.abs(value)
        path = apart.get(name, 0.0)
        if metric.is_pure_number and metric.when != "body":
            path = size * apart["sensor_rms"] / (metrics["sensor_rms"] or math.inf)
        both = np.hypot(metric.bar.own * (value - other[name]), metric.bar.path * path)
        found[name] = np.maximum(share * both, metric.bar.least * size)
    return found


def scatter_bars(ours: Monitored, metrics: Metrics, counted: tuple) -> Metrics:
    """Return the bars of a chaotic motion: of averages by batch means, inf of all else."""
    bars = {name: np.full(np.shape(value), math.inf) for name, value in metrics.items()}
    per_turn = [one.measure(counted) for one in ours.cut()]
    batches, count = parts(per_turn), len(per_turn)
    for name, value in metrics.items():
        kind, size = NUMBERS[name].kind, np.asarray(value)
        if kind not in ("root", "rate") or count < 2:
            continue
        power = 2 if kind == "root" else 1  # of a root the mean square is what is averaged
        means = np.array([
            np.mean([np.asarray(one[name]) ** power for one in batch], axis=0) for batch in batches
        ])  # fmt: skip
        error = np.asarray(average_bar(standard_error(means), count))
        if kind == "root":
            bars[name] = np.divide(error, 2.0 * size, out=error.copy(), where=size > 0.0)
        else:
            bars[name] = np.maximum(error, count_bar(size * count) / count)
    return bars

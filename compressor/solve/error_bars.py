"""Error bars: how far metrics may lie from the exact ones, by other runs of the same case.

The difference of a metric from a run ten times looser is mostly that run's error, so that a share
of it bounds the metric's own. Beyond `accuracy.LOOSEST` both may take the same wrong course over
friction's fast modes, and a looser run that failed its energy audit says little: there a run ten
times tighter is compared with. Where the tolerance lets it be no looser than LOOSEST, a run a
thousand times looser is a second one, cheap and unlikely to err alike.

Two runs may agree by chance in one metric; there the differences of all the peaks of a run, which
share their causes, and the distance of the journals of the two runs stand in. The energy residual
is a floor. Where the journals have parted, as in chaotic motion, agreement is chance: a larger
share of their distance is a floor. Estimates of an error hold while it is small: a bar of a few
per cent grows beyond them.

Shares stand in `compressor.metrics`. They were chosen on the 200 random cases of
tests/random_cases.py, for bars that hold 95 % of the errors and are at most ten times as long
(median), and on the extreme scenes of `compsim stress`; tests/results/accuracy.json and stress.json
say how far that went (make accuracy, make stress).
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from compressor.cases import Targets
from compressor.metrics import METRICS
from compressor.physics import COLUMNS, Column, observe_all
from compressor.solve.request import Trajectory

Metrics = dict[str, Any]  # by name: a number, or an array over joints (and axes)

FLOOR = 0.1  # of the energy residual, relative to the metric
PARTED, SHARE_PARTED = 0.01, 0.3  # of a journal's room: runs farther apart agree by chance
WHOLE = 1.5  # of the difference to a tighter run, which is mostly the run's own error
FAR, SHARE_FAR = 100.0, 0.04  # times the tolerance: runs beyond; share of their difference
LARGE = 0.015  # of a metric: a bar that long doubles
ROUNDING = 1e-13  # of the metric
INSTANTS = 64  # from the start to the end of a run, at which two runs are compared


class OtherRun(NamedTuple):
    """Another run of a case: its metrics, its tolerance, and how far its journals came apart.

    `distance`: over the journals' room (`journal_distance`).
    """

    metrics: Mapping[str, Any]
    rtol: float
    distance: float = 0.0


def bars(
    metrics: Mapping[str, Any], others: Sequence[OtherRun], rtol: float, residual: float
) -> Metrics:
    """The error bar of each metric of a run at a tolerance, in its unit and shape.

    Without another run every bar is inf. residual: energy imbalance relative to what the contacts
    lose.
    """
    if not others:
        return {name: np.full(np.shape(value), np.inf) for name, value in metrics.items()}
    estimates = [estimate(metrics, other, rtol) for other in others]
    error = {name: np.maximum.reduce([one[name] for one in estimates]) for name in metrics}
    for name in metrics:
        if METRICS[name].bar.relative:
            size = np.abs(metrics[name])
            error[name] = np.maximum(error[name], max(FLOOR * residual, ROUNDING) * size)
            error[name] = grown(error[name], float(np.max(size)))
    return error


def estimate(metrics: Mapping[str, Any], other: OtherRun, rtol: float) -> Metrics:
    """The error of each metric of a run by its difference from one other run."""
    apart = {name: np.abs(np.asarray(metrics[name]) - other.metrics[name]) for name in metrics}
    shared = shared_difference(metrics, apart)
    far, tighter = other.rtol > FAR * rtol, other.rtol < rtol
    distance, weight = (0.0, SHARE_FAR) if far else (other.distance, 1.0)
    parted = SHARE_PARTED * min(distance, 1.0) if distance > PARTED else 0.0
    error = {}
    for name in metrics:
        bar = METRICS[name].bar
        if bar.relative:
            size = np.abs(metrics[name])
            own = WHOLE if tighter else bar.own
            difference = weight * np.hypot(own * apart[name], bar.of_peaks * shared * size)
            error[name] = np.maximum(difference, max(bar.of_path * distance, parted) * size)
        else:
            floor = np.maximum(bar.of_path * distance, parted * np.maximum(metrics[name], 1.0))
            error[name] = np.maximum(weight * apart[name], floor)
    return error


def grown(bar: np.ndarray, size: float) -> np.ndarray:
    """Bars of a metric of some size, long ones longer."""
    return bar * (1.0 + bar / (LARGE * size)) if size > 0.0 else bar


def shared_difference(metrics: Mapping[str, Any], apart: Mapping[str, Any]) -> float:
    """The mean of the relative differences of all peaks but the largest one; 0 where none is."""
    peaks = [name for name, row in METRICS.items() if row.peak]
    size = np.concatenate([np.ravel(np.abs(metrics[name])) for name in peaks])
    moved = np.concatenate([np.ravel(apart[name]) for name in peaks])
    relative = np.sort(moved[size > 0] / size[size > 0])[:-1]
    return float(relative.mean()) if relative.size else 0.0


def unmet(targets: Targets, metrics: Mapping[str, Any], error: Mapping[str, Any]) -> list[str]:
    """What to say of each metric whose relative bar, at its worst joint, is longer than asked for.

    A metric of 0, such as the penetration of an ideal joint, is met by a bar of 0 alone.
    """
    messages = []
    for name, target in targets:
        size, bar = np.ravel(np.abs(metrics[name])), np.ravel(error[name])
        long = bar > target * size
        if long.any():
            with np.errstate(divide="ignore"):
                worst = (bar[long] / size[long]).max()
            messages.append(f"{name}: its error bar is {worst:.2g} of it, not {target:g}")
    return messages


def with_instants(times: np.ndarray) -> np.ndarray:
    """The times of an output grid (s) and those at which runs are compared, whatever the grid."""
    return np.union1d(times, _instants(times[-1]))


def take_instants(p: np.record, run: Trajectory, times: np.ndarray) -> np.ndarray:
    """Eccentricities (m) at the instants of a run on `with_instants(times)`, now put on `times`.

    Shape (INSTANTS + 1, joint, axis); nan from where the run stopped.
    """
    at = np.searchsorted(run.times, _instants(times[-1]))
    rows = np.empty((at.size, COLUMNS))
    observe_all(run.times[at], run.states[at], run.phases[at], p, rows)
    kept = np.searchsorted(run.times, times)
    run.times, run.states, run.phases = times, run.states[kept], run.phases[kept]
    return rows[:, Column.ECCENTRICITY : Column.ECCENTRICITY + 4].reshape(-1, 2, 2)


def journal_distance(p: np.record, ours: np.ndarray, theirs: np.ndarray) -> float:
    """Greatest distance of the eccentricities of two runs at the instants, over the room.

    A journal's room is its clearance, or how far it came if that is more. 0 for ideal joints.
    """
    faulty = p["clearance"] > 0
    away = np.linalg.norm(ours - theirs, axis=2).max(axis=0)
    room = np.maximum(p["clearance"], np.linalg.norm(ours, axis=2).max(axis=0))
    return float((away[faulty] / room[faulty]).max(initial=0.0))


def _instants(end: float) -> np.ndarray:
    return end * (np.arange(INSTANTS + 1) / INSTANTS)

"""Error bars: how far metrics may lie from the exact ones, told by other runs of the same case.

The difference of a metric from a run ten times looser is mostly that run's error, so that a share
of it bounds the metric's own. Beyond `accuracy.LOOSEST` both may take the same wrong course over
friction's fast modes, and a looser run that failed its energy audit tells little: there a run ten
times tighter is asked. Where the tolerance lets it be no looser than LOOSEST, a run a thousand
times looser is a second witness, cheap and unlikely to err alike.

Two runs may agree by chance in one metric; there the differences of all the peaks of a run, which
share their causes, and the distance of the journals of the two runs stand in. The energy residual
is a floor. Where the journals have parted, as in chaotic motion, chance is all there is: a larger
share of their distance is a floor. Estimates of an error hold while it is small: a bar of a few
per cent grows beyond them.

Shares were chosen on the 200 random cases of tests/random_cases.py, for bars that hold 95 % of the
errors and are at most ten times as long (median), and on the extreme scenes of `compsim stress`;
tests/results/accuracy.json and stress.json say how far that went (make accuracy, make stress).
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from compressor.cases import Targets

Metrics = dict[str, Any]  # by name: a number, or an array over joints (and axes)

# Metrics that are the greatest value over time: their relative errors are of one size.
PEAKS = (
    "peak_acceleration",
    "peak_contact_force",
    "peak_contact_force_axis",
    "max_penetration",
)
# Metric -> share of its own difference, of the mean relative difference of the peaks, and of the
# distance of the journals over their room.
SHARES = {
    "peak_acceleration": (0.8, 0.5, 0.02),
    "peak_contact_force": (0.7, 0.6, 0.02),
    "peak_contact_force_axis": (1.0, 0.4, 0.02),
    "max_penetration": (0.8, 0.01, 0.002),
    "rms_acceleration": (0.4, 0.02, 0.003),
    "rms_acceleration_deviation": (0.5, 0.4, 0.02),
}
OWN = {  # seldom wrong: the difference alone holds, or a share of the distance
    "contact_loss_fraction": 0.01,
    "impact_count": 0.0,
}
FLOOR = 0.1  # of the energy residual, relative to the metric
ASTRAY, SHARE_ASTRAY = 0.01, 0.3  # of a journal's room: runs parted farther agree by chance
WHOLE = 1.5  # of the difference to a tighter run, which is mostly the run's own error
FAR, SHARE_FAR = 100.0, 0.04  # times the tolerance: witnesses beyond; share of what they tell
LARGE = 0.015  # of a metric: a bar that long doubles
ROUNDING = 1e-13  # of the metric


class Witness(NamedTuple):
    """Another run of a case: its metrics, its tolerance, and how far its journals came apart.

    `parted`: over the journals' room (`compressor.solve.parting`).
    """

    metrics: Mapping[str, Any]
    rtol: float
    parted: float = 0.0


def bars(
    found: Mapping[str, Any], witnesses: Sequence[Witness], rtol: float, residual: float
) -> Metrics:
    """The error bar of each metric found with a tolerance, in its unit and shape.

    Without a witness every bar is inf. residual: energy imbalance relative to what the contacts
    lose.
    """
    if not witnesses:
        return {name: np.full(np.shape(value), np.inf) for name, value in found.items()}
    told = [testimony(found, witness, rtol) for witness in witnesses]
    error = {name: np.maximum.reduce([bar[name] for bar in told]) for name in found}
    for name in SHARES:
        size = np.abs(found[name])
        error[name] = np.maximum(error[name], max(FLOOR * residual, ROUNDING) * size)
        error[name] = grown(error[name], float(np.max(size)))
    return error


def testimony(found: Mapping[str, Any], witness: Witness, rtol: float) -> Metrics:
    """What one other run tells of the error of each metric."""
    apart = {name: np.abs(np.asarray(found[name]) - witness.metrics[name]) for name in found}
    shared = common(found, apart)
    far, tighter = witness.rtol > FAR * rtol, witness.rtol < rtol
    parted, weight = (0.0, SHARE_FAR) if far else (witness.parted, 1.0)
    astray = SHARE_ASTRAY * min(parted, 1.0) if parted > ASTRAY else 0.0
    told = {}
    for name, of_path in OWN.items():
        floor = np.maximum(of_path * parted, astray * np.maximum(found[name], 1.0))
        told[name] = np.maximum(weight * apart[name], floor)
    for name, (own, of_peaks, of_path) in SHARES.items():
        size = np.abs(found[name])
        share = WHOLE if tighter else own
        estimate = weight * np.hypot(share * apart[name], of_peaks * shared * size)
        told[name] = np.maximum(estimate, max(of_path * parted, astray) * size)
    return told


def grown(bar: np.ndarray, size: float) -> np.ndarray:
    """Bars of a metric of some size, long ones longer."""
    return bar * (1.0 + bar / (LARGE * size)) if size > 0.0 else bar


def common(found: Mapping[str, Any], apart: Mapping[str, Any]) -> float:
    """The mean of the relative differences of all peaks but the largest one; 0 where none is."""
    size = np.concatenate([np.ravel(np.abs(found[name])) for name in PEAKS])
    moved = np.concatenate([np.ravel(apart[name]) for name in PEAKS])
    relative = np.sort(moved[size > 0] / size[size > 0])[:-1]
    return float(relative.mean()) if relative.size else 0.0


def unmet(targets: Targets, found: Mapping[str, Any], error: Mapping[str, Any]) -> list[str]:
    """What to say of each metric whose relative bar, at its worst joint, is longer than asked for.

    A metric of 0, such as the penetration of an ideal joint, is met by a bar of 0 alone.
    """
    said = []
    for name, target in targets:
        size, bar = np.ravel(np.abs(found[name])), np.ravel(error[name])
        long = bar > target * size
        if long.any():
            with np.errstate(divide="ignore"):
                worst = (bar[long] / size[long]).max()
            said.append(f"{name}: its error bar is {worst:.2g} of it, not {target:g}")
    return said

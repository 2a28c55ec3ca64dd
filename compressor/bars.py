"""Error bars: how far metrics may lie from the exact ones, told by a second run.

The difference of a metric between two runs, the second ten times looser, is mostly the second's
error, so that a share of it bounds the first's. Beyond `accuracy.LOOSEST` both may take the same
wrong course over friction's fast modes: there the stiff partner is the second, ten times tighter.

Two runs may agree by chance; there the differences of all the peaks of a run, which share their
causes, stand in. The energy residual is a floor. Where the journals of the two runs have parted, as
in chaotic motion, chance is all there is: a share of their distance is a floor. Shares were chosen
on the 200 random cases of tests/random_cases.py, for bars that hold 95 % of the errors and are at
most ten times as long (median); tests/results/accuracy.json says how far that went (make accuracy).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from compressor.accuracy import Targets

Metrics = dict[str, Any]  # by name: a number, or an array over joints (and axes)

# Metrics that are the greatest value over time: their relative errors are of one size.
PEAKS = (
    "peak_acceleration",
    "peak_contact_force",
    "peak_contact_force_axis",
    "max_penetration",
)
# Metric -> share of its own difference, and of the mean relative difference of the peaks.
SHARES = {
    "peak_acceleration": (0.8, 0.5),
    "peak_contact_force": (0.7, 0.6),
    "peak_contact_force_axis": (1.0, 0.4),
    "max_penetration": (0.8, 0.01),
    "rms_acceleration": (0.4, 0.02),
    "rms_acceleration_deviation": (0.5, 0.4),
}
OWN = ("contact_loss_fraction", "impact_count")  # seldom wrong: the difference alone holds
# The ratio of the two runs' errors falls with the tolerance, from about 12 at 2e-5 to 6 at 2e-8.
STRETCH, STRETCH_FROM, LONGEST_STRETCH = 0.12, 2e-5, 1.4  # per decade below
FLOOR = 0.1  # of the energy residual, relative to the metric
ASTRAY, SHARE_ASTRAY = 0.01, 0.3  # of a journal's room: runs parted farther agree by chance
WHOLE = 1.5  # of the difference to a tighter run, which is mostly the run's own error
ROUNDING = 1e-13  # of the metric


def bars(
    found: Mapping[str, Any],
    other: Mapping[str, Any],
    rtol: float,
    residual: float,
    parted: float = 0.0,
    tighter: bool = False,
) -> Metrics:
    """The error bar of each metric found with a tolerance, in its unit and shape.

    other: the same metrics with ten times the tolerance, or a tenth of it (`tighter`); empty if
    that run failed, which makes every bar inf. residual: energy imbalance relative to what the
    contacts lose. parted: how far the journals of the two runs came apart, over their room.
    """
    if not other:
        return {name: np.full(np.shape(value), np.inf) for name, value in found.items()}
    apart = {name: np.abs(np.asarray(value) - other[name]) for name, value in found.items()}
    shared = common(found, apart)
    stretch = min(max(1.0 + STRETCH * np.log10(STRETCH_FROM / rtol), 1.0), LONGEST_STRETCH)
    astray = SHARE_ASTRAY * min(parted, 1.0) if parted > ASTRAY else 0.0
    floor = max(FLOOR * residual, ROUNDING, astray)
    error = {name: np.maximum(apart[name], astray * np.maximum(found[name], 1.0)) for name in OWN}
    for name, (own, of_peaks) in SHARES.items():
        size = np.abs(found[name])
        share = WHOLE if tighter else own
        error[name] = np.maximum(
            stretch * np.hypot(share * apart[name], of_peaks * shared * size), floor * size
        )
    return error


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

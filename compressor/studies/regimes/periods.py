"""Poincaré points: after how many revolutions they repeat, and how far two sets of them are apart.

Places are eccentricities in units of the clearance. A motion of period p passes p points; whether
it does is told from places at revolutions in a row, whose rates follow from it.
"""

import math

import numpy as np

from compressor.cases import Case

TOLERANCE = 1e-3  # of the clearance: points so near to each other are one
OF_PROMISE = (
    0.2  # of the error of acceleration that accuracy allows: the tolerance, where it is more
)
LONGEST = 16  # rev: period that is looked for
MORE = 4  # revolutions, beyond two periods, in which points are to repeat


def tolerance(case: Case) -> float:
    """Return how near (of the clearance) two Poincaré points of a case are one.

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

    The shortest one, up to 16, of which the last two periods and four revolutions are the same,
    each to the last place of its phase.
    """
    for period in range(1, LONGEST + 1):
        count = 2 * period + MORE
        if count > len(found):
            return None
        last = found[-count:]
        phases = (last[phase::period] for phase in range(period))
        if all(distances(one, one[-1:]).max() <= within for one in phases):
            return period
    return None


def distances(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the distance of every place from every other, (k, l), at the worse joint."""
    away = one[:, None] - other[None, :]
    return np.linalg.norm(away, axis=-1).max(axis=-1)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Return the Hausdorff distance of two sets of places, (k, joint, 2) and (l, joint, 2)."""
    away = distances(one, other)
    return float(max(away.min(axis=1).max(), away.min(axis=0).max()))

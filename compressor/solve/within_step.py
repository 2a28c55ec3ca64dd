"""Where a function of a step crosses zero, and its top, on the step's dense solution."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from compressor.physics import CHOICE, Column

Observer = Callable[[float], np.ndarray]  # returns the row observed at a fraction of a step

ROD_LOAD = int(Column.FORCE) + 2  # at the small end, along x
PEAKED = slice(Column.ACCELERATION, Column.DEVIATION)  # columns whose greatest size is tallied
TOLERANCE = 1e-10  # of a step: as well as a crossing is placed
TOP_LOOKS = 12  # at most, at a top


def find_crossings(
    look: Callable[[float], float], nodes: np.ndarray, values: np.ndarray
) -> list[tuple[float, float]]:
    """Return where in a step a function becomes positive or ceases to be so, and how fast it moves.

    look: the function of the fraction of the step; nodes, values: (m,), where it is known already.
    The places rise; the rates are those of a line between the nodes around each, a step. Where the
    parabola through three neighbours passes zero, its extreme is looked at, too.
    """
    low, high = values.min(), values.max()
    if low > high - low or -high > high - low:
        return []
    points = [(float(node), float(value)) for node, value in zip(nodes, values, strict=True)]
    for left, middle, right in zip(points, points[1:], points[2:], strict=False):
        if (left[1] > 0.0) == (middle[1] > 0.0) == (right[1] > 0.0):
            at, extreme = parabola_of(left, middle, right)
            if left[0] < at < right[0] and extreme * middle[1] <= 0.0:
                points = sorted({*points, (at, look(at))})
    found = []
    for (begin, before), (end, after) in pairwise(points):
        if (before > 0.0) == (after > 0.0):
            continue
        low, high = begin, end
        while high - low > TOLERANCE:
            at = 0.5 * (low + high)
            if (look(at) > 0.0) == (after > 0.0):
                high = at
            else:
                low = at
        found.append((0.5 * (low + high), (after - before) / (end - begin)))
    return found


def share_above(begin: float, crossings: list[tuple[float, float]]) -> float:
    """Return the share of a step in which a function is positive; begin: its value at the begin."""
    lengths = np.diff([0.0, *(at for at, _ in crossings), 1.0])
    return float(lengths[0 if begin > 0.0 else 1 :: 2].sum())


def parabola_of(
    left: tuple[float, float], middle: tuple[float, float], right: tuple[float, float]
) -> tuple[float, float]:
    """Return the place and the value of the extreme of the parabola through three points.

    nan of a straight line.
    """
    one, other = left[0] - middle[0], right[0] - middle[0]
    slope_left, slope_right = (left[1] - middle[1]) / one, (right[1] - middle[1]) / other
    curvature = (slope_right - slope_left) / (other - one)
    if curvature == 0.0:
        return math.nan, math.nan
    at = -0.5 * (slope_left - curvature * one) / curvature
    return middle[0] + at, middle[1] - curvature * at**2


def find_top(
    look: Callable[[float], float], nodes: np.ndarray, values: np.ndarray, known: float
) -> float:
    """Return the greater of `known` and the greatest value of a function over a step.

    Its values at nodes count, and looks at the tops of parabolas, as long as these are above it.
    look, nodes, values: as of `find_crossings`.
    """
    i = int(np.clip(values.argmax(), 1, values.size - 2))
    known = max(known, float(values.max()))
    points = [(float(nodes[k]), float(values[k])) for k in (i - 1, i, i + 1)]
    for _ in range(TOP_LOOKS):
        at, top = parabola_of(*points)
        if not (top > known and points[0][0] < at < points[2][0]) or at == points[1][0]:
            break
        points = sorted([*points, (at, look(at))])
        best = max((1, 2), key=lambda k: points[k][1])
        points = points[best - 1 : best + 2]
        known = max(known, points[1][1])
    return known


def look_at_step(
    p: np.record, observe: Observer, nodes: np.ndarray, rows: np.ndarray, tally: np.record,
    sides: np.ndarray,
) -> None:  # fmt: skip
    """Raise peaks under chosen forces by the tops within a step, and write the rod load's sides.

    rows: observed at nodes, (m, COLUMNS); sides: (4,), as `tally_step` takes them, where the tally
    has a rod load.
    """
    if p["laws"].size >= CHOICE:
        sizes = np.abs(rows[:, PEAKED])
        # a parabola rises above neighbours by less than half their range
        may_beat = 1.5 * sizes.max(axis=0) - 0.5 * sizes.min(axis=0) > tally["peak"]
        for k in np.flatnonzero(may_beat).tolist():

            def look_at_size(s: float, column: int = Column.ACCELERATION + k) -> float:
                return abs(float(observe(s)[column]))

            known = float(tally["peak"][k])
            tally["peak"][k] = find_top(look_at_size, nodes, sizes[:, k], known)
    if not tally["has_rod_load"]:
        return
    for side, sign in enumerate((1.0, -1.0)):
        loads = sign * rows[:, ROD_LOAD]

        def look(s: float, sign: float = sign) -> float:
            return sign * float(observe(s)[ROD_LOAD])

        sides[side] = share_above(loads[0], find_crossings(look, nodes, loads))
        sides[2 + side] = find_top(look, nodes, loads, float(tally["side_peak"][side]))

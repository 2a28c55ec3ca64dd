"""The tally: an accumulator of a run's metrics and energy ledger, from rows observed at its steps.

`tally_step` takes rows at the Gauss-Lobatto nodes of a step's dense solution, so that a peak
between two output samples counts; `tally_energy` audits the energy at every step's end.
"""

import math
from typing import NamedTuple

import numpy as np

from compressor.physics._jit import inline_llvm, inline_once, jit
from compressor.physics.contact_laws import has_chosen_laws, in_contact
from compressor.physics.observe import (
    ACCELERATION,
    CRANK_POWER,
    DEVIATION,
    FORCE,
    KINETIC,
    NORMAL,
    PACE,
    PENETRATION,
    POTENTIAL,
    Column,
)
from compressor.physics.record import zero

# of a peak: nodes between which a step resolved to its tolerance may rise above it
PEAK_NEARNESS = 0.98
# column of the force on the small end along x, positive in tension; no `int`, for each value of
# which numba would compile what it is given to anew
ROD_LOAD = np.int64(FORCE + 2)


def lobatto(n):
    """Return nodes in [0, 1], both ends included, and weights of Gauss-Lobatto quadrature."""
    legendre = np.polynomial.legendre.Legendre.basis(n - 1)
    inner = np.sort(legendre.deriv().roots().real)
    nodes = np.concatenate(([-1.0], inner, [1.0]))
    weights = 2.0 / (n * (n - 1) * legendre(nodes) ** 2)
    nodes, weights = (nodes + 1.0) / 2.0, weights / 2.0
    for fixed in (nodes, weights):  # as global arrays are in compiled code: of one type from Python
        fixed.setflags(write=False)
    return nodes, weights


# columns that a march writes at each node of a step
IN_STEPS = (*range(ACCELERATION, CRANK_POWER), PACE)


def require_written(*columns):
    """Return columns as integers. Raises ValueError for one that a step does not write."""
    for column in columns:
        if column not in IN_STEPS:
            raise ValueError(f"{Column(column).name} is not written at each node of a step")
    return tuple(int(column) for column in columns)


MEANS = require_written(Column.CRANK_TORQUE, Column.GUIDE_MOMENT)
SQUARES = require_written(Column.ACCELERATION, Column.DEVIATION)
GREATEST = require_written(*range(ACCELERATION, DEVIATION))  # one beside the other
PEAKED = len(GREATEST)
SUM, PEAK, KEPT = "sum", "peak", "kept"


class Field(NamedTuple):
    """A number of a tally; SUM or PEAK of what began anew at each cut, or KEPT from the start."""

    name: str
    merge: str
    shape: tuple = ()
    kind: str = "f8"
    begin: float = 0.0


FIELDS = (
    Field("seconds", SUM),  # of machine time measured
    Field("steady_seconds", SUM),  # that a steady crank takes for the same angle
    Field("integral", SUM, (len(MEANS),)),  # of MEANS over time
    Field("square", SUM, (len(SQUARES),)),  # of SQUARES, their squares
    Field("peak", PEAK, (PEAKED,)),  # of GREATEST, their sizes
    Field("top", KEPT, (PEAKED,)),  # the same at the present step's nodes
    Field("max_penetration", PEAK, (2,), begin=-math.inf),
    Field("loss_seconds", SUM, (2,)),
    # contacts that began after flight, the journal being off its bore; and inside the penetration
    Field("impacts", SUM, (2,), "i8"),
    Field("releases", SUM, (2,), "i8"),
    Field("touching", KEPT, (2,), "i8", 1),  # until it is seen apart
    Field("flown", KEPT, (2,), "i8"),  # whether the journal was off its bore since the last contact
    Field("deepest", KEPT, (2,), begin=-math.inf),  # penetration over the whole run
    Field("energy", KEPT),  # at the start
    Field("crank_work", KEPT),
    Field("load_work", KEPT),
    Field("contact_work", KEPT),  # of the normal forces, springs and losses; film and rod too
    Field("friction_loss", KEPT),
    Field("worst_imbalance", KEPT),  # J
    Field("peak_kinetic", KEPT),
    Field("started", KEPT, (), "i8"),
    # s by which changes of contact move, in all, where the state is off by its natural size
    Field("switch_shift", SUM, (2,)),
    Field("has_rod_load", KEPT, (), "i8"),  # whether the rod load, x at the small end, is tallied
    Field("side_peak", PEAK, (2,)),  # its greatest tension and compression, N
    Field("side_seconds", SUM, (2,)),  # that a steady crank takes while it is above and below zero
)
TALLY = np.dtype([(field.name, field.kind, field.shape) for field in FIELDS], align=True)


def new_tally(has_rod_load=False):
    """Return an empty tally; has_rod_load: whether the rod load is tallied."""
    tally = zero(TALLY)
    for field in FIELDS:
        tally[field.name] = field.begin
    tally["has_rod_load"] = has_rod_load
    return tally


def cut_tally(tally):
    """Return a copy of a tally, which begins anew but for what is KEPT."""
    before = tally.copy()
    for field in FIELDS:
        if field.merge != KEPT:
            tally[field.name] = field.begin
    return before


def merge_tallies(tallies):
    """Return one tally of several parts of a run in a row."""
    whole = tallies[-1].copy()
    for field in FIELDS:
        parts = [one[field.name] for one in tallies]
        if field.merge != KEPT:
            whole[field.name] = sum(parts) if field.merge == SUM else np.max(parts, axis=0)
    return whole


@inline_llvm
def vertex(left, right, before, here, after):
    """Return the top of the parabola through three values, or the middle one without a top."""
    slope_left = (before - here) / left
    slope_right = (after - here) / right
    curvature = (slope_right - slope_left) / (right - left)
    if curvature < 0.0:
        slope = slope_left - curvature * left
        at = -0.5 * slope / curvature
        if left < at < right:
            return here + 0.5 * slope * at
    return here


@inline_llvm
def extreme_of(left, right, before, here, after):
    """Return place and value of the extreme of the parabola through three values, or nan."""
    slope_left = (before - here) / left
    slope_right = (after - here) / right
    curvature = (slope_right - slope_left) / (right - left)
    at = -0.5 * (slope_left - curvature * left) / curvature if curvature != 0.0 else math.nan
    return at, here - curvature * at * at


@inline_llvm
def may_exceed(top, known):
    """Return whether a parabola through nodes of greatest `top` may rise above a known peak."""
    return 2.0 * top >= known


@inline_llvm
def peak_of(nodes, rows, every, column, known):
    """Return the greater of `known` and the largest value of a column over a step.

    Of nodes, `every` first, second, ..., and the parabola through the best; of GREATEST |value|.
    """
    last, size = nodes.size - 1, column < DEVIATION
    best, top = 0, -math.inf
    for i in range(0, last + 1, every):
        value = abs(rows[i, column]) if size else rows[i, column]
        if value > top:
            best, top = i, value
    if not may_exceed(top, known):
        return max(top, known)
    i = min(max(best, every), last - every)
    before, here, after = rows[i - every, column], rows[i, column], rows[i + every, column]
    if size:
        before, here, after = abs(before), abs(here), abs(after)
    left, right = nodes[i - every] - nodes[i], nodes[i + every] - nodes[i]
    return max(top, known, vertex(left, right, before, here, after))


@inline_llvm
def add_peaks(nodes, rows, every, tally, p):
    """Raise the tally's peaks by the nodes of a step, and by parabolas through them.

    Chosen forces, such as a card's, may ripple between nodes: a march looks for their tops.
    """
    for k in range(PEAKED):
        if has_chosen_laws(p):
            tally.peak[k] = max(tally.peak[k], tally.top[k])
        elif may_exceed(tally.top[k], tally.peak[k]):
            tally.peak[k] = peak_of(nodes, rows, every, ACCELERATION + k, tally.peak[k])


@inline_llvm
def tally_energy(row, flows, tally):
    """Write the energy flows so far, (4,) J, and the worst imbalance since the first call."""
    energy = row[KINETIC] + row[POTENTIAL]
    if not tally.started:
        tally.energy = energy
        tally.started = 1
    tally.crank_work, tally.load_work = flows[0], flows[1]
    tally.contact_work, tally.friction_loss = flows[2], flows[3]
    tally.peak_kinetic = max(tally.peak_kinetic, row[KINETIC])
    gain = energy - tally.energy
    imbalance = abs(gain - flows[0] - flows[1] + flows[2] + flows[3])
    if not imbalance <= tally.worst_imbalance:  # so that a nan is kept
        tally.worst_imbalance = imbalance


@jit
def add_flows(rows, weights, span, flows):
    """Add to flows, (4,) J, the quadrature of the powers at a step's nodes; span in s."""
    for k in range(4):
        for i in range(rows.shape[0]):
            flows[k] += span * weights[i] * rows[i, CRANK_POWER + k]


@inline_once
def may_beat_peaks(rows, middle, tally):
    """Return whether a peak may be beaten within a step, by its first, middle and last row."""
    last = rows.shape[0] - 1
    for k in range(PEAKED):
        column = ACCELERATION + k
        top = max(abs(rows[0, column]), abs(rows[middle, column]), abs(rows[last, column]))
        if 0.0 < top >= PEAK_NEARNESS * tally.peak[k]:
            return True
    for joint in range(2):
        column = PENETRATION + joint
        top = max(rows[0, column], rows[middle, column], rows[last, column])
        if 0.0 < top >= PEAK_NEARNESS * tally.max_penetration[joint]:
            return True
    return False


@inline_llvm
def gap_fraction_between(before, after):
    """Return the share without contact of the way between two nearnesses, by a straight line."""
    low, high = min(before, after), max(before, after)
    if high <= 0.0:
        return 1.0
    return low / (low - high) if low < 0.0 else 0.0


@inline_once
def tally_contact(joint, span, nodes, rows, every, gap_fraction, measured, tally):
    """Add a step's contact loss, impacts, releases and penetration at one joint."""
    touching, flown = tally.touching[joint], tally.flown[joint]
    for i in range(0, nodes.size, every):
        depth = rows[i, PENETRATION + joint]
        touches = 1 if in_contact(rows[i, NORMAL + joint]) else 0
        if depth < 0.0:
            flown = 1
        if measured and touches > touching:  # a contact begins
            tally.impacts[joint] += flown
            tally.releases[joint] += 1 - flown
        touching = touches
        if touches:
            flown = 0
        tally.deepest[joint] = max(tally.deepest[joint], depth)
    tally.touching[joint], tally.flown[joint] = touching, flown
    if measured:
        known = tally.max_penetration[joint]
        tally.max_penetration[joint] = peak_of(nodes, rows, every, PENETRATION + joint, known)
        tally.loss_seconds[joint] += gap_fraction[joint] * span


@inline_llvm
def tally_step(span, nodes, weights, rows, every, gap_fraction, sides, measured, tally, p):
    """Add one step (or part of one) of length span (s) to the tally.

    rows: at the nodes; every: 1, or 2 where only the first, third, ... is filled, with `weights`
    zero at the others; gap_fraction: share without contact, by joint; sides: as of `measure_sides`;
    measured: whether the metrics count. span is that of a steady crank; what is tallied are shares
    and means of the time that passes.
    """
    more = 0.0
    for i in range(0, nodes.size, every):
        more += weights[i] * (rows[i, PACE] - 1.0)
    seconds = span * (1.0 + more)
    for joint in range(2):
        if p.clearance[joint] > 0.0:
            tally_contact(joint, seconds, nodes, rows, every, gap_fraction, measured, tally)
    if not measured:
        return
    tally.seconds += seconds
    tally.steady_seconds += span
    for k in range(PEAKED):
        tally.top[k] = 0.0
    for i in range(0, nodes.size, every):
        weight = span * weights[i] * rows[i, PACE]
        for k in range(len(MEANS)):
            tally.integral[k] += weight * rows[i, MEANS[k]]
        for k in range(len(SQUARES)):
            tally.square[k] += weight * rows[i, SQUARES[k]] ** 2
        for k in range(PEAKED):
            tally.top[k] = max(tally.top[k], abs(rows[i, ACCELERATION + k]))
    add_peaks(nodes, rows, every, tally, p)
    if tally.has_rod_load:
        for side in range(2):
            tally.side_seconds[side] += span * sides[side]
            tally.side_peak[side] = max(tally.side_peak[side], sides[2 + side])


@jit
def tally_each(spans, nodes, weights, rows, every, gaps, sides, measured, tally, p):
    """Add steps one after the other as `tally_step` adds one; arrays have a row for each step."""
    for n in range(spans.size):
        tally_step(spans[n], nodes, weights, rows[n], every, gaps[n], sides[n], measured, tally, p)

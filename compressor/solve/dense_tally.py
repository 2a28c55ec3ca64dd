"""Tally the steps of a solution that is known at all times: an ideal machine's, or SciPy's.

Nothing here is the compiled march's but the accumulator. Between a step's nodes, peaks and
changes of sign are looked for in windows of time: at POINTS times in each, then between the
neighbours of what is found.
"""

import math
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from compressor.physics import (
    FLOWS,
    ROD_LOAD,
    Column,
    Load,
    add_flows,
    lobatto,
    new_tally,
    sample_segments,
    segments,
    tally_each,
    tally_energy,
)
from compressor.reasons import Reason
from compressor.solve.request import SAME_TIME, Trajectory, revolutions, split_segments
from compressor.solve.series import rows_at
from compressor.solve.si_record import length_and_speed, natural_sizes

# returns the rows at times (s), (k, COLUMNS), of states that may be moved, (n, k)
Observer = Callable[..., np.ndarray]
Look = Callable[[np.ndarray], np.ndarray]  # returns the values of a function at times (s)

NODES, WEIGHTS = lobatto(9)  # steps may be long
PEAKED = slice(Column.ACCELERATION, Column.DEVIATION)  # columns whose greatest size is tallied
POINTS = 17
FOR_CHANGES, FOR_TOPS = 8, 4  # rounds: windows shrink 16-fold in each, or 8-fold
SMALL_CHANGE = 1e-6  # of a state's natural size: by which a change of contact is moved
KICK = 30.0  # tolerances of speed: what a contact within one step may add unseen
NEAR_TOP = 0.99  # of the greatest value known: nodes below are under no greater top


def narrow(
    look: Look, low: np.ndarray, high: np.ndarray, rounds: int, pick: Callable
) -> tuple[np.ndarray, np.ndarray]:
    """Return windows of time (s), (k,), after some rounds of looks into each."""
    for _ in range(rounds if low.size else 0):
        times = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, POINTS)
        begin, end = pick(look(times.ravel()).reshape(times.shape))
        each = np.arange(low.size)
        low, high = times[each, begin], times[each, end]
    return low, high


def find_changes(
    look: Look, times: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return when (s) a function changes its sign, and the rate of a line there."""

    def pick(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # around the first change
        above = values > 0.0
        at = np.maximum((above != above[:, :1]).argmax(axis=1), 1)
        return at - 1, at

    at = np.flatnonzero(np.diff(values > 0.0))
    low, high = narrow(look, times[at], times[at + 1], FOR_CHANGES, pick)
    return 0.5 * (low + high), np.diff(values)[at] / np.diff(times)[at]


def shares_above(steps: np.ndarray, begin: float, changes: np.ndarray) -> np.ndarray:
    """Return the share of each step in which a function is positive, by its changes (s)."""
    times = np.concatenate((steps[:1], changes, steps[-1:]))
    passed = np.diff(times)
    passed[1 if begin > 0.0 else 0 :: 2] = 0.0
    return np.diff(np.interp(steps, times, np.append(0.0, passed.cumsum()))) / np.diff(steps)


def find_tops(look: Look, times: np.ndarray, values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the greatest values of functions, (c,), at times (m,) and between them, or `known`."""
    top = np.maximum(known, values.max(axis=0))
    inner = values[1:-1]
    high = (inner > NEAR_TOP * top) & (inner >= values[:-2]) & (inner >= values[2:])
    at, column = np.nonzero(high)

    def pick(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # around the greatest
        at = np.clip(values.argmax(axis=1), 1, POINTS - 2)
        return at - 1, at + 1

    def look_at_own(times: np.ndarray) -> np.ndarray:
        return look(times)[np.arange(times.size), np.repeat(column, times.size // column.size)]

    if at.size:
        begin, end = narrow(look_at_own, times[at], times[at + 2], FOR_TOPS, pick)
        np.maximum.at(top, column, look_at_own(0.5 * (begin + end)))
    return top


def tally_steps(
    p: np.record, tally: np.record, steps: np.ndarray, observe: Observer, measured: bool
) -> np.ndarray:
    """Add steps of one phase, by their ends (s), to a tally; return the rows, (m, 9, COLUMNS)."""
    spans = np.diff(steps)
    times = np.append((steps[:-1, None] + spans[:, None] * NODES[:-1]).ravel(), steps[-1])
    rows, gaps, sides = observe(times), np.zeros((spans.size, 2)), np.zeros((spans.size, 4))

    def above(
        column: int | np.int64, sign: float = 1.0
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the share of each step in which a column is positive, its changes and rates."""
        values = sign * rows[:, column]
        found = find_changes(lambda at: sign * observe(at)[:, column], times, values)
        return shares_above(steps, values[0], found[0]), *found

    def tops(look: Callable[[np.ndarray], np.ndarray], known: np.ndarray) -> np.ndarray:
        return find_tops(lambda at: look(observe(at)), times, look(rows), known)

    if measured:
        tally["peak"] = tops(lambda rows: np.abs(rows[:, PEAKED]), tally["peak"])
        for joint in np.flatnonzero(p["clearance"] > 0.0).tolist():
            shares, changes, rates = above(Column.NEARNESS + joint)
            gaps[:, joint] = 1.0 - shares
            for change in zip(changes, rates, strict=True):
                tally["switch_shift"][joint] += shift_of_change(p, joint, observe, *change)
    if measured and tally["has_rod_load"]:  # without load the rod is on neither side
        sides[:, 0], sides[:, 1] = above(ROD_LOAD)[0], above(ROD_LOAD, -1.0)[0]
        sides[:, 2:] = tops(lambda rows: rows[:, [ROD_LOAD]] * (1.0, -1.0), tally["side_peak"])
    last = NODES.size - 1
    of_steps = rows[last * np.arange(spans.size)[:, None] + np.arange(NODES.size)]
    tally_each(spans, NODES, WEIGHTS, of_steps, 1, gaps, sides, measured, tally, p)
    return of_steps


def shift_of_change(p: np.record, joint: int, observe: Observer, time: float, rate: float) -> float:
    """Return by how much (s) a change of contact moves for a state off by its natural size."""
    small = SMALL_CHANGE * np.diag(natural_sizes(p))
    moved = np.hstack((np.zeros((len(small), 1)), small))
    near = observe(np.full(1 + len(small), time), moved)[:, Column.NEARNESS + joint]
    return float(np.linalg.norm(near[1:] - near[0]) / SMALL_CHANGE / abs(rate))


def find_missed_contact(
    p: np.record, rtol: float, steps: np.ndarray, rows: np.ndarray
) -> tuple[float, str] | None:
    """Return where (s) the first step begins that holds a whole contact of some impulse; words."""
    normal, spans = rows[..., Column.NORMAL : Column.NEARNESS], np.diff(steps)
    whole = (normal > 0.0).any(axis=1) & (normal[:, 0] <= 0.0) & (normal[:, -1] <= 0.0)
    if not whole.any():
        return None
    impulse = np.where(whole, spans[:, None] * (WEIGHTS @ normal), 0.0).max(axis=1)
    kick = impulse / min(p.rod_mass, p.reciprocating_mass)
    missed = np.flatnonzero(kick > KICK * rtol * length_and_speed(p)[1])
    if not missed.size:
        return None
    begin, span, force = steps[missed[0]], spans[missed[0]], normal[missed[0]].max()
    text = f"a contact of {force:.2g} N within one step of {span:.2g} s from {begin:.6g} s"
    return float(begin), text


def closed_form(
    p: np.record, times: np.ndarray, settle: float, pieces: int, timeout: float, has_rod_load: bool
) -> Trajectory:
    """Return the trajectory of ideal joints over an output grid, without integration.

    pieces: into which each stretch between load corners, or each revolution in it, is cut, but a
    card's, which is cut at its nodes.
    """
    deadline, began = time.monotonic() + timeout, time.perf_counter()
    turn, states = math.tau / float(p["omega"]), np.zeros((times.size, 4))
    edges, phases = segments(p, float(times[-1]))
    at_samples = phases[sample_segments(times, edges)]
    result = Trajectory(times, states, at_samples, new_tally(has_rod_load))
    cuts = settle, *revolutions(0.0, times[-1], turn)
    edges, phases, (settle, *_) = split_segments(edges, phases, cuts)
    nodes = np.empty(0)
    if p["load"] == Load.CARD:  # whose curve is of pieces between its nodes
        nodes = np.arange(0.0, times[-1] / turn, 1.0 / len(p["card"])) * turn
    flows = np.zeros(FLOWS)

    def observe(phase: int, times: np.ndarray) -> np.ndarray:
        return rows_at(p, times, np.zeros((times.size, 4)), phase)

    tally_energy(observe(phases[0], times[:1])[0], flows, result.tally)
    for begin, end, phase in zip(edges[:-1], edges[1:], phases, strict=True):
        if time.monotonic() > deadline:
            result.reason = Reason.BUDGET_SECONDS
            result.stop_time, states[times >= begin] = float(begin), math.nan
            break
        steps = np.linspace(begin, end, pieces + 1)
        if nodes.size:
            inside = nodes[(nodes > begin + SAME_TIME * turn) & (nodes < end - SAME_TIME * turn)]
            steps = np.array([begin, *inside, end])
        look = partial(observe, phase)
        rows = tally_steps(p, result.tally, steps, look, bool(begin >= settle))
        for span, row in zip(np.diff(steps), rows, strict=True):
            add_flows(row, WEIGHTS, span, flows)
            tally_energy(row[-1], flows, result.tally)
    result.seconds = time.perf_counter() - began
    return result

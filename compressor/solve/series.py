"""The time series of a run, and how far those of two runs of a case are apart.

Two runs are compared at the same times, whatever is stored of either: `A_TURN` times a revolution.
Their distance is a relative L2 norm over the settled part, sqrt(sum |a - b|^2 / sum |a|^2); of a
vector its length counts.
"""

import math
from functools import cache

import numpy as np

from compressor.cases import Case
from compressor.metrics import SERIES, SIZES
from compressor.physics import COLUMNS, WIDE, Column, is_featured, observe_all
from compressor.solve.request import Trajectory

COLUMN = {
    "displacement": Column.DISPLACEMENT,
    "velocity": Column.VELOCITY,
    "acceleration": Column.ACCELERATION,
    "rod_angle": Column.ROD_ANGLE,
    "piston_force": Column.PISTON_FORCE,
    "contact_force": Column.FORCE,
    "eccentricity": Column.ECCENTRICITY,
    "penetration": Column.PENETRATION,
}
A_TURN = 150  # times a revolution at which two runs are compared
OF_A_PERIOD = 24  # samples of the forces in one of the body's fastest motion
FEWEST, MOST = 64, 20_000  # of these times over a settled part


def rows_of(p: np.record, run: Trajectory) -> np.ndarray:
    """Return the observed rows of a run at its times, (m, COLUMNS); nan from where it stopped.

    Of a mechanism with features (m, WIDE), with what its guide bears.
    """
    rows = np.empty((run.times.size, WIDE if is_featured(p) else COLUMNS))
    observe_all(run.times, run.states, run.phases, p, rows)
    rows[np.isnan(run.states).any(axis=1)] = math.nan
    return rows


def finer(case: Case) -> int:
    """Return how many times finer than the output grid forces are sampled for the body and its
    sensor.
    """
    body = case.body
    if body is None:
        return 1
    natural = (body.frequency_x_Hz, body.frequency_y_Hz, body.frequency_rocking_Hz)
    rate = OF_A_PERIOD * max(natural)
    if case.sensor is not None:
        from compressor.vibration import analogue_rate

        rate = max(rate, analogue_rate(body, case.sensor))
    return max(1, math.ceil(rate * case.duration / round(case.steps) * (1 - 1e-12)))


def block(name: str, rows: np.ndarray) -> np.ndarray:
    """Return a time series from observed rows, shape (m,), (m, joint) or (m, joint, axis)."""
    shape = tuple(SIZES[dim] for dim in SERIES[name][0])
    column = COLUMN[name]
    return rows[:, column : column + math.prod(shape)].reshape(-1, *shape)


def compared_times(case: Case) -> np.ndarray:
    """Return the times (s) at which runs of a case are compared, from where it has settled to its
    end.

    In each whole revolution at the same angles, so that revolutions can be compared, too.
    """
    span = case.duration - case.settle
    each = a_turn(case)
    step = case.turn / each if each else span / FEWEST
    count = max(1, int(span / step * (1 + 1e-12)))
    return case.settle + step * (np.arange(count) + 0.5)  # off the corners of the load


def a_turn(case: Case) -> int:
    """Return how many of these times a revolution has; 0 where the run settles within no whole
    one.
    """
    revolutions = (case.duration - case.settle) / case.turn
    return round(min(A_TURN, max(1.0, MOST / revolutions))) if revolutions >= 1.0 else 0


def take_samples(p: np.record, run: Trajectory, times: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return the observed rows at some of a run's times; the run keeps its samples at others.

    times, kept: subsets of `run.times`, s.
    """
    whole, rows = (run.times, run.states, run.phases), np.empty((0, COLUMNS))
    if times.size:
        at = np.searchsorted(run.times, times)
        run.times, run.states, run.phases = (array[at] for array in whole)
        rows = rows_of(p, run)
    if kept.size < whole[0].size:
        stay = np.searchsorted(whole[0], kept)
        whole = whole[0][stay], whole[1][stay], whole[2][stay]
    run.times, run.states, run.phases = whole
    return rows


@cache
def places() -> tuple[np.ndarray, np.ndarray, dict[str, int | slice]]:
    """Return where `distances` finds what it sums: columns, where each sum begins, and sums by
    name.

    A vector's squares are one sum; a series over joints has two.
    """
    columns: list[int] = []
    starts: list[int] = []
    sums: dict[str, int | slice] = {}
    for name, (dims, _, _) in SERIES.items():
        count = math.prod(SIZES[dim] for dim in dims)
        joints = SIZES["joint"] if "joint" in dims else 1
        begin = len(starts)
        starts += range(len(columns), len(columns) + count, count // joints)
        columns += range(COLUMN[name], COLUMN[name] + count)
        sums[name] = slice(begin, begin + joints) if "joint" in dims else begin
    return np.array(columns), np.array(starts), sums


def distances(ours: np.ndarray, theirs: np.ndarray) -> dict[str, np.ndarray]:
    """Return the relative L2 distance of each time series of two runs, by joint where it has one.

    ours, theirs: observed rows at the same times, (m, COLUMNS). 0 where both are 0.
    """
    columns, starts, sums = places()
    apart = ours - theirs
    away = np.add.reduceat(np.einsum("ij,ij->j", apart, apart)[columns], starts)
    size = np.add.reduceat(np.einsum("ij,ij->j", ours, ours)[columns], starts)
    found = np.sqrt(np.divide(away, size, out=np.zeros_like(away), where=size > 0.0))
    return {name: found[place] for name, place in sums.items()}


def journal_distance(p: np.record, ours: np.ndarray, theirs: np.ndarray) -> float:
    """Return the greatest distance of the eccentricities of two runs, over the room; 0 for ideal
    joints.

    ours, theirs: observed rows at the same times. A journal's room is its clearance, or how far it
    came if that is more.
    """
    one, other = block("eccentricity", ours), block("eccentricity", theirs)
    faulty = p["clearance"] > 0
    away = np.linalg.norm(one - other, axis=2).max(axis=0)
    room = np.maximum(p["clearance"], np.linalg.norm(one, axis=2).max(axis=0))
    return float((away[faulty] / room[faulty]).max(initial=0.0))

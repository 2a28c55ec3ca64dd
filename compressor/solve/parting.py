"""How far two runs of one case part: the greatest distance of their journals, over the room.

Runs are looked at at the same times whatever their output grid is, so that what is made of the
distance does not depend on it.
"""

import numpy as np

from compressor.physics import COLUMNS, Column, observe_all
from compressor.solve.request import Trajectory

LOOKS = 64  # from the start to the end of a run


def looking(times: np.ndarray) -> np.ndarray:
    """The times of an output grid and those of the looks together (s)."""
    return np.union1d(times, _looks(times[-1]))


def looked_at(p: np.record, run: Trajectory, times: np.ndarray) -> np.ndarray:
    """Eccentricities (m) at the looks of a run on `looking(times)`, which is put on `times`.

    Shape (LOOKS + 1, joint, axis); nan from where the run stopped.
    """
    seen = np.searchsorted(run.times, _looks(times[-1]))
    rows = np.empty((seen.size, COLUMNS))
    observe_all(run.times[seen], run.states[seen], run.phases[seen], p, rows)
    kept = np.searchsorted(run.times, times)
    run.times, run.states, run.phases = times, run.states[kept], run.phases[kept]
    return rows[:, Column.ECCENTRICITY : Column.ECCENTRICITY + 4].reshape(-1, 2, 2)


def parted(p: np.record, ours: np.ndarray, theirs: np.ndarray) -> float:
    """Greatest distance of the eccentricities of two runs at the looks, over the room.

    A journal's room is its clearance, or how far it came if that is more. 0 for ideal joints.
    """
    worn = p["clearance"] > 0
    away = np.linalg.norm(ours - theirs, axis=2).max(axis=0)
    room = np.maximum(p["clearance"], np.linalg.norm(ours, axis=2).max(axis=0))
    return float((away[worn] / room[worn]).max(initial=0.0))


def _looks(end: float) -> np.ndarray:
    return end * (np.arange(LOOKS + 1) / LOOKS)

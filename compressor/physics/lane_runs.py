"""Runs side by side as Python asks for them: gathered into arrays for `lane_march`."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from compressor.physics.lane_march import Runs, march_lanes
from compressor.physics.lane_rows import FIELDS, LANES, new_lanes
from compressor.physics.record import RECORD, Load
from compressor.physics.tally import TALLY
from compressor.physics.walker import DONE, WALKER, Work, new_work

OF_THE_LOAD = ("preload", "spring_stiffness", "spring_damping")


class Run(NamedTuple):
    """A run from its begin to its end, as `march` takes it; the names are those of `march`."""

    walker: np.record
    p: np.record
    z: np.ndarray
    size: np.ndarray
    edges: np.ndarray
    phases: np.ndarray
    times: np.ndarray
    states: np.ndarray
    tally: np.record


def fits(p: np.record) -> bool:
    """Return whether runs of a record can march in lanes: default laws and powers of 1.5."""
    default = p["laws"].size == 1
    return bool(default and p["load"] != Load.GAS and p["exponent"] == 1.5)


def march_side_by_side(runs: Sequence[Run], most: int) -> list[Run | None]:
    """Return the runs of one scene with clearance at their ends, to the bit as by `march`.

    None for one that does not fit into a lane, that failed, or that took more than `most` attempts
    of a step. What the runs hold is left as it is.
    """
    fitting = [i for i, run in enumerate(runs) if fits(run.p)]
    ended: list[Run | None] = [None] * len(runs)
    if not fitting:
        return ended
    whole = gathered([runs[i] for i in fitting])
    scene = (0,) * int(runs[0].p["scene"])
    march_lanes(scene, new_lanes(), LANES, whole, np.full(LANES, -1), most)
    for k, i in enumerate(fitting):
        begin, samples = whole.places[k, 2:].tolist()
        if whole.walkers["status"][k] == DONE:
            ended[i] = runs[i]._replace(
                walker=whole.walkers[k], z=whole.z[k], tally=whole.tallies[k],
                states=whole.states[begin : begin + samples],
            )  # fmt: skip
    return ended


def gathered(runs: Sequence[Run]) -> Runs:
    """Return the runs in arrays."""
    m, n = len(runs), runs[0].size.size
    records = np.array([run.p for run in runs], RECORD).view(np.recarray)
    walkers = np.array([run.walker for run in runs], WALKER).view(np.recarray)
    size = np.array([run.size for run in runs])
    counts = np.array([(run.phases.size, run.times.size) for run in runs])
    places = np.stack([counts.cumsum(axis=0) - counts, counts], axis=2).reshape(m, 4)
    fields = np.empty((m, len(FIELDS)))
    for row, (name, joint) in enumerate(FIELDS):
        column = records[name]
        fields[:, row] = column[:, joint] if column.ndim > 1 else column
    for name in OF_THE_LOAD:  # no load is a spring without force
        fields[records["load"] == Load.NONE, FIELDS.index((name, 0))] = 0.0
    return Runs(
        walkers, records, np.array([run.tally for run in runs], TALLY).view(np.recarray),
        np.array([run.z for run in runs]), walkers["rtol"][:, None] * size, size, fields, places,
        np.concatenate([run.edges for run in runs]), np.concatenate([run.phases for run in runs]),
        np.concatenate([run.times for run in runs]),
        np.full((counts[:, 1].sum(), n), math.nan),
        Work(*(np.zeros((m, *array.shape)) for array in new_work(n))),
    )  # fmt: skip

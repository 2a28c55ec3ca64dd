"""A run's tally cut into revolutions, and put together again."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from compressor.physics import FLOWS, new_tally

Turns = list[np.record]  # tallies, of one revolution each
SUMS = (
    "seconds", "square_acceleration", "square_deviation", "crank_torque", "guide_moment",
    "loss_seconds", "impacts", "releases",
)  # fmt: skip
GREATEST = ("peak", "max_penetration")  # the others go on from the start of the run
WORN = ("steady_seconds", "slid", "worn")  # sums of a mechanism with features
SAME_TIME = 1e-12  # of the run: edges this near to each other are one


@dataclass
class Cuts:
    """Times (s) at which a run's tally is cut.

    `enough`: asked at each of them with the tallies so far; once it says so, the run ends there.
    `turns`: those tallies, of what lies before each cut and after the one before it. `states`: the
    motion at each cut.
    """

    times: np.ndarray
    enough: Callable[[Turns], bool] = lambda turns: False
    turns: Turns = field(default_factory=list)
    states: list[np.ndarray] = field(default_factory=list)

    def cut(self, tally: np.record, z: np.ndarray) -> bool:
        """Keep what was tallied since the last cut, begin again, and tell whether to go on.

        z: motion and flows there.
        """
        self.states.append(z[:-FLOWS].copy())
        self.turns.append(tally.copy())
        fresh = new_tally()
        for name in SUMS + GREATEST:
            tally[name] = fresh[name]
        for name in worn_sums(tally):
            tally[name] = 0.0
        return not self.enough(self.turns)


def revolutions(begin: float, end: float, turn: float) -> np.ndarray:
    """Return the ends (s) of the whole revolutions from one time to another."""
    return begin + turn * np.arange(1, int((end - begin) / turn * (1 + SAME_TIME)) + 1)


def worn_sums(tally: np.record) -> tuple[str, ...]:
    """Return the sums that a tally has beside `SUMS`."""
    return WORN if "worn" in (tally.dtype.names or ()) else ()


def merged(turns: Sequence[np.record]) -> np.record:
    """Return one tally of several revolutions in a row."""
    whole = turns[-1].copy()
    for name in (*SUMS, *worn_sums(whole)):
        whole[name] = sum(turn[name] for turn in turns)
    for name in GREATEST:
        whole[name] = np.max([turn[name] for turn in turns], axis=0)
    return whole


def with_cuts(
    edges: np.ndarray, phases: np.ndarray, cuts: Cuts | None
) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Return the segments that end at all cuts as well, and how many of them there are up to
    each cut.
    """
    times = []
    for time in cuts.times if cuts else ():
        edges, phases, near = with_edge(edges, phases, time)
        times.append(near)
    return edges, phases, [int(np.searchsorted(edges, near)) for near in times]


def with_edge(
    edges: np.ndarray, phases: np.ndarray, time: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the segments that end at a time as well, and that time: of an edge that lies there
    already.
    """
    near = edges[np.abs(edges - time).argmin()]
    if abs(near - time) <= SAME_TIME * edges[-1]:
        return edges, phases, float(near)
    i = int(np.searchsorted(edges, time))
    if i == edges.size:
        return edges, phases, time
    edges = np.concatenate((edges[:i], (time,), edges[i:]))
    return edges, np.concatenate((phases[:i], phases[i - 1 : i], phases[i:])), time

"""A march as Python holds it: how it is made ready, goes on, and is kept to go on from."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from compressor.physics import (
    FLOWS,
    Mode,
    Pair,
    Work,
    march,
    new_walker,
    new_work,
)
from compressor.solve.request import Request, greatest_depth
from compressor.solve.sizes import contact_sizes

COMPILED = {
    "auto": (Mode.AUTO, Pair.TSIT5),
    "DOPRI5": (Mode.EXPLICIT, Pair.DOPRI5),
    "TSIT5": (Mode.EXPLICIT, Pair.TSIT5),
    "RODAS": (Mode.STIFF, Pair.DOPRI5),
}
LANE_METHODS = ("auto", "TSIT5")
CONTACT_STEP = 0.3  # of the contact's own time scale: the first step after an onset


class Standing(NamedTuple):
    """How a march stands: all that `march` writes but the output samples."""

    walker: np.record
    z: np.ndarray  # motion and flows, (n + 4,)
    work: Work
    tally: np.record

    def copy(self) -> "Standing":
        """Return a copy that a march may go on from."""
        work = Work(*(array.copy() for array in self.work))
        return Standing(self.walker.copy(), self.z.copy(), work, self.tally.copy())

    @property
    def attempts(self) -> int:
        """Steps attempted so far: taken, refused, and those that an onset cut short."""
        w = self.walker
        return int(w.steps + w.rejected + w.onsets + (w.landing > 0.0))


class Snapshot(NamedTuple):
    """What is kept of a standing to go on from it: of its work, what a call of `march` reads.

    Records are kept as bytes: numpy takes five microseconds to copy one, a fiftieth for these.
    """

    walker: bytes
    z: np.ndarray
    rates: np.ndarray  # work.k[0]
    row: np.ndarray
    tally: bytes
    kind: np.dtype  # of the tally

    @classmethod
    def of(cls, now: Standing) -> "Snapshot":
        """Return a snapshot, in about a microsecond."""
        work = now.work
        return cls(
            now.walker.tobytes(), now.z.copy(), work.k[0].copy(), work.row.copy(),
            now.tally.tobytes(), now.tally.dtype,
        )  # fmt: skip

    def standing(self) -> Standing:
        """Return a march as it stood then."""
        work = new_work(self.z.size - FLOWS)
        work.k[0], work.row[:] = self.rates, self.row
        return Standing(
            unpacked(self.walker, new_walker(0).dtype),
            self.z.copy(),
            work,
            unpacked(self.tally, self.kind),
        )


def unpacked(data: bytes, kind: np.dtype) -> np.record:
    """Return a record of a kind, that compiled code may write, from its bytes."""
    return np.frombuffer(bytearray(data), kind).view(np.recarray)[0]


@dataclass(frozen=True)
class March:
    """A request as the compiled loop takes it.

    `size`: of each number of the motion, (n,); `edges`, `phases`: the load's segments; `states`:
    the output samples, which are written.
    """

    request: Request
    size: np.ndarray
    edges: np.ndarray
    phases: np.ndarray
    states: np.ndarray

    def advance(self, now: Standing, attempts: int, segments: int | None = None) -> None:
        """Go on by at most so many attempts of a step, through the first so many segments."""
        request, size = self.request, self.size
        edges, phases = self.edges, self.phases
        if segments is not None:
            edges, phases = edges[: segments + 1], phases[:segments]
        march(
            now.walker, request.p, now.z, now.work, request.rtol * size, size, edges, phases,
            request.times, self.states, now.tally, attempts,
        )  # fmt: skip


def ready_walker(request: Request, size: np.ndarray) -> np.record:
    """Return a walker at the start of a run by a compiled method; `size` as of `natural_sizes`."""
    mode, pair = COMPILED[request.method]
    walker = new_walker(mode)
    walker["pair"], walker["rtol"] = pair, request.rtol
    length, speed = contact_sizes(request.p, size)
    walker["watch"], walker["contact_step"] = 1, CONTACT_STEP * length / speed
    walker["deepest"] = greatest_depth(request.p)[0]
    return walker

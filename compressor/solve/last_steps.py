"""The last steps of a march that has stopped, taken once more and looked at one by one.

A march is resumable to the bit, so that nothing needs to be kept of a run that ends well but how
it stood before its last chunk.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from compressor.physics import (
    FLOWS,
    STAGES,
    STIFF_STAGES,
    TALLY,
    WALKER,
    E,
    Pair,
    Work,
    derivative_with_flows,
    new_work,
)

LAST = 16  # attempts that are looked at
NONE = -1  # in place of a number of the state


class Standing(NamedTuple):
    """How a march stands: all that `march` writes but the output samples."""

    walker: np.record
    z: np.ndarray  # motion and flows, (n + 4,)
    work: Work
    tally: np.record

    def copy(self) -> "Standing":
        """A copy that a march may go on from."""
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

    @classmethod
    def of(cls, now: Standing) -> "Snapshot":
        """A snapshot, in about a microsecond."""
        work = now.work
        return cls(
            now.walker.tobytes(), now.z.copy(), work.k[0].copy(), work.row.copy(),
            now.tally.tobytes(),
        )  # fmt: skip

    def standing(self) -> Standing:
        """A march as it stood then."""
        work = new_work(self.z.size - FLOWS)
        work.k[0], work.row[:] = self.rates, self.row
        return Standing(
            unpacked(self.walker, WALKER), self.z.copy(), work, unpacked(self.tally, TALLY)
        )


def unpacked(data: bytes, dtype: np.dtype) -> np.record:
    """A record that compiled code may write, from its bytes."""
    return np.frombuffer(bytearray(data), dtype).view(np.recarray)[0]


@dataclass
class History:
    """The last steps before a stop, each attempt one entry; error: over its tolerance."""

    times: list[float] = field(default_factory=list)  # s, where they begin
    steps: list[float] = field(default_factory=list)  # s
    errors: list[float] = field(default_factory=list)
    words: list[str] = field(default_factory=list)  # method, and what became of the step
    dominant: int = NONE  # number of the state that drove the last error, or went bad

    def add(self, time: float, step: float, error: float, words: str) -> None:
        """Append an attempt; more than LAST push out the first."""
        self.times.append(time)
        self.steps.append(step)
        self.errors.append(error)
        self.words.append(words)
        kept: list
        for kept in (self.times, self.steps, self.errors, self.words):
            del kept[:-LAST]


def retrace(
    before: Standing,
    after: Standing,
    advance: Callable[[Standing, int], None],
    p: np.record,
    rtol: float,
    size: np.ndarray,
    edges: np.ndarray,
    phases: np.ndarray,
) -> History:
    """The history of a march that stood like `before` and stopped like `after`.

    `advance(standing, limit)` marches on; size: of each number of the motion, (n,); edges, phases:
    the load's segments. `before` is written.
    """
    made = after.attempts - before.attempts
    if made > LAST:
        advance(before, made - LAST)
    found = History()
    for _ in range(min(made, LAST)):
        now = before.copy()
        w = now.walker
        phase = int(phases[w.segment])
        if w.fresh:
            derivative_with_flows(w.t, now.z, phase, p, now.work.k[0])
        advance(before, 1)
        step = attempted(now.walker, before.walker, float(edges[w.segment + 1]))
        scaled = scaled_error(now, before, step, rtol, size)
        error = math.sqrt(float(np.mean(scaled**2)))
        found.add(float(w.t), step, error, described(now.walker, before.walker))
        found.dominant = dominant(scaled, before.work.new[: size.size])
    return found


def attempted(now: np.record, then: np.record, end: float) -> float:
    """Length (s) of the step that was attempted, by the rules of `march`."""
    if then.steps > now.steps:
        return float(then.t - now.t)
    if now.landing > 0.0 or now.h == 0.0:
        return float(now.landing) or math.nan
    h = min(now.h, end - now.t)
    return float(end - now.t if now.t + 1.01 * h >= end else h)


def scaled_error(
    now: Standing, then: Standing, step: float, rtol: float, size: np.ndarray
) -> np.ndarray:
    """Estimated error of each number of the motion over its tolerance, (n,)."""
    n = now.z.size - FLOWS
    if now.walker.stiff:
        error = then.work.k[STIFF_STAGES, :n]
    else:
        stages = np.vstack((now.work.k[:1], then.work.k[1:STAGES]))
        error = step * (E[now.walker.pair] @ stages)[:n]
    largest = np.maximum(np.abs(now.z[:n]), np.abs(then.work.new[:n]))
    return error / (rtol * (size + largest))


def dominant(scaled: np.ndarray, new: np.ndarray) -> int:
    """The number of the state that went bad first, or has the largest error."""
    bad = np.flatnonzero(~np.isfinite(new) | ~np.isfinite(scaled))
    return int(bad[0]) if bad.size else int(np.abs(scaled).argmax())


def described(now: np.record, then: np.record) -> str:
    """Method of an attempt, and what became of it."""
    method = "RODAS" if now.stiff else Pair(int(now.pair)).name
    if then.steps > now.steps:
        return f"{method} to an onset" if now.landing > 0.0 else f"{method} taken"
    return f"{method} refused" if then.rejected > now.rejected else f"{method} cut at an onset"

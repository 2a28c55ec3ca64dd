"""Integrate by the compiled march, in chunks between which budgets are checked.

A march can be resumed to the bit. So a run that ends well leaves nothing behind, and one that stops
is taken up again from its last checkpoint, to record its last steps one by one.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from compressor.physics import (
    FLOWS,
    Mode,
    RungeKuttaPair,
    Status,
    WorkArrays,
    derivative_with_flows,
    is_last_step,
    march,
    new_stepper,
    new_work,
    step_error,
)
from compressor.reasons import Reason
from compressor.solve.request import (
    HISTORY_LENGTH,
    History,
    Request,
    Stop,
    Trajectory,
    check_state,
    greatest_depth,
    overdue,
    passed_time,
    too_deep,
    with_cuts,
    with_edge,
)
from compressor.solve.si_record import contact_sizes, natural_sizes

COMPILED = {
    "auto": (Mode.AUTO, RungeKuttaPair.TSIT5),
    "DOPRI5": (Mode.EXPLICIT, RungeKuttaPair.DOPRI5),
    "TSIT5": (Mode.EXPLICIT, RungeKuttaPair.TSIT5),
    "RODAS": (Mode.STIFF, RungeKuttaPair.DOPRI5),
}
CONTACT_STEP = 0.3  # of the contact's own time scale: the first step after an onset


class MarchState(NamedTuple):
    """All that `march` writes but the output samples."""

    stepper: np.record
    z: np.ndarray  # motion and flows, (n + 4,)
    work: WorkArrays
    tally: np.record

    def copy(self) -> "MarchState":
        """Return a copy that a march may go on from."""
        work = WorkArrays(*(array.copy() for array in self.work))
        return MarchState(self.stepper.copy(), self.z.copy(), work, self.tally.copy())

    @property
    def attempts(self) -> int:
        """Return the steps attempted so far: taken, refused, and cut short by an onset."""
        w = self.stepper
        return int(w.steps + w.rejected + w.onsets + (w.landing > 0.0))


class Checkpoint(NamedTuple):
    """A `MarchState` to resume from: of its work arrays, what a call of `march` reads.

    Records are stored as bytes: numpy takes five microseconds to copy one, a fiftieth for these.
    """

    stepper: bytes
    z: np.ndarray
    rates: np.ndarray  # work.k[0]
    row: np.ndarray
    tally: bytes
    kind: np.dtype  # of the tally

    @classmethod
    def of(cls, now: MarchState) -> "Checkpoint":
        """Return a checkpoint, in about a microsecond."""
        work = now.work
        return cls(
            now.stepper.tobytes(), now.z.copy(), work.k[0].copy(), work.row.copy(),
            now.tally.tobytes(), now.tally.dtype,
        )  # fmt: skip

    def restore(self) -> MarchState:
        """Return the state at the checkpoint."""
        work = new_work(self.z.size - FLOWS)
        work.k[0], work.row[:] = self.rates, self.row
        return MarchState(
            unpack_record(self.stepper, new_stepper(0).dtype),
            self.z.copy(),
            work,
            unpack_record(self.tally, self.kind),
        )


def unpack_record(data: bytes, kind: np.dtype) -> np.record:
    """Return a record of a kind, that compiled code may write, from its bytes."""
    return np.frombuffer(bytearray(data), kind).view(np.recarray)[0]


@dataclass(frozen=True)
class March:
    """A request in the form that the compiled loop takes.

    `size`: of each number of the motion, (n,); `edges`, `phases`: the load's segments; `states`:
    the output samples, which are written.
    """

    request: Request
    size: np.ndarray
    edges: np.ndarray
    phases: np.ndarray
    states: np.ndarray

    def advance(self, now: MarchState, attempts: int, segments: int | None = None) -> None:
        """Go on by at most so many attempts of a step, through the first so many segments."""
        request, size = self.request, self.size
        edges, phases = self.edges, self.phases
        if segments is not None:
            edges, phases = edges[: segments + 1], phases[:segments]
        march(
            now.stepper, request.p, now.z, now.work, request.rtol * size, size, edges, phases,
            request.times, self.states, now.tally, attempts,
        )  # fmt: skip


def prepare_stepper(request: Request, size: np.ndarray) -> np.record:
    """Return a stepper at the start of a run by a compiled method; `size` as of `natural_sizes`."""
    mode, pair = COMPILED[request.method]
    stepper = new_stepper(mode)
    stepper["pair"], stepper["rtol"] = pair, request.rtol
    length, speed = contact_sizes(request.fields, size)
    stepper["watch"], stepper["contact_step"] = 1, CONTACT_STEP * length / speed
    stepper["deepest"] = greatest_depth(request.fields)[0]
    return stepper


def retrace(before: MarchState, after: MarchState, march: March) -> History:
    """Return the history of a march from the state `before` to that at its stop, `after`.

    `before` is written.
    """
    attempts = after.attempts - before.attempts
    if attempts > HISTORY_LENGTH:
        march.advance(before, attempts - HISTORY_LENGTH)
    history = History()
    for _ in range(min(attempts, HISTORY_LENGTH)):
        now = before.copy()
        w = now.stepper
        if w.fresh:
            phase = int(march.phases[w.segment])
            derivative_with_flows(w.t, now.z, phase, march.request.p, now.work.k[0])
        march.advance(before, 1)
        step = attempted_length(now.stepper, before.stepper, float(march.edges[w.segment + 1]))
        scaled = scaled_error(now, before, step, march.request.rtol, march.size)
        error = math.sqrt(float(np.mean(scaled**2)))
        p, rates = march.request.p, now.work.k[0]
        time, pace = float(passed_time(p, w.t, now.z)), float(passed_time(p, 1.0, rates))
        history.add(time, step * pace, error, describe_attempt(now.stepper, before.stepper))
        history.dominant = dominant(scaled, before.work.new[: march.size.size])
    return history


def attempted_length(now: np.record, then: np.record, end: float) -> float:
    """Return the length (s) of the step that was attempted, by the rules of `march`."""
    if then.steps > now.steps:
        return float(then.t - now.t)
    if now.landing > 0.0 or now.h == 0.0:
        return float(now.landing) or math.nan
    h = min(now.h, end - now.t)
    return float(end - now.t if is_last_step(now.t, h, end) else h)


def scaled_error(
    now: MarchState, then: MarchState, step: float, rtol: float, size: np.ndarray
) -> np.ndarray:
    """Return the estimated error of each number of the motion over its tolerance, (n,)."""
    n = now.z.size - FLOWS
    error = step_error(now.stepper, now.work.k, then.work.k, step)[:n]
    largest = np.maximum(np.abs(now.z[:n]), np.abs(then.work.new[:n]))
    return error / (rtol * (size + largest))


def dominant(scaled: np.ndarray, new: np.ndarray) -> int:
    """Return the number of the state that went bad first, or has the largest error."""
    bad = np.flatnonzero(~np.isfinite(new) | ~np.isfinite(scaled))
    return int(bad[0]) if bad.size else int(np.abs(scaled).argmax())


def describe_attempt(now: np.record, then: np.record) -> str:
    """Return the method of an attempt, and what became of it."""
    method = "RODAS" if now.stiff else RungeKuttaPair(int(now.pair)).name
    if then.steps > now.steps:
        return f"{method} to an onset" if now.landing > 0.0 else f"{method} taken"
    return f"{method} refused" if then.rejected > now.rejected else f"{method} cut at an onset"


CHUNK = 2048  # attempts of the march between two looks at the clock: 7 ms, or stiff ones 50 ms


def chunks(request: Request, stepper: np.record) -> Iterator[int]:
    """Yield the attempts that a march may take until budgets are checked, as long as it runs."""
    while stepper.status == Status.RUNNING:
        yield min(CHUNK, request.max_steps - stepper.steps - stepper.rejected)


def march_through(request: Request, result: Trajectory, edges, phases, z: np.ndarray) -> None:
    """Integrate by the compiled loop into `result`. Raises Stop."""
    deadline = time.monotonic() + request.timeout
    size = natural_sizes(request.fields)
    stepper = prepare_stepper(request, size)
    edges, phases, stepper["settle"] = with_edge(edges, phases, request.settle)
    edges, phases, ends = with_cuts(edges, phases, request.cuts)
    phases = phases.copy()
    march = March(request, size, edges, phases, result.states)
    now = MarchState(stepper, z, new_work(size.size), result.tally)
    # two: where a run stops soon after the last one, the one before begins early enough
    previous = latest = Checkpoint.of(now)
    checkpoint_attempts = 0  # attempts at the last checkpoint
    result.segments = edges, phases
    for attempts in chunks(request, stepper):
        if result.steps + result.rejected >= checkpoint_attempts + HISTORY_LENGTH:
            previous, latest = latest, Checkpoint.of(now)
            checkpoint_attempts = result.steps + result.rejected
        march.advance(now, attempts, ends[0] if ends else phases.size)
        result.steps, result.rejected = int(stepper.steps), int(stepper.rejected)
        result.evaluations = int(stepper.evaluations)
        if stepper.status == Status.DONE and ends and request.cuts:
            del ends[0]
            if request.cuts.cut(result.tally, z) and stepper.segment < phases.size:
                stepper.status = Status.RUNNING
        if stepper.status == Status.DONE:
            return
        try:
            check_march(request, stepper, z, float(result.tally.deepest), deadline)
        except Stop:
            result.stop_time, result.stop_state = float(stepper.t), z[:-FLOWS].copy()
            enough = result.steps + result.rejected >= checkpoint_attempts + HISTORY_LENGTH
            result.history = retrace((latest if enough else previous).restore(), now, march)
            raise


def check_march(
    request: Request, stepper: np.record, z: np.ndarray, deepest: float, deadline: float
) -> None:
    """Raise Stop where a march has stopped at z, or may go no further."""
    status = Status(int(stepper.status))
    check_state(request.p, z)
    if status == Status.PENETRATION_IMPLAUSIBLE:
        raise Stop(*too_deep(deepest, request.p))
    if status == Status.NON_FINITE:
        raise Stop(Reason.NON_FINITE, "the state or its rates are no longer finite")
    if status == Status.STEP_UNDERFLOW:
        raise Stop(Reason.STEP_UNDERFLOW, f"the step has shrunk to {stepper.h:.3g} s")
    if stepper.steps + stepper.rejected >= request.max_steps:
        raise Stop(Reason.BUDGET_STEPS, f"more than {request.max_steps} steps")
    if time.monotonic() > deadline:
        raise Stop(Reason.BUDGET_SECONDS, overdue(request.timeout))

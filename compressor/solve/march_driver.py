"""Integrate by the compiled march, in chunks between which budgets are checked."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from compressor.physics import (
    FLOWS,
    LAST_STEPS,
    Attempt,
    Mode,
    Status,
    WorkArrays,
    derivative_with_flows,
    march,
    new_stepper,
    new_work,
    step_error,
)
from compressor.reasons import Reason
from compressor.solve.request import (
    NONE,
    History,
    Request,
    Stop,
    Trajectory,
    check_state,
    greatest_depth,
    overdue,
    too_deep,
    with_cuts,
    with_edge,
)
from compressor.solve.si_record import contact_sizes, natural_sizes

COMPILED = {"auto": Mode.AUTO, "TSIT5": Mode.EXPLICIT, "RODAS": Mode.STIFF}
CONTACT_STEP = 0.3  # of the contact's own time scale: the first step after an onset


def prepare_stepper(request: Request, size: np.ndarray) -> np.record:
    """Return a stepper at the start of a run by a compiled method; `size` as of `natural_sizes`."""
    stepper = new_stepper(COMPILED[request.method])
    stepper["rtol"] = request.rtol
    length, speed = contact_sizes(request.fields, size)
    stepper["watch"], stepper["contact_step"] = 1, CONTACT_STEP * length / speed
    stepper["deepest"] = greatest_depth(request.fields)[0]
    return stepper


WORDS = {
    Attempt.REFUSED: "refused", Attempt.TAKEN: "taken", Attempt.TO_ONSET: "to an onset",
    Attempt.CUT_AT_ONSET: "cut at an onset",
}  # fmt: skip


def read_history(stepper: np.record, work: WorkArrays) -> History:
    """Return the last steps of a march, by its ring of them."""
    history, attempts = History(), int(stepper.attempts)
    for number in range(max(0, attempts - LAST_STEPS), attempts):
        begin, length, error, code = work.last[number % LAST_STEPS].tolist()
        name = "RODAS" if code >= Attempt.STIFF else "TSIT5"
        history.add(begin, length, error, f"{name} {WORDS[Attempt(int(code) % Attempt.STIFF)]}")
    return history


def find_dominant(now: "March") -> int:
    """Return the number of the motion that is not finite, or has the next step's largest error.

    A copy of the march goes on by one attempt of a step.
    """
    now = replace(
        now, stepper=now.stepper.copy(), z=now.z.copy(), tally=now.tally.copy(),
        states=now.states.copy(), phases=now.phases.copy(),
    )  # fmt: skip
    stepper, z, work, n = now.stepper, now.z, now.work, now.size.size
    if not np.isfinite(z[:n]).all():
        return int(np.flatnonzero(~np.isfinite(z[:n]))[0])
    if stepper.segment == now.phases.size:
        return NONE
    derivative_with_flows(stepper.t, z, int(now.phases[stepper.segment]), now.request.p, work.k[0])
    begin, rates, before = z[:n].copy(), work.k[:1].copy(), stepper.copy()
    stepper["status"], stepper["fresh"] = Status.RUNNING, 0
    now.advance(1)
    error = step_error(before, rates, work.k, 1.0)[:n]
    scaled = error / (now.size + np.maximum(np.abs(begin), np.abs(work.new[:n])))
    bad = np.flatnonzero(~np.isfinite(work.new[:n]) | ~np.isfinite(scaled))
    return int(bad[0]) if bad.size else int(np.abs(scaled).argmax())


CHUNK = 2048  # attempts of the march between two looks at the clock: 7 ms, or stiff ones 50 ms


def chunks(request: Request, stepper: np.record) -> Iterator[int]:
    """Yield the attempts that a march may take until budgets are checked, as long as it runs."""
    while stepper.status == Status.RUNNING:
        yield min(CHUNK, request.max_steps - stepper.steps - stepper.rejected)


@dataclass(frozen=True)
class March:
    """A run in the form that the compiled loop takes; `march` says what each is."""

    request: Request
    stepper: np.record
    z: np.ndarray
    work: WorkArrays
    size: np.ndarray
    edges: np.ndarray
    phases: np.ndarray
    states: np.ndarray
    tally: np.record

    def advance(self, attempts: int, segments: int | None = None) -> None:
        """Go on by at most so many attempts of a step, through the first so many segments."""
        request, count = self.request, self.phases.size if segments is None else segments
        march(
            self.stepper, request.p, self.z, self.work, request.rtol * self.size, self.size,
            self.edges[: count + 1], self.phases[:count], request.times, self.states, self.tally,
            attempts,
        )  # fmt: skip


def march_through(request: Request, result: Trajectory, edges, phases, z: np.ndarray) -> None:
    """Integrate by the compiled loop into `result`. Raises Stop."""
    deadline = time.monotonic() + request.timeout
    size = natural_sizes(request.fields)
    stepper = prepare_stepper(request, size)
    edges, phases, stepper["settle"] = with_edge(edges, phases, request.settle)
    edges, phases, ends = with_cuts(edges, phases, request.cuts)
    phases = phases.copy()  # a march writes into them where a gas is shut in
    now = March(
        request, stepper, z, new_work(size.size), size, edges, phases, result.states, result.tally
    )
    result.segments = edges, phases
    for attempts in chunks(request, stepper):
        now.advance(attempts, ends[0] if ends else None)
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
            result.history = read_history(stepper, now.work)
            result.history.dominant = find_dominant(now)
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

"""Integrate by the compiled march, in chunks between which budgets are checked."""

import time

import numpy as np

from compressor.physics import FLOWS, Status, new_work
from compressor.reasons import Reason
from compressor.solve.last_steps import retrace
from compressor.solve.marching import March, Snapshot, Standing, ready_walker
from compressor.solve.request import LAST, Request, Stop, Trajectory, check_state, overdue, too_deep
from compressor.solve.sizes import natural_sizes
from compressor.solve.turns import with_cuts, with_edge

CHUNK = 2048  # attempts of the march between two looks at the clock: 7 ms, or stiff ones 50 ms


def march_through(request: Request, result: Trajectory, edges, phases, z: np.ndarray) -> None:
    """Integrate by the compiled loop; raises Stop."""
    deadline = time.monotonic() + request.timeout
    size = natural_sizes(request.p)
    walker = ready_walker(request, size)
    edges, phases, walker["settle"] = with_edge(edges, phases, request.settle)
    edges, phases, ends = with_cuts(edges, phases, request.cuts)
    march = March(request, size, edges, phases, result.states)
    now = Standing(walker, z, new_work(size.size), result.tally)
    earlier = before = Snapshot.of(now)
    seen = 0  # attempts at the last snapshot
    while walker.status == Status.RUNNING:
        if result.steps + result.rejected >= seen + LAST:
            earlier, before = before, Snapshot.of(now)
            seen = result.steps + result.rejected
        attempts = min(CHUNK, request.max_steps - walker.steps - walker.rejected)
        march.advance(now, attempts, ends[0] if ends else phases.size)
        result.steps, result.rejected = int(walker.steps), int(walker.rejected)
        result.evaluations = int(walker.evaluations)
        if walker.status == Status.DONE and ends and request.cuts:
            del ends[0]
            if request.cuts.cut(result.tally, z) and walker.segment < phases.size:
                walker.status = Status.RUNNING
        if walker.status == Status.DONE:
            return
        try:
            check_march(request, walker, z, float(result.tally.deepest), deadline)
        except Stop:
            result.stop_time, result.stop_state = float(walker.t), z[:-FLOWS].copy()
            enough = result.steps + result.rejected >= seen + LAST
            result.history = retrace((before if enough else earlier).standing(), now, march)
            raise


def check_march(
    request: Request, walker: np.record, z: np.ndarray, deepest: float, deadline: float
) -> None:
    """Raise Stop where a march has stopped at z, or may go no further."""
    status = Status(int(walker.status))
    check_state(request.p, z)
    if status == Status.PENETRATION_IMPLAUSIBLE:
        raise Stop(Reason.PENETRATION_IMPLAUSIBLE, too_deep(deepest, request.p))
    if status == Status.NON_FINITE:
        raise Stop(Reason.NON_FINITE, "the state or its rates are no longer finite")
    if status == Status.STEP_UNDERFLOW:
        raise Stop(Reason.STEP_UNDERFLOW, f"the step has shrunk to {walker.h:.3g} s")
    if walker.steps + walker.rejected >= request.max_steps:
        raise Stop(Reason.BUDGET_STEPS, f"more than {request.max_steps} steps")
    if time.monotonic() > deadline:
        raise Stop(Reason.BUDGET_SECONDS, overdue(request.timeout))

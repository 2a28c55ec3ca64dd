"""Integrate by SciPy's methods, by name: the only door to scipy.integrate.

A judge of the compiled march, with which it shares equations and accumulator: steps, events and
dense solution are those of `solve_ivp`.
"""

import math
import time
from typing import Any

import numpy as np

from compressor.physics import (
    FLOWS,
    Column,
    approach_at,
    derivative_with_flows,
    enter_segment,
    tally_energy,
)
from compressor.reasons import Reason
from compressor.solve.dense_tally import find_missed_contact, tally_steps
from compressor.solve.request import Request, Stop, Trajectory, check_depth, check_state
from compressor.solve.series import rows_at
from compressor.solve.si_record import absolute_tolerances

# of rtol: all of it left 4, 2.5, 2 times the residual of energy that is allowed, at the small end
LOCAL = {"LSODA": 0.1, "BDF": 0.1, "RK45": 0.3}
MIN_RTOL = 2.3e-14  # SciPy's own floor
BAD_EVALUATIONS = 300  # non-finite ones in a row: RK45 would hang, LSODA report success
STEPS_AT_ONCE = 1024  # that are tallied together, to save memory


def step_through(
    request: Request, result: Trajectory, settle: float, ends: list[int], z: np.ndarray
) -> None:
    """Integrate from edge to edge by SciPy, as `run.march_through` compiled. Raises Stop."""
    edges, phases = result.edges, result.edge_phases
    result.stop_time, result.stop_state = float(edges[0]), z[:-FLOWS].copy()
    result.states[0] = result.stop_state
    run = ScipyRun(request, result, settle)
    for i in range(phases.size):
        enter_segment(edges[i], z, i, phases, request.p)
        run.phase = int(phases[i])
        z = run.go(edges[i], edges[i + 1], z)
        if i + 1 in ends:
            result.cut(z)
            if request.enough and request.enough(result):
                break
    result.stop_time = math.nan


class ScipyRun:
    """A run by one of SciPy's methods; `phase`: of the load, at present."""

    def __init__(self, request: Request, result: Trajectory, settle: float):
        self.request, self.result, self.settle, self.p = request, result, settle, request.p
        self.phase, self.last, self.deadline = 0, 0.0, time.monotonic() + request.timeout
        # by joint whose law reads the speed at which bodies meet: whether they have met
        joints = np.flatnonzero((self.p["clearance"] > 0.0) & (self.p["hysteresis"] != 0.0))
        self.touches, self.bad = dict.fromkeys(joints.tolist(), False), 0

    def differentiate(self, t: float, z: np.ndarray) -> np.ndarray:
        """Return dz/dt by the compiled right-hand side. Raises Stop beyond a budget."""
        out, result = np.empty(z.size), self.result
        derivative_with_flows(t, np.array(z), self.phase, self.p, out)
        result.evaluations += 1
        self.bad = 0 if math.isfinite(out.sum()) else self.bad + 1
        if self.bad >= BAD_EVALUATIONS:
            raise Stop(Reason.NON_FINITE, "the right-hand side stays non-finite")
        if result.evaluations % 256 == 0 and time.monotonic() > self.deadline:
            raise Stop(Reason.BUDGET_SECONDS, "")
        return out

    def observe(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Return the rows at times (s), (k, COLUMNS); states: with flows, (n + 4, k)."""
        return rows_at(self.p, times, states[:-FLOWS].T, self.phase)

    def watch(self, t: float, z: np.ndarray) -> float:
        """Count and judge each step's end: an event that never comes. Raises Stop."""
        result, last, self.last = self.result, self.last, t
        if t == last:  # of an integration's begin
            return 1.0
        if not np.isfinite(z).all():
            raise Stop(Reason.NON_FINITE, "the state is no longer finite")
        result.stop_time, result.stop_state, result.steps = t, z[:-FLOWS].copy(), result.steps + 1
        row = self.observe(np.array([t]), z[:, None])[0]
        tally_energy(row, np.array(z[-FLOWS:]), result.tally)
        check_depth(row[Column.PENETRATION : Column.NORMAL], self.p)
        check_state(self.p, z)
        most = self.request.max_steps
        if result.steps + result.rejected >= most and t < self.request.times[-1]:
            raise Stop(Reason.BUDGET_STEPS, f"more than {most} steps")
        return 1.0

    def meeting(self, joint: int) -> Any:
        """Return the event of a gap that closes, or opens again; it ends an integration."""

        def depth(t: float, z: np.ndarray) -> float:
            return float(self.observe(np.array([t]), z[:, None])[0, Column.PENETRATION + joint])

        event: Any = depth
        event.terminal, event.direction = True, -1.0 if self.touches[joint] else 1.0
        return event

    def go(self, t: float, end: float, z: np.ndarray) -> np.ndarray:
        """Return motion and flows at an edge, from those at the edge before. Raises Stop."""
        p, result = self.p, self.result
        while t < end:
            path, met = self.advance(t, end, z, [*self.touches])
            if met:  # beyond it the law has another speed: the step is taken again, up to there
                result.steps, result.rejected = result.steps - 1, result.rejected + 1
                path, _ = self.advance(path.t[-2], path.t[-1], path.y[:, -2].copy(), [])
            t, z = path.t[-1], path.y[:, -1].copy()
            for joint in met:
                self.touches[joint] = not self.touches[joint]
                if self.touches[joint]:
                    y, (rates, scratch) = z[:-FLOWS].copy(), np.empty((2, z.size - FLOWS))
                    _, speed = approach_at(joint, t, y, self.phase, p, rates, scratch)
                    z[2 * p["freedoms"] + joint] = max(speed, p["least_approach"])
        return z

    def advance(self, t: float, end: float, z: np.ndarray, joints: list) -> tuple[Any, list[int]]:
        """Return SciPy's path up to where bodies meet, tallied up to the step before; joints."""
        from scipy.integrate import solve_ivp  # a third of the time of a short run

        method, self.last = self.request.method, t
        rtol = max(self.request.rtol * LOCAL.get(method, 1.0), MIN_RTOL)
        atol, watched = absolute_tolerances(self.p, rtol), [self.watch, *map(self.meeting, joints)]
        how: dict[str, Any] = {"rtol": rtol, "atol": atol, "events": watched, "dense_output": True}
        try:
            path = solve_ivp(self.differentiate, (t, end), z, method, **how)
        except ValueError as error:  # of a matrix with nan
            raise Stop(Reason.NON_FINITE, str(error)) from error
        met = [joint for joint, at in zip(joints, path.t_events[1:], strict=True) if at.size]
        self.take(np.unique(path.t[:-1] if met else path.t), path.sol)
        if not path.success:
            raise Stop(Reason.STEP_UNDERFLOW, path.message)
        return path, met

    def take(self, steps: np.ndarray, dense: Any) -> None:
        """Tally steps, by their ends (s), and sample the output grid within them. Raises Stop."""
        request, result = self.request, self.result

        def observe(times: np.ndarray, moved: np.ndarray | float = 0.0) -> np.ndarray:
            states = dense(times)
            states[:-FLOWS] += moved
            return self.observe(times, states)

        for first in range(0, steps.size - 1, STEPS_AT_ONCE):
            part, measured = steps[first : first + STEPS_AT_ONCE + 1], bool(steps[0] >= self.settle)
            rows = tally_steps(self.p, result.tally, part, observe, measured)
            check_depth(result.tally["deepest"], self.p)
            if missed := find_missed_contact(self.p, request.rtol, part, rows):
                result.stop_time, text = missed
                result.stop_state = dense(result.stop_time)[:-FLOWS]
                raise Stop(Reason.CONTACT_UNDERRESOLVED, text)
        inside = slice(*np.searchsorted(request.times, (steps[0], np.nextafter(steps[-1], np.inf))))
        if inside.start < inside.stop:
            result.states[inside] = dense(request.times[inside])[:-FLOWS].T

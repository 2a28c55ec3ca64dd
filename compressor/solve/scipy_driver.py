"""Integrate by SciPy's methods, by name: the only door to scipy.integrate.

SciPy is not trusted with states that go bad: its LSODA reports success with nan, and its
Runge-Kutta methods hang on inf.

Where journal and bore meet in a step of SciPy's: laws with a restitution need its speed there.
SciPy's methods end no step where contact begins. A step in which a gap closes is forgotten and
taken again up to that moment, by a fresh solver; from there on the joint carries the speed at which
it met, as after a landing of the compiled march (`physics.onset.store_approach_velocity`).
"""

import math
import time
from functools import cache
from typing import Any

import numpy as np

from compressor.physics import (
    COLUMNS,
    FLOWS,
    Column,
    approach_at,
    contact_within,
    derivative_with_flows,
    enter_segment,
    lobatto,
    observe_all,
    sample_segments,
    tally_energy,
    tally_step,
)
from compressor.reasons import Reason
from compressor.solve.request import (
    Request,
    Stop,
    Trajectory,
    check_state,
    greatest_depth,
    overdue,
    passed_time,
    too_deep,
    with_cuts,
)
from compressor.solve.si_record import absolute_tolerances, length_and_speed, natural_sizes
from compressor.solve.within_step import find_crossings, look_at_step, share_above

SAMPLES_IN_STEP = 17  # times in a step at which gaps are looked at, both ends included
MAX_HALVINGS = 50
LANDING_FRACTION = 1e-3  # of a step: a gap that closes nearer to its end closes at its end


def needs_landings(p: np.record) -> bool:
    """Return whether a record's law reads the speed at which bodies met."""
    return bool(p["hysteresis"] != 0.0)


class Landings:
    """What is looked for in each step of a stretch in which the load has one phase."""

    def __init__(self, p: np.record, phase: int):
        self.p, self.phase = p, phase
        self.joints = [joint for joint in range(2) if p["clearance"][joint] > 0.0]
        self.landed_until = [-np.inf, -np.inf]  # s: a gap that closes before was landed on

    def depths(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Return the penetrations (m) of both joints, (m, 2), at times (s) and states (m, n)."""
        rows = np.empty((times.size, COLUMNS))
        observe_all(times, states, np.full(times.size, self.phase), self.p, rows)
        return rows[:, Column.PENETRATION : Column.PENETRATION + 2]

    def find_onset(self, begin: float, end: float, dense) -> float | None:
        """Return when (s) a gap first closes within a step, or None; at its end none does."""

        def depths(times: np.ndarray) -> np.ndarray:
            return self.depths(times, np.ascontiguousarray(dense(times)[:-FLOWS].T))

        times = np.linspace(begin, end, SAMPLES_IN_STEP)
        penetration, onset = depths(times), end
        for joint in self.joints:
            closing = (penetration[:-1, joint] < 0.0) & (penetration[1:, joint] >= 0.0)
            for i in np.flatnonzero(closing & (times[1:] > self.landed_until[joint])):
                low, high = times[i], times[i + 1]
                for _ in range(MAX_HALVINGS):
                    middle = 0.5 * (low + high)
                    if depths(np.array([middle]))[0, joint] >= 0.0:
                        high = middle
                    else:
                        low = middle
                if high > self.landed_until[joint]:
                    onset = min(onset, high)
                    break
        return onset if end - onset > LANDING_FRACTION * (end - begin) else None

    def land(self, begin: float, end: float, dense, z: np.ndarray) -> None:
        """Write the approach speed of joints whose gaps close at the end of a step.

        Of a step that they began apart. z: motion and flows, (n + 4,), written.
        """
        y, rates, scratch = z[:-FLOWS].copy(), np.empty(z.size - FLOWS), np.empty(z.size - FLOWS)
        depths = self.depths(np.array([begin]), np.ascontiguousarray(dense([begin])[:-FLOWS].T))[0]
        for joint in self.joints:
            depth, speed = approach_at(joint, end, y, self.phase, self.p, rates, scratch)
            if (
                depths[joint] < 0.0 < speed
                and abs(depth) <= LANDING_FRACTION * (end - begin) * speed
            ):
                place = 2 * self.p["freedoms"] + joint
                z[place] = max(speed, self.p["least_approach"])
                # a gap that is open by a hair closes once more soon after: that is the same contact
                self.landed_until[joint] = end + 2.0 * max(0.0, -depth) / speed


# Local errors add up in the energy: with rtol itself, these methods left residuals above 10 rtol a
# revolution at the small end (LSODA up to 4 times, BDF 2.5, RK45 2), so they get a share of it.
LOCAL = {"LSODA": 0.1, "BDF": 0.1, "RK45": 0.3}
MIN_RTOL = 2.3e-14  # SciPy's own floor
BAD_EVALUATIONS = 300  # non-finite right-hand sides in a row before a run is given up
EVALUATIONS_PER_STEP = 50  # a step that never ends is caught by its evaluations
NODES, WEIGHTS = lobatto(9)  # SciPy's steps may be long
SMALL_CHANGE = 1e-6  # of a state's natural size: by which a change of contact is moved
KICK = 30.0  # tolerances of speed: what a contact within one step may add unseen


class Derivative:
    """The compiled right-hand side as SciPy calls it, counted, timed and guarded."""

    def __init__(self, request: Request):
        self.p = request.p
        self.z = np.zeros(request.start.size + FLOWS)
        self.rows = np.empty((1, COLUMNS))
        self.phase = 0
        self.evaluations = 0
        self.bad = 0
        self.limit = EVALUATIONS_PER_STEP * request.max_steps
        self.timeout = request.timeout
        self.deadline = time.monotonic() + request.timeout

    def __call__(self, t: float, z: np.ndarray) -> np.ndarray:
        self.z[:] = z
        out = np.empty_like(self.z)
        derivative_with_flows(t, self.z, self.phase, self.p, out)
        self.evaluations += 1
        if math.isfinite(out.sum()):
            self.bad = 0
        else:
            self.bad += 1
            if self.bad >= BAD_EVALUATIONS:
                raise Stop(Reason.NON_FINITE, "the right-hand side stays non-finite")
        if self.evaluations % 256 == 0:
            self.check_budget()
        return out

    def check_budget(self) -> None:
        """Raise Stop when evaluations or wall time have run out."""
        if self.evaluations > self.limit:
            raise Stop(Reason.BUDGET_STEPS, f"more than {self.limit} evaluations")
        if time.monotonic() > self.deadline:
            raise Stop(Reason.BUDGET_SECONDS, overdue(self.timeout))


def step_through(request: Request, result: Trajectory, edges, phases, z: np.ndarray) -> None:
    """Integrate by one of SciPy's methods, segment by segment."""
    right_hand_side = Derivative(request)
    edges, phases, ends = with_cuts(edges, phases, request.cuts)
    owner, phases = sample_segments(request.times, edges), phases.copy()
    result.segments = edges, phases
    try:
        for i in range(phases.size):
            enter_segment(edges[i], z, i, phases, request.p)
            right_hand_side.phase = int(phases[i])
            samples = np.flatnonzero(owner == i)
            segment = LoadStretch(request, right_hand_side, result, edges[i], edges[i + 1], samples)
            z = segment.run(z)
            if request.cuts and i + 1 in ends and not request.cuts.cut(result.tally, z):
                result.stop_time = math.nan
                break
    finally:
        result.evaluations = right_hand_side.evaluations


@cache
def scipy_method(name: str) -> Any:
    """Return SciPy's method of a name, loaded when first used.

    Loading takes a third of the time of a short run.
    """
    from scipy import integrate as scipy_integrate

    return getattr(scipy_integrate, name)


class LoadStretch:
    """One stretch between load corners, stepped by a fresh SciPy solver."""

    def __init__(self, request, right_hand_side, result, begin, end, samples):
        self.request, self.right_hand_side, self.result = request, right_hand_side, result
        self.begin, self.end = begin, end
        self.samples = samples  # indices of this segment's samples
        self.times = np.clip(request.times[samples], begin, end)
        p = request.p
        self.landings = Landings(p, right_hand_side.phase) if needs_landings(p) else None

    def run(self, z: np.ndarray) -> np.ndarray:
        """Integrate to the segment's end; return state and flows there. Raises Stop."""
        result, t, bound = self.result, self.begin, self.end
        result.stop_time, result.stop_state = t, z[:-FLOWS]
        while t < self.end:
            t, z, bound = self.go(t, z, bound)
        if self.end == self.request.times[-1]:
            result.stop_time = math.nan
        return z

    def go(self, t: float, z: np.ndarray, bound: float) -> tuple[float, np.ndarray, float]:
        """Integrate from (t, z) to a bound by a fresh solver, or until bodies meet within a step.

        Returns the time and the state that were reached, and the next bound: the step in which they
        met is then to be taken again.
        """
        request, result = self.request, self.result
        rtol = max(request.rtol * LOCAL.get(request.method, 1.0), MIN_RTOL)
        atol = absolute_tolerances(request.p, rtol)
        solver = scipy_method(request.method)(
            self.right_hand_side, t, z, bound, rtol=rtol, atol=atol
        )
        while solver.status == "running":
            if result.steps + result.rejected >= request.max_steps:
                raise Stop(Reason.BUDGET_STEPS, f"more than {request.max_steps} steps")
            before = solver.y.copy()
            message = solver.step()
            if solver.status == "failed":
                raise Stop(Reason.STEP_UNDERFLOW, str(message))
            if not np.isfinite(solver.y).all():
                result.history.dominant = int(np.flatnonzero(~np.isfinite(solver.y))[0])
                raise Stop(Reason.NON_FINITE, "the state is no longer finite")
            dense = solver.dense_output()
            if self.landings:
                onset = self.landings.find_onset(solver.t_old, solver.t, dense)
                if onset is not None:
                    result.rejected += 1
                    return solver.t_old, before, onset
            result.steps += 1
            self.take(solver, dense)
            self.audit(solver)
            result.stop_time, result.stop_state = solver.t, solver.y[:-FLOWS].copy()
            begin, end = (
                float(passed_time(request.p, *at))
                for at in ((solver.t_old, before), (solver.t, solver.y))
            )
            result.history.add(begin, end - begin, math.nan, f"{request.method} taken")
            check_state(request.p, solver.y)
            self.check()
        z = solver.y.copy()
        if self.landings and bound < self.end:
            self.landings.land(solver.t_old, solver.t, dense, z)
        return solver.t, z, self.end

    def take(self, solver, dense) -> None:
        """Tally the accepted step and sample the output grid within it."""
        settle = self.request.settle
        if solver.t_old < settle < solver.t:
            self.tally(dense, solver.t_old, settle, False)
            self.tally(dense, settle, solver.t, True)
        else:
            self.tally(dense, solver.t_old, solver.t, solver.t_old >= settle)
        low = np.searchsorted(self.times, solver.t_old, side="right")
        if solver.t_old == self.begin:
            low = 0
        high = np.searchsorted(self.times, solver.t, side="right")
        if high > low:
            self.result.states[self.samples[low:high]] = dense(self.times[low:high])[:-FLOWS].T

    def tally(self, dense, begin: float, end: float, measured: bool) -> None:
        """Observe the dense solution on [begin, end] and add it to the tally."""
        times = begin + (end - begin) * NODES
        states = np.ascontiguousarray(dense(times)[:-FLOWS].T)
        rows = np.empty((times.size, COLUMNS))
        phases = np.full(times.size, self.right_hand_side.phase)
        observe_all(times, states, phases, self.request.p, rows)
        self.check_contact(begin, end - begin, rows)
        tally, p = self.result.tally, self.request.p
        gap_fraction, sides = np.zeros(2), np.zeros(4)
        if measured:
            self.measure_parts(dense, begin, end, rows, gap_fraction, sides)
        tally_step(end - begin, NODES, WEIGHTS, rows, 1, gap_fraction, sides, measured, tally, p)

    def measure_parts(self, dense, begin, end, rows, gap_fraction, sides) -> None:
        """Write the shares of a step without contact, by joint, and its rod load's sides.

        rows: observed at NODES; gap_fraction, (2,), and sides, (4,), as `tally_step` takes them,
        are written. The tally takes peaks, and how far changes of contact may move.
        """
        request, tally, span = self.request, self.result.tally, end - begin
        found, phase = np.empty((1, COLUMNS)), np.array([self.right_hand_side.phase])

        def observe(s: float, change: np.ndarray | float = 0.0) -> np.ndarray:
            state = np.ascontiguousarray(dense(begin + s * span)[:-FLOWS] + change)[np.newaxis]
            observe_all(np.array([begin + s * span]), state, phase, request.p, found)
            return found[0]

        def measure_gap(joint: int) -> None:
            column = Column.NEARNESS + joint
            changes = find_crossings(lambda s: float(observe(s)[column]), NODES, rows[:, column])
            gap_fraction[joint] = 1.0 - share_above(rows[0, column], changes)
            for at, rate in changes:
                small, here = (
                    SMALL_CHANGE * np.diag(natural_sizes(request.fields)),
                    observe(at)[column],
                )
                moved = [observe(at, one)[column] - here for one in small]
                shift = np.linalg.norm(moved) / SMALL_CHANGE / abs(rate)
                tally["switch_shift"][joint] += span * shift

        for joint in range(2):
            if request.p["clearance"][joint] > 0.0:
                measure_gap(joint)
        look_at_step(request.p, observe, NODES, rows, tally, sides)

    def check_contact(self, begin: float, span: float, rows: np.ndarray) -> None:
        """Raise Stop where a whole contact lies within a step and its impulse is no small error."""
        whole = [joint for joint in range(2) if contact_within(rows, joint)]
        if not whole:
            return
        normal = rows[:, Column.NORMAL : Column.NORMAL + 2]
        p, force = self.request.p, normal.max()
        kick = span * (WEIGHTS @ normal[:, whole]).max() / min(p.rod_mass, p.reciprocating_mass)
        if kick > KICK * self.request.rtol * length_and_speed(p)[1]:
            detail = (
                f"a contact of {force:.2g} N within one step of {span:.2g} s from {begin:.6g} s"
            )
            raise Stop(Reason.CONTACT_UNDERRESOLVED, detail)

    def audit(self, solver) -> None:
        """Compare the energy at the step's end with the flows up to there."""
        state, flows = solver.y[:-FLOWS].copy(), solver.y[-FLOWS:].copy()
        rhs, now = self.right_hand_side, np.array([solver.t])
        observe_all(now, state[np.newaxis], np.array([rhs.phase]), self.request.p, rhs.rows)
        tally_energy(rhs.rows[0], flows, self.result.tally)

    def check(self) -> None:
        """Raise Stop when a journal sinks in implausibly deep."""
        depth, p = float(self.result.tally.deepest), self.request.p
        if not depth <= greatest_depth(p)[0]:
            raise Stop(*too_deep(depth, p))
        self.right_hand_side.check_budget()

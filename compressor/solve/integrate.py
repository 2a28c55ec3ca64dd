"""Integrate one record over time: the compiled march, or SciPy's methods by name.

Both call the same right-hand side, restart at every load corner, observe each accepted step's
dense solution at Gauss-Lobatto nodes for the metrics, and sample it on the output grid. SciPy is
not trusted with states that go bad: its LSODA reports success with nan, and its Runge-Kutta
methods hang on inf. The only door to scipy.integrate.
"""

import itertools
import math
import time
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from compressor.cases import IMPLAUSIBLE
from compressor.physics import (
    COLUMNS,
    FLOWS,
    FREEDOMS,
    NORMAL,
    Load,
    Mode,
    Pair,
    Scene,
    Status,
    add_flows,
    derivative_with_flows,
    lobatto,
    march,
    new_tally,
    new_walker,
    new_work,
    observe,
    observe_all,
    sample_segments,
    segments,
    shares_apart,
    tally_energy,
    tally_step,
)
from compressor.reasons import Reason
from compressor.solve.last_steps import LAST, History, Snapshot, Standing, retrace

COMPILED = {
    "auto": (Mode.AUTO, Pair.TSIT5),
    "DOPRI5": (Mode.EXPLICIT, Pair.DOPRI5),
    "TSIT5": (Mode.EXPLICIT, Pair.TSIT5),
    "RODAS": (Mode.STIFF, Pair.DOPRI5),
}
# Local errors add up in the energy: with rtol itself, these methods left residuals above 10 rtol a
# revolution at the small end (LSODA up to 4 times, BDF 2.5, RK45 2), so they get a share of it.
LOCAL = {"LSODA": 0.1, "BDF": 0.1, "RK45": 0.3}
LEAST_RTOL = 2.3e-14  # SciPy's own floor
BAD_EVALUATIONS = 300  # non-finite right-hand sides in a row before a run is given up
EVALUATIONS_PER_STEP = 50  # a step that never ends is caught by its evaluations
NODES, WEIGHTS = lobatto(9)  # SciPy's steps may be long
CHUNK = 2048  # attempts of the march between two looks at the clock: 7 ms, or stiff ones 50 ms
PIECES_A_LOOK = 256  # of the ideal scene's quadrature between two looks at the clock
SAME_TIME = 1e-12  # of the run: edges this near to each other are one
KICK = 30.0  # tolerances of speed: what a contact within one step of SciPy's may add unseen
CONTACT_STEP = 0.3  # of the contact's own time scale: the first step after an onset


@dataclass
class Request:
    """What to integrate: a record (SI), the initial state, samples, span, settings and budgets."""

    p: np.record
    start: np.ndarray
    times: np.ndarray  # output grid, s, shape (m,)
    settle: float  # s
    rtol: float
    method: str = "auto"
    max_steps: int = 5_000_000
    timeout: float = math.inf  # s


@dataclass
class Trajectory:
    """States on the output grid, the tally of the dense solution, and how the run ended.

    `states` has shape (m, k) and is nan from the sample at which an incomplete run stopped;
    `reason` is empty when the run is complete.
    """

    times: np.ndarray
    states: np.ndarray
    phases: np.ndarray
    tally: np.record
    reason: str = ""
    detail: str = ""
    stop_time: float = math.nan
    stop_state: np.ndarray = field(default_factory=lambda: np.empty(0))
    history: History = field(default_factory=History)  # the last steps before a stop
    steps: int = 0
    rejected: int = 0
    evaluations: int = 0
    seconds: float = 0.0


class Stop(Exception):
    """A run that cannot go on, by its named reason."""

    def __init__(self, reason: str, detail: str):
        self.reason, self.detail = reason, detail
        super().__init__(f"{reason}: {detail}")


class Derivative:
    """The compiled right-hand side as SciPy calls it, counted, timed and guarded."""

    def __init__(self, request: Request):
        self.p = request.p
        self.z = np.zeros(request.start.size + FLOWS)
        self.row = np.empty(COLUMNS)
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


def scales(p: np.record) -> tuple[float, float]:
    """Length (m) and speed (m/s) that absolute tolerances are relative to.

    The length is the smaller of the clearance and the penetration under the forces at hand, but
    not below a thousandth of the latter; the speed is that length at the contact's frequency.
    """
    force = p["reciprocating_mass"] * p["crank_radius"] * p["omega"] ** 2
    if p["load"] == Load.DESIGN:
        force += p["preload"] + p["spring_stiffness"] * p["spring_stroke"]
    elif p["load"] == Load.TYPICAL:
        force += p["discharge_force"]
    faulty = p["clearance"] > 0
    stiffness = p["stiffness"][faulty].max()
    depth = (force / stiffness) ** (1 / p["exponent"])
    length = max(min(p["clearance"][faulty].min(), depth), 1e-3 * depth)
    mass = min(p["rod_mass"], p["reciprocating_mass"])
    frequency = math.sqrt(p["exponent"] * stiffness * depth ** (p["exponent"] - 1) / mass)
    return length, length * frequency


def natural_sizes(p: np.record) -> np.ndarray:
    """Size of each number of the motion, shape (2 n,): deviations (m, rad), their rates (per s)."""
    length, speed = scales(p)
    per_unit = np.ones(FREEDOMS[Scene(int(p["scene"]))])
    per_unit[-1] = 1.0 / p["rod_length"]  # the last freedom is an angle
    return np.concatenate((length * per_unit, speed * per_unit))


def absolute_tolerances(p: np.record, rtol: float) -> np.ndarray:
    """SciPy's atol, shape (2 n + 4,), for the scene's deviations, their rates, energy flows."""
    energy = (p.reciprocating_mass + p.rod_mass) * (p.crank_radius * p.omega) ** 2 / 2
    return rtol * np.concatenate((natural_sizes(p), np.full(FLOWS, energy)))


def integrate(request: Request) -> Trajectory:
    """Integrate a scene with clearance over its output grid; a run that fails is returned too."""
    edges, phases = segments(request.p, float(request.times[-1]))
    owner = sample_segments(request.times, edges)
    states = np.full((request.times.size, request.start.size), math.nan)
    result = Trajectory(request.times, states, phases[owner], new_tally())
    z = np.append(request.start, np.zeros(FLOWS))
    row = np.empty(COLUMNS)
    observe(0.0, request.start, int(phases[0]), request.p, row)
    tally_energy(row, z[-FLOWS:], result.tally)
    began = time.perf_counter()
    try:
        # a trial step may leave the finite numbers; the steps taken are checked
        with np.errstate(all="ignore"):
            if request.method in COMPILED:
                march_through(request, result, edges, phases, z)
            else:
                step_through(request, result, edges, phases, z)
    except Stop as stop:
        result.reason, result.detail = stop.reason, stop.detail
    result.seconds = time.perf_counter() - began
    return result


def ready_walker(request: Request, size: np.ndarray) -> np.record:
    """A walker at the start of a run by a compiled method; `size` as of `natural_sizes`."""
    mode, pair = COMPILED[request.method]
    walker = new_walker(mode)
    walker.pair, walker.rtol = pair, request.rtol
    walker.watch, walker.contact_step = 1, CONTACT_STEP * size[0] / size[size.size // 2]
    walker.deepest = IMPLAUSIBLE * request.p.pin_radius
    return walker


def march_through(request: Request, result: Trajectory, edges, phases, z: np.ndarray) -> None:
    """Integrate by the compiled loop, in chunks between which budgets are checked."""
    deadline = time.monotonic() + request.timeout
    size = natural_sizes(request.p)
    walker = ready_walker(request, size)
    edges, phases, walker.settle = cut(edges, phases, request.settle)
    now = Standing(walker, z, new_work(size.size), result.tally)

    def advance(some: Standing, attempts: int) -> None:
        march(
            some.walker, request.p, some.z, some.work, request.rtol * size, size, edges, phases,
            request.times, result.states, some.tally, attempts,
        )  # fmt: skip

    earlier = before = Snapshot.of(now)
    seen = 0  # attempts at the last snapshot
    while walker.status == Status.RUNNING:
        if result.steps + result.rejected >= seen + LAST:
            earlier, before = before, Snapshot.of(now)
            seen = result.steps + result.rejected
        advance(now, min(CHUNK, request.max_steps - walker.steps - walker.rejected))
        result.steps, result.rejected = int(walker.steps), int(walker.rejected)
        result.evaluations = int(walker.evaluations)
        if walker.status == Status.DONE:
            return
        try:
            check_march(request, walker, float(result.tally.deepest), deadline)
        except Stop:
            result.stop_time, result.stop_state = float(walker.t), z[:-FLOWS].copy()
            enough = result.steps + result.rejected >= seen + LAST
            kept = (before if enough else earlier).standing()
            result.history = retrace(
                kept, now, advance, request.p, request.rtol, size, edges, phases
            )
            raise


def cut(edges: np.ndarray, phases: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Segments that end at a time as well, and that time: of an edge that lies there already."""
    near = edges[np.abs(edges - time).argmin()]
    if abs(near - time) <= SAME_TIME * edges[-1]:
        return edges, phases, float(near)
    i = int(np.searchsorted(edges, time))
    if i == edges.size:
        return edges, phases, time
    return np.insert(edges, i, time), np.insert(phases, i, phases[i - 1]), time


def check_march(request: Request, walker: np.record, deepest: float, deadline: float) -> None:
    """Raise Stop where a march has stopped, or may go no further."""
    status = Status(int(walker.status))
    if status == Status.PENETRATION_IMPLAUSIBLE:
        raise Stop(Reason.PENETRATION_IMPLAUSIBLE, too_deep(deepest))
    if status == Status.NON_FINITE:
        raise Stop(Reason.NON_FINITE, "the state or its rates are no longer finite")
    if status == Status.STEP_UNDERFLOW:
        raise Stop(Reason.STEP_UNDERFLOW, f"the step has shrunk to {walker.h:.3g} s")
    if walker.steps + walker.rejected >= request.max_steps:
        raise Stop(Reason.BUDGET_STEPS, f"more than {request.max_steps} steps")
    if time.monotonic() > deadline:
        raise Stop(Reason.BUDGET_SECONDS, overdue(request.timeout))


def overdue(timeout: float) -> str:
    """What is wrong with a run that takes longer (s)."""
    return f"more than {timeout:g} s of wall time"


def too_deep(deepest: float) -> str:
    """What is wrong with a penetration (m)."""
    return f"{deepest * 1e3:.3g} mm, more than a tenth of the pin radius"


def step_through(request: Request, result: Trajectory, edges, phases, z: np.ndarray) -> None:
    """Integrate by one of SciPy's methods, segment by segment."""
    right_hand_side = Derivative(request)
    owner = sample_segments(request.times, edges)
    try:
        for i, phase in enumerate(phases):
            right_hand_side.phase = int(phase)
            wanted = np.flatnonzero(owner == i)
            segment = Segment(request, right_hand_side, result, edges[i], edges[i + 1], wanted)
            z = segment.run(z)
    finally:
        result.evaluations = right_hand_side.evaluations


@cache
def scipy_method(name: str) -> Any:
    """SciPy's method of a name, loaded when first used: a third of what a short run would take."""
    from scipy import integrate as scipy_integrate

    return getattr(scipy_integrate, name)


class Segment:
    """One stretch between load corners, stepped by a fresh SciPy solver."""

    def __init__(self, request, right_hand_side, result, begin, end, wanted):
        self.request, self.right_hand_side, self.result = request, right_hand_side, result
        self.begin, self.end = begin, end
        self.wanted = wanted  # indices of this segment's samples
        self.times = np.clip(request.times[wanted], begin, end)

    def run(self, z: np.ndarray) -> np.ndarray:
        """Step to the segment's end and return state and flows there; raises Stop."""
        request, result = self.request, self.result
        result.stop_time, result.stop_state = self.begin, z[:-FLOWS]
        rtol = max(request.rtol * LOCAL.get(request.method, 1.0), LEAST_RTOL)
        solver = scipy_method(request.method)(
            self.right_hand_side,
            self.begin,
            z,
            self.end,
            rtol=rtol,
            atol=absolute_tolerances(request.p, rtol),
        )
        while solver.status == "running":
            if result.steps >= request.max_steps:
                raise Stop(Reason.BUDGET_STEPS, f"more than {request.max_steps} steps")
            message = solver.step()
            if solver.status == "failed":
                raise Stop(Reason.STEP_UNDERFLOW, str(message))
            if not np.isfinite(solver.y).all():
                result.history.dominant = int(np.flatnonzero(~np.isfinite(solver.y))[0])
                raise Stop(Reason.NON_FINITE, "the state is no longer finite")
            result.steps += 1
            self.take(solver)
            self.audit(solver)
            result.stop_time, result.stop_state = solver.t, solver.y[:-FLOWS].copy()
            taken = solver.t - solver.t_old
            result.history.add(solver.t_old, taken, math.nan, f"{request.method} taken")
            self.check()
        if self.end == request.times[-1]:
            result.stop_time = math.nan
        return solver.y.copy()

    def take(self, solver) -> None:
        """Tally the accepted step and sample the output grid within it."""
        dense = solver.dense_output()
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
            self.result.states[self.wanted[low:high]] = dense(self.times[low:high])[:-FLOWS].T

    def tally(self, dense, begin: float, end: float, measured: bool) -> None:
        """Observe the dense solution on [begin, end] and add it to the tally."""
        times = begin + (end - begin) * NODES
        states = np.ascontiguousarray(dense(times)[:-FLOWS].T)
        rows = np.empty((times.size, COLUMNS))
        phases = np.full(times.size, self.right_hand_side.phase)
        observe_all(times, states, phases, self.request.p, rows)
        self.check_contact(begin, end - begin, rows)
        tally, p, apart = self.result.tally, self.request.p, np.empty(2)
        shares_apart(NODES, rows, apart)
        tally_step(end - begin, NODES, WEIGHTS, rows, 1, apart, measured, tally, p)

    def check_contact(self, begin: float, span: float, rows: np.ndarray) -> None:
        """Raise Stop where a whole contact lies within a step and its impulse is no small error."""
        normal = rows[:, NORMAL : NORMAL + 2]
        whole = (normal[1:-1] > 0).any(axis=0) & (normal[0] <= 0) & (normal[-1] <= 0)
        if not whole.any():
            return
        p, force = self.request.p, normal.max()
        kick = span * (WEIGHTS @ normal[:, whole]).max() / min(p.rod_mass, p.reciprocating_mass)
        if kick > KICK * self.request.rtol * scales(p)[1]:
            detail = (
                f"a contact of {force:.2g} N within one step of {span:.2g} s from {begin:.6g} s"
            )
            raise Stop(Reason.CONTACT_UNDERRESOLVED, detail)

    def audit(self, solver) -> None:
        """Compare the energy at the step's end with the flows up to there."""
        state, flows = solver.y[:-FLOWS].copy(), solver.y[-FLOWS:].copy()
        row = self.right_hand_side.row
        observe(solver.t, state, self.right_hand_side.phase, self.request.p, row)
        tally_energy(row, flows, self.result.tally)

    def check(self) -> None:
        """Raise Stop when a journal sinks in implausibly deep."""
        deepest, limit = self.result.tally.deepest, IMPLAUSIBLE * self.request.p.pin_radius
        if not deepest <= limit:
            raise Stop(Reason.PENETRATION_IMPLAUSIBLE, too_deep(deepest))
        self.right_hand_side.check_budget()


def closed_form(
    p: np.record, times: np.ndarray, settle: float, pieces: int, timeout: float = math.inf
) -> Trajectory:
    """The ideal scene: nothing is integrated, metrics and energy flows by quadrature.

    `pieces`: into which each stretch between load corners, or each revolution in it, is cut;
    `timeout`: wall time (s) that it may take.
    """
    deadline = time.monotonic() + timeout
    edges, phases = segments(p, float(times[-1]))
    result = Trajectory(
        times, np.zeros((times.size, 4)), phases[sample_segments(times, edges)], new_tally()
    )
    began = time.perf_counter()
    grid = fine_grid(edges, pieces, 2.0 * math.pi / p.omega)
    cuts = np.unique(np.concatenate((edges, [settle], grid)))
    owner = sample_segments((cuts[:-1] + cuts[1:]) / 2, edges)
    states = np.zeros((NODES.size, 4))
    rows = np.empty((NODES.size, COLUMNS))
    flows, apart = np.zeros(FLOWS), np.zeros(2)
    for number, (begin, end) in enumerate(itertools.pairwise(cuts)):
        phase = phases[owner[number]]
        if number % PIECES_A_LOOK == 0 and time.monotonic() > deadline:
            result.reason = Reason.BUDGET_SECONDS
            result.detail, result.stop_time = overdue(timeout), float(begin)
            result.states[times >= begin] = math.nan
            break
        nodes = begin + (end - begin) * NODES
        observe_all(nodes, states, np.full(NODES.size, phase), p, rows)
        tally_energy(rows[0], flows, result.tally)
        add_flows(rows, WEIGHTS, end - begin, flows)
        tally_energy(rows[-1], flows, result.tally)
        tally_step(end - begin, NODES, WEIGHTS, rows, 1, apart, begin >= settle, result.tally, p)
    result.seconds = time.perf_counter() - began
    return result


def fine_grid(edges: np.ndarray, pieces: int, turn: float) -> np.ndarray:
    """Points that cut every segment of the ideal motion into pieces a quadrature resolves."""
    grids = []
    for begin, end in itertools.pairwise(edges):
        count = pieces * math.ceil((end - begin) / turn - 1e-9)
        grids.append(np.linspace(begin, end, count + 1))
    return np.concatenate(grids)

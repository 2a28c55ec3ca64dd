"""Run a case at one tolerance: by the compiled march, by SciPy's methods, or in closed form.

All call the same right-hand side, restart at every load corner, observe each accepted step's dense
solution at Gauss-Lobatto nodes for the metrics, and sample it on the output grid.
"""

import itertools
import math
import time
from dataclasses import dataclass, field

import numpy as np

from compressor.cases import Case
from compressor.physics import (
    COLUMNS,
    FLOWS,
    LAST_STEPS,
    Attempt,
    Load,
    Mode,
    Status,
    WorkArrays,
    add_flows,
    march,
    merge_tallies,
    new_stepper,
    new_tally,
    new_work,
    observe_all,
    sample_segments,
    segments,
    tally_energy,
)
from compressor.reasons import Reason
from compressor.solve.dense_tally import WEIGHTS, Observer, tally_steps
from compressor.solve.request import (
    Cuts,
    Metrics,
    Request,
    Stop,
    Trajectory,
    Turns,
    check_state,
    greatest_depth,
    overdue,
    too_deep,
    with_cuts,
    with_edge,
)
from compressor.solve.run_metrics import metrics
from compressor.solve.scipy_driver import step_through
from compressor.solve.series import compared_times, finer, journal_distance, rows_of
from compressor.solve.si_record import contact_sizes, initial_state, is_ideal, natural_sizes, record

PIECES_PER_CHECK = 256  # of the quadrature between two looks at the clock


def closed_form(
    p: np.record, times: np.ndarray, settle: float, pieces: int, timeout: float = math.inf,
    has_rod_load: bool = False,
) -> Trajectory:  # fmt: skip
    """Return the trajectory of ideal joints over an output grid, without integration.

    `pieces`: into which each stretch between load corners, or each revolution in it, is cut, but a
    card's, which is cut at its nodes; `timeout`: wall time (s) that it may take; `has_rod_load`:
    whether the rod load is tallied.
    """
    deadline = time.monotonic() + timeout
    edges, phases = segments(p, float(times[-1]))
    tally = new_tally(has_rod_load)
    result = Trajectory(
        times, np.zeros((times.size, 4)), phases[sample_segments(times, edges)], tally
    )
    start = time.perf_counter()
    turn = 2.0 * math.pi / p.omega
    if p["load"] == Load.CARD:  # whose curve is of pieces between its nodes
        edges = np.arange(0.0, edges[-1] / turn, 1.0 / len(p["card"])) * turn
        edges, phases = np.append(edges, times[-1]), np.zeros(edges.size, dtype=np.int64)
        grid = edges
    else:
        grid = fine_grid(edges, pieces, turn)
    cuts = np.unique(np.concatenate((edges, [settle], grid)))
    owner, measured = sample_segments((cuts[:-1] + cuts[1:]) / 2, edges), cuts[:-1] >= settle
    changes = 1 + np.flatnonzero(np.diff(owner) | np.diff(measured))
    blocks = np.union1d(np.arange(0, owner.size, PIECES_PER_CHECK), changes)
    flows = np.zeros(FLOWS)
    for first, last in itertools.pairwise([*blocks, owner.size]):
        if time.monotonic() > deadline:
            result.reason = Reason.BUDGET_SECONDS
            result.detail, result.stop_time = overdue(timeout), float(cuts[first])
            result.states[times >= cuts[first]] = math.nan
            break
        steps, phase = cuts[first : last + 1], int(phases[owner[first]])
        rows = tally_steps(p, tally, steps, ideal_observer(p, phase), bool(measured[first]))
        for span, row in zip(np.diff(steps), rows, strict=True):
            tally_energy(row[0], flows, tally)
            add_flows(row, WEIGHTS, span, flows)
            tally_energy(row[-1], flows, tally)
    result.seconds = time.perf_counter() - start
    return result


def ideal_observer(p: np.record, phase: int) -> Observer:
    """Return what observes an ideal machine in a phase of its load."""

    def observe(times: np.ndarray) -> np.ndarray:
        rows = np.empty((times.size, COLUMNS))
        observe_all(times, np.zeros((times.size, 4)), np.full(times.size, phase), p, rows)
        return rows

    return observe


def fine_grid(edges: np.ndarray, pieces: int, turn: float) -> np.ndarray:
    """Return points that cut every segment into pieces short enough for a quadrature.

    edges: of the segments (s); pieces: of a revolution, whose length is `turn` (s).
    """
    grids = []
    for begin, end in itertools.pairwise(edges):
        count = pieces * math.ceil((end - begin) / turn - 1e-9)
        grids.append(np.linspace(begin, end, count + 1))
    return np.concatenate(grids)


COMPILED = {"auto": Mode.AUTO, "TSIT5": Mode.EXPLICIT, "RODAS": Mode.STIFF}
CONTACT_STEP = 0.3  # of the contact's own time scale: the first step after an onset
CHUNK = 2048  # attempts of the march between two looks at the clock: 5 ms, stiff ones 50 ms


def integrate(request: Request) -> Trajectory:
    """Integrate a motion over its output grid; a run that fails is returned too."""
    edges, phases = segments(request.fields, float(request.times[-1]))
    states = np.full((request.times.size, request.start.size), math.nan)
    result = Trajectory(
        request.times, states, phases[sample_segments(request.times, edges)],
        new_tally(request.has_rod_load),
    )  # fmt: skip
    z, rows = np.append(request.start, np.zeros(FLOWS)), np.empty((1, COLUMNS))
    observe_all(np.zeros(1), request.start[np.newaxis], phases[:1], request.p, rows)
    tally_energy(rows[0], z[-FLOWS:], result.tally)
    began = time.perf_counter()
    integrate_through = march_through if request.method in COMPILED else step_through
    try:
        # a trial step may leave the finite numbers; the steps taken are checked
        with np.errstate(all="ignore"):
            integrate_through(request, result, edges, phases, z)
    except Stop as stop:
        result.reason, result.detail = stop.reason, stop.detail
    if request.fields["load"] in (Load.GAS, Load.CYLINDER) and result.segments:
        edges, phases = result.segments
        result.phases = phases[sample_segments(result.times, edges)]
    result.seconds = time.perf_counter() - began
    return result


def march_through(request: Request, result: Trajectory, edges, phases, z: np.ndarray) -> None:
    """Integrate by the compiled loop into `result`, from motion and flows z on. Raises Stop."""
    deadline, size = time.monotonic() + request.timeout, natural_sizes(request.fields)
    stepper, work = prepare_stepper(request), new_work(size.size)
    edges, phases, stepper["settle"] = with_edge(edges, phases, request.settle)
    edges, phases, ends = with_cuts(edges, phases, request.cuts)
    phases = phases.copy()  # a march writes into them where a gas is shut in
    result.segments = edges, phases
    while stepper.status == Status.RUNNING:
        left = request.max_steps - result.steps - result.rejected
        count = ends[0] if ends else phases.size
        march(
            stepper, request.p, z, work, request.rtol * size, size, edges[: count + 1],
            phases[:count], request.times, result.states, result.tally, min(CHUNK, left),
        )  # fmt: skip
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
            result.last_steps = read_last_steps(stepper, work)
            raise


def prepare_stepper(request: Request) -> np.record:
    """Return a stepper at the start of a run by a compiled method."""
    stepper = new_stepper(COMPILED[request.method])
    stepper["rtol"] = request.rtol
    length, speed = contact_sizes(request.fields)
    stepper["watch"], stepper["contact_step"] = 1, CONTACT_STEP * length / speed
    stepper["deepest"] = greatest_depth(request.fields)[0]
    return stepper


WORDS = {
    Attempt.REFUSED: "refused", Attempt.TAKEN: "taken", Attempt.TO_ONSET: "to an onset",
    Attempt.CUT_AT_ONSET: "cut at an onset",
}  # fmt: skip


def read_last_steps(stepper: np.record, work: WorkArrays) -> list[tuple[float, float, float, str]]:
    """Return the last attempts of a march, by its ring of them."""
    found, attempts = [], int(stepper.attempts)
    for number in range(max(0, attempts - LAST_STEPS), attempts):
        begin, length, error, code = work.last[number % LAST_STEPS].tolist()
        name = "RODAS" if code >= Attempt.STIFF else "TSIT5"
        words = f"{name} {WORDS[Attempt(int(code) % Attempt.STIFF)]}"
        found.append((begin, length, error, words))
    return found


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


PIECES = 32  # of the ideal scene's quadrature, a revolution
FINER_POWER = 0.3  # power of the tolerance by which they become more


@dataclass
class Solution:
    """A case's motion and what is known of it.

    `rtol`: the tolerance it was integrated with; `metrics`: by name, empty where the run did not
    reach its end; `bars`, `series_errors`: an error of each metric and of each time series, empty
    where none was estimated; `samples`: observed rows at the times at which runs are compared;
    `reason` and `detail`: why the job failed, empty when it is ok; `promise`: whether what its
    accuracy promises was `kept`, or `none` was given; `horizon` (s): nan where none was looked for;
    `settle` (s): from where metrics count; `turns`: tallies of the settled revolutions, if they
    were cut; `statistics`: of a chaotic motion; `regime`: of `Regime`, or "" where nothing is
    known; `period`, `settled` (rev): of a periodic motion, nan of others; `companions`: the runs
    that errors are estimated by.
    """

    p: np.record
    trajectory: Trajectory
    rtol: float
    settle: float
    metrics: Metrics
    samples: np.ndarray
    reason: str
    detail: str
    bars: Metrics = field(default_factory=dict)
    series_errors: Metrics = field(default_factory=dict)
    promise: str = "none"
    horizon: float = math.nan
    turns: Turns = field(default_factory=list)
    statistics: Metrics = field(default_factory=dict)
    regime: str = ""
    period: float = math.nan
    settled: float = math.nan
    companions: "tuple[Solution, ...]" = ()

    def journals_apart(self, other: "Solution") -> float:
        """Return the greatest distance of the journals of two runs of a case, over their room."""
        return journal_distance(self.p, self.samples, other.samples)


def moves_body(case: Case) -> bool:
    """Return whether a case's runs move a body, for which they are sampled."""
    return case.body is not None


def is_sampled(case: Case) -> bool:
    """Return whether a case's result needs samples of its run: for time series, or for a body."""
    return case.output.keep == "series" or moves_body(case)


def run_at_tolerance(
    case: Case, rtol: float, timeout: float, sampled: bool, cuts: Cuts | None = None,
    state: np.ndarray | None = None, sampled_until: float = math.inf,
) -> Solution:  # fmt: skip
    """Return one run of a case at a tolerance, without errors, within a wall time (s).

    `sampled`: whether on the output grid; steps do not land on it, so that metrics are the same
    without. `cuts`: into revolutions; metrics are of all of them. `state`: the motion at the start,
    top dead centre (`physics.state_names`), in place of the case's own; no ideal scene has one.
    `sampled_until`: the time (s) behind which a long run has no samples but its end. A run that
    stops raises nothing: its `reason` says why.
    """
    p, end = record(case), case.duration
    output, compared = (
        times[(times <= sampled_until) | (times == end)]
        for times in (output_times(case, sampled), compared_times(case))
    )
    times = np.union1d(output, compared)
    if is_ideal(case):
        pieces = round(PIECES * (case.rtol / rtol) ** FINER_POWER)
        trajectory = closed_form(p, times, case.settle, pieces, timeout, case.output.signals)
    else:
        start = initial_state(case, p) if state is None else state
        trajectory = integrate(Request(
            p, start, times, case.settle, rtol, case.solve.method, case.solve.max_steps, timeout,
            cuts, case.output.signals,
        ))  # fmt: skip
    turns = cuts.turns if cuts else []
    if turns:
        trajectory.tally = merge_tallies([*turns, trajectory.tally])
    samples = rows_of(p, trajectory.at(compared), COLUMNS)
    reason, detail = trajectory.reason, trajectory.detail
    numbers = {} if reason else metrics(p, trajectory.tally)
    return Solution(
        p, trajectory.at(output), rtol, case.settle, numbers, samples, reason, detail, turns=turns
    )


def output_times(case: Case, sampled: bool) -> np.ndarray:
    """Return the times (s) at which a run of a case is kept: its output grid, or both ends."""
    samples = finer(case) * round(case.steps) if sampled else 1
    return case.duration * (np.arange(samples + 1) / samples)

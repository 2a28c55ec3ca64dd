"""Run a case at one tolerance: by the compiled march, by SciPy's methods, or in closed form.

All call the same right-hand side, restart at every load corner, observe each accepted step's dense
solution at Gauss-Lobatto nodes for the metrics, and sample it on the output grid.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from compressor.cases import Case
from compressor.physics import (
    COLUMNS,
    FLOWS,
    Load,
    Mode,
    Status,
    march,
    merge_tallies,
    new_stepper,
    new_tally,
    new_work,
    read_fields,
    rehearse,
    sample_segments,
    segments,
    tally_energy,
)
from compressor.reasons import Reason
from compressor.solve.dense_tally import closed_form
from compressor.solve.request import (
    Metrics,
    Request,
    Stop,
    Trajectory,
    check_depth,
    check_state,
    greatest_depths,
    revolutions,
    split_segments,
)
from compressor.solve.run_metrics import metrics
from compressor.solve.scipy_driver import step_through
from compressor.solve.series import compared_times, finer, rows_at, rows_of
from compressor.solve.si_record import contact_sizes, initial_state, is_ideal, natural_sizes, record

COMPILED = {"auto": Mode.AUTO, "TSIT5": Mode.EXPLICIT, "RODAS": Mode.STIFF}
CONTACT_STEP = 0.3  # of the contact's own time scale: the first step after an onset
CHUNK = 2048  # attempts of the march between two looks at the clock: 5 ms, stiff ones 50 ms


def integrate(request: Request) -> Trajectory:
    """Integrate a motion over its output grid; a run that fails is returned too."""
    p, times = request.p, request.times
    edges, phases = segments(request.fields, float(times[-1]))
    states = np.full((times.size, request.start.size), math.nan)
    result = Trajectory(
        times, states, phases[sample_segments(times, edges)], new_tally(request.has_rod_load)
    )
    z = np.append(request.start, np.zeros(FLOWS))
    row = rows_at(p, np.zeros(1), request.start[np.newaxis], phases[0])[0]
    tally_energy(row, z[-FLOWS:], result.tally)
    is_compiled = request.method in COMPILED
    # SciPy's dense solution of a long run would fill memory: each revolution ends an integration
    turn = math.tau / float(p["omega"])
    turns = np.empty(0) if is_compiled else revolutions(0.0, times[-1], turn)
    edges, phases, exact = split_segments(edges, phases, [request.settle, *turns, *request.cuts])
    ends = np.searchsorted(edges, exact[1 + len(turns) :]).tolist()
    # a run writes into its phases where a gas is shut in
    result.edges, result.edge_phases = edges, phases.copy()
    began = time.perf_counter()
    try:
        # a trial step may leave the finite numbers; the steps taken are checked
        with np.errstate(all="ignore"):
            (march_through if is_compiled else step_through)(request, result, exact[0], ends, z)
    except Stop as stop:
        result.reason, result.detail = stop.reason, stop.detail
    if request.fields["load"] in (Load.GAS, Load.CYLINDER):
        result.phases = result.edge_phases[sample_segments(times, edges)]
    result.seconds = time.perf_counter() - began
    return result


def compile_parts(case: Case) -> None:
    """Have parts of the march compiled that it then loads, a third of all that it is."""
    p = record(case)
    start, size = initial_state(case, p), natural_sizes(read_fields(p))
    _, phases = segments(read_fields(p), case.turn)
    z, work = np.append(start, np.zeros(FLOWS)), new_work(size.size)
    rehearse(new_stepper(Mode.AUTO), 1.0, z, work, size, phases[0], p, new_tally(True), 0)


def march_through(
    request: Request, result: Trajectory, settle: float, ends: list[int], z: np.ndarray
) -> None:
    """Integrate by the compiled loop into `result`, from motion and flows z on. Raises Stop.

    settle: the edge (s) from which metrics count; ends: how many segments lie before each cut.
    """
    deadline, size = time.monotonic() + request.timeout, natural_sizes(request.fields)
    stepper, work = new_stepper(COMPILED[request.method]), new_work(size.size)
    length, speed = contact_sizes(request.fields)
    stepper["rtol"], stepper["settle"] = request.rtol, settle
    stepper["contact_step"] = CONTACT_STEP * length / speed
    stepper["deepest"] = greatest_depths(request.fields)
    while stepper.status == Status.RUNNING:
        left = request.max_steps - result.steps - result.rejected
        count = ends[0] if ends else result.edge_phases.size
        march(
            stepper, request.p, z, work, request.rtol * size, size, result.edges[: count + 1],
            result.edge_phases[:count], request.times, result.states, result.tally,
            min(CHUNK, left),
        )  # fmt: skip
        result.steps, result.rejected = int(stepper.steps), int(stepper.rejected)
        result.evaluations = int(stepper.evaluations)
        if stepper.status == Status.DONE and ends:
            del ends[0]
            result.cut(z)
            is_enough = request.enough and request.enough(result)
            if not is_enough and stepper.segment < result.edge_phases.size:
                stepper.status = Status.RUNNING
        if stepper.status == Status.DONE:
            return
        try:
            check_march(request, stepper, z, result.tally.deepest, deadline)
        except Stop:
            result.stop_time, result.stop_state = float(stepper.t), z[:-FLOWS].copy()
            raise


def check_march(
    request: Request, stepper: np.record, z: np.ndarray, deepest: np.ndarray, deadline: float
) -> None:
    """Raise Stop where a march has stopped at z, or may go no further."""
    status = Status(int(stepper.status))
    check_state(request.p, z)
    if status == Status.PENETRATION_IMPLAUSIBLE:
        check_depth(deepest, request.p)
    if status == Status.NON_FINITE:
        raise Stop(Reason.NON_FINITE, "the state or its rates are no longer finite")
    if status == Status.STEP_UNDERFLOW:
        raise Stop(Reason.STEP_UNDERFLOW, f"the step has shrunk to {stepper.h:.3g} s")
    if stepper.steps + stepper.rejected >= request.max_steps:
        raise Stop(Reason.BUDGET_STEPS, f"more than {request.max_steps} steps")
    if time.monotonic() > deadline:
        raise Stop(Reason.BUDGET_SECONDS, "")


PIECES = 32  # of the ideal scene's quadrature, a revolution
FINER_POWER = 0.3  # power of the tolerance by which they become more


@dataclass
class Solution:
    """A case's motion and what is known of it.

    `metrics`: by name, empty where the run did not reach its end; `bars`, `series_errors`: empty
    where none was estimated; `samples`: observed rows at the times at which runs are compared;
    `reason`, `detail`: why the job failed; `promise`: `kept`, or `none`; `horizon` (s): nan where
    none was looked for; `settle` (s): from where metrics count; `statistics`: of a chaotic motion;
    `regime`: or ""; `period`, `settled` (rev): of a periodic motion; `companions`: the runs that
    errors come from.
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
    statistics: Metrics = field(default_factory=dict)
    regime: str = ""
    period: float = math.nan
    settled: float = math.nan
    companions: "tuple[Solution, ...]" = ()


def is_sampled(case: Case) -> bool:
    """Return whether a case's result needs samples of its run: for time series, or for a body."""
    return case.output.keep == "series" or case.body is not None


def run_at_tolerance(
    case: Case, rtol: float, timeout: float, sampled: bool, state: np.ndarray | None = None,
    cuts: Sequence[float] | np.ndarray = (), enough: Callable[[Trajectory], bool] | None = None,
    sampled_until: float = math.inf,
) -> Solution:  # fmt: skip
    """Return one run of a case at a tolerance, without errors, within a wall time (s).

    `sampled`: on the output grid; steps do not land on it. `state`: the motion at the start in
    place of the case's own. `cuts`, `enough`: as of a `Request`. `sampled_until`: the time (s)
    behind which there are no samples of the grid but the end. A run that stops raises nothing: its
    `reason` says why.
    """
    p, end = record(case), case.duration
    output, compared = output_times(case, sampled), compared_times(case)
    output = output[(output <= sampled_until) | (output == end)]
    times, has_rod_load = np.union1d(output, compared), case.output.signals
    if is_ideal(case):
        pieces = round(PIECES * (case.rtol / rtol) ** FINER_POWER)
        run = closed_form(p, times, case.settle, pieces, timeout, has_rod_load)
    else:
        start, solve = initial_state(case, p) if state is None else state, case.solve
        run = integrate(Request(
            p, start, times, case.settle, rtol, solve.method, solve.max_steps, timeout,
            has_rod_load, cuts, enough,
        ))  # fmt: skip
    if run.reason == Reason.BUDGET_SECONDS:  # the limit of all the case's runs, not what was left
        run.detail = f"more than {case.solve.timeout_s:g} s of wall time in all"
    if run.turns:
        run.tally = merge_tallies([*run.turns, run.tally])
    samples, numbers = rows_of(p, run.at(compared), COLUMNS), {}
    if not run.reason:
        numbers = metrics(p, run.tally)
    return Solution(p, run.at(output), rtol, case.settle, numbers, samples, run.reason, run.detail)


def output_times(case: Case, sampled: bool) -> np.ndarray:
    """Return the times (s) at which a run of a case is kept: its output grid, or both ends."""
    samples = finer(case) * round(case.steps) if sampled else 1
    return case.duration * (np.arange(samples + 1) / samples)

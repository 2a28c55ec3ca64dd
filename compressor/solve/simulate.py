"""Case -> Dataset: the only place where numbers get names, units and attributes."""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from compressor.cases import MODEL_VERSION, CardError, Case, require_case
from compressor.metrics import SERIES
from compressor.outcome import Outcome, row, without_run
from compressor.physics import is_featured, state_names
from compressor.program import PROGRAM, library_versions
from compressor.reasons import Reason
from compressor.solve.request import Trajectory, passed_time
from compressor.solve.run import Solution
from compressor.solve.run_metrics import ledger
from compressor.solve.series import SIGNALS, Variables, block, features, finer, rows_of, variable
from compressor.solve.solution import solve

if TYPE_CHECKING:
    import xarray as xr


def simulate(case: Case) -> "xr.Dataset":
    """Simulate one case and return its Dataset: status, metrics, error bars, time series.

    All numbers are SI; `attrs` of a variable have its `units` and `long_name`. Metrics have the
    dimensions (), (joint) or (joint, axis), such as `peak_acceleration` (m/s2) and
    `peak_contact_force` (N) by joint, and are taken over the dense solution after
    `solve.settle_rev`. `<metric>_error` is how far each may be from the exact value, in its own
    unit. Time series have (time), (time, joint) or (time, joint, axis), such as `acceleration`
    (m/s2) of the crosshead and `contact_force` (N) on the rod; with `output.keep: metrics` there
    are none. `docs/a-run.md` lists all of them.

    Raises CaseError for what is no Case, and nothing else: a run that fails has the `status`
    "failed", a `reason` by a stable name and the attribute `detail`, and its series are nan from
    where it stopped. `promise` says whether the accuracy was kept, `regime` how far the motion can
    be foretold; both are attributes, too.

    The first run in a process takes a few seconds to load the machine code, or a minute to
    compile it where that was never done; the next take some milliseconds.

    >>> import compressor
    >>> case = compressor.Case.from_values({
    ...     "joint": "big_end", "clearance_mm": 0.2,
    ...     "solve": {"duration_rev": 2, "accuracy": "draft"},
    ... })
    >>> run = compressor.simulate(case)
    >>> print(run.status.item(), run.promise.item(), run.regime.item())
    ok kept predictable
    >>> force = run.peak_contact_force.sel(joint="big_end")
    >>> bar = run.peak_contact_force_error.sel(joint="big_end")
    >>> print(f"{force / 1e3:.2f} kN, known to {100 * bar / force:.2f} %")
    8.81 kN, known to 0.06 %
    >>> run.contact_force.dims, run.contact_force.attrs["units"]
    (('time', 'joint', 'axis'), 'N')
    """
    found, series = observe(require_case(case))
    import xarray as xr  # takes half a second to load, which storing a job spares

    return xr.Dataset(found.table(series), attrs=found.attributes)


def observe(case: Case) -> tuple[Outcome, Variables]:
    """Simulate one case; return its `Outcome` and its time series (see `simulate`)."""
    try:
        return with_series(case, solve(case))
    except CardError as error:  # of a file that has changed, or is gone
        return without_run(case.attributes(), Reason.INVALID_INPUT, str(error)), {}


def with_series(case: Case, solution: Solution) -> tuple[Outcome, Variables]:
    """Return the `Outcome` of a solution, with metrics of body and sensor, and its time series."""
    result, keeps_series = outcome(case, solution), case.output.keep == "series"
    variables = series(case, solution) if keeps_series else {}
    if case.body:
        from compressor.solve.body import foundation  # loads parts of SciPy

        more, numbers = foundation(case, solution)
        variables |= more if keeps_series else {}
        for name, value in numbers.items():
            result.numbers[name] = value
    return result, variables


def measure(case: Case) -> Outcome:
    """Simulate one case; return its `Outcome` alone."""
    return observe(case)[0]


def series(case: Case, solution: Solution) -> Variables:
    """Return the time series as xarray variables, with the signals and features of the case."""
    p, on_grid = solution.p, slice(None, None, finer(case))
    rows = rows_of(p, solution.trajectory, part=on_grid)
    times, states = solution.trajectory.times[on_grid], solution.trajectory.states[on_grid]
    time = passed_time(p, times, states)
    angles = np.where(np.isnan(time), np.nan, p.omega * times)  # a stalled crank turns no further
    variables = {
        "time": variable(("time",), time.copy(), "s", "time"),
        "crank_angle": variable(("time",), angles, "rad", "crank angle from top dead centre"),
    }
    for name, (dims, unit, phrase) in (SERIES | (SIGNALS if case.output.signals else {})).items():
        variables[name] = variable(("time", *dims), block(name, rows).copy(), unit, phrase)
    if is_featured(p):
        for name, found in features(p, states, rows).items():
            variables[name] = variable(("time",), *found)
    return variables


def outcome(case: Case, solution: Solution) -> Outcome:
    """Return what is kept of a solution without its series, and without a body's metrics."""
    numbers = row()
    values = solution.metrics | ledger(solution.p, solution.trajectory)
    errors = solution.bars | solution.series_errors
    values |= {f"{name}_error": error for name, error in errors.items()} | solution.statistics
    values |= {"predictability_horizon": solution.horizon}
    values |= {"period_rev": solution.period, "settled_rev": solution.settled}
    for name, value in values.items():
        numbers[name] = value
    status = "failed" if solution.reason else "ok"
    return Outcome(status, str(solution.reason), numbers, attributes(case, solution))


def attributes(case: Case, solution: Solution) -> dict[str, object]:
    """Return what a reader of the file needs to know of the case and the program."""
    trajectory = solution.trajectory
    attrs: dict[str, object] = {
        "comment": "SI units; forces act on the rod; the frame of the README",
        **case.attributes(),
        "complete": 0 if trajectory.reason else 1,
        "settle": settle_time(solution),
        "rtol": solution.rtol,
        "error_bars": int(case.wants_bars),
        "signals": int(case.output.signals),
        "promise": solution.promise,
        "regime": solution.regime,
        "method": case.solve.method,
        "model_version": MODEL_VERSION,
        "program": PROGRAM,
        "libraries": libraries(),
    }
    if solution.reason:
        attrs["detail"] = solution.detail
    if trajectory.reason:
        attrs |= stop_attributes(case, solution)
    return attrs


def settle_time(solution: Solution) -> float:
    """Return the time (s) from which metrics count, also of a crank whose speed gives way."""
    p, run = solution.p, solution.trajectory
    if not (is_featured(p) and p["driven"]) or not run.tally["seconds"]:
        return solution.settle
    inside = np.isfinite(run.states[:, 0])
    if run.times.size > 2 and inside.any() and run.times[inside][-1] >= solution.settle:
        times = run.times[inside]
        return float(np.interp(solution.settle, times, passed_time(p, times, run.states[inside])))
    return stop_time(p, run) - float(run.tally["seconds"])


def stop_time(p: np.record, run: Trajectory) -> float:
    """Return the time (s) at which a run stopped or ended."""
    at = run.stop_time if run.reason else float(run.times[-1])
    return float(passed_time(p, np.array([at]), run.last_state[np.newaxis])[0])


def stop_attributes(case: Case, solution: Solution) -> dict[str, object]:
    """Return where a run stopped, and in which state."""
    trajectory = solution.trajectory
    return {
        "stop_time": stop_time(solution.p, trajectory),
        "stop_crank_angle": case.omega * trajectory.stop_time,
        "stop_state": trajectory.stop_state,
        "stop_state_names": "; ".join(state_names(solution.p)),
    }


@cache
def libraries() -> str:
    """Return the libraries that results depend on, with their versions."""
    versions = library_versions("numpy", "scipy", "numba")
    return ", ".join(f"{name} {version}" for name, version in versions.items())

"""Case -> Dataset: the only place where numbers get names, units and attributes."""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from compressor.cases import MODEL, Case, require_case
from compressor.metrics import SERIES
from compressor.outcome import Outcome, Table, row, without_run
from compressor.physics import FLOWS, is_featured, state_names
from compressor.program import PROGRAM, library_versions
from compressor.reasons import Reason
from compressor.solve.attempts import NOTHING_AHEAD, Ahead, Solution
from compressor.solve.foundation import foundation
from compressor.solve.request import NONE, Trajectory, last_state
from compressor.solve.series import block, finer, rows_of
from compressor.solve.signals import SIGNALS, features, passed, signals
from compressor.solve.solution import solve
from compressor.solve.tallied import ledger

if TYPE_CHECKING:
    import xarray as xr

MOST_KEPT = 1_000_000  # samples of a Dataset whose like is kept
LIKE: dict[tuple, "xr.Dataset"] = {}  # the last Dataset without its values, by names and shapes


def simulate(case: Case) -> "xr.Dataset":
    """Simulate one case and return its Dataset: status, metrics, error bars, time series.

    All numbers are SI; `attrs` of a variable have its `units` and `long_name`. Metrics have the
    dimensions (), (joint) or (joint, axis), such as `peak_acceleration` (m/s2) and
    `peak_contact_force` (N) by joint, and are taken over the dense solution after
    `solve.settle_rev`. `<metric>_error` is how far each may be from the exact value, in its own
    unit. Time series have (time), (time, joint) or (time, joint, axis), such as `acceleration`
    (m/s2) of the crosshead and `contact_force` (N) on the rod; with `output.keep: metrics` there
    are none. `solve/README.md` lists all of them, and tells how they are made.

    Raises CaseError for what is no Case, and nothing else: a run that fails has the `status`
    "failed", a `reason` by a stable name and the attribute `detail`, and its series are nan from
    where it stopped. `attrs["promise"]` says whether the accuracy was kept, `attrs["regime"]` how
    far the motion can be foretold.

    The first run in a process takes a few seconds to load the machine code, or a minute to
    compile it where that was never done; the next take some milliseconds.

    >>> import compressor
    >>> case = compressor.Case.from_values({
    ...     "joint": "big_end", "clearance_mm": 0.2,
    ...     "solve": {"duration_rev": 2, "accuracy": "draft"},
    ... })
    >>> run = compressor.simulate(case)
    >>> print(run.status.item(), run.attrs["promise"], run.attrs["regime"])
    ok kept predictable
    >>> force = run.peak_contact_force.sel(joint="big_end")
    >>> bar = run.peak_contact_force_error.sel(joint="big_end")
    >>> print(f"{force / 1e3:.2f} kN, known to {100 * bar / force:.2f} %")
    8.81 kN, known to 0.04 %
    >>> run.contact_force.dims, run.contact_force.attrs["units"]
    (('time', 'joint', 'axis'), 'N')
    """
    return as_dataset(observe(require_case(case))[1])


def as_dataset(table: Table) -> "xr.Dataset":
    """Return the Dataset of a table: the last one's like with other values, where shapes are the
    same.

    To make one anew takes xarray three times as long: it compares each variable with all others.
    """
    import xarray as xr

    shape = tuple((name, one.dims, one.values.shape) for name, one in table.variables.items())
    indexes = {name: one for name, one in table.variables.items() if one.dims == (name,)}
    like = LIKE.get(shape)
    if like is None or not all(
        np.array_equal(like.variables[name].values, one.values) for name, one in indexes.items()
    ):
        hollow = {
            name: one._replace(values=np.broadcast_to(np.zeros((), one.values.dtype), sizes))
            for (name, _, sizes), one in zip(shape, table.variables.values(), strict=True)
        }
        like = xr.Dataset(hollow | indexes)
        LIKE.clear()
        if all(size <= MOST_KEPT for size in like.sizes.values()):
            LIKE[shape] = like
    made = like.copy(data={str(name): table.variables[str(name)].values for name in like.data_vars})
    for name, variable in made.variables.items():
        variable.attrs = dict(table.variables[str(name)].attrs)
    made.attrs = dict(table.attrs)
    return made


def observe(case: Case, ahead: Ahead = NOTHING_AHEAD) -> tuple[Outcome, Table]:
    """Simulate one case for its `Outcome` and what its Dataset is made of (see `simulate`)."""
    if case.problems:
        found = refused(case)
        return found, found.table({})
    return with_series(case, solve(case, ahead))


def with_series(case: Case, solution: Solution) -> tuple[Outcome, Table]:
    """Return the `Outcome` of a solution and what its Dataset is made of."""
    kept = case.output.keep == "series"
    found = outcome(case, solution)
    more = series(case, solution) if kept else {}
    if "clipped_share" in more:
        found.numbers["clipped_fraction"] = more["clipped_share"][1]
    return found, found.table(more)


def measure(case: Case, ahead: Ahead = NOTHING_AHEAD) -> Outcome:
    """Simulate one case for its `Outcome` alone: what `simulate` gives less the time series."""
    return refused(case) if case.problems else outcome(case, solve(case, ahead))


def refused(case: Case) -> Outcome:
    """Return the outcome of a case that no case file could ask for."""
    detail = "; ".join(map(str, case.problems))
    return without_run(case.attributes(), Reason.INVALID_INPUT, detail)


def series(case: Case, solution: Solution) -> dict[str, tuple]:
    """Return the time series as xarray variables, with signals, body and sensor where they are
    wanted.
    """
    p, every = solution.p, finer(case)
    whole = rows_of(p, solution.trajectory)
    rows, times = whole[::every], solution.trajectory.times[::every]
    states = solution.trajectory.states[::every]
    angle = {"units": "rad", "long_name": "crank angle from top dead centre"}
    time = passed(p, times, states)
    turned = np.where(np.isnan(time), np.nan, p.omega * times)  # a stalled crank turns no further
    variables: dict[str, tuple] = {
        "time": (("time",), time, {"units": "s", "long_name": "time"}),
        "crank_angle": (("time",), turned, angle),
    }
    for name, (dims, unit, phrase) in SERIES.items():
        attrs = {"units": unit, "long_name": phrase}
        variables[name] = (("time", *dims), np.ascontiguousarray(block(name, rows)), attrs)
    for name, values in (signals(p, rows) if case.output.signals else {}).items():
        dims, unit, phrase = SIGNALS[name]
        variables[name] = (("time", *dims), values, {"units": unit, "long_name": phrase})
    if is_featured(p):
        for name, (values, unit, phrase) in features(p, states, rows).items():
            variables[name] = (("time",), values, {"units": unit, "long_name": phrase})
    return variables | (foundation(case, solution, whole) if case.body else {})


def outcome(case: Case, solution: Solution) -> Outcome:
    """Return what is kept of a solution without its series."""
    numbers = row()
    known = solution.metrics | solution.reversal | ledger(solution.p, solution.trajectory)
    errors = solution.bars | solution.series_errors | solution.reversal_bars
    known |= {f"{name}_error": error for name, error in errors.items()}
    known |= solution.statistics
    known |= {
        "predictability_horizon": solution.horizon,
        "period_rev": solution.period,
        "settled_rev": solution.settled,
    }
    for name, value in known.items():
        numbers[name] = value
    status = "failed" if solution.reason else "ok"
    return Outcome(status, str(solution.reason), numbers, attributes(case, solution))


def attributes(case: Case, solution: Solution) -> dict[str, object]:
    """Return what a reader of the file needs to know of the case and the program."""
    trajectory = solution.trajectory
    attrs: dict[str, object] = {
        "Conventions": "SI units; forces act on the rod; the frame of the README",
        **case.attributes(),
        "complete": 0 if trajectory.reason else 1,
        "settle": settle_time(solution),
        "rtol": solution.rtol,
        "error_bars": int(case.wants_bars),
        "signals": int(case.output.signals),
        "promise": solution.promise,
        "regime": solution.regime,
        "method": case.solve.method,
        "model_version": MODEL,
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
        return float(np.interp(solution.settle, times, passed(p, times, run.states[inside])))
    return stop_time(p, run) - float(run.tally["seconds"])


def stop_time(p: np.record, run: Trajectory) -> float:
    """Return the time (s) at which a run stopped or ended."""
    at = run.stop_time if run.reason else float(run.times[-1])
    return float(passed(p, np.array([at]), last_state(run)[np.newaxis])[0])


def stop_attributes(case: Case, solution: Solution) -> dict[str, object]:
    """Return where a run stopped, in which state, and how its last steps went."""
    trajectory = solution.trajectory
    history, names = trajectory.history, state_names(solution.p)
    flows = ("energy flow, J",) * FLOWS
    return {
        "stop_time": stop_time(solution.p, trajectory),
        "stop_crank_angle": case.omega * trajectory.stop_time,
        "stop_state": trajectory.stop_state,
        "stop_state_names": "; ".join(names),
        "stop_dominant": "" if history.dominant == NONE else (names + flows)[history.dominant],
        "stop_history_time": np.array(history.times),
        "stop_history_step": np.array(history.steps),
        "stop_history_error": np.array(history.errors),
        "stop_history_words": "; ".join(history.words),
    }


@cache
def libraries() -> str:
    """Return the libraries that results depend on, with their versions."""
    versions = library_versions("numpy", "scipy", "numba")
    return ", ".join(f"{name} {version}" for name, version in versions.items())

"""Case -> Dataset: the only place where numbers get names, units and attributes."""

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from compressor.cases import MODEL_VERSION, Case, back_action, require_case
from compressor.metrics import SERIES
from compressor.outcome import DatasetParts, Outcome, row, without_run, word_variables
from compressor.physics import is_featured, state_names
from compressor.program import PROGRAM, library_versions
from compressor.reasons import Reason
from compressor.solve.request import Metrics, Trajectory, passed_time
from compressor.solve.run import Solution
from compressor.solve.run_metrics import ledger
from compressor.solve.series import SIGNALS, block, features, finer, rows_of, signals
from compressor.solve.solution import solve

if TYPE_CHECKING:
    import xarray as xr

    from compressor.vibration import Record

Variables = dict[str, tuple]  # as xarray has them

BODY = {  # over time and these dimensions: (dimensions, unit, long name)
    "body_displacement": (("axis",), "m", "displacement of the body's mass centre"),
    "body_velocity": (("axis",), "m/s", "velocity of the body's mass centre"),
    "body_acceleration": (("axis",), "m/s2", "acceleration of the body's mass centre"),
    "body_rocking": ((), "rad", "rotation of the body, counter-clockwise"),
}


def foundation(case: Case, solution: Solution) -> tuple[Variables, Metrics]:
    """Return the body's motion on the output grid, the sensor's record in time of its own, metrics.

    A steady body is nan before the machine has settled; all is nan, and there is no record and no
    metric, of a run that did not reach its end. `one_way_error`: bound of the relative L2 error of
    the body's velocity by leaving out what its motion does to the machine: of the order m / M away
    from resonances. A journal's chatter may come at other moments on a body that gives way, so that
    no bound is stated of accelerations. Metrics have their error bars beside them
    (`compressor.solve.body_metrics`).
    """
    from compressor.solve import body_metrics

    stride, numbers, shaken = finer(case), {}, None
    variables: Variables = {}
    samples = (solution.trajectory.times.size - 1) // stride + 1
    values = {name: np.full((samples, 2)[: 1 + len(BODY[name][0])], math.nan) for name in BODY}
    if not solution.trajectory.reason:
        shaken = body_metrics.shake_by(case, solution)
        begin = body_metrics.first_sample(case, solution)
        motion, grid = shaken.motion, slice(-begin % stride, None, stride)
        for name in ("displacement", "velocity", "acceleration"):
            both = np.stack([getattr(motion[axis], name) for axis in "xy"], axis=1)
            values[f"body_{name}"][-len(both[grid]) :] = both[grid]
        rocking = motion["rocking"].displacement[grid]
        values["body_rocking"][-len(rocking) :] = rocking
    for name, (dims, unit, phrase) in BODY.items():
        variables[name] = (("time", *dims), values[name], {"units": unit, "long_name": phrase})
    if shaken:
        spectra = tuple(motion[axis].velocity[:-1] for axis in "xy")
        phrase = "bound of the relative error of the body's velocity: it is driven one way"
        attrs = {"units": "1", "long_name": phrase}
        errors = one_way_errors(case, spectra, solution.trajectory.times[1])
        variables["one_way_error"] = (("axis",), errors, attrs)
        numbers = body_metrics.with_bars(case, solution, shaken)
    if shaken and shaken.recorded:
        variables |= sensor_variables(shaken.recorded)
        numbers["clipped_fraction"] = shaken.recorded.clipped
    return variables, numbers


def sensor_variables(record: "Record") -> Variables:
    """Return a sensor's samples and the tacho's pulses, each with a dimension of its own."""
    since = "time since the record's begin"
    return {
        "sensor_time": (("sensor_time",), record.times, {"units": "s", "long_name": since}),
        "sensor_acceleration": (
            ("sensor_time",), record.values,
            {"units": "m/s2", "long_name": "samples of the accelerometer"},
        ),
        "tacho_time": (
            ("pulse",), record.tacho,
            {"units": "s", "long_name": "times at which the crank passes top dead centre"},
        ),
    }  # fmt: skip


def one_way_errors(case: Case, velocities: tuple, step: float) -> list[float]:
    """Return the bound by axis, from the spectrum of each velocity at equal steps (s)."""
    from compressor.vibration import line_amplitudes

    bounds = []
    for axis, values in zip(("x", "y"), velocities, strict=True):
        if not values.any():
            bounds.append(0.0)
            continue
        amplitudes = line_amplitudes(values, values.size, True)
        frequencies = np.arange(amplitudes.size) / (values.size * step)
        back = np.abs(back_action(case, axis, frequencies))
        error = np.where(back < 1.0, back / np.maximum(1.0 - back, 1e-12), np.inf)
        shares = amplitudes**2 / (amplitudes**2).sum()
        bounds.append(float(np.sqrt((shares * error**2).sum())))
    return bounds


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
    found, variables = observe(require_case(case))
    table = found.table(variables)
    return as_dataset(DatasetParts(table.variables | word_variables(table.attrs), table.attrs))


def as_dataset(table: DatasetParts) -> "xr.Dataset":
    """Return the Dataset of a table."""
    import xarray as xr

    return xr.Dataset(dict(table.variables), attrs=dict(table.attrs))


def observe(case: Case) -> tuple[Outcome, Variables]:
    """Simulate one case; return its `Outcome` and its time series (see `simulate`)."""
    if refused := refused_outcome(case):
        return refused, {}
    return with_series(case, solve(case))


def with_series(case: Case, solution: Solution) -> tuple[Outcome, Variables]:
    """Return the `Outcome` of a solution, with the metrics of body and sensor, and its time series.

    There are none of a case that keeps metrics alone.
    """
    result, keeps_series = outcome(case, solution), case.output.keep == "series"
    variables: Variables = {}
    if not (keeps_series or case.body):
        return result, {}
    if case.body:
        variables, numbers = foundation(case, solution)
        for name, value in numbers.items():
            result.numbers[name] = value
    return result, series(case, solution) | variables if keeps_series else {}


def measure(case: Case) -> Outcome:
    """Simulate one case; return its `Outcome` alone."""
    return observe(case)[0]


def refused_outcome(case: Case) -> Outcome | None:
    """Return the outcome of a case whose card is not there, or not as it was; None of others."""
    detail = case.find_changed_card()
    return without_run(case.attributes(), Reason.INVALID_INPUT, detail) if detail else None


def series(case: Case, solution: Solution) -> Variables:
    """Return the time series as xarray variables, with the signals and features of the case."""
    p, on_grid = solution.p, slice(None, None, finer(case))
    rows = rows_of(p, solution.trajectory, part=on_grid)
    times, states = solution.trajectory.times[on_grid], solution.trajectory.states[on_grid]
    angle_attrs = {"units": "rad", "long_name": "crank angle from top dead centre"}
    time = passed_time(p, times, states)
    angles = np.where(np.isnan(time), np.nan, p.omega * times)  # a stalled crank turns no further
    variables: Variables = {
        "time": (("time",), time.copy(), {"units": "s", "long_name": "time"}),
        "crank_angle": (("time",), angles, angle_attrs),
    }
    for name, (dims, unit, phrase) in SERIES.items():
        attrs = {"units": unit, "long_name": phrase}
        variables[name] = (("time", *dims), np.ascontiguousarray(block(name, rows)), attrs)
    for name, values in (signals(rows) if case.output.signals else {}).items():
        dims, unit, phrase = SIGNALS[name]
        variables[name] = (("time", *dims), values, {"units": unit, "long_name": phrase})
    if is_featured(p):
        for name, (values, unit, phrase) in features(p, states, rows).items():
            variables[name] = (("time",), values, {"units": unit, "long_name": phrase})
    return variables


def outcome(case: Case, solution: Solution) -> Outcome:
    """Return what is kept of a solution without its series, and without a body's metrics."""
    numbers = row()
    values = solution.metrics | ledger(solution.p, solution.trajectory)
    errors = solution.bars | solution.series_errors
    values |= {f"{name}_error": error for name, error in errors.items()}
    values |= solution.statistics
    values |= {
        "predictability_horizon": solution.horizon,
        "period_rev": solution.period,
        "settled_rev": solution.settled,
    }
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
    """Return where a run stopped, in which state, and how its last steps went."""
    trajectory = solution.trajectory
    last = trajectory.last_steps
    return {
        "stop_time": stop_time(solution.p, trajectory),
        "stop_crank_angle": case.omega * trajectory.stop_time,
        "stop_state": trajectory.stop_state,
        "stop_state_names": "; ".join(state_names(solution.p)),
        "stop_history_time": np.array([time for time, *_ in last]),
        "stop_history_step": np.array([length for _, length, *_ in last]),
        "stop_history_error": np.array([error for *_, error, _ in last]),
        "stop_history_words": "; ".join(words for *_, words in last),
    }


@cache
def libraries() -> str:
    """Return the libraries that results depend on, with their versions."""
    versions = library_versions("numpy", "scipy", "numba")
    return ", ".join(f"{name} {version}" for name, version in versions.items())

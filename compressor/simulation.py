"""Case -> Dataset: the only place where numbers get names, units and attributes."""

import json
import math
from functools import cache
from importlib import metadata
from typing import TYPE_CHECKING, Any

import numpy as np

import compressor
from compressor.case import MODEL_VERSION, Case
from compressor.integrate import Request, Trajectory, closed_form, integrate
from compressor.physics.motion import start
from compressor.physics.observe import COLUMNS, Column, observe_all
from compressor.physics.parameters import FREEDOMS, Scene
from compressor.record import offsets, record, scene
from compressor.schema import ROW, Outcome, Table, Variable, coordinates

if TYPE_CHECKING:
    import xarray as xr

# name: (column, extra dimensions, unit, long name)
SERIES = {
    "displacement": (Column.DISPLACEMENT, (), "m", "crosshead position from the crank centre"),
    "velocity": (Column.VELOCITY, (), "m/s", "crosshead velocity"),
    "acceleration": (Column.ACCELERATION, (), "m/s2", "crosshead acceleration"),
    "rod_angle": (Column.ROD_ANGLE, (), "rad", "rod angle phi"),
    "piston_force": (Column.PISTON_FORCE, (), "N", "piston force, positive towards the crank"),
    "contact_force": (Column.FORCE, ("joint", "axis"), "N", "joint force on the rod"),
    "eccentricity": (
        Column.ECCENTRICITY, ("joint", "axis"), "m", "journal centre less bearing centre",
    ),
    "penetration": (
        Column.PENETRATION, ("joint",), "m", "contact penetration, negative where there is a gap",
    ),
}  # fmt: skip


def simulate(case: Case) -> "xr.Dataset":
    """Simulate one case and return its Dataset (DESIGN 4): series, metrics, status.

    Dims: time, joint, axis; SI units in the attributes. A run that fails is no exception: its
    `status` is "failed", `reason` says why by a stable name, and its series are nan from where it
    stopped. Metrics are taken over the dense solution after `settle_rev`.
    """
    import xarray as xr

    table = observe(case)[1]
    return xr.Dataset(table.variables, attrs=table.attrs)


def observe(case: Case) -> tuple[Outcome, Table]:
    """Simulate one case for its `Outcome` and what its Dataset is made of (see `simulate`)."""
    p, trajectory = solve(case)
    found = outcome(case, p, trajectory)
    variables = found.variables() | coordinates()
    if case.output.keep == "series":
        variables |= series(p, trajectory)
    named = {name: Variable(d, np.asarray(v), attrs) for name, (d, v, attrs) in variables.items()}
    return found, Table(named, found.attributes)


def measure(case: Case) -> Outcome:
    """Simulate one case for its `Outcome` alone: what `simulate` gives less the time series."""
    return outcome(case, *solve(case))


def solve(case: Case) -> tuple[np.record, Trajectory]:
    """A case's record and its motion."""
    p = record(case)
    times = case.duration * (np.arange(round(case.steps) + 1) / round(case.steps))
    if scene(case) == Scene.IDEAL:
        return p, closed_form(p, times, case.settle)
    y = np.zeros(2 * FREEDOMS[scene(case)])
    start(offsets(case), y, p)
    how = case.solve
    return p, integrate(
        Request(p, y, times, case.settle, case.rtol, how.method, how.max_steps, how.timeout_s)
    )


def series(p: np.record, trajectory: Trajectory) -> dict[str, tuple]:
    """The time series as xarray variables."""
    rows = np.empty((trajectory.times.size, COLUMNS))
    observe_all(trajectory.times, trajectory.states, trajectory.phases, p, rows)
    rows[np.isnan(trajectory.states).any(axis=1)] = math.nan
    angle = {"units": "rad", "long_name": "crank angle from top dead centre"}
    variables: dict[str, tuple] = {
        "time": (("time",), trajectory.times, {"units": "s", "long_name": "time"}),
        "crank_angle": (("time",), p.omega * trajectory.times, angle),
    }
    sizes = {"joint": 2, "axis": 2}
    for name, (column, dims, unit, phrase) in SERIES.items():
        shape = tuple(sizes[dim] for dim in dims)
        block = rows[:, column : column + math.prod(shape)].reshape(-1, *shape)
        attrs = {"units": unit, "long_name": phrase}
        variables[name] = (("time", *dims), np.ascontiguousarray(block), attrs)
    return variables


def outcome(case: Case, p: np.record, trajectory: Trajectory) -> Outcome:
    """What is kept of a trajectory without its series."""
    numbers = np.full(1, math.nan, dtype=ROW)[0]
    if not trajectory.reason:
        for name, value in metrics(p, trajectory.tally).items():
            numbers[name] = value
    for name, value in ledger(trajectory).items():
        numbers[name] = value
    status = "failed" if trajectory.reason else "ok"
    return Outcome(status, trajectory.reason, numbers, attributes(case, trajectory))


def metrics(p: np.record, tally: np.record) -> dict[str, Any]:
    """The metrics by name, from what was tallied after settling."""
    ideal = p["clearance"] == 0
    seconds = tally["seconds"] or math.nan
    return {
        "peak_acceleration": tally["peak"][0],
        "rms_acceleration": math.sqrt(tally["square_acceleration"] / seconds),
        "rms_acceleration_deviation": math.sqrt(tally["square_deviation"] / seconds),
        "peak_contact_force": tally["peak"][5:],
        "peak_contact_force_axis": tally["peak"][1:5].reshape(2, 2),
        "max_penetration": np.where(ideal, 0.0, tally["max_penetration"]),
        "contact_loss_fraction": np.where(ideal, 0.0, tally["loss_seconds"] / seconds),
        "impact_count": np.where(ideal, 0.0, tally["impacts"]),
    }


def energy_residual(tally: np.record) -> float:
    """Worst imbalance relative to the contact's losses, floored at 1e-3 of the kinetic energy."""
    lost = tally["damping_loss"] + tally["friction_loss"]
    return float(tally["worst_imbalance"] / max(lost, 1e-3 * tally["peak_kinetic"]))


def ledger(trajectory: Trajectory) -> dict[str, float]:
    """Energy flows and counts by name."""
    tally = trajectory.tally
    return {
        "crank_work": tally["crank_work"],
        "load_work": tally["load_work"],
        "contact_damping_loss": tally["damping_loss"],
        "friction_loss": tally["friction_loss"],
        "energy_residual": energy_residual(tally) if tally["started"] else math.nan,
        "steps": trajectory.steps,
        "rejected": trajectory.rejected,
        "evaluations": trajectory.evaluations,
        "seconds": trajectory.seconds,
    }


def attributes(case: Case, trajectory: Trajectory) -> dict[str, object]:
    """What a reader of the file needs to know of the case and the program."""
    attrs: dict[str, object] = {
        "Conventions": "SI units; forces act on the rod; the frame of the README",
        "name": case.name,
        "case": json.dumps(case.values(), sort_keys=True),
        "key": case.key,
        "physics_key": case.physics_key,
        "complete": 0 if trajectory.reason else 1,
        "settle": case.settle,
        "rtol": case.rtol,
        "method": case.solve.method,
        "model_version": MODEL_VERSION,
        "program": f"compsim {compressor.__version__}",
        "libraries": libraries(),
    }
    if trajectory.reason:
        attrs["detail"] = trajectory.detail
        attrs["stop_time"] = trajectory.stop_time
        attrs["stop_crank_angle"] = case.omega * trajectory.stop_time
        attrs["stop_state"] = trajectory.stop_state
        attrs["stop_state_names"] = ", ".join(STATE_NAMES[trajectory.stop_state.size])
    return attrs


@cache
def libraries() -> str:
    """The libraries that results depend on, with their versions."""
    return ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "scipy", "numba"))


STATE_NAMES = {
    0: (),
    4: ("x deviation, m", "phi deviation, rad", "its rate, m/s", "its rate, rad/s"),
    8: (
        "x deviation, m", "X deviation, m", "Y deviation, m", "phi deviation, rad",
        "x rate, m/s", "X rate, m/s", "Y rate, m/s", "phi rate, rad/s",
    ),
}  # fmt: skip

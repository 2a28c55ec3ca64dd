"""Case -> Dataset: the only place where numbers get names, units and attributes."""

import json
import math
from importlib import metadata

import numpy as np
import xarray as xr

import compressor
from compressor.case import MODEL_VERSION, Case
from compressor.integrate import Request, Trajectory, closed_form, integrate
from compressor.parameter import JOINTS
from compressor.physics.motion import start
from compressor.physics.observe import COLUMNS, Column, observe_all
from compressor.physics.parameters import FREEDOMS, Scene
from compressor.record import offsets, record, scene

AXES = ("x", "y")

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
# name: (dimensions, unit, long name)
METRICS = {
    "peak_acceleration": ((), "m/s2", "greatest |acceleration|"),
    "rms_acceleration": ((), "m/s2", "root mean square of acceleration"),
    "rms_acceleration_deviation": ((), "m/s2", "rms of acceleration less the ideal machine's"),
    "peak_contact_force": (("joint",), "N", "greatest joint force on the rod"),
    "peak_contact_force_axis": (("joint", "axis"), "N", "greatest joint force along an axis"),
    "max_penetration": (("joint",), "m", "greatest penetration; negative: never touched"),
    "contact_loss_fraction": (("joint",), "1", "share of time without contact (F_N = 0)"),
    "impact_count": (("joint",), "1", "times that contact began"),
}
# energy flows and how the run went
LEDGER = {
    "crank_work": ("J", "work put in by the crank over the run"),
    "load_work": ("J", "work put in by the piston force over the run"),
    "contact_damping_loss": ("J", "energy lost to contact damping over the run"),
    "friction_loss": ("J", "energy lost to joint friction over the run"),
    "energy_residual": ("1", "worst energy imbalance relative to the contact's losses"),
    "steps": ("1", "accepted integration steps"),
    "rejected": ("1", "rejected steps; SciPy's methods do not tell"),
    "evaluations": ("1", "evaluations of the right-hand side"),
    "seconds": ("s", "wall time of the solution"),
}


def simulate(case: Case) -> xr.Dataset:
    """Simulate one case and return its Dataset (DESIGN 4): series, metrics, status.

    Dims: time, joint, axis; SI units in the attributes. A run that fails is no exception: its
    `status` is "failed", `reason` says why by a stable name, and its series are nan from where it
    stopped. Metrics are taken over the dense solution after `settle_rev`.
    """
    p = record(case)
    times = case.duration * (np.arange(round(case.steps) + 1) / round(case.steps))
    if scene(case) == Scene.IDEAL:
        trajectory = closed_form(p, times, case.settle)
    else:
        y = np.zeros(2 * FREEDOMS[scene(case)])
        start(offsets(case), y, p)
        solve = case.solve
        trajectory = integrate(
            Request(
                p, y, times, case.settle, case.rtol, solve.method, solve.max_steps, solve.timeout_s
            )
        )
    return dataset(case, p, trajectory)


def dataset(case: Case, p: np.record, trajectory: Trajectory) -> xr.Dataset:
    """Name what a trajectory holds."""
    variables = ledger(case, p, trajectory) | metrics(p, trajectory)
    if case.output.keep == "series":
        variables |= series(p, trajectory)
    coordinates: dict[str, tuple] = {
        "joint": ("joint", list(JOINTS), {"long_name": "joint of the rod"}),
        "axis": ("axis", list(AXES), {"long_name": "direction; x along the cylinder, y up"}),
    }
    if case.output.keep == "series":
        coordinates["time"] = ("time", trajectory.times, {"units": "s", "long_name": "time"})
    return xr.Dataset(variables, coordinates, attributes(case, trajectory))


def series(p: np.record, trajectory: Trajectory) -> dict[str, tuple]:
    """The time series as xarray variables."""
    rows = np.empty((trajectory.times.size, COLUMNS))
    observe_all(trajectory.times, trajectory.states, trajectory.phases, p, rows)
    rows[np.isnan(trajectory.states).any(axis=1)] = math.nan
    angle = {"units": "rad", "long_name": "crank angle from top dead centre"}
    variables: dict[str, tuple] = {"crank_angle": ("time", p.omega * trajectory.times, angle)}
    sizes = {"joint": 2, "axis": 2}
    for name, (column, dims, unit, phrase) in SERIES.items():
        shape = tuple(sizes[dim] for dim in dims)
        block = rows[:, column : column + math.prod(shape)].reshape(-1, *shape)
        attrs = {"units": unit, "long_name": phrase}
        variables[name] = (("time", *dims), np.ascontiguousarray(block), attrs)
    return variables


def metrics(p: np.record, trajectory: Trajectory) -> dict[str, tuple]:
    """The metrics as xarray variables; nan when the run did not reach its end."""
    tally = trajectory.tally
    ideal = p.clearance == 0
    seconds = tally.seconds or math.nan
    values = {
        "peak_acceleration": tally.peak_acceleration,
        "rms_acceleration": math.sqrt(tally.square_acceleration / seconds),
        "rms_acceleration_deviation": math.sqrt(tally.square_deviation / seconds),
        "peak_contact_force": tally.peak_force,
        "peak_contact_force_axis": tally.peak_force_axis.reshape(2, 2),
        "max_penetration": np.where(ideal, 0.0, tally.max_penetration),
        "contact_loss_fraction": np.where(ideal, 0.0, tally.loss_seconds / seconds),
        "impact_count": np.where(ideal, 0.0, tally.impacts),
    }
    variables = {}
    for name, (dims, unit, phrase) in METRICS.items():
        value = np.array(values[name], dtype=float)
        if trajectory.reason:
            value[...] = math.nan
        variables[name] = (dims, value, {"units": unit, "long_name": phrase})
    return variables


def energy_residual(tally: np.record) -> float:
    """Worst imbalance relative to the contact's losses, floored at 1e-3 of the kinetic energy."""
    lost = tally.damping_loss + tally.friction_loss
    return float(tally.worst_imbalance / max(lost, 1e-3 * tally.peak_kinetic))


def ledger(case: Case, p: np.record, trajectory: Trajectory) -> dict[str, tuple]:
    """Status, energy flows and counts as xarray scalars."""
    tally = trajectory.tally
    values = (
        tally.crank_work,
        tally.load_work,
        tally.damping_loss,
        tally.friction_loss,
        energy_residual(tally) if tally.started else math.nan,
        trajectory.steps,
        trajectory.rejected,
        trajectory.evaluations,
        trajectory.seconds,
    )
    variables: dict[str, tuple] = {
        "status": ((), "failed" if trajectory.reason else "ok", {"long_name": "ok or failed"}),
        "reason": ((), trajectory.reason, {"long_name": "why a run failed, by a stable name"}),
    }
    for (name, (unit, phrase)), value in zip(LEDGER.items(), values, strict=True):
        variables[name] = ((), value, {"units": unit, "long_name": phrase})
    return variables


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
        "libraries": ", ".join(
            f"{name} {metadata.version(name)}" for name in ("numpy", "scipy", "numba")
        ),
    }
    if trajectory.reason:
        attrs["detail"] = trajectory.detail
        attrs["stop_time"] = trajectory.stop_time
        attrs["stop_crank_angle"] = case.omega * trajectory.stop_time
        attrs["stop_state"] = trajectory.stop_state
        attrs["stop_state_names"] = ", ".join(STATE_NAMES[trajectory.stop_state.size])
    return attrs


STATE_NAMES = {
    0: (),
    4: ("x deviation, m", "phi deviation, rad", "its rate, m/s", "its rate, rad/s"),
    8: (
        "x deviation, m", "X deviation, m", "Y deviation, m", "phi deviation, rad",
        "x rate, m/s", "X rate, m/s", "Y rate, m/s", "phi rate, rad/s",
    ),
}  # fmt: skip

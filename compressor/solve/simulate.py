"""Case -> Dataset: the only place where numbers get names, units and attributes."""

import itertools
import json
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import metadata
from typing import TYPE_CHECKING

import numpy as np

import compressor
from compressor.cases import LOOSEST, MODEL_VERSION, TIGHTEST, Case, CaseError
from compressor.metrics import HORIZON, SIZES
from compressor.outcome import ROW, Outcome, Table, Variable, coordinates, without_run
from compressor.physics import (
    COLUMNS,
    FLOWS,
    FREEDOMS,
    STATE_NAMES,
    Column,
    Scene,
    observe_all,
    start,
)
from compressor.reasons import Reason
from compressor.solve.energy_audit import RUNGS, allowed, energy_residual
from compressor.solve.error_bars import Metrics, Witness, bars, unmet
from compressor.solve.horizon import predictability_horizon
from compressor.solve.ideal_scene import closed_form
from compressor.solve.integrate import integrate
from compressor.solve.parting import looked_at, looking, parted
from compressor.solve.request import NONE, Request, Trajectory
from compressor.solve.si_record import offsets, record, scene

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

NO_LOOKS = np.zeros((1, 2, 2))  # of a run that is compared with no other, or has ideal joints
PIECES = 32  # of the ideal scene's quadrature; twice as many a rung
OUT_OF_BUDGET = (
    Reason.BUDGET_STEPS,
    Reason.BUDGET_SECONDS,
    Reason.STEP_UNDERFLOW,
)  # a tighter run may end so


@dataclass
class Solution:
    """A case's motion and what is told of it.

    `rtol`: the tolerance it was integrated with; `metrics`: by name, empty where the run did not
    reach its end; `bars`: an error bar of each metric, empty where none was made; `looks`:
    eccentricities (m) at a few times, by which runs are compared; `reason` and `detail`: why the
    job failed, empty when it is ok; `horizon` (s): nan where none was asked for.
    """

    p: np.record
    trajectory: Trajectory
    rtol: float
    metrics: Metrics
    bars: Metrics
    looks: np.ndarray
    reason: str
    detail: str
    horizon: float = math.nan


def simulate(case: Case) -> "xr.Dataset":
    """Simulate one case and return its Dataset: series, metrics, status.

    Dims: time, joint, axis; SI units in the attributes. A run that fails is no exception: its
    `status` is "failed", `reason` says why by a stable name, and its series are nan from where it
    stopped. Metrics are taken over the dense solution after `settle_rev`.
    """
    import xarray as xr

    table = observe(case)[1]
    return xr.Dataset(table.variables, attrs=table.attrs)


def observe(case: Case) -> tuple[Outcome, Table]:
    """Simulate one case for its `Outcome` and what its Dataset is made of (see `simulate`)."""
    return tabled(refused(case), {}) if case.problems else told(case, solve(case))


def told(case: Case, found: Solution) -> tuple[Outcome, Table]:
    """The `Outcome` of a solution and what its Dataset is made of."""
    kept = case.output.keep == "series"
    return tabled(outcome(case, found), series(found.p, found.trajectory) if kept else {})


def tabled(end: Outcome, more: dict[str, tuple]) -> tuple[Outcome, Table]:
    """An outcome and, with more variables, what its Dataset is made of."""
    variables = end.variables() | coordinates() | more
    named = {name: Variable(d, np.asarray(v), attrs) for name, (d, v, attrs) in variables.items()}
    return end, Table(named, end.attributes)


def measure(case: Case) -> Outcome:
    """Simulate one case for its `Outcome` alone: what `simulate` gives less the time series."""
    return refused(case) if case.problems else outcome(case, solve(case))


def refused(case: Case) -> Outcome:
    """The outcome of a case that no case file could ask for."""
    return without_run(case, Reason.INVALID_INPUT, str(CaseError([*case.problems])))


def solve(case: Case) -> Solution:
    """A case's motion, with error bars and the horizon where they are wanted."""
    began = time.monotonic()
    found = climb(case) if case.targets else once(case)
    if case.solve.horizon and not found.reason:
        left = case.solve.timeout_s - (time.monotonic() - began)
        found.horizon = predictability_horizon(case, left)
        if found.horizon < case.duration:
            beyond_horizon(case, found)
    return found


def beyond_horizon(case: Case, found: Solution) -> None:
    """Withdraw the error bars of a motion that cannot be foretold to its end."""
    found.bars = {name: np.full(np.shape(bar), math.inf) for name, bar in found.bars.items()}
    if case.targets:
        found.reason = Reason.ACCURACY_NOT_REACHED
        turns = found.horizon / case.turn
        found.detail = f"no error bar holds beyond the horizon, {turns:.3g} revolutions"


def once(case: Case) -> Solution:
    """A case's motion at its own tolerance, with error bars where they are wanted."""
    found = audited(case, case.output.keep == "series")
    if case.wants_bars and not found.reason:
        left = case.solve.timeout_s - found.trajectory.seconds
        found.bars = error_bars(found, witnesses(case, found, left))
    return found


def witnesses(case: Case, found: Solution, timeout: float) -> list[Solution]:
    """The runs that tell the error of another; none if the first of them fails.

    The first is ten times looser; or ten times tighter where the tolerance is so loose that
    explicit steps may run over friction's fast modes, then by the stiff partner, and where the
    looser run has failed its audit. A second one is a thousand times looser, if that is not too
    loose.
    """
    rung, retried = round(math.log10(case.rtol / found.rtol)), found.rtol < 0.5 * case.rtol
    stiff = replace(case, solve=replace(case.solve, method="RODAS"))
    loose = found.rtol > LOOSEST
    tighter = loose or (retried and found.rtol > 5.0 * TIGHTEST)
    near = attempt(stiff if loose else case, rung + (1 if tighter else -1), timeout, False)
    if near.reason or 1e3 * found.rtol > LOOSEST:
        return [] if near.reason else [near]
    far = attempt(case, rung - 3, timeout - near.trajectory.seconds, False)
    return [near] if far.reason else [near, far]


def audited(case: Case, sampled: bool) -> Solution:
    """A run whose energy balances: at the case's tolerance, or up to RUNGS times ten tighter.

    Where no run passes the audit, the last whole one is a failed job.
    """
    left = case.solve.timeout_s
    best: Solution | None = None
    for rung in range(RUNGS + 1):
        found = attempt(case, rung, left, sampled)
        if best and found.reason in OUT_OF_BUDGET:
            return unbalanced(case, best, found.reason, f"the next run: {found.detail}")
        if found.reason or balanced(case, found):
            return found
        left -= found.trajectory.seconds
        best = found
        if found.rtol < 9.9 * TIGHTEST:
            break
    return unbalanced(case, found, "", f"at rtol {found.rtol:.2g}")


def balanced(case: Case, found: Solution) -> bool:
    """Whether the energy of a whole run balances as well as the case asks for."""
    return energy_residual(found.trajectory.tally) <= allowed(case.rtol, case.duration / case.turn)


def unbalanced(case: Case, best: Solution, reason: str, detail: str) -> Solution:
    """A whole run as a failed job: its series and energies are kept, its metrics are not."""
    residual = energy_residual(best.trajectory.tally)
    most = allowed(case.rtol, case.duration / case.turn)
    best.metrics, best.bars = {}, {}
    timed_out = reason == Reason.BUDGET_SECONDS
    best.reason = reason if timed_out else Reason.ENERGY_AUDIT_FAILED
    best.detail = f"energy residual {residual:.2g}, more than {most:.2g}; {detail}"
    return best


def climb(case: Case) -> Solution:
    """Ever tighter runs, until the bars of the metrics that accuracy is asked for are met.

    The looser runs are the witnesses of the next, so that bars cost nothing. A ladder that ends
    before keeps its last whole run, and says how far it came.
    """
    left = case.solve.timeout_s
    sampled = case.output.keep == "series"
    runs = [attempt(case, 0, left, sampled)]
    for rung in itertools.count(1):
        best = runs[-1]
        if best.reason:
            return best
        left -= best.trajectory.seconds
        if case.rtol / 10.0**rung < 0.99 * TIGHTEST:
            return short_of(case, best, Reason.ACCURACY_NOT_REACHED, "no run is tighter")
        found = attempt(case, rung, left, sampled)
        if found.reason in OUT_OF_BUDGET:
            reason = (
                found.reason
                if found.reason == Reason.BUDGET_SECONDS
                else Reason.ACCURACY_NOT_REACHED
            )
            return short_of(case, best, reason, f"the next run: {found.detail}")
        if not found.reason:
            found.bars = error_bars(found, [best, *runs[-3:-2]])
            told = balanced(case, best) and balanced(case, found)
            if told and not unmet(case.targets, found.metrics, found.bars):
                return found
        runs.append(found)
    raise AssertionError("the ladder has an end")


def short_of(case: Case, best: Solution, reason: str, detail: str) -> Solution:
    """The best run of a ladder as a failed job that tells how far it came."""
    if not balanced(case, best):
        return unbalanced(case, best, reason, detail)
    best.bars = best.bars or error_bars(best, [])
    missed = unmet(case.targets, best.metrics, best.bars)
    best.reason = reason
    best.detail = "; ".join([*missed, f"at rtol {best.rtol:.2g}", detail])
    return best


def attempt(case: Case, rung: int, timeout: float, sampled: bool) -> Solution:
    """One run of a case, 10^rung times tighter than it asks for, without error bars.

    The ideal scene's quadrature gets twice the pieces a rung. `sampled`: whether on the output
    grid; steps do not land on it, so that metrics are the same without.
    """
    p, rtol = record(case), case.rtol / 10.0**rung
    samples = round(case.steps) if sampled else 1
    times = case.duration * (np.arange(samples + 1) / samples)
    if scene(case) == Scene.IDEAL:
        trajectory = closed_form(p, times, case.settle, round(PIECES * 2.0**rung), timeout)
        looks = NO_LOOKS
    else:
        y = np.zeros(2 * FREEDOMS[scene(case)])
        start(offsets(case), y, p)
        how = case.solve
        grid = looking(times) if case.wants_bars else times
        trajectory = integrate(
            Request(p, y, grid, case.settle, rtol, how.method, how.max_steps, timeout)
        )
        looks = looked_at(p, trajectory, times) if case.wants_bars else NO_LOOKS
    found = {} if trajectory.reason else metrics(p, trajectory.tally)
    return Solution(p, trajectory, rtol, found, {}, looks, trajectory.reason, trajectory.detail)


def error_bars(found: Solution, others: Sequence[Solution]) -> Metrics:
    """The error bar of each metric by other runs of the case; unknown where there are none."""
    told = [Witness(o.metrics, o.rtol, parted(found.p, found.looks, o.looks)) for o in others]
    return bars(found.metrics, told, found.rtol, energy_residual(found.trajectory.tally))


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
    for name, (column, dims, unit, phrase) in SERIES.items():
        shape = tuple(SIZES[dim] for dim in dims)
        block = rows[:, column : column + math.prod(shape)].reshape(-1, *shape)
        attrs = {"units": unit, "long_name": phrase}
        variables[name] = (("time", *dims), np.ascontiguousarray(block), attrs)
    return variables


def outcome(case: Case, found: Solution) -> Outcome:
    """What is kept of a solution without its series."""
    numbers = np.full(1, math.nan, dtype=ROW)[0]
    known = {**found.metrics, **ledger(found.trajectory)}
    known |= {f"{name}_error": bar for name, bar in found.bars.items()}
    known[HORIZON] = found.horizon
    for name, value in known.items():
        numbers[name] = value
    status = "failed" if found.reason else "ok"
    return Outcome(status, str(found.reason), numbers, attributes(case, found))


def metrics(p: np.record, tally: np.record) -> Metrics:
    """The metrics by name, from what was tallied after settling."""
    ideal = p["clearance"] == 0
    seconds = tally["seconds"] or math.nan
    axes, sizes = Column.FORCE - Column.ACCELERATION, Column.FORCE_SIZE - Column.ACCELERATION
    return {
        "peak_acceleration": tally["peak"][0],
        "rms_acceleration": math.sqrt(tally["square_acceleration"] / seconds),
        "rms_acceleration_deviation": math.sqrt(tally["square_deviation"] / seconds),
        "peak_contact_force": tally["peak"][sizes:],
        "peak_contact_force_axis": tally["peak"][axes:sizes].reshape(2, 2),
        "max_penetration": np.where(ideal, 0.0, tally["max_penetration"]),
        "contact_loss_fraction": np.where(ideal, 0.0, tally["loss_seconds"] / seconds),
        "impact_count": np.where(ideal, 0.0, tally["impacts"]),
    }


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


def attributes(case: Case, found: Solution) -> dict[str, object]:
    """What a reader of the file needs to know of the case and the program."""
    trajectory = found.trajectory
    attrs: dict[str, object] = {
        "Conventions": "SI units; forces act on the rod; the frame of the README",
        "name": case.name,
        "case": json.dumps(case.values(), sort_keys=True),
        "key": case.key,
        "physics_key": case.physics_key,
        "complete": 0 if trajectory.reason else 1,
        "settle": case.settle,
        "rtol": found.rtol,
        "error_bars": int(case.wants_bars),
        "method": case.solve.method,
        "model_version": MODEL_VERSION,
        "program": f"compsim {compressor.__version__}",
        "libraries": libraries(),
    }
    if found.reason:
        attrs["detail"] = found.detail
    if trajectory.reason:
        attrs |= stop_attributes(case, trajectory)
    return attrs


def stop_attributes(case: Case, trajectory: Trajectory) -> dict[str, object]:
    """Where a run stopped, in which state, and how its last steps went."""
    history, names = trajectory.history, STATE_NAMES[scene(case)]
    flows = ("energy flow, J",) * FLOWS
    return {
        "stop_time": trajectory.stop_time,
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
    """The libraries that results depend on, with their versions."""
    return ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "scipy", "numba"))

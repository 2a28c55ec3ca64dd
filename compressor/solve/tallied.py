"""The numbers of a job from what its run has tallied."""

import math

import numpy as np

from compressor.physics import Column, is_featured
from compressor.solve.energy_audit import energy_residual
from compressor.solve.error_bars import Metrics
from compressor.solve.request import Trajectory, last_state

ROUNDING = 1e-12


def metrics(p: np.record, tally: np.record) -> Metrics:
    """Return the metrics by name, from what was tallied after settling."""
    ideal = p["clearance"] == 0
    seconds = tally["seconds"] or math.nan
    axes, sizes = Column.FORCE - Column.ACCELERATION, Column.FORCE_SIZE - Column.ACCELERATION
    # the spans of steps add up to within rounding: whole revolutions are to stay whole
    name = "steady_seconds" if is_featured(p) else "seconds"
    steady = tally[name] or math.nan
    revolutions = round(float(steady * p["omega"]) / math.tau, 9)
    return {
        "peak_acceleration": tally["peak"][0],
        "rms_acceleration": math.sqrt(tally["square_acceleration"] / seconds),
        "rms_acceleration_deviation": math.sqrt(tally["square_deviation"] / seconds),
        "peak_contact_force": tally["peak"][sizes:],
        "peak_contact_force_axis": tally["peak"][axes:sizes].reshape(2, 2),
        "max_penetration": np.where(ideal, 0.0, tally["max_penetration"]),
        "contact_loss_fraction": np.where(ideal, 0.0, tally["loss_seconds"] / seconds),
        "mean_crank_torque": tally["crank_torque"] / seconds,
        "mean_guide_moment": tally["guide_moment"] / seconds,
        "impact_count": np.where(ideal, 0.0, tally["impacts"]),
        "release_count": np.where(ideal, 0.0, tally["releases"]),
        "impacts_per_rev": np.where(ideal, 0.0, tally["impacts"] / revolutions),
        "releases_per_rev": np.where(ideal, 0.0, tally["releases"] / revolutions),
    }


def ledger(p: np.record, trajectory: Trajectory) -> dict[str, float]:
    """Return the energy flows and counts by name."""
    tally, state = trajectory.tally, last_state(trajectory)
    elastic = is_featured(p) and p["elastic"]
    lost = float(state[p["rod_loss"]]) if elastic else 0.0
    # both are integrated by the same stages: without a contact they are equal but for rounding
    contact = tally["damping_loss"] - lost
    return {
        "crank_work": tally["crank_work"],
        "load_work": tally["load_work"],
        "contact_damping_loss": 0.0 if abs(contact) <= ROUNDING * lost else contact,
        "rod_damping_loss": lost,
        "friction_loss": tally["friction_loss"],
        "energy_residual": energy_residual(tally) if tally["started"] else math.nan,
        "steps": trajectory.steps,
        "rejected": trajectory.rejected,
        "evaluations": trajectory.evaluations,
        "seconds": trajectory.seconds,
    }

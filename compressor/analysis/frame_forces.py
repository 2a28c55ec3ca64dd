"""Forces on the frame from a run's stored series: what its figures draw, signals kept or not."""

from dataclasses import replace

import numpy as np
import xarray as xr

from compressor.analysis.runs import case_of, record_of, settled
from compressor.cases import Case, with_ideal_joints
from compressor.metrics import JOINTS
from compressor.solve import forces_on_frame, simulate

BIG_END = JOINTS.index("big_end")


class NoSeriesError(ValueError):
    """A run of which no series are kept, or too few to be read."""


def frame_forces(run: xr.Dataset) -> dict[str, np.ndarray]:
    """The signals of `compressor.solve.signals` by name, at all samples of a run; SI.

    They follow from contact_force, piston_force, displacement and penetration, so that no run needs
    `output: {signals: true}` for them. Raises NoSeriesError for a run without time series.
    """
    if "time" not in run.dims or "contact_force" not in run:
        raise NoSeriesError("the run has no time series (output.keep: series)")
    force = run["contact_force"].transpose("time", "joint", "axis").values
    series = (run[name].values for name in ("piston_force", "displacement"))
    found = forces_on_frame(record_of(run), force, *series)
    return found | {"crank_torque": crank_torque(run)}


def crank_torque(run: xr.Dataset) -> np.ndarray:
    """Torque (N m) that drives the crank along its rotation, (m,).

    R (cos theta F_by - sin theta F_bx) - (R_j - depth) F_t with the friction F_t at the big end's
    journal (compressor/solve/README.md, The Dataset). The force on the rod is F_N n - F_t t with n
    along the eccentricity, and t a quarter turn from it, counter-clockwise.
    """
    p = record_of(run)
    at = run.sel(joint=JOINTS[BIG_END])
    force = at["contact_force"].transpose("time", "axis").values
    angle = run["crank_angle"].values
    lever = float(p["crank_radius"])
    torque = lever * (np.cos(angle) * force[:, 1] - np.sin(angle) * force[:, 0])
    if p["clearance"][BIG_END] > 0:
        place = at["eccentricity"].transpose("time", "axis").values
        size = np.linalg.norm(place, axis=1)
        across = place[:, 0] * force[:, 1] - place[:, 1] * force[:, 0]
        friction = -np.divide(across, size, out=np.zeros_like(size), where=size > 0)
        torque = torque - (float(p["pin_radius"]) - at["penetration"].values) * friction
    return torque


def whole_revolutions(run: xr.Dataset) -> tuple[xr.Dataset, int]:
    """The settled samples up to the last whole revolution's end, and how many they are.

    Raises NoSeriesError for a run without time series, or that settles within less than one.
    """
    if "time" not in run.dims or "crank_angle" not in run:
        raise NoSeriesError("the run has no time series (output.keep: series)")
    kept = settled(run)
    turns = (kept["crank_angle"].values - kept["crank_angle"].values[0]) / (2.0 * np.pi)
    count = int(np.floor(turns[-1] + 1e-6))
    if count < 1:
        raise NoSeriesError("the run has no whole settled revolution (solve.duration_rev)")
    return kept.isel(time=turns <= count + 1e-6), count


def last_revolution(run: xr.Dataset) -> tuple[np.ndarray, xr.Dataset]:
    """The last whole settled revolution, both ends included, and its crank angles (degrees).

    The first angle lies from 0 to 360. Raises NoSeriesError as `whole_revolutions`.
    """
    kept, count = whole_revolutions(run)
    angle = np.degrees(kept["crank_angle"].values)
    inside = angle >= angle[0] + 360.0 * (count - 1) - 1e-6
    angle = angle[inside]
    return angle - 360.0 * np.floor(angle[0] / 360.0 + 1e-9), kept.isel(time=inside)


def healthy_twin(run: xr.Dataset) -> xr.Dataset:
    """The same machine with ideal joints, on the run's output grid, from closed forms."""
    values = replace(with_ideal_joints(case_of(run)), body=None, sensor=None).values()
    values["solve"]["error_bars"] = False
    values["output"] = {"keep": "series"}
    return simulate(Case.from_values(values))

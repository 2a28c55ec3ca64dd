"""What leaving a feature out changes in the answer, and saves in time; and the paper's shortcuts.

A feature is a row of `compressor.studies.tradeoff.feature_rows`.
"""

import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from compressor.cases import ACCURACY, Case, Output
from compressor.metrics import JOINTS, METRICS
from compressor.physics import exact_motion, series_motion
from compressor.solve import simulate
from compressor.studies.tradeoff.work_precision import (
    complete,
    faulty,
    grid_values,
    solved,
    stored_values,
)

EXACT = "fine"  # accuracy at which answers are compared


@dataclass(frozen=True)
class Effect:
    """What a change of the model does: relative changes, and the ratio of wall times.

    nan where a number has no meaning; `reason` is that of a run that failed.
    """

    change_peak_acceleration: float = math.nan
    change_peak_contact_force: float = math.nan
    change_acceleration: float = math.nan
    time_ratio: float = math.nan
    reason: str = ""


def comparable(case: Case) -> Case:
    """Return a case solved so exactly that only its model tells in its answer."""
    return solved(case, "auto", min(case.rtol, ACCURACY[EXACT].rtol))


def compare(base: Case, other: Case, repeats: int, known: xr.Dataset | None = None) -> Effect:
    """Return what another model changes in the joints that the base has clearance in.

    Answers are compared at `EXACT`; the ratio of times is the median over `repeats` pairs of runs
    in turn, each case by its own method and tolerance. known: the base's run to compare with, where
    it was made before.
    """
    runs = [simulate(comparable(base)) if known is None else known, simulate(comparable(other))]
    # a body moves in time series; it changes neither the run nor the time of its solution
    timed = [
        replace(case, body=None, sensor=None, output=Output("metrics")) for case in (base, other)
    ]
    ratios = []
    for _ in range(repeats):
        ours, others = (simulate(case)["seconds"].item() for case in timed)
        ratios.append(others / ours)
    for run in runs:
        if not complete(run):
            return Effect(reason=run["reason"].item())
    joints = faulty(base) or [*JOINTS]
    peak, force, apart = changes(*[stored_values(run, joints) for run in runs])
    return Effect(peak, force, apart, statistics.median(ratios))


def changes(
    values: Mapping[str, np.ndarray], others: Mapping[str, np.ndarray]
) -> tuple[float, float, float]:
    """Return the relative changes of peak acceleration and contact force, signed, and L2 of
    acceleration.
    """
    peak = others["peak_acceleration"] / values["peak_acceleration"] - 1
    forces = others["peak_contact_force"] / values["peak_contact_force"] - 1
    force = forces[np.abs(forces).argmax()]
    a, b = values["acceleration"], others["acceleration"]
    return float(peak), float(force), float(np.linalg.norm(b - a) / np.linalg.norm(a))


SERIES_ERRORS = {  # of the paper's series (Eq. 3-4) in place of the exact ideal motion
    "place_error": "greatest error of the series' displacement over the smallest clearance",
    "acceleration_error": "relative L2 error of the series' acceleration",
}


def series_errors(case: Case) -> tuple[float, float]:
    """Return the errors of the series kinematics of a case, by `SERIES_ERRORS`.

    No run uses the series: both errors are those of the ideal machine.
    """
    machine = case.machine
    lengths = machine.crank_radius_mm / 1000, machine.rod_length_mm / 1000
    theta = np.linspace(0, 2 * np.pi, 3601)
    x, _, a = exact_motion(theta, *lengths, case.omega)
    series_x, _, series_a = series_motion(theta, *lengths, case.omega)
    clearance = min(getattr(case.clearance_mm, joint) for joint in faulty(case)) / 1000
    place = float(np.abs(series_x - x).max() / clearance)
    return place, float(np.linalg.norm(series_a - a) / np.linalg.norm(a))


def read_from_grid(run: xr.Dataset, with_series: xr.Dataset) -> xr.Dataset:
    """Return a run with peaks as its output grid (0.1 ms in the paper) shows them.

    with_series: the same run with its time series. Metrics that no grid gives are nan; bars are 0,
    since the grid changes the run's own numbers.
    """
    values = grid_values(with_series, JOINTS) if complete(with_series) else {}
    found = {
        name: run[name].copy(data=values[name]) if name in values else run[name] * math.nan
        for name in METRICS
    }
    found |= {f"{name}_error": 0.0 * run[f"{name}_error"] for name in METRICS}
    return run.assign(found | {"seconds": math.nan})

"""Forces on the frame from a run's stored series: what its figures draw, signals kept or not."""

from dataclasses import replace

import numpy as np
import xarray as xr

from compressor.analysis.runs import case_of, record_of, settled
from compressor.cases import Case, with_ideal_joints
from compressor.solve import SIGNALS, signals_of_scene, simulate


class NoSeriesError(ValueError):
    """A run of which no series are kept, or too few to be read."""


def frame_forces(run: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the signals of `compressor.solve.signals` by name, at all samples of a run; SI.

    They are those that the run has stored, or follow from its time series. A machine with features
    is simulated again where they are not stored: its guide, oil and drive show in no other series.
    Raises NoSeriesError for a run without time series.
    """
    if "time" not in run.dims or "contact_force" not in run:
        raise NoSeriesError("the run has no time series (output.keep: series)")
    if all(name in run for name in SIGNALS):
        return {
            name: run[name].transpose("time", *dims).values
            for name, (dims, _, _) in SIGNALS.items()
        }
    case = case_of(run)
    if not case.has_features:
        return signals_of_scene(record_of(run), run)
    values = case.values()
    solve = {name: value for name, value in values["solve"].items() if name != "accuracy"}
    values["solve"] = solve | {"rtol": float(run.attrs["rtol"]), "error_bars": False}
    values["output"] = {"keep": "series", "signals": True}
    again = simulate(Case.from_values(values))
    return frame_forces(
        again.isel(time=np.isin(again["crank_angle"].values, run["crank_angle"].values))
    )


def whole_revolutions(run: xr.Dataset) -> tuple[xr.Dataset, int]:
    """Return the settled samples up to the last whole revolution's end, and how many they are.

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
    """Return the last whole settled revolution, both ends included, and its crank angles (degrees).

    The first angle lies from 0 to 360. Raises NoSeriesError as `whole_revolutions`.
    """
    kept, count = whole_revolutions(run)
    angle = np.degrees(kept["crank_angle"].values)
    inside = angle >= angle[0] + 360.0 * (count - 1) - 1e-6
    angle = angle[inside]
    return angle - 360.0 * np.floor(angle[0] / 360.0 + 1e-9), kept.isel(time=inside)


def healthy_twin(run: xr.Dataset) -> xr.Dataset:
    """Return the same machine with ideal joints, on the run's output grid, from closed forms."""
    values = replace(with_ideal_joints(case_of(run)), body=None, sensor=None).values()
    values["solve"]["error_bars"] = False
    values["output"] = {"keep": "series"}
    return simulate(Case.resolve(values))

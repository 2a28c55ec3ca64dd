"""How joints with clearance shake the frame: orders of the force along the cylinder.

A worn joint puts its force on the frame in high orders of the crank speed, where the ideal machine
has next to none.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from compressor.analysis.runs import case_of, record_of, settled_part
from compressor.cases import Case, with_ideal_joints
from compressor.solve import SIGNALS, signals_of_scene, simulate

if TYPE_CHECKING:
    import xarray as xr


class NoSeriesError(ValueError):
    """A run without stored series, or with too few to be read."""


def frame_forces(run: "xr.Dataset") -> dict[str, np.ndarray]:
    """Return the signals of `compressor.solve.series` by name, at all samples of a run; SI.

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
    if not (case.needs_mechanism or case.lubricant):
        return signals_of_scene(record_of(run), run)
    values, degrees = case.values(), np.degrees(run["crank_angle"].values)
    each = round((degrees[-1] - degrees[0]) / (degrees.size - 1), 9)
    samples = np.rint(degrees / each).astype(int)
    values["solve"] = {  # of the case as it was run, without what was yet to be found
        "method": case.solve.method, "rtol": float(run.attrs["rtol"]), "error_bars": False,
        "max_steps": case.solve.max_steps, "timeout_s": case.solve.timeout_s,
        "settle_rev": round(float(run.attrs["settle"]) / case.turn, 9),
        "duration_rev": int(samples[-1]) * each / 360.0, "output_step_deg": each,
    }  # fmt: skip
    values["output"] = {"keep": "series", "signals": True}
    return frame_forces(simulate(Case.resolve(values)).isel(time=samples))


def whole_revolutions(run: "xr.Dataset") -> "tuple[xr.Dataset, int]":
    """Return the settled samples up to the last whole revolution's end, and how many they are.

    Raises NoSeriesError for a run without time series, or that settles within less than one.
    """
    if "time" not in run.dims or "crank_angle" not in run:
        raise NoSeriesError("the run has no time series (output.keep: series)")
    settled = settled_part(run)
    turns = (settled["crank_angle"].values - settled["crank_angle"].values[0]) / (2.0 * np.pi)
    count = int(np.floor(turns[-1] + 1e-6))
    if count < 1:
        raise NoSeriesError("the run has no whole settled revolution (solve.duration_rev)")
    beyond = int(np.searchsorted(turns, count + 1e-6, "right"))
    return settled.isel(time=slice(beyond)), count  # views, no copies


def last_revolution(run: "xr.Dataset") -> "tuple[np.ndarray, xr.Dataset]":
    """Return the last whole settled revolution, both ends included, and its crank angles (degrees).

    The first angle lies from 0 to 360. Raises NoSeriesError as `whole_revolutions`.
    """
    settled, count = whole_revolutions(run)
    angle = np.degrees(settled["crank_angle"].values)
    first = int(np.searchsorted(angle, angle[0] + 360.0 * (count - 1) - 1e-6))
    angle = angle[first:]
    return angle - 360.0 * np.floor(angle[0] / 360.0 + 1e-9), settled.isel(time=slice(first, None))


def healthy_twin(run: "xr.Dataset") -> "xr.Dataset | None":
    """Return the run of the same machine with ideal joints, on the output grid of its own case.

    From closed forms, or simulated where a feature leaves none; None where it then fails. Without
    error bars, with body and sensor. Only the run's case is read.
    """
    ideal = with_ideal_joints(case_of(run))
    values = ideal.values()
    values["solve"]["error_bars"] = False
    values["output"] = {"keep": "series", "signals": ideal.output.signals}
    twin = simulate(Case.resolve(values))
    return twin if twin["status"].item() == "ok" else None


ORDER = 12  # of the crank speed: above it the ideal machine's force has next to nothing


@dataclass(frozen=True)
class Spectrum:
    """Peak amplitudes of the orders 0, 1, ... of the crank speed, (k,), in the signal's unit.

    Blocks are revolutions, whose mean squares are averaged. `above`: rms of what lies above
    `ORDER` over all of them, in the signal's unit.
    """

    amplitudes: np.ndarray
    above: float


def shaking(run: "xr.Dataset") -> Spectrum:
    """Return the order spectrum of X, the force on the frame along the cylinder, N, of a run.

    Raises NoSeriesError where its series hold no whole settled revolution, RecordError where they
    are too coarse for `ORDER`.
    """
    from compressor.vibration import RecordError, line_amplitudes, resample_angle

    settled, revolutions = whole_revolutions(run)
    crank = settled["crank_angle"].values
    a_turn = (crank.size - 1) // revolutions // 2 * 2  # even: as many samples in each turn
    if a_turn <= 2 * ORDER:
        text = f"order {ORDER} is not below {a_turn / 2:g}, half the samples a turn"
        raise RecordError(f"{text}: run it with a finer solve.output_step_deg")
    force = frame_forces(settled)["shaking_force"][:, 0]
    even = resample_angle(crank, force, a_turn)[: revolutions * a_turn]
    amplitudes = line_amplitudes(even, a_turn, False)
    fine = line_amplitudes(even, even.size, True)[ORDER * even.size // a_turn + 1 :]
    return Spectrum(amplitudes, math.sqrt(float(np.sum(fine**2))))  # Parseval

"""What rubs in a joint during a run, and when a clearance that wear opens reaches a value."""

import math
from typing import TYPE_CHECKING

import numpy as np

from compressor.analysis.contacts import contact_series, joints_with_clearance
from compressor.analysis.runs import record_of, settled_part, settled_revolutions
from compressor.metrics import JOINTS

if TYPE_CHECKING:
    import xarray as xr


def rubbing_work(run: "xr.Dataset") -> np.ndarray:
    """Return normal force times sliding (J a revolution) at each joint of a run, (joint,).

    Archard's wear is in proportion to it. Over the settled revolutions, by the samples of the time
    series; at the default `solve.output_step_deg` within 0.2 % of the dense solution's. Raises
    ValueError of a run without time series.
    """
    p, found = record_of(run), np.zeros(len(JOINTS))
    settled = slice(-settled_part(run).sizes["time"], None)
    tilt = run["guide_tilt"].values if "guide_tilt" in run else np.zeros(run.sizes["time"])
    for joint, clearance in joints_with_clearance(run).items():
        number, series = JOINTS.index(joint), contact_series(run, joint)
        x, y = series.place.T
        turned = np.hypot(x, y) * np.gradient(np.unwrap(np.arctan2(y, x)), series.time)
        journal = series.angle if joint == "big_end" else tilt
        radius = p["pin_radius"][number]
        sliding = turned + (radius - series.depth) * np.gradient(journal, series.time)
        # against the bore, which turns with the rod, whose angle is clockwise
        sliding += (radius + clearance) * np.gradient(run["rod_angle"].values, series.time)
        power = series.normal * np.abs(sliding)
        work = np.trapezoid(power[settled], series.time[settled])
        found[number] = work / settled_revolutions(run)
    return found


def interpolate_hours(hours: np.ndarray, opened: np.ndarray, clearance: float) -> float:
    """Return the hours at which a joint has a clearance, by straight lines between stages.

    hours: of the stages, (n,), from 0 on; opened: the joint's clearance at them, which never
    shrinks, in the unit of `clearance`, (n,). Returns inf where it is not reached.
    """
    beyond = np.flatnonzero(opened >= clearance)
    if not beyond.size:
        return math.inf
    pair = slice(max(beyond[0] - 1, 0), beyond[0] + 1)
    return float(np.interp(clearance, opened[pair], hours[pair]))

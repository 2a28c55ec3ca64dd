"""How long a joint lasts: the hours until its clearance has grown to a limit."""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from compressor.studies.wear.stages import Worn


class Life(NamedTuple):
    """Hours until the first joint is worn out, nan where that is after the last stage.

    low, high: with the greatest and the least coefficient; `joint`: that is worn out, or is the
    nearest to it; `clearance`, `angle`: there at the end (m), and of the deepest place (rad).
    """

    hours: float
    low: float
    high: float
    joint: str
    clearance: float
    angle: float


def life(of: Worn, stages: xr.Dataset) -> Life:
    """Return how long a machine lasts, by straight lines between its stages."""
    opened = stages["clearance"].transpose("stage", "joint").values
    hours = stages["hours"].values
    reached = [when(hours, opened[:, joint], of.limit) for joint in range(opened.shape[1])]
    worst = int(np.nanargmin(reached)) if np.isfinite(reached).any() else int(opened[-1].argmax())
    found, factor, most = reached[worst], of.how.coefficient_factor, of.how.hours
    deepest = stages["worn_depth"].isel(stage=-1, joint=worst)
    return Life(
        found if found <= most else math.nan,
        found / factor if found <= factor * most else math.nan,
        found * factor if found * factor <= most else math.nan,
        str(stages["joint"].values[worst]),
        float(opened[-1, worst]),
        float(stages["angle"].values[int(deepest.values.argmax())]),
    )


def when(hours: np.ndarray, opened: np.ndarray, limit: float) -> float:
    """Return when a clearance that never shrinks reaches a limit; nan where it does not."""
    beyond = np.flatnonzero(opened >= limit)
    if not beyond.size:
        return math.nan
    last = int(beyond[0])
    return float(np.interp(limit, opened[last - 1 : last + 1], hours[last - 1 : last + 1]))

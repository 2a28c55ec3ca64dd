"""Wear of a machine's bores: clearance and greatest force over hours."""

import math

import numpy as np
import xarray as xr

from compressor.metrics import JOINTS
from compressor.report import BLACK, CYCLE, GREY, Drawing, LineStyle, Note, fill, make_grid


def draw_wear(stages: xr.Dataset, limit_mm: float, factor: float) -> Drawing:
    """Return two panels of wear: each joint's clearance and greatest force by hours.

    stages: of `stages.open_wear`; limit_mm: of the clearance; factor: by which the coefficient may
    be smaller or greater, whose hours are shaded.
    """
    figure, grid = make_grid(1, 2, 3.6)
    opening, force = grid.flat
    hours = stages["hours"].values
    worn = [joint for joint in JOINTS if (stages["clearance"].sel(joint=joint) > 0).all()]
    for joint, line in zip(worn, CYCLE, strict=False):
        name, one = joint.replace("_", " "), stages.sel(joint=joint)
        opened = 1e3 * one["clearance"].values
        opening.plot(hours, opened, line, name)
        around = np.concatenate([hours / factor, hours[::-1] * factor])
        there_and_back = np.concatenate([opened, opened[::-1]])
        opening.plot(around, there_and_back, fill(line.color, 0.15), kind="band")
        force.plot(hours, 1e-3 * one["peak_contact_force"].values, line, name)
    if math.isfinite(limit_mm):
        opening.notes.append(Note(y=limit_mm, style=LineStyle(BLACK, linewidth=0.8)))
        opening.notes.append(Note("limit", 0.02 * hours[-1], limit_mm, shift=(0, 2), size=8.5))
    opening.x.title = force.x.title = "operating hours"
    opening.x.span(0.0, max(float(hours[-1]), 1e-9))
    opening.y.title = "clearance (mm)"
    force.y.title = "greatest contact force (kN)"
    force.y.span(low=0.0)
    figure.legend = force.traces
    for panel, letter in zip(grid.flat, "ab", strict=True):
        panel.title = f"({letter})"
        panel.notes.append(Note(y=0.0, style=LineStyle(GREY, linewidth=0.5, zorder=0)))
    return figure

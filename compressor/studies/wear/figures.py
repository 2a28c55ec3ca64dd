"""Wear of a machine's bores: clearance and greatest force over hours."""

import math
import os
from collections.abc import Iterator

import numpy as np
import xarray as xr

from compressor.metrics import JOINTS
from compressor.report import (
    BLACK,
    CYCLE,
    GREY,
    Drawing,
    LineStyle,
    Note,
    fill,
    make_grid,
    render,
    title_figure,
)
from compressor.store import publish
from compressor.studies.wear.run import WearSummary
from compressor.studies.wear.stages import open_wear, wear_file

MAX_DRAWN = 12  # machines that get a figure


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


def draw_machines(summary: WearSummary, folder: str, titles: dict[str, str]) -> Iterator[str]:
    """Draw the first machines that have a life; titles: of the studies' machines, "" without."""
    for one in [one for one in summary.machines if one.life][:MAX_DRAWN]:
        path = wear_file(folder, one.case).with_suffix(".png")
        wear_keys = one.case.wear
        assert wear_keys
        bounds = wear_keys.limit_mm or math.nan, wear_keys.coefficient_factor
        drawing = draw_wear(open_wear(folder, one.case), *bounds)
        point = [f"{key} {value}" for key, value in one.point.items()]
        drawing.title = title_figure(titles[one.study] or one.study, "wear of the bores", point)
        publish(path, render(drawing, "png"))
        yield os.fspath(path)

"""Wear of a machine's bores: clearance and greatest force over hours, and their profiles."""

import math

import numpy as np
import xarray as xr

from compressor.metrics import JOINTS
from compressor.report import BLACK, CYCLE, GREY, Drawing, LineStyle, Note, Panel, fill, make_grid

MAX_PROFILES = 5


def draw_wear(stages: xr.Dataset, limit_mm: float, factor: float) -> Drawing:
    """Return three panels of wear: clearance and force by hours, and the worn profiles.

    The clearance is at the deepest place, the force is the greatest, profiles are by place on the
    bore.

    stages: of `stages.open_wear`; limit_mm: of the clearance; factor: by which the coefficient may
    be smaller or greater, whose hours are shaded. Profiles are of the joint that is worn the most.
    """
    figure, grid = make_grid(1, 3, 3.6)
    opening, force, profiles = grid.flat
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
    opening.y.title = "clearance, deepest place (mm)"
    force.y.title = "greatest contact force (kN)"
    force.y.span(low=0.0)
    deepest = max(worn, key=lambda joint: float(stages["worn_depth"].sel(joint=joint).max()))
    figure.legend = force.traces
    plot_profiles(profiles, stages.sel(joint=deepest))
    profiles.y.title = f"worn off the {deepest.replace('_', ' ')} (µm)"
    for panel, letter in zip(grid.flat, "abc", strict=True):
        panel.title = panel.title or f"({letter})"
        panel.notes.append(Note(y=0.0, style=LineStyle(GREY, linewidth=0.5, zorder=0)))
    return figure


def plot_profiles(panel: Panel, stages: xr.Dataset) -> None:
    """Draw what is worn off one joint at some of the stages, the later the darker."""
    hours = stages["hours"].values
    shown = np.unique(np.linspace(0, hours.size - 1, MAX_PROFILES + 1).round().astype(int))[1:]
    names = [f"{float(f'{hours[number]:.3g}'):,.12g}" for number in shown]  # no power of ten
    half = stages.sizes["angle"] // 2  # profiles go from -180 to 180 degrees
    angles = (np.degrees(stages["angle"].values) + 180.0) % 360.0 - 180.0
    around = np.append(np.roll(angles, half), angles.max() + angles[1])
    for place, number in enumerate(shown):
        depth = np.roll(1e6 * stages["worn_depth"].isel(stage=number).values, half)
        depth = np.append(depth, depth[0])
        share, name = (place + 1) / shown.size, f"{names[place]} h"
        panel.plot(around, depth, LineStyle(BLACK, linewidth=1.0, alpha=share), name)
    after = f"after {', '.join(names)} h" if names else "no wear yet"
    panel.title = f"(c) {after}" + ",\nthe later the darker" * (len(names) > 1)
    panel.title_size = 8.0
    panel.x.title, panel.x.ticks = "place, from the rod's axis (deg)", range(-180, 181, 90)

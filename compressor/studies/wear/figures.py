"""Wear of a machine's bores: clearance and greatest force over hours, and their profiles."""

import math

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from compressor.metrics import JOINTS
from compressor.report import BLACK, CYCLE, GREY, in_style, legend_above, sheet

MAX_PROFILES = 5


@in_style
def draw_wear(stages: xr.Dataset, limit_mm: float, factor: float) -> Figure:
    """Return the clearance at the deepest place, greatest force, and what is worn off by place on
    the bore.

    stages: of `stages.open_wear`; limit_mm: of the clearance; factor: by which the coefficient may
    be smaller or greater, whose hours are shaded. Profiles are of the joint that is worn the most.
    """
    figure, panels = sheet(1, 3, 3.6)
    hours = stages["hours"].values
    worn = [joint for joint in JOINTS if (stages["clearance"].sel(joint=joint) > 0).all()]
    handles = []
    for joint, line in zip(worn, CYCLE, strict=False):
        opened = 1e3 * stages["clearance"].sel(joint=joint).values
        (handle,) = panels[0, 0].plot(
            hours, opened, label=joint.replace("_", " "), **line.properties()
        )
        panels[0, 0].fill_betweenx(
            opened, hours / factor, hours * factor, color=line.color, alpha=0.15, linewidth=0
        )
        force = stages["peak_contact_force"].sel(joint=joint).values
        panels[0, 1].plot(hours, 1e-3 * force, **line.properties())
        handles.append(handle)
    if math.isfinite(limit_mm):
        panels[0, 0].axhline(limit_mm, color=BLACK, linewidth=0.8)
        panels[0, 0].annotate("limit", (0.02 * hours[-1], limit_mm), (0, 2),
                              textcoords="offset points", fontsize=8.5)  # fmt: skip
    panels[0, 0].set(ylabel="clearance, deepest place (mm)", xlabel="operating hours")
    panels[0, 0].set_xlim(0.0, max(float(hours[-1]), 1e-9))
    panels[0, 1].set(ylabel="greatest contact force (kN)", xlabel="operating hours", ylim=(0, None))
    deepest = max(worn, key=lambda joint: float(stages["worn_depth"].sel(joint=joint).max()))
    shown = np.unique(np.linspace(0, hours.size - 1, MAX_PROFILES + 1).round().astype(int))[1:]
    half = stages.sizes["angle"] // 2  # profiles go from -180 to 180 degrees
    angles = (np.degrees(stages["angle"].values) + 180.0) % 360.0 - 180.0
    around = np.append(np.roll(angles, half), angles.max() + angles[1])
    for place, number in enumerate(shown):
        depth = 1e6 * stages["worn_depth"].isel(stage=number).sel(joint=deepest).values
        depth = np.roll(depth, half)
        depth = np.append(depth, depth[0])
        share = (place + 1) / shown.size
        panels[0, 2].plot(around, depth, color=BLACK, alpha=share, linewidth=1.0)
        panels[0, 2].annotate(
            f"{hours[number]:.3g} h", (around[depth.argmax()], depth.max()), (0, 2),
            textcoords="offset points", ha="center", fontsize=7.5, alpha=max(share, 0.5),
        )  # fmt: skip
    panels[0, 2].set(ylabel=f"worn off the {deepest.replace('_', ' ')} (µm)")
    panels[0, 2].set(xlabel="place, from the rod's axis (deg)", xticks=range(-180, 181, 90))
    for panel, letter in zip(panels.flat, "abc", strict=True):
        panel.set_title(f"({letter})")
        panel.axhline(0.0, color=GREY, linewidth=0.5, zorder=0)
    legend_above(figure, handles)
    return figure

"""Figures 10 and 13: the acceleration of the mechanism against the horizontal contact force."""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compressor.analysis import CLEARANCES, force_relation, label, settled
from compressor.report.figures.curves import KILONEWTON, Runs
from compressor.report.figures.forces import contact_force
from compressor.report.figures.style import BLACK, BY_CLEARANCE, sheet, styled


@styled
def draw_relation(runs: Runs, joint: str) -> Figure:
    """Return one panel a clearance: every stored sample, the regression line, r and r²."""
    figure, panels = sheet(1, 3, 4.0, sharex=True, sharey=True)
    for panel, letter, clearance in zip(panels.flat, "abc", CLEARANCES, strict=True):
        run = runs[label(joint, clearance)]
        name = f"{clearance:g} mm"
        scatter(panel, settled(run), joint, BY_CLEARANCE[clearance].color, name)
        regress(panel, run, joint)
        panel.set_title(f"({letter}) {name}")
        panel.set_xlabel("horizontal force on the rod (kN)")
        panel.margins(x=0.05)
    panels[0, 0].set_ylabel("acceleration (m/s²)")
    return figure


def scatter(panel: Axes, run: xr.Dataset, joint: str, color: str, name: str) -> None:
    """A dot for every stored sample."""
    force = contact_force(joint, "x").values(run)
    panel.plot(
        force,
        run["acceleration"].values,
        label=name,
        linestyle="none",
        marker="o",
        markersize=2.2,
        markerfacecolor=color,
        markeredgewidth=0,
        alpha=0.45,
    )


def regress(panel: Axes, run: xr.Dataset, joint: str) -> None:
    """The line of `force_relation` over the data's accelerations, and its numbers."""
    relation = force_relation(run, joint)
    a = settled(run)["acceleration"].values
    ends = np.array([a.min(), a.max()])
    force = (relation.slope * ends + relation.intercept) * KILONEWTON
    panel.plot(force, ends, color=BLACK, linewidth=1.1, label="fit")
    r = math.copysign(math.sqrt(relation.r2), relation.slope)
    sign = "−" if relation.intercept < 0 else "+"
    numbers = (
        f"r = {r:.3f},  r² = {relation.r2:.3f}\n"
        f"F = {relation.slope:.1f} kg · a {sign} {abs(relation.intercept) * KILONEWTON:.2f} kN"
    ).replace("-", "−")
    at, side = (0.03, "left") if relation.slope > 0 else (0.97, "right")
    panel.text(at, 0.98, numbers, transform=panel.transAxes, ha=side, va="top", fontsize=8.5)

"""How the journals of one job move: orbits, contact modes over the crank angle, impacts."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from matplotlib.ticker import MaxNLocator, MultipleLocator

from compressor.analysis import (
    MODES,
    SPOKEN,
    angle_modes,
    impacts,
    joints_with_clearance,
    last_revolution,
    settled_revolutions,
)
from compressor.metrics import JOINTS
from compressor.report.figures.curves import ANGLE_AXIS
from compressor.report.figures.style import (
    BLACK,
    BLUE,
    GOLD,
    RED,
    Line,
    legend_above,
    sheet,
    styled,
)

# flight, impact, following: lightness 30, 54, 90
MODE_COLORS = dict(zip(MODES, (BLUE, RED, "#dde3ee"), strict=True))
UNSEEN = "#ffffff"
PATH = Line(BLUE, "-", 0.9, 2.3)
BY_JOINT = dict(zip(JOINTS, ((BLUE, "o"), (RED, "D")), strict=True))
CORNERS = {0: ("top dead centre", "o"), 90: ("90°", "^"), 180: ("bottom dead centre", "s"),
           270: ("270°", "v")}  # fmt: skip
MICROMETRE = 1e6


@styled
def draw_orbits(run: xr.Dataset) -> Figure:
    """Return the journal's centre in the bore of each joint with clearance, over the last
    revolution.
    """
    joints = joints_with_clearance(run)
    figure, panels = sheet(1, len(joints), 5.4)
    for panel, joint in zip(panels.flat, joints, strict=True):
        plot_orbit(panel, run, joint)
    marks = [Line2D([], [], label=name, **corner(shape)) for name, shape in CORNERS.values()]
    legend_above(figure, marks)
    return figure


def plot_orbit(panel: Axes, run: xr.Dataset, joint: str) -> None:
    """One orbit, to scale, in its clearance circle; marks stand at every quarter of the crank."""
    degrees, kept = last_revolution(run)
    place = kept["eccentricity"].sel(joint=joint).transpose("time", "axis").values * MICROMETRE
    clearance = joints_with_clearance(run)[joint] * MICROMETRE
    panel.add_patch(Circle((0, 0), clearance, fill=False, linewidth=1.0, color=BLACK))
    panel.plot(*place.T, label="path of the journal's centre", **PATH.properties())
    for angle, (_, shape) in CORNERS.items():
        nearest = np.argmin(np.abs((degrees - angle + 180) % 360 - 180))
        panel.plot(*place[nearest], **corner(shape))
    room = 1.08 * max(clearance, np.linalg.norm(place, axis=1).max())
    panel.set(xlim=(-room, room), ylim=(-room, room), aspect="equal")
    panel.set_title(f"{SPOKEN[joint]}; circle: clearance {clearance / 1e3:.3g} mm")
    panel.set_xlabel("$e_x$ (µm), along the cylinder")
    panel.set_ylabel("$e_y$ (µm)")
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(MaxNLocator(5))


def corner(shape: str) -> dict[str, Any]:
    """Return how a mark on an orbit looks."""
    return {"marker": shape, "markersize": 7, "color": GOLD, "markeredgecolor": BLACK,
            "linestyle": "none", "zorder": 4}  # fmt: skip


@styled
def draw_modes(run: xr.Dataset) -> Figure:
    """Return contact modes over the crank angle, as shares of the revolutions, and penetration."""
    joints = joints_with_clearance(run)
    shares = angle_modes(run)
    ratios = (1.0, 2.2) * len(joints)
    figure, panels = sheet(2 * len(joints), 1, 2.9 * len(joints) + 0.9, sharex=True,
                           height_ratios=ratios)  # fmt: skip
    for joint, strip, depth in zip(joints, panels[::2, 0], panels[1::2, 0], strict=True):
        plot_strip(strip, shares, joint)
        degrees, kept = last_revolution(run)
        values = kept["penetration"].sel(joint=joint).values * MICROMETRE
        order = np.argsort(degrees % 360.0, kind="stable")
        depth.plot((degrees % 360.0)[order], values[order], **PATH.properties())
        depth.axhline(0, color=BLACK, linewidth=0.8)
        depth.set_title(f"penetration, {SPOKEN[joint]}, last revolution; below 0 a gap")
        depth.set_ylabel("δ (µm)")
    panels[-1, 0].set_xlabel(ANGLE_AXIS)
    panels[-1, 0].set_xlim(0, 360)
    panels[-1, 0].xaxis.set_major_locator(MultipleLocator(45))
    legend_above(figure, mode_handles())
    return figure


def plot_strip(panel: Axes, shares: xr.Dataset, joint: str) -> None:
    """Shares of the revolutions in each mode, stacked, over bins of the crank angle."""
    share = shares["share"].sel(joint=joint)
    angle = shares["angle"].values
    foot = np.zeros(angle.size)
    for mode, color in MODE_COLORS.items():
        height = share.sel(mode=mode).fillna(0.0).values
        panel.bar(angle, height, 360.0 / angle.size, foot, color=color, linewidth=0)
        foot = foot + height
    panel.set_title(f"share of revolutions in each contact mode, {SPOKEN[joint]}")
    panel.set(ylim=(0, 1), yticks=(0, 1), ylabel="share")
    panel.grid(visible=False)


def mode_handles() -> list[Patch]:
    """Return the modes' colours, for a legend."""
    return [
        Patch(facecolor=color, edgecolor=BLACK, linewidth=0.4, label=mode)
        for mode, color in MODE_COLORS.items()
    ]


@styled
def draw_impacts(run: xr.Dataset) -> Figure:
    """Return the approach speed of the impacts of all settled revolutions over the crank angle."""
    found = impacts(run)
    figure, panels = sheet(1, 1, 3.6)
    (panel,) = panels.flat
    handles, turns = [], settled_revolutions(run)
    for joint in joints_with_clearance(run):
        color, shape = BY_JOINT[joint]
        mine = found.isel(impact=found["joint"].values == joint)
        look: dict[str, Any] = {
            "marker": shape,
            "markersize": 5,
            "color": color,
            "linestyle": "none",
        }
        angle, speed = mine["crank_angle"].values, mine["approach_speed"].values
        panel.vlines(angle, 0, speed, color=color, linewidth=0.8)
        panel.plot(angle, speed, **look)
        handles.append(
            Line2D(
                [],
                [],
                label=f"{SPOKEN[joint]}: {angle.size / turns:.3g} impacts a revolution",
                **look,
            )
        )
    if not found.sizes["impact"]:
        panel.text(180, 0.5, "no impact: no journal came back from flight", ha="center")
        panel.set_ylim(0, 1)
        panel.set_yticks([])
    else:
        panel.set_ylim(bottom=0)
    panel.set_xlim(0, 360)
    panel.xaxis.set_major_locator(MultipleLocator(45))
    panel.set_xlabel(ANGLE_AXIS)
    panel.set_ylabel("approach speed (m/s)")
    legend_above(figure, handles)
    return figure

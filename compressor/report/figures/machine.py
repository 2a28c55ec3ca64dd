"""Figures 3 and 4: the ideal gas cycle of the gas load, and the cam of the spring load."""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.ticker import MultipleLocator

from compressor.analysis import Cam, case_of, load_phases, settled
from compressor.report.figures.curves import Runs
from compressor.report.figures.style import BLUE, GOLD, GREY, RED, Line, sheet, styled

PHASES = ("expansion", "suction", "compression", "discharge")
CLOSED = Line(BLUE, "-", 1.8, 2.3)
PRINTED = Line(GOLD, "-", 1.6, 2.2)
BASE = Line("#707070", (0, (1, 1.2)), 1.2, 2.1)


@styled
def draw_pressure_volume(runs: Runs) -> Figure:
    """Return the figure 3: cylinder pressure over volume, phases named, with their direction."""
    run = settled(runs["typical"])
    volume, pressure = gas_state(run)
    figure, panels = sheet(1, 1, 5.2)
    (panel,) = panels.flat
    panel.plot(volume, pressure, label="gas in the cylinder", **CLOSED.properties())
    name_phases(panel, run, volume, pressure)
    panel.set_xlim(0, 1.05 * volume.max())
    panel.set_ylim(0, 1.15 * pressure.max())
    panel.set_xlabel("gas volume V (litres)")
    panel.set_ylabel("cylinder pressure p (MPa, absolute)")
    return figure


def gas_state(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return the volume (litres) and absolute pressure (MPa) of a run of the gas load."""
    case = case_of(run)
    machine, gas = case.machine, case.gas
    area = math.pi * gas.piston_radius_mm**2  # mm^2
    head = machine.rod_length_mm + machine.crank_radius_mm + gas.head_clearance_mm
    volume = area * (head - run["displacement"].values * 1e3) * 1e-6
    return volume, run["piston_force"].values / area + gas.back_pressure_MPa


def name_phases(panel: Axes, run: xr.Dataset, volume: np.ndarray, pressure: np.ndarray) -> None:
    """Write each phase's name beside it, with an arrow along its direction."""
    phase = load_phases(run)
    offsets = {"expansion": (14, 8), "suction": (0, -16), "compression": (10, 8)}
    for number, name in enumerate(PHASES):
        here = np.flatnonzero(phase == number)
        here = here[: np.argmax(np.diff(here, append=np.inf) > 1) + 1]  # its first revolution
        middle = here[np.argmin(np.abs(volume[here] - volume[here].mean()))]
        head, tail = middle + here.size // 14, middle - here.size // 14
        panel.annotate(
            "",
            (volume[head], pressure[head]),
            (volume[tail], pressure[tail]),
            arrowprops={"arrowstyle": "-|>", "color": BLUE, "mutation_scale": 22, "shrinkB": 0},
        )
        panel.annotate(
            name,
            (volume[middle], pressure[middle]),
            offsets.get(name, (0, 10)),
            textcoords="offset points",
            ha="left" if name in ("expansion", "compression") else "center",
            va="top" if name == "suction" else "bottom",
            fontsize=11,
        )


@styled
def draw_cam(runs: Runs) -> Figure:
    """Return the figure 4: the cam's contour, and its follower's displacement beside the printed
    one.
    """
    cam = Cam(runs["design"])
    angles = np.radians(np.linspace(0, 360, 1441))
    figure, panels = sheet(1, 2, 4.9, width_ratios=(1, 1.25))
    draw_contour(panels[0, 0], cam, angles)
    draw_follower(panels[0, 1], cam, angles)
    return figure


def draw_contour(panel: Axes, cam: Cam, angles: np.ndarray) -> None:
    """The closed cam's pitch curve around its base circle, with rays at every quarter turn."""
    x, y = cam.contour(angles, cam.base_radius)
    disc = Circle((0, 0), cam.base_radius * 1e3, facecolor="#f1f1f1", edgecolor="none")
    panel.add_patch(disc)
    turns = np.radians([0, 90, 180, 270])
    for degrees, rim_x, rim_y in zip((0, 90, 180, 270), *cam.contour(turns, 0.0), strict=True):
        mark_ray(panel, degrees, math.hypot(rim_x, rim_y) + cam.base_radius)
    circle = cam.base_radius * 1e3 * np.array([np.cos(angles), np.sin(angles)])
    panel.plot(*circle, **BASE.properties())
    panel.plot(x * 1e3, y * 1e3, **CLOSED.properties())
    panel.set_aspect("equal", adjustable="datalim")
    panel.margins(0.06)
    panel.set_title("(a) contour of the closed cam")
    panel.set_xlabel("x (mm)")
    panel.set_ylabel("y (mm)")
    base = f"base circle, {cam.base_radius * 1e3:g} mm"
    legend_below(panel, [(CLOSED, "roller's path"), (BASE, base)])


def mark_ray(panel: Axes, degrees: float, radius: float) -> None:
    """A ray from the cam's centre to its rim (m), with its cam angle beside it."""
    turn = math.radians(degrees)
    along = np.array([math.cos(turn), math.sin(turn)])
    aside = np.abs(along[::-1])
    panel.add_artist(Line2D(*np.outer(along, [0, 1e3 * radius]), color=GREY, linewidth=0.8))
    x, y = (1e3 * radius - 32) * along + 18 * aside
    panel.text(x, y, f"{degrees:g}°", ha="center", va="center")


def draw_follower(panel: Axes, cam: Cam, angles: np.ndarray) -> None:
    """Follower displacement of the closed cam, and of Eq. 10 taken literally."""
    fall = cam.printed_fall
    before, after = angles[angles < fall], np.append(fall, angles[angles >= fall])
    for part in (before, after):
        panel.plot(np.degrees(part), cam.printed_follower(part) * 1e3, **PRINTED.properties())
    panel.plot(np.degrees(angles), cam.follower(angles) * 1e3, **CLOSED.properties())
    height, left = (float(cam.printed_follower(turn)) * 1e3 for turn in (math.pi, fall))
    where = math.degrees(fall)
    panel.vlines(where, left, height, colors=RED, linestyles="dotted")
    write_at(panel, f"printed: rises by {height:.1f} mm", (150, height), (0, 5), "left")
    write_at(
        panel, f"and falls by {left:.1f} mm:\nit does not close", (where, 165), (-6, 0), "right"
    )
    stroke = float(cam.follower(math.pi)) * 1e3
    write_at(panel, f"{stroke:.0f} mm each way", (183, stroke), (0, 5), "left")
    panel.set_xlim(0, 360)
    panel.xaxis.set_major_locator(MultipleLocator(60))
    panel.set_ylim(-6, 1.12 * height)
    panel.set_title("(b) follower displacement")
    panel.set_xlabel("cam angle (°)")
    panel.set_ylabel("s (mm)")
    legend_below(panel, [(CLOSED, "closed cam, as simulated"), (PRINTED, "as printed, Eq. 10")])


def write_at(
    panel: Axes, text: str, point: tuple[float, float], shift: tuple[float, float], side: str
) -> None:
    """A remark beside a point of a panel, shifted in points (1/72 inch)."""
    panel.annotate(text, point, shift, textcoords="offset points", ha=side, fontsize=9)


def legend_below(panel: Axes, entries: Sequence[tuple[Line, str]]) -> None:
    """A panel's legend in the margin below it."""
    handles = [Line2D([], [], label=name, **line.properties()) for line, name in entries]
    panel.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2)

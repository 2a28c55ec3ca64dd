"""The paper's figures: 3 and 4, and 6 to 16."""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.ticker import MultipleLocator

from compressor.analysis import (
    CLEARANCES,
    Cam,
    case_of,
    force_relation,
    label,
    load_phases,
    settled_part,
)
from compressor.report.figures.curves import (
    ANGLE_AXIS,
    KILONEWTON,
    Curve,
    Quantity,
    Runs,
    differing_part,
    fault_curves,
    load_curves,
    plot,
    plot_enlarged,
    plot_rows,
)
from compressor.report.figures.style import (
    BLACK,
    BLUE,
    BY_CLEARANCE,
    GOLD,
    GREY,
    RED,
    LineStyle,
    in_style,
    legend_above,
    sheet,
)

MOTION = (
    Quantity("displacement", "displacement", "displacement (mm)", 1e3, window=24.0, steep=True),
    Quantity("velocity", "velocity", "velocity (m/s)", steep=True),
    Quantity("acceleration", "acceleration", "acceleration (m/s²)"),
)


@in_style
def draw_load_response(runs: Runs) -> Figure:
    """Return the figure 6: the design and the typical model without clearance."""
    curves = load_curves(runs)
    figure, panels = sheet(3, 2, 9.6)
    for (full, enlarged), quantity, letters in zip(panels, MOTION, ("ab", "cd", "ef"), strict=True):
        plot(full, curves, quantity)
        enlarge([full], enlarged, curves, quantity, letters)
    return finish_figure(figure, panels[-1], curves)


@in_style
def draw_fault_response(runs: Runs, fault: str) -> Figure:
    """Return the figures 8, 11, 14: no clearance and three clearances of one fault.

    Acceleration oscillates fast: it has a row a clearance.
    """
    curves = fault_curves(runs, fault, ideal=True)
    figure, panels = sheet(5, 2, 11.5, height_ratios=(3, 3, 2, 2, 2))
    for (full, enlarged), quantity, letters in zip(panels, MOTION[:2], ("ab", "cd"), strict=False):
        plot(full, curves, quantity)
        enlarge([full], enlarged, curves, quantity, letters)
    enlarged = beside(figure, panels, slice(2, 5))
    plot_rows(panels[2:, 0], curves, MOTION[2])
    enlarge(panels[2:, 0], enlarged, curves, MOTION[2], "ef")
    return finish_figure(figure, [panels[-1, 0], enlarged], curves)


def beside(figure: Figure, panels: np.ndarray, rows: slice) -> Axes:
    """Return one panel in place of those in the second column of some rows."""
    grid = panels[0, 0].get_gridspec()
    for _, panel in panels[rows]:
        panel.remove()
    return figure.add_subplot(grid[rows, 1])


def enlarge(
    full: Sequence[Axes] | np.ndarray,
    enlarged: Axes,
    curves: Sequence[Curve],
    quantity: Quantity,
    letters: str,
) -> None:
    """Draw the view where the curves differ most, and the titles of both."""
    part, differs = differing_part(curves, quantity)
    plot_enlarged(full, enlarged, curves, quantity, part)
    full[0].set_title(f"({letters[0]}) {full[0].get_title('left')}")
    remark = "" if differs else ": the curves coincide"
    enlarged.set_title(f"({letters[1]}) {quantity.title}, enlarged{remark}")


def finish_figure(
    figure: Figure, lowest: Sequence[Axes] | np.ndarray, curves: Sequence[Curve]
) -> Figure:
    """Return the figure with the titles of its lowest axes and a legend."""
    for panel in lowest:
        panel.set_xlabel(ANGLE_AXIS)
    legend_above(figure, [curve.handle() for curve in curves])
    return figure


PISTON = Quantity("piston_force", "", "force on the piston, towards the crank (kN)", KILONEWTON)


@in_style
def draw_piston_force(runs: Runs) -> Figure:
    """Return the figure 7: the piston force of the design and the typical model."""
    figure, panels = sheet(1, 1, 4.2)
    (panel,) = panels.flat
    curves = load_curves(runs)
    plot(panel, curves, PISTON)
    panel.set_ylim(bottom=0)
    panel.set_xlabel(ANGLE_AXIS)
    legend_above(figure, [curve.handle() for curve in curves])
    return figure


@in_style
def draw_contact_force(runs: Runs, fault: str, joint: str) -> Figure:
    """Return the figures 9, 12, 15, 16: contact force at one joint, both ways, a row a clearance.

    All enlarged views show the window in which the horizontal forces at the fault's first joint
    differ most, so that those of both joints show the same angles.
    """
    figure, panels = sheet(6, 2, 11.5, width_ratios=(2, 1))
    curves = fault_curves(runs, fault, ideal=False)
    part, _ = differing_part(curves, contact_force(first_joint(fault), "x"))
    for rows, axis, letter in zip((slice(0, 3), slice(3, 6)), "xy", "ab", strict=True):
        quantity = contact_force(joint, axis)
        enlarged = beside(figure, panels, rows)
        plot_rows(panels[rows, 0], curves, quantity)
        plot_enlarged(panels[rows, 0], enlarged, curves, quantity, part)
        top = panels[rows, 0][0]
        top.set_title(f"({letter}) {top.get_title('left')}")
        enlarged.set_title("enlarged")
        enlarged.set_ylabel("")
    return finish_figure(figure, [panels[-1, 0], enlarged], curves)


def first_joint(fault: str) -> str:
    """Return the joint whose forces choose the enlarged view."""
    return "small_end" if fault == "small_end" else "big_end"


def contact_force(joint: str, axis: str) -> Quantity:
    """Return the force on the rod at a joint along an axis, kN."""
    title = {"x": "horizontal force on the rod", "y": "vertical force on the rod"}[axis]
    where = (("joint", joint), ("axis", axis))
    return Quantity("contact_force", title, "force (kN)", KILONEWTON, where=where)


@in_style
def draw_relation(runs: Runs, joint: str) -> Figure:
    """Return one panel a clearance: every stored sample, the regression line, r and r²."""
    figure, panels = sheet(1, 3, 4.0, sharex=True, sharey=True)
    for panel, letter, clearance in zip(panels.flat, "abc", CLEARANCES, strict=True):
        run = runs[label(joint, clearance)]
        name = f"{clearance:g} mm"
        scatter(panel, settled_part(run), joint, BY_CLEARANCE[clearance].color, name)
        regress(panel, run, joint)
        panel.set_title(f"({letter}) {name}")
        panel.set_xlabel("horizontal force on the rod (kN)")
        panel.margins(x=0.05)
    panels[0, 0].set_ylabel("acceleration (m/s²)")
    return figure


def scatter(panel: Axes, run: xr.Dataset, joint: str, color: str, name: str) -> None:
    """Draw a dot for every stored sample."""
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
    """Draw the line of `force_relation` over the data's accelerations, and its numbers."""
    relation = force_relation(run, joint)
    a = settled_part(run)["acceleration"].values
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


PHASES = ("expansion", "suction", "compression", "discharge")
CLOSED = LineStyle(BLUE, "-", 1.8, 2.3)
PRINTED = LineStyle(GOLD, "-", 1.6, 2.2)
BASE = LineStyle("#707070", (0, (1, 1.2)), 1.2, 2.1)


@in_style
def draw_pressure_volume(runs: Runs) -> Figure:
    """Return the figure 3: cylinder pressure over volume, phases named, with their direction."""
    run = settled_part(runs["typical"])
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


@in_style
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
    """Draw the closed cam's pitch curve around its base circle, with rays at every quarter turn."""
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
    """Draw a ray from the cam's centre to its rim (m), with its cam angle beside it."""
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
    """Draw a remark beside a point of a panel, shifted in points (1/72 inch)."""
    panel.annotate(text, point, shift, textcoords="offset points", ha=side, fontsize=9)


def legend_below(panel: Axes, entries: Sequence[tuple[LineStyle, str]]) -> None:
    """Draw a panel's legend in the margin below it."""
    handles = [Line2D([], [], label=name, **line.properties()) for line, name in entries]
    panel.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2)

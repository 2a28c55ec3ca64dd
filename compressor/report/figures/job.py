"""Figures of one job: signals, spectra, orbits, contact modes, impacts; and maps of a study."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from matplotlib.ticker import MaxNLocator, MultipleLocator

from compressor.analysis import (
    MODES,
    ORDER,
    SPOKEN,
    SweptRow,
    angle_modes,
    deviation_spectrum,
    frame_forces,
    impacts,
    joints_with_clearance,
    last_revolution,
    rows_modes,
    sensor_envelope,
    settled_revolutions,
    shaking,
)
from compressor.metrics import JOINTS
from compressor.report.figures.curves import ANGLE_AXIS, KILONEWTON
from compressor.report.figures.style import (
    BLACK,
    BLUE,
    GOLD,
    GREY,
    RED,
    LineStyle,
    in_style,
    legend_above,
    sheet,
)

# flight, impact, following: lightness 30, 54, 90
MODE_COLORS = dict(zip(MODES, (BLUE, RED, "#dde3ee"), strict=True))
UNSEEN = "#ffffff"
PATH = LineStyle(BLUE, "-", 0.9, 2.3)
BY_JOINT = dict(zip(JOINTS, ((BLUE, "o"), (RED, "D")), strict=True))
CORNERS = {0: ("top dead centre", "o"), 90: ("90°", "^"), 180: ("bottom dead centre", "s"),
           270: ("270°", "v")}  # fmt: skip
MICROMETRE = 1e6


@in_style
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


@in_style
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


@in_style
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


Forces = dict[str, np.ndarray]

THIS = LineStyle(BLUE, "-", 1.1, 2.3)
TWIN = LineStyle(GOLD, "-", 2.2, 2.1)  # broader and lighter, below
MARK = LineStyle(RED, (0, (4, 1.5)), 1.0, 2.2)
NAMES = {"this": "this job", "twin": "the same machine without clearance"}
MAX_ORDERS = 200  # that are drawn
MAX_ENVELOPE = 60  # of an envelope
ROUNDING = 1e-6  # m/s2, of an acceleration
DECADES = 4  # below the greatest line
ORDERS_AXIS = "order (cycles per revolution)"


@dataclass(frozen=True)
class Signal:
    """A panel of the page of signals."""

    title: str
    axis: str
    values: Callable[[xr.Dataset, Forces], np.ndarray]


SIGNALS = (
    Signal("acceleration of the crosshead", "a (m/s²)", lambda run, _: run["acceleration"].values),
    Signal("force on the frame along the cylinder", "X (kN)",
           lambda _, force: force["shaking_force"][:, 0] * KILONEWTON),
    Signal("force on the frame across the cylinder", "Y (kN)",
           lambda _, force: force["shaking_force"][:, 1] * KILONEWTON),
    Signal("force of the crosshead on its guide, upwards", "$F_g$ (kN)",
           lambda _, force: force["guide_force"] * KILONEWTON),
    Signal("torque that drives the crank", "T (N m)", lambda _, force: force["crank_torque"]),
    Signal("rod load at the crosshead pin, tension positive", "$F_r$ (kN)",
           lambda _, force: force["rod_load"] * KILONEWTON),
)  # fmt: skip


@in_style
def draw_signals(run: xr.Dataset, twin: xr.Dataset | None) -> Figure:
    """Return the last settled revolution of a run, and of its machine without clearance, six
    panels.
    """
    figure, panels = sheet(3, 2, 8.6, sharex=True)
    drawn = {"twin": (twin, TWIN), "this": (run, THIS)}
    for name, (one, line) in drawn.items():
        if one is None:
            continue
        degrees, kept = last_revolution(one)
        forces = frame_forces(kept)
        for panel, signal in zip(panels.flat, SIGNALS, strict=True):
            panel.plot(degrees, signal.values(kept, forces), **line.properties())
            panel.set_title(signal.title)
            panel.set_ylabel(signal.axis)
        panels[0, 0].set_xlim(degrees[0], degrees[-1])
        panels[0, 0].xaxis.set_major_locator(MultipleLocator(90))
        drawn[name] = (one, line)
    for panel in panels[-1]:
        panel.set_xlabel(ANGLE_AXIS)
    if twin is not None:
        legend_above(figure, legend())
    return figure


def legend() -> list[Line2D]:
    """Return this job and its twin."""
    pairs = ((NAMES["this"], THIS), (NAMES["twin"], TWIN))
    return [Line2D([], [], label=name, **line.properties()) for name, line in pairs]


@in_style
def draw_spectra(run: xr.Dataset, twin: xr.Dataset | None) -> Figure:
    """Return the order spectra of X and of the crosshead's deviation.

    With a sensor, of its envelope.
    """
    envelope = sensor_envelope(run)
    rows = 2 if envelope is None else 3
    figure, panels = sheet(rows, 1, 2.7 * rows + 0.5)
    force, deviation = panels[:2, 0]
    if twin is not None:
        plot_lines(force, shaking(twin).spectrum.lines, TWIN)
    plot_lines(force, shaking(run).spectrum.lines, THIS)
    force.set_title("force on the frame along the cylinder")
    force.set_ylabel("amplitude of X (N)")
    force.set_xlabel(ORDERS_AXIS)
    plot_deviation(deviation, deviation_spectrum(run).lines)
    deviation.set_title("acceleration of the crosshead less that of ideal joints")
    deviation.set_ylabel("amplitude (m/s²)")
    deviation.set_xlabel(ORDERS_AXIS)
    if envelope is not None:
        plot_envelope(panels[2, 0], (envelope.orders, envelope.amplitudes), envelope.band)
    if twin is not None:
        legend_above(figure, legend())
    return figure


def plot_lines(panel: Axes, lines: tuple[np.ndarray, np.ndarray], line: LineStyle) -> None:
    """Orders and amplitudes, (k,) each, on a log scale from order 1 on, with `ORDER` marked."""
    shown = (lines[0] >= 1) & (lines[0] <= MAX_ORDERS)
    orders, amplitudes = (values[shown] for values in lines)
    panel.plot(orders, amplitudes, **line.properties())
    top = max(amplitudes.max(), panel.dataLim.y1 if panel.lines[1:] else 0.0)
    panel.set_yscale("log")
    if top > 0:
        panel.set_ylim(top * 10.0**-DECADES, 3 * top)
    panel.set_xlim(0, orders[-1])
    if not panel.texts:
        mark_order(panel)


def plot_deviation(panel: Axes, lines: tuple[np.ndarray, np.ndarray]) -> None:
    """Draw the spectrum of a deviation, m/s2; in words where it is rounding, as of ideal joints."""
    if lines[1].max() > ROUNDING:
        plot_lines(panel, lines, THIS)
        return
    panel.text(0.5, 0.5, "none: the motion is that of ideal joints", ha="center",
               transform=panel.transAxes)  # fmt: skip
    panel.set(yticks=[], xlim=(0, MAX_ORDERS))


def mark_order(panel: Axes) -> None:
    """Draw a vertical line at `ORDER`, with its name."""
    panel.axvline(ORDER, **MARK.properties())
    panel.annotate(
        f"order {ORDER}", (ORDER, 1), (4, -4), xycoords=panel.get_xaxis_transform(),
        textcoords="offset points", va="top", color=RED, fontsize=8.5,
    )  # fmt: skip


def plot_envelope(
    panel: Axes, lines: tuple[np.ndarray, np.ndarray], band: tuple[float, float]
) -> None:
    """A sensor's envelope spectrum, orders and amplitudes (k,), without its mean; band in Hz."""
    shown = (lines[0] > 0.01) & (lines[0] <= MAX_ENVELOPE)
    panel.plot(*(values[shown] for values in lines), **THIS.properties())
    low, high = (edge / 1e3 for edge in band)
    panel.set_title(f"envelope of the sensor between {low:.3g} and {high:.3g} kHz")
    panel.set_ylabel("amplitude (m/s²)")
    panel.set_xlabel(ORDERS_AXIS)
    panel.set_ylim(bottom=0)
    panel.set_xlim(0, MAX_ENVELOPE)


MAX_TICKS = 12
MAX_MAP_ORDERS = 150
MAP_DECADES = 3  # below the greatest line above `ORDER`
ROW, LEAST = 0.24, 3.4  # inches: of a row, and of all


@in_style
def draw_waterfall(rows: Sequence[SweptRow], title: str) -> Figure:
    """Return order spectra of X, a row a value, in colour; beside them the rms above `ORDER`."""
    figure, panels = sheet(1, 2, height(len(rows)) + 0.9, width_ratios=(3, 1), sharey=True)
    image, beside = panels.flat
    found = [row.shaking for row in rows]
    size = min(MAX_MAP_ORDERS, *(one.spectrum.orders.size - 1 for one in found if one))
    table = np.full((len(rows), size), np.nan)
    for number, one in enumerate(found):
        if one:
            table[number] = one.spectrum.amplitudes[1 : size + 1]
    top = np.nanmax(table[:, ORDER:])  # the first orders are beyond the scale
    if top < 1e-9 * np.nanmax(table):  # ideal joints: rounding
        top = np.nanmax(table)
    edges = np.arange(size + 1) + 0.5, np.arange(len(rows) + 1) - 0.5
    colors = image.pcolormesh(
        *edges, np.maximum(table, top * 10.0**-MAP_DECADES), cmap="cividis", rasterized=True,
        norm=LogNorm(top * 10.0**-MAP_DECADES, top),
    )  # fmt: skip
    figure.colorbar(
        colors, ax=image, location="top", aspect=50, label="amplitude of X (N)", extend="both"
    )
    image.axvline(ORDER + 0.5, color=RED, linewidth=1.2, linestyle=(0, (4, 1.5)))
    image.set_xlabel(ORDERS_AXIS + f"; dashed: order {ORDER}")
    label_rows(image, rows, title)
    above = [one.spectrum.above if one else np.nan for one in found]
    beside.plot(above, np.arange(len(rows)), color=BLUE, marker="o", markersize=3.5)
    beside.set_xlabel(f"rms of X above\norder {ORDER} (N)")
    beside.set_xlim(0, max(1.0, 1.08 * np.nanmax(above)))
    return figure


@in_style
def draw_map(rows: Sequence[SweptRow], title: str) -> Figure:
    """Return the most frequent contact mode over the crank angle, a row a value, for each joint."""
    modes = rows_modes(rows)
    figure, panels = sheet(1, len(modes), height(len(rows)) + 0.9, sharey=True)
    for panel, (joint, table) in zip(panels.flat, modes.items(), strict=True):
        plot_modes(panel, table)
        panel.set_title(SPOKEN[joint])
        panel.set_xlabel(ANGLE_AXIS)
    label_rows(panels[0, 0], rows, title)
    handles = mode_handles()
    if any((table < 0).any() for table in modes.values()):
        nothing = "no series, or no clearance"
        handles.append(Patch(facecolor=UNSEEN, edgecolor=GREY, hatch="////", label=nothing))
    legend_above(figure, handles)
    return figure


def plot_modes(panel: Axes, table: np.ndarray) -> None:
    """Modes, (rows, bins) of integers as in `mode_map`, in their colours; below 0 hatched."""
    edges = np.linspace(0, 360, table.shape[1] + 1), np.arange(len(table) + 1) - 0.5
    known = np.ma.masked_less(table, 0)
    panel.patch.set(facecolor=UNSEEN, edgecolor=GREY, hatch="////")
    panel.pcolormesh(*edges, known, cmap=ListedColormap([*MODE_COLORS.values()]), vmin=-0.5,
                     vmax=len(MODES) - 0.5, rasterized=True)  # fmt: skip
    panel.hlines(edges[1][1:-1], 0, 360, color="white", linewidth=0.8 if len(table) < 40 else 0)
    panel.grid(visible=False)
    panel.set_xlim(0, 360)
    panel.xaxis.set_major_locator(MultipleLocator(90))


def label_rows(panel: Axes, rows: Sequence[SweptRow], title: str) -> None:
    """Draw the swept values at some of the rows, with what became of those that have no series."""
    each = -(-len(rows) // MAX_TICKS)
    named = [*range(0, len(rows), each)]
    words = [f"{row.value} ({row.problem})" if row.problem else row.value for row in rows]
    panel.set_yticks(named, [words[number] for number in named])
    panel.set_ylim(-0.5, len(rows) - 0.5)
    panel.set_ylabel(title)
    panel.grid(visible=False)


def height(rows: int) -> float:
    """Return the height (inches) of so many rows."""
    return min(9.0, max(LEAST, ROW * rows))

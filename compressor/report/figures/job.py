"""One job as an engineer reads it: its signals over a revolution, and their spectra."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

from compressor.analysis import (
    ORDER,
    deviation_spectrum,
    frame_forces,
    last_revolution,
    sensor_envelope,
    shaking,
)
from compressor.report.figures.curves import ANGLE_AXIS, KILONEWTON
from compressor.report.figures.style import BLUE, GOLD, RED, Line, legend_above, sheet, styled

Forces = dict[str, np.ndarray]

THIS = Line(BLUE, "-", 1.1, 2.3)
TWIN = Line(GOLD, "-", 2.2, 2.1)  # broader and lighter, below
MARK = Line(RED, (0, (4, 1.5)), 1.0, 2.2)
NAMES = {"this": "this job", "twin": "the same machine without clearance"}
MOST_ORDERS = 200  # that are drawn
MOST_ENVELOPE = 60  # of an envelope
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


@styled
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


@styled
def draw_spectra(run: xr.Dataset, twin: xr.Dataset | None) -> Figure:
    """Return the order spectra of X and of the crosshead's deviation; with a sensor, of its
    envelope.
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


def plot_lines(panel: Axes, lines: tuple[np.ndarray, np.ndarray], line: Line) -> None:
    """Orders and amplitudes, (k,) each, on a log scale from order 1 on, with `ORDER` marked."""
    shown = (lines[0] >= 1) & (lines[0] <= MOST_ORDERS)
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
    """The spectrum of a deviation, m/s2; in words where it is rounding, as of ideal joints."""
    if lines[1].max() > ROUNDING:
        plot_lines(panel, lines, THIS)
        return
    panel.text(0.5, 0.5, "none: the motion is that of ideal joints", ha="center",
               transform=panel.transAxes)  # fmt: skip
    panel.set(yticks=[], xlim=(0, MOST_ORDERS))


def mark_order(panel: Axes) -> None:
    """A vertical line at `ORDER`, with its name."""
    panel.axvline(ORDER, **MARK.properties())
    panel.annotate(
        f"order {ORDER}", (ORDER, 1), (4, -4), xycoords=panel.get_xaxis_transform(),
        textcoords="offset points", va="top", color=RED, fontsize=8.5,
    )  # fmt: skip


def plot_envelope(
    panel: Axes, lines: tuple[np.ndarray, np.ndarray], band: tuple[float, float]
) -> None:
    """A sensor's envelope spectrum, orders and amplitudes (k,), without its mean; band in Hz."""
    shown = (lines[0] > 0.01) & (lines[0] <= MOST_ENVELOPE)
    panel.plot(*(values[shown] for values in lines), **THIS.properties())
    low, high = (edge / 1e3 for edge in band)
    panel.set_title(f"envelope of the sensor between {low:.3g} and {high:.3g} kHz")
    panel.set_ylabel("amplitude (m/s²)")
    panel.set_xlabel(ORDERS_AXIS)
    panel.set_ylim(bottom=0)
    panel.set_xlim(0, MOST_ENVELOPE)

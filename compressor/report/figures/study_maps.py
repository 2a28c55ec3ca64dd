"""A study as maps: order spectra and contact modes, a row for each value of a swept axis."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator

from compressor.analysis import MODES, ORDER, SPOKEN, SweptRow, rows_modes
from compressor.report.figures.contact import MODE_COLORS, UNSEEN, mode_handles
from compressor.report.figures.curves import ANGLE_AXIS
from compressor.report.figures.job import ORDERS_AXIS
from compressor.report.figures.style import BLUE, GREY, RED, legend_above, sheet, styled

MOST_TICKS = 12
MOST_ORDERS = 150
DECADES = 3  # below the greatest line above `ORDER`
ROW, LEAST = 0.24, 3.4  # inches: of a row, and of all


@styled
def draw_waterfall(rows: Sequence[SweptRow], title: str) -> Figure:
    """Return order spectra of X, a row a value, in colour; beside them the rms above `ORDER`."""
    figure, panels = sheet(1, 2, height(len(rows)) + 0.9, width_ratios=(3, 1), sharey=True)
    image, beside = panels.flat
    found = [row.shaking for row in rows]
    size = min(MOST_ORDERS, *(one.spectrum.orders.size - 1 for one in found if one))
    table = np.full((len(rows), size), np.nan)
    for number, one in enumerate(found):
        if one:
            table[number] = one.spectrum.amplitudes[1 : size + 1]
    top = np.nanmax(table[:, ORDER:])  # the first orders are beyond the scale
    if top < 1e-9 * np.nanmax(table):  # ideal joints: rounding
        top = np.nanmax(table)
    edges = np.arange(size + 1) + 0.5, np.arange(len(rows) + 1) - 0.5
    colors = image.pcolormesh(
        *edges, np.maximum(table, top * 10.0**-DECADES), cmap="cividis", rasterized=True,
        norm=LogNorm(top * 10.0**-DECADES, top),
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


@styled
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
    """The swept values at some of the rows, with what became of those that have no series."""
    each = -(-len(rows) // MOST_TICKS)
    named = [*range(0, len(rows), each)]
    words = [f"{row.value} ({row.problem})" if row.problem else row.value for row in rows]
    panel.set_yticks(named, [words[number] for number in named])
    panel.set_ylim(-0.5, len(rows) - 0.5)
    panel.set_ylabel(title)
    panel.grid(visible=False)


def height(rows: int) -> float:
    """Return the height (inches) of so many rows."""
    return min(9.0, max(LEAST, ROW * rows))

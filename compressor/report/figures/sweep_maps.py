"""A sweep along two axes: a map of every metric with lines of equal value."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator

from compressor.report.figures.artists import with_jobs
from compressor.report.figures.style import GREY, legend_above, styled
from compressor.report.figures.sweep_data import Axis, Sweep, spans_decades
from compressor.report.figures.sweep_metric import MARKS, NAMES, Measure
from compressor.report.figures.sweep_panels import (
    CHAOTIC,
    MOST_KEYS,
    RING,
    in_lines,
    mark_points,
    marks_shown,
    metric_panels,
    thinned,
)

COLORS = "cividis"
MOST_CELLS = 64  # along an axis
MOST_CONTOURS = 5
FEWEST_RISEN = 0.2  # of the cells, above the least value
NOTHING: dict[str, Any] = {"facecolor": "#f2f2f2", "edgecolor": GREY, "hatch": "////"}


def across(sweep: Sweep) -> tuple[int, int]:
    """Return which of two axes lies in x and which in y: words in y, else the one with fewer
    values.
    """
    first, second = sweep.axes
    rank = [(not axis.is_words, axis.values.size) for axis in (first, second)]
    return (0, 1) if rank[0] >= rank[1] else (1, 0)


class Cells(NamedTuple):
    """The jobs of a map: its axes in x and y, the places of the cells' middles, and their keys."""

    axes: tuple[Axis, Axis]
    centres: tuple[np.ndarray, np.ndarray]
    keys: np.ndarray | None


@styled
def draw_maps(sweep: Sweep, measures: Sequence[Measure]) -> Figure:
    """Return every measure over both axes of a grid, a cell a job, at most MOST_CELLS along an
    axis.
    """
    in_x, in_y = across(sweep)
    x, y = sweep.axes[in_x], sweep.axes[in_y]
    chosen = [thinned(axis.values.size, MOST_CELLS) for axis in (y, x)]

    def table(values: np.ndarray) -> np.ndarray:
        return values.transpose(in_y, in_x)[np.ix_(*chosen)]

    status, chaotic = table(sweep.status), table(sweep.chaotic)
    keys = None if sweep.keys is None or status.size > MOST_KEYS else table(sweep.keys)
    cells = Cells((x, y), (x.places[chosen[1]], y.places[chosen[0]]), keys)
    figure, panels = metric_panels(measures, 2.6)
    tables = [table(sweep.values(measure)) for measure in measures]
    for panel, measure, values in zip(panels, measures, tables, strict=True):
        plot_map(figure, panel, cells, values, measure)
        mark_cells(panel, cells, status, chaotic)
        for way, axis in (("x", x), ("y", y)):
            scale_way(panel, way, axis)
    figure.supxlabel(x.title, fontsize="medium")
    figure.supylabel(y.title, fontsize="medium")
    handles: list[Any] = marks_shown(status, chaotic)
    if any((np.isnan(values) & (status == "ok")).any() for values in tables):
        handles.append(Patch(label="no value: this joint has no clearance", **NOTHING))
    if handles:
        legend_above(figure, handles)
    return figure


def plot_map(
    figure: Figure, panel: Axes, cells: Cells, table: np.ndarray, measure: Measure
) -> None:
    """A measure's cells with their scale of colours and, over numbers, lines of equal value."""
    panel.patch.set(**NOTHING)
    panel.grid(visible=False)
    low, high = np.nanmin(table), np.nanmax(table)
    if spans_decades(table):
        norm: Normalize = LogNorm(low, high)
        steps = LogLocator(subs=(1.0, 3.0)).tick_values(low, high)
    else:
        norm = Normalize(low, high if high > low else low + (abs(low) or 1.0))
        steps = MaxNLocator(MOST_CONTOURS + 1).tick_values(low, high)
    edges = [edges_of(c, axis) for c, axis in zip(cells.centres, cells.axes, strict=True)]
    mesh = panel.pcolormesh(*edges, np.ma.masked_invalid(table), norm=norm, cmap=COLORS,
                            rasterized=True)  # fmt: skip
    mesh.set_label(measure.title)
    if cells.keys is not None:
        with_jobs(mesh, cells.keys)
    bar = figure.colorbar(mesh, ax=panel, label=measure.unit, pad=0.02, aspect=14)
    inside = steps[(steps > low) & (steps < high)]
    inside = inside[:: -(-inside.size // MOST_CONTOURS)] if inside.size else inside
    if inside.size and has_lines(table, cells.axes):
        lines = panel.contour(*cells.centres, np.ma.masked_invalid(table), levels=inside,
                              colors="white", linewidths=0.9, linestyles="solid")  # fmt: skip
        lines.set_label("lines at " + ", ".join(f"{level:g}" for level in inside))
        bar.add_lines(lines)


def has_lines(table: np.ndarray, axes: tuple[Axis, Axis]) -> bool:
    """Return whether lines of equal value tell something: over numbers, and not around a few
    cells.
    """
    rising = np.nansum(table > np.nanmin(table)) >= FEWEST_RISEN * table.size
    return min(table.shape) >= 3 and not any(axis.is_words for axis in axes) and bool(rising)


def mark_cells(panel: Axes, cells: Cells, status: np.ndarray, chaotic: np.ndarray) -> None:
    """Marks in the cells of jobs that failed, were not run or are chaotic."""
    x, y = cells.centres
    marks = [(status == word, mark, NAMES[word]) for word, mark in MARKS.items()]
    for here, mark, name in (*marks, (chaotic, RING, CHAOTIC)):
        rows, columns = np.nonzero(here)
        keys = None if cells.keys is None else cells.keys[here]
        mark_points(panel, x[columns], y[rows], keys, mark, name)


def scale_way(panel: Axes, way: str, axis: Axis) -> None:
    """Words as ticks, or a log scale, of the x or the y axis of a map."""
    own = panel.xaxis if way == "x" else panel.yaxis
    if axis.is_words:
        own.set_ticks(range(len(axis.words)), in_lines(axis.words) if way == "x" else axis.words)
    elif axis.is_log:
        (panel.set_xscale if way == "x" else panel.set_yscale)("log")


def edges_of(centres: np.ndarray, axis: Axis) -> np.ndarray:
    """Return the edges between cells: halfway, on a log scale by ratio; outer cells are
    symmetric.
    """
    at = np.log(centres) if axis.is_log else centres
    middle = 0.5 * (at[1:] + at[:-1])
    ends = [2.0 * at[0] - middle[0]], middle, [2.0 * at[-1] - middle[-1]]
    edges = np.concatenate(ends)
    return np.exp(edges) if axis.is_log else edges

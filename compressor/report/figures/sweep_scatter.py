"""A sampled sweep: points over each of the strongest keys, with the trend through them."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from compressor.analysis import trend
from compressor.report.figures.style import BLUE, CYCLE, legend_above, sheet, styled
from compressor.report.figures.sweep_data import Sweep, named
from compressor.report.figures.sweep_metric import Measure
from compressor.report.figures.sweep_panels import (
    CHAOTIC,
    MARKERS,
    RING,
    mark_feet,
    mark_points,
    marks_shown,
    metric_panels,
    scale_x,
    scale_y,
    thinned,
)

MOST_POINTS = 2000  # in a panel
MOST_COLUMNS = 4
PLACES = 60  # of a trend


@styled
def draw_points(sweep: Sweep, axes: Sequence[int], measures: Sequence[Measure]) -> Figure:
    """Return every measure over the axis that matters most for it; axes: their numbers, one a
    measure.
    """
    figure, panels = metric_panels(measures, 2.35)
    for panel, axis, measure in zip(panels, axes, measures, strict=True):
        plot_points(panel, sweep, axis, measure)
        panel.set_xlabel(sweep.axes[axis].title)
        panel.set_ylabel(measure.unit)
    legend_above(figure, entries(sweep))
    return figure


@styled
def draw_scatter(sweep: Sweep, axes: Sequence[int], measures: Sequence[Measure]) -> Figure:
    """Return the measures in rows over axes in columns."""
    figure, grid = sheet(
        len(measures), len(axes), 2.3 * len(measures) + 0.9, sharex="col", sharey="row"
    )
    for row, measure in zip(grid, measures, strict=True):
        for panel, axis in zip(row, axes, strict=True):
            plot_points(panel, sweep, axis, measure)
        row[0].set_title(measure.title)
        row[0].set_ylabel(measure.unit)
    for panel, axis in zip(grid[-1], axes, strict=True):
        panel.set_xlabel(sweep.axes[axis].title)
    legend_above(figure, entries(sweep))
    return figure


def grouping(sweep: Sweep) -> tuple[str, list[Any], np.ndarray]:
    """Return the words that have a colour: their axis' phrase, the words, and each job's number.

    The first axis of words with no more of them than there are lines to tell apart.
    """
    for axis in sweep.axes:
        if axis.is_words and len(axis.words) <= len(CYCLE):
            return axis.phrase, axis.words, axis.places.astype(int)
    return "", [""], np.zeros(sweep.place.shape, int)


def plot_points(panel: Axes, sweep: Sweep, axis: int, measure: Measure) -> None:
    """The jobs over one axis, and for each group the trend and its interval."""
    one = sweep.axes[axis]
    x, y, keys = one.places, sweep.values(measure), sweep.keys
    scale_x(panel, one)
    scale_y(panel, y)
    phrase, words, group = grouping(sweep)
    shown = np.zeros(y.size, bool)
    shown[thinned(y.size, MOST_POINTS)] = True
    for n, word in enumerate(words):
        name = named(phrase, word) if phrase else "a job"
        here = shown & (group == n)
        color = CYCLE[n].color if phrase else BLUE
        mark = {"linestyle": "none", "marker": MARKERS[n], "markersize": 3.0, "color": color,
                "alpha": 0.55 if y.size < 500 else 0.35, "markeredgewidth": 0.0}  # fmt: skip
        mark_points(panel, x[here], y[here], None if keys is None else keys[here], mark, name)
        if not one.is_words:
            known = np.where(group == n, sweep.known(measure), np.nan)
            plot_trend(panel, x, known, color, name)
    ring = shown & sweep.chaotic
    mark_points(panel, x[ring], y[ring], None if keys is None else keys[ring], RING, CHAOTIC)
    mark_feet(panel, x[shown], sweep.status[shown], None if keys is None else keys[shown])


def plot_trend(panel: Axes, x: np.ndarray, y: np.ndarray, color: str, name: str) -> None:
    """A parabola through points and the 95 % interval of its mean, on the panel's scales."""
    logs = panel.get_xscale() == "log", panel.get_yscale() == "log"
    there = x[np.isfinite(x) & np.isfinite(y)]
    if not there.size or not np.ptp(there):
        return
    low, high = there.min(), there.max()
    at = np.geomspace(low, high, PLACES) if logs[0] else np.linspace(low, high, PLACES)
    found = trend(
        np.log(x) if logs[0] else x, np.log(y) if logs[1] else y, np.log(at) if logs[0] else at
    )
    if found is None:
        return
    middle, below, above = (np.exp(part) if logs[1] else part for part in found)
    name = "" if name == "a job" else f", {name}"
    panel.fill_between(at, below, above, color=color, alpha=0.22, linewidth=0.0,
                       label=f"95 % interval of the trend{name}")  # fmt: skip
    panel.plot(at, middle, color=color, linewidth=1.8, label=f"trend{name}", zorder=3)


def entries(sweep: Sweep) -> list[Any]:
    """Return the legend of a scatter diagram."""
    return [*_entries(sweep), *marks_shown(sweep.status, sweep.chaotic)]


def _entries(sweep: Sweep) -> Iterator[Any]:
    phrase, words, _ = grouping(sweep)
    for n, word in enumerate(words):
        color = CYCLE[n].color if phrase else BLUE
        yield Line2D([], [], color=color, linestyle="none", marker=MARKERS[n], markersize=4.5,
                     label=named(phrase, word) if phrase else "a job")  # fmt: skip
    color = BLUE if not phrase else "#606060"
    yield Line2D([], [], color=color, linewidth=1.8, label="trend")
    yield Patch(facecolor=color, alpha=0.3, label="its 95 % interval")

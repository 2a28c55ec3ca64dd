"""A sweep along several axes: lines over the strongest ones, in rows and columns of panels."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from compressor.report.figures.style import legend_above, sheet, styled
from compressor.report.figures.sweep_data import Axis, Sweep, coarse
from compressor.report.figures.sweep_metric import Measure
from compressor.report.figures.sweep_panels import (
    CHAOTIC,
    MARKERS,
    MOST_LINES,
    RING,
    lines_for,
    mark_feet,
    mark_points,
    marks_shown,
    metric_panels,
    plot_jobs,
    scale_x,
    scale_y,
    thinned,
)

MOST_COLUMNS, MOST_ROWS = 4, 3
MOST_PLACES = 200  # in x


class Roles(NamedTuple):
    """Which axis of a sweep does what, by number; -1: none. The others are averaged over."""

    x: int
    color: int
    column: int = -1
    row: int = -1


@dataclass(frozen=True)
class Part:
    """A measure at points: of a sweep or, of a line, over x and what is averaged, (x, others)."""

    values: np.ndarray
    bars: np.ndarray
    status: np.ndarray
    chaotic: np.ndarray
    keys: np.ndarray | None

    @property
    def is_jobs(self) -> bool:
        """Whether each point is one job."""
        return self.values.shape[1] == 1


def roles_of(sweep: Sweep, order: Sequence[int], detailed: bool) -> Roles:
    """Return which axis does what. order: the axes' numbers, the strongest first.

    In x lies the one of the two strongest axes of numbers that has more values, in colours the
    strongest of the others; with `detailed` the next two make columns and rows.
    """
    numbers = [n for n in order if not sweep.axes[n].is_words] or list(order)
    x = max(numbers[:2], key=lambda n: sweep.axes[n].values.size)
    color, *others = [n for n in order if n != x]
    return Roles(x, color, *(others[:2] if detailed else []))


def chosen_of(axis: Axis, most: int) -> np.ndarray:
    """Return the numbers of an axis' values that are shown."""
    return thinned(axis.values.size, most)


@styled
def draw_overview(sweep: Sweep, role: Roles, measures: Sequence[Measure]) -> Figure:
    """Return every measure over two axes, as lines; means over the others, if there are any.

    What is not known within its error bar is no part of a mean.
    """
    sweep = coarse(sweep, role.x, MOST_PLACES)
    figure, panels = metric_panels(measures, 2.35)
    entries: dict[str, Line2D] = {}
    for panel, measure in zip(panels, measures, strict=True):
        colors = chosen_of(sweep.axes[role.color], MOST_LINES)
        whole = whole_part(sweep, measure, role)
        parts = [line_part(whole, role, {role.color: int(n)}) for n in colors]
        entries |= plot_parts(panel, sweep, role, parts, whole)
        panel.set_ylabel(measure.unit)
    figure.supxlabel(sweep.axes[role.x].title, fontsize="medium")
    legend_above(figure, [*entries.values(), *marks_of(sweep, role)])
    return figure


def is_averaged(sweep: Sweep, role: Roles) -> bool:
    """Return whether lines are means over some axes."""
    return any(n not in role for n in range(len(sweep.axes)))


def marks_of(sweep: Sweep, role: Roles) -> list[Line2D]:
    """Return the legend's entries of marks: means have none."""
    return [] if is_averaged(sweep, role) else marks_shown(sweep.status, sweep.chaotic)


@styled
def draw_multiples(sweep: Sweep, role: Roles, measures: Sequence[Measure]) -> Figure:
    """Return a panel for each value of one axis and, in rows, of another, or for each measure."""
    sweep = coarse(sweep, role.x, MOST_PLACES)
    columns = chosen_of(sweep.axes[role.column], MOST_COLUMNS)
    has_rows = role.row >= 0
    rows: Sequence[int] = chosen_of(sweep.axes[role.row], MOST_ROWS).tolist() if has_rows else []
    grid_rows = [(measures[0], n) for n in rows] if has_rows else [(m, -1) for m in measures]
    figure, grid = sheet(
        len(grid_rows), columns.size, 2.2 * len(grid_rows) + 1.0, sharex=True,
        sharey=True if has_rows else "row",
    )  # fmt: skip
    entries: dict[str, Line2D] = {}
    for line, (measure, row) in zip(grid, grid_rows, strict=True):
        whole = whole_part(sweep, measure, role)
        for panel, column in zip(line, columns, strict=True):
            at = {role.column: int(column)} | ({role.row: row} if has_rows else {})
            colors = chosen_of(sweep.axes[role.color], MOST_LINES)
            parts = [line_part(whole, role, at | {role.color: int(n)}) for n in colors]
            entries |= plot_parts(panel, sweep, role, parts, whole)
            words = [] if has_rows else [measure.title]
            words += [sweep.axes[axis].told(n) for axis, n in at.items()]
            panel.set_title("\n".join(words), fontsize=9)
        line[0].set_ylabel(measure.unit)
    figure.supxlabel(sweep.axes[role.x].title, fontsize="medium")
    legend_above(figure, [*entries.values(), *marks_of(sweep, role)])
    return figure


def whole_part(sweep: Sweep, measure: Measure, role: Roles) -> Part:
    """Return a measure over a sweep; where lines are means, what is known of it within its error
    bar.
    """
    values = sweep.known(measure) if is_averaged(sweep, role) else sweep.values(measure)
    return Part(values, sweep.bars(measure), sweep.status, sweep.chaotic, sweep.keys)


def line_part(whole: Part, role: Roles, at: dict[int, int]) -> Part:
    """Return what a line shows: the points over x at a value of some axes, numbers by number."""

    def part(values: np.ndarray) -> np.ndarray:
        index = tuple(at.get(n, slice(None)) for n in range(values.ndim))
        left = [n for n in range(values.ndim) if n not in at]
        return np.moveaxis(values[index], left.index(role.x), 0).reshape(values.shape[role.x], -1)

    return Part(
        part(whole.values), part(whole.bars), part(whole.status), part(whole.chaotic),
        None if whole.keys is None else part(whole.keys),
    )  # fmt: skip


def plot_parts(
    panel: Axes, sweep: Sweep, role: Roles, parts: Sequence[Part], whole: Part
) -> dict[str, Line2D]:
    """Return a panel's lines and marks; gives the legend's entries by name."""
    axis, color = sweep.axes[role.x], sweep.axes[role.color]
    x, chosen = axis.places, chosen_of(color, MOST_LINES)
    scale_x(panel, axis)
    entries = {}
    values = whole.values  # so that all panels of a measure have one scale
    if role.column < 0 and not parts[0].is_jobs:
        values = np.stack([mean_of(part.values) for part in parts])
    span = scale_y(panel, values)
    for n, part, line in zip(chosen, parts, lines_for(color, chosen), strict=True):
        marker = MARKERS[int(n) % len(MARKERS)] if color.is_words else "o"
        style = line.properties() | {"marker": marker, "markersize": 3.4}
        style |= {"linestyle": "none"} if axis.is_words else {}
        name = color.told(int(n))
        entries[name] = Line2D([], [], label=name, **style)
        plot_part(panel, x, part, name, style, span)
    if not parts[0].is_jobs:
        return entries
    places = np.repeat(x, sum(part.values.shape[1] for part in parts))
    status = np.concatenate([part.status for part in parts], axis=1).ravel()
    keys = [part.keys for part in parts if part.keys is not None]
    mark_feet(panel, places, status, np.concatenate(keys, axis=1).ravel() if keys else None)
    return entries


def plot_part(
    panel: Axes, x: np.ndarray, part: Part, name: str, style: dict[str, Any], span: float
) -> None:  # fmt: skip
    """A line through jobs with their bars, or through means."""
    if part.is_jobs:
        keys = None if part.keys is None else part.keys[:, 0]
        values, ring = part.values[:, 0], part.chaotic[:, 0]
        plot_jobs(panel, (x, values, part.bars[:, 0]), keys, name, style, span)
        mark_points(panel, x[ring], values[ring], None if keys is None else keys[ring], RING,
                    CHAOTIC)  # fmt: skip
        return
    panel.plot(x, mean_of(part.values), label=name, **style)


def mean_of(values: np.ndarray) -> np.ndarray:
    """Return the means over the last axis of what is known; nan where nothing is."""
    known = np.isfinite(values)
    count = known.sum(axis=-1)
    return np.where(count, np.where(known, values, 0.0).sum(axis=-1) / np.maximum(count, 1), np.nan)

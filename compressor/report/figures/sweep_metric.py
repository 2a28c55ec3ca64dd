"""A user's own sweep: every metric against one swept axis, in small panels."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from compressor.metrics import JOINTS, METRICS
from compressor.report.figures.style import (
    BLUE,
    CYCLE,
    GREY,
    RED,
    Line,
    legend_above,
    sheet,
    styled,
)

COLUMNS = 3
MARKERS = "osD^v"
MANY = Line(GREY, "-", 0.8, 2.0)
MEDIAN = Line(BLUE, "-", 2.0, 2.3)
LOG_RATIO = 100.0  # an axis that spans more is drawn on a log scale
ALONE = {"linestyle": "none", "zorder": 4}
POINTS: dict[str, Any] = {"linestyle": "none", "markersize": 3.5}
MARKS: dict[str, dict[str, Any]] = {
    "failed": {"marker": "x", "color": RED, "markersize": 7, "markeredgewidth": 1.8} | ALONE,
    "missing": {"marker": "o", "color": "#606060", "markersize": 6, "markerfacecolor": "none"}
    | ALONE,
}
NAMES = {"failed": "a job failed here", "missing": "a job was not run"}
FOOT = {"failed": 0.04, "missing": 0.11}  # height in a panel


@dataclass(frozen=True)
class Measure:
    """A stored metric as it is shown: unit, factor from SI, and the joint, "" where it has none."""

    variable: str
    title: str
    unit: str
    factor: float = 1.0
    joint: str = ""

    def of(self, data: xr.Dataset) -> xr.DataArray:
        """The metric of a job or of a study's jobs, in the unit; nan for contact in ideal joints.

        An ideal joint has a penetration of exactly 0.
        """
        return self.scaled(data, self.variable)

    def bar(self, data: xr.Dataset) -> xr.DataArray:
        """Its error bar, as `of`; nan where there is none."""
        if f"{self.variable}_error" not in data:
            return self.of(data) * math.nan
        return self.scaled(data, f"{self.variable}_error")

    def scaled(self, data: xr.Dataset, name: str) -> xr.DataArray:
        """A variable of the metric in the measure's unit."""
        values = data[name]
        if METRICS[self.variable].contact:
            values = values.where(data["max_penetration"] != 0)
        return (values.sel(joint=self.joint, drop=True) if self.joint else values) * self.factor


def shown(name: str) -> Iterator[Measure]:
    """A metric as the report draws it, if it does: of each joint apart."""
    metric = METRICS[name]
    if metric.shown and not metric.dims:
        yield Measure(name, *metric.shown)
    elif metric.shown:
        title, unit, factor = metric.shown
        for joint in JOINTS:
            yield Measure(name, f"{title}, {joint.replace('_', ' ')}", unit, factor, joint)


MEASURES = tuple(measure for name in METRICS for measure in shown(name))


def measures(data: xr.Dataset) -> list[Measure]:
    """The measures of which a dataset has any value."""
    there = (measure for measure in MEASURES if measure.variable in data)
    return [measure for measure in there if measure.of(data).notnull().any()]


def swept(study: xr.Dataset) -> list[str]:
    """The axes of a study that have more than one value; of a list of jobs, the coordinates."""
    if study["status"].dims != ("job",):
        return [str(dim) for dim in study["status"].dims if study.sizes[dim] > 1]
    columns = (str(n) for n, c in study.coords.items() if c.dims == ("job",) and n != "key")
    return [name for name in columns if len({*study[name].dropna("job").values.tolist()}) > 1]


def axis_title(study: xr.Dataset, axis: str) -> str:
    """What an axis is called: its key in the case file, and its phrase where it has one."""
    attrs = study[axis].attrs
    key, phrase = attrs.get("case_key", axis), attrs.get("long_name", "")
    return f"{key}: {phrase}" if phrase not in ("", key) else str(key)


@styled
def draw_metrics(study: xr.Dataset, axis: str) -> Figure:
    """Every metric of a study (as `open_study` gives it) against one of its axes.

    A few combinations of the other axes are lines with a legend; many are light lines, with their
    median. A list of jobs is drawn as points against one of its coordinates. A job without result
    is a mark at the foot of every panel.
    """
    listed = axis not in study.dims
    if listed:
        study = study.swap_dims(job=axis)
    data = study.drop_vars([n for n in study.variables if {"time", "sample"} & {*study[n].dims}])
    others = [str(dim) for dim in study["status"].dims if dim != axis]
    data = data.transpose(axis, *others, ...)
    shown = measures(data)
    rows = math.ceil(len(shown) / COLUMNS)
    figure, grid = sheet(rows, COLUMNS, 2.35 * rows + 0.8)
    panels = list(grid.flat)
    for panel in panels[len(shown) :]:
        panel.remove()
    for panel, measure in zip(panels, shown, strict=False):
        table = measure.of(data).values.reshape(data.sizes[axis], -1)
        if listed:
            panel.plot(positions(data, axis), table[:, 0], marker="o", color=BLUE, **POINTS)
        else:
            plot_table(panel, positions(data, axis), table)
        mark_unfinished(panel, data, axis)
        scale_axis(panel, data, axis)
        scale_values(panel, table)
        panel.set_title(measure.title + (f" ({measure.unit})" if measure.unit else ""))
    figure.supxlabel(axis_title(data, axis), fontsize="medium")
    handles = legend(data, others)
    if handles:
        legend_above(figure, handles)
    return figure


def positions(data: xr.Dataset, axis: str) -> np.ndarray:
    """Where the values of an axis stand: at their numbers, different words one after the other."""
    values = data[axis].values
    if values.dtype.kind in "fiu":
        return values.astype(float)
    places = {word: float(n) for n, word in enumerate(dict.fromkeys(values))}
    return np.array([places[word] for word in values])


def plot_table(panel: Axes, x: np.ndarray, table: np.ndarray) -> None:
    """A line a column of the table, or light lines and the median of their finite values."""
    if table.shape[1] <= len(CYCLE):
        for column, line, marker in zip(table.T, CYCLE, MARKERS, strict=False):
            panel.plot(x, column, marker=marker, markersize=4.5, **line.properties())
        return
    for column in table.T:
        panel.plot(x, column, marker=".", markersize=3, **MANY.properties())
    some = np.isfinite(table).any(axis=1)
    middle = np.full(x.size, np.nan)
    middle[some] = np.nanmedian(table[some], axis=1)
    panel.plot(x, middle, marker="o", markersize=4, **MEDIAN.properties())


def mark_unfinished(panel: Axes, data: xr.Dataset, axis: str) -> None:
    """Marks at the foot of a panel where any job of the axis' value failed or was not run."""
    x = positions(data, axis)
    for status, mark in MARKS.items():
        here = x[(data["status"].values.reshape(x.size, -1) == status).any(axis=1)]
        foot = np.full(here.size, FOOT[status])
        if here.size:
            panel.plot(here, foot, transform=panel.get_xaxis_transform(), clip_on=False, **mark)


def scale_axis(panel: Axes, data: xr.Dataset, axis: str) -> None:
    """Words as ticks, and a log scale where numbers span decades."""
    x = positions(data, axis)
    if data[axis].dtype.kind not in "fiu":
        words = [str(value) for value in dict.fromkeys(data[axis].values)]
        panel.set_xticks(range(len(words)), words)
        panel.set_xlim(-0.3, len(words) - 0.7)
        return
    panel.margins(x=0.06)
    if np.nanmin(x) > 0 and np.nanmax(x) / np.nanmin(x) >= LOG_RATIO:
        panel.set_xscale("log")


def scale_values(panel: Axes, table: np.ndarray) -> None:
    """Room at the foot for marks; values that are all the same stand in the middle."""
    low, high = np.nanmin(table), np.nanmax(table)
    room = 0.14 * (high - low) or 0.5 * abs(high) or 1.0
    panel.set_ylim(low - room, high + room)


def legend(data: xr.Dataset, others: Sequence[str]) -> list[Line2D]:
    """What the lines and marks of every panel mean; nothing where there is one plain line."""
    points = list(itertools.product(*([(dim, v) for v in data[dim].values] for dim in others)))
    if len(points) > len(CYCLE):
        handles = [handle(MANY, "each combination of the other axes"), handle(MEDIAN, "median")]
    elif len(points) > 1:
        names = [", ".join(f"{dim} {shown_value(v)}" for dim, v in point) for point in points]
        handles = [
            handle(line, name, marker)
            for line, name, marker in zip(CYCLE, names, MARKERS, strict=False)
        ]
    else:
        handles = []
    present = set(data["status"].values.flat)
    marks = [Line2D([], [], label=NAMES[s], **mark) for s, mark in MARKS.items() if s in present]
    return handles + marks


def handle(line: Line, name: str, marker: str = "") -> Line2D:
    """A line's entry in the legend."""
    return Line2D([], [], label=name, marker=marker, markersize=4.5, **line.properties())


def shown_value(value: Any) -> str:
    """A swept value in few characters."""
    return f"{value:g}" if isinstance(value, float | int | np.number) else str(value)

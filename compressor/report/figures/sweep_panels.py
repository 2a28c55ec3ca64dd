"""Sweeps drawn as lines or points: a panel a metric."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go

from compressor.report.figures.drawing import Drawing, Panel, make_grid, thin_places
from compressor.report.figures.style import BLUE, CYCLE, RED, LineStyle, mark, palette
from compressor.report.figures.sweep_data import (
    MARKS,
    NAMES,
    Measure,
    PlottedAxis,
    PlottedSweep,
    coarse,
    name_value,
    spans_decades,
)
from compressor.report.limits import NO_LIMITS, Limits

COLUMNS = 3
MAX_LINES = 12  # in a panel
MAX_KEYS = 2000  # jobs of a study that clicks show
PANEL_MARGIN = 0.18  # of a panel's height, below and above its values
VISIBLE = 0.004  # of a panel's height: an error bar that is seen
MARKERS = ("circle", "square", "diamond", "triangle-up", "triangle-down")
FEET = {"failed": 0.03, "missing": 0.08}  # of a panel's height
CHAOTIC = "chaotic: a greatest value holds for this run only"
LIMIT = LineStyle(RED, (4, 1.5), 1.4, 2.4)  # of a metric
RING = mark("#d633a8", "circle", 4.5, 5, is_hollow=True, edge_width=0.8)


def ring_around(size: float) -> LineStyle:
    """Return the ring of chaotic jobs, as large as their points, of a size, so that none hides."""
    return replace(RING, markersize=size - RING.edge_width)


def metric_panels(
    measures: Sequence[Measure], height: float, share_x: str = "", share_y: str = ""
) -> Drawing:
    """Return a drawing with a panel for each measure, titled; height of a row in inches."""
    rows = math.ceil(len(measures) / COLUMNS)
    columns = min(COLUMNS, len(measures))
    drawing, _ = make_grid(rows, columns, max(3.2, height * rows + 0.8), len(measures),
                           share_x=share_x, share_y=share_y)  # fmt: skip
    for panel, measure in zip(drawing.panels, measures, strict=True):
        panel.title = measure.title
        panel.label("y", "{}", measure.unit)
    return drawing


def job_keys(keys: np.ndarray) -> tuple[str, ...]:
    """Return the keys of the jobs at points; none where these are too many to show."""
    return tuple(map(str, keys.ravel())) if keys.size <= MAX_KEYS else ()


def plot_jobs(
    panel: Panel, points: tuple[np.ndarray, np.ndarray, np.ndarray], keys: np.ndarray, name: str,
    line: LineStyle, span: float, listed: bool = True,
) -> None:  # fmt: skip
    """Draw a line through jobs (x, y, bars), with error bars where any is seen beside the span.

    listed: in the legend.
    """
    x, y, bars = points
    finite = np.where(np.isfinite(bars), bars, 0.0)
    ends = np.where(np.isfinite(y), finite, np.nan)
    errors = np.stack([ends, ends]) if (finite > VISIBLE * span).any() else None
    panel.plot(x, y, line, name, errors, job_keys(keys), listed)


def mark_points(
    panel: Panel, x: np.ndarray, y: np.ndarray, keys: np.ndarray, look: LineStyle, name: str
) -> None:
    """Draw marks at points, which the legend names."""
    if x.size:
        panel.plot(x, y, look, name, jobs=job_keys(keys))


def mark_feet(panel: Panel, x: np.ndarray, status: np.ndarray, keys: np.ndarray) -> None:
    """Draw marks at the foot of a panel where jobs failed or were not run; all of one shape."""
    low, high = panel.y.range
    for word, look in MARKS.items():
        here = status == word
        foot = low + FEET[word] * (high - low)
        foot = (10.0**foot if panel.y.type == "log" else foot) / panel.factors["y"]
        feet = np.full(here.sum(), foot)
        mark_points(panel, x[here], feet, keys[here], look, NAMES[word])


def scale_x(panel: Panel, axis: PlottedAxis) -> None:
    """Set words at ticks, and a log scale where numbers span decades."""
    if axis.is_words:
        panel.name_ticks("x", in_lines(axis.words))
        panel.span("x", -0.3, len(axis.words) - 0.7)
        return
    low, high = np.nanmin(axis.places), np.nanmax(axis.places)
    if axis.is_log:
        panel.x.type, room = "log", (high / low) ** 0.05
        panel.span("x", low / room, high * room)
    else:
        room = 0.05 * (high - low)
        panel.span("x", low - room, high + room)


def in_lines(words: Sequence[str]) -> list[str]:
    """Return the words as they stand below each other, so that neighbours do not overlap."""
    return [word.replace(" ", "\n") for word in words]


def scale_y(panel: Panel, values: np.ndarray) -> float:
    """Set the y axis for values, with room at the foot for marks; return the panel's span.

    Logarithmic over decades. Values that are all the same stand in the middle.
    """
    values = values[np.isfinite(values)]
    low, high = (values.min(), values.max()) if values.size else (0.0, 1.0)
    if spans_decades(values):
        panel.y.type, room = "log", (high / low) ** PANEL_MARGIN
        panel.span("y", low / room, high * room)
        return float(low)
    room = PANEL_MARGIN * (high - low) or 0.5 * abs(high) or 1.0
    panel.span("y", low - room, high + room)
    return float(high - low + 2.0 * room)


def lines_for(axis: PlottedAxis, chosen: Iterable[int]) -> list[LineStyle]:
    """Return a line for each of an axis' values, from dark to light where they are numbers.

    chosen: the numbers of the values. Colours are those of viridis, which the colour-blind tell
    apart by lightness.
    """
    numbers = list(chosen)
    if len(numbers) <= len(CYCLE) and (axis.is_words or len(numbers) == 1):
        return list(CYCLE[: len(numbers)])
    shares = np.linspace(0.0, 0.88, len(numbers))
    return [LineStyle(palette("viridis", 256)[int(256 * share)], (), 1.5) for share in shares]


PLAIN_LINE = LineStyle(BLUE, (), 1.4, marker="circle", markersize=3.8)
MAX_JOBS = 1000


def draw_curves(
    sweep: PlottedSweep, measures: Sequence[Measure], limits: Limits = NO_LIMITS
) -> go.Figure:
    """Return every measure over the one axis of a grid, a point a job; over words without a line.

    Of more than MAX_JOBS jobs as many are drawn. limits: of measures, which are lines.
    """
    sweep = coarse(sweep, 0, MAX_JOBS)
    (axis,) = sweep.axes
    x, status, chaotic, keys = axis.places, sweep.status, sweep.chaotic, sweep.keys
    drawing = metric_panels(measures, 2.35, "all")
    line = replace(PLAIN_LINE, linewidth=0.0) if axis.is_words else PLAIN_LINE
    for panel, measure in zip(drawing.panels, measures, strict=True):
        values, bars = sweep.values(measure), sweep.bars(measure)
        panel.x.title = axis.title
        scale_x(panel, axis)
        span = scale_y(panel, values)
        plot_jobs(panel, (x, values, bars), keys, measure.title, line, span, listed=False)
        ring = ring_around(line.markersize)
        mark_points(panel, x[chaotic], values[chaotic], keys[chaotic], ring, CHAOTIC)
        mark_feet(panel, x, status, keys)
        for limit in limits.of(measure):
            panel.rule(LIMIT, y=limit)
    return drawing.figure()


MAX_PLACES = 200  # in x


class Roles(NamedTuple):
    """Which axis of a sweep lies in x and which has colours; the others are averaged over."""

    x: int
    color: int


@dataclass(frozen=True)
class MeasuredPoints:
    """A measure at points: of a sweep or, of a line, over x and what is averaged, (x, others)."""

    values: np.ndarray
    bars: np.ndarray
    status: np.ndarray
    chaotic: np.ndarray
    keys: np.ndarray

    @property
    def is_jobs(self) -> bool:
        """Return whether each point is one job."""
        return self.values.shape[1] == 1


def roles_of(sweep: PlottedSweep, order: Sequence[int]) -> Roles:
    """Return the roles of the axes; order: the axes' numbers, the strongest first.

    In x lies the one of the two strongest axes of numbers that has more values, in colours the
    strongest of the others.
    """
    numbers = [n for n in order if not sweep.axes[n].is_words] or list(order)
    x = max(numbers[:2], key=lambda n: sweep.axes[n].values.size)
    return Roles(x, next(n for n in order if n != x))


def draw_overview(sweep: PlottedSweep, role: Roles, measures: Sequence[Measure]) -> go.Figure:
    """Return every measure over two axes, as lines; means over the others, if there are any.

    What is not known within its error bar is no part of a mean.
    """
    sweep = coarse(sweep, role.x, MAX_PLACES)
    drawing = metric_panels(measures, 2.35, "all")
    for panel, measure in zip(drawing.panels, measures, strict=True):
        panel.x.title = sweep.axes[role.x].title
        plot_parts(panel, sweep, role, whole_part(sweep, measure))
    return drawing.figure()


def whole_part(sweep: PlottedSweep, measure: Measure) -> MeasuredPoints:
    """Return a measure over a sweep.

    Where lines are means, what is known of it within its error bar.
    """
    values = sweep.known(measure) if len(sweep.axes) > 2 else sweep.values(measure)
    return MeasuredPoints(values, sweep.bars(measure), sweep.status, sweep.chaotic, sweep.keys)


def line_part(whole: MeasuredPoints, role: Roles, color: int) -> MeasuredPoints:
    """Return what a line shows: the points over x at a colour's value, by its number."""

    def part(values: np.ndarray) -> np.ndarray:
        first = np.moveaxis(values, (role.x, role.color), (0, 1))
        return first[:, color].reshape(values.shape[role.x], -1)

    return MeasuredPoints(
        part(whole.values), part(whole.bars), part(whole.status), part(whole.chaotic),
        part(whole.keys),
    )  # fmt: skip


def plot_parts(panel: Panel, sweep: PlottedSweep, role: Roles, whole: MeasuredPoints) -> None:
    """Draw a panel's lines and marks."""
    axis, color = sweep.axes[role.x], sweep.axes[role.color]
    x, chosen = axis.places, thin_places(color.values.size, MAX_LINES)
    parts = [line_part(whole, role, int(n)) for n in chosen]
    scale_x(panel, axis)
    values = whole.values if parts[0].is_jobs else np.stack([mean_of(p.values) for p in parts])
    span = scale_y(panel, values)
    for n, part, line in zip(chosen, parts, lines_for(color, chosen), strict=True):
        marker = MARKERS[int(n) % len(MARKERS)] if color.is_words else "circle"
        style = replace(line, marker=marker, markersize=3.4)
        style = replace(style, linewidth=0.0) if axis.is_words else style
        plot_part(panel, x, part, color.value_text(int(n)), style, span)
    if not parts[0].is_jobs:
        return
    places = np.repeat(x, len(parts))
    status = np.concatenate([part.status for part in parts], axis=1).ravel()
    keys = np.concatenate([part.keys for part in parts], axis=1).ravel()
    mark_feet(panel, places, status, keys)


def plot_part(
    panel: Panel, x: np.ndarray, part: MeasuredPoints, name: str, style: LineStyle, span: float
) -> None:  # fmt: skip
    """Draw a line through jobs with their bars, or through means."""
    if part.is_jobs:
        values, ring, keys = part.values[:, 0], part.chaotic[:, 0], part.keys[:, 0]
        plot_jobs(panel, (x, values, part.bars[:, 0]), keys, name, style, span)
        look = ring_around(style.markersize)
        mark_points(panel, x[ring], values[ring], keys[ring], look, CHAOTIC)
        return
    panel.plot(x, mean_of(part.values), style, name)


def mean_of(values: np.ndarray) -> np.ndarray:
    """Return the means over the last axis of what is known; nan where nothing is."""
    known = np.isfinite(values)
    count = known.sum(axis=-1)
    return np.where(count, np.where(known, values, 0.0).sum(axis=-1) / np.maximum(count, 1), np.nan)


MAX_POINTS = 2000  # in a panel
POINT = 3.0  # size of a job


def draw_points(sweep: PlottedSweep, axes: Sequence[int], measures: Sequence[Measure]) -> go.Figure:
    """Return every measure of a list of jobs over the axis that matters most for it.

    axes: their numbers, one a measure.
    """
    drawing = metric_panels(measures, 2.35)
    for panel, axis, measure in zip(drawing.panels, axes, measures, strict=True):
        plot_points(panel, sweep, axis, measure)
        panel.x.title = sweep.axes[axis].title
    return drawing.figure()


def grouping(sweep: PlottedSweep) -> tuple[str, list[Any], np.ndarray]:
    """Return the words that have a colour: their axis' phrase, the words, and each job's number.

    The first axis of words with no more of them than there are lines to tell apart.
    """
    for axis in sweep.axes:
        if axis.is_words and len(axis.words) <= len(CYCLE):
            return axis.phrase, axis.words, axis.places.astype(int)
    return "", [""], np.zeros(sweep.place.shape, int)


def plot_points(panel: Panel, sweep: PlottedSweep, axis: int, measure: Measure) -> None:
    """Draw the jobs over one axis, in the colours of their groups."""
    one = sweep.axes[axis]
    x, y, keys = one.places, sweep.values(measure), sweep.keys
    scale_x(panel, one)
    scale_y(panel, y)
    phrase, words, group = grouping(sweep)
    shown = np.zeros(y.size, bool)
    shown[thin_places(y.size, MAX_POINTS)] = True
    for n, word in enumerate(words):
        name = name_value(phrase, word) if phrase else "a job"
        here = shown & (group == n)
        color = CYCLE[n].color if phrase else BLUE
        alpha = 0.55 if y.size < 500 else 0.35
        dots = mark(color, MARKERS[n], POINT, edge_width=0.0, alpha=alpha)
        mark_points(panel, x[here], y[here], keys[here], dots, name)
    ring = shown & sweep.chaotic
    mark_points(panel, x[ring], y[ring], keys[ring], ring_around(POINT), CHAOTIC)
    mark_feet(panel, x[shown], sweep.status[shown], keys[shown])

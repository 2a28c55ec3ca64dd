"""Sweeps drawn as lines or points: a panel a metric."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from numpy.typing import ArrayLike

from compressor.report.figures import style
from compressor.report.figures.drawing import Drawing, Panel, make_grid, thin_places
from compressor.report.figures.sweep_data import (
    MARKS,
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
MIN_SHARE, MIN_BARS = 0.01, 6.0  # least height: of the value, in error bars; else noise is a trend
VISIBLE = 0.004  # of a panel's height: an error bar that is seen
MARKERS = ("circle", "square", "diamond", "triangle-up", "triangle-down")
CHAOTIC = "chaotic: a greatest value holds for this run only"
LIMIT = style.LineStyle(style.RED, (4, 1.5), 1.4, 2.4)  # of a metric
RING = style.mark("#d633a8", "circle", 4.5, 5, is_hollow=True, edge_width=0.8)


def ring_around(size: float) -> style.LineStyle:
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
    panel: Panel, sweep: PlottedSweep, measure: Measure, name: str, line: style.LineStyle,
    span: float, listed: bool = True,
) -> None:  # fmt: skip
    """Draw a line through the jobs of one axis, and rings around those that are chaotic.

    span: of the panel, beside which error bars are drawn that are seen; listed: in the legend.
    """
    x, y, keys, wild = sweep.axes[0].places, measure.of(sweep.data), sweep.keys, sweep.chaotic
    bars = np.nan_to_num(measure.bar(sweep.data), posinf=0.0)
    ends = np.where(np.isfinite(y), bars, np.nan)
    errors = np.stack([ends, ends]) if (bars > VISIBLE * span).any() else None
    panel.plot(x, y, line, name, errors, job_keys(keys), listed)
    mark_points(panel, x[wild], y[wild], keys[wild], ring_around(line.markersize), CHAOTIC)


def mark_points(
    panel: Panel, x: np.ndarray, y: np.ndarray, keys: np.ndarray, look: style.LineStyle, name: str
) -> None:
    """Draw marks at points, which the legend names."""
    if x.size:
        panel.plot(x, y, look, name, jobs=job_keys(keys))


def mark_feet(panel: Panel, x: np.ndarray, status: np.ndarray, keys: np.ndarray) -> None:
    """Draw marks at the foot of a panel where jobs failed or were not run; all of one shape."""
    low, high = panel.y.range
    for word, (look, name, height) in MARKS.items():
        here = status == word
        foot = low + height * (high - low)
        foot = (10.0**foot if panel.y.type == "log" else foot) / panel.factors["y"]
        feet = np.full(here.sum(), foot)
        mark_points(panel, x[here], feet, keys[here], look, name)


def scale_x(panel: Panel, axis: PlottedAxis) -> None:
    """Name an axis; set words at its ticks, and a log scale where numbers span decades."""
    panel.x.title = axis.title
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


def span_around(values: np.ndarray, bars: ArrayLike, margin: float = 0.0) -> tuple[float, float]:
    """Return the ends of an axis, or of a scale of colours, around finite values.

    With a margin, in heights of the values. At least MIN_BARS error bars apart, and MIN_SHARE of
    the values, which then stand in the middle; but below values that are not below 0, such as
    counts, only the margin is.
    """
    bars = np.asarray(bars)
    bar = float(np.median(bars[np.isfinite(bars)])) if np.isfinite(bars).any() else 0.0
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    least = max(MIN_SHARE * max(abs(low), abs(high)), MIN_BARS * bar) or 1.0
    whole = max((1.0 + 2.0 * margin) * (high - low), least)
    start = 0.5 * (low + high - whole)
    start = max(start, -margin / (1.0 + 2.0 * margin) * whole) if low >= 0.0 else start
    return start, start + whole


def scale_y(panel: Panel, values: np.ndarray, bars: ArrayLike = ()) -> float:
    """Set the y axis for values, with room at the foot for marks; return the panel's span.

    Logarithmic over decades, else as `span_around`.
    """
    values = values[np.isfinite(values)]
    if spans_decades(values):
        low, high = values.min(), values.max()
        panel.y.type, room = "log", (high / low) ** PANEL_MARGIN
        panel.span("y", low / room, high * room)
        return float(low)
    low, high = span_around(values, bars, PANEL_MARGIN)
    panel.span("y", low, high)
    return high - low


def lines_of(count: int, is_ramp: bool) -> Sequence[style.LineStyle]:
    """Return so many lines, of colours from dark to light if they are many, or numbers' ramp."""
    if count <= (1 if is_ramp else len(style.CYCLE)):
        return style.CYCLE[:count]
    ramp = style.palette("viridis", 256)
    shares = np.linspace(0.0, 0.88, count)
    return [style.LineStyle(ramp[int(256 * share)], (), 1.5) for share in shares]


def lines_for(axis: PlottedAxis, is_points: bool) -> dict[int, style.LineStyle]:
    """Return lines by the numbers of an axis' values, from dark to light where these are numbers.

    At most MAX_LINES; is_points: marks alone. Colours are those of viridis, which the colour-blind
    tell apart by lightness.
    """
    chosen = thin_places(axis.values.size, MAX_LINES).tolist()
    lines = lines_of(len(chosen), not axis.is_words)
    return {
        n: replace(line, marker=MARKERS[n % len(MARKERS)] if axis.is_words else "circle",
                   markersize=3.4, linewidth=0.0 if is_points else line.linewidth)
        for n, line in zip(chosen, lines, strict=True)
    }  # fmt: skip


PLAIN_LINE = style.LineStyle(style.BLUE, (), 1.4, marker="circle", markersize=3.8)
MAX_JOBS = 1000


MAX_PLACES = 200  # in x


def choose_axes(sweep: PlottedSweep, order: Sequence[int]) -> tuple[int, int]:
    """Return which axis lies in x and which has colours; order: the strongest first.

    In x lies the one of the two strongest axes of numbers that has more values, in colours the
    strongest of the others.
    """
    numbers = [n for n in order if not sweep.axes[n].is_words] or list(order)
    x = max(numbers[:2], key=lambda n: sweep.axes[n].values.size)
    return x, next(n for n in order if n != x)


def draw_lines(
    sweep: PlottedSweep,
    chosen: Sequence[int],
    measures: Sequence[Measure],
    limits: Limits = NO_LIMITS,
) -> go.Figure:
    """Return every measure over the first of some axes of a grid, a line a value of the second.

    Points are jobs, without a line over words; of three axes or more means over the others, of what
    is known within its error bar. limits: of measures, which are lines.
    """
    count = len(sweep.axes)
    sweep = coarse(sweep, chosen[0], MAX_JOBS if count == 1 else MAX_PLACES)
    axis, *others = (sweep.axes[n] for n in chosen)
    alone = {0: replace(PLAIN_LINE, linewidth=0.0) if axis.is_words else PLAIN_LINE}
    lines = lines_for(others[0], axis.is_words) if others else alone
    names = [others[0].value_text(n) if others else "" for n in lines]
    parts = [sweep.at(chosen[1], n) if others else sweep for n in lines]
    drawing = metric_panels(measures, 2.35, "all")
    for panel, measure in zip(drawing.panels, measures, strict=True):
        scale_x(panel, axis)
        if count > 2:
            known = xr.DataArray(sweep.known(measure), dims=[one.name for one in sweep.axes])
            means = known.mean([d for d in known.dims if d not in (axis.name, others[0].name)])
            rows = [means.isel({others[0].name: n}).values for n in lines]
            scale_y(panel, np.array(rows))
            for row, line, name in zip(rows, lines.values(), names, strict=True):
                panel.plot(axis.places, row, line, name)
            continue
        span = scale_y(panel, measure.of(sweep.data), measure.bar(sweep.data))
        for part, line, name in zip(parts, lines.values(), names, strict=True):
            plot_jobs(panel, part, measure, name or measure.title, line, span, bool(name))
        for part in parts:
            mark_feet(panel, axis.places, part.status, part.keys)
        for limit in limits.of(measure):
            panel.rule(LIMIT, y=limit)
    return drawing.figure()


MAX_POINTS = 2000  # in a panel
POINT = 3.0  # size of a job


def draw_points(sweep: PlottedSweep, axes: Sequence[int], measures: Sequence[Measure]) -> go.Figure:
    """Return every measure of a list of jobs over the axis that matters most for it.

    axes: their numbers, one a measure.
    """
    drawing = metric_panels(measures, 2.35)
    phrase, words, group = grouping(sweep)
    lines = lines_of(len(words), False)
    for panel, axis, measure in zip(drawing.panels, axes, measures, strict=True):
        x, y, keys = sweep.axes[axis].places, measure.of(sweep.data), sweep.keys
        scale_x(panel, sweep.axes[axis])
        scale_y(panel, y, measure.bar(sweep.data))
        shown = np.zeros(y.size, bool)
        shown[thin_places(y.size, MAX_POINTS)] = True
        alpha = 0.55 if y.size < 500 else 0.35
        for n, (word, line) in enumerate(zip(words, lines, strict=True)):
            name = name_value(phrase, word) if phrase else "a job"
            here, shape = shown & (group == n), MARKERS[n % len(MARKERS)]
            dots = style.mark(line.color, shape, POINT, edge_width=0.0, alpha=alpha)
            mark_points(panel, x[here], y[here], keys[here], dots, name)
        ring = shown & sweep.chaotic
        mark_points(panel, x[ring], y[ring], keys[ring], ring_around(POINT), CHAOTIC)
        mark_feet(panel, x[shown], sweep.status[shown], keys[shown])
    return drawing.figure()


def grouping(sweep: PlottedSweep) -> tuple[str, list[Any], np.ndarray]:
    """Return the words that have a colour: their axis' phrase, the words, and each job's number.

    The first axis of words with no more of them than there are lines to tell apart.
    """
    for axis in sweep.axes:
        if axis.is_words and len(axis.words) <= MAX_LINES:
            return axis.phrase, axis.words, axis.places.astype(int)
    return "", [""], np.zeros(sweep.status.shape, int)

"""Sweeps drawn as maps along two axes, and which swept key matters most."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import plotly.graph_objects as go

from compressor import analysis
from compressor.report.figures import style, sweep_panels
from compressor.report.figures.drawing import Panel, Way, make_grid
from compressor.report.figures.sweep_data import (
    MARKS,
    Measure,
    PlottedAxis,
    PlottedSweep,
    coarse,
    differ_beyond_bars,
    spans_decades,
)

MAX_CELLS = 64  # along an axis


def draw_maps(sweep: PlottedSweep, measures: Sequence[Measure]) -> go.Figure:
    """Return a map of every measure over both axes of a grid, a cell a job.

    Colours span the error bars at least, so that noise is no pattern. At most MAX_CELLS lie along
    an axis; the axis of fewer values lies along y.
    """
    x, y = sorted(sweep.axes, key=lambda axis: -axis.values.size)
    table = PlottedSweep(sweep.data.transpose(y.name, x.name, ...), (x, y))
    table = coarse(coarse(table, 0, MAX_CELLS), 1, MAX_CELLS)
    x, y = table.axes
    marks = [(table.status == word, mark, name) for word, (mark, name, _) in MARKS.items()]
    ring = replace(sweep_panels.RING, markersize=6.0)
    marks.append((table.chaotic, ring, sweep_panels.CHAOTIC))
    drawing = sweep_panels.metric_panels(measures, 2.6, "all", "all")
    for panel, measure in zip(drawing.panels, measures, strict=True):
        panel.label("y", "")  # the colours have the unit
        panel.x.showgrid = panel.y.showgrid = False
        cells, bars = measure.of(table.data), measure.bar(table.data)
        values, is_log = cells[np.isfinite(cells)], spans_decades(cells)
        ends = (values.min(), values.max()) if is_log else sweep_panels.span_around(values, bars)
        panel.map(
            x.places, y.places, cells, style.palette("cividis"), ends, "{}", measure.unit, is_log,
            measure.title, sweep_panels.job_keys(table.keys),
        )  # fmt: skip
        for here, mark, name in marks:
            rows, columns = np.nonzero(here)
            places = x.places[columns], y.places[rows]
            sweep_panels.mark_points(panel, *places, table.keys[here], mark, name)
        scale_map(panel, "x", x, sweep_panels.in_lines(x.words))
        scale_map(panel, "y", y, y.words)
        panel.x.title, panel.y.title = x.title, y.title
    return drawing.figure()


def scale_map(panel: Panel, way: Way, axis: PlottedAxis, words: Sequence[str]) -> None:
    """Set the x or the y axis of a map: words in its cells, or a log scale."""
    if axis.is_words:
        panel.name_ticks(way, words)
    elif axis.is_log:
        panel.axis(way).type = "log"


COLUMNS = 4
MAIN, TOTAL = "by itself (main effect)", "with its interactions (total effect)"
RANK = "correlation of ranks"
Ranking = dict[Measure, analysis.Effects]


def ranking(sweep: PlottedSweep, measures: Sequence[Measure]) -> Ranking:
    """Return the effects of a sweep's axes, of one kind, on each measure known well enough.

    What differs by no more than its error bars is noise, and has none.
    """
    columns = [axis.values for axis in sweep.axes]
    found = {}
    for measure in measures:
        values = sweep.known(measure)
        if not differ_beyond_bars(values, measure.bar(sweep.data)):
            continue
        if sweep.is_grid:
            effects = analysis.grid_effects(values)
        else:
            effects = analysis.sampled_effects(columns, values)
        if effects is not None and np.isfinite(effects.main).any():
            found[measure] = effects
    if any(effects.total is not None for effects in found.values()):
        return {m: effects for m, effects in found.items() if effects.total is not None}
    return found


def order_of(effects: analysis.Effects) -> list[int]:
    """Return the numbers of the axes, the strongest first; what is unknown is last."""
    return np.argsort(-np.nan_to_num(effects.strength), kind="stable").tolist()


def order_by_mean_strength(found: Ranking) -> list[int]:
    """Return the axes' numbers, the strongest on the mean of the measures first."""
    strengths = [np.nan_to_num(effects.strength) for effects in found.values()]
    return np.argsort(-np.mean(strengths, axis=0), kind="stable").tolist()


def draw_ranking(sweep: PlottedSweep, found: Ranking) -> go.Figure:
    """Return a panel an axis, the strongest first, with a bar and its interval a measure."""
    order = order_by_mean_strength(found)
    rows, columns = math.ceil(len(order) / COLUMNS), min(COLUMNS, len(order))
    each = 0.26 * len(found) + 0.75
    drawing, _ = make_grid(rows, columns, rows * each + 0.7, len(order), share_y="all")
    correlated = any(effects.total is None for effects in found.values())
    least, most = (-1.0, 1.0) if correlated else (0.0, 100.0)  # estimates go beyond shares
    ends = [part(one, n, name) for one in found.values() for n in order for name in (MAIN, TOTAL)]
    low, high = min(least, np.nanmin(ends)), max(most, np.nanmax(ends))
    for panel, axis in zip(drawing.panels, order, strict=True):
        plot_bars(panel, list(found.values()), axis)
        panel.title = sweep.axes[axis].phrase
        panel.x.title = RANK if correlated else "share of variance (%)"
        panel.span("x", 1.05 * low, 1.05 * high)
        panel.y.showgrid = False
        if low < 0.0:
            panel.rule(style.LineStyle("#606060", linewidth=0.8), x=0.0)
    first = drawing.panels[0]
    first.name_ticks("y", [measure.title for measure in found])
    first.span("y", len(found) - 0.5, -0.5)
    return drawing.figure()


def plot_bars(panel: Panel, found: Sequence[analysis.Effects], axis: int) -> None:
    """Draw the effects of one axis on all measures: total effects above, main effects below."""
    places = np.arange(len(found), dtype=float)
    if found[0].total is None:
        bars: tuple[tuple[str, float, float, str], ...] = ((RANK, 0.0, 0.5, style.BLUE),)
    else:
        bars = (TOTAL, -0.19, 0.36, style.GOLD), (MAIN, 0.19, 0.36, style.BLUE)
    for name, shift, height, color in bars:
        values, low, high = np.array([part(effects, axis, name) for effects in found]).T
        errors = np.nan_to_num([values - low, high - values]).clip(min=0.0)
        panel.bars(np.nan_to_num(values), places + shift, style.fill(color), name, height,
                   errors=errors if errors.any() else None)  # fmt: skip


def part(effects: analysis.Effects, axis: int, name: str) -> tuple[float, float, float]:
    """Return an effect and the ends of its interval: a share in %, or a correlation."""
    values, ends = (
        (effects.main, effects.main_ends) if name != TOTAL else (effects.total, effects.total_ends)
    )
    if values is None:
        return math.nan, math.nan, math.nan
    factor = 1.0 if effects.total is None else 100.0
    low, high = (math.nan, math.nan) if ends is None else ends[:, axis] * factor
    return float(values[axis]) * factor, float(low), float(high)


def spell_strongest(sweep: PlottedSweep, effects: analysis.Effects) -> str:
    """Return the two strongest axes and what each does, with its interval where it has one.

    A share of the spread, as it is estimated: also below 0 or above 1. Or a correlation.
    """
    form, sign = (".2f", "") if effects.total is None else (".0f", " %")
    texts = []
    for axis in order_of(effects)[:2]:
        ends = part(effects, axis, RANK if effects.total is None else TOTAL)
        value, low, high = (f"{end:z{form}}" for end in ends)
        between = "" if math.isnan(ends[1]) else f" ({low} to {high})"
        texts.append(f"{sweep.axes[axis].phrase} {value}{between}{sign}")
    return ", ".join(texts).replace("-", "−")

"""A record beside jobs: mean revolution, segments, orders and envelope, with a caption."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from compressor.report import (
    BLACK,
    CYCLE,
    GREY,
    Drawing,
    LineStyle,
    Panel,
    as_csv,
    fill,
    make_grid,
    render,
)
from compressor.store import publish
from compressor.studies.compare.comparison import Comparison
from compressor.studies.compare.likeness import SEGMENTS, SWING, Curves

MOST = 3  # jobs with a line of their own; the others are in the range alone
KEY = 10  # digits of a key in a legend
RECORD = LineStyle(BLACK, linewidth=1.3, zorder=3.0)


def draw_comparison(found: Comparison) -> Drawing:
    """Return the four panels of a comparison, the record's curves in black."""
    figure, grid = make_grid(2, 2, 7.4)
    shown = [(found.name, found.curves, RECORD), *(
        (f"{job.key[:KEY]}: {job.what}", job.curves, line)
        for job, line in zip(found.jobs[:MOST], CYCLE, strict=False)
    )]  # fmt: skip
    (mean, segments), (orders, envelope) = grid
    if len(found.jobs) > 1:
        several = np.array([job.curves.envelope for job in found.jobs])
        shade_range(envelope, several, len(found.jobs))
    for name, one, line in shown:
        mean.plot(one.angle, one.mean, line, name)
        plot_segments(segments, one, line, name)
        orders.plot(np.arange(1, one.spectrum.size + 1), one.spectrum, line, name)
        envelope.plot(np.arange(360) + 0.5, one.envelope, line, name)
    figure.legend = mean.traces
    for panel in (mean, segments, envelope):
        panel.x.title, panel.x.ticks = "crank angle (deg)", range(0, 361, 60)
        panel.x.span(0.0, 360.0)
    mean.y.title = "mean revolution (m/s²)"
    segments.y.title = "peak and rms of 10° segments (m/s²)"
    orders.x.title, orders.y.title = "order of the speed", "rms of an order (m/s²)"
    orders.x.log = orders.y.log = True
    orders.x.span(1.0, found.orders)
    envelope.y.title = f"envelope above order {SWING} (m/s²)"
    for panel in (segments, envelope):
        panel.y.span(low=0.0)
    for panel, letter in zip(grid.flat, "abcd", strict=True):
        panel.title = f"({letter})"
    return figure


def plot_segments(panel: Panel, one: Curves, line: LineStyle, name: str) -> None:
    """Draw peaks and, paler, rms of segments as steps, each over its 10 degrees."""
    edges = np.arange(SEGMENTS + 1) * (360.0 / SEGMENTS)
    x = np.repeat(edges, 2)[1:-1]
    panel.plot(x, np.repeat(one.peak, 2), line, name)
    panel.plot(x, np.repeat(one.rms, 2), replace(line, alpha=0.45), f"{name}, rms")


def shade_range(panel: Panel, several: np.ndarray, count: int) -> None:
    """Shade what lies between the least and the greatest envelope of the jobs."""
    x = np.arange(360) + 0.5
    low, high = several.min(axis=0), several.max(axis=0)
    around = np.concatenate([x, x[::-1]])
    edge = np.concatenate([low, high[::-1]])
    panel.plot(around, edge, fill(GREY, 0.5), f"range of {count} jobs", kind="band")


def caption(found: Comparison) -> str:
    """Return what the figure shows, with its numbers."""
    best = found.jobs[0]
    like = best.likeness
    text = (
        f"(a) Mean revolution of {found.name} ({len(found.turned.values)} revolutions) and of the "
        f"jobs most alike, orders 1 to {best.orders}: correlation {like.correlation.value:.3f} "
        f"with job {best.key[:KEY]}, {best.what}. (b) Peak and, paler, rms of each 10 "
        f"degrees, on average over revolutions: peaks most different at "
        f"{like.segment} to {like.segment + 10} degrees, {like.segment_ratio:.2f} times the job's. "
        f"(c) Orders: {like.spectral_distance.value:.1f} dB apart, rms {like.rms_ratio.value:.3g} "
        f"times the job's. (d) Envelope above order {SWING}"
    )
    text += f", correlation {like.envelope.value:.3f}"
    if math.isnan(found.inside):
        return f"{text}."
    return f"{text}; in the range of {len(found.jobs)} jobs at {found.inside:.0%} of crank angles."


def write_figure(drawing: Drawing, output: str, kind: str) -> None:
    """Write a figure as a picture, or its numbers as CSV."""
    data = as_csv(drawing).encode() if kind == ".csv" else render(drawing, kind[1:])
    publish(Path(output), data)

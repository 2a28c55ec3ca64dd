"""A sweep along one axis: every metric with its error bars."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from compressor.report.figures.style import legend_above, styled
from compressor.report.figures.sweep_data import Sweep, coarse
from compressor.report.figures.sweep_metric import Measure
from compressor.report.figures.sweep_panels import (
    CHAOTIC,
    PLAIN_LINE,
    RING,
    mark_feet,
    mark_points,
    marks_shown,
    metric_panels,
    plot_jobs,
    scale_x,
    scale_y,
)

MOST_POINTS = 1000


@styled
def draw_curves(sweep: Sweep, measures: Sequence[Measure]) -> Figure:
    """Return every measure over the one axis of a grid, a point a job; over words without a line.

    Of more than MOST_POINTS jobs as many are drawn.
    """
    sweep = coarse(sweep, 0, MOST_POINTS)
    (axis,) = sweep.axes
    x, status, chaotic, keys = axis.places, sweep.status, sweep.chaotic, sweep.keys
    figure, panels = metric_panels(measures, 2.35)
    line = PLAIN_LINE | ({"linestyle": "none"} if axis.is_words else {})
    for panel, measure in zip(panels, measures, strict=True):
        values, bars = sweep.values(measure), sweep.bars(measure)
        scale_x(panel, axis)
        span = scale_y(panel, values)
        plot_jobs(panel, (x, values, bars), keys, measure.title, line, span)
        mark_points(panel, x[chaotic], values[chaotic], None if keys is None else keys[chaotic],
                    RING, CHAOTIC)  # fmt: skip
        mark_feet(panel, x, status, keys)
        panel.set_ylabel(measure.unit)
    figure.supxlabel(axis.title, fontsize="medium")
    handles = marks_shown(status, chaotic)
    if handles:
        legend_above(figure, handles)
    return figure

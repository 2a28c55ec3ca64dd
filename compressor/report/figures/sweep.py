"""Chooses how a study's sweep is drawn, by its axes, and says what is seen."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from compressor.report.figures.sweep_data import Sweep, sweep_of
from compressor.report.figures.sweep_lines import draw_curves
from compressor.report.figures.sweep_maps import MOST_CELLS, draw_maps
from compressor.report.figures.sweep_metric import Measure, draw_metrics, measures, shown_value

MARKS = (
    "A cross: a job failed here; an empty grey circle: a job was not run; a ring: a chaotic job, "
    "whose averages hold within their bars, but whose greatest values hold for that run only."
)


class SweepFigure(NamedTuple):
    """A drawing of a study's sweep. name: what its files are called after the study's name."""

    name: str
    title: str
    caption: str
    figure: Figure


def draw_sweep(data: xr.Dataset) -> list[SweepFigure]:
    """The drawings of a study, as `open_study` gives it; none where nothing is swept or measured.

    What is the same at every job is said in the caption, and not drawn.
    """
    known = measures(data)
    sweep = sweep_of(data)
    if not known or not sweep.axes:
        return []
    shown, same = parted(sweep, known)
    if not shown:
        shown, same = known, []
    told = " ".join(part for part in (marks_caption(sweep), same_caption(sweep, same)) if part)
    if sweep.is_grid and len(sweep.axes) == 1:
        return [curves(sweep, shown, told)]
    if sweep.is_grid and len(sweep.axes) == 2:
        return [maps(sweep, shown, told)]
    return [
        SweepFigure(
            axis.name, f"metrics against {axis.phrase}", told, draw_metrics(data, axis.name)
        )
        for axis in sweep.axes
    ]


def parted(sweep: Sweep, known: Sequence[Measure]) -> tuple[list[Measure], list[Measure]]:
    """The measures that differ between jobs, and those that do not."""
    varied = [bool(np.ptp(v[np.isfinite(v)])) for v in (sweep.values(m) for m in known)]
    both = [*zip(known, varied, strict=True)]
    return [m for m, varies in both if varies], [m for m, varies in both if not varies]


def curves(sweep: Sweep, shown: Sequence[Measure], told: str) -> SweepFigure:
    """A sweep along one axis."""
    (axis,) = sweep.axes
    caption = (
        f"Every metric against {axis.phrase}, a point a job. Error bars are drawn where they are "
        f"longer than a point. {told}"
    )
    name = f"metrics against {axis.phrase}"
    return SweepFigure(axis.name, name, caption.strip(), draw_curves(sweep, shown))


def maps(sweep: Sweep, shown: Sequence[Measure], told: str) -> SweepFigure:
    """A sweep along two axes."""
    first, second = sweep.axes
    large = [axis for axis in sweep.axes if axis.values.size > MOST_CELLS]
    thin = "".join(
        f" Of {axis.values.size} values of {axis.phrase} {MOST_CELLS} are shown." for axis in large
    )
    caption = (
        f"Every metric over {first.phrase} and {second.phrase}, a cell a job. White: lines of "
        f"equal value, which stand in the scale of colours, too.{thin} {told}"
    )
    name = f"metrics over {first.phrase} and {second.phrase}"
    return SweepFigure("map", name, caption.strip(), draw_maps(sweep, shown))


def marks_caption(sweep: Sweep) -> str:
    """What marks mean, where there are any."""
    status, chaotic = sweep.status, sweep.chaotic
    return MARKS if chaotic.any() or np.isin(status, ("failed", "missing")).any() else ""


def same_caption(sweep: Sweep, same: Sequence[Measure]) -> str:
    """The measures that are the same at every job, with their values."""
    if not same:
        return ""
    parts = [
        f"{m.title} ({shown_value(np.nanmax(sweep.values(m)))} {m.unit}".rstrip() + ")"
        for m in same
    ]
    return f"The same at every job, and not drawn: {'; '.join(parts)}."

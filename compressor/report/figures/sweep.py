"""Chooses how a study's sweep is drawn, by its axes, and says what is seen."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import xarray as xr

from compressor.report.figures import sweep_captions as captions
from compressor.report.figures.drawing import Drawing, Note
from compressor.report.figures.sweep_data import Measure, PlottedSweep, measures, sweep_of
from compressor.report.figures.sweep_maps import (
    LIMIT,
    Ranking,
    draw_maps,
    draw_ranking,
    leading,
    order_by_mean_strength,
    order_of,
    ranking,
)
from compressor.report.figures.sweep_panels import (
    MAX_COLUMNS,
    draw_curves,
    draw_overview,
    draw_points,
    draw_scatter,
    roles_of,
)
from compressor.report.limits import NO_LIMITS, Limits
from compressor.units import Units

MAX_ROWS = 3  # measures that stand in a figure with rows of them


class SweepFigure(NamedTuple):
    """A drawing of a study's sweep. name: what its files are called after the study's name."""

    name: str
    title: str
    caption: str
    figure: Drawing


def draw_sweep(
    data: xr.Dataset, limits: Limits = NO_LIMITS, units: Units = "usual"
) -> list[SweepFigure]:
    """Return the drawings of a study, as `open_study` gives it; curves show limits of metrics.

    None where nothing is swept or measured.

    What is the same at every job is said in a caption, and not drawn.
    """
    known = measures(data, units)
    sweep = sweep_of(data)
    if not known or not sweep.axes:
        return []
    shown, same = captions.split_measures(sweep, known)
    if not shown:
        shown, same = known, []
    marks = captions.describe_marks(sweep), captions.describe_unchanged(sweep, same)
    if not sweep.is_grid:
        return [*draw_sampled(sweep, shown, marks)]
    if len(sweep.axes) == 1:
        (axis,) = sweep.axes
        title = f"metrics against {axis.phrase}"
        drawing = draw_curves(sweep, shown)
        for panel, measure in zip(drawing.panels, shown, strict=False):
            panel.notes += [Note(y=limit, style=LIMIT) for limit in limits.of(measure)]
        words = captions.curves(sweep), *marks, *zone_words(shown, limits)
        caption = captions.join_sentences(*words)
        return [SweepFigure(axis.name, title, caption, drawing)]
    return [*draw_grid(sweep, shown, marks, limits)]


def zone_words(shown: Sequence[Measure], limits: Limits) -> list[str]:
    """Return the sentences on zones, if any of the measures has limits; lines are dashed red."""
    return limits.words if any(limits.of(one) for one in shown) else []


def draw_grid(
    sweep: PlottedSweep, shown: Sequence[Measure], marks: tuple[str, str], limits: Limits
) -> Iterator[SweepFigure]:
    """Yield the figures of a grid of two or more axes.

    A ranking, and an overview of all metrics. Two axes of numbers, or of words, are a map.
    """
    found = ranking(sweep, shown)
    yield from draw_ranked(sweep, found, shown)
    order = order_by_mean_strength(found) if found else [*range(len(sweep.axes))]
    first, second = (sweep.axes[n] for n in order[:2])
    if len(sweep.axes) == 2 and first.is_words == second.is_words:
        title = f"metrics over {first.phrase} and {second.phrase}"
        figure = draw_maps(sweep, shown, limits)
        traces = (trace for panel in figure.panels for trace in panel.traces)
        words = captions.maps(sweep, any(one.scale and one.scale.levels for one in traces))
        caption = captions.join_sentences(words, *marks, *zone_words(shown, limits))
        yield SweepFigure("map", title, caption, figure)
        return
    role = roles_of(sweep, order)
    title = f"metrics over {sweep.axes[role.x].phrase} and {sweep.axes[role.color].phrase}"
    are_first = len(sweep.axes) > 2 and bool(found) and {*role} == {*order[:2]}
    caption = captions.join_sentences(captions.overview(sweep, role, are_first), marks[1])
    yield SweepFigure("overview", title, caption, draw_overview(sweep, role, shown))


def draw_sampled(
    sweep: PlottedSweep, shown: Sequence[Measure], marks: tuple[str, str]
) -> Iterator[SweepFigure]:
    """Yield the figures of a list of jobs that are no grid.

    A ranking, each metric against its strongest key, and some metrics against all keys.
    """
    found = ranking(sweep, shown)
    yield from draw_ranked(sweep, found, shown)
    order = order_by_mean_strength(found) if found else [*range(len(sweep.axes))]
    numbers = [n for n in order if not sweep.axes[n].is_words] or order
    strongest = []
    for measure in shown:
        own = order_of(found[measure]) if measure in found else order
        strongest.append(next(n for n in own if n in numbers))
    kind, is_ranked = captions.axis_kind(sweep), bool(found)
    figure = draw_points(sweep, strongest, shown)
    caption = captions.join_sentences(captions.points(sweep, is_ranked), *marks)
    which = f"the {kind} that matters most for each" if is_ranked else f"a {kind}"
    yield SweepFigure("points", f"metrics over {which}", caption, figure)
    if len(numbers) < 2:
        return
    columns = numbers[:MAX_COLUMNS]
    group = leading(sweep, shown, MAX_ROWS)
    figure = draw_scatter(sweep, columns, group)
    words = captions.scatter(sweep, len(columns), len(numbers), is_ranked)
    title = f"{', '.join(one.title for one in group)} over each {kind}"
    yield SweepFigure("scatter", title, captions.join_sentences(words, marks[0]), figure)


def draw_ranked(
    sweep: PlottedSweep, found: Ranking, shown: Sequence[Measure]
) -> Iterator[SweepFigure]:
    """Yield the ranking of the axes, if enough is known for one."""
    if found and len(sweep.axes) > 1:
        caption = captions.ranking(sweep, found, shown)
        yield SweepFigure("ranking", "what explains the spread of each metric", caption,
                          draw_ranking(sweep, found))  # fmt: skip

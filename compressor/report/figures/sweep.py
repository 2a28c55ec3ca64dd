"""Chooses how a study's sweep is drawn, by its axes, and says what is seen."""

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from compressor.report.figures.sweep_data import (
    Measure,
    PlottedAxis,
    PlottedSweep,
    measures,
    shown_value,
    sweep_of,
)
from compressor.report.figures.sweep_maps import (
    MAX_CELLS,
    Ranking,
    draw_maps,
    draw_ranking,
    order_by_mean_strength,
    order_of,
    ranking,
    spell_strongest,
)
from compressor.report.figures.sweep_panels import (
    CHAOTIC,
    MAX_JOBS,
    MAX_LINES,
    MAX_PLACES,
    MAX_POINTS,
    Roles,
    draw_curves,
    draw_overview,
    draw_points,
    grouping,
    roles_of,
)
from compressor.report.figures.table import DrawnFigure
from compressor.report.limits import NO_LIMITS, Limits
from compressor.units import Units

MARKS = {
    "failed": "a cross: a job failed here",
    "missing": "a grey circle: a job was not run",
    CHAOTIC: "a pink ring: a chaotic job, whose averages hold within their bars, but whose "
    "greatest values hold for that run only",
}
VARIANCE = (
    "Spread is the variance over the grid. Bars: the share that an axis explains by itself (main "
    "effect) and together with its interactions with others (total effect, as in the "
    "numbers), from the exact decomposition of the variance (Sobol' 2001; Saltelli et al. 2008)."
)
INDICES = (
    "Spread is the variance over the jobs. Bars: the share that a key explains by itself (main "
    "effect) and together with its interactions with others (total effect, as in the "
    "numbers): Sobol's indices with 95 % bootstrap intervals (Saltelli et al. 2010)."
)
RANKS = (
    "Spearman's correlation of ranks of each metric with each key, and of words the correlation "
    "ratio of ranks, of numbers with 95 % intervals. An effect that rises and falls again is not "
    "seen in it."
)


def draw_sweep(
    data: xr.Dataset, limits: Limits = NO_LIMITS, units: Units = "usual"
) -> list[DrawnFigure]:
    """Return the drawings of a study, as `open_study` gives it; curves show limits of metrics.

    None where nothing is swept or measured.

    What is the same at every job is said in a caption, and not drawn.
    """
    known = measures(data, units)
    sweep = sweep_of(data)
    if not known or not sweep.axes:
        return []
    shown, same = split_measures(sweep, known)
    if not shown:
        shown, same = known, []
    marks = describe_marks(sweep), describe_unchanged(sweep, same)
    if not sweep.is_grid:
        return [*draw_sampled(sweep, shown, marks)]
    if len(sweep.axes) == 1:
        (axis,) = sweep.axes
        title = f"metrics against {axis.phrase}"
        figure = draw_curves(sweep, shown, limits)
        words = (
            f"Every metric against {axis.phrase}, a point a job, with error bars where one is long "
            "enough to be seen.",
            describe_thinning(axis, MAX_JOBS), *marks, *zone_words(shown, limits),
        )  # fmt: skip
        return [DrawnFigure(figure, join_sentences(*words), name=axis.name, title=title)]
    return [*draw_grid(sweep, shown, marks, limits)]


def zone_words(shown: Sequence[Measure], limits: Limits) -> list[str]:
    """Return the sentences on zones, if any of the measures has limits; lines are dashed red."""
    return limits.words if any(limits.of(one) for one in shown) else []


def draw_grid(
    sweep: PlottedSweep, shown: Sequence[Measure], marks: tuple[str, str], limits: Limits
) -> Iterator[DrawnFigure]:
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
        has_lines = any(one.type == "scatter" and not (one.name or one.fill) for one in figure.data)
        lines = (
            "; white: lines of equal value, which stand in the scale of colours, too" * has_lines
        )
        thinned = [describe_thinning(axis, MAX_CELLS) for axis in sweep.axes]
        words = f"A cell a job{lines}.", *thinned, *marks, *zone_words(shown, limits)
        yield DrawnFigure(figure, join_sentences(*words), name="map", title=title)
        return
    role = roles_of(sweep, order)
    title = f"metrics over {sweep.axes[role.x].phrase} and {sweep.axes[role.color].phrase}"
    words = describe_overview(sweep, role), marks[0] if len(sweep.axes) == 2 else "", marks[1]
    figure = draw_overview(sweep, role, shown)
    yield DrawnFigure(figure, join_sentences(*words), name="overview", title=title)


def describe_overview(sweep: PlottedSweep, role: Roles) -> str:
    """Describe every metric over two of the axes: what a point and a colour are."""
    x, color = (sweep.axes[n] for n in role)
    others = [axis.phrase for n, axis in enumerate(sweep.axes) if n not in role]
    whole = (sweep.status == "ok") & ~sweep.chaotic
    point, left = "A point a job.", ""
    if others:
        point = f"Each point is the mean over {' and '.join(others)}."
    if others and not whole.all():
        left = (
            f"Up to {int((~whole).sum())} of {whole.size} jobs lack a value that is known within "
            "its error bar, and are no part of a mean."
        )
    return join_sentences(
        f"Every metric over {x.phrase}, a colour for each value of {color.phrase}.",
        point, left, describe_thinning(x, MAX_PLACES), describe_thinning(color, MAX_LINES),
    )  # fmt: skip


def draw_sampled(
    sweep: PlottedSweep, shown: Sequence[Measure], marks: tuple[str, str]
) -> Iterator[DrawnFigure]:
    """Yield the figures of a list of jobs that are no grid.

    A ranking, and each metric against its strongest key.
    """
    found = ranking(sweep, shown)
    yield from draw_ranked(sweep, found, shown)
    order = order_by_mean_strength(found) if found else [*range(len(sweep.axes))]
    numbers = [n for n in order if not sweep.axes[n].is_words] or order
    strongest = []
    for measure in shown:
        own = order_of(found[measure]) if measure in found else order
        strongest.append(next(n for n in own if n in numbers))
    kind = axis_kind(sweep)
    which = f"the {kind} that matters most for each" if found else f"a {kind}"
    words = f"Every metric over {which}, a point a job.", *describe_colors(sweep), *marks
    figure, title = draw_points(sweep, strongest, shown), f"metrics over {which}"
    yield DrawnFigure(figure, join_sentences(*words), name="points", title=title)


def draw_ranked(
    sweep: PlottedSweep, found: Ranking, shown: Sequence[Measure]
) -> Iterator[DrawnFigure]:
    """Yield the ranking of the axes, if enough is known for one."""
    if not found or len(sweep.axes) < 2:
        return
    kind = next(iter(found.values())).kind
    most = max(effects.unknown for effects in found.values())
    bases = {effects.base for effects in found.values() if effects.base}
    left = [measure.title for measure in shown if measure not in found]
    how = "count with the sum of their axes' main effects" if kind == "grid" else "are left out"
    words = (
        {"grid": VARIANCE, "saltelli": INDICES, "rank": RANKS}[kind],
        f"They are of the first {min(bases):,} whole blocks of the design." if bases else "",
        f"Points without a value that is known within its error bar, up to {most} of a metric, "
        f"{how}." if most else "",
        "Not ranked, since too few values are known or all known ones are the same: "
        f"{'; '.join(left)}." if left else "",
    )  # fmt: skip
    numbers = [(measure.title, spell_strongest(sweep, one)) for measure, one in found.items()]
    title = "what explains the spread of each metric"
    yield DrawnFigure(draw_ranking(sweep, found), join_sentences(*words), numbers, name="ranking",
                      title=title)  # fmt: skip


def join_sentences(*parts: str) -> str:
    """Return the sentences one after the other."""
    return " ".join(part for part in parts if part)


def split_measures(
    sweep: PlottedSweep, known: Sequence[Measure]
) -> tuple[list[Measure], list[Measure]]:
    """Return the measures that differ between jobs, or that some lack, and the others."""
    values, is_ok = [sweep.values(measure) for measure in known], sweep.status == "ok"
    varied = [bool(np.isnan(v[is_ok]).any() or np.ptp(v[np.isfinite(v)])) for v in values]
    both = [*zip(known, varied, strict=True)]
    return [m for m, varies in both if varies], [m for m, varies in both if not varies]


def describe_marks(sweep: PlottedSweep) -> str:
    """Describe the marks that are drawn, if any."""
    there = {*sweep.status.ravel().tolist()} | ({CHAOTIC} if sweep.chaotic.any() else set())
    text = "; ".join(words for mark, words in MARKS.items() if mark in there)
    return f"{text[0].upper()}{text[1:]}." if text else ""


def describe_unchanged(sweep: PlottedSweep, same: Sequence[Measure]) -> str:
    """Describe the measures that are the same at every job, with their values."""
    if not same:
        return ""
    parts = [
        f"{m.title} ({shown_value(np.nanmax(sweep.values(m)))} {m.unit}".rstrip() + ")"
        for m in same
    ]
    return f"The same at every job, and not drawn: {'; '.join(parts)}."


def describe_thinning(axis: PlottedAxis, most: int) -> str:
    """Describe how many of an axis' values are shown, if not all are."""
    count = axis.values.size
    return "" if count <= most else f"Of {count} values of {axis.phrase} {most} are shown."


def axis_kind(sweep: PlottedSweep) -> str:
    """Return what a list of jobs is drawn over: a key, or a number where some keys are words."""
    return "number" if {axis.is_words for axis in sweep.axes} == {True, False} else "key"


def describe_colors(sweep: PlottedSweep) -> Iterator[str]:
    """Yield the sentences on colours, and on how many points are drawn."""
    phrase, _, _ = grouping(sweep)
    if phrase:
        yield f"A colour for each {phrase}."
    count = sweep.place.size
    if count > MAX_POINTS:
        yield f"{MAX_POINTS:,} of {count:,} jobs are drawn; the ranking is that of all."

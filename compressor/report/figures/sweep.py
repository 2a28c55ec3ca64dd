"""Chooses how a study's sweep is drawn, by its axes, and says what is seen."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from compressor import analysis
from compressor.report.figures import sweep_maps, sweep_panels
from compressor.report.figures.sweep_data import (
    Measure,
    PlottedAxis,
    PlottedSweep,
    join_zipped,
    measures,
    shown_value,
    sweep_of,
)
from compressor.report.figures.table import DrawnFigure, Number
from compressor.report.limits import NO_LIMITS, Limits
from compressor.units import Units

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


CORRELATED = 0.5  # correlation of ranks of two keys, beyond which they go together


def draw_sweep(
    data: xr.Dataset, limits: Limits = NO_LIMITS, units: Units = "usual", is_curve: bool = False
) -> list[DrawnFigure]:
    """Return the drawings of a study, as `open_study` gives it; curves show limits of metrics.

    None where nothing is swept or measured. What is the same at every job is a number of a caption,
    and not drawn. is_curve: the jobs are along one key, or several that are zipped.
    """
    known = measures(data, units)
    sweep = sweep_of(data)
    if not known or not sweep.axes:
        return []
    swept = sweep.axes
    if is_curve and not sweep.is_grid:
        sweep = join_zipped(sweep)
    shown, same = split_measures(sweep, known)
    if not shown:
        shown, same = known, []
    about = [*count_jobs(sweep), *(number_of_all(sweep, one) for one in same)]
    if not sweep.is_grid:
        return [*draw_sampled(sweep, shown, about)]
    if len(sweep.axes) == 1:
        (axis,) = sweep.axes
        others = ", ".join(one.phrase for one in swept if one.name != axis.name)
        along = f" ({others} with it)" * bool(others)
        sentence = (
            f"Every metric against {axis.phrase}{along}, a point a job, with error bars where one "
            "is long enough to be seen."
        )
        return [DrawnFigure(
            sweep_panels.draw_lines(sweep, [0], shown, limits), sentence,
            [*count_drawn(axis, sweep_panels.MAX_JOBS), *about],
            zone_words(shown, limits), axis.name, f"metrics against {axis.phrase}",
        )]  # fmt: skip
    return [*draw_grid(sweep, shown, about, limits)]


def zone_words(shown: Sequence[Measure], limits: Limits) -> str:
    """Return the sentences on zones, if any of the measures has limits; lines are dashed red."""
    return "".join(f" {text}" for text in limits.words(shown))


def draw_grid(
    sweep: PlottedSweep, shown: Sequence[Measure], about: Sequence[Number], limits: Limits
) -> Iterator[DrawnFigure]:
    """Yield a grid's figures: a ranking, and all metrics as maps or lines."""
    found = sweep_maps.ranking(sweep, shown)
    yield from draw_ranked(sweep, found, shown)
    order = sweep_maps.order_by_mean_strength(found) if found else [*range(len(sweep.axes))]
    first, second = (sweep.axes[n] for n in order[:2])
    if len(sweep.axes) == 2 and first.is_words == second.is_words:
        title = f"metrics over {first.phrase} and {second.phrase}"
        cut = [number for axis in sweep.axes for number in count_drawn(axis, sweep_maps.MAX_CELLS)]
        sentence = "A cell a job; one without colour lacks the metric."
        maps = sweep_maps.draw_maps(sweep, shown)
        yield DrawnFigure(maps, sentence, [*cut, *about], zone_words(shown, limits), "map", title)
        return
    chosen = sweep_panels.choose_axes(sweep, order)
    x, color = (sweep.axes[n] for n in chosen)
    others = [axis.phrase for n, axis in enumerate(sweep.axes) if n not in chosen]
    point = f"the mean over {' and '.join(others)}" if others else "a job"
    sentence = (
        f"Every metric over {x.phrase}, a colour for each value of {color.phrase}; a point is "
        f"{point}."
    )
    cut = [*count_drawn(x, sweep_panels.MAX_PLACES), *count_drawn(color, sweep_panels.MAX_LINES)]
    yield DrawnFigure(
        sweep_panels.draw_lines(sweep, chosen, shown), sentence, [*cut, *about],
        " What is not known within its error bar is no part of a mean." * bool(others),
        "overview", f"metrics over {x.phrase} and {color.phrase}",
    )  # fmt: skip


def draw_sampled(
    sweep: PlottedSweep, shown: Sequence[Measure], about: Sequence[Number]
) -> Iterator[DrawnFigure]:
    """Yield a list's figures: a ranking, and each metric over its strongest key."""
    found = sweep_maps.ranking(sweep, shown)
    yield from draw_ranked(sweep, found, shown)
    order = sweep_maps.order_by_mean_strength(found) if found else [*range(len(sweep.axes))]
    numbers = [n for n in order if not sweep.axes[n].is_words] or order
    strongest = []
    for measure in shown:
        own = sweep_maps.order_of(found[measure]) if measure in found else order
        strongest.append(next(n for n in own if n in numbers))
    # where some keys are words, each metric is drawn over a number
    kind = "number" if {axis.is_words for axis in sweep.axes} == {True, False} else "key"
    which = f"the {kind} that matters most for each" if found else f"a {kind}"
    phrase, _, _ = sweep_panels.grouping(sweep)
    colors = f", a colour for each {phrase}" * bool(phrase)
    count = sweep.status.size
    drawn = [("jobs drawn", f"{sweep_panels.MAX_POINTS:,} of {count:,}")] * (
        count > sweep_panels.MAX_POINTS
    )
    yield DrawnFigure(
        sweep_panels.draw_points(sweep, strongest, shown),
        f"Every metric over {which}, a point a job{colors}.", [*drawn, *about], "", "points",
        f"metrics over {which}",
    )  # fmt: skip


def draw_ranked(
    sweep: PlottedSweep, found: sweep_maps.Ranking, shown: Sequence[Measure]
) -> Iterator[DrawnFigure]:
    """Yield the ranking of the axes, if enough is known for one."""
    if not found or len(sweep.axes) < 2:
        return
    kind = next(iter(found.values())).kind
    most = max(effects.unknown for effects in found.values())
    bases = {effects.base for effects in found.values() if effects.base}
    left = [measure.title for measure in shown if measure not in found]
    how = "count with the sum of their axes' main effects" if kind == "grid" else "are left out"
    numbers = [
        (measure.title, sweep_maps.spell_strongest(sweep, one)) for measure, one in found.items()
    ]
    numbers += [("first whole blocks of the design", f"{min(bases):,}")] if bases else []
    numbers += [(f"points of a metric that are not known within their error bars, and {how}",
                 f"up to {most}")] * bool(most)  # fmt: skip
    why = "too few values are known or all are the same within their error bars"
    numbers += [(f"not ranked, as {why}", ", ".join(left))] * bool(left)
    sentence = {"grid": VARIANCE, "saltelli": INDICES, "rank": RANKS + spell_correlated(sweep)}[
        kind
    ]
    title = "what explains the spread of each metric"
    yield DrawnFigure(
        sweep_maps.draw_ranking(sweep, found), sentence, numbers, "", "ranking", title
    )


def spell_correlated(sweep: PlottedSweep) -> str:
    """Return the sentence on pairs of keys that go together over the jobs, if there are any."""
    if sweep.is_grid:
        return ""
    pairs = []
    numbers = (axis for axis in sweep.axes if not axis.is_words)
    for one, other in itertools.combinations(numbers, 2):
        x, y = one.places, other.places
        known = np.isfinite(x) & np.isfinite(y)
        if np.unique(y[known]).size > 1:
            found, _, _ = analysis.correlate_ranks(x[known], y[known])
            pairs += [f"{one.phrase} and {other.phrase} ({found:.2f})"] * (abs(found) > CORRELATED)
    text = ", ".join(pairs).replace("-", "−")
    return f" These keys go together, so that one's effect may be the other's: {text}." * bool(text)


def split_measures(
    sweep: PlottedSweep, known: Sequence[Measure]
) -> tuple[list[Measure], list[Measure]]:
    """Return the measures that differ between jobs, or that some lack, and the others.

    Where none differs those that are not 0. What is 0 wherever it is known is one of the others.
    """
    values, is_ok = [measure.of(sweep.data) for measure in known], sweep.status == "ok"
    filled = [np.where(is_ok, np.nan_to_num(v), np.nanmax(v)) for v in values]  # lacks differ, too
    varied = [bool(np.ptp(v)) for v in filled]
    if not any(varied):
        varied = [bool(v.any()) for v in filled]
    both = [*zip(known, varied, strict=True)]
    return [m for m, varies in both if varies], [m for m, varies in both if not varies]


def count_jobs(sweep: PlottedSweep) -> Iterator[Number]:
    """Yield how many jobs there are, and how many of these failed, were not run, are chaotic."""
    yield "jobs", f"{sweep.status.size:,}"
    failed, missing = (sweep.status == word for word in ("failed", "missing"))
    for name, here in (("failed", failed), ("not run", missing), ("chaotic", sweep.chaotic)):
        if here.any():
            yield name, f"{here.sum():,}"


def number_of_all(sweep: PlottedSweep, measure: Measure) -> Number:
    """Return the number of a measure that is the same at every job."""
    values = measure.of(sweep.data)
    lacks = " that has it" * bool(np.isnan(values[sweep.status == "ok"]).any())
    text = f"{shown_value(np.nanmax(values))} {measure.unit}".rstrip()
    return f"{measure.title}, at every job{lacks}", text


def count_drawn(axis: PlottedAxis, most: int) -> list[Number]:
    """Return how many of an axis' values are drawn; nothing where all are."""
    count = axis.values.size
    return [(f"values of {axis.phrase} drawn", f"{most:,} of {count:,}")] * (count > most)

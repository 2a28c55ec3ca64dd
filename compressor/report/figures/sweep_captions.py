"""What is said under the drawings of a sweep. A caption is a claim: each number is of the data."""

from collections.abc import Iterator, Sequence

import numpy as np

from compressor.report.figures.sweep_data import Measure, PlottedAxis, PlottedSweep, shown_value
from compressor.report.figures.sweep_maps import MAX_CELLS, Ranking, describe_ranking
from compressor.report.figures.sweep_panels import (
    CHAOTIC,
    MAX_JOBS,
    MAX_LINES,
    MAX_PLACES,
    MAX_POINTS,
    Roles,
    grouping,
)

MARKS = {
    "failed": "a cross: a job failed here",
    "missing": "a grey circle: a job was not run",
    CHAOTIC: "a pink ring: a chaotic job, whose averages hold within their bars, but whose "
    "greatest values hold for that run only",
}
VARIANCE = (
    "Spread is the variance over the grid. Bars: the share that an axis explains by itself (main "
    "effect) and together with its interactions with others (total effect, as in these "
    "sentences), from the exact decomposition of the variance (Sobol' 2001; Saltelli et al. 2008)."
)
INDICES = (
    "Spread is the variance over the jobs. Bars: the share that a key explains by itself (main "
    "effect) and together with its interactions with others (total effect, as in these "
    "sentences): Sobol's indices with 95 % bootstrap intervals (Saltelli et al. 2010)."
)
RANKS = (
    "Spearman's correlation of ranks of each metric with each key, and of words the correlation "
    "ratio of ranks, of numbers with 95 % intervals. An effect that rises and falls again is not "
    "seen in it."
)


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


def curves(sweep: PlottedSweep) -> str:
    """Describe a sweep along one axis."""
    return join_sentences(
        f"Every metric against {sweep.axes[0].phrase}, a point a job, with error bars where one "
        "is long enough to be seen.",
        describe_thinning(sweep.axes[0], MAX_JOBS),
    )


def maps(sweep: PlottedSweep, has_lines: bool) -> str:
    """Describe a sweep along two axes. has_lines: of equal value, in some panel."""
    lines = "; white: lines of equal value, which stand in the scale of colours, too"
    return join_sentences(
        f"A cell a job{lines if has_lines else ''}.",
        *(describe_thinning(axis, MAX_CELLS) for axis in sweep.axes),
    )


def describe_thinning(axis: PlottedAxis, most: int) -> str:
    """Describe how many of an axis' values are shown, if not all are."""
    count = axis.values.size
    return "" if count <= most else f"Of {count} values of {axis.phrase} {most} are shown."


def describe_points(sweep: PlottedSweep, role: Roles) -> str:
    """Describe a point: a job, with the meaning of its marks, or a mean over some axes."""
    others = [axis.phrase for n, axis in enumerate(sweep.axes) if n not in role]
    if not others:
        return join_sentences("A point a job.", describe_marks(sweep))
    whole = (sweep.status == "ok") & ~sweep.chaotic
    left = "" if whole.all() else (
        f"Up to {int((~whole).sum())} of {whole.size} jobs lack a value that is known within its "
        "error bar, and are no part of a mean."
    )  # fmt: skip
    return join_sentences(f"Each point is the mean over {' and '.join(others)}.", left)


def overview(sweep: PlottedSweep, role: Roles, are_first: bool) -> str:
    """Describe every metric over two of the axes. are_first: of a ranking of more axes."""
    color = sweep.axes[role.color]
    rank = ": the axes that matter most on the mean of all metrics" if are_first else ""
    return join_sentences(
        f"Every metric over {sweep.axes[role.x].phrase}, a colour for each value of "
        f"{color.phrase}{rank}.",
        describe_points(sweep, role),
        describe_thinning(sweep.axes[role.x], MAX_PLACES),
        describe_thinning(color, MAX_LINES),
    )


def axis_kind(sweep: PlottedSweep) -> str:
    """Return what a list of jobs is drawn over: a key, or a number where some keys are words."""
    return "number" if {axis.is_words for axis in sweep.axes} == {True, False} else "key"


def points(sweep: PlottedSweep, is_ranked: bool) -> str:
    """Describe each metric of a list of jobs over a key."""
    kind = axis_kind(sweep)
    which = f"the {kind} that matters most for it" if is_ranked else f"a {kind}"
    return join_sentences(f"Every metric over {which}, a point a job.", *describe_colors(sweep))


def scatter(sweep: PlottedSweep, shown: int, keys: int, is_ranked: bool) -> str:
    """Describe some metrics of a list of jobs over several keys. shown: so many of the keys."""
    kind = axis_kind(sweep)
    most = f"the {shown} strongest" if is_ranked else f"{shown}"
    some = f"{most} of {keys} {kind}s" if keys > shown else f"each {kind}"
    return join_sentences(
        f"The metrics that change most over {some}, a point a job.",
        *describe_colors(sweep),
    )


def describe_colors(sweep: PlottedSweep) -> Iterator[str]:
    """Yield the sentences on colours, and on how many points are drawn."""
    phrase, _, _ = grouping(sweep)
    if phrase:
        yield f"A colour for each {phrase}."
    count = sweep.place.size
    if count > MAX_POINTS:
        yield f"{MAX_POINTS:,} of {count:,} jobs are drawn; the ranking is that of all."


def ranking(sweep: PlottedSweep, found: Ranking, shown: Sequence[Measure]) -> str:
    """Describe which axis matters for which of the metrics that are shown."""
    left = [measure.title for measure in shown if measure not in found]
    kind = next(iter(found.values())).kind
    most = max(effects.unknown for effects in found.values())
    bases = {effects.base for effects in found.values() if effects.base}
    return join_sentences(
        describe_ranking(sweep, found) + " In parentheses: the correlation." * (kind == "rank"),
        {"grid": VARIANCE, "saltelli": INDICES, "rank": RANKS}[kind],
        f"They are of the first {min(bases):,} whole blocks of the design." if bases else "",
        f"Points without a value that is known within its error bar, up to {most} of a metric, "
        + ("count with the sum of their axes' main effects." if kind == "grid" else "are left out.")
        if most
        else "",
        "Not ranked, since too few values are known or all known ones are the same: "
        f"{'; '.join(left)}."
        if left
        else "",
    )

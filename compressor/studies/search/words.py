"""What a search finds, as lines of text and as JSON."""

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

from compressor.digits import by_bar, plural
from compressor.studies.search.find import SearchResult
from compressor.studies.search.question import JobReading, Question
from compressor.units import Units

MAX_LISTED = 5  # points that do not decide, one by one
Shown = tuple[str, float]  # a unit, and the factor to it from SI
AVERAGED = " (mean over revolutions: chaotic)"
UNBARRED = " (no error bar was made)"


def lines(
    question: Question, answer: SearchResult, folder: str, units: "Units | None"
) -> Iterator[str]:
    """Yield an answer as it is printed, its numbers in chosen units."""
    shown = question.goal.unit_shown(units)
    kind_lines = comparison_lines if answer.best is None else extremum_lines
    yield from kind_lines(question, answer, shown)
    for point in answer.blind[:MAX_LISTED]:
        within = f"{format_reading(point.reading, shown)}: within its error bar of the limit"
        yield f"  {at(question, point)}: {point.reading.reason or within}  job {point.key[:8]}"
    if len(answer.blind) > MAX_LISTED:
        yield f"  and {len(answer.blind) - MAX_LISTED} more"
    yield from crossing_lines(question, answer)
    outside = [point for point in answer.failed if point not in answer.blind]
    for point in outside[:MAX_LISTED]:
        yield f"  {at(question, point)}, outside: {point.reading.reason}  job {point.key[:8]}"
    yield f"what is finer than the scan, {spacing(question)}, may be missed"
    yield (f"{plural(len(answer.points))}, {answer.run_now} of them run now, in study "
           f"{answer.study} of {folder}")  # fmt: skip


def comparison_lines(question: Question, answer: SearchResult, shown: Shown) -> Iterator[str]:
    """Yield the place at which a comparison first becomes true."""
    goal = question.goal
    unit, factor = shown
    text = f"{goal.name} {goal.sign} {factor * goal.limit:g} {unit}".rstrip()
    if answer.base:
        base = format_reading(answer.base, shown)
        yield f"base, at {question.key} = {question.low:g}: {base}; {goal.times:g} times it"
    low, high = answer.low, answer.high

    def line(point: Any, verdict: str) -> str:
        reading = format_reading(point.reading, shown)
        return f"  {at(question, point)}: {verdict}, {reading}  job {point.key[:8]}"

    if high is None:
        many = f"at none of {len(answer.points)} points from {question.low:g} to {question.high:g}"
        unsure = f", and {len(answer.blind)} of them {doubt(answer)}:" if answer.blind else ""
        yield f"{text} surely holds {many}{unsure}" if unsure else f"{text} holds {many}"
    elif answer.kind == "at_low":
        yield f"{text} holds from the range's lower end on"
        yield line(high, "yes")
    else:
        start = f"at most {question.low:g}" if low is None else f"{low.argument:.9g}"
        yield f"{text} first holds between {question.key} = {start} and {high.argument:.9g}"
        if low is not None:
            yield line(low, "no")
        yield line(high, "yes")
        if answer.blind:
            yield f"  {plural(len(answer.blind), 'point')} between {doubt(answer)}:"


def doubt(answer: SearchResult) -> str:
    """Describe points whose error bars reach the limit."""
    return "does not decide" if len(answer.blind) == 1 else "do not decide"


def crossing_lines(question: Question, answer: SearchResult) -> Iterator[str]:
    """Yield the crossings beside the first, each between two neighbouring points."""
    others = [one for one in answer.crossings if one.high is not answer.high]
    if others:
        yield f"{plural(len(others), 'more crossing')} seen, not narrowed down:"
    for one in others:
        verb = "holds again" if one.holds else "stops holding"
        yield f"  {verb} between {at(question, one.low)} and {one.high.argument:.9g}"


def extremum_lines(question: Question, answer: SearchResult, shown: Shown) -> Iterator[str]:
    """Yield the place at which a metric is greatest or least."""
    best = answer.best
    assert best is not None
    yield (f"{question.goal.name} is {question.goal.sign} at {at(question, best)}: "
           f"{format_reading(best.reading, shown)}  job {best.key[:8]}")  # fmt: skip
    first, last = answer.within[0].argument, answer.within[-1].argument
    if len(answer.within) > 1:
        yield (f"  as far as error bars show, {len(answer.within)} points from {first:.9g} to "
               f"{last:.9g} may be as good")  # fmt: skip
    low = "none" if answer.low is None else f"{answer.low.argument:.9g}"
    high = "none" if answer.high is None else f"{answer.high.argument:.9g}"
    yield f"  nearest points that are surely worse: below {low}, above {high}"
    if answer.blind:
        yield f"  {plural(len(answer.blind), 'point')} between without a value:"


def at(question: Question, point: Any) -> str:
    """Return a point's place."""
    return f"{question.key} = {point.argument:.9g}"


def format_reading(reading: JobReading, shown: Shown) -> str:
    """Return a job's number with its error bar in a unit."""
    unit, factor = shown
    bar = factor * reading.bar if reading.barred else math.nan
    text = by_bar(factor * reading.value, bar, False)
    return (f"{text} {unit}".rstrip() + AVERAGED * reading.averaged
            + UNBARRED * (not reading.barred))  # fmt: skip


def spacing(question: Question) -> str:
    """Describe the distance of the points of a scan."""
    steps = question.scan - 1
    if question.logarithmic:
        factor = (question.high / question.low) ** (1 / steps)
        return f"{question.scan} points a factor {factor:.4g} apart"
    return f"{question.scan} points {(question.high - question.low) / steps:.4g} apart"


def jsonable_answer(question: Question, answer: SearchResult) -> dict[str, Any]:
    """Return a question and its answer as JSON says them."""
    fields = dataclasses.asdict(question) | {"unit": question.goal.unit}
    return fields | dataclasses.asdict(answer, dict_factory=by_json_key)


def by_json_key(fields: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return fields by their JSON keys, which stay: that of a point's reading is `told`."""
    return {"told" if name == "reading" else name: value for name, value in fields}

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


def list_answer(
    question: Question, answer: SearchResult, folder: str, units: "Units | None"
) -> Iterator[str]:
    """Yield an answer as it is printed, its numbers in chosen units."""
    shown = question.goal.unit_shown(units)
    list_kind = list_comparison if answer.best is None else list_extremum
    yield from list_kind(question, answer, shown)
    for point in answer.blind[:MAX_LISTED]:
        within = f"{format_reading(point.reading, shown)}: within its error bar of the limit"
        yield f"  {at(question, point)}: {point.reading.reason or within}  job {point.key[:8]}"
    if len(answer.blind) > MAX_LISTED:
        yield f"  and {len(answer.blind) - MAX_LISTED} more"
    others = [one for one in answer.crossings if one.high is not answer.high]
    if others:
        yield f"{plural(len(others), 'more crossing')} seen, not narrowed down:"
    for one in others:
        verb = "holds again" if one.holds else "stops holding"
        yield f"  {verb} between {at(question, one.low)} and {one.high.argument:.9g}"
    outside = [point for point in answer.failed if point not in answer.blind]
    for point in outside[:MAX_LISTED]:
        yield f"  {at(question, point)}, outside: {point.reading.reason}  job {point.key[:8]}"
    yield f"what is finer than the scan, {spacing(question)}, may be missed"
    run = f"{plural(len(answer.points))}, {answer.run_now} of them run now"
    yield f"{run}, in study {answer.study} of {folder}"


def list_comparison(question: Question, answer: SearchResult, shown: Shown) -> Iterator[str]:
    """Yield the place at which a comparison first becomes true."""
    goal, key, low, high = question.goal, question.key, answer.low, answer.high
    unit, factor = shown
    text = f"{goal.name} {goal.sign} {factor * goal.limit:g} {unit}".rstrip()
    doubt = "does not decide" if len(answer.blind) == 1 else "do not decide"
    if answer.base:
        base = format_reading(answer.base, shown)
        yield f"base, at {key} = {question.low:g}: {base}; {goal.times:g} times it"
    if high is None:
        many = f"none of {len(answer.points)} points from {question.low:g} to {question.high:g}"
        unsure = f", and {len(answer.blind)} of them {doubt}:"
        yield (
            f"{text} surely holds at {many}{unsure}" if answer.blind else f"{text} holds at {many}"
        )
    elif answer.kind == "at_low":
        yield f"{text} holds from the range's lower end on"
    else:
        start = f"at most {question.low:g}" if low is None else f"{low.argument:.9g}"
        yield f"{text} first holds between {key} = {start} and {high.argument:.9g}"
        if low:
            yield f"  {at(question, low)}: no, {job_words(low, shown)}"
    if high:
        yield f"  {at(question, high)}: yes, {job_words(high, shown)}"
        if answer.blind and answer.kind != "at_low":
            yield f"  {plural(len(answer.blind), 'point')} between {doubt}:"


def list_extremum(question: Question, answer: SearchResult, shown: Shown) -> Iterator[str]:
    """Yield the place at which a metric is greatest or least."""
    best, goal, within = answer.best, question.goal, answer.within
    assert best is not None
    yield f"{goal.name} is {goal.sign} at {at(question, best)}: {job_words(best, shown)}"
    if len(within) > 1:
        reach = f"{within[0].argument:.9g} to {within[-1].argument:.9g}"
        yield f"  as far as error bars show, {len(within)} points from {reach} may be as good"
    low, high = (f"{one.argument:.9g}" if one else "none" for one in (answer.low, answer.high))
    yield f"  nearest points that are surely worse: below {low}, above {high}"
    if answer.blind:
        yield f"  {plural(len(answer.blind), 'point')} between without a value:"


def at(question: Question, point: Any) -> str:
    """Return a point's place."""
    return f"{question.key} = {point.argument:.9g}"


def job_words(point: Any, shown: Shown) -> str:
    """Return a point's number and job."""
    return f"{format_reading(point.reading, shown)}  job {point.key[:8]}"


def format_reading(reading: JobReading, shown: Shown) -> str:
    """Return a job's number with its error bar in a unit."""
    unit, factor = shown
    bar = factor * reading.bar if reading.barred else math.nan
    text = f"{by_bar(factor * reading.value, bar, False)} {unit}".rstrip()
    text += " (mean over revolutions: chaotic)" if reading.averaged else ""
    return text if reading.barred else f"{text} (no error bar was made)"


def spacing(question: Question) -> str:
    """Return the distance of the points of a scan."""
    steps = question.scan - 1
    if question.logarithmic:
        factor = (question.high / question.low) ** (1 / steps)
        return f"{question.scan} points a factor {factor:.4g} apart"
    return f"{question.scan} points {(question.high - question.low) / steps:.4g} apart"


def jsonable_answer(question: Question, answer: SearchResult) -> dict[str, Any]:
    """Return a question and its answer as JSON says them."""
    fields = dataclasses.asdict(question) | {"unit": question.goal.unit}
    return fields | dataclasses.asdict(answer)

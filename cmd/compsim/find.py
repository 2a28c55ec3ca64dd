"""`compsim find`: where a metric first passes a value, or is greatest or least, over a key."""

import dataclasses
import json
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from compressor.digits import by_bar
from compressor.program import duration
from compsim.options import (
    check_json_units,
    config_argument,
    jobs_option,
    json_option,
    quiet_option,
    results_option,
    setting,
    units_option,
)
from compsim.progress import ProgressReporter
from compsim.screen import (
    DONE,
    SOME_FAILED,
    caution,
    jsonable,
    one_thread_each,
    plural,
    print_text,
    say_wrapped,
    wrap_line,
)

if TYPE_CHECKING:
    from compressor.cases import Study
    from compressor.studies.search.find import SearchResult
    from compressor.studies.search.question import JobReading, Question
    from compressor.units import Units

KINDS = ("first", "greatest", "least")
MAX_LISTED = 5  # points that do not decide, one by one
Shown = tuple[str, float]  # a unit, and the factor to it from SI
AVERAGED = " (mean over revolutions: chaotic)"
UNBARRED = " (no error bar was made)"


@click.command()
@config_argument
@click.option("--over", required=True, metavar="KEY=LOW:HIGH",
              help="Search over this key within this range, in the case file's unit.")  # fmt: skip
@click.option("--first", metavar="'METRIC[.JOINT] > VALUE'",
              help="Find where this becomes true going up: > >= < <=. VALUE is in SI, or has its "
              "unit, as 166 kN, or is a factor, as 1.5 * base: of the metric at LOW.")  # fmt: skip
@click.option("--greatest", metavar="METRIC[.JOINT]", help="Find where the metric is greatest.")
@click.option("--least", metavar="METRIC[.JOINT]", help="Find where the metric is least.")
@click.option("--tolerance", type=click.FloatRange(1e-9, 0.5), default=1e-3, show_default=True,
              help="Narrow the answer down to this, relative to the range.")  # fmt: skip
@click.option("--scan", type=click.IntRange(3, 1000), default=9, show_default=True,
              help="Run so many evenly spaced points first.")  # fmt: skip
@click.option("--log", "logarithmic", is_flag=True, help="Space points evenly in the logarithm.")
@units_option("that of VALUE, else SI")
@setting
@results_option
@jobs_option("Run in this many worker processes, as many points in one step of --first.")
@json_option
@quiet_option
def find(
    config: str,
    folder: str,
    jobs: int | None,
    units: "Units | None",
    as_json: bool,
    quiet: bool,
    **options: Any,
) -> int:
    """Find where a metric passes a value, or is greatest or least.

    \b
    compsim find worn.yaml --over clearance_mm=0.01:0.3 \\
        --first 'contact_loss_fraction.small_end > 0.001'
    compsim find worn.yaml --over machine.speed_rpm=200:900 \\
        --greatest peak_acceleration
    compsim find worn.yaml --over clearance_mm=0.08:0.3 \\
        --first 'peak_contact_force.small_end > 1.5 * base' --units plant

    CONFIG makes one case once the key is given. The answer of --first is an interval: at its lower
    end the comparison does not hold, at its upper end it does. Points that their error bars leave
    open, or whose job failed, stay inside the interval and are named. Later crossings are
    named as wide as the scan shows them; a narrower --over narrows one down. Of --greatest and
    --least it is the best point, and the points whose error bars reach its own. Structure that is
    finer than the scan may be missed. In a chaotic motion a peak stands for its mean over
    revolutions.

    Every point is a job of the study CONFIG-find-KEY in the folder of results: it is stored, and
    not run again. --json has all numbers in SI. Exit code 3 if any point's job failed.
    """
    check_json_units(as_json, units)
    one_thread_each()  # before numpy loads
    question = question_of(config, options)
    study = question.checked()
    from compressor.studies.search.find import find as search
    from compressor.sweep import cores

    if not quiet:
        caution([study])
        tell_ahead(question, study, folder, jobs or cores())
    with ProgressReporter(quiet, "points") as progress:
        answer = search(question, folder, jobs or cores(), progress)
    if answer.base:
        question = dataclasses.replace(question, goal=question.goal.beside(answer.base))
    if as_json:
        print_text(json.dumps(jsonable_answer(question, answer), indent=1))
    else:
        for line in lines(question, answer, folder, units):
            indent = len(line) - len(line.lstrip())
            print_text("\n".join(wrap_line(line.lstrip(), indent)))
    return SOME_FAILED if answer.failed else DONE


def tell_ahead(question: "Question", study: "Study", folder: str, workers: int) -> None:
    """Report how many runs a search will take, and about how long, by timing one of them."""
    from compressor.sweep import forecast

    found = forecast([study], folder, 0)
    if missing := found.counts.missing:
        whole = found.with_times(workers, say_wrapped, 1)
        steps, points = question.most_to_narrow(workers)
        each = (whole.seconds - whole.loading) / missing
        if steps == points:  # one at a time
            each *= max(1.0, whole.cores)
        more = steps * whole.loading + points * each  # each step starts workers of its own
        say_wrapped(
            f"{plural(missing, 'run')} to scan, about {duration(whole.seconds)}; then up to "
            f"{points} to narrow the answer, about {duration(more)}"
        )


def question_of(config: str, options: dict[str, Any]) -> "Question":
    """Return the question of the options; a usage error where it is none, or more than one."""
    from compressor.studies.search.question import Question

    kinds = [kind for kind in KINDS if options[kind] is not None]
    if len(kinds) != 1:
        raise click.UsageError("give one of --first, --greatest and --least")
    more = {name: options[name] for name in ("tolerance", "scan", "logarithmic", "overrides")}
    return Question.written(config, options["over"], options[kinds[0]], kinds[0], **more)


def lines(
    question: "Question", answer: "SearchResult", folder: str, units: "Units | None"
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


def comparison_lines(question: "Question", answer: "SearchResult", shown: Shown) -> Iterator[str]:
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


def doubt(answer: "SearchResult") -> str:
    """Describe points whose error bars reach the limit."""
    return "does not decide" if len(answer.blind) == 1 else "do not decide"


def crossing_lines(question: "Question", answer: "SearchResult") -> Iterator[str]:
    """Yield the crossings beside the first, each between two neighbouring points."""
    others = [one for one in answer.crossings if one.high is not answer.high]
    if others:
        yield f"{plural(len(others), 'more crossing')} seen, not narrowed down:"
    for one in others:
        verb = "holds again" if one.holds else "stops holding"
        yield f"  {verb} between {at(question, one.low)} and {one.high.argument:.9g}"


def extremum_lines(question: "Question", answer: "SearchResult", shown: Shown) -> Iterator[str]:
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


def at(question: "Question", point: Any) -> str:
    """Return a point's place."""
    return f"{question.key} = {point.argument:.9g}"


def format_reading(reading: "JobReading", shown: Shown) -> str:
    """Return a job's number with its error bar in a unit."""
    unit, factor = shown
    bar = factor * reading.bar if reading.barred else math.nan
    text = by_bar(factor * reading.value, bar, False)
    return (f"{text} {unit}".rstrip() + AVERAGED * reading.averaged
            + UNBARRED * (not reading.barred))  # fmt: skip


def spacing(question: "Question") -> str:
    """Describe the distance of the points of a scan."""
    steps = question.scan - 1
    if question.logarithmic:
        factor = (question.high / question.low) ** (1 / steps)
        return f"{question.scan} points a factor {factor:.4g} apart"
    return f"{question.scan} points {(question.high - question.low) / steps:.4g} apart"


def jsonable_answer(question: "Question", answer: "SearchResult") -> dict[str, Any]:
    """Return a question and its answer as JSON says them."""
    fields = dataclasses.asdict(question) | {"unit": question.goal.unit}
    return jsonable(fields | dataclasses.asdict(answer, dict_factory=by_json_key))


def by_json_key(fields: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return fields by their JSON keys, which stay: that of a point's reading is `told`."""
    return {"told" if name == "reading" else name: value for name, value in fields}

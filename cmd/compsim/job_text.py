"""What is known of one job, line by line: numbers with names, units and their error bars."""

import itertools
import math
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from compressor import metrics
from compressor.digits import ROUNDING, UNKNOWN, by_bar
from compressor.units import Units, unit_in
from compsim import screen

if TYPE_CHECKING:
    from compressor.store import JobReport

Line = tuple[str, str]  # a label and what stands beside it

WIDTH = 37  # columns of a label, or more where one is longer
SPREAD = "_standard_error"
# unit in SI -> the unit of case files and of the report, and its factor
UNITS = {
    "m/s2": ("m/s²", 1.0), "N": ("kN", 1e-3), "m": ("mm", 1e3), "rad": ("deg", math.degrees(1.0)),
    "1": ("", 1.0),
}  # fmt: skip
LABELS = {  # of others than their names
    "contact_loss_fraction": "time without dry contact",
    "impacts_per_rev": "dry contacts after flight",
}
FACTS = ("promise", "regime", "method", "rtol", "program", "libraries")


def sections(
    found: "JobReport", limits: tuple[float, float], units: Units = "usual"
) -> Iterator[tuple[str, list[str]]]:
    """Yield the headings and lines of a job.

    limits: of the rod load's reversal, degrees and percent; units: of the numbers.
    """
    yield "", screen.align_lines(stop(found), WIDTH)
    known = numbers(found, units, "tally", "statistics", "body")
    lines = screen.align_lines([*known, *reversal_verdict(found, *limits)], WIDTH)
    notes = [*film(found), *cautions(found), *found.caveats]
    yield "metrics, with their error bars", [*lines, *notes]
    yield (
        "its machine at a steady speed, with ideal joints",
        screen.align_lines(machine(found, units), WIDTH),
    )
    yield (
        "relative errors of the time series",
        screen.align_lines(series_errors(found), WIDTH),
    )
    yield "the run", screen.align_lines([*numbers(found, units, "run"), *facts(found)], WIDTH)


def stop(found: "JobReport") -> list[Line]:
    """Return where a job's run stopped, and its state there; [] for one that ended."""
    attributes = found.attributes
    if "stop_history_words" not in attributes:
        return []
    angle = math.degrees(attributes["stop_crank_angle"]) % 360
    when = f"at {attributes['stop_time']:.9g} s, {angle:.5g} degrees of crank angle"
    lines = [("stopped", when)]
    names = attributes["stop_state_names"].split("; ")
    for name, value in zip(names, attributes["stop_state"], strict=False):
        lines.append((name, f"{value:.6g}"))
    return lines


def numbers(found: "JobReport", units: Units, *sources: str) -> list[Line]:
    """Return a line for each number of some sources, joint and axis, to its known digits."""
    lines = []
    for name, row in metrics.NUMBERS.items():
        if row.source not in sources or name.endswith(SPREAD) or name not in found.numbers:
            continue
        if row.kind == "count":  # it grows with the run: the number per revolution is shown
            continue
        values, (errors, relative, kind) = found.numbers[name], bar_of(found, name)
        unit, factor = unit_of(row, units)
        highest = max(values) if "segment" in row.dims else -math.inf
        every = [abs(pick_value(values, place)) for place, _ in places(row)]
        rounding = ROUNDING * max((one for one in every if not math.isnan(one)), default=0.0)
        for place, label in places(row):
            value = pick_value(values, place)
            if math.isnan(value) or tells_nothing(found, row, place):
                continue
            if value < highest:
                continue  # of the segments of a revolution the one that is highest
            error = math.nan if errors is None else pick_value(errors, place)
            if abs(value) < rounding:  # beside the other joint or axis
                value = error = 0.0
            text = format_measured(value * factor, error * factor, relative)
            if error == 0.0 and name.endswith("_per_rev"):
                text = f"{value:.3g}"  # a mean of few whole numbers: exact of this run alone
            if text != UNKNOWN:
                text = " ".join(filter(None, (text, unit, "" if math.isnan(error) else kind)))
                if name == "knock":
                    text += f", {knock_verdict(value, error)}"
            elif kind:
                continue  # of the statistics of a chaotic motion only those that are known
            lines.append((label, text))
    return lines


def knock_verdict(value: float, error: float) -> str:
    """Return whether a joint with a `knock` knocks, by its limit and the error bar."""
    limit = metrics.BARRED["knock"].limit
    sure = math.isnan(error) or abs(value - limit) > error
    word = "may knock" if not sure else "knocks" if value > limit else "does not knock"
    return f"{word} (limit {limit:g})"


def series_errors(found: "JobReport") -> list[Line]:
    """Return how far time series may be from the exact ones, a line for each joint."""
    lines = []
    for row in map(metrics.series_error, metrics.SERIES):
        for place, label in places(row):
            error = pick_value(found.numbers[row.name], place)
            if not (math.isnan(error) or tells_nothing(found, row, place)):
                lines.append((label, UNKNOWN if math.isinf(error) else f"{error:.2g}"))
    return lines


def bar_of(found: "JobReport", name: str) -> tuple[Any, bool, str]:
    """Return the errors of a number, whether they are relative, and what kind they are.

    None in place of errors where there are none.
    """
    if name in metrics.BARRED:
        return found.numbers.get(f"{name}_error"), metrics.BARRED[name].bar.relative, ""
    return found.numbers.get(name + SPREAD), True, "(standard error)"


def unit_of(row: metrics.Metric, units: Units) -> tuple[str, float]:
    """Return the unit in which a number is shown, as the report does, and its factor from SI."""
    if row.name.endswith(("_fraction", "_share")):
        return "%", 100.0
    if row.shown and row.unit != "1":
        unit, factor = row.shown.unit, row.shown.factor
    else:
        unit, factor = UNITS.get(row.unit, (row.unit, 1.0))
    unit, more = unit_in(unit, units)
    return unit, factor * more


def places(row: metrics.Metric) -> Iterator[tuple[tuple[int, ...], str]]:
    """Yield the place and label of each of a number's values: `peak contact force, big end`.

    The error of a series is called after the series.
    """
    words: dict[str, tuple[Any, ...]] = {
        "joint": metrics.JOINTS,
        "axis": metrics.AXES,
        "quantile": metrics.QUANTILES,
        "segment": tuple(f"{at:g} to {at + 10:g} deg" for at in metrics.SEGMENTS),
        "threshold": metrics.THRESHOLDS,
    }
    first = row.name.removesuffix("_error")
    first = LABELS.get(first, first.removesuffix("_rev").removesuffix("_per").replace("_", " "))
    for choice in itertools.product(*(enumerate(words[dim]) for dim in row.dims)):
        parts = [first, *(str(word).replace("_", " ") for _, word in choice)]
        yield tuple(number for number, _ in choice), ", ".join(parts)


def pick_value(values: Any, place: tuple[int, ...]) -> float:
    """Return one of a number's values."""
    for number in place:
        values = values[number]
    return float(values)


def tells_nothing(found: "JobReport", row: metrics.Metric, place: tuple[int, ...]) -> bool:
    """Return whether a number is that of the contact in a joint that has no clearance."""
    return row.contact and found.case.joint not in (metrics.JOINTS[place[0]], "both")


def format_measured(value: float, error: float, relative: bool) -> str:
    """Return a number with its error, by the digits that it allows; six digits without one."""
    return f"{value:.6g}" if math.isnan(error) else by_bar(value, error, relative)


def reversal_verdict(found: "JobReport", degrees: float, percent: float) -> list[Line]:
    """Return whether the rod load changes sides for long and far enough; [] without signals."""
    worst, texts = math.inf, []
    for name, unit, least in (("angle", math.degrees(1.0), degrees), ("share", 100.0, percent)):
        value = unit * found.numbers.get(f"rod_load_reversal_{name}", math.nan)
        bar = unit * found.numbers.get(f"rod_load_reversal_{name}_error", math.nan)
        if math.isnan(value):
            return []
        if math.isinf(bar):
            return [("rod load", "its reversal is not known well enough to be judged")]
        bar = 0.0 if math.isnan(bar) else bar
        texts.append(format_measured(value, bar, True) if bar else f"{value:.4g}")
        clear = value - least
        worst = min(worst, clear / abs(clear) if abs(clear) >= bar and clear else 0.0)
    word = {1.0: "passes", 0.0: "cannot be distinguished from", -1.0: "fails"}[worst]
    kind = "API 618's" if (degrees, percent) == (15.0, 3.0) else "the maker's"
    verdict = f"reversal of {texts[0]} degrees and {texts[1]} %: {word} {kind} "
    return [("rod load", f"{verdict}{degrees:g} degrees and {percent:g} %")]


def film(found: "JobReport") -> list[str]:
    """Return how contact forces and counts are meant of a job that has oil."""
    if not found.case.lubricant:
        return []
    return [
        "contact forces include the force of the oil film",
        "where the film takes a blow there is no dry contact: knock tells whether a joint knocks",
    ]


def cautions(found: "JobReport") -> list[str]:
    """Return how far the numbers may be trusted, where their errors do not say it."""
    if found.attributes.get("regime") == "undecided":
        return ["errors are as large as numbers, and chaos could not be ruled out in the time that "
                "was spent: ask by solve.horizon: true"]  # fmt: skip
    if found.attributes.get("regime") != "chaotic":
        return []
    lines = ["the motion is chaotic: averages may be trusted, single peaks may not"]
    wanted = found.numbers.get("revolutions_to_one_percent", math.nan)
    if math.isfinite(wanted):
        lines.append(f"{wanted:.0f} settled revolutions would bring the standard error of "
                     "rms_acceleration to 1 %")  # fmt: skip
    return lines


def machine(found: "JobReport", units: Units) -> list[Line]:
    """Return what the job's machine has without clearance: gas load, inertia, rod load and more."""
    from compressor.analysis import describe_cases

    return describe_cases([found.case]).lines(units) if "case" in found.attributes else []


def facts(found: "JobReport") -> list[Line]:
    """Return how a job was run, a line each."""
    from compressor.outcome import regime_words

    texts = {name: str(found.attributes[name]) for name in FACTS if name in found.attributes}
    lines = [(name, regime_words(text) if name == "regime" else text)
             for name, text in texts.items()]  # fmt: skip
    lines += worn_joints(found)
    return [*lines, ("file", os.path.relpath(found.file))] if found.file else lines


def worn_joints(found: "JobReport") -> list[Line]:
    """Return which joints count as worn; [] where the case names no healthy clearance."""
    case = found.case
    sizes = [
        f"{joint.replace('_', ' ')} {getattr(case.clearance_mm, joint):g} of up to {healthy:g} mm"
        for joint in metrics.JOINTS
        if (healthy := getattr(case.healthy_clearance_mm, joint)) > 0.0
    ]
    worn = case.worn_joint.replace("_", " ")
    return [("worn", f"{worn} (healthy: {', '.join(sizes)})")] if sizes else []

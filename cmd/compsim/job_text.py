"""What is known of one job, line by line: numbers with names, units and their error bars."""

import itertools
import math
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from compressor import metrics
from compressor.digits import ROUNDING, UNKNOWN, align_columns, by_bar
from compressor.outcome import regime_words
from compressor.units import Units, unit_in

if TYPE_CHECKING:
    from compressor.store import JobReport

Line = tuple[str, str]  # a label and what stands beside it

WIDTH = 37  # columns of a label, or more where one is longer
SPREAD = "_standard_error"
# unit in SI -> the unit of case files and of the report, and its factor
UNITS = {"m/s2": ("m/s²", 1.0), "N": ("kN", 1e-3), "m": ("mm", 1e3), "1": ("", 1.0)}
UNITS["rad"] = "deg", math.degrees(1.0)
LABELS = {  # of others than their names
    "contact_loss_fraction": "time without dry contact",
    "impacts_per_rev": "dry contacts after flight",
}
WORDS = {  # dimension -> what its places are called
    "joint": metrics.JOINTS,
    "axis": metrics.AXES,
    "quantile": metrics.QUANTILES,
    "segment": [f"{at:g} to {at + 10:g} deg" for at in metrics.SEGMENTS],
    "threshold": metrics.THRESHOLDS,
}
FACTS = ("promise", "regime", "method", "rtol", "program", "libraries")


def sections(found: "JobReport", units: Units = "usual") -> Iterator[tuple[str, list[str]]]:
    """Yield the headings and lines of a job; units: of the numbers."""
    attributes = found.attributes
    if "stop_time" in attributes:
        angle = math.degrees(attributes["stop_crank_angle"]) % 360
        where = f"at {attributes['stop_time']:.9g} s, {angle:.5g} degrees of crank angle"
        yield "", align([("stopped", where)])
    known = [*numbers(found, units, "tally", "statistics", "body")]
    lines = align([*known, *reversal_verdict(found)])
    yield "metrics, with their error bars", [*lines, *notes(found), *found.caveats]
    yield "relative errors of the time series", align(series_errors(found))
    yield "the run", align([*numbers(found, units, "run"), *facts(found)])


def align(lines: list[Line]) -> list[str]:
    """Return labels and values in columns."""
    return align_columns([(f"{label:<{WIDTH}}", text) for label, text in lines])


def numbers(found: "JobReport", units: Units, *sources: str) -> Iterator[Line]:
    """Yield a line for each number of some sources, joint and axis, to its known digits."""
    for name, row in metrics.NUMBERS.items():
        if name in found.numbers and row.source in sources:
            # a count grows with the run: the number per revolution is shown
            if row.kind == "count" or name.endswith(SPREAD):
                continue
            yield from values_of(found, row, units)


def values_of(found: "JobReport", row: metrics.Metric, units: Units) -> Iterator[Line]:
    """Yield a line for each value of a number; of a revolution's segments for the highest."""
    values = np.asarray(found.numbers[row.name], float)
    if row.name in metrics.BARRED:
        bars, relative, kind = "_error", metrics.BARRED[row.name].bar.relative, ""
    else:
        bars, relative, kind = SPREAD, True, " (standard error)"
    errors = np.asarray(found.numbers.get(row.name + bars, values * math.nan), float)
    unit, factor = unit_of(row, units)
    greatest = max((abs(one) for one in values.flat if not math.isnan(one)), default=0.0)
    for place, label in places(found, row):
        value, error = float(values[place]), float(errors[place])
        if math.isnan(value) or ("segment" in row.dims and value < greatest):
            continue
        if abs(value) < ROUNDING * greatest:  # beside the other joint or axis
            value = error = 0.0
        # a pull of 0 is known, where the rod load keeps to the other side
        text = by_bar(value * factor, error * factor, relative and value != 0.0)
        if text != UNKNOWN:
            text = f"{text} {unit}".rstrip() + ("" if math.isnan(error) else kind)
            verdict = f", {knock_verdict(value, error)}" if row.name == "knock" else ""
            yield label, text + verdict
        elif not kind:  # of the statistics of a chaotic motion only those that are known
            yield label, text


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
        errors = np.asarray(found.numbers[row.name])
        for place, label in places(found, row):
            if not math.isnan(errors[place]):
                known = math.isfinite(errors[place])
                lines.append((label, f"{errors[place]:.2g}" if known else UNKNOWN))
    return lines


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


def places(found: "JobReport", row: metrics.Metric) -> Iterator[tuple[tuple[int, ...], str]]:
    """Yield the place and label of each of a number's values: `peak contact force, big end`.

    The error of a series is called after the series. A contact's numbers are left out at a joint
    that has no clearance.
    """
    first = row.name.removesuffix("_error")
    first = LABELS.get(first, first.removesuffix("_rev").removesuffix("_per").replace("_", " "))
    for choice in itertools.product(*(enumerate(WORDS[dim]) for dim in row.dims)):
        if row.contact and found.case.joint not in (choice[0][1], "both"):
            continue
        parts = [first, *(str(word).replace("_", " ") for _, word in choice)]
        yield tuple(number for number, _ in choice), ", ".join(parts)


def reversal_verdict(found: "JobReport") -> list[Line]:
    """Return whether the rod load changes sides as API 618 requires; [] without signals."""
    worst, texts = math.inf, []
    for name, unit, least in (("angle", math.degrees(1.0), 15.0), ("share", 100.0, 3.0)):
        value = unit * found.numbers.get(f"rod_load_reversal_{name}", math.nan)
        bar = unit * found.numbers.get(f"rod_load_reversal_{name}_error", math.nan)
        if math.isnan(value):
            return []
        if math.isinf(bar):
            return [("rod load", "its reversal is not known well enough to be judged")]
        bar = 0.0 if math.isnan(bar) else bar
        texts.append(by_bar(value, bar, relative=False) if bar else f"{value:.4g}")
        clear = value - least
        worst = min(worst, math.copysign(1.0, clear) if clear and abs(clear) >= bar else 0.0)
    word = {1.0: "passes", 0.0: "cannot be distinguished from", -1.0: "fails"}[worst]
    verdict = f"reversal of {texts[0]} degrees and {texts[1]} %: {word} API 618's"
    return [("rod load", f"{verdict} 15 degrees and 3 %")]


def notes(found: "JobReport") -> Iterator[str]:
    """Yield how forces and counts are meant of a job that has oil, and how far to trust numbers."""
    if found.case.lubricant:
        yield "contact forces include the force of the oil film"
        yield "an impact that the film cushions is no dry contact: see knock"
    regime = found.attributes.get("regime")
    if regime == "undecided":
        is_asked = found.case.solve.horizon is True
        remedy = "raise solve.max_steps or timeout_s" if is_asked else "ask by solve.horizon: true"
        yield (
            "errors are as large as numbers, and chaos could not be ruled out in the time that was "
            f"spent: {remedy}"
        )
    if regime == "chaotic":
        yield "the motion is chaotic: averages may be trusted, single peaks may not"
        wanted = found.numbers.get("revolutions_to_one_percent", math.nan)
        if math.isfinite(wanted):
            yield (
                f"{wanted:.0f} settled revolutions would bring the standard error of "
                "rms_acceleration to 1 %"
            )


def facts(found: "JobReport") -> list[Line]:
    """Return how a job was run, which joints count as worn, and its file, a line each."""
    lines = []
    for name in FACTS:
        if name in found.attributes:
            text = str(found.attributes[name])
            lines.append((name, regime_words(text) if name == "regime" else text))
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

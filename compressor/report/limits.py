"""Limits of metrics that a user gives: zones A, B and so on, as evaluation standards have them.

No limit is ours: those of a standard, a maker or a contract are the user's to give, with a unit. A
value whose error bar holds a limit is in either of both zones.
"""

import itertools
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from compressor.metrics import BARRED
from compressor.program import CompsimError, did_you_mean
from compressor.report.figures.sweep_data import MEASURES, Measure
from compressor.units import Units, read_quantity, split_number

MAX_LIMITS = 3  # of a metric: zones A to D, as of ISO 20816-1
ZONES = "ABCD"
TEXT = re.compile(r"\s*(\w+)\s*=\s*([^=]*[^=\s])\s*")
WITHOUT_UNIT = ("", "per rev")
MORE_IS_BETTER = ("rod_load_reversal_angle",)  # A would be the worst zone


class LimitError(CompsimError, ValueError):
    """Limits that cannot be used: what is wrong with them and what to write."""


@dataclass(frozen=True)
class Limits:
    """Rising limits by metric, in SI; units: of the page that shows them."""

    by_metric: Mapping[str, tuple[float, ...]]
    units: Units = "usual"

    def of(self, measure: Measure) -> tuple[float, ...]:
        """Return the limits of a measure in its unit; () without any."""
        return tuple(measure.factor * one for one in self.by_metric.get(measure.variable, ()))

    def zone(self, measure: Measure, value: float, bar: float) -> str:
        """Return the zone of a value with its error bar, in the measure's unit, such as B.

        A value on a limit is in the zone above it; A/B: the error bar holds their limit. "" without
        limits, without a value, and where the bar is not known.
        """
        limits = self.of(measure)
        if not limits or math.isnan(value) or math.isinf(bar):
            return ""
        bar = 0.0 if math.isnan(bar) else bar
        ends = (sum(end >= one for one in limits) for end in (value - bar, value + bar))
        return "/".join(dict.fromkeys(ZONES[end] for end in ends))

    def words(self, shown: Iterable[Measure]) -> list[str]:
        """Return a sentence on the zones of each metric that is shown."""
        sentences, variables = [], {measure.variable for measure in shown}
        for name in filter(variables.__contains__, self.by_metric):
            one = shown_measure(name, self.units)
            title, unit = one.title.partition(",")[0], f" {one.unit}" if one.unit else ""
            texts = [f"{limit:g}{unit}" for limit in self.of(one)]
            ends = [f"{ZONES[0]} below {texts[0]}"]
            ends += [f"{ZONES[n]} from {text} on" for n, text in enumerate(texts, 1)]
            sentences.append(f"Zones of {title}, by limits that were given: {', '.join(ends)}.")
        return sentences


NO_LIMITS = Limits({})


def shown_measure(metric: str, units: Units) -> Measure:
    """Return a metric as a page in these units shows it; of joints or axes the first."""
    return next(one.read_in(units) for one in MEASURES if one.variable == metric)


def read_limits(texts: Iterable[str], units: Units = "usual") -> Limits:
    """Return limits of texts such as `sensor_peak=0.2,0.5 g`, whose unit stands behind the last.

    units: of the page. Raises LimitError with what to write, in the unit that the page shows.
    """
    found: dict[str, tuple[float, ...]] = {}
    known = dict.fromkeys(one.variable for one in MEASURES)
    for text in texts:
        parts = TEXT.fullmatch(text)
        if parts is None or parts[1] not in known:
            hint = did_you_mean(parts[1], known) if parts else ""
            near = hint or f"there are {', '.join(known)}"
            raise LimitError(f"{text!r} is no limit: write METRIC=VALUE,... and the unit, such as "
                             f"'sensor_peak=20,50 m/s²'; {near}")  # fmt: skip
        if parts[1] in MORE_IS_BETTER:
            raise LimitError(f"{text!r}: more reversal is better, and zone A is below a limit; "
                             "compsim show JOB judges it")  # fmt: skip
        if parts[1] in found:
            raise LimitError(f"{text!r}: {parts[1]} has limits already")
        found[parts[1]] = read_values(parts[2], shown_measure(parts[1], units), text)
    return Limits(found, units)


def read_values(values: str, measure: Measure, text: str) -> tuple[float, ...]:
    """Return the limits of a measure in SI from their part of a text. Raises LimitError."""
    parts = [split_number(one) for one in values.split(",")]
    unit = parts[-1][1]
    if any(number is None for number, _ in parts):
        raise LimitError(f"{text!r}: limits are numbers with commas between them, and a unit")
    if not unit and measure.unit not in WITHOUT_UNIT:
        raise LimitError(f"{text!r} has no unit: write '{measure.variable}={values} "
                         f"{measure.unit}', as the page shows it")  # fmt: skip
    found = []
    for number, own in parts:
        try:
            value = read_quantity(f"{number} {own or unit}", BARRED[measure.variable].unit)
        except ValueError as error:
            raise LimitError(f"{text!r}: {error}") from None
        found += [] if value is None else [value]
    if len(found) > MAX_LIMITS or any(low >= high for low, high in itertools.pairwise(found)):
        raise LimitError(f"{text!r}: give one to {MAX_LIMITS} numbers, each above the last")
    return tuple(found)

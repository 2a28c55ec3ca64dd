"""Limits of metrics that a user gives: zones A, B and so on, as evaluation standards have them.

No limit is ours: those of a standard, a maker or a contract are the user's to give. A value whose
error bar holds a limit is in either of both zones.
"""

import itertools
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from compressor.program import CompsimError, did_you_mean
from compressor.report.figures.sweep_data import MEASURES, Measure

MAX_LIMITS = 3  # of a metric: zones A to D, as of ISO 20816-1
ZONES = "ABCD"
# units as the report shows metrics -> how they end the name of a limit
ENDINGS = {
    "m/s²": "_m_per_s2", "mm/s": "_mm_per_s", "kN": "_kN", "µm": "_um", "%": "_percent",
    "ms": "_ms", "°": "_deg", "per rev": "", "": "",
}  # fmt: skip
TEXT = re.compile(r"\s*(\w+)\s*=\s*([^=]+)")


class LimitError(CompsimError, ValueError):
    """Limits that cannot be used: what is wrong with them and what to write."""

    exit_code = 2


@dataclass(frozen=True)
class Zone:
    """A zone: `name`, such as B, or A/B where the error bar holds a limit; `number`: the worse."""

    name: str
    number: int


@dataclass(frozen=True)
class Limits:
    """Rising limits by metric, in the unit that the report shows it in without a choice."""

    by_metric: Mapping[str, tuple[float, ...]]

    def of(self, measure: Measure) -> tuple[float, ...]:
        """Return the limits of a measure in its unit; () without any."""
        limits = self.by_metric.get(measure.variable, ())
        if not limits:
            return ()
        usual = next(one for one in MEASURES if one.variable == measure.variable)
        return tuple(limit * measure.factor / usual.factor for limit in limits)

    def zone(self, measure: Measure, value: float, bar: float) -> Zone | None:
        """Return the zone of a value with its error bar, in the measure's unit.

        A value on a limit is in the zone above it. None without limits, without a value, and where
        the bar is not known.
        """
        limits = self.of(measure)
        if not limits or math.isnan(value) or math.isinf(bar):
            return None
        bar = 0.0 if math.isnan(bar) else bar
        low, high = (sum(end >= one for one in limits) for end in (value - bar, value + bar))
        return Zone(ZONES[low] + (f"/{ZONES[high]}" if high > low else ""), high)

    @property
    def words(self) -> list[str]:
        """Return a sentence on each metric's zones."""
        sentences = []
        for name, limits in self.by_metric.items():
            one = next(measure for measure in MEASURES if measure.variable == name)
            title, unit = one.title.partition(",")[0], f" {one.unit}" if one.unit else ""
            ends = [f"{ZONES[0]} below {limits[0]:g}{unit}"]
            ends += [f"{ZONES[n]} from {limit:g}{unit} on" for n, limit in enumerate(limits, 1)]
            sentences.append(f"Zones of {title}, by limits that were given: {', '.join(ends)}.")
        return sentences


NO_LIMITS = Limits({})


def limit_names() -> dict[str, str]:
    """Return the metrics that the report shows, by the names of their limits."""
    return {one.variable + ENDINGS[one.unit]: one.variable for one in MEASURES}


def read_limits(texts: Iterable[str]) -> Limits:
    """Return limits of texts such as `body_velocity_rms_mm_per_s=2.8,4.5`. Raises LimitError."""
    found: dict[str, tuple[float, ...]] = {}
    names = limit_names()
    for text in texts:
        parts = TEXT.fullmatch(text)
        if parts is None or parts[1] not in names:
            hint = did_you_mean(parts[1], names) if parts else ""
            listed = f"there are {', '.join(names)}"
            raise LimitError(f"{text!r} is no limit: write NAME=VALUE,...; {hint or listed}")
        try:
            limits = tuple(float(one) for one in parts[2].split(","))
        except ValueError:
            raise LimitError(f"{text!r}: limits are numbers, with commas between them") from None
        rising = all(low < high for low, high in itertools.pairwise(limits))
        if len(limits) > MAX_LIMITS or not rising or not all(map(math.isfinite, limits)):
            raise LimitError(f"{text!r}: give one to {MAX_LIMITS} numbers, each above the last")
        if names[parts[1]] in found:
            raise LimitError(f"{text!r}: {parts[1]} has limits already")
        found[names[parts[1]]] = limits
    return Limits(found)

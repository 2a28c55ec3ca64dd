"""How far a claim's measure lies from its threshold, with what its error bars allow.

A margin is relative to the threshold: 0 at it, positive where the claim holds, 0.1 where the
measure could change by a tenth of the threshold. That of a difference of shares is in the shares'
own unit.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from compressor.analysis.runs import settled
from compressor.solve import mean_bar, sure


class Measure(NamedTuple):
    """A number and its absolute error: nan where no error is known, as of runs without bars."""

    value: float
    error: float = 0.0

    def over(self, other: "Measure") -> "Measure":
        """Return the ratio of two measures; relative errors add, as errors of one model may."""
        ratio = self.value / other.value if other.value else math.inf
        away = self.error / abs(self.value) if self.value else 0.0
        return Measure(ratio, ratio * (away + other.error / abs(other.value or math.inf)))


class Margin(NamedTuple):
    """How far a measure is on the right side of its threshold, over the threshold."""

    value: float
    error: float

    @property
    def clear(self) -> bool:
        """Whether it is known on which side of the threshold the measure lies."""
        return abs(self.value) > self.error

    @property
    def said(self) -> str:
        """The margin in words, in percent of the threshold."""
        bar = "no error bar" if math.isnan(self.error) else f"± {100 * self.error:.2g} %"
        doubt = "" if self.clear or math.isnan(self.error) else ", undecided"
        return f"{100 * self.value:+.3g} % ({bar}{doubt})"


def at_least(measure: Measure, threshold: float) -> Margin:
    """Return the margin of a measure that is to be at least a threshold."""
    return Margin(measure.value / threshold - 1.0, measure.error / threshold)


def above(measure: Measure, threshold: float) -> Margin:
    """Return the margin of a measure that is to exceed a threshold: of a tie it is below zero."""
    margin = at_least(measure, threshold)
    return margin._replace(value=math.nextafter(0.0, -1.0)) if margin.value == 0.0 else margin


def at_most(measure: Measure, threshold: float) -> Margin:
    """Return the margin of a measure that is to be at most a threshold."""
    return Margin(1.0 - measure.value / threshold, measure.error / threshold)


def least(margins: Sequence[Margin]) -> Margin:
    """Return the smallest margin: of a claim that asks for all of them.

    Its error reaches to the lowest that any of them may be, so that a larger margin with a long
    error bar counts, too. nan where any error is not known.
    """
    smallest = min(margin.value for margin in margins)
    lowest = min(margin.value - margin.error for margin in margins)
    unknown = any(math.isnan(margin.error) for margin in margins)
    return Margin(smallest, math.nan if unknown else smallest - lowest)


def exceeds(one: Measure, other: Measure, by: float) -> Margin:
    """Return the margin, in the measures' own unit, of a measure that is to exceed another one
    by this.
    """
    return Margin(one.value - other.value - by, one.error + other.error)


def is_chaotic(run: xr.Dataset) -> bool:
    """Return whether the course of a run's motion cannot be foretold, so that averages alone
    count.
    """
    return run.attrs.get("regime") == "chaotic"


def revolutions(run: xr.Dataset) -> Iterator[xr.Dataset]:
    """Yield the whole settled revolutions of a run, both ends included."""
    kept = settled(run)
    turns = (kept["crank_angle"].values - kept["crank_angle"].values[0]) / (2.0 * math.pi)
    for number in range(int(turns[-1] + 1e-6)):
        inside = (turns >= number - 1e-6) & (turns <= number + 1 + 1e-6)
        yield kept.isel(time=inside)


def by_revolution(run: xr.Dataset, value: Callable[[xr.Dataset], float]) -> float:
    """Return half of the 95 % interval of a value's mean over revolutions, by their scatter.

    inf of a single revolution.
    """
    return mean_bar(np.array([value(turn) for turn in revolutions(run)]))


def measured(run: xr.Dataset, value: Callable[[xr.Dataset], float], error: float) -> Measure:
    """Return a value of a run's settled part with an error; of a chaotic run by its revolutions."""
    kept = settled(run)
    return Measure(value(kept), by_revolution(kept, value) if is_chaotic(run) else error)


def peak(run: xr.Dataset, name: str, **where: str) -> Measure:
    """Return a greatest value of a run with its error bar; where: its joint.

    Of a chaotic run the mean over revolutions of each one's greatest value, since that of the whole
    run grows with its length.
    """
    if not is_chaotic(run):
        return metric(run, name, **where)
    value, error = (
        float(run[n].sel(where)) for n in (f"{name}_mean", f"{name}_mean_standard_error")
    )
    return Measure(value, float(sure(np.array(error), int(run["revolutions"]))))


def metric(run: xr.Dataset, name: str, **where: str) -> Measure:
    """Return a metric of a run with its error bar; where: its joint and axis."""
    value, error = (float(run[n].sel(where)) for n in (name, f"{name}_error"))
    return Measure(value, error)


def series_error(run: xr.Dataset, name: str, values: np.ndarray, **where: str) -> float:
    """Return the rms of the error of a settled time series, in its unit: its relative one times its
    rms.

    values: the settled series, of vectors by component; where: its joint.
    """
    share = float(run[f"{name}_error"].sel(where))
    size = values**2 if values.ndim == 1 else (values**2).sum(axis=-1)
    return share * math.sqrt(float(np.mean(size)))

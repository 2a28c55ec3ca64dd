"""How far a claim's measure lies from its threshold, and how continuously a joint hits.

A margin is relative to the threshold: 0 at it, positive where the claim holds, 0.1 where the
measure could change by a tenth of the threshold. That of a difference of shares is in the shares'
own unit.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from compressor.analysis.contacts import FOLLOWING, contact_series, impacts_of, modes_of
from compressor.analysis.runs import settled_part
from compressor.analysis.shaking import whole_revolutions
from compressor.solve import average_bar, mean_bar

if TYPE_CHECKING:
    import xarray as xr


class BarredNumber(NamedTuple):
    """A number and its absolute error: nan where no error is known, as of runs without bars."""

    value: float
    error: float = 0.0

    def over(self, other: "BarredNumber") -> "BarredNumber":
        """Return the ratio of two measures; relative errors add, as errors of one model may."""
        ratio = self.value / other.value if other.value else math.inf
        own_error = self.error / abs(self.value) if self.value else 0.0
        return BarredNumber(ratio, ratio * (own_error + other.error / abs(other.value or math.inf)))


class Margin(NamedTuple):
    """How far a measure is on the right side of its threshold, over the threshold."""

    value: float
    error: float

    @property
    def clear(self) -> bool:
        """Return whether it is known on which side of the threshold the measure lies."""
        return abs(self.value) > self.error

    @property
    def said(self) -> str:
        """Return the margin in words, in percent of the threshold."""
        if self.error == 0.0 and self.clear:
            return f"{100 * self.value:+.3g} %"
        bar = "no error bar" if math.isnan(self.error) else f"± {100 * self.error:.2g} %"
        doubt = "" if self.clear or math.isnan(self.error) else ", undecided"
        return f"{100 * self.value:+.3g} % ({bar}{doubt})"


def at_least(measure: BarredNumber, threshold: float) -> Margin:
    """Return the margin of a measure that is to be at least a threshold."""
    return Margin(measure.value / threshold - 1.0, measure.error / threshold)


def above(measure: BarredNumber, threshold: float) -> Margin:
    """Return the margin of a measure that is to exceed a threshold: of a tie it is below zero."""
    margin = at_least(measure, threshold)
    return margin._replace(value=math.nextafter(0.0, -1.0)) if margin.value == 0.0 else margin


def at_most(measure: BarredNumber, threshold: float) -> Margin:
    """Return the margin of a measure that is to be at most a threshold."""
    return Margin(1.0 - measure.value / threshold, measure.error / threshold)


def least(margins: Sequence[Margin]) -> Margin:
    """Return the smallest margin: of a claim that requires all of them.

    Its error reaches to the lowest that any of them may be, so that a larger margin with a long
    error bar counts, too. nan where any error is not known.
    """
    smallest = min(margin.value for margin in margins)
    lowest = min(margin.value - margin.error for margin in margins)
    unknown = any(math.isnan(margin.error) for margin in margins)
    return Margin(smallest, math.nan if unknown else smallest - lowest)


def exceeds(one: BarredNumber, other: BarredNumber, by: float) -> Margin:
    """Return the margin by which a measure exceeds another by more than `by`, in its unit."""
    return Margin(one.value - other.value - by, one.error + other.error)


def is_chaotic(run: "xr.Dataset") -> bool:
    """Return whether a run's motion cannot be foretold, so that only averages count."""
    return run.attrs.get("regime") == "chaotic"


def revolutions(run: "xr.Dataset") -> "Iterator[xr.Dataset]":
    """Yield the whole settled revolutions of a run, both ends included."""
    settled = settled_part(run)
    turns = (settled["crank_angle"].values - settled["crank_angle"].values[0]) / (2.0 * math.pi)
    for number in range(int(turns[-1] + 1e-6)):
        inside = (turns >= number - 1e-6) & (turns <= number + 1 + 1e-6)
        yield settled.isel(time=inside)


def measure(
    run: "xr.Dataset", value: "Callable[[xr.Dataset], float]", error: float
) -> BarredNumber:
    """Return a value of a run's settled part with an error.

    Of a chaotic run half of the 95 % interval of its revolutions' mean, inf of too few.
    """
    settled = settled_part(run)
    if is_chaotic(run):
        error = mean_bar(np.array([value(turn) for turn in revolutions(settled)]))
    return BarredNumber(value(settled), error)


def peak(run: "xr.Dataset", name: str, **where: str) -> BarredNumber:
    """Return a greatest value of a run with its error bar; where: its joint.

    Of a chaotic run it is `mean_peak`, since that of the whole run grows with its length.
    """
    return mean_peak(run, name, **where) if is_chaotic(run) else metric(run, name, **where)


def mean_peak(run: "xr.Dataset", name: str, **where: str) -> BarredNumber:
    """Return a chaotic run's mean over revolutions of each one's peak; where: its joint."""
    value, error = (
        float(run[n].sel(where)) for n in (f"{name}_mean", f"{name}_mean_standard_error")
    )
    return BarredNumber(value, float(average_bar(np.array(error), int(run["revolutions"]))))


def metric(run: "xr.Dataset", name: str, **where: str) -> BarredNumber:
    """Return a metric of a run with its error bar; where: its joint and axis."""
    value, error = (float(run[n].sel(where)) for n in (name, f"{name}_error"))
    return BarredNumber(value, error)


def series_error(run: "xr.Dataset", name: str, values: np.ndarray, **where: str) -> float:
    """Return the rms error of a settled time series, in its unit.

    It is the stored relative error times the rms of the series.

    values: the settled series, of vectors by component; where: its joint.
    """
    share = float(run[f"{name}_error"].sel(where))
    size = values**2 if values.ndim == 1 else (values**2).sum(axis=-1)
    return share * math.sqrt(float(np.mean(size)))


def share_apart(run: "xr.Dataset", joint: str) -> BarredNumber:
    """Return the share of crank angle in which a joint with clearance is in flight or impact.

    Over settled whole revolutions, see `modes_of`. Its error is the bar of the share of time
    without contact, and two samples for each impact. Raises NoSeriesError where there are none.
    """
    settled, _ = whole_revolutions(run)

    def look(part: "xr.Dataset") -> tuple[float, int]:
        series = contact_series(part, joint)
        struck = impacts_of(part, series)
        return float((modes_of(series, struck)[:-1] != FOLLOWING).mean()), len(struck)

    if is_chaotic(run):
        return measure(settled, lambda part: look(part)[0], math.nan)
    share, count = look(settled)
    error = float(settled["contact_loss_fraction_error"].sel(joint=joint))
    return BarredNumber(share, error + 2.0 * count / (settled.sizes["time"] - 1))

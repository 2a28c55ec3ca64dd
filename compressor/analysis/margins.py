"""How far a claim's measure lies from its threshold, and how continuously a joint hits.

A margin is relative to the threshold: 0 at it, positive where the claim holds, 0.1 where the
measure could change by a tenth of the threshold. That of a difference of shares is in the shares'
own unit.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from compressor.analysis.contacts import (
    FOLLOWING,
    ContactSeries,
    Impact,
    contact_series,
    impacts_of,
    modes_of,
)
from compressor.analysis.runs import settled_part
from compressor.analysis.shaking import ORDER, evenly, whole_revolutions
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


def by_revolution(run: "xr.Dataset", value: "Callable[[xr.Dataset], float]") -> float:
    """Return half of the 95 % interval of a value's mean over revolutions; inf of too few."""
    return mean_bar(np.array([value(turn) for turn in revolutions(run)]))


def measure(
    run: "xr.Dataset", value: "Callable[[xr.Dataset], float]", error: float
) -> BarredNumber:
    """Return a value of a run's settled part with an error; of a chaotic run by its revolutions."""
    settled = settled_part(run)
    return BarredNumber(value(settled), by_revolution(settled, value) if is_chaotic(run) else error)


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


WINDOW = 10.0  # degrees of crank angle that count as hit by one impact or more
SLOWEST = 0.01  # m/s: approach speed from which on a contact after flight counts as an impact
ENERGY = 0.9  # share of the energy whose angle is reported


class Shares(NamedTuple):
    """How a joint's contact is spread over whole revolutions: shares, 0 to 1, with their errors.

    `apart`: of crank angle in flight or impact (`modes_of`). `hit`: of windows of `WINDOW`
    degrees that an impact faster than `SLOWEST` falls into. `energy_angle`: of crank angle that
    holds `ENERGY` of the energy of the horizontal joint force above `ORDER`, large where it rings
    all around.
    """

    apart: BarredNumber
    hit: BarredNumber
    energy_angle: BarredNumber


class Evidence(NamedTuple):
    """What is looked at: a joint in whole revolutions of a run, its impacts and high force."""

    series: ContactSeries
    settled: "xr.Dataset"
    revolutions: int
    hits: list[Impact]
    high: np.ndarray  # (m,), N, along the cylinder, above `ORDER`


def evidence(run: "xr.Dataset", joint: str) -> Evidence:
    """Return the `Evidence` of a joint with clearance over settled whole revolutions of a run.

    Raises NoSeriesError where there is none.
    """
    from compressor.vibration import high_pass_orders

    settled, count = whole_revolutions(run)
    force = settled["contact_force"].sel(joint=joint, axis="x").values
    high = high_pass_orders(*evenly(settled, count, force), ORDER)
    series = contact_series(settled, joint)
    return Evidence(series, settled, count, impacts_of(settled, series), high)


def find_shares(by: Evidence) -> dict[str, float]:
    """Return the values of `Shares` by their names."""
    from compressor.vibration import energy_angle

    modes = modes_of(by.series, by.hits)
    return {
        "apart": float((modes[:-1] != FOLLOWING).mean()),
        "hit": hit_share(by.hits, by.revolutions),
        "energy_angle": energy_angle(by.high, ENERGY),
    }


def measure_shares(run: "xr.Dataset", joint: str) -> Shares:
    """Return the settled shares of a joint with clearance.

    The errors follow from the run's error bars. That of `apart` is the bar of the share of time
    without contact, and two samples for each impact. That of `hit` is a window for each impact that
    is within the velocity's error of `SLOWEST`, or within a sample of a window's edge. That of
    `energy_angle` is its change where the energy changes as much as the force's error allows. In a
    chaotic run all come from the scatter of its revolutions. Raises as `evidence`.
    """
    by = evidence(run, joint)
    found = find_shares(by)
    if is_chaotic(run):
        turns = [find_shares(evidence(turn, joint)) for turn in revolutions(by.settled)]
        errors = [mean_bar(np.array([turn[name] for turn in turns])) for name in found]
    else:
        errors = [apart_error(by), hit_error(by), angle_error(by)]
    return Shares(*map(BarredNumber, found.values(), errors))


def apart_error(by: Evidence) -> float:
    """Return the error of the share of crank angle in flight or impact."""
    stored_error = float(by.settled["contact_loss_fraction_error"].sel(joint=by.series.joint))
    return stored_error + 2.0 * len(by.hits) / (by.settled.sizes["time"] - 1)


def hit_error(by: Evidence) -> float:
    """Return the error of the share of windows that are hit."""
    speed = np.array([one.approach_speed for one in by.hits])
    angle = np.array([one.crank_angle for one in by.hits])
    doubt = series_error(by.settled, "velocity", by.settled["velocity"].values)
    if math.isnan(doubt):
        return math.nan
    sample = math.degrees(float(by.settled["crank_angle"][1] - by.settled["crank_angle"][0]))
    unsure = np.abs(angle - WINDOW * np.round(angle / WINDOW)) < sample
    unsure = (unsure & (speed > SLOWEST - doubt)) | (np.abs(speed - SLOWEST) < doubt)
    return float(unsure.sum()) * WINDOW / (360.0 * by.revolutions)


def angle_error(by: Evidence) -> float:
    """Return the error of the share of crank angle that holds `ENERGY` of the energy."""
    from compressor.vibration import energy_angle

    force = by.settled["contact_force"].sel(joint=by.series.joint).values
    error = series_error(by.settled, "contact_force", force, joint=by.series.joint)
    size = math.sqrt(float(np.mean(by.high**2)))
    if math.isnan(error) or not size:
        return error
    share_error = min(2.0 * error / size, 0.5 * ENERGY)
    shares = (ENERGY - share_error, ENERGY, min(ENERGY + share_error, 1.0))
    low, found, high = (energy_angle(by.high, share) for share in shares)
    return max(high - found, found - low)


def compare_shares(big: Shares, small: Shares) -> str:
    """Return the shares of a big end beside those of a small end, in words."""
    (apart, hit, angle), (small_apart, small_hit, small_angle) = (
        [one.value for one in shares] for shares in (big, small)
    )
    return (
        f"flight and impact {apart:.1%} and {small_apart:.1%} of the angle; "
        f"{WINDOW:g}° windows hit {hit:.1%} and {small_hit:.1%}; {ENERGY:.0%} of the energy of "
        f"F_x above order {ORDER} in {angle:.0%} and {small_angle:.0%} of the angle"
    )


def hit_share(hits: Sequence[Impact], revolutions: int) -> float:
    """Return the share of crank-angle windows (`WINDOW` degrees) that impacts fall into."""
    angles = (360.0 * one.revolution + one.crank_angle for one in hits
              if one.approach_speed > SLOWEST)  # fmt: skip
    return len({angle // WINDOW for angle in angles}) * WINDOW / (360.0 * revolutions)

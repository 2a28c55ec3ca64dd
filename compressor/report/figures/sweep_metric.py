"""The metrics of a study as reports show them, its swept axes, and marks of unfinished jobs."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from compressor.metrics import JOINTS, METRICS
from compressor.report.figures.style import RED

ALONE = {"linestyle": "none", "zorder": 4}
MARKS: dict[str, dict[str, Any]] = {
    "failed": {"marker": "x", "color": RED, "markersize": 7, "markeredgewidth": 1.8} | ALONE,
    "missing": {"marker": "o", "color": "#606060", "markersize": 6, "markerfacecolor": "none"}
    | ALONE,
}
NAMES = {"failed": "a job failed here", "missing": "a job was not run"}
FOOT = {"failed": 0.04, "missing": 0.11}  # height in a panel


@dataclass(frozen=True)
class Measure:
    """A stored metric as it is shown: unit, factor from SI, and the joint, "" where it has none."""

    variable: str
    title: str
    unit: str
    factor: float = 1.0
    joint: str = ""

    @property
    def is_relative(self) -> bool:
        """Whether its error bar is a part of it; that of a share or a count is in its own unit."""
        return METRICS[self.variable].bar.relative

    def of(self, data: xr.Dataset) -> xr.DataArray:
        """Return the metric of a job or of a study's jobs, in the unit; nan for contact in ideal
        joints.

        An ideal joint has a penetration of exactly 0.
        """
        return self.scaled(data, self.variable)

    def bar(self, data: xr.Dataset) -> xr.DataArray:
        """Return its error bar, as `of`; nan where there is none."""
        if f"{self.variable}_error" not in data:
            return self.of(data) * math.nan
        return self.scaled(data, f"{self.variable}_error")

    def scaled(self, data: xr.Dataset, name: str) -> xr.DataArray:
        """Return a variable of the metric in the measure's unit."""
        values = data[name]
        if METRICS[self.variable].contact:
            values = values.where(data["max_penetration"] != 0)
        return (values.sel(joint=self.joint, drop=True) if self.joint else values) * self.factor


def shown(name: str) -> Iterator[Measure]:
    """Yield a metric as the report draws it, if it does: of each joint apart."""
    metric = METRICS[name]
    if metric.shown and not metric.dims:
        yield Measure(name, *metric.shown)
    elif metric.shown:
        title, unit, factor = metric.shown
        for joint in JOINTS:
            yield Measure(name, f"{title}, {joint.replace('_', ' ')}", unit, factor, joint)


MEASURES = tuple(measure for name in METRICS for measure in shown(name))


def measures(data: xr.Dataset) -> list[Measure]:
    """Return the measures of which a dataset has any value."""
    there = (measure for measure in MEASURES if measure.variable in data)
    return [measure for measure in there if measure.of(data).notnull().any()]


def swept(study: xr.Dataset) -> list[str]:
    """Return the axes of a study that have more than one value; of a list of jobs, the
    coordinates.
    """
    if study["status"].dims != ("job",):
        return [str(dim) for dim in study["status"].dims if study.sizes[dim] > 1]
    columns = (str(n) for n, c in study.coords.items() if c.dims == ("job",) and n != "key")
    return [name for name in columns if len({*study[name].dropna("job").values.tolist()}) > 1]


def positions(data: xr.Dataset, axis: str) -> np.ndarray:
    """Return where the values of an axis stand: at their numbers, different words one after the
    other.
    """
    values = data[axis].values
    if values.dtype.kind in "fiu":
        return values.astype(float)
    places = {word: float(n) for n, word in enumerate(dict.fromkeys(values))}
    return np.array([places[word] for word in values])


def shown_value(value: Any) -> str:
    """Return a swept value in few characters."""
    return f"{value:g}" if isinstance(value, float | int | np.number) else str(value)

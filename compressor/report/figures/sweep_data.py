"""A study as its sweep is drawn: its metrics, its axes, and its jobs in a grid or a list."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from compressor.analysis import SPOKEN
from compressor.digits import ROUNDING
from compressor.metrics import AXES, BARRED, JOINTS
from compressor.report.figures.style import RED, mark
from compressor.units import Units, unit_in

MARKS = {
    "failed": mark(RED, "x-thin", 7, 4, edge_width=1.8),
    "missing": mark("#606060", "circle", 6, 4, is_hollow=True),
}
NAMES = {"failed": "a job failed here", "missing": "a job was not run"}
FOOT = {"failed": 0.04, "missing": 0.11}  # height in a panel


@dataclass(frozen=True)
class Measure:
    """A stored metric as it is shown: unit, factor from SI, joint and axis, "" without one."""

    variable: str
    title: str
    unit: str
    factor: float = 1.0
    joint: str = ""
    axis: str = ""

    def read_in(self, units: Units) -> "Measure":
        """Return the measure in chosen units."""
        unit, factor = unit_in(self.unit, units)
        return replace(self, unit=unit, factor=self.factor * factor)

    @property
    def is_relative(self) -> bool:
        """Return whether its error bar is a part of its value.

        The bar of a share or a count is in its own unit.
        """
        return BARRED[self.variable].bar.relative

    def of(self, data: xr.Dataset) -> np.ndarray:
        """Return the metric of a job, (), or of a study's jobs, in their shape, in the unit.

        Nan for contact in ideal joints, whose penetration is exactly 0.
        """
        return self.in_unit(data, self.variable)

    def bar(self, data: xr.Dataset) -> np.ndarray:
        """Return its error bar, as `of`; nan where there is none."""
        name = f"{self.variable}_error"
        return self.in_unit(data, name) if name in data else self.of(data) * math.nan

    def in_unit(self, data: xr.Dataset, name: str) -> np.ndarray:
        """Return a variable of the metric in the measure's unit.

        0 of a number that is rounding beside that of the other joint or axis.
        """
        found = data.variables[name]  # by numpy: xarray's own steps take ten times as long
        values = found.values
        if self.joint or self.axis:
            dim, parts = ("joint", JOINTS) if self.joint else ("axis", AXES)
            way, number = found.get_axis_num(dim), parts.index(self.joint or self.axis)
            sizes = abs(data.variables[self.variable].values)
            is_rounding = sizes.take(number, way) < ROUNDING * np.fmax.reduce(sizes, way)
            values = np.where(is_rounding, 0.0, values.take(number, way))
            if BARRED[self.variable].contact:
                depth = data.variables["max_penetration"].values.take(number, way)
                values = np.where(depth != 0, values, math.nan)
        return np.asarray(values * self.factor)


def shown_variables(name: str) -> Iterator[Measure]:
    """Yield a metric as the report draws it, if it does: of each joint, or axis, apart."""
    metric = BARRED[name]
    if metric.shown and not metric.dims:
        yield Measure(name, *metric.shown)
    elif metric.shown and metric.dims == ("axis",):
        title, unit, factor = metric.shown
        for axis in AXES:
            yield Measure(name, f"{title}, {axis}", unit, factor, axis=axis)
    elif metric.shown:
        title, unit, factor = metric.shown
        for joint in JOINTS:
            yield Measure(name, f"{title}, {joint.replace('_', ' ')}", unit, factor, joint)


MEASURES = tuple(measure for name in BARRED for measure in shown_variables(name))


def measures(data: xr.Dataset, units: Units = "usual") -> list[Measure]:
    """Return the measures that have any value in a dataset, in chosen units."""
    stored = (measure for measure in MEASURES if measure.variable in data)
    return [one.read_in(units) for one in stored if not np.isnan(one.of(data)).all()]


def swept_axes(study: xr.Dataset) -> list[str]:
    """Return the axes of a study that have more than one value.

    Of a list of jobs, the coordinates.
    """
    if study["status"].dims != ("job",):
        return [str(dim) for dim in study["status"].dims if study.sizes[dim] > 1]
    columns = (str(n) for n, c in study.coords.items() if c.dims == ("job",) and n != "key")
    return [name for name in columns if len({*study[name].dropna("job").values.tolist()}) > 1]


def swept_values(data: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the swept values of a study's jobs, in the order of its `status`, by coordinate."""
    status = data["status"]
    names = [str(n) for n, c in data.coords.items() if {*c.dims} <= {*status.dims} and n != "key"]
    return {
        name: data[name].broadcast_like(status).transpose(*status.dims).values.ravel()
        for name in names
    }


def positions(data: xr.Dataset, axis: str) -> np.ndarray:
    """Return the positions of an axis' values along it, as `PlottedAxis.places`."""
    return PlottedAxis(axis, "", "", data[axis].values).places


def shown_value(value: Any) -> str:
    """Return a swept value in few characters."""
    return f"{value:g}" if isinstance(value, float | int | np.number) else str(value)


LOG_RATIO = 100.0  # numbers that span more are drawn on a log scale
LONG_PHRASE = 32  # letters of a phrase


@dataclass(frozen=True)
class PlottedAxis:
    """A swept key. values: those of the grid in order or, of a list of jobs, that of each job."""

    name: str
    phrase: str
    unit: str
    values: np.ndarray

    @property
    def is_words(self) -> bool:
        """Return whether its values are categories."""
        return self.values.dtype.kind not in "fiu"

    @property
    def words(self) -> list[str]:
        """Return its different values as words, in their order."""
        return [format_swept(value) for value in dict.fromkeys(self.values.tolist())]

    @property
    def places(self) -> np.ndarray:
        """Return the positions of its values along it.

        Numbers stand at themselves, different words one after the other.
        """
        if not self.is_words:
            return self.values.astype(float)
        found = {word: float(n) for n, word in enumerate(dict.fromkeys(self.values.tolist()))}
        return np.array([found[word] for word in self.values.tolist()])

    @property
    def is_log(self) -> bool:
        """Return whether it is drawn on a log scale."""
        return not self.is_words and spans_decades(self.places)

    @property
    def title(self) -> str:
        """Return the text along it: phrase and unit."""
        return f"{self.phrase} ({self.unit})" if self.unit not in ("", "1") else self.phrase

    def value_text(self, number: int) -> str:
        """Return one of its values in words, such as `rod mass 3 kg`."""
        value = self.values[number]
        if self.is_words:
            return name_value(self.phrase, format_swept(value))
        return f"{self.phrase} {format_swept(value)}" + (
            f" {self.unit}" if self.unit != "1" else ""
        )


@dataclass(frozen=True)
class PlottedSweep:
    """The jobs of a study over its axes.

    place: the number of each point's job in the order of the study's `status`; of the axes'
    lengths in a grid, else (jobs,).
    """

    data: xr.Dataset
    axes: tuple[PlottedAxis, ...]
    place: np.ndarray
    is_grid: bool

    def at_points(self, values: np.ndarray) -> np.ndarray:
        """Return values of the study's jobs at the points."""
        return values.ravel()[self.place]

    def values(self, measure: Measure) -> np.ndarray:
        """Return a measure at the points, in its unit."""
        return self.at_points(measure.of(self.data))

    def bars(self, measure: Measure) -> np.ndarray:
        """Return the error bars of a measure at the points; nan where there is none."""
        return self.at_points(measure.bar(self.data))

    def known(self, measure: Measure) -> np.ndarray:
        """Return a measure at the points, nan where it is not known within its error bar.

        A chaotic motion's greatest value is not.
        """
        values, bars = self.values(measure), self.bars(measure)
        good = np.isnan(bars) | np.isfinite(bars)
        if BARRED[measure.variable].bar.relative:
            good &= ~(bars >= abs(values)) | (bars == 0.0)
        return np.where(good, values, math.nan)

    @cached_property
    def status(self) -> np.ndarray:
        """Return the status of each point's job."""
        return self.at_points(self.data["status"].values)

    @cached_property
    def chaotic(self) -> np.ndarray:
        """Return whether each point's job is chaotic."""
        if "regime" not in self.data:
            return np.zeros(self.place.shape, bool)
        return self.at_points(self.data["regime"].values) == "chaotic"

    @cached_property
    def keys(self) -> np.ndarray:
        """Return the key of each point's job."""
        return self.at_points(self.data["key"].values)


def sweep_of(data: xr.Dataset) -> PlottedSweep:
    """Return the sweep of a study, as `open_study` gives it; numbers of a grid are sorted."""
    status = data["status"]
    names = swept_axes(data)
    if status.dims == ("job",):
        axes = [axis_of(data, name, data[name].values) for name in names]
        return PlottedSweep(data, tuple(axes), np.arange(status.size), False)
    place = np.arange(status.size).reshape(status.shape)
    found = []
    for name in names:
        values = data[name].values
        order = np.arange(values.size) if values.dtype.kind not in "fiu" else np.argsort(values)
        place = np.take(place, order, axis=status.dims.index(name))
        found.append(axis_of(data, name, values[order]))
    return PlottedSweep(
        data, tuple(found), place.reshape([axis.values.size for axis in found]), True
    )


def coarse(sweep: PlottedSweep, axis: int, most: int) -> PlottedSweep:
    """Return a grid with at most so many values of an axis, evenly chosen, the ends among them."""
    size = sweep.axes[axis].values.size
    if size <= most:
        return sweep
    chosen = np.unique(np.linspace(0, size - 1, most).astype(int))
    axes = [
        replace(one, values=one.values[chosen]) if n == axis else one
        for n, one in enumerate(sweep.axes)
    ]
    return PlottedSweep(sweep.data, tuple(axes), np.take(sweep.place, chosen, axis), True)


def axis_of(data: xr.Dataset, name: str, values: np.ndarray) -> PlottedAxis:
    """Return an axis of a study with its phrase and unit."""
    attrs = data[name].attrs
    unit, key = str(attrs.get("units", "")), str(attrs.get("case_key", name))
    phrase = str(attrs.get("long_name", key))
    if phrase in (key, name) or len(phrase) > LONG_PHRASE or values.dtype.kind not in "fiu":
        phrase = name_in_words(name if unit else key.rpartition(".")[2], unit)
    return PlottedAxis(name, phrase, unit, values)


def name_in_words(name: str, unit: str) -> str:
    """Return a coordinate's name without its unit: `clearance, small end` of its mm."""
    ending = "_" + unit.replace("/", "_per_").replace(" ", "_") if unit else ""
    head, inside, part = name.partition(f"{ending}_") if ending else (name, "", "")
    words = f"{head}, {part}" if inside and part else name.removesuffix(ending)
    return words.replace("_", " ")


def spans_decades(values: np.ndarray) -> bool:
    """Return whether numbers are all above 0 and span more than LOG_RATIO."""
    finite = values[np.isfinite(values)]
    return bool(finite.size and finite.min() > 0.0 and finite.max() >= LOG_RATIO * finite.min())


def name_value(phrase: str, word: str) -> str:
    """Return a word after what it is a value of: `load design`, but `both joints`."""
    return word if phrase in word else f"{phrase} {word}"


def format_swept(value: object) -> str:
    """Return a swept value in few characters."""
    return SPOKEN.get(str(value), shown_value(value).replace("_", " "))

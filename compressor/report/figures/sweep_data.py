"""A study as its sweep is drawn: its metrics, its axes, and its jobs in a grid or a list."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from compressor.analysis import SPOKEN
from compressor.digits import ROUNDING
from compressor.metrics import AXES, BARRED, JOINTS
from compressor.report.figures.drawing import thin_places
from compressor.report.figures.style import RED, mark
from compressor.units import Units, unit_in

MARKS = {  # of jobs without a result: how they look, their name, their height in a panel
    "failed": (mark(RED, "x-thin", 7, 4, edge_width=1.8), "a job failed here", 0.04),
    "missing": (mark("#606060", "circle", 6, 4, is_hollow=True), "a job was not run", 0.11),
}


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
        """Return whether its error bar is a part of its value, not in its own unit."""
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

    def known(self, values: np.ndarray, bars: np.ndarray) -> np.ndarray:
        """Return values of the measure, nan where one is not known within its error bar.

        A chaotic motion's greatest value is not.
        """
        good = np.isnan(bars) | np.isfinite(bars)
        if self.is_relative:
            good &= ~(bars >= abs(values)) | (bars == 0.0)
        return np.where(good, values, math.nan)

    def in_unit(self, data: xr.Dataset, name: str) -> np.ndarray:
        """Return a variable of the metric in the unit; 0 of rounding beside the other joint."""
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
    elif metric.shown:
        (dim,), (title, unit, factor) = metric.dims, metric.shown
        for part in AXES if dim == "axis" else JOINTS:
            words = f"{title}, {part.replace('_', ' ')}"
            yield Measure(name, words, unit, factor, **{dim: part})


MEASURES = tuple(measure for name in BARRED for measure in shown_variables(name))


def measures(data: xr.Dataset, units: Units = "usual") -> list[Measure]:
    """Return the measures that have any value in a dataset, in chosen units."""
    stored = (measure for measure in MEASURES if measure.variable in data)
    return [one.read_in(units) for one in stored if not np.isnan(one.of(data)).all()]


def differ_beyond_bars(values: np.ndarray, bars: np.ndarray) -> bool:
    """Return whether the least and the greatest value are apart by more than their error bars."""
    if np.isnan(values).all():
        return False
    low, high = np.nanargmin(values), np.nanargmax(values)
    return bool(np.ptp(values.flat[[low, high]]) > np.nansum(bars.flat[[low, high]]))


def swept_values(data: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the swept values of a study's jobs, in the order of its `status`, by coordinate."""
    status = data["status"]
    names = [str(n) for n, c in data.coords.items() if {*c.dims} <= {*status.dims} and n != "key"]
    return {
        name: data[name].broadcast_like(status).transpose(*status.dims).values.ravel()
        for name in names
    }


def shown_value(value: Any) -> str:
    """Return a swept value in few characters."""
    is_number = isinstance(value, float | int | np.number) and not isinstance(value, bool)
    return f"{value:g}" if is_number else str(value)


LOG_RATIO = 100.0  # numbers that span more are drawn on a log scale
LONG_PHRASE = 30  # letters of a phrase: less than of one joint, so that both have one form


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
    """The jobs of a study over its axes; data: with the dimensions of a grid's axes, else `job`."""

    data: xr.Dataset
    axes: tuple[PlottedAxis, ...]

    @property
    def is_grid(self) -> bool:
        """Return whether its jobs fill a grid."""
        return self.data["status"].dims != ("job",)

    @property
    def status(self) -> np.ndarray:
        """Return the status of each job."""
        return self.data["status"].values

    @property
    def keys(self) -> np.ndarray:
        """Return the key of each job."""
        return self.data["key"].values

    @property
    def chaotic(self) -> np.ndarray:
        """Return whether each job is chaotic."""
        return self.data["regime"].values == "chaotic"

    def known(self, measure: Measure) -> np.ndarray:
        """Return a measure of the jobs, as `Measure.known`."""
        return measure.known(measure.of(self.data), measure.bar(self.data))

    def at(self, axis: int, number: int) -> "PlottedSweep":
        """Return the part of a grid at one value of an axis."""
        rest = self.axes[:axis] + self.axes[axis + 1 :]
        return PlottedSweep(self.data.isel({self.axes[axis].name: number}), rest)


def sweep_of(data: xr.Dataset) -> PlottedSweep:
    """Return the sweep of a study, as `open_study` gives it, over what has more than one value.

    Numbers of a grid are sorted.
    """
    dims = data["status"].dims
    if dims == ("job",):
        columns = (str(n) for n, c in data.coords.items() if c.dims == dims and n != "key")
        names = [name for name in columns if len({*data[name].dropna("job").values.tolist()}) > 1]
    else:
        names = [str(dim) for dim in dims if data.sizes[dim] > 1]
        data = data.isel({dim: 0 for dim in dims if dim not in names})
        falling = [n for n in names if data[n].dtype.kind in "fiu" and (np.diff(data[n]) < 0).any()]
        data = data.isel({name: np.argsort(data[name].values) for name in falling})
    return PlottedSweep(data, tuple(axis_of(data, name) for name in names))


def join_zipped(sweep: PlottedSweep) -> PlottedSweep:
    """Return jobs of keys that are zipped as a curve, over the first whose numbers all differ."""
    for axis in sweep.axes:
        if not axis.is_words and np.unique(axis.places).size == axis.places.size:
            order = np.argsort(axis.places)
            data = sweep.data.isel(job=order).swap_dims(job=axis.name)
            return PlottedSweep(data, (replace(axis, values=axis.values[order]),))
    return sweep


def coarse(sweep: PlottedSweep, axis: int, most: int) -> PlottedSweep:
    """Return a grid with at most so many values of an axis, evenly chosen, the ends among them."""
    one = sweep.axes[axis]
    chosen = thin_places(one.values.size, most)
    if chosen.size == one.values.size:
        return sweep
    thin = replace(one, values=one.values[chosen])
    axes = (*sweep.axes[:axis], thin, *sweep.axes[axis + 1 :])
    return PlottedSweep(sweep.data.isel({one.name: chosen}), axes)


def axis_of(data: xr.Dataset, name: str) -> PlottedAxis:
    """Return an axis of a study with its phrase and unit."""
    values, attrs = data[name].values, data[name].attrs
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

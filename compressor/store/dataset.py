"""Jobs as one labelled Dataset: metrics in memory, series read when they are used."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from compressor.cases import phrase_of, points, table, value_in
from compressor.digits import is_known
from compressor.metrics import BARRED, NUMBERS, SIZES
from compressor.outcome import Variable, coordinates, word_variables
from compressor.reasons import Reason
from compressor.store.files import StoreWarning
from compressor.store.netcdf import DamagedFile
from compressor.store.rows import Rows
from compressor.store.studies import StoredStudy, coordinate_names


@dataclass(frozen=True)
class Layout:
    """How jobs are laid out in a Dataset: their keys over named dimensions, and coordinates."""

    dims: tuple[str, ...]
    keys: np.ndarray
    coordinates: dict[str, xr.Variable]


def _coordinate(dims: tuple[str, ...], key: str, values: Sequence[Any], units: str) -> xr.Variable:
    attrs = {"units": units} if units else {}
    attrs |= {"long_name": phrase_of(key), "case_key": key}
    if not units:
        values = [_word(value) for value in values]
    return xr.Variable(dims, np.array(values), attrs)


def _word(value: Any) -> str:
    return ", ".join(map(_word, value)) if isinstance(value, tuple) else str(value).lower()


def grid(study: StoredStudy) -> Layout:
    """Return the layout of one study that is a grid: a dimension for every axis."""
    names = coordinate_names([axis.key for axis in study.axes])
    coordinates = {
        names[axis.key]: _coordinate((names[axis.key],), axis.key, axis.values, axis.units)
        for axis in study.axes
    }
    shape = tuple(len(axis.values) for axis in study.axes)
    return Layout(tuple(coordinates), np.array(study.keys).reshape(shape), coordinates)


def table_of_jobs(studies: Sequence[StoredStudy]) -> Layout:
    """Return the layout of several studies, or of one that is no grid: one dimension, `job`."""
    units = {"joint": "", "load": ""} | {a.key: a.units for s in studies for a in s.axes}
    rows = [(study, point) for study in studies for point in points(study)]
    coordinates = {"study": xr.Variable("job", [study.name for study, _ in rows])}
    for key, name in coordinate_names(list(units)).items():
        missing = np.nan if units[key] else ""
        swept = {study.name: any(axis.key == key for axis in study.axes) for study in studies}
        values = [
            point.get(key, missing) if swept[study.name] else _fixed_value(study, key, missing)
            for study, point in rows
        ]
        coordinates[name] = _coordinate(("job",), key, values, units[key])
    keys = [key for study in studies for key in study.keys]
    return Layout(("job",), np.array(keys), coordinates)


def _fixed_value(study: StoredStudy, key: str, missing: Any) -> Any:
    """Return the value of a key in all jobs of a study; `missing` where it has no single one."""
    value = value_in(study.fixed, key)
    return missing if value is None else value


def outcomes(layout: Layout, rows: Rows) -> xr.Dataset:
    """Return the Dataset of a layout from the rows of a store, without time series."""
    positions = rows.find(layout.keys)
    variables = _outcomes(layout, rows, positions)
    found = positions[positions >= 0]
    if (rows.bytes_of["reason"][found] != Reason.INTERNAL_ERROR.encode()).any():
        variables |= _metrics(layout, rows, positions)
        axes = coordinates(dim for one in variables.values() for dim in one.dims)
        variables |= {n: xr.Variable(*parts) for n, parts in axes.items()}
    return _with_coordinates(variables, layout)


def label_dataset(layout: Layout, rows: Rows) -> xr.Dataset:
    """Return the Dataset of a layout, from the rows of a store and its jobs with time series."""
    dataset = outcomes(layout, rows)
    positions = rows.find(layout.keys)
    found = np.unique(positions[positions >= 0])
    whole = found[rows.samples[found] > 0]
    if not whole.size:
        return dataset
    series = _series(layout, rows, positions, whole)
    return _with_coordinates(dict(dataset.variables) | series, layout)


def mask_untrusted(dataset: xr.Dataset) -> xr.Dataset:
    """Return a Dataset of jobs with nan for each metric that its error bar does not vouch for.

    So are metrics of jobs that are not ok, and of runs without error bars.
    """
    known = np.vectorize(is_known, otypes=[bool])
    is_ok = dataset["status"] == "ok"
    masked = {}
    for name, row in BARRED.items():
        if name in dataset:
            bar = dataset.get(f"{name}_error", np.nan * dataset[name])
            vouched = xr.apply_ufunc(known, dataset[name], bar, row.bar.relative)
            masked[name] = dataset[name].where(vouched & is_ok)
            masked[f"{name}_error"] = bar.where(vouched & is_ok)
    return dataset.assign(masked)


def machine_constants(studies: Sequence[StoredStudy], layout: Layout) -> dict[str, xr.Variable]:
    """Return the numbers of `machine` that have a default, as a case file gives or leaves them.

    Of one study those that it does not sweep, without dimensions; of several along `job`. Numbers
    without a default, such as the rod's inertia or a counterweight, are not among them.
    """
    rows = [
        row
        for key, row in table().items()
        if key.startswith("machine.") and row.kind == "number" and not row.optional
    ]
    names = coordinate_names([row.key for row in rows])
    found = {}
    for row in rows:
        values = [_fixed_value(study, row.key, np.nan) for study in studies]
        name = names[row.key]
        if name in layout.coordinates or not all(isinstance(one, int | float) for one in values):
            continue
        attrs = {"units": row.unit or "1", "long_name": row.label, "case_key": row.key}
        if len(studies) == 1:
            found[name] = xr.Variable((), float(values[0]), attrs)
        else:
            jobs = np.repeat(np.array(values, float), [study.jobs for study in studies])
            found[name] = xr.Variable(("job",), jobs, attrs)
    return found


def _with_coordinates(variables: dict[Any, Any], layout: Layout) -> xr.Dataset:
    names = ["key", "study", *SIZES, "time", *layout.coordinates]
    dataset = xr.Dataset(variables | layout.coordinates)
    return dataset.set_coords([name for name in names if name in dataset])


def _outcomes(layout: Layout, rows: Rows, positions: np.ndarray) -> dict[str, xr.Variable]:
    """Return the key, status, reason, promise and regime of every job."""
    is_stored = positions >= 0

    def words(name: str, otherwise: str) -> np.ndarray:
        return np.where(is_stored, _values_at(rows.word(name), positions), otherwise)

    texts = {
        "key": (layout.keys, "a job's identity"),
        "status": (words("status", "missing"), "ok, failed or missing"),
        "reason": (words("reason", ""), "why a run failed"),
    }
    for name, one in word_variables({}).items():
        texts[name] = (words(name, ""), one.attrs["long_name"])
    return {
        name: xr.Variable(layout.dims, values, {"long_name": phrase})
        for name, (values, phrase) in texts.items()
    }


def _values_at(values: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return the values at positions; anything where a position is -1."""
    return values[positions] if values.size else np.full(positions.shape, "")


def _metrics(layout: Layout, rows: Rows, positions: np.ndarray) -> dict[str, xr.Variable]:
    """Return all numbers of the rows, nan where a job has none, but for those that no job has."""
    found = {}
    for name, values in rows.numbers(positions).items():
        metric = NUMBERS[name]
        if metric.is_given(values):
            found[name] = xr.Variable((*layout.dims, *metric.dims), values, metric.attributes)
    return found


def _series(
    layout: Layout, rows: Rows, positions: np.ndarray, whole: np.ndarray
) -> dict[str, xr.Variable]:
    """Return the time series of all jobs; none but those of one of the longest are read yet."""
    template = _first_readable(rows, whole[np.argsort(-rows.samples[whole], kind="stable")])
    if not template:
        return {}
    lengths = {*zip(rows.samples[whole].tolist(), rows.ends[whole].tolist(), strict=True)}
    positions = np.where(np.isin(positions, whole), positions, -1)
    dim = "time" if len(lengths) == 1 else "sample"
    found = {"time": xr.Variable(*template["time"])} if dim == "time" else {}
    for name, item in template.items():
        if "time" in item.dims and name not in found:
            lazy = StudySeries(rows, name, positions, item.values.shape)
            dims = (*layout.dims, dim, *item.dims[1:])
            found[name] = xr.Variable(dims, indexing.LazilyIndexedArray(lazy), item.attrs)
    return found


def _first_readable(rows: Rows, positions: np.ndarray) -> dict[str, Variable]:
    """Return the series of the first of some jobs that is not damaged; {} without one, and warn."""
    for position in positions.tolist():
        try:
            return rows.series(position)
        except DamagedFile as error:
            damage = error
    warnings.warn(f"{damage}: no time series can be read", StoreWarning, stacklevel=2)
    return {}


class StudySeries(BackendArray):
    """One series of all jobs of a study; indexing reads the batches of those jobs alone."""

    def __init__(self, rows: Rows, name: str, positions: np.ndarray, longest: tuple[int, ...]):
        self.rows, self.name, self.positions, self.longest = rows, name, positions, longest
        self.shape = (*positions.shape, *longest)
        self.dtype = np.dtype(float)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        basic = indexing.IndexingSupport.BASIC
        return indexing.explicit_indexing_adapter(key, self.shape, basic, self._read)

    def _read(self, index: tuple[Any, ...]) -> np.ndarray:
        jobs, samples = index[: self.positions.ndim], index[self.positions.ndim :]
        positions = np.asarray(self.positions[jobs])
        blocks = self.rows.fresh(
            positions.ravel(), lambda rows, at: self._blocks(rows, at, samples)
        )
        return blocks.reshape((*positions.shape, *blocks.shape[1:]))

    def _blocks(self, rows: Rows, positions: np.ndarray, samples: tuple[Any, ...]) -> np.ndarray:
        """Return a series of jobs, (jobs, samples, ...), nan beyond the end of each."""
        found = np.full((positions.size, *np.empty(self.longest)[samples].shape), np.nan)
        for place, values in rows.series_of_jobs(self.name, positions):
            block = np.full(self.longest, np.nan)
            block[: len(values)] = values
            found[place] = block[samples]
        return found

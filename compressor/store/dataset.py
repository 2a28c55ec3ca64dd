"""Jobs as one labelled Dataset: metrics in memory, series read when they are used."""

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from compressor.cases import points, table, value_of
from compressor.metrics import NUMBERS, SIZES
from compressor.outcome import JOB_WORDS, Variable, coordinates
from compressor.reasons import Reason
from compressor.store.files import StoreWarning
from compressor.store.netcdf import DamagedFile
from compressor.store.stored import Stored
from compressor.store.studies import StoredStudy, coordinate_names, swept_column

KEY = {"long_name": "a job's identity"}


def lay_out(studies: Sequence[StoredStudy]) -> xr.Dataset:
    """Return the keys of studies' jobs, of one that is a grid over its axes, else in a list."""
    if len(studies) != 1 or not studies[0].is_grid:
        return lay_out_jobs(studies)
    (study,) = studies
    names = coordinate_names([axis.key for axis in study.axes])
    axes = {name: (name, *swept_column(a.key, a.values))
            for a in study.axes for name in [names[a.key]]}  # fmt: skip
    keys = np.reshape(study.keys, [len(axis.values) for axis in study.axes])
    return xr.Dataset({"key": ([*axes], keys, KEY)}, axes)


def lay_out_jobs(studies: Sequence[StoredStudy]) -> xr.Dataset:
    """Return the keys of studies' jobs with one dimension, `job`, and what is swept."""
    swept = dict.fromkeys(axis.key for study in studies for axis in study.axes)
    found: dict[str, Any] = {
        "study": ("job", [study.name for study in studies for _ in study.keys])
    }
    for key, name in coordinate_names([*{"joint": 0, "load": 0} | swept]).items():
        column: list[Any] = []
        for study in studies:
            if any(axis.key == key for axis in study.axes):
                column += [point.get(key) for point in points(study)]
            else:
                column += [value_of(study.fixed, key)] * study.jobs
        found[name] = ("job", *swept_column(key, column))
    keys = np.array([key for study in studies for key in study.keys])
    return xr.Dataset({"key": ("job", keys, KEY)}, found)


def label_jobs(layout: xr.Dataset, stored: Stored, with_series: bool = False) -> xr.Dataset:
    """Return the Dataset of laid out jobs of a store, with their time series if wanted."""
    dims, positions = layout["key"].dims, stored.find(layout["key"].values)
    found = positions[positions >= 0]
    variables: dict[Any, xr.Variable] = {"key": layout["key"].variable}
    for name, phrase in JOB_WORDS.items():
        words = np.append(stored.words(name), "missing" if name == "status" else "")  # last: at -1
        variables[name] = xr.Variable(dims, words[positions], {"long_name": phrase})
    if (stored.columns["reason"][found] != Reason.INTERNAL_ERROR.encode()).any():
        given = [name for name in NUMBERS if name in stored.given]
        numbers = stored.numbers(positions, given)
        for name, metric in NUMBERS.items():
            if name in given and metric.is_given(numbers[name]):
                place = (*dims, *metric.dims)
                variables[name] = xr.Variable(place, numbers[name], metric.attributes)
        axes = coordinates(dim for one in variables.values() for dim in one.dims)
        variables |= {name: xr.Variable(*parts) for name, parts in axes.items()}
    if with_series:
        variables |= _series(dims, stored, positions)
    names = ["study", *SIZES, "time", *layout.variables]
    dataset = xr.Dataset(variables | {**layout.variables})
    return dataset.set_coords([name for name in names if name in dataset])


def machine_constants(studies: Sequence[StoredStudy], layout: xr.Dataset) -> dict[str, xr.Variable]:
    """Return the numbers of `machine` that have a default, as a case file gives or leaves them.

    Of one study those that it does not sweep, without dimensions; of several along `job`. Numbers
    without a default, such as the rod's inertia or a counterweight, are not among them.
    """
    keys = [
        key for key, row in table().items()
        if key.startswith("machine.") and row.kind == "number" and not row.optional
    ]  # fmt: skip
    found = {}
    for key, name in coordinate_names(keys).items():
        values, attrs = swept_column(key, [value_of(study.fixed, key) for study in studies])
        if name in layout or values.dtype.kind != "f":
            continue
        jobs = np.repeat(values, [study.jobs for study in studies])
        found[name] = xr.Variable((), jobs[0], attrs) if len(studies) == 1 else (
            xr.Variable(("job",), jobs, attrs)
        )  # fmt: skip
    return found


def _series(dims: tuple[Any, ...], stored: Stored, positions: np.ndarray) -> dict[str, xr.Variable]:
    """Return the time series of all jobs; none but those of one of the longest are read yet."""
    samples, ends = stored.columns["samples"], stored.columns["end_time"]
    found = np.unique(positions[positions >= 0])
    whole = found[samples[found] > 0]
    if not whole.size:
        return {}
    template = _first_readable(stored, whole[np.argsort(-samples[whole], kind="stable")])
    lengths = {*zip(samples[whole].tolist(), ends[whole].tolist(), strict=True)}
    dim = "time" if len(lengths) == 1 else "sample"
    variables: dict[str, xr.Variable] = {}
    for name, item in template.items():
        if name == dim:
            variables[name] = xr.Variable(*item)
        elif "time" in item.dims:
            lazy = indexing.LazilyIndexedArray(
                StudySeries(stored, name, positions, item.values.shape)
            )
            place = (*dims, dim, *item.dims[1:])
            variables[name] = xr.Variable(place, lazy, item.attrs)
    return variables


def _first_readable(stored: Stored, positions: np.ndarray) -> dict[str, Variable]:
    """Return the series of the first of some jobs that is not damaged; {} without one, and warn."""
    for position in positions.tolist():
        try:
            return stored.series([position])[0]
        except DamagedFile as error:
            damage = error
    warnings.warn(f"{damage}: no time series can be read", StoreWarning, stacklevel=2)
    return {}


class StudySeries(BackendArray):
    """One series of all jobs of a study; indexing reads the batches of those jobs alone."""

    def __init__(self, stored: Stored, name: str, positions: np.ndarray, longest: tuple[int, ...]):
        self.stored, self.name, self.positions, self.longest = stored, name, positions, longest
        self.shape = (*positions.shape, *longest)
        self.dtype = np.dtype(float)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        basic = indexing.IndexingSupport.BASIC
        return indexing.explicit_indexing_adapter(key, self.shape, basic, self._read)

    def _read(self, index: tuple[Any, ...]) -> np.ndarray:
        """Return some samples of some jobs, nan beyond the end of each."""
        jobs, samples = index[: self.positions.ndim], index[self.positions.ndim :]
        positions = np.asarray(self.positions[jobs])
        shape = np.empty(self.longest)[samples].shape
        found = np.full((positions.size, *shape), np.nan)
        for place, one in enumerate(self.stored.series(positions.ravel(), [self.name])):
            if self.name in one:
                values, block = one[self.name].values, np.full(self.longest, np.nan)
                block[: len(values)] = values
                found[place] = block[samples]
        return found.reshape((*positions.shape, *shape))

"""Jobs as one labelled Dataset: metrics in memory, series read when they are used.

How a job's file is read is handed in by `compressor.store`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from compressor.case import table
from compressor.manifest import StoredStudy, points

if TYPE_CHECKING:
    from compressor.store import JobStatus

RENAMED = {"joint": "fault"}  # `joint` is a dimension of every dataset
UNIT_IN_GROUP = ("clearance_mm", "initial_offset_mm")

# a job's key, names of variables -> those that its file holds
Values = Callable[[str, Sequence[str]], dict[str, np.ndarray]]


@dataclass(frozen=True)
class Layout:
    """How jobs are laid out in a Dataset: their keys over named dimensions, and coordinates."""

    dims: tuple[str, ...]
    keys: np.ndarray
    coordinates: dict[str, xr.Variable]


def coordinate_names(keys: Sequence[str]) -> dict[str, str]:
    """What swept keys are called as coordinates: their last part, where that is enough."""
    last = [key.rpartition(".")[2] for key in keys]
    return {
        key: RENAMED.get(key, short)
        if last.count(short) == 1 and key.partition(".")[0] not in UNIT_IN_GROUP
        else key.replace(".", "_")
        for key, short in zip(keys, last, strict=True)
    }


def _coordinate(dims: tuple[str, ...], key: str, values: Sequence[Any], units: str) -> xr.Variable:
    row = table().get(key)
    attrs = {"units": units} if units else {}
    attrs |= {"long_name": row.phrase if row else key, "case_key": key}
    if not units:
        values = [_word(value) for value in values]
    return xr.Variable(dims, np.array(values), attrs)


def _word(value: Any) -> str:
    return ", ".join(value) if isinstance(value, tuple) else str(value).lower()


def grid(study: StoredStudy) -> Layout:
    """One study: a dimension for every axis."""
    names = coordinate_names([axis.key for axis in study.axes])
    coordinates = {
        names[axis.key]: _coordinate((names[axis.key],), axis.key, axis.values, axis.units)
        for axis in study.axes
    }
    shape = tuple(len(axis.values) for axis in study.axes)
    return Layout(tuple(coordinates), np.array(study.keys).reshape(shape), coordinates)


def table_of_jobs(studies: Sequence[StoredStudy]) -> Layout:
    """Several studies: one dimension, `job`."""
    units = {"joint": "", "load": ""} | {a.key: a.units for s in studies for a in s.axes}
    rows = [(study, point) for study in studies for point in points(study.axes)]
    coordinates = {"study": xr.Variable("job", [study.name for study, _ in rows])}
    for key, name in coordinate_names(list(units)).items():
        missing = np.nan if units[key] else ""
        values = [point.get(key, _fixed_value(study.fixed, key, missing)) for study, point in rows]
        coordinates[name] = _coordinate(("job",), key, values, units[key])
    keys = [key for study in studies for key in study.keys]
    return Layout(("job",), np.array(keys), coordinates)


def _fixed_value(fixed: Mapping[str, Any], key: str, missing: Any) -> Any:
    """The value of a key that a study does not sweep; `missing` where it has no single one."""
    value: Any = fixed
    for part in key.split("."):
        value = value.get(part, missing) if isinstance(value, Mapping) else missing
    if key == "clearance_mm" and isinstance(value, Mapping):
        sizes = {size for size in value.values() if size > 0}
        return sizes.pop() if len(sizes) == 1 else missing
    return missing if isinstance(value, Mapping) else value


def labelled(
    layout: Layout,
    known: Mapping[str, "JobStatus | None"],
    template: xr.Dataset | None,
    values: Values,
) -> xr.Dataset:
    """The Dataset of a layout; `template` is a job with all the variables that any of them has."""
    jobs = [job for job in known.values() if job]
    variables = _outcomes(layout, known)
    if template is not None:
        variables |= _metrics(layout, template, {job.key for job in jobs}, values)
        variables |= _series(layout, template, [job for job in jobs if job.samples], values)
        variables |= {name: template[name].variable for name in ("joint", "axis")}
    coordinates = ["key", "study", "joint", "axis", "time", *layout.coordinates]
    dataset = xr.Dataset(variables | layout.coordinates)
    return dataset.set_coords([name for name in coordinates if name in dataset])


def _outcomes(layout: Layout, known: Mapping[str, "JobStatus | None"]) -> dict[str, xr.Variable]:
    """Key, status and reason of every job."""
    ends = [known[key] for key in layout.keys.flat]
    texts = {
        "key": (list(layout.keys.flat), "a job's identity and the name of its file"),
        "status": ([job.status if job else "missing" for job in ends], "ok, failed or missing"),
        "reason": ([job.reason if job else "" for job in ends], "why a run failed"),
    }
    return {
        name: xr.Variable(
            layout.dims, np.array(values).reshape(layout.keys.shape), {"long_name": phrase}
        )
        for name, (values, phrase) in texts.items()
    }


def _metrics(
    layout: Layout, template: xr.Dataset, stored: set[str], values: Values
) -> dict[str, xr.Variable]:
    """All numbers that are no series; nan where a job has none."""
    wanted = [
        str(name)
        for name, item in template.items()
        if "time" not in item.dims and item.dtype.kind in "fi"
    ]
    read = {key: values(key, wanted) for key in stored}
    found = {}
    for name in wanted:
        item = template[name]
        out = np.full((*layout.keys.shape, *item.shape), np.nan)
        for point, key in np.ndenumerate(layout.keys):
            out[point] = read.get(str(key), {}).get(name, np.nan)
        found[name] = xr.Variable((*layout.dims, *item.dims), out, item.attrs)
    return found


def _series(
    layout: Layout, template: xr.Dataset, jobs: Sequence["JobStatus"], values: Values
) -> dict[str, xr.Variable]:
    """The time series of all jobs, none of which is read yet."""
    if "time" not in template.dims:
        return {}
    shared = len({(job.samples, job.end) for job in jobs}) == 1
    stored = {job.key for job in jobs}
    keys = np.vectorize(lambda key: key if key in stored else "", otypes=[object])(layout.keys)
    found = {"time": template["time"].variable} if shared else {}
    for name, item in template.variables.items():
        if "time" in item.dims and name not in found:
            dims = (*layout.dims, "time" if shared else "sample", *item.dims[1:])
            lazy = indexing.LazilyIndexedArray(StudySeries(values, str(name), keys, item.shape))
            found[str(name)] = xr.Variable(dims, lazy, item.attrs)
    return found


class StudySeries(BackendArray):
    """One series of all jobs of a study; indexing reads the files of the jobs asked for."""

    def __init__(self, values: Values, name: str, keys: np.ndarray, longest: tuple[int, ...]):
        self.values, self.name, self.keys, self.longest = values, name, keys, longest
        self.shape = (*keys.shape, *longest)
        self.dtype = np.dtype(float)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        basic = indexing.IndexingSupport.BASIC
        return indexing.explicit_indexing_adapter(key, self.shape, basic, self._read)

    def _read(self, index: tuple[Any, ...]) -> np.ndarray:
        jobs, samples = index[: self.keys.ndim], index[self.keys.ndim :]
        keys = np.asarray(self.keys[jobs], dtype=object)
        blocks = [self._block(key)[samples] for key in keys.flat]
        inner = np.empty(self.longest)[samples].shape
        return np.array(blocks).reshape((*keys.shape, *inner))

    def _block(self, key: str) -> np.ndarray:
        """A job's series, nan beyond its end."""
        block = np.full(self.longest, np.nan)
        if key:
            values = self.values(key, [self.name])[self.name]
            block[: len(values)] = values
        return block

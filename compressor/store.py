"""The store: a folder of finished jobs and of the studies they belong to.

    <folder>/jobs/<key>.h5        one job, netCDF-4 as xarray, h5py and ncdump read it
    <folder>/studies/<name>.json  one study: its axes and the keys of its jobs, in C order

A file appears under its name only when all of it is on disk, so whatever has a name is whole.
Studies share the jobs that they have in common. Only this module imports h5py.
"""

import contextlib
import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr

from compressor.case import Case
from compressor.durable import Folder, StoreError, discard_leftovers, publish, system_error
from compressor.labels import grid, labelled, table_of_jobs
from compressor.manifest import StoredAxis, StoredStudy, points, read_studies, write_study

__all__ = [
    "DamagedJob",
    "Folder",
    "JobStatus",
    "StoreError",
    "StoredAxis",
    "StoredStudy",
    "discard_leftovers",
    "finished_keys",
    "has_job",
    "job_path",
    "job_status",
    "known_status",
    "open_study",
    "points",
    "read_job",
    "read_studies",
    "write_job",
    "write_study",
]

TEXT = h5py.string_dtype()  # variable-length UTF-8
KEY = re.compile(r"[0-9a-f]{20}")


class DamagedJob(StoreError):
    """A file among the jobs that is no finished job; a run replaces it."""


@dataclass(frozen=True)
class JobStatus:
    """How a stored job ended, and what is kept of it."""

    key: str
    status: str  # ok | failed
    reason: str  # a stable name; empty when ok
    detail: str
    samples: int  # of the time series; 0 where only metrics are kept
    end: float  # last time of the series, s
    timeout: float  # wall time that the job was given, s

    def serves(self, case: Case) -> bool:
        """Whether a case needs no new run: neither what is kept nor `timeout_s` is in its key."""
        if self.reason == "budget_seconds" and case.solve.timeout_s > self.timeout:
            return False
        if self.samples or case.output.keep == "metrics":
            return True
        return self.reason == "internal_error"


def job_path(folder: Folder, key: str) -> Path:
    """Where a job's file stands."""
    if not KEY.fullmatch(key):
        raise StoreError(folder, f"{key!r} is no job's key", "a key is 20 hexadecimal digits")
    return Path(folder) / "jobs" / f"{key}.h5"


def write_job(folder: Folder, dataset: xr.Dataset) -> Path:
    """Store a job's Dataset, as `compressor.simulate` returns it; an older one is replaced."""
    path = job_path(folder, dataset.attrs["key"])
    publish(path, _image(dataset))
    return path


def read_job(folder: Folder, key: str) -> xr.Dataset:
    """A stored job's Dataset, its variables read from the file when they are used."""
    path = job_path(folder, key)
    try:
        with _damage_named(path), contextlib.ExitStack() as unless_good:
            dataset = unless_good.enter_context(xr.open_dataset(path, engine="h5netcdf"))
            if dataset.attrs.get("key") != key:
                raise ValueError
            unless_good.pop_all()
            return dataset
    except FileNotFoundError as error:
        raise StoreError(path, "is not stored", "run its study first") from error


def has_job(folder: Folder, key: str) -> bool:
    """Whether a job is stored, failed ones included."""
    return job_path(folder, key).exists()


def finished_keys(folder: Folder) -> set[str]:
    """The keys of all stored jobs, failed ones included."""
    try:
        names = os.listdir(Path(folder) / "jobs")
    except FileNotFoundError:
        return set()
    except OSError as error:
        raise system_error(Path(folder) / "jobs", error) from error
    return {name[:-3] for name in names if name.endswith(".h5") and KEY.fullmatch(name[:-3])}


def job_status(folder: Folder, key: str) -> JobStatus | None:
    """How a stored job ended; None where there is none. Raises DamagedJob."""
    path = job_path(folder, key)
    try:
        with _damage_named(path), h5py.File(path) as file:
            if file.attrs["key"] != key:
                raise ValueError
            times = file.get("time")
            return JobStatus(
                key,
                file["status"].asstr()[()],
                file["reason"].asstr()[()],
                str(file.attrs.get("detail", "")),
                0 if times is None else times.size,
                0.0 if times is None else float(times[-1]),
                json.loads(file.attrs["case"])["solve"]["timeout_s"],
            )
    except FileNotFoundError:
        return None


def known_status(folder: Folder, key: str) -> JobStatus | None:
    """`job_status`, but None for a damaged file too, which a run replaces."""
    try:
        return job_status(folder, key)
    except DamagedJob:
        return None


@contextlib.contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    """Turn the many ways in which a file can fail to be a job into StoreError."""
    try:
        yield
    except FileNotFoundError:
        raise
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        if isinstance(error, OSError) and error.errno:
            raise system_error(path, error) from error
        problem = "is no finished job of compsim: cut short, damaged, or foreign"
        raise DamagedJob(path, problem, "run its study again, which replaces it") from error


def _image(dataset: xr.Dataset) -> bytes:
    """A Dataset as the bytes of a netCDF-4 file.

    Built in memory, since HDF5 can crash the process when a disk fills up while it writes.
    """
    with h5py.File("job", "w", driver="core", backing_store=False, track_order=True) as file:
        for name, variable in dataset.variables.items():
            values = variable.to_numpy()
            dtype = TEXT if values.dtype.kind in "OU" else values.dtype
            stored = file.create_dataset(str(name), data=values.astype(dtype), dtype=dtype)
            _set_attributes(stored, variable.attrs)
            if variable.dims == (name,):
                stored.make_scale(str(name))
        for name, variable in dataset.variables.items():
            for number, dim in enumerate(variable.dims):
                if dim != name:
                    file[str(name)].dims[number].attach_scale(file[str(dim)])
        _set_attributes(file, dataset.attrs)
        file.flush()
        return file.id.get_file_image()


def _set_attributes(stored: Any, attributes: Mapping[Any, Any]) -> None:
    for name, value in attributes.items():
        if isinstance(value, str):  # HDF5 text holds neither NUL nor lone surrogates
            value = value.encode(errors="replace").decode().replace("\0", "\ufffd")
        stored.attrs[name] = value


def open_study(folder: Folder, name: str | None = None) -> xr.Dataset:
    """A study as one Dataset, labelled by its axes; series are read when they are used.

    One study (that of `name`, or the only one) has its axes as dimensions: the last part of each
    swept key, such as `clearance_mm`, in the case file's unit; a swept `joint` is called `fault`.
    Several studies have a `job` dimension with coordinates `study`, `fault`, `load` and each
    swept key. `key` names every job's file (see `read_job`), `status` is ok, failed or missing,
    and metrics are nan where a job is not ok.

    Series have the dimension `time`. If the jobs have different output grids (a swept speed),
    they have `sample` instead, nan beyond a job's end, with `time` a coordinate of every job.
    """
    folder = os.path.abspath(folder)
    studies = read_studies(folder)
    if name is not None:
        known = ", ".join(study.name for study in studies)
        studies = [study for study in studies if study.name == name]
        if not studies:
            raise StoreError(folder, f"holds no study {name!r}", f"it holds {known}")
    layout = grid(studies[0]) if len(studies) == 1 else table_of_jobs(studies)
    ends = {str(key): known_status(folder, key) for key in layout.keys.flat}
    whole = [job for job in ends.values() if job and job.reason != "internal_error"]
    values = partial(_values, folder)
    if whole:
        with read_job(folder, max(whole, key=lambda job: job.samples).key) as template:
            dataset = labelled(layout, ends, template, values)
    else:
        dataset = labelled(layout, ends, None, values)
    dataset.attrs = {"folder": folder, "studies": [study.name for study in studies]}
    return dataset


def _values(folder: str, key: str, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Variables of a stored job by name, without those that it does not have."""
    with _damage_named(job_path(folder, key)), h5py.File(job_path(folder, key)) as file:
        return {name: file[name][()] for name in names if name in file}

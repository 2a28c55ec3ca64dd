"""Stored jobs and studies as Datasets, and the records of their sensors."""

import math
import os
import re
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from compressor.store.files import Folder, StoreError, StoreWarning, WrongName
from compressor.store.stored import Stored, read_store
from compressor.store.studies import StoredStudy, find_job, find_study, read_studies, whole_key

if TYPE_CHECKING:
    import xarray as xr

    from compressor.vibration import Record

WHOLE_KEY = 20  # digits
BOTH_JOINTS = (
    "`fault` is the swept joint, and `joint` the one that a number belongs to: select both, as in "
    "study.sel(fault='big_end', joint='big_end')"
)


def read_job(folder: Folder, key: str) -> "xr.Dataset":
    """Return a stored job's Dataset: what `simulate` gives of its case, with series if stored.

    folder: of results; key: 20 hexadecimal digits, as `Case.key` and the coordinate `key` of a
    study have them, or the beginning of one. Raises StoreError where there is no such job, or a
    damaged one.

    After `compsim run wear.yaml` with the file of `load_cases`:

    >>> import compressor
    >>> study = compressor.open_study("results", "wear")
    >>> run = compressor.read_job("results", study.key.sel(clearance_mm=0.2).item())
    >>> run.acceleration.dims, compressor.Case.from_attribute(run.attrs["case"]).joint
    (('time',), 'big_end')
    """
    stored = read_store(folder)
    if len(key) < WHOLE_KEY:
        key = whole_key(folder, key, read_studies(folder), stored.keys())
    return stored.job(key)


def open_study(folder: Folder, name: str | None = None) -> "xr.Dataset":
    """Return a study as one Dataset, labelled by its axes; series are read when they are used.

    folder: of results; name: of the study, all studies without. Variables and SI units are those
    of `simulate`.

    One study (that of `name`, or the only one) has its axes as dimensions: the last part of each
    swept key, such as `clearance_mm`, in the case file's unit; a swept `joint` is called `fault`.
    Several studies, and one that is no grid (zip, samples, exclude, blocks), have a `job` dimension
    with coordinates `study`, `fault`, `load` and each swept key. `key` names every job (see
    `read_job`), `status` is ok, failed or missing, and metrics are nan where a job did not reach
    its end. Numbers of the machine that are not swept, such as `rod_mass_kg`, are variables, too,
    so that `to_dataframe` has a column of each. Of a study that sweeps `joint` a StoreWarning says
    that `joint` alone does not select a fault.

    Series have the dimension `time`. If the jobs have different output grids (a swept speed),
    they have `sample` instead, nan beyond a job's end, with `time` a coordinate of every job.

    Raises StoreError for a folder without results and for a study that it does not hold: a
    WrongName, which says what was probably meant. Of damaged files a StoreWarning is given, and
    their jobs count as missing; where numbers alone are damaged, a StoreError names the file.

    After `compsim run wear.yaml` with the file of `load_cases`:

    >>> import compressor
    >>> study = compressor.open_study("results", "wear")
    >>> one = study.sel(clearance_mm=0.2)
    >>> print(f"{one.peak_acceleration:.0f} ± {one.peak_acceleration_error:.1f} m/s2")
    647 ± 0.2 m/s2
    >>> surely_below = study.peak_acceleration + study.peak_acceleration_error < 700
    >>> study.clearance_mm.where(surely_below, drop=True).values.tolist()
    [0.1, 0.2]
    >>> study.acceleration.sel(clearance_mm=0.3).dims
    ('time',)
    """
    studies = read_studies(folder)
    if name is not None:
        studies = [find_study(folder, name, studies)]
    dataset = label_studies(read_store(folder, warn=True), studies)
    if "fault" in dataset.dims and "joint" in dataset.dims:
        warnings.warn(BOTH_JOINTS, StoreWarning, stacklevel=2)
    return dataset


def label_studies(stored: Stored, studies: Sequence[StoredStudy]) -> "xr.Dataset":
    """Return studies of a store as one Dataset, as `open_study` does."""
    from compressor.store import dataset as datasets  # loads xarray: half a second

    layout = datasets.lay_out(studies)
    found = datasets.label_jobs(layout, stored, with_series=True)
    return found.assign(datasets.machine_constants(studies, layout))


NEEDS_SENSOR = "run it with body: true, sensor: true and output.keep: series"
SERIES = ("sensor_time", "sensor_acceleration", "tacho_time")


def job_record(stored: Stored, key: str) -> "Record | None":
    """Return the sensor's record of a stored job; None where it has none."""
    found = stored.values(key, SERIES)
    if set(found) != set(SERIES):
        return None
    from compressor.vibration import Record  # loads parts of SciPy

    times, values, tacho = (np.asarray(found[name], float) for name in SERIES)
    return Record(times, values, tacho, math.nan)


def find_record(name: str, folder: Folder, hints: Mapping[str, Any]) -> "tuple[str, Record]":
    """Return a record by the name of its file, or by the beginning of a stored job's key.

    With the job's key, "" of a file; hints: what a file does not say, by the names that
    `compressor.vibration.read_record` has. Raises RecordError for a file, and StoreError for a job,
    also where it is given hints.
    """
    if not re.fullmatch("[0-9a-f]{1,20}", name) or os.path.exists(name):
        from compressor.vibration import read_record

        return "", read_record(name, **hints)
    if hints:
        options = " ".join(f"--{hint.replace('_', '-')}" for hint in hints)
        problem = f"a stored job such as {name} says all of its record"
        raise WrongName(folder, problem, f"leave {options} out")
    stored = read_store(folder, warn=True)
    key = find_job(folder, [name], read_studies(folder), stored.keys())
    record = job_record(stored, key)
    if record is None:
        raise StoreError(folder, f"job {key} has no sensor's record", NEEDS_SENSOR)
    return key, record

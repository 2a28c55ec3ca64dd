"""Results for other programs: a table of studies' jobs or the time series of one, in one file.

A CSV file has one header line, units in brackets where a name does not end in its unit, and
numbers that read back to the bit; an empty cell is a number that there is not. A sensor's record
has times of its own: its columns are those that `compsim identify` reads, and the shorter columns
of a job end in empty cells. The file is whole or absent. For netCDF `open_study` and `read_job`
have what xarray's `to_netcdf` writes.
"""

import itertools
import os
import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compressor.store.files import Folder, StoreWarning, WrongName, publish
from compressor.store.reader import job_record
from compressor.store.stored import Stored, read_store
from compressor.store.studies import find_study, read_studies, whole_key

if TYPE_CHECKING:
    import xarray as xr

HEXADECIMAL = re.compile("[0-9a-f]{1,20}")


def export(
    folder: Folder, names: Sequence[str], output: Folder, force: bool = False
) -> tuple[int, str]:
    """Write a file of studies, a row a job, or of one job, a row a sample; return its rows.

    With what a row is. names: of studies, all without; or the beginning of the job's key. output: a
    .csv. force: replace what is there. Raises WrongName for a file that does not fit, and
    StoreError where the store or the disk gives way.
    """
    from compressor.store import dataset as datasets  # loads xarray: half a second

    path, stored, known = Path(output), read_store(folder, warn=True), read_studies(folder)
    if path.suffix != ".csv":
        raise WrongName(path, "is no name of a CSV file", "end it in .csv")
    if os.path.lexists(path) and not force:
        raise WrongName(path, "exists", "--force replaces it")
    keys = {name for name in names if HEXADECIMAL.fullmatch(name)} - {one.name for one in known}
    if keys and len(names) > 1:
        problem = "has studies, or one job"
        raise WrongName(path, problem, "export each job to a file of its own")
    if keys:
        key = whole_key(folder, names[0], known, stored.keys())
        what, (rows, data) = "sample", _encode_job(stored, key)
    else:
        studies = [find_study(folder, name, known) for name in dict.fromkeys(names)] or known
        rows, what = sum(study.jobs for study in studies), "job"
        table = datasets.label_jobs(datasets.lay_out_jobs(studies), stored)
        data = encode_csv(columns(table, "job"))
    publish(path, data)
    return rows, what


def _encode_job(stored: Stored, key: str) -> tuple[int, bytes]:
    """Return how many rows a job's file has, and its bytes."""
    run = stored.job(key)
    if "time" not in run.dims:
        remedy = "run its case file with --set output.keep=series, or export its study"
        raise WrongName(stored.folder, f"job {key} has no time series", remedy)
    table = columns(run, "time")
    if found := job_record(stored, key):
        from compressor.vibration import record_columns  # loads parts of SciPy

        table |= (more := record_columns(found.times, found.values, found.tacho))
        if "tacho" not in more:
            problem = "no column tacho: its sensor's record passes top dead centre less than twice"
            remedy = "raise solve.duration_rev or sensor.length_rev"
            warnings.warn(f"job {key}: {problem}; {remedy}", StoreWarning, stacklevel=3)
    return run.sizes["time"], encode_csv(table)


def columns(table: "xr.Dataset", dim: str) -> dict[str, np.ndarray]:
    """Return the variables along a dimension by header, a column for each joint, axis and so on.

    Swept keys stay in the units of the case file.
    """
    found = {}
    leading = [name for name in table.coords if table[name].dims == (dim,)]
    for name in dict.fromkeys([*leading, *table.data_vars]):
        item = table[name]
        if item.dims[:1] != (dim,):
            continue
        unit = item.attrs.get("units", "1")
        ending = "" if unit == "1" or "case_key" in item.attrs else f" [{unit}]"
        inner = [table[other].values.tolist() for other in item.dims[1:]]
        values = item.values.reshape(len(item), -1)
        for number, labels in enumerate(itertools.product(*inner)):
            found["_".join(map(str, (name, *labels))) + ending] = values[:, number]
    return found


def encode_csv(table: dict[str, np.ndarray]) -> bytes:
    """Return columns as CSV; those that are shorter than others end in empty cells."""
    import pandas as pd  # half a second

    whole = {  # to the last digit of a double
        name: pd.Series(values.astype(float) if values.dtype.kind == "f" else values)
        for name, values in table.items()
    }
    return pd.DataFrame(whole).to_csv(index=False, lineterminator="\n").encode()

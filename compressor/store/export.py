"""Results for other programs: a table of studies' jobs or the time series of one, in one file.

A CSV file has one header line, units in brackets where a name does not end in its unit, and
numbers that read back to the bit; an empty cell is a number that there is not. A sensor's record
has times of its own: its columns are those that `compsim identify` reads, and the shorter columns
of a job end in empty cells. The file is whole or absent.
"""

import itertools
import json
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compressor.program import PROGRAM
from compressor.store.files import Folder, WrongName, publish
from compressor.store.netcdf import encode_dataset
from compressor.store.sensor_records import job_record
from compressor.store.stored import Stored, read_store
from compressor.store.studies import StoredStudy, find_study, read_studies, whole_key

if TYPE_CHECKING:
    import xarray as xr

SUFFIXES = (".nc", ".csv")
HEXADECIMAL = re.compile("[0-9a-f]{1,20}")


def export(
    folder: Folder, names: Sequence[str], output: Folder, force: bool = False
) -> tuple[int, str]:
    """Write a file of studies, a row a job, or of one job, a row a sample; return its rows.

    With what a row is. names: of studies, all without; or the beginning of the job's key. output:
    .nc or .csv. force: replace what is there. Raises WrongName for a file that does not fit, and
    StoreError where the store or the disk gives way.
    """
    path, stored, known = Path(output), read_store(folder, warn=True), read_studies(folder)
    _check_target(path, force)
    keys = {name for name in names if HEXADECIMAL.fullmatch(name)} - {one.name for one in known}
    if keys and len(names) > 1:
        problem = "has studies, or one job"
        raise WrongName(path, problem, "export each job to a file of its own")
    if keys:
        key = whole_key(folder, names[0], known, stored.keys())
        what, (rows, data) = "sample", _encode_job(stored, key, path.suffix)
    else:
        studies = [find_study(folder, name, known) for name in dict.fromkeys(names)] or known
        rows, what = sum(study.jobs for study in studies), "job"
        data = _encode_studies(stored, studies, path.suffix)
    publish(path, data)
    return rows, what


def _check_target(path: Path, force: bool) -> None:
    """Raise WrongName where a file may not be written."""
    if path.suffix not in SUFFIXES:
        problem = f"no files of the type {path.suffix}" if path.suffix else "no folders"
        raise WrongName(path, f"{problem} are written", f"end the name in {' or '.join(SUFFIXES)}")
    if os.path.lexists(path) and not force:
        raise WrongName(path, "exists", "--force replaces it")


def _encode_studies(stored: Stored, studies: Sequence[StoredStudy], suffix: str) -> bytes:
    """Return the numbers of studies' jobs as one table; in netCDF a lone grid keeps its axes."""
    from compressor.store import dataset as datasets  # loads xarray: half a second

    if suffix == ".csv":
        table = datasets.label_jobs(datasets.lay_out_jobs(studies), stored)
        return encode_csv(columns(table, "job"))
    fields = ("name", "case_file", "fixed", "command", "versions", "written")
    origin = [{name: getattr(study, name) for name in fields} for study in studies]
    table = datasets.label_jobs(datasets.lay_out(studies), stored).assign_attrs(
        title=f"compsim: {' '.join(study.name for study in studies)}",
        program=PROGRAM,
        studies=json.dumps(origin),
    )
    others = [name for name in table.coords if name not in table.dims]
    for name in table.data_vars:  # as netCDF's readers expect
        mine = [n for n in others if {*table[n].dims} <= {*table[name].dims}]
        table[name].attrs["coordinates"] = " ".join(map(str, mine))
    return encode_dataset(table)


def _encode_job(stored: Stored, key: str, suffix: str) -> tuple[int, bytes]:
    """Return how many rows a job's file has, and its bytes."""
    position = stored.position(key)
    if position is None:
        raise WrongName(stored.folder, f"job {key} is not stored", "run its case file first")
    if not (samples := int(stored.columns["samples"][position])):
        remedy = "run its case file with --set output.keep=series, or export its study"
        raise WrongName(stored.folder, f"job {key} has no time series", remedy)
    if suffix == ".nc":
        return samples, encode_dataset(stored.job(key))
    table = columns(stored.job(key), "time")
    if found := job_record(stored, key):
        from compressor.vibration import record_columns  # loads parts of SciPy

        table |= record_columns(found.times, found.values, found.tacho)
    return samples, encode_csv(table)


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

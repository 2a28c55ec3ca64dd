"""Results for other programs: metrics of studies and time series of jobs, as netCDF or as CSV.

Records of sensors, as programs that analyse vibration open them, are WAV and MAT files too.

A CSV file has one header line, units in brackets where a name does not end in its unit, and
numbers that read back to the bit; an empty cell is a number that there is not. A sensor's record
has times of its own: its columns are those that `compsim identify` reads, and the shorter columns
of a job end in empty cells. Rows are written block by block, and every file is whole or absent.
"""

import csv
import io
import itertools
import json
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from compressor.program import PROGRAM, CompsimError, Progress, no_progress
from compressor.store.files import Folder, WrongName, publish, publishing
from compressor.store.netcdf import DamagedFile, encode_dataset
from compressor.store.reader import Stored, read_store
from compressor.store.sensor_records import NEEDS_SENSOR
from compressor.store.studies import StoredStudy, find_study, read_studies, whole_key
from compressor.units import Units, unit_in

if TYPE_CHECKING:
    import xarray as xr

RECORD_SUFFIXES = {"wav": ".wav", "mat": ".mat"}  # of a sensor's record alone
SUFFIXES = {"netcdf": ".nc", "csv": ".csv", **RECORD_SUFFIXES}
BLOCK = 4096  # rows of a CSV file that are text at the same time
HEXADECIMAL = re.compile("[0-9a-f]{1,20}")


class ExportError(CompsimError):
    """A target that an export cannot be written to."""

    exit_code = 2


@dataclass(frozen=True)
class ExportOptions:
    """How to export.

    form: of the files in a folder, of `SUFFIXES`, netcdf by default; series: also the time series
    of every job of the studies, in a folder beside each; force: replace what is there; units: of
    CSV, other files are in SI.
    """

    form: str | None = None
    series: bool = False
    force: bool = False
    units: Units = "si"


@dataclass(frozen=True)
class Exported:
    """A file that was written."""

    path: str
    # metrics: of studies, a row a job | series: of one job, a row a sample | record: of its sensor
    kind: str
    name: str  # of the studies, or the job's key
    rows: int
    bytes: int


@dataclass(frozen=True)
class _Task:
    """A file to be written: with metrics of studies, or with the time series of one job."""

    path: Path
    studies: tuple[StoredStudy, ...] = ()
    key: str = ""
    named: bool = True  # rather than one of all jobs of a study


def export(
    folder: Folder,
    names: Sequence[str],
    output: Folder,
    options: ExportOptions | None = None,
    progress: Progress = no_progress,
) -> tuple[list[Exported], list[DamagedFile]]:
    """Write what `names` name, studies and jobs by the beginning of their keys, else all studies.

    output: a file, .nc or .csv, for the studies together as one table, or for one job; or .wav
    or .mat for the sensor's record of one job; or a folder, in which each gets a file: a name
    without a suffix, with a slash at its end, or of a folder.

    Returns what was written, and damage that was met, which costs the jobs in it alone. Raises
    ExportError before anything is written, StoreError where the store or the disk gives way.
    """
    stored, known = read_store(folder), read_studies(folder)
    studies, keys = _named_jobs(folder, names, stored, known)
    target = Path(output)
    options = options or ExportOptions()
    form, is_file = _form(output, options.form)
    if options.units == "plant" and form != "csv":
        raise ExportError(f"{target}: plant units are of CSV alone: leave out --units")
    if studies and form in RECORD_SUFFIXES:
        problem = f"a file of the type {SUFFIXES[form]} is the sensor's record of one job"
        raise ExportError(f"{target}: {problem}: name jobs by their keys, not studies")
    if is_file:
        tasks = [_one_file(target, studies, keys, options.series)]
    else:
        tasks = [*_files(target, SUFFIXES[form], stored, studies, keys, options.series)]
    if not options.force:
        _refuse_existing(tasks)
    found, damaged = [], list(stored.damaged)
    for number, task in enumerate(tasks):
        progress(number, len(tasks), "")
        try:
            write = _metrics if task.studies else _series
            found.append(write(task, stored, form, options.units))
        except DamagedFile as error:
            if task.named:
                raise
            damaged.append(error)
    return found, damaged


def _named_jobs(
    folder: Folder, names: Sequence[str], stored: Stored, known: Sequence[StoredStudy]
) -> tuple[list[StoredStudy], list[str]]:
    """Return the studies and the keys of jobs that are named, each once; by default all studies."""
    by_name = {study.name for study in known}
    if not names:
        return [*known], []
    studies, keys = [], []
    for name in dict.fromkeys(names):
        if name not in by_name and HEXADECIMAL.fullmatch(name):
            keys.append(whole_key(folder, name, known, stored.keys()))
        else:
            studies.append(find_study(folder, name, known))
    return studies, list(dict.fromkeys(keys))


def _form(output: Folder, form: str | None) -> tuple[str, bool]:
    """Return the form of an export, and whether it goes to one file, by the target's suffix.

    Raises ExportError for a suffix that is none of SUFFIXES, unless the name is that of a folder:
    one that exists, or ends in a slash.
    """
    target = Path(output)
    if not target.suffix or target.is_dir() or os.fspath(output).endswith(os.sep):
        return form or "netcdf", False
    known = {suffix: form for form, suffix in SUFFIXES.items()}.get(target.suffix)
    if known is None:
        raise ExportError(
            f"{target}: no files of the type {target.suffix} are written: end the name in "
            f".nc or .csv, for a job's record in {' or '.join(RECORD_SUFFIXES.values())}, or, for "
            f"a folder, in {os.sep}"
        )
    if form not in (None, known):
        raise ExportError(f"{target} is no name for {form}: end it in {SUFFIXES[form or known]}")
    return known, True


def _one_file(
    target: Path, studies: Sequence[StoredStudy], keys: Sequence[str], series: bool
) -> _Task:
    if series or len(keys) > 1 or (keys and studies):
        raise ExportError(f"{target} is one file, and this needs several: give a folder")
    return _Task(target, tuple(studies), "".join(keys))


def _files(
    target: Path,
    suffix: str,
    stored: Stored,
    studies: Sequence[StoredStudy],
    keys: Sequence[str],
    series: bool,
) -> Iterator[_Task]:
    """Yield a file for each study and each job, and those of the studies' time series."""
    for study in studies:
        yield _Task(target / f"{study.name}{suffix}", (study,))
        if series:
            positions = stored.rows.find(study.keys)
            has_series = (positions >= 0) & (stored.rows.samples[positions] > 0)
            for key in dict.fromkeys(itertools.compress(study.keys, has_series.tolist())):
                yield _Task(target / study.name / f"{key}{suffix}", key=key, named=False)
    for key in keys:
        yield _Task(target / f"{key}{suffix}", key=key)


def _refuse_existing(tasks: Iterable[_Task]) -> None:
    for task in tasks:
        if os.path.lexists(task.path):
            raise ExportError(f"{task.path} exists: --force replaces it")


def _metrics(task: _Task, stored: Stored, form: str, units: Units) -> Exported:
    """Write the numbers of studies' jobs as one table; in netCDF a lone grid keeps its axes."""
    from compressor.store.dataset import (  # loads xarray: half a second
        grid,
        outcomes,
        table_of_jobs,
    )

    studies = task.studies
    if form == "csv":
        table = outcomes(table_of_jobs(studies), stored.rows)
        size = write_csv(task.path, columns(table, "job", units))
    else:
        is_grid = len(studies) == 1 and studies[0].is_grid
        layout = grid(studies[0]) if is_grid else table_of_jobs(studies)
        table = outcomes(layout, stored.rows).assign_attrs(_attributes(studies))
        data = encode_dataset(_link_coordinates(table))
        publish(task.path, data)
        size = len(data)
    jobs = sum(study.jobs for study in studies)
    name = " ".join(study.name for study in studies)
    return Exported(os.fspath(task.path), "metrics", name, jobs, size)


def _series(task: _Task, stored: Stored, form: str, units: Units) -> Exported:
    """Write the time series of one job."""
    position = stored.position(task.key)
    if position is None:
        raise WrongName(stored.folder, f"job {task.key} is not stored", "run its case file first")
    if not (samples := int(stored.rows.samples[position])):
        remedy = "run its case file with --set output.keep=series, or export its study"
        raise WrongName(stored.folder, f"job {task.key} has no time series", remedy)
    kind, dataset = "series", stored.job(task.key)
    if form == "csv":
        size = write_csv(task.path, columns(dataset, "time", units) | _record(dataset))
    else:
        data = encode_dataset(dataset)
        if form in RECORD_SUFFIXES:
            from compressor.vibration import encode_record  # loads parts of SciPy

            record = _record(dataset)
            if not record:
                problem = f"job {task.key} has no sensor's record"
                raise WrongName(stored.folder, problem, NEEDS_SENSOR)
            data = encode_record(record, SUFFIXES[form])
            kind, samples = "record", len(next(iter(record.values())))
        publish(task.path, data)
        size = len(data)
    return Exported(os.fspath(task.path), kind, task.key, samples, size)


def columns(table: "xr.Dataset", dim: str, units: Units = "si") -> dict[str, np.ndarray]:
    """Return the variables along a dimension by header, a column for each joint, axis and so on.

    units: of the numbers; swept keys stay in those of the case file.
    """
    found = {}
    leading = [name for name in table.coords if table[name].dims == (dim,)]
    for name in dict.fromkeys([*leading, *table.data_vars]):
        item = table[name]
        if item.dims[:1] != (dim,):
            continue
        unit = item.attrs.get("units", "1")
        is_key, factor = "case_key" in item.attrs, 1.0
        if units == "plant" and not is_key:
            unit, factor = unit_in(unit, units)
        ending = "" if unit == "1" or is_key else f" [{unit}]"
        inner = [table[other].values.tolist() for other in item.dims[1:]]
        values = item.values.reshape(len(item), -1)
        values = values if factor == 1.0 else factor * values
        for number, labels in enumerate(itertools.product(*inner)):
            found["_".join(map(str, (name, *labels))) + ending] = values[:, number]
    return found


def _record(run: "xr.Dataset") -> dict[str, np.ndarray]:
    """Return the columns of a job's record, as `compsim identify` reads them; nothing without."""
    if "sensor_time" not in run:
        return {}
    from compressor.vibration import record_columns  # loads parts of SciPy

    names = ("sensor_time", "sensor_acceleration", "tacho_time")
    return record_columns(*(run[name].values for name in names))


def write_csv(path: Path, table: dict[str, np.ndarray]) -> int:
    """Write columns as CSV, durably, and return the bytes written.

    Columns that are shorter than others end in empty cells.
    """
    rows = max(map(len, table.values()))
    with publishing(path) as file:
        text = io.TextIOWrapper(file, "utf-8", newline="", write_through=True)
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(table)
        for start in range(0, rows, BLOCK):
            parts = [_cells(values[start : start + BLOCK]) for values in table.values()]
            writer.writerows(itertools.zip_longest(*parts, fillvalue=""))
        text.detach()
        return file.tell()


def _cells(values: np.ndarray) -> list[Any]:
    """Return the values as csv takes them: floats are written to the last digit, nan as nothing."""
    if values.dtype.kind != "f":
        return values.tolist()
    cells = values.astype(float).astype(object)
    cells[np.isnan(values)] = ""
    return cells.tolist()


def _link_coordinates(table: "xr.Dataset") -> "xr.Dataset":
    """Return a table whose variables name their coordinates, as netCDF's readers expect."""
    others = [name for name in table.coords if name not in table.dims]
    linked = table.copy()
    for name in table.data_vars:
        mine = [n for n in others if {*table[n].dims} <= {*table[name].dims}]
        linked[name].attrs["coordinates"] = " ".join(map(str, mine))
    return linked


def _attributes(studies: Sequence[StoredStudy]) -> dict[str, str]:
    """Return where the numbers of a file come from."""
    fields = ("name", "case_file", "fixed", "command", "versions", "written")
    origin = [{name: getattr(study, name) for name in fields} for study in studies]
    return {
        "title": f"compsim: {' '.join(study.name for study in studies)}",
        "program": PROGRAM,
        "studies": json.dumps(origin),
    }

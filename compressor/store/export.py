"""Results for other programs: metrics of studies and time series of jobs, as netCDF or as CSV.

Records of sensors, as programs that analyse vibration open them, are WAV and MAT files too.

A CSV file has one header line, units in brackets where a name does not end in its unit, and
numbers that read back to the bit; an empty cell is a number that there is not. A sensor's record
has times of its own: its columns are those that `compsim identify` reads, and the shorter columns
of a job end in empty cells. Every file is whole or absent.
"""

import itertools
import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from compressor.program import PROGRAM, CompsimError, Progress, no_progress
from compressor.store.files import Folder, WrongName, publish
from compressor.store.netcdf import DamagedFile, encode_dataset
from compressor.store.sensor_records import NEEDS_SENSOR
from compressor.store.stored import Stored, read_store
from compressor.store.studies import StoredStudy, find_study, read_studies, whole_key
from compressor.units import Units, unit_in

if TYPE_CHECKING:
    import xarray as xr

RECORD_SUFFIXES = {"wav": ".wav", "mat": ".mat"}  # of a sensor's record alone
SUFFIXES = {"netcdf": ".nc", "csv": ".csv", **RECORD_SUFFIXES}
HEXADECIMAL = re.compile("[0-9a-f]{1,20}")

Content = tuple[StoredStudy, ...] | str  # of a file: studies, or a job by its key


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
    rows: int
    bytes: int


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

    Returns what was written, and damage that was met, which costs the files of it alone. Raises
    ExportError before anything is written, StoreError where the store or the disk gives way.
    """
    stored, known = read_store(folder), read_studies(folder)
    options = options or ExportOptions()
    form, is_file = _choose_form(output, options)
    studies, keys = _named_jobs(folder, names, stored, known)
    files = _plan_files(Path(output), form, is_file, stored, studies, keys, options.series)
    for path in () if options.force else files:
        if os.path.lexists(path):
            raise ExportError(f"{path} exists: --force replaces it")
    found, damaged = [], [*stored.damaged]
    for number, (path, content) in enumerate(files.items()):
        progress(number, len(files), "")
        try:
            if isinstance(content, str):
                kind, rows, data = _encode_job(stored, content, form, options.units)
            else:
                rows = sum(study.jobs for study in content)
                kind, data = "metrics", _encode_metrics(stored, content, form, options.units)
        except DamagedFile as error:
            damaged.append(error)
            continue
        publish(path, data)
        found.append(Exported(os.fspath(path), kind, rows, len(data)))
    return found, damaged


def _choose_form(output: Folder, options: ExportOptions) -> tuple[str, bool]:
    """Return the form of an export, and whether it goes to one file, by the target's suffix.

    Raises ExportError for a suffix that is none of SUFFIXES, unless the name is that of a folder:
    one that exists, or ends in a slash.
    """
    target, form = Path(output), options.form
    is_file = bool(target.suffix) and not (target.is_dir() or os.fspath(output).endswith(os.sep))
    if is_file:
        known = {suffix: form for form, suffix in SUFFIXES.items()}.get(target.suffix)
        if known is None:
            raise ExportError(
                f"{target}: no files of the type {target.suffix} are written: end the name in "
                f".nc or .csv, for a job's record in {' or '.join(RECORD_SUFFIXES.values())}, or, "
                f"for a folder, in {os.sep}"
            )
        if form not in (None, known):
            raise ExportError(f"{target} is no name for {form}: end it in {SUFFIXES[form or '']}")
        form = known
    form = form or "netcdf"
    if options.units == "plant" and form != "csv":
        raise ExportError(f"{target}: plant units are of CSV alone: leave out --units")
    return form, is_file


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
    return studies, keys


def _plan_files(
    target: Path,
    form: str,
    is_file: bool,
    stored: Stored,
    studies: Sequence[StoredStudy],
    keys: Sequence[str],
    series: bool,
) -> dict[Path, Content]:
    """Return what is to be written, by file. Raises ExportError where it does not fit."""
    suffix = SUFFIXES[form]
    if studies and form in RECORD_SUFFIXES:
        problem = f"a file of the type {suffix} is the sensor's record of one job"
        raise ExportError(f"{target}: {problem}: name jobs by their keys, not studies")
    if is_file and (series or len(keys) > 1 or (keys and studies)):
        raise ExportError(f"{target} is one file, and this needs several: give a folder")
    if is_file:
        return {target: keys[0] if keys else tuple(studies)}
    files: dict[Path, Content] = {}
    for study in studies:
        files[target / f"{study.name}{suffix}"] = (study,)
        for key in study.keys if series else ():
            status = stored.status(key)
            if status and status.samples:
                files[target / study.name / f"{key}{suffix}"] = key
    return files | {target / f"{key}{suffix}": key for key in keys}


def _encode_metrics(
    stored: Stored, studies: Sequence[StoredStudy], form: str, units: Units
) -> bytes:
    """Return the numbers of studies' jobs as one table; in netCDF a lone grid keeps its axes."""
    from compressor.store import dataset as datasets  # loads xarray: half a second

    if form == "csv":
        table = datasets.label_jobs(datasets.lay_out_jobs(studies), stored)
        return encode_csv(columns(table, "job", units))
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


def _encode_job(stored: Stored, key: str, form: str, units: Units) -> tuple[str, int, bytes]:
    """Return the kind of a job's file, its rows, and the time series in it."""
    position = stored.position(key)
    if position is None:
        raise WrongName(stored.folder, f"job {key} is not stored", "run its case file first")
    if not (samples := int(stored.columns["samples"][position])):
        remedy = "run its case file with --set output.keep=series, or export its study"
        raise WrongName(stored.folder, f"job {key} has no time series", remedy)
    run = stored.job(key)
    if form == "csv":
        return "series", samples, encode_csv(columns(run, "time", units) | _record(run))
    if form == "netcdf":
        return "series", samples, encode_dataset(run)
    from compressor.vibration import encode_record  # loads parts of SciPy

    if not (record := _record(run)):
        raise WrongName(stored.folder, f"job {key} has no sensor's record", NEEDS_SENSOR)
    return "record", len(next(iter(record.values()))), encode_record(record, SUFFIXES[form])


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


def encode_csv(table: dict[str, np.ndarray]) -> bytes:
    """Return columns as CSV; those that are shorter than others end in empty cells."""
    import xarray as xr

    rows = max(map(len, table.values()))
    whole: dict[Any, Any] = {}
    for name, values in table.items():
        if values.dtype.kind == "f":  # to the last digit of a double
            values = np.pad(values.astype(float), (0, rows - len(values)), constant_values=np.nan)
        whole[name] = ("row", values)
    text = xr.Dataset(whole).to_dataframe().to_csv(index=False, lineterminator="\n")
    return text.encode()

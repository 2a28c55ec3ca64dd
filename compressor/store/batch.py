"""Batches: files with some finished jobs each, `<folder>/batches/<name>.h5`, whole or not there.

A worker writes one about twice a second. A job is done when its batch has its name: there is
no other writer, no lock and no index, and stores are merged by copying their batches. Names begin
with the time of writing, so that of two equal results of a job the later one is known.

A batch is netCDF-4: `xarray.open_dataset(path, engine="h5netcdf")` shows jobs x metrics, their
error bars, and jobs x samples with names and units.

    job (job)                   keys
    status, reason, ... (job)   `WORDS`
    samples, end_time (job)     length of the time series (0: none is kept), last time in s
    metric, unit (metric)       columns of the next two, such as knock.big_end
    value, error (job, metric)  numbers and their error bars, nan where a job has none
    attributes (byte)           JSON, a line a job, deflated by zlib
    time, ... (job, sample)     time series, where they are kept, nan beyond the end of each
"""

import itertools
import json
import os
import time
import uuid
import zlib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from compressor.metrics import AXES, HORIZON, JOINTS, NUMBERS, QUANTILES, SEGMENTS, THRESHOLDS
from compressor.outcome import ABSCISSAE, JOB_WORDS, ROW, Outcome, Variable, coordinates
from compressor.store.files import Folder, FolderLost, StoreError, make_folder, publish
from compressor.store.netcdf import (
    dimensions_of,
    encode_netcdf,
    open_netcdf,
    read_attributes,
    read_bytes,
)

FOLDER, SUFFIX = "batches", ".h5"
WORDS = {
    "physics_key": "hash of what a job simulates, not how",
    **JOB_WORDS,
    "kept": "what is kept: bars, horizon, signals, series, these in double precision",
}
LABELS = {
    "joint": JOINTS, "axis": AXES, "quantile": QUANTILES, "segment": SEGMENTS,
    "threshold": THRESHOLDS,
}  # fmt: skip
SAMPLES = {"time": "sample", "sensor_time": "sensor_sample"}  # dimensions as batches call them
DIMENSIONS = {short: dim for dim, short in SAMPLES.items()}
TABLES = ("value", "error")
OF_JOBS = (*TABLES, "attributes")  # what is not read at once, but for time series
PLACES = np.arange(ROW.itemsize // 8.0).view(ROW)[0]  # of each number in a row of all


def places_of(names: Sequence[str]) -> np.ndarray:
    """Return the places of some numbers in a row of all."""
    return np.concatenate([np.ravel(PLACES[name]) for name in names]).astype(int)


def _label_numbers() -> tuple[dict[str, int], dict[str, int]]:
    """Return places of values and of error bars by label, which begins with the number's name."""
    values: dict[str, int] = {}
    errors: dict[str, int] = {}
    for name, row in NUMBERS.items():
        bare = name.removesuffix("_error") if row.source == "error" else name
        every = itertools.product(*(LABELS[dim] for dim in row.dims))
        for parts, place in zip(every, places_of([name]).tolist(), strict=True):
            label = ".".join([bare, *(f"{p:g}" if isinstance(p, float) else str(p) for p in parts)])
            (errors if row.source == "error" else values)[label] = place
    return values, errors


VALUES, ERRORS = _label_numbers()


def name_of(label: str) -> str:
    """Return the name of a labelled number, without joint, axis and so on."""
    return label.partition(".")[0]


Rows = tuple[dict[str, np.ndarray], list[str]]  # job, `WORDS`, samples, end_time; labels of numbers


# ---- writing ------------------------------------------------------------------------------------


def encode_batch(outcomes: Sequence[Outcome]) -> bytes:
    """Return the bytes of a batch."""
    numbers = np.array([one.numbers for one in outcomes], ROW).view(float)
    numbers = numbers.reshape(len(outcomes), -1)
    given = ~np.isnan(numbers).all(axis=0)
    labels = [label for label, at in VALUES.items() if given[at] or given[ERRORS.get(label, at)]]
    numbers = np.column_stack([numbers, np.full(len(outcomes), np.nan)])  # of what has no bar
    lines = [json.dumps(one.attributes, default=lambda array: array.tolist()) for one in outcomes]
    packed = zlib.compress("\n".join(lines).encode(), level=1)
    times = [one.series["time"].values if one.series else np.zeros(0) for one in outcomes]
    words = [_words(one) for one in outcomes]
    series = _join_series(outcomes)
    variables: dict[str, Any] = {
        "job": (("job",), [one.key for one in outcomes], {"long_name": "a job's identity"}),
        **{
            name: (("job",), [one[name] for one in words], {"long_name": phrase})
            for name, phrase in WORDS.items()
        },
        "samples": (("job",), [len(one) for one in times], {}),
        "end_time": (("job",), [one[-1] if len(one) else 0.0 for one in times], {"units": "s"}),
        "metric": (("metric",), np.array(labels, "U"), {}),
        "unit": (("metric",), np.array([NUMBERS[name_of(one)].unit for one in labels], "U"), {}),
        "value": (("job", "metric"), numbers[:, [VALUES[label] for label in labels]], {}),
        "error": (
            ("job", "metric"),
            numbers[:, [ERRORS.get(label, -1) for label in labels]],
            {"long_name": "error bar, inf where it is not known"},
        ),
        "attributes": (("byte",), np.frombuffer(packed, np.uint8), {}),
        **coordinates(dim for dims, _, _ in series.values() for dim in dims),
        **series,
    }
    is_single = any(one.values.dtype.char == "f" for one in series.values())
    return encode_netcdf(variables, {"comment": "SI units"}, series if is_single else ())


def _words(outcome: Outcome) -> dict[str, str]:
    attributes, numbers = outcome.attributes, outcome.numbers
    series = outcome.series.get("acceleration") or outcome.series.get("time")
    kept = {
        "bars": not np.isnan(numbers["peak_acceleration_error"]),
        "horizon": not np.isnan(numbers[HORIZON]),
        "signals": attributes.get("signals"),
        "series": series,
        "double": series and series.values.dtype.char == "d",
    }
    text = " ".join(name for name, is_kept in kept.items() if is_kept)
    return outcome.words() | {"physics_key": str(attributes.get("physics_key", "")), "kept": text}


def _join_series(outcomes: Sequence[Outcome]) -> dict[str, Variable]:
    """Return the time series of jobs, padded with nan to the longest, and their lengths."""
    found: dict[str, Variable] = {}
    for name in dict.fromkeys(name for one in outcomes for name in one.series):
        parts = {row: one.series[name] for row, one in enumerate(outcomes) if name in one.series}
        dims, _, attrs = next(iter(parts.values()))
        shape = np.max([part.values.shape for part in parts.values()], axis=0)
        kind = np.result_type(*(part.values.dtype for part in parts.values()))
        whole = np.full((len(outcomes), *shape), np.nan, kind)
        for row, part in parts.items():
            place: Any = (row, *map(slice, part.values.shape))
            whole[place] = part.values
        if absent := [row for row in range(len(outcomes)) if row not in parts]:
            attrs = attrs | {"absent": absent}
        short = [SAMPLES.get(dim, dim) for dim in dims]
        found[name] = Variable(("job", *short), whole, attrs)
        for axis, dim in enumerate(short):
            if dim not in LABELS and dim != "sample":
                lengths = np.zeros(len(outcomes), int)
                for row, part in parts.items():
                    lengths[row] = part.values.shape[axis]
                found[f"{dim}s"] = Variable(("job",), lengths, {})
    return found


def make_batches(folder: Folder) -> None:
    """Make the folder of batches, once, when a run begins. Raises StoreError."""
    make_folder(Path(folder) / FOLDER)


def publish_batch(folder: Folder, data: bytes, written: str = "") -> Path:
    """Write the bytes of a batch under a new name, durably; return its path.

    folder: of results, which `make_batches` has made; written: the time that its name begins with,
    by default now. Raises StoreError where the disk refuses, FolderLost where the folder is gone.
    """
    name = f"{written or f'{time.time_ns():020}'}-{uuid.uuid4().hex[:8]}{SUFFIX}"
    path = Path(folder) / FOLDER / name
    try:
        publish(path, data, make=False)  # one made anew would lack what the run has stored before
    except StoreError as error:
        if isinstance(error.__cause__, FileNotFoundError | NotADirectoryError):
            raise FolderLost(folder) from error
        raise
    return path


# ---- reading: each raises DamagedFile, and FileNotFoundError ------------------------------------


def read_batch(path: Path) -> Rows:
    """Return what there is of each job but its numbers, attributes and time series."""
    with open_netcdf(path) as file:
        columns = {name: read_bytes(file[name]) for name in ("job", *WORDS)}
        columns |= {name: file[name][()] for name in ("samples", "end_time")}
        labels = read_bytes(file["metric"]).astype(str).tolist()
        shapes = {values.shape for values in columns.values()}
        if {(*shape, len(labels)) for shape in shapes} != {file[name].shape for name in TABLES}:
            raise ValueError
        return columns, labels


@lru_cache(maxsize=1)
def read_tables(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return values, error bars and a column of nan side by side, (jobs, columns).

    With the column of each place in a row of all numbers.
    """
    with open_netcdf(path) as file:
        values, errors = (file[name][()] for name in TABLES)
        labels = read_bytes(file["metric"]).astype(str).tolist()
    count, columns = len(labels), np.full(ROW.itemsize // 8 + 1, -1)
    # the last place is of labels without a bar, and of those of another version of the program
    columns[[ERRORS.get(label, -1) for label in labels]] = range(count, 2 * count)
    columns[[VALUES.get(label, -1) for label in labels]] = range(count)
    return np.column_stack([values, errors, np.full(len(values), np.nan)]), columns


def read_numbers(path: Path, rows: Sequence[int], places: np.ndarray) -> np.ndarray:
    """Return numbers of some jobs at some places in a row of all, nan where there are none."""
    table, columns = read_tables(path)
    return table[np.ix_(rows, columns[places])]


@lru_cache(maxsize=4)
def read_lines(path: Path) -> list[bytes]:
    """Return the attributes of each job as JSON."""
    with open_netcdf(path) as file:
        return zlib.decompress(file["attributes"][()].tobytes()).split(b"\n")


def read_attributes_of(path: Path, row: int) -> dict[str, Any]:
    """Return the attributes of one job."""
    found = json.loads(read_lines(path)[row])
    return {n: np.array(v) if isinstance(v, list) else v for n, v in found.items()}


def read_series(
    path: Path, rows: Sequence[int], names: Sequence[str] | None = None
) -> list[dict[str, Variable]]:
    """Return time series of some jobs by name: those of `names`, or all, that each has."""
    found: list[dict[str, Variable]] = [{} for _ in rows]
    if not found:
        return []
    with open_netcdf(path) as file:
        every = [*file]
        is_single = np.char.find(read_bytes(file["kept"]), b"double") < 0
        for name in every if names is None else [one for one in names if one in every]:
            data = file[name]  # not `get`, to which what is damaged is absent
            dims = dimensions_of(data, every)[1:]
            lengths = [file[f"{dim}s"][()] for dim in dims if f"{dim}s" in every]
            if not lengths:
                continue
            attrs = read_attributes(data)
            absent = {*np.ravel(attrs.pop("absent", ())).tolist()}
            # stored as doubles beside others
            singles = is_single & ("sample" in dims and name not in ABSCISSAE)
            dims = [DIMENSIONS.get(dim, dim) for dim in dims]
            source = data[()] if len(rows) == len(data) else data  # one read for all jobs
            for one, row in zip(found, rows, strict=True):
                if row not in absent:
                    values = source[(row, *(slice(int(length[row])) for length in lengths))]
                    kind = np.dtype("f4") if singles[row] else data.dtype
                    one[name] = Variable(tuple(dims), values.astype(kind, copy=False), attrs)
    return found


def batch_paths(folder: Folder) -> list[Path]:
    """Return the batches of a folder of results, in the order of writing. Raises OSError."""
    place = Path(folder) / FOLDER
    try:
        names = os.listdir(place)
    except FileNotFoundError:
        return []
    return [place / n for n in sorted(names) if n.endswith(SUFFIX) and not n.startswith(".")]

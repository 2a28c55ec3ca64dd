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
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from compressor.metrics import AXES, HORIZON, JOINTS, NUMBERS, QUANTILES, SEGMENTS, THRESHOLDS
from compressor.outcome import ABSCISSAE, ROW, Outcome, Variable, coordinates
from compressor.store.files import Folder, publish
from compressor.store.netcdf import (
    dimensions_of,
    encode_netcdf,
    names_of,
    open_netcdf,
    read_attributes,
    read_bytes,
)

FOLDER, SUFFIX = "batches", ".h5"
WORDS = {
    "physics_key": "hash of what a job simulates, not how",
    "status": "ok or failed",
    "reason": "why a run failed, by a stable name",
    "promise": "whether what accuracy promises was kept",
    "regime": "how far the motion is predictable",
    "precision": "of the time series: double or single",
    "signals": "yes where there are metrics of signals, and signals in any time series",
    "bars": "yes where metrics have error bars",
    "horizon": "yes where it is known how long the motion is predictable",
}
LABELS = {
    "joint": JOINTS, "axis": AXES, "quantile": QUANTILES, "segment": SEGMENTS,
    "threshold": THRESHOLDS,
}  # fmt: skip
SAMPLES = {"time": "sample", "sensor_time": "sensor_sample"}  # dimensions as batches call them
TABLES = ("value", "error")
DIMENSIONS = {short: dim for dim, short in SAMPLES.items()}


def _columns() -> tuple[dict[str, int], dict[str, int], dict[str, str]]:
    """Return positions of values and of error bars in ROW's numbers by label; names by label."""
    values: dict[str, int] = {}
    errors: dict[str, int] = {}
    names: dict[str, str] = {}
    count = itertools.count()
    for name, row in NUMBERS.items():
        for parts in itertools.product(*(LABELS[dim] for dim in row.dims)):
            bare = name.removesuffix("_error") if row.source == "error" else name
            label = ".".join([bare, *(f"{p:g}" if isinstance(p, float) else str(p) for p in parts)])
            (errors if row.source == "error" else values)[label] = next(count)
            names.setdefault(label, bare)
    return values, errors, names


VALUES, ERRORS, NAMES = _columns()


@dataclass(frozen=True, eq=False)
class Batch:
    """What is read of a batch at once: all but its numbers, attributes and time series."""

    path: Path
    keys: np.ndarray  # bytes, (jobs,)
    words: dict[str, np.ndarray]  # bytes, (jobs,) each
    samples: np.ndarray
    ends: np.ndarray
    labels: tuple[str, ...]  # of the columns of numbers
    is_compressed: bool  # whether its time series are

    def __len__(self) -> int:
        return len(self.keys)


def encode_batch(outcomes: Sequence[Outcome], compress: bool = False) -> bytes:
    """Return the bytes of a batch; compress: deflate its time series."""
    numbers = (
        np.array([one.numbers for one in outcomes], ROW).view(float).reshape(len(outcomes), -1)
    )
    given = ~np.isnan(numbers).all(axis=0)
    labels = [
        label for label, at in VALUES.items() if given[at] or given[ERRORS.get(label, at)]
    ]  # fmt: skip
    errors = np.full((len(outcomes), len(labels)), np.nan)
    for column, label in enumerate(labels):
        if label in ERRORS:
            errors[:, column] = numbers[:, ERRORS[label]]
    lines = [json.dumps(one.attributes, default=lambda array: array.tolist()) for one in outcomes]
    packed = zlib.compress("\n".join(lines).encode(), level=1)
    times = [one.series["time"].values if one.series else np.zeros(0) for one in outcomes]
    words = [_words(one) for one in outcomes]
    series = _join_series(outcomes)
    dims = {dim for names, _, _ in series.values() for dim in names}
    variables: dict[str, Any] = {
        "job": (("job",), [one.key for one in outcomes], {"long_name": "a job's identity"}),
        **{
            name: (("job",), [one[name] for one in words], {"long_name": phrase})
            for name, phrase in WORDS.items()
        },
        "samples": (("job",), [len(one) for one in times], {}),
        "end_time": (("job",), [one[-1] if len(one) else 0.0 for one in times], {"units": "s"}),
        "metric": (("metric",), np.array(labels, "U"), {}),
        "unit": (("metric",), np.array([NUMBERS[NAMES[label]].unit for label in labels], "U"), {}),
        "value": (("job", "metric"), numbers[:, [VALUES[label] for label in labels]], {}),
        "error": (("job", "metric"), errors, {"long_name": "error bar, inf where it is not known"}),
        "attributes": (("byte",), np.frombuffer(packed, np.uint8), {}),
        **coordinates(dims),
        **series,
    }
    return encode_netcdf(
        variables, {"comment": "SI units", "compressed": compress}, series if compress else ()
    )


def _words(outcome: Outcome) -> dict[str, str]:
    attributes, numbers = outcome.attributes, outcome.numbers
    exact = {"f": "single", "d": "double"}
    samples = outcome.series.get("acceleration") or outcome.series.get("time")
    return {
        "physics_key": str(attributes.get("physics_key", "")),
        "status": outcome.status,
        "reason": outcome.reason,
        "promise": str(attributes.get("promise", "")),
        "regime": str(attributes.get("regime", "")),
        "precision": exact[samples.values.dtype.char] if samples else "",
        "signals": "yes" if attributes.get("signals") else "",
        "bars": "" if np.isnan(numbers["peak_acceleration_error"]) else "yes",
        "horizon": "" if np.isnan(numbers[HORIZON]) else "yes",
    }


def _join_series(outcomes: Sequence[Outcome]) -> dict[str, Variable]:
    """Return the time series of jobs, padded with nan to the longest, and their lengths."""
    found: dict[str, Variable] = {}
    for name in dict.fromkeys(name for one in outcomes for name in one.series):
        parts = [one.series.get(name) for one in outcomes]
        first = next(part for part in parts if part)
        shape = np.max([part.values.shape for part in parts if part], axis=0)
        kind = np.result_type(*(part.values.dtype for part in parts if part))
        whole = np.full((len(parts), *shape), np.nan, kind)
        for row, part in enumerate(parts):
            if part:
                place: Any = (row, *map(slice, part.values.shape))
                whole[place] = part.values
        absent = [row for row, part in enumerate(parts) if not part]
        attrs = first.attrs | ({"absent": absent} if absent else {})
        dims = tuple(SAMPLES.get(dim, dim) for dim in first.dims)
        found[name] = Variable(("job", *dims), whole, attrs)
        for axis, dim in enumerate(first.dims):
            if dim not in LABELS and dim != "time":
                lengths = [part.values.shape[axis] if part else 0 for part in parts]
                found[f"{dim}_count"] = Variable(("job",), np.array(lengths), {})
    return found


def publish_batch(folder: Folder, data: bytes, written: str = "") -> Path:
    """Write the bytes of a batch under a new name, durably; return its path.

    folder: of results; written: the time that its name begins with, by default now. Raises
    StoreError where the disk refuses.
    """
    name = f"{written or f'{time.time_ns():020}'}-{uuid.uuid4().hex[:8]}{SUFFIX}"
    path = Path(folder) / FOLDER / name
    publish(path, data)
    return path


def write_batch(folder: Folder, outcomes: Sequence[Outcome], compress: bool = False) -> Path:
    """Write outcomes, with the time series that are in them, as a batch; return its path.

    folder: of results. Raises StoreError where the disk refuses.
    """
    return publish_batch(folder, encode_batch(outcomes, compress))


def read_batch(path: Path) -> Batch:
    """Return a batch. Raises DamagedFile, and FileNotFoundError."""
    with open_netcdf(path) as file:
        words = {name: read_bytes(file[name]) for name in WORDS}
        batch = Batch(
            path, read_bytes(file["job"]), words, file["samples"][()], file["end_time"][()],
            tuple(read_bytes(file["metric"]).astype(str).tolist()), bool(file.attrs["compressed"]),
        )  # fmt: skip
        shape = (len(batch), len(batch.labels))
        if {len(one) for one in (*words.values(), batch.samples, batch.ends)} != {len(batch)} or (
            file["value"].shape != shape or file["error"].shape != shape
        ):
            raise ValueError
        return batch


@lru_cache(maxsize=4)
def read_numbers(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return values and error bars of a batch, (jobs, labels) each. Raises DamagedFile."""
    with open_netcdf(path) as file:
        return file["value"][()], file["error"][()]


@lru_cache(maxsize=4)
def read_lines(path: Path) -> list[bytes]:
    """Return the attributes of each job as JSON. Raises DamagedFile."""
    with open_netcdf(path) as file:
        return zlib.decompress(file["attributes"][()].tobytes()).split(b"\n")


def read_series(path: Path, row: int, names: Sequence[str] | None = None) -> dict[str, Variable]:
    """Return time series of one job by name, those of `names` that it has, by default all.

    Raises DamagedFile, and FileNotFoundError.
    """
    with open_netcdf(path) as file:
        return _read_series(file, [row], names)[0]


def _read_series(
    file: Any, rows: Sequence[int], names: Sequence[str] | None = None
) -> list[dict[str, Variable]]:
    """Return time series of some jobs, each by name."""
    found: list[dict[str, Variable]] = [{} for _ in rows]
    for name in names_of(file) if names is None else names:
        parts = _read_rows(file, name, rows)
        if not parts:
            continue
        data = file[name]
        dims = tuple(DIMENSIONS.get(dim, dim) for dim in dimensions_of(data)[1:])
        attrs = {key: value for key, value in read_attributes(data).items() if key != "absent"}
        for one, values in zip(found, parts, strict=True):
            if values is not None:
                one[name] = Variable(dims, values, attrs)
    return found


def read_one_series(path: Path, name: str, rows: Sequence[int]) -> list[np.ndarray | None]:
    """Return one time series of some jobs of a batch, None where a job has none.

    Raises DamagedFile, and FileNotFoundError.
    """
    with open_netcdf(path) as file:
        return _read_rows(file, name, rows) or [None] * len(rows)


def _read_rows(file: Any, name: str, rows: Sequence[int]) -> list[np.ndarray | None]:
    """Return a series of some jobs, cut to the length of each; [] of what is none."""
    if name not in file:
        return []
    data = file[name]  # not `get`, to which what is damaged is absent
    if data.ndim < 2 or name in TABLES or "_Encoding" in data.attrs:
        return []
    absent = data.attrs.get("absent", ())
    dims = dimensions_of(data)[1:]
    lengths = [
        file["samples" if dim == "sample" else f"{DIMENSIONS.get(dim, dim)}_count"][()]
        for dim in dims
        if dim not in LABELS
    ]
    kinds = np.full(len(data), data.dtype)
    if "sample" in dims and name not in ABSCISSAE:  # beside doubles, singles are stored as such
        kinds[read_bytes(file["precision"]) == b"single"] = np.dtype("f4")
    return [
        None if row in absent else
        data[(row, *(slice(int(some[row])) for some in lengths))].astype(kinds[row], copy=False)
        for row in rows
    ]  # fmt: skip


def read_outcomes(batch: Batch) -> list[Outcome]:
    """Return all that a batch holds, to be merged with others. Raises DamagedFile."""
    values, errors = read_numbers(batch.path)
    numbers = spread_numbers(batch.labels, values, errors)
    lines = read_lines(batch.path)
    kept = np.flatnonzero(batch.samples).tolist()
    with open_netcdf(batch.path) as file:
        series = dict(zip(kept, _read_series(file, kept), strict=True)) if kept else {}
    return [
        Outcome(
            batch.words["status"][row].decode(), batch.words["reason"][row].decode(),
            numbers[row].view(ROW)[0], parse_attributes(lines[row]), series.get(row, {}),
        )
        for row in range(len(batch))
    ]  # fmt: skip


def spread_numbers(labels: Sequence[str], values: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Return numbers in the order of ROW, (jobs, columns), from those that a batch holds."""
    found = np.full((len(values), ROW.itemsize // 8), np.nan)
    for column, label in enumerate(labels):
        found[:, VALUES[label]] = values[:, column]
        if label in ERRORS:
            found[:, ERRORS[label]] = errors[:, column]
    return found


def parse_attributes(line: bytes) -> dict[str, Any]:
    """Return the attributes of a job from a line of JSON."""
    found = json.loads(line)
    return {n: np.array(v) if isinstance(v, list) else v for n, v in found.items()}


def batch_paths(folder: Folder) -> list[Path]:
    """Return the batches of a folder of results, in the order of writing. Raises OSError."""
    place = Path(folder) / FOLDER
    try:
        names = os.listdir(place)
    except FileNotFoundError:
        return []
    return [place / n for n in sorted(names) if n.endswith(SUFFIX) and not n.startswith(".")]

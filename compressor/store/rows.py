"""Segments, files that hold the outcomes of many jobs as columns, and those rows that count.

A segment is written once, as `<folder>/rows/<number>-<digest>.h5`, netCDF-4 like a job's file. The
digest of its bytes is in its name, and compared whenever it is read.

Of several rows of one job the most complete one counts (`completeness`): runs that write at the
same time, each its own shard, take nothing from each other. Among equals it is the one with the
greatest `serial`: the number of the segment that it was first written to.
"""

import json
import re
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from compressor.metrics import ALWAYS, HORIZON, NUMBERS
from compressor.outcome import ROW, Outcome, Regime, SeriesFile, coordinates, row
from compressor.store.files import HEX20, pending_path
from compressor.store.hdf5 import DamagedJob, digest, image, open_file, read_variable, storable
from compressor.store.series_file import intact, series_path

NAME = re.compile(rf"([0-9]{{9}})-({HEX20})\.h5")
ANY_KEY = re.compile(rb"(?=([0-9a-f]{20}))")  # every 20 hexadecimal digits in a row
REMEDY = "move it away, then run its studies again"
FOREIGN_LINES = "is no file of compsim's: what it holds of its jobs cannot be read"
MAX_LINE = 1 << 20  # bytes that are known of one job, on average over a segment

# columns that are no numbers of ROW: (type, phrase, pattern of its texts)
COLUMNS = {
    "key": ("S20", "a job's identity", HEX20),
    "physics_key": ("S20", "hash of what a job simulates, not how", ""),
    "status": ("S", "ok or failed", "ok|failed"),
    "reason": ("S", "why a run failed, by a stable name", "[a-z_]*"),
    "serial": ("i8", "order of writing; of a job's equally good rows the greatest counts", ""),
    "samples": ("i8", "length of the time series; 0: none is kept", ""),
    "end": ("f8", "last time of the series, s", ""),
    "precision": ("S", "of the series: double or single", "(single|double)?"),
    "digest": ("S20", "of the file with the series", f"({HEX20})?"),
    "promise": ("S", "kept, or none given; empty in files of before 2026-11-22", "(kept|none)?"),
    "regime": ("S", "how far the motion can be foretold; empty where that is not known",
               "|".join(["", *Regime])),
    "signals": ("S", "yes where there are metrics of signals, and signals beside any time series",
                "(yes)?"),
}  # fmt: skip
LATER_COLUMNS = ("promise", "regime", "signals")  # columns that older files do not have


@dataclass(frozen=True, eq=False)
class Segment:
    """The rows of one segment."""

    path: Path  # of its file; empty before it has one
    columns: dict[str, np.ndarray]  # each of shape (rows,)
    numbers_or_file: np.ndarray | bytes  # its numbers, dtype ROW, (rows,), or its file's bytes
    texts: bytes  # zlib of each row's attributes as JSON, a line a row
    notes: bytes  # the same of each row's `detail`

    def __len__(self) -> int:
        return len(self.columns["key"])

    def numbers(self, *names: str) -> np.ndarray:
        """Return the numbers of the rows, dtype ROW or those fields of it that are named, (rows,).

        They are read each time: few ask for them, and they are a kilobyte a row.
        """
        kind = ROW if not names else np.dtype([(name, ROW[name]) for name in names])
        if isinstance(self.numbers_or_file, np.ndarray):
            return self.numbers_or_file[[*names]] if names else self.numbers_or_file
        found = np.full(len(self), np.nan, kind)
        with open_file(self.numbers_or_file, self.path, REMEDY) as file:
            for name in kind.names or ():
                if name in file:
                    found[name] = read_variable(file[name], self.numbers_or_file)
        return found

    @cached_property
    def names(self) -> frozenset[str]:
        """Return the names of the numbers that the segment has; others are nan in all rows."""
        if isinstance(self.numbers_or_file, np.ndarray):
            return frozenset(NUMBERS)
        with open_file(self.numbers_or_file, self.path, REMEDY) as file:
            return frozenset(name for name in NUMBERS if name in file)

    @property
    def place(self) -> Path:
        """Return the folder that holds `rows` and `jobs`."""
        return self.path.parent.parent

    @cached_property
    def details(self) -> list[bytes]:
        """Return what is known of each failure, as JSON."""
        return unpack_lines(self.notes, self)


def segment_name(number: int, data: bytes) -> str:
    """Return the name of a segment's file."""
    return f"{number:09}-{digest(data)}.h5"


def of_outcomes(outcomes: Iterable[Outcome], serial: int) -> Segment:
    """Return a segment of new rows, without a path."""
    outcomes = list(outcomes)
    series = [outcome.series or SeriesFile(0, 0.0, "", "") for outcome in outcomes]
    words = {
        "key": [outcome.key for outcome in outcomes],
        "physics_key": [str(outcome.attributes.get("physics_key", "")) for outcome in outcomes],
        "status": [outcome.status for outcome in outcomes],
        "reason": [outcome.reason for outcome in outcomes],
        "precision": [item.precision for item in series],
        "digest": [item.digest for item in series],
        "promise": [str(outcome.attributes.get("promise", "")) for outcome in outcomes],
        "regime": [str(outcome.attributes.get("regime", "")) for outcome in outcomes],
        "signals": ["yes" if o.attributes.get("signals") else "" for o in outcomes],
    }
    columns = {
        name: np.array([storable(value).encode() for value in values], COLUMNS[name][0])
        for name, values in words.items()
    }
    columns["serial"] = np.full(len(outcomes), serial)
    columns["samples"] = np.array([item.samples for item in series], int)
    columns["end"] = np.array([item.end for item in series], float)
    numbers = np.array([outcome.numbers for outcome in outcomes], ROW)
    texts = pack_lines(_line(outcome.attributes) for outcome in outcomes)
    return Segment(Path(), columns, numbers, texts, pack_lines(_line(o.detail) for o in outcomes))


def _line(value: Any) -> bytes:
    return json.dumps(value, default=lambda array: array.tolist()).encode()


def pack_lines(lines: Iterable[bytes]) -> bytes:
    return zlib.compress(b"\n".join(lines), level=1)


def unpack_lines(packed: bytes, segment: Segment) -> list[bytes]:
    """Return a line for each row of a segment. Raises DamagedJob."""
    try:
        inflater = zlib.decompressobj()
        lines = inflater.decompress(packed, MAX_LINE * (len(segment) + 1)).split(b"\n")
        if inflater.eof and len(lines) == max(1, len(segment)):
            return lines
        raise ValueError(f"{len(lines)} lines")
    except (zlib.error, ValueError) as error:
        raise DamagedJob(segment.path, FOREIGN_LINES, REMEDY) from error


def read_line(line: bytes, kind: type, segment: Segment) -> Any:
    """Return a line of a segment, of a kind of values. Raises DamagedJob."""
    try:
        value = json.loads(line)
        if isinstance(value, kind):
            return value
        raise ValueError(f"no {kind.__name__}")
    except (ValueError, RecursionError) as error:
        raise DamagedJob(segment.path, FOREIGN_LINES, REMEDY) from error


def encode(segment: Segment) -> bytes:
    """Return the bytes of a segment's file.

    The keys stand in it twice, first and last, so that damage can be reported by the job's name.
    """
    columns = segment.columns
    numbers = segment.numbers()
    present = [metric for name, metric in NUMBERS.items() if metric.is_given(numbers[name])]
    dims = {dim for metric in present for dim in metric.dims}
    variables: dict[str, Any] = {}
    for name, (names, values, attrs) in coordinates({"quantile", *dims}).items():
        kind = object if isinstance(values[0], str) else float
        variables[name] = (names, np.array(values, kind), attrs)
    for name, (_, phrase, _) in COLUMNS.items():
        variables[name] = (("row",), columns[name], {"long_name": phrase})
    for metric in present:
        name = metric.name
        variables[name] = (("row", *metric.dims), numbers[name], metric.attributes)
    for name, packed in (("attributes", segment.texts), ("details", segment.notes)):
        data = np.frombuffer(packed, np.uint8)
        attrs = {"long_name": "zlib of JSON, a line a row"}
        variables[name] = ((f"bytes_of_{name}",), data, attrs)
    variables["key_again"] = (("row",), columns["key"], {"long_name": COLUMNS["key"][1]})
    return image(variables, {"comment": "SI units"})


def decode(data: bytes, path: Path) -> Segment:
    """Return the segment that a file's bytes hold; a number that it does not have is nan.

    Raises DamagedJob for what is no segment.
    """
    with open_file(data, path, REMEDY) as file:
        rows = len(file["key"])
        columns = {}
        for name, (kind, _, pattern) in COLUMNS.items():
            absent = name in LATER_COLUMNS and name not in file
            values = np.full(rows, b"", "S1") if absent else read_variable(file[name], data)
            if values.dtype.kind != kind[0] or values.shape != (rows,):
                raise ValueError(name)
            like = re.compile(pattern.encode())
            if pattern and not all(map(like.fullmatch, np.unique(values).tolist())):
                raise ValueError(name)
            columns[name] = values
        for name in NUMBERS:
            if name in file:
                values = read_variable(file[name], data)  # not kept: may raise
                if values.shape != (rows, *ROW[name].shape) or values.dtype.kind != "f":
                    raise ValueError(name)
        blobs = (read_variable(file[name], data).tobytes() for name in ("attributes", "details"))
        return Segment(path, columns, data, *blobs)


def read_segment(path: Path) -> Segment:
    """Return a segment from its file. Raises Cut where its bytes are not as they were written."""
    data = path.read_bytes()
    named = NAME.fullmatch(path.name)
    if named is None or digest(data) != named[2]:
        raise Cut(path, "is damaged: its bytes are not those that were written", REMEDY, data)
    return decode(data, path)


class Cut(DamagedJob):
    """A segment whose bytes are not those that were written."""

    def __init__(self, path: Path, problem: str, remedy: str, data: bytes):
        super().__init__(path, problem, remedy)
        self.data = data

    def possible_keys(self) -> set[bytes]:
        """Return what may have been the keys of its jobs."""
        return {*ANY_KEY.findall(self.data)}


def merge(segments: Sequence[Segment]) -> Segment:
    """Return one segment with the rows that count of several segments, without a path."""
    rows = Rows.of(segments)
    chosen = [*zip(rows.source.tolist(), rows.row.tolist(), strict=True)]
    texts = [unpack_lines(segment.texts, segment) for segment in segments]
    return Segment(
        Path(),
        rows.columns,
        rows._numbers(*NUMBERS),
        pack_lines(texts[source][row] for source, row in chosen),
        pack_lines(segments[source].details[row] for source, row in chosen),
    )


@lru_cache(maxsize=4)
def _lines(segment: Segment) -> list[bytes]:
    """Return the attributes of each row of a segment, as JSON."""
    return unpack_lines(segment.texts, segment)


def completeness(columns: dict[str, np.ndarray]) -> np.ndarray:
    """Return how complete rows are, integers (rows,): failed 0, ok 1, with time series 3.

    Double precision adds 2, signals add 1.
    """
    series, double = columns["samples"] > 0, columns["precision"] == b"double"
    score = 1 + (columns["signals"] == b"yes") + series * (2 + 2 * double)
    return (columns["status"] == b"ok") * score


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows that count of many segments, one a job, in the order of their keys."""

    segments: tuple[Segment, ...]
    source: np.ndarray  # index of the segment, shape (jobs,)
    row: np.ndarray  # and of the row in it
    columns: dict[str, np.ndarray]
    gone: np.ndarray  # whether a job's row names time series whose file is gone, (jobs,)

    @classmethod
    def of(cls, segments: Sequence[Segment], has_files: Any = None) -> "Rows":
        """Return the rows of segments that count.

        has_files: returns which rows of a segment have all their files (default: all); the others
        count as rows without time series.
        """
        source = np.repeat(np.arange(len(segments)), [len(s) for s in segments])
        row = np.concatenate([np.arange(len(s)) for s in segments] or [np.zeros(0, int)])
        columns = {
            name: np.concatenate(
                [s.columns[name] for s in segments] or [np.zeros(0, kind if kind != "S" else "S1")]
            )
            for name, (kind, *_) in COLUMNS.items()
        }
        gone = np.zeros(len(row), bool)
        if has_files is not None and segments:
            gone = ~np.concatenate([has_files(s) for s in segments])
            columns["samples"][gone] = 0
            columns["precision"][gone] = columns["digest"][gone] = b""
        # by key, completeness and serial: of a key's rows the last one counts
        order = np.lexsort((columns["serial"], completeness(columns), columns["key"]))
        keys = columns["key"][order]
        chosen = order[np.append(keys[1:] != keys[:-1], True)[: len(keys)]]
        chosen_columns = {name: values[chosen] for name, values in columns.items()}
        return cls(tuple(segments), source[chosen], row[chosen], chosen_columns, gone[chosen])

    def __len__(self) -> int:
        return len(self.row)

    @cached_property
    def numbers(self) -> np.ndarray:
        """Return the numbers of every job, (jobs,): a kilobyte a job, read once.

        Those fields of ROW that every job has, or some segment: `number_row` has all of a job.
        """
        given = ALWAYS.union(name for segment in self.segments for name in segment.names)
        return self._numbers(*[name for name in NUMBERS if name in given])

    def number_row(self, position: int) -> np.void:
        """Return all numbers of a job, dtype ROW."""
        found, known = row(), self.numbers
        for name in known.dtype.names or ():
            found[name] = known[name][position]
        return found

    @cached_property
    def has_bars(self) -> np.ndarray:
        """Return whether metrics have error bars, (jobs,)."""
        return ~np.isnan(self._estimates["peak_acceleration_error"])

    @cached_property
    def has_horizon(self) -> np.ndarray:
        """Return whether it is known how long each motion can be foretold, (jobs,)."""
        return ~np.isnan(self._estimates[HORIZON])

    @cached_property
    def course(self) -> np.ndarray:
        """Return when each motion settled (rev) and how much of its record is clipped, (jobs,)."""
        return self._numbers("settled_rev", "clipped_fraction")

    @cached_property
    def _estimates(self) -> np.ndarray:
        return self._numbers("peak_acceleration_error", HORIZON)

    def _numbers(self, *names: str) -> np.ndarray:
        found: np.ndarray | None = None
        for number, segment in enumerate(self.segments):
            mine = np.flatnonzero(self.source == number)
            numbers = segment.numbers(*names)
            if found is None:
                found = np.empty(len(self), [(name, ROW[name]) for name in names])
            found[mine] = numbers[self.row[mine]]
        return np.empty(0, ROW) if found is None else found

    def find(self, keys: np.ndarray | Sequence[str]) -> np.ndarray:
        """Return the positions of jobs by key, in the shape of `keys`; -1 where there is none."""
        wanted = np.asarray(keys).astype("S20")
        if not len(self):
            return np.full(wanted.shape, -1)
        places = np.minimum(np.searchsorted(self.columns["key"], wanted), len(self) - 1)
        return np.where(self.columns["key"][places] == wanted, places, -1)

    @cached_property
    def words(self) -> dict[str, np.ndarray]:
        """Return status, reason, precision, promise, regime and signals of every job as text."""
        names = ("status", "reason", "precision", "promise", "regime", "signals")
        return {name: np.char.decode(self.columns[name], "utf-8", "replace") for name in names}

    def detail(self, position: int) -> str:
        """Return what is known of a job's failure."""
        segment = self.segments[self.source[position]]
        return read_line(segment.details[self.row[position]], str, segment)

    def attributes(self, position: int) -> dict[str, Any]:
        """Return a job's attributes; quick for jobs of the same segment one after the other."""
        segment = self.segments[self.source[position]]
        found = read_line(_lines(segment)[self.row[position]], dict, segment)
        try:
            return {n: np.array(v) if isinstance(v, list) else v for n, v in found.items()}
        except ValueError as error:
            raise DamagedJob(segment.path, FOREIGN_LINES, REMEDY) from error

    def path(self, position: int) -> Path | None:
        """Return the file with a job's time series, which may wait for its name; None for none."""
        if not self.columns["samples"][position]:
            return None
        key, checksum = (self.columns[name][position].decode() for name in ("key", "digest"))
        path = series_path(self.segments[self.source[position]].place, key, checksum)
        waiting = pending_path(path)
        return waiting if not path.exists() and waiting.exists() else path

    def intact(self, position: int) -> bool:
        """Return whether a job's file of time series, if it has one, is as it was written."""
        path = self.path(position)
        return path is None or intact(path)

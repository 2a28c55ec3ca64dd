"""Segments: files that each hold the outcomes of many jobs as columns, a row a job.

A segment is written once, as `<folder>/rows/<number>-<digest>.h5`, netCDF-4 like a job's file. The
digest of its bytes is in its name, and compared whenever it is read.
"""

import json
import re
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from compressor.cases import MODEL
from compressor.metrics import METRICS, NUMBERS, ROD_LOAD, SOMETIMES
from compressor.outcome import ROW, Outcome, Regime, SeriesFile, coordinates
from compressor.program import PROGRAM
from compressor.store.files import HEX20
from compressor.store.hdf5 import DamagedJob, digest, image, opened, storable

NAME = re.compile(rf"([0-9]{{9}})-({HEX20})\.h5")
GIVEN = digest(" ".join([PROGRAM, MODEL, *METRICS, *ROD_LOAD]).encode())[:8]  # by this version
DIGITS = re.compile(rb"[0-9a-f]{20,}")  # in which keys may stand
REMEDY = "move it away, then run its studies again"
WORDS = {  # columns -> what their texts look like
    "key": re.compile(HEX20.encode()),
    "status": re.compile(rb"ok|failed"),
    "reason": re.compile(rb"[a-z_]*"),
    "precision": re.compile(rb"(single|double)?"),
    "promise": re.compile(rb"(kept|none)?"),
    "regime": re.compile("|".join(["", *Regime]).encode()),
    "signals": re.compile(rb"(yes)?"),
    "digest": re.compile(f"({HEX20})?".encode()),
    "given": re.compile(rb"([0-9a-f]{8})?"),
}
FOREIGN_LINES = "is no file of compsim's: what it tells of its jobs cannot be read"
MOST_LINE = 1 << 20  # bytes that are known of one job, on average over a segment

# columns that are no numbers of ROW: (type, phrase)
COLUMNS = {
    "key": ("S20", "a job's identity"),
    "physics_key": ("S20", "hash of what a job simulates, not how"),
    "status": ("S", "ok or failed"),
    "reason": ("S", "why a run failed, by a stable name"),
    "serial": ("i8", "order of writing; of a job's equally good rows the greatest counts"),
    "samples": ("i8", "length of the time series; 0: none is kept"),
    "end": ("f8", "last time of the series, s"),
    "precision": ("S", "of the series: double or single"),
    "digest": ("S20", "of the file with the series"),
    "promise": ("S", "kept, or none given; empty in files of before 2026-11-22"),
    "regime": ("S", "how far the motion can be foretold; empty where that is not known"),
    "signals": ("S", "yes where signals are kept beside the time series"),
    "given": ("S8", "hash of the program, its model and the names of its metrics"),
}
LATER = ("promise", "regime", "signals", "given")  # columns that older files do not have


@dataclass(frozen=True, eq=False)
class Segment:
    """The rows of one segment."""

    path: Path  # of its file; empty before it has one
    columns: dict[str, np.ndarray]  # each of shape (rows,)
    held: np.ndarray | bytes  # its numbers, dtype ROW, (rows,), or the file that has them
    texts: bytes  # zlib of each row's attributes as JSON, a line a row
    notes: bytes  # the same of each row's `detail`

    def __len__(self) -> int:
        return len(self.columns["key"])

    def numbers(self, *names: str) -> np.ndarray:
        """Return the numbers of the rows, dtype ROW or those fields of it that are named, (rows,).

        They are read each time: few ask for them, and they are a kilobyte a row.
        """
        kind = ROW if not names else np.dtype([(name, ROW[name]) for name in names])
        if isinstance(self.held, np.ndarray):
            return self.held[[*names]] if names else self.held
        found = np.full(len(self), np.nan, kind)
        with opened(self.held, self.path, REMEDY) as file:
            for name in kind.names or ():
                if name in file:
                    found[name] = file[name][()]
        return found

    @property
    def place(self) -> Path:
        """The folder that holds `rows` and `jobs`."""
        return self.path.parent.parent

    @cached_property
    def details(self) -> list[bytes]:
        """What is known of each failure, as JSON."""
        return unpacked(self.notes, self)


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
        "signals": ["yes" if has_signals(outcome) else "" for outcome in outcomes],
        "given": [GIVEN for _ in outcomes],
    }
    columns = {name: _text_column(name, values) for name, values in words.items()}
    columns["serial"] = np.full(len(outcomes), serial)
    columns["samples"] = np.array([item.samples for item in series], int)
    columns["end"] = np.array([item.end for item in series], float)
    numbers = np.array([outcome.numbers for outcome in outcomes], ROW)
    texts = packed(_line(outcome.attributes) for outcome in outcomes)
    return Segment(Path(), columns, numbers, texts, packed(_line(o.detail) for o in outcomes))


def has_signals(outcome: Outcome) -> bool:
    """Return whether signals are kept of a job."""
    return outcome.series is not None and bool(outcome.attributes.get("signals"))


def _text_column(name: str, values: Sequence[str]) -> np.ndarray:
    return np.array([storable(value).encode() for value in values], COLUMNS[name][0])


def _line(value: Any) -> bytes:
    return json.dumps(value, default=lambda array: array.tolist()).encode()


def packed(lines: Iterable[bytes]) -> bytes:
    return zlib.compress(b"\n".join(lines), level=1)


def unpacked(packed: bytes, segment: Segment) -> list[bytes]:
    """Return a line for each row of a segment. Raises DamagedJob."""
    try:
        inflater = zlib.decompressobj()
        lines = inflater.decompress(packed, MOST_LINE * (len(segment) + 1)).split(b"\n")
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

    The keys stand in it twice, first and last, so that damage can be told by the job's name.
    """
    columns = segment.columns
    variables: dict[str, Any] = {}
    numbers = segment.numbers()
    for name, (dims, values, attrs) in coordinates().items():
        kind = object if isinstance(values[0], str) else float
        variables[name] = (dims, np.array(values, kind), attrs)
    for name, (_, phrase) in COLUMNS.items():
        variables[name] = (("row",), columns[name], {"long_name": phrase})
    for name, (dims, unit, phrase) in NUMBERS.items():
        values = numbers[name]
        if name not in SOMETIMES or not np.isnan(values).all():
            variables[name] = (("row", *dims), values, {"units": unit, "long_name": phrase})
    for name, packed in (("attributes", segment.texts), ("details", segment.notes)):
        data = np.frombuffer(packed, np.uint8)
        attrs = {"long_name": "zlib of JSON, a line a row"}
        variables[name] = ((f"bytes_of_{name}",), data, attrs)
    variables["key_again"] = (("row",), columns["key"], {"long_name": COLUMNS["key"][1]})
    return image(variables, {"Conventions": "SI units"})


def decode(data: bytes, path: Path) -> Segment:
    """Return the segment that a file's bytes hold; a number that it does not have is nan.

    Raises DamagedJob for what is no segment.
    """
    with opened(data, path, REMEDY) as file:
        rows = len(file["key"])
        absent = np.full(rows, b"", "S1")
        columns = {
            name: absent if name in LATER and name not in file else file[name][()]
            for name in COLUMNS
        }
        for name, (kind, _) in COLUMNS.items():
            if columns[name].dtype.kind != kind[0] or columns[name].shape != (rows,):
                raise ValueError(name)
        for name, pattern in WORDS.items():
            if not all(pattern.fullmatch(word) for word in np.unique(columns[name]).tolist()):
                raise ValueError(name)
        for name in NUMBERS:
            if name in file:
                values = file[name][()]  # not kept: what cannot be read is told now
                if values.shape != (rows, *ROW[name].shape) or values.dtype.kind != "f":
                    raise ValueError(name)
        blobs = (file[name][()].tobytes() for name in ("attributes", "details"))
        return Segment(path, columns, data, *blobs)


def read_segment(path: Path) -> Segment:
    """Return a segment from its file. Raises Cut where its bytes are not those that were
    written.
    """
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
        """Return what may have been the keys of its jobs: every 20 hexadecimal digits in a row."""
        return {
            run[0][start : start + 20]
            for run in DIGITS.finditer(self.data)
            for start in range(len(run[0]) - 19)
        }

"""The rows that count of many segments: one a job, in the order of their keys.

Of several rows of one job the one that is worth most counts (`worth`): runs that write at the same
time, each its own shard, take nothing from each other. Among equals it is the one with the greatest
`serial`: the number of the segment that it was first written to.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from compressor.metrics import HORIZON
from compressor.outcome import ROW
from compressor.store.files import pending_path
from compressor.store.hdf5 import DamagedJob
from compressor.store.segment import (
    COLUMNS,
    FOREIGN_LINES,
    REMEDY,
    Segment,
    packed,
    read_line,
    unpacked,
)
from compressor.store.series_file import intact, series_path


def merge(segments: Sequence[Segment]) -> Segment:
    """Return one segment with the rows that count of several segments, without a path."""
    rows = Rows.of(segments)
    chosen = [*zip(rows.source.tolist(), rows.row.tolist(), strict=True)]
    texts = [unpacked(segment.texts, segment) for segment in segments]
    return Segment(
        Path(),
        rows.columns,
        rows.numbers,
        packed(texts[source][row] for source, row in chosen),
        packed(segments[source].details[row] for source, row in chosen),
    )


@lru_cache(maxsize=4)
def _lines(segment: Segment) -> list[bytes]:
    """Return the attributes of each row of a segment, as JSON."""
    return unpacked(segment.texts, segment)


def worth(columns: dict[str, np.ndarray]) -> np.ndarray:
    """Return how much rows of one job tell: failed 0, ok 1, with time series 3, in double precision
    5.

    One more with signals.
    """
    series, double = columns["samples"] > 0, columns["precision"] == b"double"
    told = 1 + series * (2 + 2 * double + (columns["signals"] == b"yes"))
    return (columns["status"] == b"ok") * told


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows that count of many segments, one a job, in the order of their keys."""

    segments: tuple[Segment, ...]
    source: np.ndarray  # index of the segment, shape (jobs,)
    row: np.ndarray  # and of the row in it
    columns: dict[str, np.ndarray]

    @classmethod
    def of(cls, segments: Sequence[Segment], usable: Any = None) -> "Rows":
        """Merge segments; `usable` tells which rows of a segment there are (default: all)."""
        masks = [np.ones(len(s), bool) if usable is None else usable(s) for s in segments]
        source = np.repeat(np.arange(len(segments)), [mask.sum() for mask in masks])
        row = np.concatenate([np.flatnonzero(mask) for mask in masks] or [np.zeros(0, int)])
        columns = {
            name: np.concatenate(
                [s.columns[name][mask] for s, mask in zip(segments, masks, strict=True)]
                or [np.zeros(0, kind if kind != "S" else "S1")]
            )
            for name, (kind, _) in COLUMNS.items()
        }
        order = np.lexsort((columns["serial"], worth(columns), columns["key"]))
        keys = columns["key"][order]
        chosen = order[np.append(keys[1:] != keys[:-1], True)[: len(keys)]]
        chosen_columns = {name: values[chosen] for name, values in columns.items()}
        return cls(tuple(segments), source[chosen], row[chosen], chosen_columns)

    def __len__(self) -> int:
        return len(self.row)

    @cached_property
    def numbers(self) -> np.ndarray:
        """All numbers of every job, dtype ROW, (jobs,): a kilobyte a job, read when first used."""
        return self._numbers()

    @cached_property
    def barred(self) -> np.ndarray:
        """Whether metrics have error bars, (jobs,)."""
        return ~np.isnan(self._estimates["peak_acceleration_error"])

    @cached_property
    def foretold(self) -> np.ndarray:
        """Whether it is known how long a job's motion can be foretold, (jobs,)."""
        return ~np.isnan(self._estimates[HORIZON])

    @cached_property
    def course(self) -> np.ndarray:
        """When each motion settled (rev) and how much of its record is clipped, (jobs,)."""
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
                found = np.empty(len(self), numbers.dtype)
            found[mine] = numbers[self.row[mine]]
        return np.empty(0, ROW) if found is None else found

    def find(self, keys: np.ndarray | Sequence[str]) -> np.ndarray:
        """Return where jobs stand, by key, in an array of the shape of `keys`; -1: nowhere."""
        wanted = np.asarray(keys).astype("S20")
        if not len(self):
            return np.full(wanted.shape, -1)
        places = np.minimum(np.searchsorted(self.columns["key"], wanted), len(self) - 1)
        return np.where(self.columns["key"][places] == wanted, places, -1)

    @cached_property
    def words(self) -> dict[str, np.ndarray]:
        """Status, reason, precision, promise, regime and signals of every job as text."""
        names = ("status", "reason", "precision", "promise", "regime", "signals")
        return {name: np.char.decode(self.columns[name], "utf-8", "replace") for name in names}

    def detail(self, position: int) -> str:
        """Return what is known of a job's failure."""
        segment = self.segments[self.source[position]]
        return read_line(segment.details[self.row[position]], str, segment)

    def text(self, position: int) -> bytes:
        """Return a job's attributes as JSON; quick for jobs of the same segment one after the
        other.
        """
        return _lines(self.segments[self.source[position]])[self.row[position]]

    def attributes(self, position: int) -> dict[str, Any]:
        """Return a job's attributes; quick for jobs of the same segment one after the other."""
        segment = self.segments[self.source[position]]
        found = read_line(self.text(position), dict, segment)
        try:
            return {n: np.array(v) if isinstance(v, list) else v for n, v in found.items()}
        except ValueError as error:
            raise DamagedJob(segment.path, FOREIGN_LINES, REMEDY) from error

    def path(self, position: int) -> Path | None:
        """Return the file with a job's time series, which may wait for its name; None without
        any.
        """
        if not self.columns["samples"][position]:
            return None
        key, checksum = (self.columns[name][position].decode() for name in ("key", "digest"))
        path = series_path(self.segments[self.source[position]].place, key, checksum)
        waiting = pending_path(path)
        return waiting if not path.exists() and waiting.exists() else path

    def intact(self, position: int) -> bool:
        """Return whether the file with a job's time series, if there is one, is what was
        written.
        """
        path = self.path(position)
        return path is None or intact(path)

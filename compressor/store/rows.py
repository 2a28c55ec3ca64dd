"""The jobs of a folder of results: of several rows of a job the one that counts.

The most complete one counts (`completeness`), of equals the one that was written later. A run may
merge the batches of rows with others at any time: then they are looked for again (`Rows.fresh`).
"""

import itertools
import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from compressor.metrics import ALWAYS, NUMBERS
from compressor.outcome import ROW, Variable
from compressor.store.batch import (
    ERRORS,
    NAMES,
    WORDS,
    Batch,
    batch_paths,
    parse_attributes,
    read_batch,
    read_lines,
    read_numbers,
    read_one_series,
    read_series,
    spread_numbers,
)
from compressor.store.files import Folder, StoreError, system_error
from compressor.store.netcdf import DamagedFile

ATTEMPTS = 100  # at reading batches that a run merges meanwhile
Found = TypeVar("Found")
_ENDS = np.cumsum([math.prod(ROW[name].shape) for name in NUMBERS])
# positions of a number in the columns of ROW: first, one past the last
COLUMNS = {
    name: (int(end) - math.prod(ROW[name].shape), int(end))
    for name, end in zip(NUMBERS, _ENDS, strict=True)
}


def completeness(words: dict[str, np.ndarray], samples: np.ndarray) -> np.ndarray:
    """Return how complete rows are, integers (rows,): failed 0, ok 1, with time series 5.

    Double precision adds 4; signals, error bars and a horizon add 1 each.
    """
    series, double = samples > 0, words["precision"] == b"double"
    extras = sum((words[name] == b"yes").astype(int) for name in ("signals", "bars", "horizon"))
    return (words["status"] == b"ok") * (1 + extras + series * (4 + 4 * double))


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows that count of some batches, one a job, in the order of their keys."""

    folder: Path
    batches: tuple[Batch, ...]
    source: np.ndarray  # index of the batch, (jobs,)
    row: np.ndarray  # and of the row in it
    keys: np.ndarray  # bytes, (jobs,)
    bytes_of: dict[str, np.ndarray]  # the words of each job as bytes
    samples: np.ndarray  # length of the time series, 0 where none is kept
    ends: np.ndarray  # last time of the series, s

    @classmethod
    def of(cls, folder: Path, batches: Sequence[Batch]) -> "Rows":
        """Return the rows of a folder's batches that count; these are in the order of writing."""

        def join(parts: Sequence[np.ndarray], kind: str) -> np.ndarray:
            return np.concatenate([*parts, np.zeros(0, kind)])

        source = np.repeat(np.arange(len(batches)), [len(batch) for batch in batches])
        row = join([np.arange(len(batch)) for batch in batches], "i8")
        keys = join([batch.keys for batch in batches], "S1")
        words = {name: join([batch.words[name] for batch in batches], "S1") for name in WORDS}
        samples = join([batch.samples for batch in batches], "i8")
        ends = join([batch.ends for batch in batches], "f8")
        order = np.lexsort((source, completeness(words, samples), keys))
        last = np.append(keys[order][1:] != keys[order][:-1], True)[: len(keys)]
        at = order[last]
        words = {name: values[at] for name, values in words.items()}
        found = source[at], row[at], keys[at], words, samples[at], ends[at]
        return cls(folder, tuple(batches), *found)

    def __len__(self) -> int:
        return len(self.keys)

    def find(self, keys: np.ndarray | Sequence[str]) -> np.ndarray:
        """Return the positions of jobs by key, in the shape of `keys`; -1 where there is none."""
        wanted = np.asarray(keys).astype("S20")
        if not len(self):
            return np.full(wanted.shape, -1)
        places = np.minimum(np.searchsorted(self.keys, wanted), len(self) - 1)
        return np.where(self.keys[places] == wanted, places, -1)

    def word(self, name: str) -> np.ndarray:
        """Return a word of every job, of `batch.WORDS`, as text, (jobs,)."""
        return self.bytes_of[name].astype(str)

    @cached_property
    def given(self) -> frozenset[str]:
        """Return the names of the numbers that every job has, or some batch."""
        labels = {label for batch in self.batches for label in batch.labels}
        bars = {f"{NAMES[label]}_error" for label in labels & ERRORS.keys()}
        return ALWAYS | {NAMES[label] for label in labels} | bars

    def fresh(self, positions: np.ndarray, read: "Callable[[Rows, np.ndarray], Found]") -> Found:
        """Return what `read` gives of these rows and positions, (jobs,).

        Where their batches have been merged since: of the rows that the folder has now. Raises
        StoreError where jobs are gone.
        """
        rows = self
        for _ in range(ATTEMPTS):
            try:
                return read(rows, positions)
            except FileNotFoundError:
                there = positions >= 0
                keys = rows.keys[positions[there]]
                rows, _ = read_rows(self.folder)
                positions = positions.copy()
                positions[there] = rows.find(keys)
                if (positions[there] < 0).any():
                    raise StoreError(self.folder, "has lost jobs meanwhile", "try again") from None
        raise StoreError(self.folder, "changes faster than it can be read", "try again")

    def numbers(self, positions: np.ndarray, names: Sequence[str] = ()) -> dict[str, np.ndarray]:
        """Return numbers of jobs at positions by name, nan at -1 and where a job has none.

        names: by default those of `given`. Each has the shape of `positions`, then of its
        dimensions. They are read each time: a kilobyte a job. Raises DamagedFile.
        """
        flat = np.ravel(positions)
        names = names or [name for name in NUMBERS if name in self.given]
        columns = {name: COLUMNS[name] for name in names}
        wanted = np.concatenate([np.arange(*span) for span in columns.values()])
        found = self.fresh(flat, lambda rows, at: rows._numbers(at, wanted))
        ends = np.cumsum([end - begin for begin, end in columns.values()])
        shape = np.shape(positions)
        return {
            name: found[:, end - (span[1] - span[0]) : end].reshape((*shape, *ROW[name].shape))
            for (name, span), end in zip(columns.items(), ends.tolist(), strict=True)
        }

    def _numbers(self, positions: np.ndarray, wanted: np.ndarray) -> np.ndarray:
        """Return some columns of ROW of jobs at positions, nan at -1."""
        found = np.full((positions.size, wanted.size), np.nan)
        for number in np.unique(self.source[positions[positions >= 0]]).tolist():
            mine = np.flatnonzero((positions >= 0) & (self.source[positions] == number))
            batch, rows = self.batches[number], self.row[positions[mine]]
            parts = (part[rows] for part in read_numbers(batch.path))
            found[mine] = spread_numbers(batch.labels, *parts)[:, wanted]
        return found

    def number_row(self, position: int) -> np.void:
        """Return all numbers of a job, dtype ROW. Raises DamagedFile."""
        wanted = np.arange(ROW.itemsize // 8)
        found = self.fresh(np.array([position]), lambda rows, at: rows._numbers(at, wanted))
        return found.view(ROW)[0, 0]

    def attributes(self, position: int) -> dict[str, Any]:
        """Return a job's attributes. Raises DamagedFile."""
        return self.fresh(
            np.array([position]),
            lambda rows, at: parse_attributes(read_lines(rows.path(at[0]))[rows.row[at[0]]]),
        )

    def path(self, position: int) -> Path:
        """Return the batch with a job."""
        return self.batches[self.source[position]].path

    def series(self, position: int, names: Sequence[str] | None = None) -> dict[str, Variable]:
        """Return time series of a job by name, of `names` those that it has. Raises DamagedFile."""
        if not self.samples[position]:
            return {}
        return self.fresh(
            np.array([position]),
            lambda rows, at: read_series(rows.path(at[0]), int(rows.row[at[0]]), names),
        )

    def series_of_jobs(self, name: str, positions: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """Yield a series of each of some jobs that has it, with its place among positions, (n,).

        A batch is opened once. Raises DamagedFile, and FileNotFoundError, as `fresh` expects.
        """
        stored = np.flatnonzero((positions >= 0) & (self.samples[positions] > 0))
        order = stored[np.argsort(self.source[positions[stored]], kind="stable")]
        for number, places in itertools.groupby(
            order.tolist(), lambda place: int(self.source[positions[place]])
        ):
            mine = [*places]
            rows = self.row[positions[mine]].tolist()
            parts = read_one_series(self.batches[number].path, name, rows)
            yield from ((place, part) for place, part in zip(mine, parts, strict=True)
                        if part is not None)  # fmt: skip


def read_rows(folder: Folder) -> tuple[Rows, list[DamagedFile]]:
    """Return the rows of a folder, and its damaged batches.

    Raises StoreError, also where runs change the folder faster than it can be read.
    """
    folder = Path(os.path.abspath(folder))
    for _ in range(ATTEMPTS):
        batches, damaged = [], []
        try:
            for path in batch_paths(folder):
                try:
                    batches.append(read_batch(path))
                except DamagedFile as error:
                    damaged.append(error)
        except FileNotFoundError:
            continue  # merged with others meanwhile
        except OSError as error:
            raise system_error(folder, error) from error
        return Rows.of(folder, batches), damaged
    raise StoreError(folder, "changes faster than it can be read", "try again")

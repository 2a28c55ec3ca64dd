"""The jobs of a folder of results: of several rows of a job the one that counts.

The most complete one counts (`completeness`), of equals the one that was written later.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from compressor.metrics import ALWAYS, NUMBERS
from compressor.outcome import ROW, Variable
from compressor.store.batch import (
    ERRORS,
    NAMES,
    WORDS,
    Batch,
    parse_attributes,
    read_lines,
    read_numbers,
    read_one_series,
    read_series,
    spread_numbers,
)

_ENDS = np.cumsum([math.prod(ROW[name].shape) for name in NUMBERS])
# positions of a number in the columns of ROW: first, one past the last
COLUMNS = {
    name: (int(end) - math.prod(ROW[name].shape), int(end))
    for name, end in zip(NUMBERS, _ENDS, strict=True)
}


def completeness(words: dict[str, np.ndarray], samples: np.ndarray) -> np.ndarray:
    """Return how complete rows are, integers (rows,): failed 0, ok 1, with time series 3.

    Double precision adds 2, signals add 1.
    """
    series, double = samples > 0, words["precision"] == b"double"
    score = 1 + (words["signals"] == b"yes") + series * (2 + 2 * double)
    return (words["status"] == b"ok") * score


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows that count of some batches, one a job, in the order of their keys."""

    batches: tuple[Batch, ...]
    source: np.ndarray  # index of the batch, (jobs,)
    row: np.ndarray  # and of the row in it
    keys: np.ndarray  # bytes, (jobs,)
    bytes_of: dict[str, np.ndarray]  # the words of each job as bytes
    samples: np.ndarray  # length of the time series, 0 where none is kept
    ends: np.ndarray  # last time of the series, s

    @classmethod
    def of(cls, batches: Sequence[Batch]) -> "Rows":
        """Return the rows of batches that count; batches are in the order of writing."""

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
        return cls(tuple(batches), source[at], row[at], keys[at], words, samples[at], ends[at])

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

    def numbers(self, positions: np.ndarray, names: Sequence[str] = ()) -> dict[str, np.ndarray]:
        """Return numbers of jobs at positions by name, nan at -1 and where a job has none.

        names: by default those of `given`. Each has the shape of `positions`, then of its
        dimensions. They are read each time: a kilobyte a job. Raises DamagedFile.
        """
        flat = np.ravel(positions)
        names = names or [name for name in NUMBERS if name in self.given]
        columns = {name: COLUMNS[name] for name in names}
        wanted = np.concatenate([np.arange(*span) for span in columns.values()])
        found = np.full((flat.size, wanted.size), np.nan)
        for number in np.unique(self.source[flat[flat >= 0]]).tolist():
            mine = np.flatnonzero((flat >= 0) & (self.source[flat] == number))
            batch = self.batches[number]
            whole = spread_numbers(batch.labels, *read_numbers(batch))
            found[mine] = whole[np.ix_(self.row[flat[mine]], wanted)]
        ends = np.cumsum([end - begin for begin, end in columns.values()])
        shape = np.shape(positions)
        return {
            name: found[:, end - (span[1] - span[0]) : end].reshape((*shape, *ROW[name].shape))
            for (name, span), end in zip(columns.items(), ends.tolist(), strict=True)
        }

    def number_row(self, position: int) -> np.void:
        """Return all numbers of a job, dtype ROW. Raises DamagedFile."""
        batch = self.batches[self.source[position]]
        values, errors = (part[self.row[position]][np.newaxis] for part in read_numbers(batch))
        return spread_numbers(batch.labels, values, errors).view(ROW)[0, 0]

    def attributes(self, position: int) -> dict[str, Any]:
        """Return a job's attributes. Raises DamagedFile."""
        return parse_attributes(read_lines(self.path(position))[self.row[position]])

    def path(self, position: int) -> Path:
        """Return the batch with a job."""
        return self.batches[self.source[position]].path

    def series(self, position: int, names: Sequence[str] | None = None) -> dict[str, Variable]:
        """Return time series of a job by name, of `names` those that it has. Raises DamagedFile."""
        if not self.samples[position]:
            return {}
        return read_series(self.path(position), int(self.row[position]), names)

    def series_of_jobs(self, name: str, positions: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """Yield a series of each of some jobs that has it, with its place among positions, (n,).

        A batch is opened once. Raises DamagedFile, and FileNotFoundError.
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

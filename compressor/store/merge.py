"""Keep a folder of results tidy: merge small batches, set damaged ones aside."""

import contextlib
import math
from collections import defaultdict
from pathlib import Path

import numpy as np

from compressor.store.batch import encode_batch, publish_batch, read_outcomes
from compressor.store.files import Folder, discard_leftovers, refusals
from compressor.store.netcdf import DamagedFile
from compressor.store.stored import read_store

MAX_JOBS, MAX_BYTES = 4096, 32_000_000  # of a merged batch
SMALL = 0.25  # part of either, below which a batch is small
MAX_SMALL = 8  # small batches that may stay

Counting = tuple[Path, list[int], float]  # a batch, its rows that count, its part of a merged one


def merge_batches(folder: Folder) -> set[str]:
    """Merge the small batches of a folder, if there are many; return the keys of all jobs in it.

    A merged one is on disk before those that it replaces are removed. It has the rows that count,
    and is as old as the newest of them: what is written meanwhile counts as the later. Batches that
    cannot be read are set aside, and removed are those without a row that counts. Raises
    StoreError.
    """
    folder = Path(folder)
    with refusals(folder):
        discard_leftovers(folder)
        stored = read_store(folder)
        for damage in stored.damaged:
            set_aside(Path(damage.path))
        paths, source, row = stored.places
        small: dict[int, list[Counting]] = defaultdict(list)
        for number, path in enumerate(paths):
            mine = np.flatnonzero(source == number)
            share = _share(path, mine.size)
            if not mine.size:
                path.unlink(missing_ok=True)
            elif share < SMALL:
                length = int(stored.columns["samples"][mine].max())  # alike, lest series grow
                small[length].append((path, np.sort(row[mine]).tolist(), share))
        if sum(map(len, small.values())) > MAX_SMALL:
            for alike in small.values():
                _merge_alike(folder, alike)
        return stored.keys()


def set_aside(path: Path) -> None:
    """Rename a damaged batch, where that may be: its jobs count as missing, also for a run."""
    with contextlib.suppress(OSError):
        path.rename(f"{path}.damaged")


def _share(path: Path, jobs: int) -> float:
    """Return the part of a merged batch that a batch makes; inf where another run has merged it."""
    with contextlib.suppress(FileNotFoundError):
        return max(jobs / MAX_JOBS, path.stat().st_size / MAX_BYTES)
    return math.inf


def _merge_alike(folder: Path, batches: list[Counting]) -> None:
    """Merge batches in groups that are large enough."""
    numbers = np.cumsum([share for *_, share in batches]).astype(int)  # of each one's group
    for number in np.unique(numbers):
        group = [one for one, its in zip(batches, numbers, strict=True) if its == number]
        if len(group) > 1:
            _merge_group(folder, group)


def _merge_group(folder: Path, group: list[Counting]) -> None:
    """Write one batch in place of several, unless one is damaged, gone or of another version."""
    outcomes = []
    with contextlib.suppress(DamagedFile, FileNotFoundError):
        for path, rows, _ in group:
            found = read_outcomes(path)
            outcomes += [found[row] for row in rows]
        publish_batch(folder, encode_batch(outcomes), group[-1][0].name[:20])
        for path, *_ in group:
            path.unlink(missing_ok=True)

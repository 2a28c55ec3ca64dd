"""Keep a folder of results tidy: merge small batches, set damaged ones aside."""

import contextlib
from collections import defaultdict
from pathlib import Path

import numpy as np

from compressor.store.batch import encode_batch, publish_batch, read_outcomes
from compressor.store.files import Folder, discard_leftovers, refusals
from compressor.store.netcdf import DamagedFile
from compressor.store.stored import read_store

MAX_JOBS, MAX_BYTES = 4096, 32_000_000  # of a merged batch; one with a quarter of either is small
MAX_SMALL = 8  # small batches that may stay

Counting = tuple[Path, list[int]]  # a batch, and its rows that count


def merge_batches(folder: Folder) -> None:
    """Merge the small batches of a folder, of this run or another, if there are many.

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
        small: dict[object, list[Counting]] = defaultdict(list)
        for number, path in enumerate(paths):
            mine = np.flatnonzero(source == number)
            if not mine.size:
                path.unlink(missing_ok=True)
            elif mine.size < MAX_JOBS // 4 and 0 < _size(path) < MAX_BYTES // 4:
                # of one length and kind, lest time series grow
                kept = {*stored.columns["kept"][mine].tolist()}
                kinds = {(b"double" in k, b"compressed" in k) for k in kept if b"series" in k}
                length = int(stored.columns["samples"][mine].max())
                small[length, frozenset(kinds)].append((path, np.sort(row[mine]).tolist()))
        if sum(map(len, small.values())) > MAX_SMALL:
            for alike in small.values():
                _merge_alike(folder, alike)


def set_aside(path: Path) -> None:
    """Rename a damaged batch, where that may be: its jobs count as missing, also for a run."""
    with contextlib.suppress(OSError):
        path.rename(f"{path}.damaged")


def _size(path: Path) -> int:
    """Return the bytes of a batch; 0 where another run has merged it."""
    with contextlib.suppress(FileNotFoundError):
        return path.stat().st_size
    return 0


def _merge_alike(folder: Path, batches: list[Counting]) -> None:
    """Merge batches in groups that are large enough."""
    group: list[Counting] = []
    jobs = size = 0
    for number, (path, rows) in enumerate(batches, 1):
        group.append((path, rows))
        jobs, size = jobs + len(rows), size + _size(path)
        if jobs >= MAX_JOBS or size >= MAX_BYTES or number == len(batches):
            if len(group) > 1:
                _merge_group(folder, group)
            group, jobs, size = [], 0, 0


def _merge_group(folder: Path, group: list[Counting]) -> None:
    """Write one batch in place of several, unless one is damaged, gone or of another version."""
    outcomes = []
    with contextlib.suppress(DamagedFile, FileNotFoundError):
        for path, rows in group:
            found = read_outcomes(path)
            outcomes += [found[row] for row in rows]
        publish_batch(folder, encode_batch(outcomes), group[-1][0].name[:20])
        for path, _ in group:
            path.unlink(missing_ok=True)

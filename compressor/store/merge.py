"""Keep a folder of results tidy: merge small batches, set damaged ones aside."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from compressor.store.batch import (
    Batch,
    batch_paths,
    encode_batch,
    publish_batch,
    read_batch,
    read_outcomes,
)
from compressor.store.files import Folder, discard_leftovers, refusals
from compressor.store.netcdf import DamagedFile
from compressor.store.rows import Rows

MAX_JOBS, MAX_BYTES = 4096, 32_000_000  # of a merged batch; one with a quarter of either is small
MAX_SMALL = 8  # small batches that may stay


def merge_batches(folder: Folder) -> None:
    """Merge the small batches of a folder, of this run or another, if there are many.

    A merged one is on disk before those that it replaces are removed. Of a job that was run twice
    the row that counts is kept. Damaged ones are left. Raises StoreError.
    """
    with refusals(folder):
        discard_leftovers(folder)
        small = [path for path in batch_paths(folder) if _size(path) < MAX_BYTES // 4]
        if len(small) <= MAX_SMALL:
            return
        for group in _groups(small):
            if len(group) > 1:
                _merge(Path(folder), group)


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:  # merged by another run
        return MAX_BYTES


def _groups(paths: list[Path]) -> Iterator[list[Batch]]:
    """Yield batches that are to be merged: time series of one length, lest they be padded."""
    alike: dict[tuple[int, bool], list[Batch]] = {}
    for path in paths:
        with contextlib.suppress(DamagedFile, FileNotFoundError):
            batch = read_batch(path)
            kind = int(batch.samples.max()), batch.is_compressed
            if len(batch) < MAX_JOBS // 4:
                alike.setdefault(kind, []).append(batch)
    for batches in alike.values():
        group: list[Batch] = []
        for batch in batches:
            group.append(batch)
            size = sum(_size(one.path) for one in group)
            if sum(map(len, group)) >= MAX_JOBS or size >= MAX_BYTES:
                yield group
                group = []
        yield group


def _merge(folder: Path, group: list[Batch]) -> None:
    """Write one batch in place of several."""
    rows = Rows.of(group)
    try:
        found = [read_outcomes(batch) for batch in group]
    except (DamagedFile, FileNotFoundError):
        return
    chosen = zip(rows.source.tolist(), rows.row.tolist(), strict=True)
    outcomes = [found[source][row] for source, row in chosen]
    publish_batch(folder, encode_batch(outcomes, group[0].is_compressed))
    for batch in group:
        batch.path.unlink(missing_ok=True)


def set_aside(path: Path) -> None:
    """Rename a damaged batch, so that nobody reads it again; its jobs count as missing."""
    with contextlib.suppress(FileNotFoundError):
        os.rename(path, f"{path}.damaged")

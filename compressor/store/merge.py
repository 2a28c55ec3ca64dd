"""Keep a folder of results tidy: merge small batches, set damaged ones aside."""

import contextlib
import os
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from compressor.store.batch import Batch, encode_batch, publish_batch, read_outcomes
from compressor.store.files import Folder, discard_leftovers, refusals
from compressor.store.netcdf import DamagedFile
from compressor.store.rows import Rows, read_rows

MAX_JOBS, MAX_BYTES = 4096, 32_000_000  # of a merged batch; one with a quarter of either is small
MAX_SMALL = 8  # small batches that may stay


def merge_batches(folder: Folder) -> None:
    """Merge the small batches of a folder, of this run or another, if there are many.

    A merged one is on disk before those that it replaces are removed. It has the rows that count,
    and is as old as the newest of them: what is written meanwhile counts as the later. Batches that
    cannot be read are set aside, and removed are those without a row that counts. Raises
    StoreError.
    """
    with refusals(folder):
        discard_leftovers(folder)
        rows, damaged = read_rows(folder)
        for damage in damaged:
            set_aside(Path(damage.path))
        used = {*rows.source.tolist()}
        for number, batch in enumerate(rows.batches):
            if number not in used:
                batch.path.unlink(missing_ok=True)
        small = {n: size for n in sorted(used) if (size := _small_size(rows.batches[n]))}
        for group in _groups(rows, small) if len(small) > MAX_SMALL else ():
            if len(group) > 1:
                _merge(rows, group)


def _small_size(batch: Batch) -> int:
    """Return the bytes of a batch that is small, 0 of another."""
    try:
        size = batch.path.stat().st_size
    except FileNotFoundError:  # merged by another run
        return 0
    return size if size < MAX_BYTES // 4 and len(batch) < MAX_JOBS // 4 else 0


def _groups(rows: Rows, small: dict[int, int]) -> Iterator[list[int]]:
    """Yield which batches are to be merged: time series of one length and kind, lest they grow."""
    alike: dict[object, list[int]] = defaultdict(list)
    for number in small:
        batch = rows.batches[number]
        kinds = frozenset(batch.words["precision"].tolist()) - {b""}
        alike[int(batch.samples.max()), batch.is_compressed, kinds].append(number)
    for numbers in alike.values():
        group, jobs, size = [], 0, 0
        for number in numbers:
            group.append(number)
            jobs, size = jobs + len(rows.batches[number]), size + small[number]
            if jobs >= MAX_JOBS or size >= MAX_BYTES:
                yield group
                group, jobs, size = [], 0, 0
        yield group


def _merge(rows: Rows, group: list[int]) -> None:
    """Write one batch in place of several; none is replaced where one is damaged or gone."""
    batches = [rows.batches[number] for number in group]
    outcomes = []
    try:
        for number, batch in zip(group, batches, strict=True):
            found = read_outcomes(batch)
            counting = np.sort(rows.row[rows.source == number]).tolist()
            outcomes += [found[row] for row in counting]
    except (DamagedFile, FileNotFoundError):
        return
    written = batches[-1].path.name[:20]
    publish_batch(rows.folder, encode_batch(outcomes, batches[0].is_compressed), written)
    for batch in batches:
        batch.path.unlink(missing_ok=True)


def set_aside(path: Path) -> None:
    """Rename a damaged batch, so that nobody reads it again; its jobs count as missing."""
    with contextlib.suppress(FileNotFoundError):
        os.rename(path, f"{path}.damaged")

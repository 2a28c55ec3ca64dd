"""Keep a folder of results tidy: merge small batches, set damaged ones aside."""

import contextlib
import itertools
import math
from collections import defaultdict
from pathlib import Path

import numpy as np

from compressor.store.batch import encode_batch, publish_batch
from compressor.store.files import Folder, StoreError, discard_leftovers, refusals
from compressor.store.stored import Stored, read_store

MAX_JOBS, MAX_BYTES = 4096, 32_000_000  # of a merged batch
SMALL = 0.25  # part of either, below which a batch is small
MAX_SMALL = 8  # small batches that may stay

Counting = tuple[Path, np.ndarray, float]  # a batch, its jobs that count, its part of a merged one


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
        paths, source, _ = stored.places
        small: dict[int, list[Counting]] = defaultdict(list)
        for number, path in enumerate(paths):
            jobs = np.flatnonzero(source == number)
            share = _share(path, jobs.size)
            if not jobs.size:
                path.unlink(missing_ok=True)
            elif share < SMALL and path not in stored.foreign:
                length = int(stored.columns["samples"][jobs].max())  # alike, lest series grow
                small[length].append((path, jobs, share))
        if sum(map(len, small.values())) > MAX_SMALL:
            for alike in small.values():
                _merge_alike(stored, alike)
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


def _merge_alike(stored: Stored, batches: list[Counting]) -> None:
    """Merge batches in groups that are large enough, but those with one that cannot be read."""
    sums = itertools.accumulate(share for *_, share in batches)
    grouped = itertools.groupby(zip(sums, batches, strict=True), lambda one: int(one[0]))
    for paths, jobs, _ in (zip(*(one for _, one in group), strict=True) for _, group in grouped):
        if len(paths) < 2:
            continue
        try:
            outcomes = stored.outcomes(np.concatenate(jobs))
        except StoreError:
            continue
        if not {*paths} <= {*stored.places[0]}:
            continue  # another run has merged them meanwhile
        publish_batch(stored.folder, encode_batch(outcomes), paths[-1].name[:20])
        for path in paths:
            path.unlink(missing_ok=True)

"""Write rows into a store: one writer at a time, and what it has acknowledged stays.

Outcomes collect in memory and go to disk as one segment when there are many, or a second after the
last one. Small segments are merged now and then: the merged one is published first, those that it
replaces are removed after.
"""

import contextlib
import math
import os
import re
import socket
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType

import numpy as np

from compressor.outcome import Outcome
from compressor.store.files import (
    LOCK_NAME,
    Folder,
    StoreError,
    discard_leftovers,
    final_path,
    make_folder,
    name_pending,
    publish,
    refusals,
    sync_folder,
    system_error,
)
from compressor.store.reader import places, read_store, segment_paths, unowned_series
from compressor.store.rows import (
    Rows,
    Segment,
    encode,
    merge,
    of_outcomes,
    read_segment,
    segment_name,
)
from compressor.store.series_file import series_path

MAX_ROWS = 4096  # in a segment that is written at once; one with fewer is small
MAX_AGE = 1.0  # s between two writings, if they are small
MAX_SMALL = 32  # small segments before they are merged
MAX_SMALL_AT_END = 8  # that may stay when the writer ends
LOCK_SECONDS = 1.0  # s for which a lock's holder may leave its file empty
SHARD = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}")


class Writer:
    """The one writer of a store, or of a shard of it; a context manager.

    What is added is acknowledged by its key, from `add`, `flush_if_due` or `flush`, once it is on
    disk; leaving the context writes the rest, also when an exception ends it. `place` is where
    files of time series belong, `found` what the store held at the start, `unowned` how many
    files of time series there are of jobs that no row knows; they are left as they are.

    Of time series only those are removed that a better row of this store has replaced.

    Raises StoreError: at entry where another process writes there (unless `wait`), later where the
    disk refuses.
    """

    def __init__(self, folder: Folder, shard: str = "", wait: bool = False, command: str = ""):
        self.folder = Path(os.path.abspath(folder))
        self.place = self.folder
        if shard:
            if not SHARD.fullmatch(shard):
                raise StoreError(folder, f"{shard!r} is no shard's name", "use A-Z a-z 0-9 . _ -")
            self.place = self.folder / "shards" / shard
        self.wait, self.command = wait, command
        self.pending: dict[str, Outcome] = {}
        self.flushed = -math.inf  # monotonic time of the last writing
        self.small: dict[Path, int] = {}  # segments below MAX_ROWS -> their rows

    def __enter__(self) -> "Writer":
        self.lock = _lock(self.place / LOCK_NAME, self.wait, self.command)
        try:
            self.found = read_store(self.folder)
            self.number = max(map(_number, self._all_paths()), default=0)
            with refusals(self.place):
                damaged = self._damaged(self.place)
                _set_aside(damaged)
                mine = [s for s in self.found.segments if s.place == self.place]
                rows = Rows.of(mine)
                self._name_stored(rows)
                discard_leftovers(self.place)
                self._discard_replaced(mine, rows)
                self.unowned = 0 if damaged else len(unowned_series(self.place, rows))
                if self.place == self.folder:
                    self._mend_idle_shards()
            self.small = {s.path: len(s) for s in mine if len(s) < MAX_ROWS}
        except BaseException:
            _release(self.lock)
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            with contextlib.suppress(StoreError) if kind else contextlib.nullcontext():
                self.flush()
                if not kind and len(self.small) > MAX_SMALL_AT_END:
                    self._merge_small()
        finally:
            _release(self.lock)

    def add(self, outcome: Outcome) -> list[str]:
        """Add an outcome, whose time series are written already; return the keys now on disk."""
        self.pending[outcome.key] = outcome
        return self.flush_if_due()

    def flush_if_due(self) -> list[str]:
        """Write what waits, but at most once a second, and return the keys now on disk."""
        due = time.monotonic() - self.flushed >= MAX_AGE or len(self.pending) >= MAX_ROWS
        return self.flush() if due else []

    def flush(self) -> list[str]:
        """Write all that waits, and return the keys now on disk."""
        if not self.pending:
            return []
        keys = list(self.pending)
        segment = of_outcomes(self.pending.values(), self.number + 1)
        series = _series_paths(self.place, segment.columns)
        if series:  # whose names, even if they wait for others, must not be lost to a power cut
            with refusals(self.place):
                sync_folder(self.place / "jobs")
        path = self._publish(encode(segment))
        name_pending(series)
        if len(segment) < MAX_ROWS:
            self.small[path] = len(segment)
        self.pending, self.flushed = {}, time.monotonic()
        if len(self.small) >= MAX_SMALL:
            self._merge_small()
        return keys

    def _publish(self, data: bytes) -> Path:
        path = self.place / "rows" / segment_name(self.number + 1, data)
        publish(path, data)
        self.number += 1
        return path

    def _merge_small(self) -> None:
        """Merge the small segments, about MAX_ROWS rows to one."""
        batch: list[Path] = []
        for path in sorted(self.small):
            batch.append(path)
            if sum(self.small[one] for one in batch) >= MAX_ROWS:
                self._merge(batch)
                batch = []
        self._merge(batch)

    def _merge(self, paths: list[Path]) -> None:
        if len(paths) < 2:
            return
        with refusals(self.place):
            parts = [read_segment(path) for path in paths]
            segment = merge(parts)
            merged = self._publish(encode(segment))
            self._discard_replaced(parts, segment)
            for path in paths:
                path.unlink()
                del self.small[path]
        if len(segment) < MAX_ROWS:
            self.small[merged] = len(segment)

    def _all_paths(self) -> list[Path]:
        return [path for place in places(self.folder) for path in segment_paths(place)]

    def _damaged(self, place: Path) -> list[Path]:
        """Return the segments of a place that were damaged when this writer began."""
        paths = [Path(damage.path) for damage in self.found.damaged]
        return [path for path in paths if path.parent.parent == place]

    def _mend_idle_shards(self) -> None:
        """Set damage of shards aside where nobody writes; others do it when they next begin."""
        for place in places(self.folder)[1:]:
            damaged = self._damaged(place)
            if damaged:
                with contextlib.suppress(StoreError):  # another process writes there
                    lock = _lock(place / LOCK_NAME, False, self.command)
                    _set_aside(damaged)
                    os.close(lock)

    def _name_stored(self, rows: Rows) -> None:
        """Give files of time series their names that wait though their row is stored: a kill."""
        waiting = [*(self.place / "jobs").glob(".*.h5.tmp")]
        known = {*_series_paths(self.place, rows.columns)} if waiting else set()
        stored = known.intersection(map(final_path, waiting))
        name_pending(path for path in stored if not path.exists())

    def _discard_replaced(self, segments: Sequence[Segment], rows: Segment | Rows) -> None:
        """Remove the time series of rows that better ones have replaced, where these have theirs.

        Where `jobs` is a link, others may store there: nothing is removed.
        """
        if (self.place / "jobs").is_symlink() or sum(map(len, segments)) == len(rows):
            return
        chosen = _series_names(rows.columns)
        better = dict(chosen)
        for key, checksum in set().union(*(_series_names(s.columns) for s in segments)) - chosen:
            if key in better and series_path(self.place, key, better[key]).exists():
                series_path(self.place, key, checksum).unlink(missing_ok=True)


def _series_paths(place: Path, columns: Mapping[str, np.ndarray]) -> list[Path]:
    """Return the files of the rows that have time series."""
    return [series_path(place, key, checksum) for key, checksum in _series_names(columns)]


def _series_names(columns: Mapping[str, np.ndarray]) -> set[tuple[str, str]]:
    """Return key and digest of the rows that have time series."""
    has_series = columns["samples"] > 0
    names = (columns[name][has_series].tolist() for name in ("key", "digest"))
    return {(key.decode(), checksum.decode()) for key, checksum in zip(*names, strict=True)}


def _set_aside(paths: Iterable[Path]) -> None:
    """Rename damaged segments, so that nobody reads them again; their jobs count as missing."""
    for path in paths:
        with contextlib.suppress(FileNotFoundError):
            os.rename(path, f"{path}.damaged")


def _number(path: Path) -> int:
    """Return the number of a segment, from its name."""
    return int(path.name.partition("-")[0])


def _holder(descriptor: int) -> str:
    """Return who holds a lock, from its file; who took it just now is about to say so."""
    deadline = time.monotonic() + LOCK_SECONDS
    while not (text := os.pread(descriptor, 1000, 0)) and time.monotonic() < deadline:
        time.sleep(0.01)
    return text.decode(errors="replace").strip() or "another process"


def _lock(path: Path, wait: bool, command: str) -> int:
    """Return the descriptor of a lock, which this process has for as long as it stays open."""
    import fcntl  # not on Windows, where nothing is run

    make_folder(path.parent)
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError as error:
            holder = _holder(descriptor)
            os.close(descriptor)
            remedy = "wait for it to end, or choose another folder"
            raise StoreError(path, f"the store is in use by {holder}", remedy) from error
        os.ftruncate(descriptor, 0)
        holder = f"process {os.getpid()} on {socket.gethostname()}: {command}\n"
        os.write(descriptor, holder.encode(errors="backslashreplace"))
    except OSError as error:
        raise system_error(path, error) from error
    return descriptor


def _release(descriptor: int) -> None:
    """Give a lock back, and take our name off it first: the next holder is not us."""
    with contextlib.suppress(OSError):
        os.ftruncate(descriptor, 0)
    os.close(descriptor)

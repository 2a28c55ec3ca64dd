"""The store: a folder of finished jobs and of the studies they belong to.

README.md lists its files. Each appears under its name only when all of it is on disk. There is no
index: what is stored is read from the batches. A run may merge batches with others at any time:
then jobs are looked for again.
"""

import contextlib
import itertools
import os
import warnings
from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from compressor.cases import Case, CaseError
from compressor.metrics import ALWAYS, NUMBERS
from compressor.outcome import ROW, Outcome, Variable
from compressor.reasons import Reason
from compressor.store.batch import (
    ERRORS,
    OF_JOBS,
    VALUES,
    WORDS,
    Rows,
    batch_paths,
    name_of,
    places_of,
    read_attributes_of,
    read_batch,
    read_numbers,
    read_series,
)
from compressor.store.files import Folder, StoreError, StoreWarning, WrongName, system_error
from compressor.store.netcdf import DamagedFile, check_file

if TYPE_CHECKING:
    import xarray as xr

ATTEMPTS = 100  # at reading batches that a run merges meanwhile
Found = TypeVar("Found")


# what cases ask for without it being in their key, and a row has: its worth where a job has several
WORTH = {"bars": 1, "horizon": 1, "signals": 1, "series": 4, "double": 4}
OF_THE_END = {"bars", "horizon"}  # what a failed job cannot have
FINAL = {  # reasons of jobs that would fail again
    Reason.INTERNAL_ERROR,
    Reason.WORKER_DIED,
    Reason.OUT_OF_MEMORY,
    Reason.INVALID_INPUT,
}


def asked_by(case: Case) -> set[str]:
    """Return what a case asks for."""
    with_series = case.output.keep == "series"
    asked = {
        "bars": case.wants_bars,
        "horizon": case.solve.horizon is True,
        "signals": case.output.signals,
        "series": with_series,
        "double": with_series and case.output.precision == "double",
    }
    return {name for name, is_asked in asked.items() if is_asked}


def asking(case: Case, more: Set[str]) -> Case:
    """Return a case that asks for more, too."""
    output = replace(case.output, signals=case.output.signals or "signals" in more)
    if "series" in (wanted := asked_by(case) | more):
        precision = "double" if "double" in wanted else "single"
        output = replace(output, keep="series", precision=precision)
    solve = replace(
        case.solve,
        error_bars=case.solve.error_bars or "bars" in more,
        horizon=True if "horizon" in more else case.solve.horizon,
    )
    return replace(case, solve=solve, output=output)


def serving_both(first: Case, second: Case) -> Case:
    """Return a case with all that two cases of one key ask for beside it."""
    found = asking(first, asked_by(second))
    solve = replace(
        found.solve,
        horizon=found.solve.horizon or second.solve.horizon,  # it may be auto
        timeout_s=max(first.solve.timeout_s, second.solve.timeout_s),
    )
    return replace(found, solve=solve)


@dataclass(frozen=True)
class JobStatus:
    """How a stored job ended, and what is kept of it."""

    status: str  # ok | failed
    reason: str  # a stable name; empty when ok
    samples: int  # of the time series; 0 where only metrics are kept
    kept: frozenset[str]

    def satisfies(self, case: Case) -> bool:
        """Return whether a case needs no new run."""
        if self.reason == Reason.BUDGET_SECONDS:
            return False  # a machine with more time to spare may do it
        if self.reason in FINAL:
            return True
        if self.reason == Reason.ACCURACY_NOT_REACHED and not case.wants_bars:
            return False  # nothing is promised without error bars
        if self.status == "ok":
            return asked_by(case) <= self.kept
        return case.output.keep == "metrics" or asked_by(case) - OF_THE_END <= self.kept

    def with_stored_outputs(self, case: Case) -> Case:
        """Return a case that, run again, has all that this job has, time series as exact."""
        return asking(case, self.kept if self.status == "ok" else self.kept - OF_THE_END)


def completeness(columns: dict[str, np.ndarray]) -> np.ndarray:
    """Return how complete rows are, (rows,): failed 0, ok 1 and more for what is kept (`WORTH`)."""
    kinds, kind = np.unique(columns["kept"], return_inverse=True)
    worth = [sum(WORTH.get(name, 0) for name in one.decode().split()) for one in kinds]
    return (columns["status"] == b"ok") * (1 + np.array(worth, int)[kind])


class Stored:
    """The jobs that a folder held when it was read, in the order of their keys.

    Of several rows of a job the most complete one counts (`completeness`), of equals the one that
    was written later. `columns`: those of batches (`batch.Rows`), a value a job; `given`: the names
    of the numbers that every job has, or some batch; `damaged`: the batches that cannot be read;
    `foreign`: those with numbers of another version, which only that one can read.
    Jobs are named by their positions; methods that read a batch raise DamagedFile, and StoreError
    where a job is gone meanwhile.
    """

    def __init__(
        self, folder: Path, batches: dict[Path, Rows], damaged: Sequence[DamagedFile] = ()
    ):
        self.folder, self.damaged = folder, damaged
        self.checked: dict[Path, bool] = {}
        labels = {label for _, more in batches.values() for label in more}
        self.foreign = {path for path, (_, more) in batches.items() if not VALUES.keys() >= {*more}}
        none = dict.fromkeys(("job", *WORDS), np.zeros(0, "S1"))
        none |= {"samples": np.zeros(0, int), "end_time": np.zeros(0)}
        parts = [none, *(columns for columns, _ in batches.values())]
        whole = {name: np.concatenate([part[name] for part in parts]) for name in none}
        counts = [len(part["job"]) for part in parts]
        source = np.repeat(np.arange(-1, len(batches)), counts)
        row = np.concatenate([*map(np.arange, counts)])
        order = np.lexsort((source, completeness(whole), whole["job"]))
        keys = whole["job"][order]
        at = order[np.append(keys[1:] != keys[:-1], True)[: len(keys)]]
        self.columns = {name: values[at] for name, values in whole.items()}
        # where each job is: all batches, index of its batch, of the row in it; replaced as one
        self.places = tuple(batches), source[at], row[at]
        bars = {f"{name_of(label)}_error" for label in labels & ERRORS.keys()}
        self.given = ALWAYS | {name_of(label) for label in labels} | bars

    def __len__(self) -> int:
        return len(self.columns["job"])

    # ---- which jobs there are -------------------------------------------------------------------

    def keys(self) -> set[str]:
        """Return the keys of all stored jobs, failed ones included."""
        return {key.decode() for key in self.columns["job"]}

    def find(self, keys: np.ndarray | Sequence[str]) -> np.ndarray:
        """Return the positions of jobs by key, in the shape of `keys`; -1 where there is none."""
        wanted, mine = np.char.encode(np.asarray(keys, "U")), self.columns["job"]
        if not len(self):
            return np.full(wanted.shape, -1)
        places = np.minimum(np.searchsorted(mine, wanted), len(self) - 1)
        return np.where(mine[places] == wanted, places, -1)

    def position(self, key: str) -> int | None:
        """Return the position of a job; None where it is not stored."""
        position = int(self.find([key])[0])
        return position if position >= 0 else None

    def words(self, name: str) -> np.ndarray:
        """Return a word of every job, of `batch.WORDS`, as text, (jobs,)."""
        return self.columns[name].astype(str)

    # ---- how they ended -------------------------------------------------------------------------

    def status(self, key: str) -> JobStatus | None:
        """Return how a stored job ended; None where it is not stored."""
        position = self.position(key)
        return None if position is None else self.status_at(position)

    def status_at(self, position: int) -> JobStatus:
        """Return how the job at a position ended; nothing is read of its batch."""
        status, reason, kept = (
            self.columns[name][position].decode() for name in ("status", "reason", "kept")
        )
        return JobStatus(
            status, reason, int(self.columns["samples"][position]), frozenset(kept.split())
        )

    def detail(self, position: int) -> str:
        """Return what is known of a failure beyond its reason."""
        return str(self.attributes(position).get("detail", ""))

    # ---- what is read of their batches ----------------------------------------------------------

    def _read(self, read: Callable[[], Found]) -> Found:
        """Return what `read` gives; look for all jobs again where their batches are gone."""
        for _ in range(ATTEMPTS):
            with contextlib.suppress(FileNotFoundError):
                return read()
            now = read_store(self.folder)
            at = now.find(self.columns["job"])
            if (at < 0).any():
                raise StoreError(self.folder, "has lost jobs meanwhile", "try again")
            batches, source, row = now.places
            self.places = batches, source[at], row[at]
        raise StoreError(self.folder, "changes faster than it can be read", "try again")

    def _by_batch(self, positions: np.ndarray) -> Iterator[tuple[Path, list[int], list[int]]]:
        """Yield each batch of jobs at positions, the places among these, and rows; without -1."""
        paths, source, row = self.places
        stored = np.flatnonzero(positions >= 0)
        order = stored[np.argsort(source[positions[stored]], kind="stable")].tolist()
        for number, places in itertools.groupby(order, lambda at: int(source[positions[at]])):
            mine = [*places]
            yield paths[number], mine, row[positions[mine]].tolist()

    def batch_of(self, position: int) -> tuple[Path, int]:
        """Return the batch with a job, and the row in it."""
        paths, source, row = self.places
        return paths[source[position]], int(row[position])

    def intact(self, position: int) -> bool:
        """Return whether the batch of a job is as it was written, but for its time series.

        These may be many gigabytes; `verify` and who uses them read them.
        """
        path, _ = self.batch_of(position)
        if path not in self.checked:
            try:
                self._read(lambda: check_file(self.batch_of(position)[0], OF_JOBS))
                self.checked[path] = True
            except DamagedFile:
                self.checked[path] = False
        return self.checked[path]

    def numbers(self, positions: Any, names: Sequence[str] = ()) -> np.ndarray:
        """Return numbers of jobs, in the shape of `positions`, nan at -1 and where a job has none.

        A structured array with the dtype of ROW, or of some `names` in it. They are read each time:
        a kilobyte a job.
        """
        names, flat = names or tuple(NUMBERS), np.ravel(positions)
        wanted = places_of(names)
        found = np.full((flat.size, wanted.size), np.nan)

        def fill() -> None:
            for path, places, rows in self._by_batch(flat):
                found[places] = read_numbers(path, rows, wanted)

        self._read(fill)
        kind = np.dtype([(name, ROW[name]) for name in names])
        return found.view(kind)[:, 0].reshape(np.shape(positions))

    def attributes(self, position: int) -> dict[str, Any]:
        """Return a job's attributes."""
        return self._read(lambda: read_attributes_of(*self.batch_of(position)))

    def case_at(self, position: int) -> Case | None:
        """Return the case of a job; None at -1, or where it is of another version's."""
        if position < 0:
            return None
        try:
            return Case.from_attribute(self.attributes(position)["case"])
        except (KeyError, CaseError):
            return None

    def outcome(self, position: int) -> Outcome:
        """Return the outcome of a job, without its time series."""
        status, reason = (self.columns[name][position].decode() for name in ("status", "reason"))
        return Outcome(status, reason, self.numbers([position])[0], self.attributes(position))

    def outcomes(self, positions: np.ndarray) -> list[Outcome]:
        """Return all that is stored of jobs; how they ended is of when the store was read."""
        ends = (self.words(name)[positions].tolist() for name in ("status", "reason"))
        found = zip(*ends, self.numbers(positions), positions, self.series(positions), strict=True)
        return [
            Outcome(status, reason, row, self.attributes(at), one)
            for status, reason, row, at, one in found
        ]

    def series(
        self, positions: Any, names: Sequence[str] | None = None
    ) -> list[dict[str, Variable]]:
        """Return time series of jobs by name, of `names` those that each has; {} at -1."""
        whole = np.where(self.columns["samples"][positions] > 0, positions, -1)
        found: list[dict[str, Variable]] = [{} for _ in whole]

        def fill() -> None:
            for path, places, rows in self._by_batch(whole):
                for place, one in zip(places, read_series(path, rows, names), strict=True):
                    found[place] = one

        self._read(fill)
        return found

    def values(self, key: str, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return some variables of a stored job's time series."""
        position = self.position(key)
        found = {} if position is None else self.series([position], names)[0]
        return {name: one.values for name, one in found.items()}

    def job(self, key: str) -> "xr.Dataset":
        """Return a stored job's Dataset. Raises StoreError where it is missing or damaged."""
        import xarray as xr  # half a second

        position = self.position(key)
        if position is None:
            raise WrongName(self.folder, f"job {key} is not stored", "run its study first")
        outcome = self.outcome(position)
        return xr.Dataset(outcome.table(self.series([position])[0]), attrs=outcome.attributes)


def read_store(folder: Folder, warn: bool = False) -> Stored:
    """Return what a folder holds; damaged batches are listed in `damaged`.

    warn: give a StoreWarning of each. Raises StoreError, also where runs change the folder faster
    than it can be read.
    """
    folder = Path(os.path.abspath(folder))
    for _ in range(ATTEMPTS):
        batches, found = {}, []
        try:
            for path in batch_paths(folder):
                try:
                    batches[path] = read_batch(path)
                except DamagedFile as error:
                    found.append(error)
        except FileNotFoundError:
            continue  # merged with others meanwhile
        except OSError as error:
            raise system_error(folder, error) from error
        for damage in found if warn else ():
            warnings.warn(f"{damage}: its jobs count as missing", StoreWarning, stacklevel=3)
        return Stored(folder, batches, found)
    raise StoreError(folder, "changes faster than it can be read", "try again")

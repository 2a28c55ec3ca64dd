"""The store: a folder of finished jobs and of the studies they belong to.

    <folder>/rows/<number>-<digest>.h5   how many jobs ended, and their numbers: `rows`
    <folder>/jobs/<key>-<digest>.h5      one job with its time series, where kept: `series_file`
    <folder>/studies/<name>.json         one study: axes, keys of its jobs in C order: `studies`
    <folder>/former/<name>~<n>.json      the same of a study that another of its name has replaced
    <folder>/shards/<shard>/{rows,jobs}  the same of a run that is one of several

A job is stored when it has a row. Where the file of time series that a row names is gone, as in a
copy without `jobs`, the job has its metrics, and no series. Every file
appears under its name only when all of it is on disk, and carries a digest of its bytes. There is
no index: what is stored is read from the rows. `compressor.store.writer` writes them.
"""

import os
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compressor.cases import Case, CaseError, PerJoint
from compressor.outcome import Outcome, word_variables
from compressor.reasons import Reason
from compressor.store.files import (
    HEX20,
    KEY,
    Folder,
    StoreError,
    StoreWarning,
    pending_path,
    system_error,
)
from compressor.store.hdf5 import DamagedJob
from compressor.store.rows import NAME, Cut, Rows, Segment, read_segment
from compressor.store.series_file import read_series, read_values
from compressor.store.studies import StoredStudy, find_study, read_studies

if TYPE_CHECKING:
    import xarray as xr

BOTH_JOINTS = (
    "`fault` is the swept joint, and `joint` the one that a number belongs to: select both, as in "
    "study.sel(fault='big_end', joint='big_end')"
)


# reasons that leave no time series
RERUN_REASONS = {
    Reason.INTERNAL_ERROR,
    Reason.WORKER_DIED,
    Reason.OUT_OF_MEMORY,
    Reason.INVALID_INPUT,
}
NAMED = re.compile(rf"{HEX20}-{HEX20}\.h5")  # a file of time series that waits no longer
ATTEMPTS = 100  # at reading segments that a writer replaces meanwhile


@dataclass(frozen=True)
class JobStatus:
    """How a stored job ended, and what is kept of it."""

    key: str
    status: str  # ok | failed
    reason: str  # a stable name; empty when ok
    detail: str
    samples: int  # of the time series; 0 where only metrics are kept
    precision: str  # of the time series: double | single
    signals: bool  # whether there are metrics of them, and they are among any time series
    bars: bool  # whether metrics have error bars
    has_horizon: bool  # whether it is known how long the motion can be foretold
    rows: Rows
    position: int

    @property
    def numbers(self) -> np.void:
        """Return the job's numbers, dtype ROW."""
        return self.rows.number_row(self.position)

    def satisfies(self, case: Case) -> bool:
        """Return whether a case needs no new run.

        The one place that knows of what a case may ask for without it being in its key.
        """
        if self.reason == Reason.BUDGET_SECONDS:
            return False  # a machine with more time to spare may do it
        if self.reason in RERUN_REASONS:
            return True
        if self.reason == Reason.ACCURACY_NOT_REACHED and not case.wants_bars:
            return False  # nothing is promised without error bars
        if case.wants_bars and self.status == "ok" and not self.bars:
            return False
        if case.solve.horizon is True and self.status == "ok" and not self.has_horizon:
            return False
        metrics_alone = case.output.keep == "metrics"
        has_metrics = self.status == "ok" or not metrics_alone
        if case.output.signals and has_metrics and not self.signals:
            return False
        if metrics_alone:
            return True
        return self.samples > 0 and (self.precision, case.output.precision) != ("single", "double")

    def with_stored_outputs(self, case: Case) -> Case:
        """Return a case that, run again, has the time series of this job, as exact as they are.

        Where the job is ok, it has its error bars and its horizon as well.
        """
        solve = case.solve
        output = replace(case.output, signals=case.output.signals or self.signals)
        if self.status == "ok":
            horizon = True if self.has_horizon and not solve.horizon else solve.horizon
            solve = replace(solve, error_bars=solve.error_bars or self.bars, horizon=horizon)
        if self.samples:
            exact = {self.precision} | ({output.precision} if output.keep == "series" else set())
            precision = "double" if "double" in exact else "single"
            output = replace(output, keep="series", precision=precision)
        return replace(case, solve=solve, output=output)


class Stored:
    """What a folder held when it was read: `rows`, and the segments that are `damaged`."""

    def __init__(self, folder: Path, segments: Sequence[Segment], damaged: Sequence[DamagedJob]):
        self.folder, self.segments, self.damaged = folder, segments, damaged
        self.rows = Rows.of(segments, _has_files)

    def warned(self) -> "Stored":
        """Return this store, after a StoreWarning of each damage, whose jobs count as missing."""
        for damage in self.damaged:
            text = f"{damage}: its jobs count as missing"
            warnings.warn(text, StoreWarning, stacklevel=3)
        return self

    def keys(self) -> set[str]:
        """Return the keys of all stored jobs, failed ones included."""
        return {key.decode() for key in self.rows.columns["key"]}

    def position(self, key: str) -> int | None:
        """Return the position of a job in `rows`; None where it is not stored."""
        position = int(self.rows.find([key])[0])
        return position if position >= 0 else None

    def physics_key(self, key: str) -> str:
        """Return what a stored job simulates, by its hash."""
        return bytes(self.rows.columns["physics_key"][self.position(key)]).decode()

    def status(self, key: str) -> JobStatus | None:
        """Return how a stored job ended; None where it is not stored."""
        position = self.position(key)
        return None if position is None else self.status_at(position)

    def status_at(self, position: int) -> JobStatus:
        """Return how the job at a position of `rows` ended."""
        rows = self.rows
        words = {name: str(values[position]) for name, values in rows.words.items()}
        return JobStatus(
            rows.columns["key"][position].decode(),
            words["status"],
            words["reason"],
            rows.detail(position) if words["status"] != "ok" else "",
            int(rows.columns["samples"][position]),
            words["precision"],
            words["signals"] == "yes",
            bool(rows.has_bars[position]),
            bool(rows.has_horizon[position]),
            rows,
            position,
        )

    def case_at(self, position: int) -> Case | None:
        """Return the case at a position of `rows`; None at -1, or of another version's.

        A position of -1 is how `Rows.find` says that there is no such job.
        """
        if position < 0:
            return None
        try:
            return Case.from_attribute(self.rows.attributes(position)["case"])
        except (KeyError, CaseError):
            return None

    def serving(self, positions: np.ndarray, case: Case) -> np.ndarray:
        """Return whether each of the jobs at some positions needs no new run for a case, boolean.

        Jobs of one kind, in all that `JobStatus.satisfies` reads, are checked once.
        """
        first, kinds = self._kinds
        satisfied = np.array([self.status_at(at).satisfies(case) for at in first.tolist()], bool)
        return satisfied[kinds[positions]] if len(positions) else np.zeros(0, bool)

    @cached_property
    def _kinds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the position of the first job of each kind, and the kind of each job, (jobs,)."""
        rows, columns = self.rows, self.rows.columns
        _, code = np.unique(columns["reason"], return_inverse=True)
        code = 3 * code + np.unique(columns["precision"], return_inverse=True)[1]
        for flag in (
            columns["status"] == b"ok", columns["signals"] == b"yes", columns["samples"] > 0,
            rows.has_bars, rows.has_horizon,
        ):  # fmt: skip
            code = 2 * code + flag
        _, first, kinds = np.unique(code, return_index=True, return_inverse=True)
        return first, kinds

    def outcome(self, position: int) -> Outcome:
        """Return the outcome of the job at a position of `rows`."""
        words = {name: str(values[position]) for name, values in self.rows.words.items()}
        attributes = self.rows.attributes(position)
        numbers = self.rows.number_row(position)
        return Outcome(words["status"], words["reason"], numbers, attributes)

    def find_ok(self, key: str, healthy: PerJoint) -> tuple[Case, Outcome] | str:
        """Return the case and outcome of a job that is ok, else why there are none, in a word.

        healthy: the clearance up to which a joint of the case counts as sound.
        """
        position = self.position(key)
        if position is None:
            return "missing"
        outcome = self.outcome(position)
        if outcome.status != "ok":
            return outcome.reason
        case = self.case_at(position)
        if case is None:
            return "damaged"
        return replace(case, healthy_clearance_mm=healthy), outcome

    def job(self, key: str) -> "xr.Dataset":
        """Return a stored job's Dataset. Raises StoreError where it is missing or damaged."""
        if not KEY.fullmatch(key):
            raise StoreError(self.folder, f"{key!r} is no key", "a key is 20 hexadecimal digits")
        position = self.position(key)
        if position is None:
            raise StoreError(self.folder, f"job {key} is not stored", "run its study first")
        path = self.rows.path(position)
        if path is not None:
            return read_series(path)
        import xarray as xr

        found = self.outcome(position)
        table = found.table({})
        return xr.Dataset(table.variables, attrs=table.attrs)

    def label(self, studies: Sequence[StoredStudy], trusted: bool = False) -> "xr.Dataset":
        """Return studies of this store as one Dataset, as `open_study` does."""
        from compressor.store import dataset as datasets  # loads xarray: half a second

        is_grid = len(studies) == 1 and studies[0].is_grid
        layout = datasets.grid(studies[0]) if is_grid else datasets.table_of_jobs(studies)
        dataset = datasets.label_dataset(layout, self.rows, self.job, self.values)
        if trusted:
            dataset = datasets.mask_untrusted(dataset)
        dataset = dataset.assign(datasets.machine_constants(studies, layout))
        names = [study.name for study in studies]
        dataset.attrs = {"folder": os.path.abspath(self.folder), "studies": names}
        return dataset

    def values(self, key: str, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return some variables of a stored job's time series."""
        position = self.position(key)
        path = None if position is None else self.rows.path(position)
        return {} if path is None else read_values(path, names)


def _has_files(segment: Segment) -> np.ndarray:
    """Return which rows of a segment have the file of time series that they name, if they do."""
    columns = segment.columns
    has_series = columns["samples"] > 0
    if not has_series.any():
        return ~has_series
    listed = _names(segment.place / "jobs")
    names = np.array([name.removeprefix(".").removesuffix(".tmp") for name in listed], "S")
    wanted = np.char.add(np.char.add(np.char.add(columns["key"], b"-"), columns["digest"]), b".h5")
    usable = ~has_series | np.isin(wanted, names)
    for position in np.flatnonzero(~usable):  # a listing may miss what gets its name meanwhile
        path = segment.place / "jobs" / wanted[position].decode()
        # looked for twice: it may get its name while it is looked for under the pending one
        usable[position] = path.exists() or pending_path(path).exists() or path.exists()
    return usable


def _names(folder: Path) -> list[str]:
    """Return the files of a folder that may not be there."""
    try:
        return os.listdir(folder)
    except FileNotFoundError:
        return []
    except OSError as error:
        raise system_error(folder, error) from error


def unowned_series(place: Path, rows: Rows) -> list[str]:
    """Return the names of files of time series in a place whose jobs no row knows.

    A run that ends leaves none: rows are gone, or have not been copied yet. Where `jobs` is a link,
    others may store there.
    """
    if (place / "jobs").is_symlink():
        return []
    names = [name for name in _names(place / "jobs") if NAMED.fullmatch(name)]
    keys = {name[:20] for name in names}
    known = {key for key, at in zip(keys, rows.find([*keys]).tolist(), strict=True) if at >= 0}
    return sorted(name for name in names if name[:20] not in known)


def places(folder: Folder) -> list[Path]:
    """Return the folders that hold `rows` and `jobs`: the store's own, and its shards'.

    A link among the shards may lead out of the store, or back: it is none of them.
    """
    shards = (Path(folder) / "shards" / name for name in sorted(_names(Path(folder) / "shards")))
    return [Path(folder), *(place for place in shards if not place.is_symlink())]


def segment_paths(place: Path) -> list[Path]:
    """Return the segments of one place, in the order of their numbers."""
    return [place / "rows" / n for n in sorted(_names(place / "rows")) if NAME.fullmatch(n)]


def read_store(folder: Folder, bearable: type[DamagedJob] = Cut) -> Stored:
    """Return what a folder holds; `bearable` damage is listed in `damaged`, other is raised.

    Raises StoreError, also where writers change the folder faster than it can be read.
    """
    folder = Path(os.path.abspath(folder))
    for _ in range(ATTEMPTS):
        segments, damaged = [], []
        try:
            for path in (path for place in places(folder) for path in segment_paths(place)):
                try:
                    segments.append(read_segment(path))
                except bearable as error:
                    damaged.append(error)
        except FileNotFoundError:
            continue  # merged with others meanwhile
        except OSError as error:
            raise system_error(folder, error) from error
        return Stored(folder, segments, damaged)
    raise StoreError(folder, "changes faster than it can be read", "try again")


def read_job(folder: Folder, key: str) -> "xr.Dataset":
    """Return a stored job's Dataset: what `simulate` gives of its case, with series if stored.

    folder: of results; key: 20 hexadecimal digits, as `Case.key` and the coordinate `key` of a
    study have them. Raises StoreError where there is no such job, or a damaged one.

    After `compsim run wear.yaml` with the file of `load_cases`:

    >>> import compressor
    >>> study = compressor.open_study("results", "wear")
    >>> run = compressor.read_job("results", study.key.sel(clearance_mm=0.2).item())
    >>> run.acceleration.dims, compressor.Case.from_attribute(run.attrs["case"]).joint
    (('time',), 'big_end')
    """
    run = read_store(folder).job(key)
    return run.assign(word_variables(run.attrs))


def open_study(folder: Folder, name: str | None = None, trusted: bool = False) -> "xr.Dataset":
    """Return a study as one Dataset, labelled by its axes; series are read when they are used.

    folder: of results; name: of the study, all studies without. Variables and SI units are those
    of `simulate`.

    One study (that of `name`, or the only one) has its axes as dimensions: the last part of each
    swept key, such as `clearance_mm`, in the case file's unit; a swept `joint` is called `fault`.
    Several studies, and one that is no grid (zip, samples, exclude, blocks), have a `job` dimension
    with coordinates `study`, `fault`, `load` and each swept key. `key` names every job (see
    `read_job`), `status` is ok, failed or missing, and metrics are nan where a job did not reach
    its end. Numbers of the machine that are not swept, such as `rod_mass_kg`, are variables, too,
    so that `to_dataframe` has a column of each. Of a study that sweeps `joint` a StoreWarning says
    that `joint` alone does not select a fault.

    Series have the dimension `time`. If the jobs have different output grids (a swept speed),
    they have `sample` instead, nan beyond a job's end, with `time` a coordinate of every job.

    With `trusted`, metrics are nan where they are not known: where the error bar is as long as the
    number or inf, as of single peaks of a chaotic motion, or was not made; and where a job failed.

    Raises StoreError for a folder without results and for a study that it does not hold: a
    WrongName, which says what was probably meant. Of damaged files a StoreWarning is given, and
    their jobs count as missing.

    After `compsim run wear.yaml` with the file of `load_cases`:

    >>> import compressor
    >>> study = compressor.open_study("results", "wear")
    >>> one = study.sel(clearance_mm=0.2)
    >>> print(f"{one.peak_acceleration:.0f} ± {one.peak_acceleration_error:.1f} m/s2")
    647 ± 0.2 m/s2
    >>> surely_below = study.peak_acceleration + study.peak_acceleration_error < 700
    >>> study.clearance_mm.where(surely_below, drop=True).values.tolist()
    [0.1, 0.2]
    >>> study.acceleration.sel(clearance_mm=0.3).dims
    ('time',)
    """
    folder = os.path.abspath(folder)
    studies = read_studies(folder, former=name is not None)
    if name is not None:
        studies = [find_study(folder, name, studies)]
    dataset = read_store(folder).warned().label(studies, trusted)
    if "fault" in dataset.dims and "joint" in dataset.dims:
        warnings.warn(BOTH_JOINTS, StoreWarning, stacklevel=2)
    return dataset

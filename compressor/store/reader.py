"""The store: a folder of finished jobs and of the studies they belong to.

    <folder>/batches/<name>.h5      some jobs each, with their time series where kept: `batch`
    <folder>/studies/<name>.json    one study: axes, keys of its jobs in C order: `studies`

Every file appears under its name only when all of it is on disk. There is no index: what is stored
is read from the batches.
"""

import os
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
from compressor.store.files import KEY, Folder, StoreError, StoreWarning
from compressor.store.netcdf import DamagedFile, check_file
from compressor.store.rows import Rows, read_rows
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
    has_horizon: bool  # whether it is known how long the motion is predictable

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
    """What a folder held when it was read: `rows`, and the batches that are `damaged`."""

    def __init__(self, rows: Rows, damaged: Sequence[DamagedFile]):
        self.folder, self.rows, self.damaged = rows.folder, rows, damaged
        self.checked: dict[Path, bool] = {}

    def warned(self) -> "Stored":
        """Return this store, after a StoreWarning of each damage, whose jobs count as missing."""
        for damage in self.damaged:
            text = f"{damage}: its jobs count as missing"
            warnings.warn(text, StoreWarning, stacklevel=3)
        return self

    def without(self, damage: DamagedFile) -> "Stored":
        """Return this store less a damaged batch, after a StoreWarning. Raises other damage."""
        left = [batch for batch in self.rows.batches if os.fspath(batch.path) != damage.path]
        if len(left) == len(self.rows.batches):
            raise damage
        text = f"{damage}: its jobs count as missing"
        warnings.warn(text, StoreWarning, stacklevel=3)
        return Stored(Rows.of(self.folder, left), [*self.damaged, damage])

    def keys(self) -> set[str]:
        """Return the keys of all stored jobs, failed ones included."""
        return {key.decode() for key in self.rows.keys}

    def position(self, key: str) -> int | None:
        """Return the position of a job in `rows`; None where it is not stored."""
        position = int(self.rows.find([key])[0])
        return position if position >= 0 else None

    def status(self, key: str) -> JobStatus | None:
        """Return how a stored job ended; None where it is not stored."""
        position = self.position(key)
        return None if position is None else self.status_at(position)

    def status_at(self, position: int) -> JobStatus:
        """Return how the job at a position of `rows` ended."""
        words = {name: values[position].decode() for name, values in self.rows.bytes_of.items()}
        is_ok = words["status"] == "ok"
        return JobStatus(
            self.rows.keys[position].decode(),
            words["status"],
            words["reason"],
            "" if is_ok else str(self.rows.attributes(position).get("detail", "")),
            int(self.rows.samples[position]),
            words["precision"],
            words["signals"] == "yes",
            words["bars"] == "yes",
            words["horizon"] == "yes",
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
        names = ("status", "reason", "precision", "signals", "bars", "horizon")
        columns = [self.rows.bytes_of[name] for name in names]
        kinds = np.rec.fromarrays([*columns, self.rows.samples > 0])
        _, first, kind = np.unique(kinds, return_index=True, return_inverse=True)
        return first, kind

    def intact(self, position: int) -> bool:
        """Return whether the batch of a job is as it was written."""
        path = self.rows.path(position)
        if path not in self.checked:
            try:
                self.rows.fresh(np.array([position]), lambda rows, at: check_file(rows.path(at[0])))
                self.checked[path] = True
            except DamagedFile:
                self.checked[path] = False
        return self.checked[path]

    def outcome(self, position: int) -> Outcome:
        """Return the outcome of the job at a position of `rows`, without its time series."""
        words = {name: values[position].decode() for name, values in self.rows.bytes_of.items()}
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
        import xarray as xr

        if not KEY.fullmatch(key):
            raise StoreError(self.folder, f"{key!r} is no key", "a key is 20 hexadecimal digits")
        position = self.position(key)
        if position is None:
            raise StoreError(self.folder, f"job {key} is not stored", "run its study first")
        found = self.outcome(position).table(self.rows.series(position))
        return xr.Dataset(found.variables, attrs=found.attrs)

    def label(self, studies: Sequence[StoredStudy], trusted: bool = False) -> "xr.Dataset":
        """Return studies of this store as one Dataset, as `open_study` does."""
        from compressor.store import dataset as datasets  # loads xarray: half a second

        is_grid = len(studies) == 1 and studies[0].is_grid
        layout = datasets.grid(studies[0]) if is_grid else datasets.table_of_jobs(studies)
        dataset = datasets.label_dataset(layout, self.rows)
        if trusted:
            dataset = datasets.mask_untrusted(dataset)
        dataset = dataset.assign(datasets.machine_constants(studies, layout))
        names = [study.name for study in studies]
        dataset.attrs = {"folder": os.path.abspath(self.folder), "studies": names}
        return dataset

    def values(self, key: str, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return some variables of a stored job's time series."""
        position = self.position(key)
        found = {} if position is None else self.rows.series(position, names)
        return {name: one.values for name, one in found.items()}


def read_store(folder: Folder) -> Stored:
    """Return what a folder holds; damaged batches are listed in `damaged`.

    Raises StoreError, also where runs change the folder faster than it can be read.
    """
    return Stored(*read_rows(folder))


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
    studies = read_studies(folder)
    if name is not None:
        studies = [find_study(folder, name, studies)]
    stored = read_store(folder).warned()
    while True:
        try:
            dataset = stored.label(studies, trusted)
            break
        except DamagedFile as damage:
            stored = stored.without(damage)
    if "fault" in dataset.dims and "joint" in dataset.dims:
        warnings.warn(BOTH_JOINTS, StoreWarning, stacklevel=2)
    return dataset

"""What studies share: jobs of a study that grows, files that grow, jobs with a record.

A study is a function of stored jobs. What it has to run it runs as ordinary jobs, so that progress,
resume, `compsim status`, shards and a cluster serve it, too.
"""

import contextlib
import hashlib
import itertools
import json
import math
import re
import shlex
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import xarray as xr

from compressor import cases, metrics, program, store, sweep, vibration
from compressor.cases import Case, Study
from compressor.outcome import Outcome
from compressor.store import StoredStudy

RANGE = re.compile(r"\s*([\w.]+)\s*=\s*([^:\s]+)\s*:\s*([^:\s]+)\s*(?::\s*(\d+)\s*)?")
DIGITS = 12  # of a key's value: enough for any derivative, and short to read
MAX_NAME = 64  # characters of a study's name
RECORD_REMEDY = "write `body: true` and `sensor: {{length_rev: {length}}}` into {file}, keep series"

Point = tuple[float, ...]  # values of keys, in the case file's units


class StudyError(program.CompsimError, ValueError):
    """A question that a study cannot answer: and what to do."""


@dataclass(frozen=True)
class KeySpan:
    """A key and the ends of its values, in the case file's unit; log: spaced with even ratios.

    count: of the values, where a text gives it, else 0.
    """

    key: str
    low: float
    high: float
    log: bool = False
    count: int = 0

    def value(self, share: float) -> float:
        """Return the key's value at a share of its span."""
        if share in (0.0, 1.0):
            return self.high if share else self.low
        if self.log:
            value = self.low * (self.high / self.low) ** share
        else:
            value = self.low + share * (self.high - self.low)
        return float(f"{value:.{DIGITS}g}")


def read_range(option: str, text: str, is_counted: bool = False, log: bool = False) -> KeySpan:
    """Return the span of a text KEY=LOW:HIGH, or KEY=LOW:HIGH:N.

    Raises StudyError with the option's name.
    """
    parts = RANGE.fullmatch(text)
    key, low, high, count = parts.groups() if parts else ("", "nan", "nan", None)
    try:
        ends = float(low), float(high)
    except ValueError:
        ends = math.nan, math.nan
    row = cases.row_of(key)
    if not all(map(math.isfinite, ends)) or (count is not None) != is_counted:
        form = "KEY=LOW:HIGH:N, such as clearance_mm=0.01:1:60"
        problem = f"write {form if is_counted else form.replace(':N', '').replace(':60', '')}"
    elif row is None:
        hint = cases.suggestion(key, "") or ", such as clearance_mm"
        problem = f"{key} is no key of a number{hint}"
    elif row.kind != "number":
        numbers = "clearance_mm or machine.speed_rpm"
        problem = f"{key} is no continuous number: give a key such as {numbers}"
    elif wrong := row.check(ends[0]) or row.check(ends[1]):
        problem = f"{key}: {wrong}"
    elif ends[0] >= ends[1]:
        problem = "write the lower end first"
    elif log and ends[0] <= 0.0:
        problem = "--log needs ends above 0"
    else:
        return KeySpan(key, *ends, log, int(count or 0))
    raise StudyError(f"{option} {text}: {problem}")


class GrowingStudy:
    """One study of a case file whose jobs are added point by point, by values of some keys.

    Every job is stored and run as any other, so that asking again runs nothing. `jobs`: the key of
    the job of each point; `refused`: points that make no case; `run_now`: jobs that were run. few:
    so many new jobs, or more, are run by workers, fewer in this process.
    """

    def __init__(
        self,
        path: str,
        keys: Sequence[str],
        ending: str,
        folder: store.Folder,
        overrides: Sequence[str] = (),
        workers: int = 2,
        progress: program.Progress = program.no_progress,
        few: int = 0,
    ):
        self.path, self.keys, self.overrides = path, tuple(keys), tuple(overrides)
        self.ending, self.folder = ending, folder
        self.workers, self.progress, self.few = workers, progress, few
        self.name = ""
        self.jobs: dict[Point, str] = {}  # point -> key of its job
        self.refused: dict[Point, cases.CaseFileError] = {}
        self.run_now = 0

    def load(self, given: Sequence[Point]) -> Study:
        """Return the study of some points. Raises CaseFileError."""
        (found,) = cases.load_studies(self.path, overrides=self.settings(given))
        return found

    def settings(self, given: Sequence[Point]) -> list[str]:
        """Return the overrides that make the study of some points."""
        columns = dict(zip(self.keys, zip(*given, strict=True), strict=True))
        texts = [f"name={self.name or self.find_name(given[0])}"]
        texts += [f"{key}=[{', '.join(map(repr, values))}]" for key, values in columns.items()]
        texts += [f"zip=[[{', '.join(self.keys)}]]"] if len(self.keys) > 1 else []
        return replace_settings(self.overrides, *texts)

    def find_name(self, point: Point) -> str:
        """Return the study's name: that of the case file, and the ending."""
        texts = [f"{key}={value!r}" for key, value in zip(self.keys, point, strict=True)]
        (one,) = cases.load_studies(self.path, overrides=replace_settings(self.overrides, *texts))
        self.name = one.name[: MAX_NAME - len(self.ending)] + self.ending
        return self.name

    def run(self, given: Sequence[Point]) -> list[str]:
        """Return the keys of the jobs of points, run where they are missing; "" of refused ones.

        Raises StoreError and WorkersFailed.
        """
        known = self.jobs.keys() | self.refused.keys()
        new = [point for point in dict.fromkeys(given) if point not in known and self.takes(point)]
        if new:
            every = sorted([*self.jobs, *new])
            study, texts = self.load(every), self.settings(every)
            few = sweep.in_this_process if len(new) < self.few else None
            # by its verb a report knows steps of a search from jobs of a sweep
            command = shlex.join(["compsim", self.ending.split("-")[1], self.path])
            done = sweep.sweep(
                [study], self.folder, self.workers, self.progress, command, texts, backend=few
            )
            self.run_now += done.run_now
            self.jobs = dict(zip(every, study.keys, strict=True))
        return [self.jobs.get(point, "") for point in given]

    def takes(self, point: Point) -> bool:
        """Return whether a point makes a case; one that does not is noted with the reason."""
        try:
            self.load([point])
        except cases.CaseFileError as error:
            self.refused[point] = error
        return point not in self.refused


def replace_settings(overrides: Sequence[str], *new: str) -> list[str]:
    """Return overrides `key=value` with new ones in place of those of the same keys."""
    return [*without_keys(overrides, [text.partition("=")[0].strip() for text in new]), *new]


def without_keys(overrides: Sequence[str], keys: Sequence[str]) -> list[str]:
    """Return overrides `key=value` without those of some keys."""
    return [text for text in overrides if text.partition("=")[0].strip() not in keys]


class RecordedJob(NamedTuple):
    """A stored job with a sensor's record."""

    key: str
    point: Mapping[str, Any]  # its values of the study's axes
    case: Case
    outcome: Outcome
    record: vibration.Record


def records(
    folder: store.Folder,
    source: StoredStudy,
    left: Counter[str],
    progress: program.Progress = program.no_progress,
) -> Iterator[RecordedJob]:
    """Yield the jobs of a study that are ok and have a record, each once.

    left: counts the others by reason. A joint counts as sound by the study's healthy clearance.
    """
    stored = store.read_store(folder, warn=True)
    own = dict(zip(source.keys, cases.points(source), strict=True))
    healthy = source.fixed.get("healthy_clearance_mm", {"big_end": 0.0, "small_end": 0.0})
    for key, point in program.report_progress([*own.items()], progress):
        if (position := stored.position(key)) is None:
            left["missing"] += 1
            continue
        try:
            outcome = stored.outcome(position)
            if outcome.reason:
                left[outcome.reason] += 1
                continue
            case, record = stored.case_at(position), store.job_record(stored, key)
        except store.DamagedFile:
            case = None
        if case is None:
            left["damaged"] += 1
        elif record is None:
            left["without_record"] += 1
        else:
            case = replace(case, healthy_clearance_mm=cases.PerJoint(**healthy))
            yield RecordedJob(key, point, case, outcome, record)


def no_records(source: StoredStudy, left: Mapping[str, int], revolutions: int) -> StudyError:
    """Return the error that says why a study has no record of so many revolutions."""
    if {*left} <= {"without_record"}:
        remedy = RECORD_REMEDY.format(length=2 * revolutions + 1, file=source.case_file)
        return StudyError(f"study {source.name} has no sensor's record: {remedy}, and run it again")
    reasons = ", ".join(f"{count} {reason}" for reason, count in left.items())
    text = f"study {source.name} has no record of {revolutions} revolutions: {reasons}"
    remedy = f"run what is missing, or with sensor.length_rev: {revolutions + 1} or more"
    return StudyError(f"{text}; {remedy}")


# ---- files that grow row by row -----------------------------------------------------------------

REMADE = "delete it: the same command makes it again"
SECONDS_BETWEEN_LOOKS = 0.5  # s between two looks at what is written

Row = dict[str, Any]
Numbers = Mapping[str, tuple[tuple[str, ...], str, str]]  # name -> dims, unit, long name


def hash_key(identity: Any) -> str:
    """Return the hash of what decides numbers, as JSON has it, by which their file is named."""
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:20]


def metric_numbers(names: Iterable[str]) -> Numbers:
    """Return the `Numbers` of metrics, as `metrics.TABLE` has them."""
    rows = {name: metrics.METRICS[name] for name in names}
    return {name: (row.dims, row.unit, row.phrase) for name, row in rows.items()}


def rows_dataset(
    rows: Sequence[Row], dim: str, texts: Mapping[str, str], numbers: Numbers
) -> xr.Dataset:
    """Return rows as a Dataset along a dimension; texts: name -> long name."""
    found: dict[str, tuple] = {}
    for name, phrase in texts.items():
        found[name] = dim, np.array([row[name] for row in rows], object), {"long_name": phrase}
    for name, (dims, unit, phrase) in numbers.items():
        values = np.array([row[name] for row in rows], float)
        found[name] = (dim, *dims), values, {"units": unit, "long_name": phrase}
    return xr.Dataset(found)


class GrowingRows(Protocol):
    """Rows that are made one after the other, each from those before, and their file.

    key: hash of what decides them, an attribute of the file; each has a `reason`, "" of a row that
    is good; cases: that are run; seconds: that they may take; size: of the whole, of which
    `count_done` is a part.
    """

    @property
    def key(self) -> str: ...
    @property
    def cases(self) -> Sequence[Case]: ...
    @property
    def seconds(self) -> float: ...
    @property
    def size(self) -> int: ...
    def path(self, folder: store.Folder) -> Path: ...
    def count_done(self, rows: Sequence[Row]) -> int: ...
    def make_row(self, rows: Sequence[Row]) -> Row: ...
    def to_dataset(self, rows: Sequence[Row]) -> xr.Dataset: ...


def stored_rows(growing: GrowingRows, folder: store.Folder, rerun: bool = False) -> list[Row]:
    """Return the rows of a file, none where there is none; rerun: those before the first failed.

    Raises StoreError where it is not the file of that key.
    """
    path = growing.path(folder)
    if not path.exists():
        return []
    found = store.read_dataset(path, REMADE)
    if found.attrs.get("key") != growing.key:
        raise store.StoreError(path, "does not hold what its name says", REMADE)
    (dim,) = found["reason"].dims
    columns = {str(k): one.values for k, one in found.variables.items() if one.dims[:1] == (dim,)}
    rows = [{name: one[n] for name, one in columns.items()} for n in range(found.sizes[dim])]
    return [*itertools.takewhile(lambda row: not row["reason"], rows)] if rerun else rows


def make_rows(growing: GrowingRows, folder: store.Folder, rerun: bool = False) -> None:
    """Make and store what a file does not hold yet, in a worker. Raises StoreError."""
    rows = stored_rows(growing, folder, rerun)
    while growing.count_done(rows) < growing.size:
        rows.append(growing.make_row(rows))
        store.write_dataset(growing.path(folder), growing.to_dataset(rows))


def run_rows(
    every: Sequence[GrowingRows],
    folder: store.Folder,
    workers: int,
    progress: program.Progress,
    rerun: bool = False,
) -> tuple[int, dict[str, tuple[str, str]]]:
    """Make what is missing of files, side by side; return what was done before, and what was lost.

    Of those that were lost reason and detail, by their keys. Progress counts as `count_done`.
    Whatever ends it early, what was stored stays, and the same call goes on. Raises StoreError and
    WorkersFailed.
    """
    place = Path(folder).absolute()
    whole = {growing.key: growing for growing in every}
    done = {key: one.count_done(stored_rows(one, place, rerun)) for key, one in whole.items()}
    before, seen = sum(done[growing.key] for growing in every), dict.fromkeys(whole, 0)
    missing = [one for key, one in whole.items() if done[key] < one.size]

    def look(remark: str = "") -> None:
        for one in missing:
            with contextlib.suppress(OSError):  # no file yet
                changed = one.path(place).stat().st_mtime_ns
                if seen[one.key] != changed:
                    seen[one.key], done[one.key] = changed, one.count_done(stored_rows(one, place))
        progress(sum(done.values()), sum(one.size for one in whole.values()), remark)

    look()
    jobs = [(one.key, one, one.seconds) for one in missing]
    parts = sweep.needed_parts(case for one in missing for case in one.cases)
    running = sweep.run_here(
        partial(make_rows, folder=place, rerun=rerun), jobs, parts, workers, look
    )
    with contextlib.closing(running), calling_often(look):
        lost = {end.id: (str(end.reason), end.detail) for end in running if end.reason}
    look()
    return before, lost


@contextlib.contextmanager
def calling_often(look: Callable[[], object]) -> Iterator[None]:
    """Call a function about twice a second, in a thread: files end long after their rows."""
    ended = threading.Event()

    def call() -> None:
        while not ended.wait(SECONDS_BETWEEN_LOOKS):
            with contextlib.suppress(store.StoreError):  # which the last look raises again
                look()

    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()

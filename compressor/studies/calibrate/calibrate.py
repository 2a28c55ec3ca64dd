"""A sound machine's unknown keys, found by jobs of one study that grows.

Each point that the fit looks at is a job of the study `CASE-calibrate`, stored and run as any
other: the same question again runs nothing.
"""

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compressor.cases import Case, CaseFileError, Study, design, load_studies, row_of
from compressor.program import Progress, no_progress
from compressor.store import Folder, job_record, read_store
from compressor.studies.calibrate.fit import Fit, fit_orders
from compressor.studies.calibrate.orders import LIMIT, CalibrationError, orders_of
from compressor.sweep import Options, in_this_process, sweep
from compressor.vibration import Record

DIGITS = 12  # of a key's value: enough for any derivative, and short to read
NAME = 64  # characters that a study's name may have
POINTS_A_KEY = 6  # of the design that the fit begins with
SEED = 1  # of the design
FEW = 25  # jobs that are done before workers have started: most take some 20 ms
SPEED = "machine.speed_rpm"
QUIET = ("sensor.noise_m_per_s2=0", "sensor.speed_jitter=0", "output.keep=series")


@dataclass(frozen=True)
class Unknown:
    """A key of the case and the range that it lies in, in the case file's unit."""

    key: str
    low: float
    high: float

    @classmethod
    def written(cls, text: str) -> "Unknown":
        """Return the unknown of a text KEY=LOW:HIGH. Raises CalibrationError."""
        key, _, span = text.partition("=")
        try:
            ends = [float(part) for part in span.split(":")]
        except ValueError:
            ends = []
        if len(ends) != 2 or not -math.inf < ends[0] < ends[1] < math.inf:
            raise CalibrationError(
                f"{text!r} is no range: write KEY=LOW:HIGH, such as "
                "machine.reciprocating_mass_kg=10:20"
            )
        row = row_of(key.strip())
        if row is None or row.kind != "number":
            raise CalibrationError(f"{key.strip()!r} is no key with a number that can be fitted")
        if row.key == SPEED:
            raise CalibrationError(f"{SPEED} is the record's own: leave it out of --fit")
        return cls(key.strip(), *ends)

    def value(self, share: float) -> float:
        """Return the key's value at a share of its range."""
        return float(f"{self.low + share * (self.high - self.low):.{DIGITS}g}")


@dataclass(frozen=True)
class Calibration:
    """What a record says of a case's unknown keys.

    case: with the fitted values, and the record's speed; unknowns and `fit`: in the same order;
    orders: how many were compared; revolutions, speed (rev/s): of the record; rpm_given: the speed
    that the case file has; jobs: points that were looked at, `run_now` of them run now, in study
    `study`.
    """

    case: Case
    unknowns: tuple[Unknown, ...]
    fit: Fit
    orders: int
    revolutions: int
    speed: float
    rpm_given: float
    jobs: int
    run_now: int
    study: str

    def interval(self, place: int) -> tuple[float, float]:
        """Return the ends of a key's 95 % interval, in the case file's unit."""
        one = self.unknowns[place]
        low, high = self.fit.interval(place)
        return one.value(low), one.value(high)


def replace_settings(overrides: Sequence[str], *new: str) -> list[str]:
    """Return overrides `key=value` with new ones in place of those of the same keys."""
    keys = {text.partition("=")[0].strip() for text in new}
    return [text for text in overrides if text.partition("=")[0].strip() not in keys] + [*new]


class FitJobs:
    """Evaluates orders of a case at values of its unknown keys, by jobs of one study."""

    def __init__(
        self, path: str, unknowns: Sequence[Unknown], overrides: Sequence[str],
        folder: Folder, workers: int, progress: Progress,
    ):  # fmt: skip
        self.path, self.unknowns, self.overrides = path, tuple(unknowns), tuple(overrides)
        self.folder, self.workers, self.progress = folder, workers, progress
        self.points: dict[tuple[float, ...], str] = {}  # values of the keys -> key of the job
        self.refused: dict[tuple[float, ...], CaseFileError] = {}  # values that make no case
        self.run_now = 0
        self.highest = 0  # order that is compared
        self.name = ""
        first = self.study([tuple(one.value(0.5) for one in unknowns)], ())
        self.middle = first.cases[0]
        if self.middle.body is None or self.middle.sensor is None:
            raise CalibrationError(
                f"{path} has no sensor to compare a record with: add body and sensor to it"
            )
        self.name = first.name[: NAME - len("-calibrate")] + "-calibrate"

    def run_at(self, rpm: float) -> None:
        """Let the case run at a speed, in place of its own."""
        self.overrides = tuple(replace_settings(self.overrides, f"{SPEED}={rpm:.{DIGITS}g}"))

    def study(self, points: Sequence[tuple[float, ...]], extra: Sequence[str] = QUIET) -> Study:
        """Return the study of some values of the unknown keys. Raises CaseFileError."""
        texts = self.settings(points, extra)
        (found,) = load_studies(self.path, overrides=texts)
        if found.jobs != len(points):
            axes = ", ".join(axis.key for axis in found.axes)
            raise CalibrationError(
                f"{self.path} makes {found.jobs} jobs where one machine is fitted, by {axes}: "
                "choose one case by --set"
            )
        return found

    def settings(self, points: Sequence[tuple[float, ...]], extra: Sequence[str]) -> list[str]:
        """Return the overrides that make the study of some values."""
        texts = replace_settings(self.overrides, *extra)
        if self.name:
            texts = replace_settings(texts, f"name={self.name}")
        for one, column in zip(self.unknowns, zip(*points, strict=True), strict=True):
            listed = ", ".join(map(repr, column))
            texts.append(f"{one.key}={listed}" if len(points) == 1 else f"{one.key}=[{listed}]")
        if len(points) == 1:
            return texts
        keys = ", ".join(one.key for one in self.unknowns)
        return texts + ([f"zip=[[{keys}]]"] if len(self.unknowns) > 1 else [])

    def __call__(self, shares: np.ndarray) -> np.ndarray:
        """Return the orders (m/s2) at shares of the ranges; nan where a job failed.

        shares: (k,), or (n, k) for n machines side by side.
        """
        rows = np.atleast_2d(shares)
        points = [
            tuple(one.value(share) for one, share in zip(self.unknowns, row, strict=True))
            for row in rows.tolist()
        ]
        known = self.points.keys() | self.refused
        new = [
            point for point in dict.fromkeys(points) if point not in known and self.is_case(point)
        ]
        if new:
            self.run(new)
        store = read_store(self.folder)
        found = []
        for point in points:
            record = job_record(store, self.points.get(point, ""))
            if record is None:
                found.append(np.full(self.highest, np.nan + 0j))
            else:
                found.append(orders_of(record).amplitudes[: self.highest])
        return np.array(found).reshape(*shares.shape[:-1], self.highest)

    def is_case(self, point: tuple[float, ...]) -> bool:
        """Return whether values make a case; those that do not are noted with their reason."""
        try:
            self.study([point])
        except CaseFileError as error:
            self.refused[point] = error
        return point not in self.refused

    def run(self, new: Sequence[tuple[float, ...]]) -> None:
        """Run the jobs of new points, in a study with all points so far."""
        every = [*self.points, *new]
        study = self.study(every)
        sets = self.settings(every, QUIET)
        words = ["compsim", "run", self.path, "-r", str(self.folder)]
        words += [word for text in sets for word in ("--set", text)]
        few = in_this_process if len(new) < FEW else None
        # so that `status` shows how to go on
        options = Options(shlex.join(words), sets, backend=few)
        done = sweep([study], self.folder, self.workers, self.progress, options)
        self.run_now += done.run_now
        self.points = dict(zip(every, study.keys, strict=True))


def calibrate(
    record: Record, path: str, unknowns: Sequence[Unknown], folder: Folder,
    overrides: Sequence[str] = (), workers: int = 2, progress: Progress = no_progress,
) -> Calibration:  # fmt: skip
    """Return what a record of a sound machine says of a case's unknown keys.

    The case runs at the record's mean speed, without noise; compared are complex orders of the mean
    revolution, up to what the record's and the case's sampling rate hold, by bounded least squares.
    Raises CaseFileError, CalibrationError, StoreError and WorkersFailed.
    """
    if not unknowns:
        raise CalibrationError("nothing is to be fitted: give --fit KEY=LOW:HIGH")
    measured = orders_of(record)
    jobs = FitJobs(path, unknowns, overrides, folder, workers, progress)
    rpm_given = jobs.middle.machine.speed_rpm
    jobs.run_at(60.0 * measured.speed)
    sensor = jobs.middle.sensor
    assert sensor is not None
    corner = sensor.low_pass_Hz or sensor.rate_Hz / LIMIT  # the highest order that both hold
    jobs.highest = min(len(measured.amplitudes), int(corner / measured.speed))
    measured = measured.up_to(jobs.highest)
    starts = np.array(design("lhs", POINTS_A_KEY * len(unknowns), len(unknowns), SEED))
    fit = fit_orders(jobs, measured.amplitudes, measured.errors, starts)
    if not jobs.points:
        raise next(iter(jobs.refused.values()))  # no point of the ranges makes a case
    if fit is None:
        raise CalibrationError(f"each job of study {jobs.name} failed: compsim status shows why")
    best = tuple(one.value(share) for one, share in zip(unknowns, fit.shares, strict=True))
    case = jobs.study([best], ()).cases[0]
    return Calibration(
        case, tuple(unknowns), fit, jobs.highest, measured.revolutions, measured.speed, rpm_given,
        len(jobs.points), jobs.run_now, jobs.name,
    )  # fmt: skip

"""A sound machine's unknown keys, found by jobs of one study that grows.

Each point that the fit looks at is a job of the study `CASE-calibrate`, stored and run as any
other: the same question again runs nothing.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compressor.cases import Case, design, load_studies, row_of
from compressor.program import Progress, no_progress
from compressor.store import Folder, job_record, read_store
from compressor.studies.calibrate.fit import Fit, fit_orders
from compressor.studies.calibrate.orders import CalibrationError, orders_of
from compressor.studies.frame import DIGITS, USABLE, GrowingStudy, Point, replace_settings
from compressor.vibration import Record

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


class FitJobs:
    """Evaluates orders of a case at values of its unknown keys, by jobs of one study."""

    def __init__(
        self, path: str, unknowns: Sequence[Unknown], overrides: Sequence[str],
        folder: Folder, workers: int, progress: Progress,
    ):  # fmt: skip
        self.unknowns, self.folder, self.plain = tuple(unknowns), folder, [*overrides]
        keys = [one.key for one in unknowns]
        self.study = GrowingStudy(
            path, keys, "-calibrate", folder, overrides, workers, progress, FEW
        )
        self.highest = 0  # order that is compared
        self.middle = self.case_at(np.full(len(unknowns), 0.5))
        if self.middle.body is None or self.middle.sensor is None:
            raise CalibrationError(
                f"{path} has no sensor to compare a record with: add body and sensor to it"
            )

    def run_at(self, rpm: float) -> None:
        """Let the case run at a speed, in place of its own, and without noise."""
        self.plain = replace_settings(self.plain, f"{SPEED}={rpm:.{DIGITS}g}")
        self.study.overrides = tuple(replace_settings(self.plain, *QUIET))

    def point(self, shares: np.ndarray) -> Point:
        """Return the values of the keys at shares of their ranges."""
        pairs = zip(self.unknowns, shares.tolist(), strict=True)
        return tuple(one.value(share) for one, share in pairs)

    def case_at(self, shares: np.ndarray) -> Case:
        """Return the case at shares of the ranges. Raises CaseFileError and CalibrationError."""
        pairs = zip(self.unknowns, self.point(shares), strict=True)
        texts = replace_settings(self.plain, *(f"{one.key}={value!r}" for one, value in pairs))
        (found,) = load_studies(self.study.path, overrides=texts)
        if found.jobs != 1:
            axes = ", ".join(axis.key for axis in found.axes)
            raise CalibrationError(
                f"{self.study.path} makes {found.jobs} jobs where one machine is fitted, by "
                f"{axes}: choose one case by --set"
            )
        return found.cases[0]

    def __call__(self, shares: np.ndarray) -> np.ndarray:
        """Return the orders (m/s2) at shares of the ranges; nan where a job failed.

        shares: (k,), or (n, k) for n machines side by side.
        """
        keys = self.study.run([self.point(row) for row in np.atleast_2d(shares)])
        store = read_store(self.folder)
        found = []
        for key in keys:
            record = job_record(store, key)
            if record is None:
                found.append(np.full(self.highest, np.nan + 0j))
            else:
                found.append(orders_of(record).amplitudes[: self.highest])
        return np.array(found).reshape(*shares.shape[:-1], self.highest)


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
    corner = sensor.low_pass_Hz or sensor.rate_Hz / USABLE  # the highest order that both hold
    jobs.highest = min(len(measured.amplitudes), int(corner / measured.speed))
    measured = measured.up_to(jobs.highest)
    starts = np.array(design("lhs", POINTS_A_KEY * len(unknowns), len(unknowns), SEED))
    fit = fit_orders(jobs, measured.amplitudes, measured.errors, starts)
    study = jobs.study
    if not study.jobs:
        raise next(iter(study.refused.values()))  # no point of the ranges makes a case
    if fit is None:
        raise CalibrationError(f"each job of study {study.name} failed: compsim status shows why")
    case = jobs.case_at(fit.shares)
    return Calibration(
        case, tuple(unknowns), fit, jobs.highest, measured.revolutions, measured.speed, rpm_given,
        len(study.jobs), study.run_now, study.name,
    )  # fmt: skip

"""The windows of a stored study's records: what alarms read of them, and of what they are."""

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from compressor.cases import PerJoint, Sensor, points
from compressor.program import CompsimError, Progress, report_progress
from compressor.store import (
    DamagedFile,
    Folder,
    Stored,
    StoredStudy,
    healthy_clearance,
    job_record,
    read_store,
)
from compressor.studies.alarms.readings import RECORD, Band, Readings, default_bands, read_windows
from compressor.vibration import MIN_REVOLUTIONS, RecordError, find_noise_mistake

SOUND = "none"  # the joint that is worn in a sound machine
MIN_SOUND = 10  # draws of a sound machine: by fewer of them no limit means anything
NO_DRAW = ("joint", "clearance_mm", "sensor", "healthy_clearance_mm")  # groups that make no draw


class AlarmsError(CompsimError):
    """A study by which no alarm can be judged, or options that it cannot have: and what to do."""

    exit_code = 2


@dataclass(frozen=True)
class AlarmOptions:
    """How to read, to disturb and to judge.

    revolutions: of a window; bands: of the filters, Hz, None for `default_bands`; noise: rms values
    (m/s2) of white noise that is added to records; false_alarms: the rate that limits are set for;
    factor: limits in its place, times a sound machine's usual reading; detected: the share of
    windows from which on an alarm is said to detect; seed: of noise and folds. Raises AlarmsError.
    """

    revolutions: int = 5
    bands: tuple[Band, ...] | None = None
    noise: tuple[float, ...] = (0.0,)
    false_alarms: float = 0.01
    factor: float | None = None
    detected: float = 0.9
    seed: int = 1

    def __post_init__(self) -> None:
        if self.revolutions < 1:
            raise AlarmsError(f"a window has at least 1 revolution, not {self.revolutions}")
        if not 0.0 < self.false_alarms < 1.0:
            rate = self.false_alarms
            raise AlarmsError(f"the rate of false alarms is between 0 and 1, not {rate:g}")
        if self.factor is not None and not 0.0 < self.factor < math.inf:
            raise AlarmsError(f"the factor of limits is above 0, not {self.factor:g}")
        if not 0.0 < self.detected <= 1.0:
            raise AlarmsError(
                f"the detected share is above 0, and 1 at most, not {self.detected:g}"
            )
        if len({*(self.bands or ())}) < len(self.bands or ()):
            raise AlarmsError("a band is given twice: give each --band once")
        for low, high in self.bands or ():
            if not 0.0 <= low < high < math.inf:
                raise AlarmsError(f"--band {low:g}-{high:g}: give the lower frequency first, in Hz")
        mistake = find_noise_mistake(self.noise)
        if mistake:
            raise AlarmsError(mistake)


@dataclass
class Windows:
    """The windows of a study's jobs: n of them, and the jobs that were left out, by reason.

    joints: worn ones, (n,); clearances: of the worn joint, of both the greater one, mm, (n,);
    draws, keys: (n,); readings: by noise level and filter; clipped: jobs with clipped records;
    values: of a worn job's case.
    """

    bands: tuple[Band, ...]
    joints: np.ndarray
    clearances: np.ndarray
    draws: np.ndarray
    keys: np.ndarray
    readings: dict[tuple[int, str], Readings]
    left_out: Mapping[str, int] = field(default_factory=dict)
    clipped: int = 0
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def is_sound(self) -> np.ndarray:
        """Return whether windows are of a sound machine, (n,)."""
        return self.joints == SOUND


def read_study(
    folder: Folder, source: StoredStudy, options: AlarmOptions, progress: Progress
) -> Windows:
    """Return the windows of all jobs of a study that have a record. Raises AlarmsError."""
    stored, healthy = read_store(folder).warned(), healthy_clearance(source)
    left: Counter[str] = Counter()
    rows: list[dict[str, Any]] = []
    bands, clipped = options.bands, 0
    values: Mapping[str, Any] = {}
    own = dict(zip(source.keys, points(source), strict=True))
    for key, point in report_progress([*own.items()], progress):
        job = read_job(stored, key, healthy, bands, options)
        if isinstance(job, str):
            left[job] += 1
            continue
        bands = job.pop("bands")
        clipped += job.pop("clipped")
        of_case = job.pop("values")
        values = of_case if job["joint"] != SOUND else values
        rows.append({**job, "key": key, "draw": name_draw(point)})
    if not rows:
        raise explain_no_windows(source, left, options)
    return replace(stack_windows(rows, bands or ()), left_out=left, clipped=clipped, values=values)


def read_job(
    stored: Stored,
    key: str,
    healthy: PerJoint,
    bands: tuple[Band, ...] | None,
    options: AlarmOptions,
) -> dict[str, Any] | str:
    """Return what is read of a job's windows, or why there are none."""
    found = stored.find_ok(key, healthy)
    if isinstance(found, str):
        return found
    case, outcome = found
    try:
        record = job_record(stored, key)
    except DamagedFile:
        return "damaged"
    if record is None:
        return "without_record"
    rate = record.rate
    passes = highest_passed(case.sensor)
    bands = default_bands(rate, passes) if bands is None else bands
    for low, high in bands:
        if high > passes * (1.0 + 1e-9):
            raise AlarmsError(
                f"band {low:g}-{high:g} Hz: the sensor of job {key} passes up to {passes:g} Hz "
                "(sensor.low_pass_Hz, or the resonance sensor.mounting_Hz): give bands up to that"
            )
        if high > rate / 2.0 * (1.0 + 1e-9):
            remedy = f"give bands up to half of that, {rate / 2:g} Hz, or a higher sensor.rate_Hz"
            raise AlarmsError(
                f"band {low:g}-{high:g} Hz: job {key} is sampled at {rate:.6g} Hz; {remedy}"
            )
    if len(record.tacho) - 1 < max(options.revolutions, MIN_REVOLUTIONS):
        return "too_short"
    if not np.ptp(record.values):  # a dead sensor, which has no crest factor either
        return "silent_record"
    low, high = case.body.band_Hz if case.body else (0.0, math.inf)
    readings: dict[tuple[int, str], Readings] = {}
    try:
        for level, rms in enumerate(options.noise):
            seed = [options.seed, int(key, 16), level]
            band = low, min(high, rate / 2.0)
            read = read_windows(record, options.revolutions, bands, band, rms, seed)
            readings |= {(level, name): one for name, one in read.items()}
    except RecordError:
        return "silent_record"
    velocity = np.asarray(outcome.numbers["body_velocity_rms"], float)
    for (_, name), one in readings.items():
        if name == RECORD:  # of the body: without noise, and the same in all windows of a job
            one["body_velocity_rms"] = np.tile(velocity, (len(one["sensor_rms"]), 1))
    joint = case.worn_joint
    sides = ("big_end", "small_end") if joint == "both" else (joint,)
    clearance = max(getattr(case.clearance_mm, side, math.nan) for side in sides)
    is_clipped = float(outcome.numbers["clipped_fraction"]) >= Sensor.REPORTED
    return {
        "joint": joint, "clearance": clearance, "readings": readings, "bands": bands,
        "clipped": is_clipped, "values": case.values(),
    }  # fmt: skip


def highest_passed(sensor: Sensor | None) -> float:
    """Return the frequency (Hz) above which a sensor's low pass or mounting lets nothing through.

    Without a low pass of its own a sensor has one by its sampling rate, which bands mind anyway.
    """
    if sensor is None:
        return math.inf
    return min(sensor.low_pass_Hz or math.inf, sensor.mounting_Hz)


def name_draw(point: Mapping[str, Any]) -> str:
    """Return a name for what a study varies of a job beside joint and clearance."""
    varied = {key: one for key, one in point.items() if key.partition(".")[0] not in NO_DRAW}
    return json.dumps(varied, sort_keys=True)


def stack_windows(rows: Sequence[dict[str, Any]], bands: tuple[Band, ...]) -> Windows:
    """Return the windows of jobs, one after the other."""
    first = rows[0]["readings"]
    sizes = [len(row["readings"][0, RECORD]["sensor_rms"]) for row in rows]
    readings = {
        place: {
            name: np.concatenate([row["readings"][place][name] for row in rows]) for name in one
        }
        for place, one in first.items()
    }
    joints, clearances, draws, keys = (
        np.repeat(np.array([row[name] for row in rows]), sizes)
        for name in ("joint", "clearance", "draw", "key")
    )
    return Windows(bands, joints, clearances, draws, keys, readings)


def explain_no_windows(
    source: StoredStudy, left: Mapping[str, int], options: AlarmOptions
) -> AlarmsError:
    """Return the error that says why a study has no window, and what to do."""
    if {*left} <= {"without_record"}:
        text = f"study {source.name} has no sensor's record: write `body: true` and"
        keys = f"`sensor: {{length_rev: {2 * options.revolutions + 1}}}`"
        return AlarmsError(f"{text} {keys} into {source.case_file}, keep series, and run it again")
    reasons = ", ".join(f"{count} {reason}" for reason, count in left.items())
    least = max(options.revolutions, MIN_REVOLUTIONS)
    text = f"study {source.name} has no record of {least} revolutions: {reasons}"
    remedy = f"run what is missing, or with sensor.length_rev: {least + 1} or more"
    if options.revolutions > MIN_REVOLUTIONS:
        remedy += ", or give fewer --revolutions"
    return AlarmsError(f"{text}; {remedy}")


def check_draws(source: StoredStudy, windows: Windows) -> None:
    """Raise AlarmsError unless there are enough draws of a sound machine, and a worn one."""
    jobs = {*windows.keys.tolist()}
    sound = {*windows.draws[windows.is_sound].tolist()}
    if not sound:
        raise AlarmsError(
            f"study {source.name}: none of its {len(jobs)} jobs with a record is of a sound "
            "machine, by which limits are set: add joint: none, or clearances up to "
            "healthy_clearance_mm, and run it again"
        )
    if len(sound) < MIN_SOUND:
        count = "one draw" if len(sound) == 1 else f"{len(sound)} draws"
        raise AlarmsError(
            f"study {source.name}: its sound jobs are {count} of what it varies beside joint and "
            f"clearance, and limits need {MIN_SOUND} at the least, for 1 % of false alarms 124: "
            "draw load and speed, such as machine.speed_rpm: {random: [700, 780]} with sample: "
            "{n: 124}"
        )
    if windows.is_sound.all():
        raise AlarmsError(
            f"study {source.name}: none of its jobs with a record is worn: add clearances beyond "
            "healthy_clearance_mm, or a joint, and run it again"
        )

"""What alarms read of the windows of a study's records: levels, counts, velocity, by filter."""

import json
import math
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compressor import analysis, cases, store, vibration
from compressor.program import Progress
from compressor.store import StoredStudy
from compressor.studies import frame

RECORD = "record"  # the filter's name of a record as it is
FRAME_HZ = (2.0, 1000.0)  # ours: the band in which frames are judged by body_velocity_rms
# m/s2, 20 a decade: the levels over which peaks are counted
LADDER = np.geomspace(1e-2, 1e4, 121)
COUNTED = (0.5, 1.0)  # ours: times the sound machine's peak, over which peaks are counted
BODY_VELOCITY = "velocity of the body"  # reads a stored metric: no noise disturbs it
NO_DRAW = ("joint", "clearance_mm", "sensor", "healthy_clearance_mm")  # groups that make no draw
SEED = 1  # of the noise, beside the job's key
LEAST_COUNT = 1.0  # a revolution: fewer of a sound machine count as so many

Band = tuple[float, float]
Readings = dict[str, np.ndarray]  # by reading: (windows, numbers)
Score = Callable[[Readings, np.ndarray], np.ndarray]  # of readings, by the rows of sound windows


@dataclass(frozen=True)
class Alarm:
    """An alarm: its title, the reading that it needs, and its score, (windows,).

    A score is how many times above a sound machine a window is, by the rows of sound windows; the
    alarm trips where it is above its limit. is_filtered: whether it reads the record of each
    filter; else the record as it is, or the body.
    """

    title: str
    reading: str
    score: Score
    is_filtered: bool = True


def score_by_ratio(name: str) -> Score:
    """Return the score of a reading: the greatest ratio of its numbers to their sound medians."""

    def score(readings: Readings, sound: np.ndarray) -> np.ndarray:
        values = readings[name]
        usual = np.median(values[sound], axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = values / usual
        # a number that a sound machine never shows: any of it is far above
        ratios = np.where((usual == 0.0) & (values == 0.0), 1.0, ratios)
        return np.where(np.isnan(ratios), -math.inf, ratios).max(axis=1)

    return score


def score_by_counts(times: float) -> Score:
    """Return the score of counts over so many times the median peak of sound windows.

    The level is the next one of `LADDER`; the usual count at least `LEAST_COUNT`.
    """

    def score(readings: Readings, sound: np.ndarray) -> np.ndarray:
        level = times * float(np.median(readings["sensor_peak"][sound]))
        place = min(int(np.searchsorted(LADDER, level)), LADDER.size - 1)
        counts = readings["sensor_counts_per_rev"][:, place]
        return counts / max(float(np.median(counts[sound])), LEAST_COUNT)

    return score


ALARMS = (
    Alarm("peak", "sensor_peak", score_by_ratio("sensor_peak")),
    Alarm("rms", "sensor_rms", score_by_ratio("sensor_rms")),
    Alarm("crest factor", "sensor_crest_factor", score_by_ratio("sensor_crest_factor")),
    Alarm("kurtosis", "sensor_kurtosis", score_by_ratio("sensor_kurtosis")),
    Alarm("segment peak", "sensor_segment_peak", score_by_ratio("sensor_segment_peak")),
    Alarm("segment rms", "sensor_segment_rms", score_by_ratio("sensor_segment_rms")),
    *(
        Alarm(f"counts over {times:g} peak", "sensor_counts_per_rev", score_by_counts(times))
        for times in COUNTED
    ),
    Alarm("velocity of the record", "velocity", score_by_ratio("velocity"), False),
    Alarm(BODY_VELOCITY, "body_velocity_rms", score_by_ratio("body_velocity_rms"), False),
)


def default_bands(rate: float, passes: float) -> tuple[Band, ...]:
    """Return the bands of a sampling rate, Hz: a frame's, and two above it where there is room.

    passes: the highest frequency that the sensor's chain lets through, Hz. The two share what a
    record holds above the frame's band, equally in its logarithm.
    """
    low, edge = FRAME_HZ
    top = min(rate / vibration.USABLE, passes)
    if top <= 2.0 * edge:
        return ((low, min(edge, top)),)
    middle = float(f"{math.sqrt(edge * top):.2g}")
    return ((low, edge), (edge, middle), (middle, float(f"{top:.6g}")))


def read_windows(
    record: vibration.Record, revolutions: int, bands: Sequence[Band], velocity_band: Band,
    noise: float, seed: Sequence[int],
) -> dict[str, Readings]:  # fmt: skip
    """Return the readings of a record's windows by filter, `RECORD` first; {} of a shorter record.

    White noise of `noise` m/s2 rms is added to the record by a seed before all else. A band's
    filter removes the other lines of the spectrum of all revolutions. Raises RecordError as
    `check_record`.
    """
    whole = vibration.check_record(record.times, record.values, record.tacho)
    ((_, record),) = vibration.cut_windows(record, whole)
    values, rate = vibration.noisy(record.values, noise, seed), record.rate
    signals = {RECORD: values}
    signals |= {
        f"{low:g}-{high:g} Hz": vibration.band_signal(values, rate, low, high)
        for low, high in bands
    }
    found = {}
    for name, signal in signals.items():
        windows = vibration.cut_windows(replace(record, values=signal), revolutions)
        if rows := [
            read_window(one.values, vibration.turns_at(one.times, one.tacho), revolutions)
            for _, one in windows
        ]:
            found[name] = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    if found:
        speed = band_velocity(values, rate, *velocity_band)
        windows = vibration.cut_windows(replace(record, values=speed), revolutions)
        found[RECORD]["velocity"] = np.array(
            [[np.sqrt(np.mean(one.values**2))] for _, one in windows]
        )
    return found


def read_window(values: np.ndarray, turns: np.ndarray, revolutions: int) -> Readings:
    """Return the readings of one window, (numbers,) each; counts at all levels of `LADDER`."""
    below = int(np.searchsorted(LADDER, np.abs(values).max()))  # levels that a peak passes
    numbers = vibration.measure_record(values, turns, revolutions, LADDER[:below].tolist())
    found = {name: np.atleast_1d(np.asarray(one, float)) for name, one in numbers.items()}
    counts = np.zeros(LADDER.size)
    counts[:below] = found.get("sensor_counts_per_rev", np.empty(0))
    return found | {"sensor_counts_per_rev": counts}


def band_velocity(values: np.ndarray, rate: float, low: float, high: float) -> np.ndarray:
    """Return the velocity of an acceleration in a band, m/s, (m,), as if both repeated themselves.

    The lines of the band over 2 pi i f; none at 0 Hz, where none follows from an acceleration.
    """
    lines = np.fft.rfft(vibration.band_signal(values, rate, low, high))
    omega = 2.0j * np.pi * np.fft.rfftfreq(len(values), 1.0 / rate)
    omega[0], lines[0] = 1.0, 0.0
    return np.fft.irfft(lines / omega, len(values))


@dataclass(frozen=True)
class Windows:
    """The n windows of a study's jobs.

    joints: worn ones, (n,); clearances: of the worn joint, of both the greater one, mm, (n,);
    draws, keys: (n,); readings: by noise level and filter; clipped: jobs with clipped records.
    """

    joints: np.ndarray
    clearances: np.ndarray
    draws: np.ndarray
    keys: np.ndarray
    readings: dict[tuple[int, str], Readings]
    clipped: int


def read_study(
    folder: store.Folder, source: StoredStudy, bands: Sequence[Band], noise: Sequence[float],
    revolutions: int, left: Counter[str], progress: Progress,
) -> Windows:  # fmt: skip
    """Return the windows of all jobs of a study that have a record. Raises StudyError.

    bands: Hz, none for `default_bands`; left: counts the other jobs by reason.
    """
    rows: list[tuple[str, float, str, str]] = []
    readings: dict[tuple[int, str], list[Readings]] = defaultdict(list)
    clipped = 0
    for job in frame.records(folder, source, left, progress):
        case, record = job.case, job.record
        assert case.body  # which made the record
        assert case.sensor
        corner = case.sensor.low_pass_Hz or record.rate / vibration.USABLE
        passes = min(corner, case.sensor.mounting_Hz)
        bands = bands or default_bands(record.rate, passes)
        check_bands(bands, job.key, passes)
        if len(record.tacho) - 1 < revolutions or not np.ptp(record.values):
            left["too_short" if np.ptp(record.values) else "silent_record"] += 1
            continue
        low, high = case.body.band_Hz
        in_band = low, min(high, record.rate / 2.0)
        own: dict[tuple[int, str], Readings] = {}
        try:
            for level, rms in enumerate(noise):
                seed = [SEED, int(job.key, 16), level]
                read = read_windows(record, revolutions, bands, in_band, rms, seed)
                own |= {(level, name): one for name, one in read.items()}
        except vibration.RecordError:
            left["silent_record"] += 1
            continue
        count = len(own[0, RECORD]["sensor_rms"])
        velocity = np.asarray(job.outcome.numbers["body_velocity_rms"], float)
        for place, one in own.items():
            if place[1] == RECORD:
                one["body_velocity_rms"] = np.tile(velocity, (count, 1))
            readings[place].append(one)
        joint = case.worn_joint
        sides = analysis.faulty_joints(joint)
        clearance = max(getattr(case.clearance_mm, side, math.nan) for side in sides)
        varied = {k: one for k, one in job.point.items() if k.partition(".")[0] not in NO_DRAW}
        rows += [(joint, clearance, json.dumps(varied, sort_keys=True), job.key)] * count
        clipped += float(job.outcome.numbers["clipped_fraction"]) >= cases.Sensor.REPORTED
    if not rows:
        raise frame.no_records(source, left, revolutions)
    stacked = {
        place: {name: np.concatenate([one[name] for one in some]) for name in some[0]}
        for place, some in readings.items()
    }
    joints, clearances, draws, keys = map(np.array, zip(*rows, strict=True))
    return Windows(joints, clearances, draws, keys, stacked, clipped)


def check_bands(bands: Sequence[Band], key: str, passes: float) -> None:
    """Raise StudyError unless a job's sensor passes the bands; passes: as in `default_bands`."""
    for low, high in bands:
        if high > passes * (1.0 + 1e-5):  # which is told in six digits
            raise frame.StudyError(
                f"band {low:g}-{high:g} Hz: the sensor of job {key} passes up to {passes:.6g} Hz "
                "(sensor.low_pass_Hz, by default the rate over 2.56, or the resonance "
                f"sensor.mounting_Hz): give bands up to {passes:.6g} Hz"
            )

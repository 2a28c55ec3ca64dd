"""What an accelerometer on the body records: mounting, filter, range, noise, sampling, tacho."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import map_coordinates

from compressor.cases import Body, Sensor
from compressor.vibration.body import (
    BodyMotion,
    Forces,
    OscillatorMotion,
    body_motion,
    casing_motion,
    centre,
    oscillate,
    point_acceleration,
)

AXES = ("x", "y")
POLES = 8  # of the anti-aliasing filter, Butterworth
# times the sampling rate, and the highest resonance, at which the analogue side runs
ANALOGUE_RATE_FACTOR = 8.0
USABLE = 2.56  # sampling rate over the highest frequency that it holds well (ISO 13373-1)
LEAD_IN = 1  # revolutions before the record, in which the low-pass filter forgets its start


@dataclass(frozen=True)
class Record:
    """Samples (m/s2) of an accelerometer at `times` (s) from the record's begin, (n,).

    `tacho`: times (s) at which the crank passes top dead centre, within the record; `clipped`: the
    share of samples beyond the range; `turns`: revolutions of the crank at the samples,
    (n,), empty where they are not known; `remarks`: how a file was read.
    """

    times: np.ndarray
    values: np.ndarray
    tacho: np.ndarray
    clipped: float
    turns: np.ndarray = field(default_factory=lambda: np.empty(0))
    remarks: tuple[str, ...] = ()

    @property
    def rate(self) -> float:
        """Return the samples a second, Hz, of the whole record: two stamps alone lose digits."""
        return float((len(self.times) - 1) / (self.times[-1] - self.times[0]))


def analogue_rate(body: Body, sensor: Sensor) -> float:
    """Return the least rate (Hz) at which forces must be known for a sensor's record."""
    casing = body.casing_frequency_Hz if body.casing else 0.0
    return ANALOGUE_RATE_FACTOR * max(sensor.rate_Hz, sensor.mounting_Hz, casing)


def listen(
    body: Body, sensor: Sensor, forces: Forces, turn: float, guide: float,
    motion: BodyMotion | None = None, phase: float = 0.0,
) -> Record:  # fmt: skip
    """Return the record of a sensor on a body under forces.

    forces: whole revolutions of `turn` s where the body is steady; guide: mid-stroke from the
    crank, m; motion: of the body, where it is known already; phase: revolutions of the crank from
    top dead centre to the first sample. A steady motion is repeated as often as the record is long,
    with each revolution at its own pace where the speed jitters; the force at an angle stays.

    The chain is the mounting's resonance, a low-pass filter, sampling, noise and clipping. Casing
    and mounting have always repeated themselves, too, where the body is steady: a mode of low
    damping would take many revolutions to forget a start at rest.
    """
    steady, step = body.start == "steady", forces.step
    rng = np.random.default_rng(sensor.seed)
    length = step * (len(forces.shaking) - 1)
    before = LEAD_IN * turn
    if steady:
        length = turn * (sensor.length_rev or max(1, int(length / turn * (1 + 1e-9))))
    x, y = centre(body)
    point = {"guide": (guide - x, -y), "bearing": (-x, -y), "body": (0.0, 0.0)}[sensor.place]
    rigid = motion or body_motion(body, forces, steady)
    acceleration, force = point_acceleration(rigid, sensor.direction, point), None
    foot, casing = acceleration, None
    if body.casing and sensor.place != "body":
        force = getattr(forces, sensor.place)[:, AXES.index(sensor.direction)]
        casing = casing_motion(body, force, step, steady)
        foot = acceleration + casing.acceleration
    mode = sensor.mounting_Hz, sensor.mounting_damping_ratio
    mounted = oscillate(foot, step, *mode, steady)
    times = pace = np.array([0.0, length])
    jitters = bool(steady and sensor.speed_jitter)
    if jitters:
        times = step * np.arange(round((before + length) / step) + 1) - before
        pace = paces(sensor, rng, times, turn)
        foot = interpolate_periodic(acceleration, step, pace)
        if force is not None and casing is not None:
            start = state_at(casing, step, pace[0])
            force = interpolate_periodic(force, step, pace)
            foot += casing_motion(body, force, step, start=start).acceleration
        mounted = oscillate(foot, step, *mode, start=state_at(mounted, step, pace[0]))
    signal = mounted.displacement * (2.0 * np.pi * sensor.mounting_Hz) ** 2
    taken = np.arange(int(length * sensor.rate_Hz * (1 + 1e-12))) / sensor.rate_Hz
    if steady and not jitters:
        lead = round(before / step)
        filtered = low_pass(sensor, np.concatenate((signal[-1 - lead : -1], signal)), step)[lead:]
        values = interpolate_periodic(filtered, step, taken)
    else:
        grid = times if jitters else step * np.arange(len(signal))
        values = CubicSpline(grid, low_pass(sensor, signal, step))(taken)
    return with_noise(sensor, values, taken, (times, pace / turn + phase), rng)


def with_noise(
    sensor: Sensor, values: np.ndarray, taken: np.ndarray, course: tuple[np.ndarray, np.ndarray],
    rng: np.random.Generator,
) -> Record:  # fmt: skip
    """Return the record of filtered samples: with noise, clipped, and with its tacho.

    taken: times (s) of the samples; course: times, and revolutions of the crank there.
    """
    values = values + rng.normal(0.0, sensor.noise_m_per_s2, values.size)
    clipped = float(np.mean(np.abs(values) > sensor.range_m_per_s2))
    values = np.clip(values, -sensor.range_m_per_s2, sensor.range_m_per_s2)
    times, turns = course
    passes = np.arange(np.ceil(max(turns[0], 0.0) - 1e-9), np.floor(turns[-1]) + 1)
    tacho = np.interp(passes, turns, times)
    tacho = tacho[(tacho > -1e-3 / sensor.rate_Hz) & (tacho <= taken[-1])]
    return Record(taken, values, tacho, clipped, np.interp(taken, times, turns))


def low_pass(sensor: Sensor, signal: np.ndarray, step: float) -> np.ndarray:
    """Return what a sensor's anti-aliasing filter leaves of a signal at steps (s), from rest on."""
    from scipy.signal import butter, sosfilt  # takes half a second

    corner = sensor.low_pass_Hz or sensor.rate_Hz / USABLE
    return sosfilt(butter(POLES, corner, fs=1.0 / step, output="sos"), signal)


def state_at(motion: OscillatorMotion, step: float, time: float) -> tuple[float, float]:
    """Return displacement and velocity of a motion that repeats itself, at a time (s)."""
    place, speed = (interpolate_periodic(values, step, np.array([time])) for values in motion[:2])
    return place.item(), speed.item()


def interpolate_periodic(values: np.ndarray, step: float, times: np.ndarray) -> np.ndarray:
    """Return a sampled curve that repeats itself at any times (s), by a cubic spline."""
    return map_coordinates(values[:-1], [times / step], order=3, mode="grid-wrap")


def paces(sensor: Sensor, rng: np.random.Generator, times: np.ndarray, turn: float) -> np.ndarray:
    """Return the times (s) at which a steady crank is as far as the real one at `times`.

    times: of the record, (m,); turn: of a steady revolution (s). The speed's deviation is a cubic
    spline through a Gaussian draw of `speed_jitter` rms for each revolution: of 0.93 of that rms
    over all times, and 0.81 of it for the mean speed of a revolution.
    """
    knots = np.arange(np.floor(times[0] / turn) - 1, np.ceil(times[-1] / turn) + 2)
    deviations = rng.normal(0.0, sensor.speed_jitter, knots.size)
    course = CubicSpline(knots * turn, deviations).antiderivative()
    return times + course(times) - course(0.0)


def noisy(values: np.ndarray, rms: float, seed: Sequence[int]) -> np.ndarray:
    """Return a window's samples (m/s2, (n,)) with white noise of an rms and a seed.

    By numpy's default generator. In a data set the seed is [its seed, the job's key as a number,
    the window's first pulse, the number of the noise level], so that anyone can add the same noise.
    """
    return values + np.random.default_rng(seed).normal(0.0, rms, values.size) if rms else values

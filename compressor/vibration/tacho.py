"""The revolutions of a record: pulses of a tacho, and the crank's turns at the samples."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline, make_smoothing_spline

from compressor.vibration.accelerometer import USABLE, Record
from compressor.vibration.spectra import RecordError, resample_angle

MIN_REVOLUTIONS = 2  # whole revolutions of a record
MIN_SMOOTHED = 5  # pulses of a smoothing spline
LOW, MIDDLE, HIGH = 0.25, 0.5, 0.75  # of a tacho's range: what lies between is no new level
MAX_PULSE_RATIO = 1.5  # longest over shortest time between pulses, beyond which one was missed


def refuse(where: object, mistakes: Iterable[tuple[object, str]]) -> None:
    """Raise RecordError for the first mistake that was made, of (whether it was, words)."""
    for is_made, text in mistakes:
        if is_made:
            raise RecordError(f"{where}: {text}")


def find_pulses(what: str, times: np.ndarray, tacho: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the times at which a tacho rises through its middle, and their uncertainty, s.

    A rise comes from low and goes high, or goes high from the first sample on. Its middle is that
    of the sine that fits it best; samples near the middle count most. A level that jumps between
    two samples jumps anywhere between them; one that rises slowly is known better, and one that
    rises by steps of several samples, as a coarse converter has it, to half of a step.
    """
    low, high = tacho.min(), tacho.max()
    refuse(what, [(low == high, f"is {low:g} all the time; it must rise once a turn")])
    share = (tacho - low) / (high - low)
    certain = np.flatnonzero((share < LOW) | (share > HIGH) | (np.arange(share.size) == 0))
    is_high = share[certain] > HIGH
    rises = np.flatnonzero(~is_high[:-1] & is_high[1:])
    found, within, step = [], [], times[-1] / (times.size - 1)
    for begin, end in zip(certain[rises], certain[rises + 1], strict=True):
        rise, since = share[begin : end + 1] - MIDDLE, times[begin : end + 1] - times[begin]
        jumps = np.diff(rise)
        longest = np.diff(np.flatnonzero(jumps), prepend=0).max()  # samples that are alike
        nearness = 1.0 / (rise**2 + (longest * jumps.max()) ** 2)
        slope, at_begin = np.polyfit(since, np.arcsin(2.0 * rise), 1, w=nearness)
        half = step * (longest / 2.0 if longest > 1 else jumps.max() / 2.0)
        # a record may begin at the middle of a rise, to what is known of it
        if slope > 0.0 and (place := times[begin] - at_begin / slope) > -step - half:
            found.append(place)
            within.append(half)
    gaps = np.diff(found)
    if gaps.size and gaps.max() > MAX_PULSE_RATIO * gaps.min():
        text = f"pulses {gaps.min():g} to {gaps.max():g} s apart"
        raise RecordError(f"{what}: {text}; one a revolution, none missed, none doubled")
    return np.array(found), np.array(within)


def smooth_pulses(pulses: np.ndarray, within: np.ndarray) -> np.ndarray:
    """Return the pulse times of a smooth speed that explains the known ones: s, (k,).

    pulses: s, (k,), one a revolution; within: s, (k,), how far each may be wrong at most. By a
    smoothing spline over the number of the revolution, as smooth as generalised cross-validation
    finds it: pulses of a steady machine come to lie on a line. Where it would move one farther than
    its bound the speed truly changes, and all stay; so do fewer than `MIN_SMOOTHED`.
    """
    if len(pulses) < MIN_SMOOTHED:
        return pulses
    numbers, size = np.arange(len(pulses), dtype=float), within.mean()
    line = np.polyval(np.polyfit(numbers, pulses, 1), numbers)
    # in sizes of an error: cross-validation looks among smoothing parameters of the order of 1
    spline = make_smoothing_spline(numbers, (pulses - line) / size, w=(size / within) ** 2)
    smooth = line + size * spline(numbers)
    return smooth if (np.abs(smooth - pulses) <= within).all() else pulses


def shift_pulses(pulses: np.ndarray, degrees: float, times: np.ndarray) -> np.ndarray:
    """Return the times of top dead centre within a record by pulses at a crank angle.

    The speed is even between two pulses; before the first and behind the last it stays.
    """
    if not degrees:
        return pulses
    turns = np.arange(len(pulses) + 1) - (degrees / 360.0) % 1.0
    found = make_interp_spline(np.arange(len(pulses)), pulses, k=1)(turns)
    # a record may begin at top dead centre
    return found[(found >= -0.5 * times[1]) & (found <= times[-1])]


def steady_pulses(rpm: float | None, tdc: float | None, start: float, length: float) -> np.ndarray:
    """Return the times of top dead centre at a steady speed, s, in a record from `start` on."""
    rpm, tdc = (math.nan if one is None else one for one in (rpm, tdc))
    if not (math.isfinite(rpm) and rpm > 0.0 and math.isfinite(tdc)):
        text = f"a speed of {rpm:g} rpm with top dead centre at {tdc:g} s"
        raise RecordError(f"{text}: give a finite speed above 0, and a finite time")
    turn = 60.0 / rpm
    first, last = math.ceil((start - tdc) / turn), math.floor((start - tdc + length) / turn)
    return tdc - start + turn * np.arange(first, last + 1)


def check_record(times: np.ndarray, values: np.ndarray, tacho: np.ndarray) -> int:
    """Return the whole revolutions of a record. Raises RecordError if it cannot be used."""
    step = (times[-1] - times[0]) / max(len(times) - 1, 1)
    refuse("a record", [
        (len(tacho) <= MIN_REVOLUTIONS, f"{len(tacho)} tacho pulses are too few: at least "
         f"{MIN_REVOLUTIONS + 1}, for whole revolutions"),
        (len(times) != len(values), f"{len(times)} times and {len(values)} values"),
        (not (np.diff(tacho) > 0.0).all(), "the tacho pulses do not increase: sort them"),
        (not ((tacho > times[0] - step) & (tacho < times[-1] + step)).all(), "tacho pulses lie "
         f"beyond the samples, {times[0]:g} to {times[-1]:g} s: pass those within"),
        (not np.isfinite(values).all(), "its values are not all numbers: cut the gaps"),
    ])  # fmt: skip
    return len(tacho) - 1


def turns_at(times: np.ndarray, tacho: np.ndarray) -> np.ndarray:
    """Return the revolutions since the first pulse at each time.

    Beyond the pulses the nearest revolution's pace counts.
    """
    turns = np.interp(times, tacho, np.arange(len(tacho)))
    turns += np.minimum(times - tacho[0], 0.0) / (tacho[1] - tacho[0])
    return turns + np.maximum(times - tacho[-1], 0.0) / (tacho[-1] - tacho[-2])


def cut_windows(record: Record, revolutions: int) -> Iterator[tuple[int, Record]]:
    """Yield the windows of a record, each behind the number of the pulse that it begins with.

    A window reaches from the last sample that is not after a pulse to the first that is not before
    the pulse `revolutions` later, with which the next one begins.
    """
    for first in range(0, len(record.tacho) - revolutions, revolutions):
        pulses = record.tacho[first : first + revolutions + 1]
        begin = max(int(np.searchsorted(record.times, pulses[0], side="right")) - 1, 0)
        inside = slice(begin, int(np.searchsorted(record.times, pulses[-1])) + 1)
        since = record.times[begin]
        times, values = record.times[inside] - since, record.values[inside]
        yield first, Record(times, values, pulses - since, record.clipped)


@dataclass(frozen=True)
class Revolutions:
    """A record by whole revolutions, at equal crank angles.

    values: (revolutions, samples a revolution), m/s2; first: where the first sample is, in
    revolutions after top dead centre, up to a step before it; speed: mean, rev/s; rate: Hz.
    """

    values: np.ndarray
    first: float
    speed: float
    rate: float

    @property
    def highest(self) -> int:
        """Return the highest order that the sampling rate holds."""
        return math.floor(self.rate / USABLE / self.speed)

    @property
    def rpm(self) -> float:
        """Return the mean speed in rpm."""
        return 60.0 * self.speed

    def lines(self, orders: int) -> np.ndarray:
        """Return the orders 1, 2, ... of each revolution, complex and rms, (n, orders)."""
        scale = math.sqrt(2.0) / self.values.shape[1]
        found = np.fft.rfft(self.values, axis=1)[:, : orders + 1] * scale
        return (found * np.exp(-2j * np.pi * self.first * np.arange(found.shape[1])))[:, 1:]


def by_revolutions(record: Record, multiple: int = 2) -> Revolutions:
    """Return a record by whole revolutions; samples a revolution are a multiple of a number.

    Raises RecordError if it cannot be used.
    """
    whole = check_record(record.times, record.values, record.tacho)
    turns = turns_at(record.times, record.tacho)
    # from the last sample that is not after the first pulse: the rest then reach over all turns
    first = max(int(np.searchsorted(turns, 0.0, side="right")) - 1, 0)
    inside = slice(first, int(np.searchsorted(turns, whole)) + 2)
    speed = whole / (record.tacho[-1] - record.tacho[0])
    count = multiple * math.ceil(record.rate / speed / multiple)
    even = resample_angle(2.0 * math.pi * turns[inside], record.values[inside], count)
    values = even[: whole * count].reshape(-1, count)
    return Revolutions(values, float(turns[first]), speed, record.rate)

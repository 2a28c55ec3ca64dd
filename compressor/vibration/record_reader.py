"""A file's samples and tacho as a `Record`: what a diagnosis or a comparison begins with."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compressor.program import did_you_mean
from compressor.vibration.accelerometer import Record
from compressor.vibration.record_files import (
    HEADER,
    TACHO,
    TIME,
    UNITS,
    VALUE,
    RecordError,
    RecordFile,
    channel_names,
    open_record_file,
    unit_name,
)
from compressor.vibration.spectra import smooth_pulses

MIN_REVOLUTIONS = 2  # whole revolutions of a record
UNEVEN = 0.1  # of a time step, by which a step may differ from the mean one
LOW, MIDDLE, HIGH = 0.25, 0.5, 0.75  # of a tacho's range: what lies between is no new level
MAX_PULSE_RATIO = 1.5  # longest over shortest time between pulses, beyond which one was missed
SAME_STEP = 1e-9  # share by which two channels' time steps may differ


@dataclass(frozen=True)
class RecordHints:
    """What a file does not say of its record, or says wrong.

    channel, tacho: names or numbers (from 1) of channels; unit: one of `UNITS`, in place of what
    the file says; rate: Hz, of a file without times; full_scale: of whole numbers, in the unit;
    tacho_deg: crank angle at which the tacho rises. rpm, tdc: a steady speed and a time (s) of top
    dead centre, both in place of a tacho.
    """

    channel: str = ""
    tacho: str = ""
    unit: str = ""
    rate: float | None = None
    full_scale: float | None = None
    tacho_deg: float = 0.0
    rpm: float | None = None
    tdc: float | None = None

    def pulses(self, times: np.ndarray) -> np.ndarray:
        """Return the times of top dead centre within a record at the steady speed, (k,)."""
        rpm, tdc = (math.nan if one is None else one for one in (self.rpm, self.tdc))
        if not (math.isfinite(rpm) and rpm > 0.0 and math.isfinite(tdc)):
            text = f"a speed of {rpm:g} rpm with top dead centre at {tdc:g} s"
            raise RecordError(f"{text}: give a finite speed above 0, and a finite time")
        turn = 60.0 / rpm
        first, last = (times[[0, -1]] - tdc) / turn
        return tdc + turn * np.arange(math.ceil(first), math.floor(last) + 1)


def read_record(path: str | Path, **known: Any) -> Record:
    """Return the record of a file whose type is one of `READERS`; known: of `RecordHints`.

    The tacho is any voltage that rises once a revolution, at top dead centre or at a known angle,
    through the middle of its range: a sine, a square or a short pulse. Pulses are interpolated
    between samples, and then smoothed by what is not known of them between two samples
    (`smooth_pulses`). Without that channel, and only then, `rpm` and `tdc` give it. Channels that
    are not chosen are ignored, and so are lines at the end of a CSV file in which the others are
    empty. `clipped` is nan: the range is not known.

    Raises RecordError with file, line or sample, and channel for what cannot be read: a missing
    channel, an unknown unit, what is no finite number, unequal time steps, pulses that are too few
    or irregular.
    """
    path, hints = Path(path), RecordHints(**known)
    file = open_record_file(path)
    value, clock = _value_channel(file, hints), _time_channel(file, hints)
    tacho = _tacho_channel(file, hints)
    wanted = [number for number in dict.fromkeys((value, tacho, clock)) if number is not None]
    columns = dict(zip(wanted, file.read(wanted), strict=True))
    _check_columns(file, columns)
    size = columns[value].size
    times = (
        _times(file, hints, value, size) if clock is None else _even(file, clock, columns[clock])
    )
    values = columns[value] * _scale(file, hints, value)
    if tacho is None:
        pulses = hints.pulses(times)
    else:
        what = f"{path}: {file.channels[tacho].name}"
        pulses, within = _pulses(what, times, columns[tacho])
        if len(pulses) > MIN_REVOLUTIONS:
            pulses = _shift(smooth_pulses(pulses, within), hints.tacho_deg, times)
    if len(pulses) <= MIN_REVOLUTIONS:
        found = f"{len(pulses)} passes of top dead centre in {times[-1] - times[0]:g} s"
        raise RecordError(f"{path}: {found}: at least {MIN_REVOLUTIONS + 1}; record for longer")
    return Record(times, values, pulses, math.nan)


def _pick(file: RecordFile, word: str, option: str) -> int:
    """Return the channel that a name or a number (from 1) means, from 0. Raises RecordError."""
    names = [one.name for one in file.channels]
    if names.count(word) == 1:
        return names.index(word)
    if word.isascii() and word.isdigit() and 1 <= int(word) <= len(names):
        return int(word) - 1
    problem = f"{names.count(word)} channels" if word in names else "no channel"
    near = did_you_mean(word, names) or f"there are {channel_names(file.channels)}"
    text = f"{file.path}: {option} {word}: {problem} of this name"
    raise RecordError(f"{text}; {near}; or give its number, 1 to {len(names)}")


def _value_channel(file: RecordFile, hints: RecordHints) -> int:
    """Return the channel of the acceleration: the chosen one, or the only one that says so."""
    if hints.channel:
        return _pick(file, hints.channel, "--channel")
    found = [n for n, one in enumerate(file.channels) if one.kind == "acceleration"]
    if len(found) == 1:
        return found[0]
    has = channel_names(file.channels)
    where = f"{file.path}:1" if file.first_line else f"{file.path}"
    if not found:
        remedy = "name the channel by --channel and --unit"
        if file.first_line:
            remedy = f"begin the file with the line {HEADER}, or {remedy}"
        raise RecordError(f"{where}: no column {VALUE}, only {has}; {remedy}")
    raise RecordError(f"{where}: {len(found)} accelerations among {has}; choose one by --channel")


def _time_channel(file: RecordFile, hints: RecordHints) -> int | None:
    """Return the channel of times, None where the step is known. Raises RecordError."""
    found = [n for n, one in enumerate(file.channels) if one.kind == "time"]
    if hints.rate is not None and (found or file.clocks):
        raise RecordError(f"{file.path}: says its times: leave --rate out")
    if not found and not file.clocks and hints.rate is None:
        where = f"{file.path}:1" if file.first_line else f"{file.path}"
        text = f"{where}: no column {TIME}, only {channel_names(file.channels)}"
        raise RecordError(f"{text}; begin the file with the line {HEADER}, or give --rate")
    return found[0] if found else None


def _tacho_channel(file: RecordFile, hints: RecordHints) -> int | None:
    """Return the channel of the tacho, None with a steady speed. Raises RecordError."""
    found = [n for n, one in enumerate(file.channels) if one.kind == "tacho"]
    if hints.tacho:
        found = [_pick(file, hints.tacho, "--tacho")]
    is_steady = hints.rpm is not None or hints.tdc is not None
    if not math.isfinite(hints.tacho_deg) or (is_steady and hints.tacho_deg):
        raise RecordError("--tacho-deg is a finite angle of a tacho: leave it out with --rpm")
    if found and is_steady:
        raise RecordError(f"{file.path}: has a tacho column: leave --rpm and --tdc out")
    if len(found) > 1:
        raise RecordError(f"{file.path}: {len(found)} channels are a tacho; choose one by --tacho")
    if not found and not is_steady:
        remedy = "add it, or give --rpm and --tdc for a steady speed, or name one by --tacho"
        raise RecordError(f"{file.path}: has no column {TACHO}: {remedy}")
    return found[0] if found else None


def _check_columns(file: RecordFile, columns: dict[int, np.ndarray]) -> None:
    """Raise RecordError where channels are not finite, or not of one length and clock."""
    sizes = {file.channels[n].name: column.size for n, column in columns.items()}
    if len(set(sizes.values())) > 1:
        text = ", ".join(f"{name} {size}" for name, size in sizes.items())
        raise RecordError(f"{file.path}: channels of different length: {text}; cut the longer one")
    for number, column in columns.items():
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            text = f"{column[bad[0]]} is not finite"
            raise RecordError(f"{file.place(number, bad[0])}: {text}; cut the record")
    if min(sizes.values()) < 2:
        raise RecordError(f"{file.path}: {min(sizes.values())} samples are no record")
    clocks = np.array([file.clocks[n] for n in columns]) if file.clocks else np.zeros((1, 2))
    if np.abs(clocks - clocks[0]).max() > SAME_STEP * clocks[0, 1]:
        steps = ", ".join(f"{file.channels[n].name} {file.clocks[n][1]:g} s" for n in columns)
        raise RecordError(f"{file.path}: channels begin at different times or steps: {steps}")


def _times(file: RecordFile, hints: RecordHints, value: int, size: int) -> np.ndarray:
    """Return the times of the samples by the file's step, or the chosen rate, (m,)."""
    start, step = file.clocks[value] if file.clocks else (0.0, math.nan)
    if hints.rate is not None and hints.rate > 0.0:
        step = 1.0 / hints.rate
    if not (math.isfinite(step) and step > 0.0):
        raise RecordError(f"{file.path}: has no time step above 0: give --rate above 0")
    return start + step * np.arange(size)


def _even(file: RecordFile, clock: int, times: np.ndarray) -> np.ndarray:
    """Return the equally spaced times, as nearly equal ones that were rounded mean them."""
    step = (times[-1] - times[0]) / (times.size - 1)
    steps = np.diff(times)
    bad = np.flatnonzero(~(np.abs(steps - step) <= UNEVEN * abs(step)) | (steps <= 0.0))
    if bad.size:
        where = file.place(clock, int(bad[0]) + 1)  # the second sample of the step
        text = f"a step of {steps[bad[0]]:g} s, where the mean one is {step:g} s"
        remedy = "resample to equal steps, or write times with more digits"
        raise RecordError(f"{where}: {text}; {remedy}")
    return times[0] + step * np.arange(times.size)


def _scale(file: RecordFile, hints: RecordHints, value: int) -> float:
    """Return what a sample of 1 is in m/s2. Raises RecordError where it is not known."""
    channel, listed = file.channels[value], ", ".join(UNITS)
    unit = unit_name(hints.unit or channel.unit)
    if not unit:
        says = f"the unit {hints.unit or channel.unit!r}" if hints.unit or channel.unit else (
            "no unit"
        )  # fmt: skip
        text = f"{file.path}: channel {channel.name} has {says}"
        raise RecordError(f"{text}: give --unit, one of {listed}")
    if file.is_integer == (hints.full_scale is None):
        text = "has whole numbers: give --full-scale, the acceleration of the greatest, in --unit"
        surplus = "has the values themselves: leave --full-scale out"
        raise RecordError(f"{file.path}: {text if file.is_integer else surplus}")
    return UNITS[unit] * (1.0 if hints.full_scale is None else hints.full_scale)


def _pulses(what: str, times: np.ndarray, tacho: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the times at which a tacho rises through its middle, and their uncertainty, s.

    A rise comes from low and goes high, or goes high from the first sample on. A level that jumps
    between two samples jumps anywhere between them; one that rises slowly is known better.
    """
    low, high = tacho.min(), tacho.max()
    if low == high:
        raise RecordError(f"{what}: is {low:g} all the time; it must rise once a turn")
    share = (tacho - low) / (high - low)
    level = np.where(share > HIGH, 1, np.where(share < LOW, -1, 0))
    level[0] = level[0] or -1  # the record may begin within a rise
    certain = np.flatnonzero(level)
    is_high = level[certain] > 0
    rises = np.flatnonzero(~is_high[:-1] & is_high[1:])
    step = times[1] - times[0]
    found, within = [], []
    for before, after in zip(certain[rises], certain[rises + 1], strict=True):
        k = max(1, before + int(np.argmax(share[before : after + 1] >= MIDDLE)))
        jump = share[k] - share[k - 1]
        part = (MIDDLE - share[k - 1]) / jump if jump > 0.0 else -math.inf
        if part > -1.0:  # otherwise the record begins more than a sample behind the middle
            found.append(times[k - 1] + part * step)
            within.append(jump * step / 2.0)
    gaps = np.diff(found)
    if gaps.size and gaps.max() > MAX_PULSE_RATIO * gaps.min():
        text = f"pulses {gaps.min():g} to {gaps.max():g} s apart"
        raise RecordError(f"{what}: {text}; one a revolution, none missed, none doubled")
    return np.array(found), np.array(within)


def _shift(pulses: np.ndarray, degrees: float, times: np.ndarray) -> np.ndarray:
    """Return the times of top dead centre within a record by pulses at a crank angle.

    The speed is even between two pulses; before the first and behind the last it stays.
    """
    if not degrees:
        return pulses
    numbers = np.arange(len(pulses))
    turns = np.arange(len(pulses) + 1) - (degrees / 360.0) % 1.0
    found = np.interp(turns, numbers, pulses)
    found += np.minimum(turns, 0.0) * (pulses[1] - pulses[0])
    found += np.maximum(turns - numbers[-1], 0.0) * (pulses[-1] - pulses[-2])
    half = 0.5 * (times[1] - times[0])  # a record may begin at top dead centre
    return found[(found >= times[0] - half) & (found <= times[-1])]


def check_record(times: np.ndarray, values: np.ndarray, tacho: np.ndarray) -> int:
    """Return the whole revolutions of a record. Raises RecordError if it cannot be used."""
    whole = len(tacho) - 1
    if whole < MIN_REVOLUTIONS:
        text = f"{len(tacho)} tacho pulses are too few: at least {MIN_REVOLUTIONS + 1}"
        raise RecordError(f"{text}, for whole revolutions")
    if len(times) != len(values):
        raise RecordError(f"{len(times)} times and {len(values)} values: pass one for each")
    if not (np.diff(tacho) > 0.0).all():
        raise RecordError("the tacho pulses do not increase: sort them, and drop double ones")
    step = times[1] - times[0] if len(times) > 1 else math.nan
    if not (tacho[0] > times[0] - step and tacho[-1] < times[-1] + step):
        text = f"tacho pulses lie beyond the samples, {times[0]:g} to {times[-1]:g} s"
        raise RecordError(f"{text}: pass those within")
    if not np.isfinite(values).all():
        raise RecordError("the record's values are not all numbers: fill or cut the gaps")
    return whole


def turns_at(times: np.ndarray, tacho: np.ndarray) -> np.ndarray:
    """Return the revolutions since the first pulse at each time.

    Beyond the pulses the nearest revolution's pace counts.
    """
    turns = np.interp(times, tacho, np.arange(len(tacho)))
    turns += np.minimum(times - tacho[0], 0.0) / (tacho[1] - tacho[0])
    return turns + np.maximum(times - tacho[-1], 0.0) / (tacho[-1] - tacho[-2])

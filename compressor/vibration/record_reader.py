"""A file's samples and tacho as a `Record`: what a diagnosis or a comparison begins with."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from compressor.program import did_you_mean
from compressor.vibration.accelerometer import Record
from compressor.vibration.record_files import (
    HEADER,
    TACHO,
    TIME,
    TIME_UNITS,
    UNITS,
    VALUE,
    RecordError,
    RecordFile,
    open_record_file,
    time_unit_name,
    unit_name,
)
from compressor.vibration.spectra import smooth_pulses

MIN_REVOLUTIONS = 2  # whole revolutions of a record
UNEVEN = 0.1  # of a time step, by which a step may differ from the mean one
PLAIN = "separator comma, decimal point, header in line 1,"  # as our own files are
SAME_RATE = 1e-4  # share by which times and a rate beside them may differ
LOW, MIDDLE, HIGH = 0.25, 0.5, 0.75  # of a tacho's range: what lies between is no new level
MAX_PULSE_RATIO = 1.5  # longest over shortest time between pulses, beyond which one was missed
SAME_STEP = 1e-9  # share by which two channels' time steps may differ


@dataclass(frozen=True)
class RecordHints:
    """What a file does not say of its record, or says wrong.

    channel, tacho, time: names or numbers (from 1) of channels; unit: one of `UNITS`, in place of
    what the file says, and time_unit one of `TIME_UNITS`; separator, decimal, skip_lines: of a file
    of text, as `open_text_table` has them; rate: Hz, of a file without times; full_scale: of whole
    numbers, in the unit; tacho_deg: crank angle at which the tacho rises. rpm, tdc: a steady speed
    and a time (s) of top dead centre, both in place of a tacho.
    """

    channel: str = ""
    tacho: str = ""
    time: str = ""
    unit: str = ""
    time_unit: str = ""
    separator: str = ""
    decimal: str = ""
    skip_lines: int | None = None
    rate: float | None = None
    full_scale: float | None = None
    tacho_deg: float = 0.0
    rpm: float | None = None
    tdc: float | None = None

    @property
    def layout(self) -> dict[str, Any]:
        """Return what is told of a file of text, by the names of `open_text_table`."""
        found = {"separator": self.separator, "decimal": self.decimal}
        told: dict[str, Any] = {name: value for name, value in found.items() if value}
        return told | ({} if self.skip_lines is None else {"skip_lines": self.skip_lines})

    def pulses(self, start: float, length: float) -> np.ndarray:
        """Return the times of top dead centre in a record at the steady speed, s, from its begin.

        start: the first sample's time, by which `tdc` counts; length: of the record.
        """
        rpm, tdc = (math.nan if one is None else one for one in (self.rpm, self.tdc))
        if not (math.isfinite(rpm) and rpm > 0.0 and math.isfinite(tdc)):
            text = f"a speed of {rpm:g} rpm with top dead centre at {tdc:g} s"
            raise RecordError(f"{text}: give a finite speed above 0, and a finite time")
        turn = 60.0 / rpm
        first = math.ceil((start - tdc) / turn)
        last = math.floor((start - tdc + length) / turn)
        return tdc - start + turn * np.arange(first, last + 1)


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
    file = open_record_file(path, **hints.layout)
    value, clock = _value_channel(file, hints), _time_channel(file, hints)
    tacho = _tacho_channel(file, hints)
    wanted = [number for number in dict.fromkeys((value, tacho, clock)) if number is not None]
    columns = dict(zip(wanted, file.read(wanted), strict=True))
    _check_columns(file, columns)
    remarks = []
    if file.layout and not file.layout.startswith(PLAIN):
        parts = {"times": clock, "acceleration": value, "tacho": tacho}
        named = [f"{what} {file.channels[n].name}" for what, n in parts.items() if n is not None]
        remarks.append(f"{path}: {file.layout}; {', '.join(named)}")
    start, times, stamps = _times(file, hints, value, columns, clock)
    values = columns[value] * _scale(file, hints, value)
    if stamps is not None:
        values = CubicSpline(stamps, values)(times)
        steps, step = np.diff(stamps), times[1]
        remarks.append(
            f"{file.channels[clock or 0].name}: steps of {steps.min() / step:.3g} to "
            f"{steps.max() / step:.3g} times the mean one, up to {np.abs(stamps - times).max():.2g}"
            " s off equal ones: samples are put on equal steps by their own times"
        )
    if tacho is None:
        pulses = hints.pulses(start, times[-1])
    else:
        what = f"{path}: {file.channels[tacho].name}"
        pulses, within = _pulses(what, times if stamps is None else stamps, columns[tacho])
        if len(pulses) > MIN_REVOLUTIONS:
            pulses = _shift(smooth_pulses(pulses, within), hints.tacho_deg, times)
            pulses = pulses[pulses > times[0] - times[1]]
        if not hints.tacho_deg and (name := file.channels[tacho].name).lower() != TACHO:
            remarks.append(
                f"{name}: its rise counts as top dead centre; --tacho-deg says its angle"
            )
    if len(pulses) <= MIN_REVOLUTIONS:
        found = f"{len(pulses)} passes of top dead centre in {times[-1] - times[0]:g} s"
        raise RecordError(f"{path}: {found}: at least {MIN_REVOLUTIONS + 1}; record for longer")
    return Record(times, values, pulses, math.nan, remarks=tuple(remarks))


def names_of(file: RecordFile) -> str:
    """Return the names of a file's channels."""
    return ", ".join(one.name for one in file.channels) or "no signals"


def _pick(file: RecordFile, word: str, option: str) -> int:
    """Return the channel that a name or a number (from 1) means, from 0. Raises RecordError."""
    names = [one.name for one in file.channels]
    if names.count(word) == 1:
        return names.index(word)
    if word.isascii() and word.isdigit() and 1 <= int(word) <= len(names):
        return int(word) - 1
    problem = f"{names.count(word)} channels" if word in names else "no channel"
    near = did_you_mean(word, names) or f"there are {names_of(file)}"
    text = f"{file.path}: {option} {word}: {problem} of this name"
    raise RecordError(f"{text}; {near}; or give its number, 1 to {len(names)}")


def _value_channel(file: RecordFile, hints: RecordHints) -> int:
    """Return the channel of the acceleration: the chosen one, or the only one that says so."""
    if hints.channel:
        return _pick(file, hints.channel, "--channel")
    found = [n for n, one in enumerate(file.channels) if one.kind == "acceleration"]
    if len(found) == 1:
        return found[0]
    has = file.content
    if not found:
        remedy = "name the channel by --channel and --unit"
        if file.first_line:
            remedy = f"write {HEADER} as titles of columns, or {remedy}"
        raise RecordError(f"{file.path}: no column {VALUE}, {has}; {remedy}")
    names = ", ".join(file.channels[n].name for n in found)
    raise RecordError(f"{file.path}: {len(found)} accelerations, {names}; choose one by --channel")


def _time_channel(file: RecordFile, hints: RecordHints) -> int | None:
    """Return the channel of times, None where the step is known. Raises RecordError."""
    found = [n for n, one in enumerate(file.channels) if one.kind == "time"]
    if hints.time:
        found = [_pick(file, hints.time, "--time")]
    if len(found) > 1:
        raise RecordError(f"{file.path}: {len(found)} channels are times; choose one by --time")
    if hints.rate is not None and (found or file.clocks):
        raise RecordError(f"{file.path}: says its times: leave --rate out")
    if not found and not file.clocks and hints.rate is None:
        text = f"{file.path}: no column {TIME}, {file.content}"
        raise RecordError(f"{text}; name the times by --time and --time-unit, or give --rate")
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


def _times(
    file: RecordFile, hints: RecordHints, value: int, columns: dict[int, np.ndarray],
    clock: int | None,
) -> tuple[float, np.ndarray, np.ndarray | None]:  # fmt: skip
    """Return the first sample's time (s), equal steps from it on (s, (m,)), and uneven times.

    Equal steps are the file's, the chosen rate's, or the times' where these were only rounded;
    otherwise the file's own times from the first one on come with them, else None.
    """
    size = columns[value].size
    if clock is None:
        start, step = file.clocks[value] if file.clocks else (0.0, math.nan)
        if hints.rate is not None and hints.rate > 0.0:
            step = 1.0 / hints.rate
        if not (math.isfinite(step) and step > 0.0):
            raise RecordError(f"{file.path}: has no time step above 0: give --rate above 0")
        return start, step * np.arange(size), None
    unit = _time_unit(file, hints, clock)
    written = columns[clock]
    # from the first one on: the steps of large times would lose digits
    times = (written - written[0]) * unit
    step, steps = times[-1] / (size - 1), np.diff(times)
    bad = np.flatnonzero(~(np.abs(steps - step) <= UNEVEN * abs(step)) | (steps <= 0.0))
    if bad.size:
        where = file.place(clock, int(bad[0]) + 1)  # the second sample of the step
        text = f"a step of {steps[bad[0]]:g} s, where the mean one is {step:g} s"
        remedy = "resample to equal steps, or write times with more digits"
        raise RecordError(f"{where}: {text}; {remedy}")
    grain = unit * _grain(written)
    if abs(file.rate * step - 1.0) > SAME_RATE + grain / times[-1]:
        name = file.channels[clock].name
        text = f"{name} has {1.0 / step:.6g} samples a second, and rate_Hz says {file.rate:.6g}"
        raise RecordError(f"{file.path}: {text}: save one of them")
    even = step * np.arange(size)
    is_rounded = np.abs(times - even).max() <= grain
    return float(written[0]) * unit, even, None if is_rounded else times


def _time_unit(file: RecordFile, hints: RecordHints, clock: int) -> float:
    """Return what a time of 1 is in s. Raises RecordError where it is not known."""
    channel = file.channels[clock]
    says = hints.time_unit or channel.unit
    if unit := time_unit_name(says):
        return TIME_UNITS[unit]
    text = f"{file.path}: {channel.name} has {f'the unit {says!r}' if says else 'no unit'} of time"
    raise RecordError(f"{text}: give --time-unit, one of {', '.join(TIME_UNITS)}")


def _grain(written: np.ndarray) -> float:
    """Return the step by which numbers were rounded: a power of ten, or the floats' own."""
    large = np.abs(written[np.abs(written) >= 0.1 * np.abs(written).max()])
    own = 4.0 * float(np.spacing(large.max()))
    for power in range(16):
        whole = large * 10.0**power
        if np.abs(whole - np.round(whole)).max() <= 1e-6 + 4.0 * np.spacing(whole.max()):
            return max(10.0**-power, own) * (1.0 + 1e-6)
    return own


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
    between two samples jumps anywhere between them; one that rises slowly is known better, and one
    that rises by steps of several samples, as a coarse converter has it, to half of a step.
    """
    low, high = tacho.min(), tacho.max()
    if low == high:
        raise RecordError(f"{what}: is {low:g} all the time; it must rise once a turn")
    share = (tacho - low) / (high - low)
    level = np.where(share > HIGH, 1, np.where(share < LOW, -1, 0))
    is_within = level[0] == 0  # the record begins within a rise
    level[0] = level[0] or -1
    certain = np.flatnonzero(level)
    is_high = level[certain] > 0
    rises = np.flatnonzero(~is_high[:-1] & is_high[1:])
    places, within = [], []  # in samples
    for before, after in zip(certain[rises], certain[rises + 1], strict=True):
        place, half = _crossing(share[before : after + 1], is_within and not before)
        if before + place > -1.0:  # else the record begins more than a sample behind the middle
            places.append(before + place)
            within.append(half)
    step = times[-1] / (times.size - 1)
    found = np.interp(places, np.arange(times.size), times) + np.minimum(places, 0.0) * step
    gaps = np.diff(found)
    if gaps.size and gaps.max() > MAX_PULSE_RATIO * gaps.min():
        text = f"pulses {gaps.min():g} to {gaps.max():g} s apart"
        raise RecordError(f"{what}: {text}; one a revolution, none missed, none doubled")
    return found, np.array(within) * step


def _crossing(rise: np.ndarray, is_cut: bool) -> tuple[float, float]:
    """Return where a rise passes `MIDDLE`, in samples from its first, and how far that may be off.

    rise: shares of the range from the last low sample to the first high one; is_cut: the rise began
    before its first sample. Samples that are alike count at their middle: the straight line between
    the middles of two levels is where a slow signal was before it was made coarse.
    """
    begins = np.flatnonzero(np.diff(rise, prepend=-1.0))  # of levels
    lengths = np.diff(begins, append=rise.size)
    middles, levels = begins + (lengths - 1) / 2.0, rise[begins]
    if is_cut and lengths[0] > 1 and lengths.size < 3:  # nothing says where it began
        return -math.inf, 0.0
    if is_cut and lengths.size > 1:  # as long as the next level, as far as it was recorded
        lengths[0] = max(lengths[:2])
        middles[0] = begins[1] - (lengths[0] + 1) / 2.0
    k = max(1, int(np.argmax(levels > MIDDLE)))
    above = levels[k] > MIDDLE
    below = np.flatnonzero(levels[:k] < MIDDLE)
    j = int(below[-1]) if below.size and above else k - 1
    jump = levels[k] - levels[j]
    if jump <= 0.0:
        return -math.inf, 0.0
    place = middles[j] + (MIDDLE - levels[j]) / jump * (middles[k] - middles[j])
    longest = lengths[j : k + 1].max()
    return float(place), longest / 2.0 if longest > 1 else jump / 2.0


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
    half = 0.5 * (times[-1] - times[0]) / (times.size - 1)  # a record may begin at top dead centre
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
    step = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else math.nan
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

"""A file's samples and tacho as a `Record`: what a diagnosis or a comparison begins with."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

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
OPTIONS = {"time": "time", "acceleration": "channel", "tacho": "tacho"}  # that name a channel


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
        names = ("separator", "decimal", "skip_lines")
        return {one: getattr(self, one) for one in names if getattr(self, one) not in ("", None)}

    @property
    def is_steady(self) -> bool:
        """Return whether a steady speed stands in for a tacho."""
        return self.rpm is not None or self.tdc is not None


def read_record(path: str | Path, **known: Any) -> Record:
    """Return the record of a file whose type is one of `READERS`; known: of `RecordHints`.

    The tacho is any voltage that rises once a revolution, at top dead centre or at a known angle,
    through the middle of its range: a sine, a square or a short pulse. Pulses are interpolated
    between samples, and then smoothed by what is not known of them between two samples
    (`smooth_pulses`). Without that channel, and only then, `rpm` and `tdc` give it. Channels that
    are not chosen are ignored, and so are lines at the end of a CSV file in which the others are
    empty. `clipped` is nan: the range is not known.

    Raises RecordError, or TextTableError, with file, line or sample, and channel for what cannot be
    read: a missing channel, an unknown unit, what is no finite number, unequal time steps, pulses
    that are too few or irregular.
    """
    path, hints = Path(path), RecordHints(**known)
    file = open_record_file(path, **hints.layout)
    chosen = _choose_channels(file, hints)
    names = {kind: file.channels[number].name for kind, number in chosen.items()}
    numbers = list(dict.fromkeys(chosen.values()))
    columns = dict(zip(numbers, file.read(numbers), strict=True))
    _check_samples(file, columns)
    remarks = []
    if file.layout and not file.layout.startswith(PLAIN):
        named = ", ".join(f"{kind} {name}" for kind, name in names.items())
        remarks.append(f"{path}: {file.layout}; {named}")
    value = chosen["acceleration"]
    values = columns[value] * UNITS[unit_name(hints.unit or file.channels[value].unit)]
    values *= hints.full_scale or 1.0
    start, times, stamps = _find_times(file, hints, chosen, columns)
    if stamps is not None:
        values, off = CubicSpline(stamps, values)(times), np.abs(stamps - times).max()
        remarks.append(
            f"{names['time']}: times up to {off / times[1]:.2g} steps off equal ones: samples are "
            "put on equal steps by their own times"
        )
    if "tacho" in chosen:
        what = f"{path}: {names['tacho']}"
        tacho = columns[chosen["tacho"]]
        pulses, within = _find_pulses(what, times if stamps is None else stamps, tacho)
        if len(pulses) > MIN_REVOLUTIONS:
            pulses = _shift(smooth_pulses(pulses, within), hints.tacho_deg, times)
            pulses = np.maximum(pulses, -0.99 * times[1])  # at the record's begin, to a sample
        if not hints.tacho_deg and names["tacho"].lower() != TACHO:
            text = "its rise counts as top dead centre; --tacho-deg says its angle"
            remarks.append(f"{names['tacho']}: {text}")
    else:
        pulses = _steady_pulses(hints, start, times[-1])
    found = f"{len(pulses)} passes of top dead centre in {times[-1] - times[0]:g} s"
    few = f"{found}: at least {MIN_REVOLUTIONS + 1}; record for longer"
    _refuse(path, [(len(pulses) <= MIN_REVOLUTIONS, few)])
    return Record(times, values, pulses, math.nan, remarks=tuple(remarks))


def _refuse(where: object, mistakes: Iterable[tuple[object, str]]) -> None:
    """Raise RecordError for the first mistake that was made, of (whether it was, words)."""
    for is_made, text in mistakes:
        if is_made:
            raise RecordError(f"{where}: {text}")


def _pick(file: RecordFile, word: str, option: str) -> int:
    """Return the channel that a name or a number (from 1) means, from 0. Raises RecordError."""
    names = [one.name for one in file.channels]
    if names.count(word) == 1:
        return names.index(word)
    if word.isascii() and word.isdigit() and 1 <= int(word) <= len(names):
        return int(word) - 1
    problem = f"{names.count(word)} channels" if word in names else "no channel"
    near = did_you_mean(word, names) or f"there are {', '.join(names) or 'no signals'}"
    text = f"{file.path}: --{option} {word}: {problem} of this name"
    raise RecordError(f"{text}; {near}; or give its number, 1 to {len(names)}")


def _choose_channels(file: RecordFile, hints: RecordHints) -> dict[str, int]:
    """Return the channels by kind: chosen ones, or the only ones that say so.

    Without times where steps are known, and without a tacho at a steady speed. Raises RecordError
    for a channel that is missing, not the only one, or of no known unit.
    """
    found = {
        kind: [n for n, one in enumerate(file.channels) if one.kind == kind] for kind in OPTIONS
    }
    for kind, option in OPTIONS.items():
        if word := getattr(hints, option):
            found[kind] = [_pick(file, word, option)]
    times, values, tachos = found.values()
    has_times, has = bool(times or file.clocks), file.content
    titles = f"write {HEADER} as titles of columns, or " if file.first_line else ""
    _refuse(file.path, [
        (not values, f"no column {VALUE}, {has}; {titles}name the channel by --channel and --unit"),
        (not has_times and hints.rate is None,
         f"no column {TIME}, {has}; name the times by --time and --time-unit, or give --rate"),
        (has_times and hints.rate is not None, "says its times: leave --rate out"),
        (not math.isfinite(hints.tacho_deg) or (hints.is_steady and hints.tacho_deg),
         "--tacho-deg is a finite angle of a tacho: leave it out with --rpm"),
        (tachos and hints.is_steady, "has a tacho column: leave --rpm and --tdc out"),
        (not tachos and not hints.is_steady, f"has no column {TACHO}: add it, or give --rpm and "
         "--tdc for a steady speed, or name one by --tacho"),
        *((len(numbers) > 1, f"{len(numbers)} channels are {kind}, "
           f"{', '.join(file.channels[n].name for n in numbers)}; choose one by --{OPTIONS[kind]}")
          for kind, numbers in found.items()),
    ])  # fmt: skip
    chosen = {kind: numbers[0] for kind, numbers in found.items() if numbers}
    for kind, option, units in (("acceleration", "unit", UNITS), ("time", "time_unit", TIME_UNITS)):
        if kind in chosen:
            channel = file.channels[chosen[kind]]
            unit = getattr(hints, option) or channel.unit
            says = f"the unit {unit!r}" if unit else "no unit"
            remedy = f"give --{option.replace('_', '-')}, one of {', '.join(units)}"
            text = f"channel {channel.name} has {says} of {kind}: {remedy}"
            _refuse(file.path, [(not unit_name(unit, units), text)])
    _refuse(file.path, [
        (file.is_integer and hints.full_scale is None,
         "has whole numbers: give --full-scale, the acceleration of the greatest, in --unit"),
        (not file.is_integer and hints.full_scale is not None,
         "has the values themselves: leave --full-scale out"),
    ])  # fmt: skip
    return chosen


def _check_samples(file: RecordFile, columns: dict[int, np.ndarray]) -> None:
    """Raise RecordError where channels are not finite, or not of one length and clock."""
    sizes = {file.channels[n].name: column.size for n, column in columns.items()}
    for number, column in columns.items():
        for at in np.flatnonzero(~np.isfinite(column)):
            raise RecordError(
                f"{file.place(number, int(at))}: {column[at]} is not finite; cut the record"
            )
    clocks = np.array([file.clocks[n] for n in columns]) if file.clocks else np.zeros((1, 2))
    _refuse(file.path, [
        (len({*sizes.values()}) > 1, "channels of different length: "
         f"{', '.join(f'{name} {size}' for name, size in sizes.items())}; cut the longer one"),
        (min(sizes.values()) < 2, f"{min(sizes.values())} samples are no record"),
        (np.abs(clocks - clocks[0]).max() > SAME_STEP * clocks[0, 1],
         f"channels begin at different times or steps, {clocks.tolist()} s: write them alike"),
    ])  # fmt: skip


def _find_times(
    file: RecordFile, hints: RecordHints, chosen: dict[str, int], columns: dict[int, np.ndarray]
) -> tuple[float, np.ndarray, np.ndarray | None]:
    """Return the first sample's time (s), equal steps from it on (s, (m,)), and uneven times.

    Equal steps are the file's, the chosen rate's, or the times' where these were only rounded;
    otherwise the file's own times from the first one on come with them, else None.
    """
    size = len(columns[chosen["acceleration"]])
    if "time" not in chosen:
        start, step = file.clocks[0] if file.clocks else (0.0, 1.0 / (hints.rate or math.nan))
        remedy = "has no time step above 0: give --rate above 0"
        _refuse(file.path, [(not (math.isfinite(step) and step > 0.0), remedy)])
        return start, step * np.arange(size), None
    clock = chosen["time"]
    name, unit = file.channels[clock].name, hints.time_unit or file.channels[clock].unit
    written, second = columns[clock], TIME_UNITS[unit_name(unit, TIME_UNITS)]
    times = (written - written[0]) * second  # steps of large times would lose digits
    step, steps = times[-1] / (size - 1), np.diff(times)
    for at in np.flatnonzero(~(np.abs(steps - step) <= UNEVEN * abs(step)) | (steps <= 0.0)):
        text = f"a step of {steps[at]:g} s, where the mean one is {step:g} s"
        remedy = "resample to equal steps, or write times with more digits"
        raise RecordError(f"{file.place(clock, int(at) + 1)}: {text}; {remedy}")
    grain = np.ptp(steps)  # times that were rounded stay this near to equal ones
    text = f"{name} has {1.0 / step:.6g} samples a second, and rate_Hz says {file.rate:.6g}"
    other = abs(file.rate * step - 1.0) > SAME_RATE + grain / times[-1]
    _refuse(file.path, [(other, f"{text}: save one of them")])
    even = step * np.arange(size)
    rounding = 4.0 * second * np.spacing(np.abs(written).max())
    is_rounded = np.abs(times - even).max() <= grain + rounding
    return float(written[0]) * second, even, None if is_rounded else times


def _steady_pulses(hints: RecordHints, start: float, length: float) -> np.ndarray:
    """Return the times of top dead centre in a record at a steady speed, s, from its begin.

    start: the first sample's time, by which `tdc` counts; length: of the record.
    """
    rpm, tdc = (math.nan if one is None else one for one in (hints.rpm, hints.tdc))
    if not (math.isfinite(rpm) and rpm > 0.0 and math.isfinite(tdc)):
        text = f"a speed of {rpm:g} rpm with top dead centre at {tdc:g} s"
        raise RecordError(f"{text}: give a finite speed above 0, and a finite time")
    turn = 60.0 / rpm
    first, last = math.ceil((start - tdc) / turn), math.floor((start - tdc + length) / turn)
    return tdc - start + turn * np.arange(first, last + 1)


def _find_pulses(what: str, times: np.ndarray, tacho: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the times at which a tacho rises through its middle, and their uncertainty, s.

    A rise comes from low and goes high, or goes high from the first sample on. Its middle is that
    of the sine which fits all its samples best. A level that jumps between two samples jumps
    anywhere between them; one that rises slowly is known better, and one that rises by steps of
    several samples, as a coarse converter has it, to half of a step.
    """
    low, high = tacho.min(), tacho.max()
    _refuse(what, [(low == high, f"is {low:g} all the time; it must rise once a turn")])
    share = (tacho - low) / (high - low)
    certain = np.flatnonzero((share < LOW) | (share > HIGH) | (np.arange(share.size) == 0))
    is_high = share[certain] > HIGH
    rises = np.flatnonzero(~is_high[:-1] & is_high[1:])
    found, within, step = [], [], times[-1] / (times.size - 1)
    for begin, end in zip(certain[rises], certain[rises + 1], strict=True):
        rise, since = share[begin : end + 1] - MIDDLE, times[begin : end + 1] - times[begin]
        jumps = np.diff(rise)
        longest = np.diff(np.flatnonzero(jumps), prepend=0).max()
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


def _shift(pulses: np.ndarray, degrees: float, times: np.ndarray) -> np.ndarray:
    """Return the times of top dead centre within a record by pulses at a crank angle.

    The speed is even between two pulses; before the first and behind the last it stays.
    """
    if not degrees:
        return pulses
    turns = np.arange(len(pulses) + 1) - (degrees / 360.0) % 1.0
    found = make_interp_spline(np.arange(len(pulses)), pulses, k=1)(turns)
    # a record may begin at top dead centre
    return found[(found >= -0.5 * times[1]) & (found <= times[-1])]


def check_record(times: np.ndarray, values: np.ndarray, tacho: np.ndarray) -> int:
    """Return the whole revolutions of a record. Raises RecordError if it cannot be used."""
    step = (times[-1] - times[0]) / max(len(times) - 1, 1)
    _refuse("a record", [
        (len(tacho) <= MIN_REVOLUTIONS, f"{len(tacho)} tacho pulses are too few: at least "
         f"{MIN_REVOLUTIONS + 1}, for whole revolutions"),
        (len(times) != len(values),
         f"{len(times)} times and {len(values)} values: pass one for each"),
        (not (np.diff(tacho) > 0.0).all(),
         "the tacho pulses do not increase: sort them, and drop double ones"),
        (not ((tacho > times[0] - step) & (tacho < times[-1] + step)).all(), "tacho pulses lie "
         f"beyond the samples, {times[0]:g} to {times[-1]:g} s: pass those within"),
        (not np.isfinite(values).all(),
         "the record's values are not all numbers: fill or cut the gaps"),
    ])  # fmt: skip
    return len(tacho) - 1


def turns_at(times: np.ndarray, tacho: np.ndarray) -> np.ndarray:
    """Return the revolutions since the first pulse at each time.

    Beyond the pulses the nearest revolution's pace counts.
    """
    turns = np.interp(times, tacho, np.arange(len(tacho)))
    turns += np.minimum(times - tacho[0], 0.0) / (tacho[1] - tacho[0])
    return turns + np.maximum(times - tacho[-1], 0.0) / (tacho[-1] - tacho[-2])

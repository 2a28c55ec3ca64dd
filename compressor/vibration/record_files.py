"""Files of an accelerometer's record: CSV, WAV and MATLAB's MAT.

A file's ending names its format: `READERS` is the table. What a file says of its
channels is read; what it does not say, such as the unit of a WAV file, is never guessed.
"""

import math
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from compressor.cases import open_text_table
from compressor.program import CompsimError, did_you_mean
from compressor.vibration.accelerometer import Record
from compressor.vibration.spectra import RecordError
from compressor.vibration.tacho import (
    MIN_REVOLUTIONS,
    find_pulses,
    refuse,
    shift_pulses,
    smooth_pulses,
    steady_pulses,
)

TIME, VALUE, TACHO = RECORD_HEADER = ("time_s", "acceleration_m_per_s2", "tacho")
HEADER = ",".join(RECORD_HEADER)
RATE = "rate_Hz"  # in a MAT file, in place of times
UNITS = {  # in m/s2; g is the standard acceleration (SI brochure), the inch and foot are exact
    "m/s2": 1.0, "mm/s2": 1e-3, "g": 9.80665, "in/s2": 0.0254, "ft/s2": 0.3048,
}  # fmt: skip
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}  # in s
SPELLINGS = (("_per_", "/"), ("²", "2"), ("^", ""), ("**", ""), ("seconds", "s"), ("sec", "s"),
             ("µ", "u"), ("μ", "u"), (" ", ""))  # fmt: skip
OURS = re.compile(r"acceleration_\w+|time_s|tacho")  # a name in our files
TITLE = re.compile(  # and its unit
    r"(.*?)\s*[\[(]([^\])]*)[\])]\s*|(time(?=_(?:m?s|us)$)|acceleration)_(\w+)", re.IGNORECASE
)
TITLES = {
    **dict.fromkeys(("time", "t", "zeit"), "time"),
    **dict.fromkeys(("tacho", "tach", "keyphasor", "keyphaser"), "tacho"),
    **dict.fromkeys(("acceleration", "acc", "accel"), "acceleration"),
}  # fmt: skip
UNEVEN = 0.1  # of a time step, by which a step may differ from the mean one
PLAIN = "separator comma, decimal point, header in line 1,"  # as our own files are
OPTIONS = {"time": "time", "acceleration": "channel", "tacho": "tacho"}  # that name a channel
SCALES = (("acceleration", "unit", UNITS), ("time", "time_unit", TIME_UNITS))


class Channel(NamedTuple):
    """A signal of a file, with what the file says of it."""

    name: str
    kind: str = ""  # time, acceleration or tacho
    unit: str = ""  # as it is written


@dataclass(frozen=True)
class RecordFile:
    """What a file has."""

    path: Path
    channels: Sequence[Channel]
    read: Callable[[Sequence[int]], list[np.ndarray]]  # samples of channels by numbers from 0
    clock: tuple[float, float] | None = None  # first time and step, s, but where a channel has it
    is_integer: bool = False  # whether samples are shares of a full scale
    layout: str = ""  # how a text was read
    unused: Sequence[str] = ()  # what else the file has, and why it is no signal

    @property
    def content(self) -> str:
        """Return what the file has, for an error that something is missing."""
        found = ", ".join(one.name for one in self.channels)
        found = f"only {found}" if found else "no signals"
        left = f"; no signals are {'; '.join(self.unused)}" if self.unused else ""
        return f"{found}{left}" + (f" ({self.layout})" if self.layout else "")


def unit_name(text: str, units: dict[str, float] = UNITS) -> str:
    """Return the name in a table of a unit as it is written; "" of an unknown one."""
    found = text.strip().strip("()[]").lower()
    for other, ours in SPELLINGS:
        found = found.replace(other, ours)
    return found if found in units else ""


def named_channel(name: str) -> Channel:
    """Return a channel by its name, such as `time_s`, `Time [ms]`, `Acc (g)`, `Keyphasor`."""
    found = TITLE.fullmatch(name)
    word, unit = (found[1] or found[3] or "", found[2] or found[4] or "") if found else (name, "")
    kind = TITLES.get(word.strip().lower(), "acceleration" if unit_name(unit) else "")
    return Channel(name, kind, unit)


def open_record_file(path: Path) -> RecordFile:
    """Return what the file of a record has. Raises RecordError where it cannot be read."""
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(filter(None, READERS))
        raise RecordError(f"{path}: no records of the type {path.suffix} are read, only {known}")
    try:
        path.open("rb").close()
        return reader(path)
    except OSError as error:
        remedy = f"give a CSV file with the columns {HEADER}, or a job's key"
        raise RecordError(f"{path}: cannot be read: {error.strerror or error}; {remedy}") from error
    except CompsimError:
        raise
    except Exception as error:  # of many kinds, where a file is cut or of something else
        text = f"{path}: is no {path.suffix[1:].upper()} file that can be read: {error}"
        raise RecordError(f"{text}; write it again, whole, or as CSV") from error


def _open_csv(path: Path) -> RecordFile:
    """Return what a text has: columns by their titles, or by numbers from 1 without a header."""
    table = open_text_table(path)
    pairs = list(zip(table.names, table.numeric, strict=True))
    return RecordFile(
        path, [named_channel(name) if is_number else Channel(name) for name, is_number in pairs],
        lambda numbers: [*map(np.array, table.read_columns(numbers)[1])], layout=table.layout,
        unused=[f"{name} (no numbers)" for name, is_number in pairs if not is_number],
    )  # fmt: skip


def _open_wav(path: Path) -> RecordFile:
    """Return what a WAV file has: channels by number, integers as shares of the full scale."""
    from scipy.io import wavfile

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Chunk", wavfile.WavFileWarning)
        warnings.filterwarnings("error", "Reached EOF", wavfile.WavFileWarning)  # it is cut
        rate, values = wavfile.read(path)
    columns, is_integer = np.atleast_2d(values.T), values.dtype.kind != "f"
    if not rate or not values.size:
        raise ValueError(f"it has {columns.shape[1]} samples, {rate} a second")
    full = 2.0 ** (8 * values.itemsize - 1) if is_integer else 1.0
    zero = 128.0 if values.dtype == np.uint8 else 0.0  # the one format without a sign
    # of several channels nothing says which is the accelerometer
    only = "acceleration" if len(columns) == 1 else ""
    return RecordFile(
        path, [Channel(str(number), only) for number in range(1, len(columns) + 1)],
        lambda numbers: [(columns[at] - zero) / full for at in numbers], (0.0, 1.0 / rate),
        is_integer,
    )  # fmt: skip


def _open_mat(path: Path) -> RecordFile:
    """Return what a MAT file has: its arrays of real numbers, a matrix by columns."""
    from scipy.io import loadmat

    found: dict[str, np.ndarray] = {}
    unused, rate = [], 0.0
    for name, array in loadmat(path).items():  # of version 7.3 it says that it cannot
        if name.startswith("__"):
            continue
        if array.dtype.kind not in "fiub" or array.ndim != 2:
            what = "struct" if array.dtype.names else array.dtype
            unused.append(f"{name} ({what} of shape {array.shape}: save real vectors or matrices)")
        elif array.size < 2:
            rate = float(array.sum()) if name == RATE else rate
        elif 1 in array.shape:
            found[name] = array.ravel().astype(float)
        else:
            found |= {f"{name}(:,{k})": one.astype(float) for k, one in enumerate(array.T, 1)}
    arrays, channels = [*found.values()], [*map(named_channel, found)]
    has_rate = rate and not any(one.kind == "time" for one in channels)
    clock = (0.0, 1.0 / rate) if has_rate else None
    return RecordFile(
        path, channels, lambda numbers: [arrays[at] for at in numbers], clock, unused=unused
    )


READERS: dict[str, Callable[..., RecordFile]] = {
    "": _open_csv, ".csv": _open_csv, ".txt": _open_csv, ".wav": _open_wav, ".mat": _open_mat,
}  # fmt: skip


@dataclass(frozen=True)
class RecordHints:
    """What a file does not say of its record, or says wrong."""

    channel: str = ""  # of the acceleration: a name, or a number from 1
    tacho: str = ""
    time: str = ""
    unit: str = ""  # one of `UNITS`, in place of what the file says
    time_unit: str = ""  # one of `TIME_UNITS`
    rate: float | None = None  # Hz, of a file without times
    full_scale: float | None = None  # of whole numbers, in the unit
    tacho_deg: float = 0.0  # crank angle at which the tacho rises
    rpm: float | None = None  # a steady speed, with a time (s) of top dead centre: of no tacho
    tdc: float | None = None


def read_record(path: str | Path, **known: Any) -> Record:
    """Return the record of a file whose type is one of `READERS`; known: of `RecordHints`.

    The tacho is any voltage that rises once a revolution, at top dead centre or at a known angle,
    through the middle of its range: a sine, a square or a short pulse. Without that channel, and
    only then, `rpm` and `tdc` give it. Channels that are not chosen are ignored, and so are lines
    at the end of a CSV file in which the others are empty. `clipped` is nan: it is not known.

    Raises RecordError, or TextTableError, with file, channel and line or sample: for a missing
    channel, an unknown unit, what is no finite number, unequal steps, few or irregular pulses.
    """
    path, hints = Path(path), RecordHints(**known)
    file = open_record_file(path)
    chosen, scales = _choose_channels(file, hints)
    names = {kind: file.channels[number].name for kind, number in chosen.items()}
    columns = dict(zip(chosen, file.read([*chosen.values()]), strict=True))
    _check_samples(path, names, columns)
    remarks = []
    if file.layout and not file.layout.startswith(PLAIN):
        named = ", ".join(f"{kind} {name}" for kind, name in names.items())
        remarks.append(f"{path}: {file.layout}; {named}")
    for kind, option, units in SCALES:
        written = file.channels[chosen[kind]].unit if kind in chosen else ""
        if unit_name(written, units) and units[unit_name(written, units)] != scales[kind]:
            taken = f"--{option.replace('_', '-')} {getattr(hints, option)}"
            remarks.append(f"{names[kind]}: the file says {written}, taken as {taken} says")
    values = columns["acceleration"] * scales["acceleration"] * (hints.full_scale or 1.0)
    if "time" in chosen:
        start = columns["time"][0] * scales["time"]
        stamps = _find_times(f"{path}: {names['time']}", columns["time"], scales["time"])
    else:
        start, step = file.clock or (0.0, 1.0 / (hints.rate or math.nan))
        has_step = math.isfinite(step) and step > 0.0
        refuse(path, [(not has_step, "has no time step above 0: save it with one, or give --rate")])
        stamps = step * np.arange(values.size)
    times = stamps[-1] / (values.size - 1) * np.arange(values.size)
    if (off := np.abs(stamps - times).max()) > 1e-6 * times[1]:
        values = CubicSpline(stamps, values)(times)
        text = f"{names['time']}: times up to {off / times[1]:.2g} steps off equal ones"
        remarks.append(f"{text}: samples are put on equal steps by their own times")
    if "tacho" in chosen:
        pulses, within = find_pulses(f"{path}: {names['tacho']}", stamps, columns["tacho"])
        if len(pulses) > MIN_REVOLUTIONS:
            pulses = shift_pulses(smooth_pulses(pulses, within), hints.tacho_deg, times)
            pulses = np.maximum(pulses, -0.99 * times[1])  # at the record's begin, to a sample
        if not hints.tacho_deg and names["tacho"].lower() != TACHO:
            text = "its rise counts as top dead centre; --tacho-deg says its angle"
            remarks.append(f"{names['tacho']}: {text}")
    else:
        pulses = steady_pulses(hints.rpm, hints.tdc, start, times[-1])
    found = f"{len(pulses)} passes of top dead centre in {times[-1]:g} s"
    few = f"{found}: at least {MIN_REVOLUTIONS + 1}; record for longer"
    refuse(path, [(len(pulses) <= MIN_REVOLUTIONS, few)])
    return Record(times, values, pulses, math.nan, remarks=tuple(remarks))


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


def _choose_channels(
    file: RecordFile, hints: RecordHints
) -> tuple[dict[str, int], dict[str, float]]:
    """Return the channels by kind, chosen or the only ones that say so, and their units in SI.

    Without times where steps are known, and without a tacho at a steady speed. Raises RecordError
    for a channel that is missing, not the only one, or of no known unit.
    """
    found, scales = {}, {}
    for kind, option in OPTIONS.items():
        numbers = [n for n, one in enumerate(file.channels) if one.kind == kind]
        ours = [n for n in numbers if OURS.fullmatch(file.channels[n].name)]  # before other titles
        word = getattr(hints, option)
        found[kind] = [_pick(file, word, option)] if word else ours or numbers
    times, values, tachos = found.values()
    is_steady = hints.rpm is not None or hints.tdc is not None
    has_times, has = bool(times or file.clock), file.content
    titles = f"write {HEADER} as titles of columns, or " if file.layout else ""
    many = [(kind, [file.channels[n].name for n in numbers]) for kind, numbers in found.items()]
    refuse(file.path, [
        (not values, f"no column {VALUE}, {has}; {titles}name the channel by --channel and --unit"),
        (not has_times and hints.rate is None,
         f"no column {TIME}, {has}; name the times by --time and --time-unit, or give --rate"),
        (has_times and hints.rate is not None, "says its times: leave --rate out"),
        (not math.isfinite(hints.tacho_deg) or (is_steady and hints.tacho_deg),
         "--tacho-deg is a finite angle of a tacho: leave it out with --rpm"),
        (tachos and is_steady, "has a tacho column: leave --rpm and --tdc out"),
        (not tachos and not is_steady, f"has no column {TACHO}: add it, or give --rpm and "
         "--tdc for a steady speed, or name one by --tacho"),
        *((len(names) > 1, f"{len(names)} channels are {kind}, {', '.join(names)}; "
           f"choose one by --{OPTIONS[kind]}") for kind, names in many),
        (file.is_integer and hints.full_scale is None,
         "has whole numbers: give --full-scale, the acceleration of the greatest, in --unit"),
        (not file.is_integer and hints.full_scale is not None,
         "has the values themselves: leave --full-scale out"),
    ])  # fmt: skip
    chosen = {kind: numbers[0] for kind, numbers in found.items() if numbers}
    for kind, option, units in SCALES:
        if kind in chosen:
            channel = file.channels[chosen[kind]]
            unit = getattr(hints, option) or channel.unit
            says = f"the unit {unit!r}" if unit else "no unit"
            remedy = f"give --{option.replace('_', '-')}, one of {', '.join(units)}"
            text = f"channel {channel.name} has {says} of {kind}: {remedy}"
            refuse(file.path, [(not unit_name(unit, units), text)])
            scales[kind] = units[unit_name(unit, units)]
    return chosen, scales


def _check_samples(path: Path, names: dict[str, str], columns: dict[str, np.ndarray]) -> None:
    """Raise RecordError where channels are not finite, or not of one length."""
    sizes = {names[kind]: column.size for kind, column in columns.items()}
    bad = [(names[kind], one, int(np.argmin(np.isfinite(one)))) for kind, one in columns.items()]
    refuse(path, [
        (len({*sizes.values()}) > 1, "channels of different length: "
         f"{', '.join(f'{name} {size}' for name, size in sizes.items())}; cut the longer one"),
        (min(sizes.values()) < 2, f"{min(sizes.values())} samples are no record"),
        *((not np.isfinite(one[at]), f"{name}: sample {at + 1} is {one[at]}, not finite; cut the "
           "record") for name, one, at in bad),
    ])  # fmt: skip


def _find_times(what: str, written: np.ndarray, unit: float) -> np.ndarray:
    """Return times from the first one on, s: on equal steps where they were only rounded.

    unit: of the times, s. Raises RecordError for steps that differ by more than `UNEVEN`.
    """
    times = (written - written[0]) * unit  # steps of large times would lose digits
    even, steps = np.linspace(0.0, times[-1], times.size), np.diff(times)
    bad = np.flatnonzero(~(np.abs(steps - even[1]) <= UNEVEN * abs(even[1])) | (steps <= 0.0))
    for at in bad:
        text = f"sample {at + 2}: a step of {steps[at]:g} s, where the mean one is {even[1]:g} s"
        raise RecordError(f"{what}: {text}; resample it, or write times with more digits")
    # times that were rounded stay as near to equal ones as their steps to each other
    rounding = np.ptp(steps) + 4.0 * unit * np.spacing(np.abs(written).max())
    return even if np.abs(times - even).max() <= rounding else times


Columns = dict[str, np.ndarray]  # by `RECORD_HEADER`; the tacho may be missing


def record_columns(times: np.ndarray, values: np.ndarray, pulses: np.ndarray) -> Columns:
    """Return a record (s, m/s2, s) as the columns of `RECORD_HEADER`.

    The tacho is a sine of the crank angle that rises through 0 at top dead centre; it stays low
    before the first pulse and high after the last. Of fewer than two pulses there is none.
    """
    found = [times, values]
    if len(pulses) > 1:
        quarter = np.diff(pulses)[[0, -1]] / 4.0
        known = [pulses[0] - quarter[0], *pulses, pulses[-1] + quarter[1]]
        turns = np.interp(times, known, [-0.25, *range(len(pulses)), len(pulses) - 0.75])
        found.append(np.sin(2.0 * np.pi * turns))
    return dict(zip(RECORD_HEADER, found, strict=False))

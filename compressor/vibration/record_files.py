"""Files of an accelerometer's record: CSV, WAV, MATLAB's MAT and universal file format 58.

A file's ending names its format: `READERS` and `ENCODERS` are the tables. What a file says of its
channels is read; what it does not say, such as the unit of a WAV file, is never guessed.
UFF needs pyuff, which `pip install 'compsim[records]'` brings.
"""

import contextlib
import csv
import io
import math
import re
import tempfile
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compressor.program import PROGRAM, CompsimError

TIME, VALUE, TACHO = RECORD_HEADER = ("time_s", "acceleration_m_per_s2", "tacho")
HEADER = ",".join(RECORD_HEADER)
RATE = "rate_Hz"  # in a MAT file, in place of times
UNITS = {  # in m/s2; g is the standard acceleration (SI brochure), the inch and foot are exact
    "m/s2": 1.0, "mm/s2": 1e-3, "g": 9.80665, "in/s2": 0.0254, "ft/s2": 0.3048,
}  # fmt: skip
SPELLINGS = (("_per_", "/"), ("²", "2"), ("^", ""), ("**", ""), ("sec", "s"), (" ", ""))
ACCELERATION = re.compile(r"acceleration_(\w+)")  # a column's name, with its unit
TIME_RESPONSE, IS_ACCELERATION, IS_TIME = 1, 12, 17  # numbers of the universal file format 58
NO_UFF = "pyuff is not installed; get it by pip install 'compsim[records]'"


class RecordError(CompsimError):
    """A record that cannot be read or used: too short, without tacho, not finite."""

    exit_code = 2


@dataclass(frozen=True)
class Channel:
    """A signal of a file: kind is time, acceleration, tacho, or "" where the file does not say.

    unit: as the file writes it, "" where it does not.
    """

    name: str
    kind: str = ""
    unit: str = ""


@dataclass(frozen=True)
class RecordFile:
    """What a file has.

    read: returns the samples of channels by their numbers, from 0, (m,) each; clocks: first time
    and step (s) of each channel, () where the file has times as a channel, or none; first_line: of
    the samples in a file of text, else 0; is_integer: whether samples are shares of a full scale.
    """

    path: Path
    channels: tuple[Channel, ...]
    read: Callable[[Sequence[int]], list[np.ndarray]]
    clocks: tuple[tuple[float, float], ...] = ()
    first_line: int = 0
    is_integer: bool = False

    def place(self, number: int, sample: int) -> str:
        """Return where a sample of a channel stands, for an error; both from 0."""
        if self.first_line:
            return f"{self.path}:{self.first_line + sample}: {self.channels[number].name}"
        return f"{self.path}: {self.channels[number].name}: sample {sample + 1}"


def unit_name(text: str) -> str:
    """Return the name in `UNITS` of a unit as it is written; "" of an unknown one."""
    found = text.strip().strip("()[]").lower()
    for other, ours in SPELLINGS:
        found = found.replace(other, ours)
    return found if found in UNITS else ""


def named_channel(name: str) -> Channel:
    """Return a channel whose name alone says what it is, as in CSV and MAT files."""
    if found := ACCELERATION.fullmatch(name):
        return Channel(name, "acceleration", found[1])
    return Channel(name, {TIME: "time", TACHO: "tacho"}.get(name, ""))


def open_record_file(path: Path) -> RecordFile:
    """Return what the file of a record has. Raises RecordError where it cannot be read."""
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(dict.fromkeys(filter(None, READERS)))
        raise RecordError(f"{path}: no records of the type {path.suffix} are read, only {known}")
    try:
        with path.open("rb"):
            pass
        return reader(path)
    except OSError as error:
        remedy = f"give a CSV file with the columns {HEADER}, or a job's key"
        raise RecordError(f"{path}: cannot be read: {error.strerror or error}; {remedy}") from error


@contextlib.contextmanager
def naming_no_csv(path: Path) -> Any:
    """Raise RecordError where the text of a file is no CSV."""
    try:
        yield
    except (UnicodeDecodeError, csv.Error) as error:
        raise RecordError(f"{path}: is no CSV file in UTF-8: {error}") from error


def _open_csv(path: Path) -> RecordFile:
    with naming_no_csv(path), path.open(encoding="utf-8-sig", newline="") as file:
        names = [name.strip() for name in next(csv.reader(file), [])]
    channels = tuple(map(named_channel, names))
    return RecordFile(path, channels, lambda numbers: _csv_columns(path, names, numbers), (), 2)


def _csv_columns(path: Path, names: list[str], numbers: Sequence[int]) -> list[np.ndarray]:
    """Return columns of a CSV file by their numbers; lines at the end may lack them."""
    found: dict[int, list[float]] = {number: [] for number in numbers}
    with naming_no_csv(path), path.open(encoding="utf-8-sig", newline="") as file:
        lines = csv.reader(file)
        next(lines, None)
        blank = 0  # the first line without these cells: beyond the end of the record
        for cells in lines:
            texts = {at: "".join(cells[at : at + 1]) for at in found}
            if not "".join(texts.values()).strip():
                blank = blank or lines.line_num
                continue
            if blank:
                problem = "the cells are empty, and the record goes on below"
                raise RecordError(f"{path}:{blank}: {problem}; cut it, or fill the gap")
            for at, text in texts.items():
                found[at].append(_number(text, f"{path}:{lines.line_num}:{at + 1}: {names[at]}"))
    return [np.array(found[number]) for number in numbers]


def _number(text: str, where: str) -> float:
    """Return a cell as a finite number. Raises RecordError."""
    try:
        value = float(text)
    except ValueError:
        remedy = "write numbers with a decimal point, and leave no cell empty"
        raise RecordError(f"{where}: {text!r} is no number; {remedy}") from None
    if not math.isfinite(value):
        raise RecordError(f"{where}: {text!r} is not finite; cut the record, or fill the gap")
    return value


def _open_wav(path: Path) -> RecordFile:
    """Return what a WAV file has: channels by number, integers as shares of the full scale."""
    from scipy.io import wavfile

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", wavfile.WavFileWarning)  # of chunks that SciPy leaves out
        warnings.filterwarnings("error", "Reached EOF", wavfile.WavFileWarning)
        try:
            rate, samples = wavfile.read(path)
        except Exception as error:  # of many kinds, where a file is cut or of something else
            raise RecordError(f"{path}: is no WAV file that can be read: {error}") from error
    columns = samples.reshape(len(samples), -1).T
    is_integer = samples.dtype.kind != "f"
    if samples.dtype == np.uint8:  # the one format without a sign
        columns = (columns - 128.0) / 128.0
    elif is_integer:
        columns = columns / -float(np.iinfo(samples.dtype).min)
    # of several channels nothing says which is the accelerometer
    only = "acceleration" if len(columns) == 1 else ""
    channels = tuple(Channel(str(number), only) for number in range(1, len(columns) + 1))
    clocks = ((0.0, 1.0 / rate),) * len(channels)
    return RecordFile(
        path, channels, lambda numbers: [columns[at].astype(float) for at in numbers], clocks,
        is_integer=is_integer,
    )  # fmt: skip


def _open_mat(path: Path) -> RecordFile:
    """Return what a MAT file has: its arrays of real numbers, a matrix by columns."""
    from scipy.io import loadmat

    try:
        whole = loadmat(path)
    except NotImplementedError as error:
        raise RecordError(f"{path}: is a MAT file of version 7.3: save it with -v7") from error
    except Exception as error:  # of many kinds, where a file is cut or of something else
        raise RecordError(f"{path}: is no MAT file that can be read: {error}") from error
    found: dict[str, np.ndarray] = {}
    step = math.nan
    for name, array in whole.items():
        if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiub" or array.ndim != 2:
            continue
        if name == RATE and array.size == 1 and float(array.item()) > 0.0:
            step = 1.0 / float(array.item())
        elif 1 in array.shape and array.size > 1:
            found[name] = array.ravel().astype(float)
        elif array.size > 1:
            found |= {
                f"{name}(:,{k + 1})": column.astype(float) for k, column in enumerate(array.T)
            }
    arrays = list(found.values())
    clocks = () if math.isnan(step) else ((0.0, step),) * len(arrays)
    channels = tuple(map(named_channel, found))
    return RecordFile(path, channels, lambda numbers: [arrays[at] for at in numbers], clocks)


def _open_uff(path: Path) -> RecordFile:
    """Return what a universal file has: its time responses (data sets 58) with even steps."""
    try:
        import pyuff
    except ImportError as error:
        raise RecordError(f"{path}: {NO_UFF}") from error
    try:
        file = pyuff.UFF(str(path))
        numbers = [n for n, kind in enumerate(file.get_set_types()) if kind == 58]
        sets = [file.read_sets(number) for number in numbers]
    except Exception as error:  # pyuff raises no other
        raise RecordError(f"{path}: is no universal file that can be read: {error}") from error
    sets = [one for one in sets if one["func_type"] == TIME_RESPONSE and one["abscissa_spacing"]]
    channels = tuple(_uff_channel(one, number) for number, one in enumerate(sets, 1))
    clocks = tuple((float(one["abscissa_min"]), float(one["abscissa_inc"])) for one in sets)

    def read(numbers: Sequence[int]) -> list[np.ndarray]:
        return [np.asarray(sets[at]["data"], float) for at in numbers]

    return RecordFile(path, channels, read, clocks)


def _uff_channel(one: dict[str, Any], number: int) -> Channel:
    """Return what a time response says of itself; `NONE` is the format's word for nothing."""
    name, unit = (
        "" if text.strip() == "NONE" else text.strip()
        for text in (str(one["id1"]), str(one["ordinate_axis_units_lab"]))
    )
    is_acceleration = one["ordinate_spec_data_type"] == IS_ACCELERATION
    kind = "acceleration" if is_acceleration else "tacho" if name.lower() == TACHO else ""
    return Channel(name or str(number), kind, unit)


READERS: dict[str, Callable[[Path], RecordFile]] = {
    "": _open_csv, ".csv": _open_csv, ".txt": _open_csv, ".wav": _open_wav, ".mat": _open_mat,
    ".uff": _open_uff, ".unv": _open_uff,
}  # fmt: skip

Columns = dict[str, np.ndarray]  # by `RECORD_HEADER`; the tacho may be missing


def record_columns(times: np.ndarray, values: np.ndarray, pulses: np.ndarray) -> Columns:
    """Return a record (s, m/s2, s) as the columns of `RECORD_HEADER`.

    The tacho is a sine of the crank angle that rises through 0 at top dead centre, so that a reader
    finds the pulses between the samples; it stays low before the first pulse and high after the
    last. With fewer than two pulses there is no such column.
    """
    found = [times, values]
    if len(pulses) > 1:
        quarter = np.diff(pulses)[[0, -1]] / 4.0
        known = [pulses[0] - quarter[0], *pulses, pulses[-1] + quarter[1]]
        turns = np.interp(times, known, [-0.25, *range(len(pulses)), len(pulses) - 0.75])
        found.append(np.sin(2.0 * np.pi * turns))
    return dict(zip(RECORD_HEADER, found, strict=False))


def encode_record(columns: Columns, suffix: str) -> bytes:
    """Return a record as a file of a type of `ENCODERS`: m/s2, with a tacho where there is one.

    Raises RecordError where the type cannot hold it.
    """
    return ENCODERS[suffix](columns)


def _encode_wav(columns: Columns) -> bytes:
    """Return 32-bit floats, 1.0 being 1 m/s2, so that no full scale has to be known."""
    from scipy.io import wavfile

    rate = 1.0 / _step(columns)
    if abs(rate - round(rate)) > 1e-6 * rate:
        text = f"a WAV file has a whole number of samples a second, and the record {rate:.9g}"
        raise RecordError(f"{text}: choose .mat or .csv")
    signals = [values for name, values in columns.items() if name != TIME]
    file = io.BytesIO()
    wavfile.write(file, round(rate), np.stack(signals, axis=1).astype(np.float32))
    return file.getvalue()


def _encode_mat(columns: Columns) -> bytes:
    """Return the columns as double variables of a MAT file of version 5, with the rate."""
    from scipy.io import savemat

    file = io.BytesIO()
    savemat(file, {**columns, RATE: 1.0 / _step(columns)}, oned_as="column")
    head = f"MATLAB 5.0 MAT-file, written by {PROGRAM}".encode().ljust(116)  # no date: same bytes
    return head[:116] + file.getvalue()[116:]


def _encode_uff(columns: Columns) -> bytes:
    """Return a data set 58 a signal, as text.

    The format gives samples 12 digits and the time step 6.
    """
    try:
        import pyuff
    except ImportError as error:
        raise RecordError(NO_UFF) from error
    names = {VALUE: ("acceleration", IS_ACCELERATION, "m/s2"), TACHO: (TACHO, 0, "NONE")}
    sets = []
    for name, (title, kind, unit) in names.items():
        if name in columns:
            sets.append(pyuff.prepare_58(
                binary=0, func_type=TIME_RESPONSE, id1=title, id2=PROGRAM, rsp_node=1, rsp_dir=0,
                ref_node=0, ref_dir=0, abscissa_spacing=1, abscissa_spec_data_type=IS_TIME,
                abscissa_axis_units_lab="s", ordinate_spec_data_type=kind,
                ordinate_axis_units_lab=unit, orddenom_spec_data_type=0,
                data=columns[name], x=columns[TIME],
            ))  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:  # pyuff writes to a path alone
        path = Path(folder) / "record.uff"
        pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")
        return path.read_bytes()


def _step(columns: Columns) -> float:
    times = columns[TIME]
    return float(times[-1] - times[0]) / (len(times) - 1)


ENCODERS: dict[str, Callable[[Columns], bytes]] = {
    ".wav": _encode_wav, ".mat": _encode_mat, ".uff": _encode_uff,
}  # fmt: skip


def channel_names(channels: Iterable[Channel]) -> str:
    """Return the names of channels for an error."""
    return ", ".join(one.name for one in channels) or "nothing"

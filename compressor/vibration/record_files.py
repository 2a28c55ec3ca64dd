"""Files of an accelerometer's record: CSV, WAV, MATLAB's MAT and universal file format 58.

A file's ending names its format: `READERS` and `ENCODERS` are the tables. What a file says of its
channels is read; what it does not say, such as the unit of a WAV file, is never guessed.
UFF needs pyuff, which `pip install 'compsim[records]'` brings.
"""

import io
import math
import re
import tempfile
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compressor.cases import open_text_table
from compressor.program import PROGRAM, CompsimError

TIME, VALUE, TACHO = RECORD_HEADER = ("time_s", "acceleration_m_per_s2", "tacho")
HEADER = ",".join(RECORD_HEADER)
RATE = "rate_Hz"  # in a MAT file, in place of times
UNITS = {  # in m/s2; g is the standard acceleration (SI brochure), the inch and foot are exact
    "m/s2": 1.0, "mm/s2": 1e-3, "g": 9.80665, "in/s2": 0.0254, "ft/s2": 0.3048,
}  # fmt: skip
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}  # in s
SPELLINGS = (("_per_", "/"), ("²", "2"), ("^", ""), ("**", ""), ("seconds", "s"), ("sec", "s"),
             ("µ", "u"), ("μ", "u"), (" ", ""))  # fmt: skip
ACCELERATION = re.compile(r"acceleration_(\w+)")  # a column's name, with its unit
TITLE = re.compile(r"(.*?)\s*[\[(]([^\])]*)[\])]\s*|(time)_(m?s|us)", re.IGNORECASE)  # and its unit
TITLES = {
    "time": "time", "t": "time", "zeit": "time", "tacho": "tacho", "tach": "tacho",
    "keyphasor": "tacho", "keyphaser": "tacho", "acc": "acceleration", "accel": "acceleration",
    "acceleration": "acceleration",
}  # fmt: skip
LAYOUT = "--separator, --decimal and --skip-lines say otherwise"
TIME_RESPONSE, IS_ACCELERATION, IS_TIME = 1, 12, 17  # numbers of the universal file format 58


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
    the samples in a file of text, else 0; is_integer: whether samples are shares of a full scale;
    rate: Hz, which the file says beside its times, nan where it does not; layout: how a text was
    read; unused: what else the file has, and why it is no signal.
    """

    path: Path
    channels: tuple[Channel, ...]
    read: Callable[[Sequence[int]], list[np.ndarray]]
    clocks: tuple[tuple[float, float], ...] = ()
    first_line: int = 0
    is_integer: bool = False
    rate: float = math.nan
    layout: str = ""
    unused: tuple[str, ...] = ()

    @property
    def content(self) -> str:
        """Return what the file has, for an error that something is missing."""
        found = ", ".join(one.name for one in self.channels)
        found = f"only {found}" if found else "no signals"
        left = f"; no signals are {'; '.join(self.unused)}" if self.unused else ""
        return f"{found}{left}" + (f" ({self.layout}; {LAYOUT})" if self.layout else "")

    def place(self, number: int, sample: int) -> str:
        """Return where a sample of a channel stands, for an error; both from 0."""
        if self.first_line:
            return f"{self.path}:{self.first_line + sample}: {self.channels[number].name}"
        return f"{self.path}: {self.channels[number].name}: sample {sample + 1}"


def unit_name(text: str, units: dict[str, float] = UNITS) -> str:
    """Return the name in a table of a unit as it is written; "" of an unknown one."""
    found = text.strip().strip("()[]").lower()
    for other, ours in SPELLINGS:
        found = found.replace(other, ours)
    return found if found in units else ""


def named_channel(name: str) -> Channel:
    """Return a channel whose name alone says what it is: our names, in CSV and MAT files."""
    if found := ACCELERATION.fullmatch(name):
        return Channel(name, "acceleration", found[1])
    return Channel(name, {TIME: "time", TACHO: "tacho"}.get(name, ""), "s" if name == TIME else "")


def titled_channel(name: str) -> Channel:
    """Return a channel by the title of a column, such as `Time [ms]`, `Acc (g)`, `Keyphasor`."""
    ours = named_channel(name)
    if ours.kind:
        return ours
    found = TITLE.fullmatch(name)
    word, unit = (found[1] or found[3] or "", found[2] or found[4] or "") if found else (name, "")
    kind = TITLES.get(word.strip().lower(), "acceleration" if unit_name(unit) else "")
    return Channel(name, kind, unit)


def open_record_file(path: Path, **layout: Any) -> RecordFile:
    """Return what the file of a record has. Raises RecordError where it cannot be read.

    layout: separator, decimal and skip_lines of a file of text, where they are told.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(filter(None, READERS))
        raise RecordError(f"{path}: no records of the type {path.suffix} are read, only {known}")
    if layout and reader is not _open_csv:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in layout)
        raise RecordError(f"{path}: is no file of text: leave {options} out")
    try:
        with path.open("rb"):
            pass
        return reader(path, **layout)
    except OSError as error:
        remedy = f"give a CSV file with the columns {HEADER}, or a job's key"
        raise RecordError(f"{path}: cannot be read: {error.strerror or error}; {remedy}") from error
    except CompsimError:
        raise
    except Exception as error:  # of many kinds, where a file is cut or of something else
        text = f"{path}: is no {path.suffix[1:].upper()} file that can be read: {error}"
        raise RecordError(f"{text}; write it again, whole, or as CSV") from error


def _open_csv(path: Path, **layout: Any) -> RecordFile:
    """Return what a text has: columns by their titles, or by numbers from 1 without a header."""
    try:
        table = open_text_table(path, **layout)
    except CompsimError as error:
        raise RecordError(f"{error} ({LAYOUT})") from error
    ours = {named_channel(name).kind for name in table.names}  # before other titles
    channels, unused = [], []
    for name, is_number in zip(table.names, table.numeric, strict=True):
        one = titled_channel(name) if is_number else Channel(name)
        is_second = one.kind in ours and not named_channel(name).kind
        channels.append(Channel(name, "", one.unit) if is_second else one)
        unused += [] if is_number else [f"{name} (no numbers)"]
    return RecordFile(
        path, tuple(channels), lambda numbers: [*map(np.array, table.read_columns(numbers)[1])],
        first_line=table.rows[0][0], layout=table.layout, unused=tuple(unused),
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
    channels = tuple(Channel(str(number), only) for number in range(1, len(columns) + 1))
    return RecordFile(
        path, channels, lambda numbers: [(columns[at] - zero) / full for at in numbers],
        ((0.0, 1.0 / rate),) * len(channels), is_integer=is_integer,
    )  # fmt: skip


def _open_mat(path: Path) -> RecordFile:
    """Return what a MAT file has: its arrays of real numbers, a matrix by columns."""
    from scipy.io import loadmat

    try:
        whole = loadmat(path)
    except NotImplementedError as error:
        raise RecordError(f"{path}: is a MAT file of version 7.3: save it with -v7") from error
    found: dict[str, np.ndarray] = {}
    unused, rate = [], math.nan
    for name, array in whole.items():
        if name.startswith("__"):
            continue
        if array.dtype.kind not in "fiub" or array.ndim != 2:
            what = "struct" if array.dtype.names else array.dtype
            unused.append(f"{name} ({what} of shape {array.shape}: save real vectors or matrices)")
        elif name == RATE and array.size == 1:
            rate = float(array.item())
            if not (math.isfinite(rate) and rate > 0.0):
                raise RecordError(f"{path}: {RATE} is {rate:g}: save a finite rate above 0")
        elif array.size <= 1:
            unused.append(f"{name} ({array.size} numbers)")
        elif 1 in array.shape:
            found[name] = array.ravel().astype(float)
        else:
            found |= {f"{name}(:,{k})": one.astype(float) for k, one in enumerate(array.T, 1)}
    arrays, channels = list(found.values()), tuple(map(named_channel, found))
    is_clock = not (math.isnan(rate) or any(one.kind == "time" for one in channels))
    return RecordFile(
        path, channels, lambda numbers: [arrays[at] for at in numbers],
        ((0.0, 1.0 / rate),) * len(arrays) if is_clock else (), rate=rate, unused=tuple(unused),
    )  # fmt: skip


END = re.compile(rb"    -1[ \t]*(?=[\r\n]|\Z)")  # of a data set, and its begin
FORTRAN = re.compile(rb"(?<=\d)[dD](?=[+-]\d\d)")  # an exponent of double precision


def _open_uff(path: Path) -> RecordFile:
    """Return what a universal file has: its time responses (data sets 58) with even steps."""
    data = path.read_bytes()
    if len(END.findall(data)) % 2:
        raise ValueError("its last data set has no end, a line with -1 in columns 5 and 6")
    data = END.sub(b"    -1", data)  # pyuff does not see a mark with blanks behind it
    if b"    58b" not in data:
        data = FORTRAN.sub(b"e", data)
    found, unused = [], []
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", np.exceptions.ComplexWarning)
        plain = Path(folder) / "record.uff"
        plain.write_bytes(data)
        file = _pyuff().UFF(str(plain))
        for number, kind in enumerate(file.get_set_types()):
            one = file.read_sets(number) if kind == 58 else {}
            if why := _why_no_response(one) if one else f"type {kind:g}, not 58":
                unused.append(f"data set {number + 1} ({why})")
            else:
                found.append(one)
    return RecordFile(
        path, tuple(_uff_channel(one, number) for number, one in enumerate(found, 1)),
        lambda numbers: [np.asarray(found[at]["data"], float) for at in numbers],
        tuple((float(one["abscissa_min"]), float(one["abscissa_inc"])) for one in found),
        unused=tuple(unused),
    )  # fmt: skip


def _pyuff() -> Any:
    try:
        import pyuff
    except ImportError as error:
        remedy = "get it by pip install 'compsim[records]'"
        raise RecordError(f"pyuff is not installed; {remedy}") from error
    return pyuff


def _why_no_response(one: dict[str, Any]) -> str:
    """Return why a data set 58 is no time response with even steps; "" where it is."""
    samples, kind = len(one["data"]), int(one["func_type"])
    mistakes = {
        f"function type {kind}, not {TIME_RESPONSE}, a time response": kind != TIME_RESPONSE,
        "uneven steps: write it with even ones": not one["abscissa_spacing"],
        "complex numbers, not a real time response": int(one["ord_data_type"]) > 4,
        f"cut: {samples} of {one['num_pts']} samples": samples < one["num_pts"],
    }
    return next((why for why, is_so in mistakes.items() if is_so), "")


def _uff_channel(one: dict[str, Any], number: int) -> Channel:
    """Return what a time response says of itself; `NONE` is the format's word for nothing."""
    texts = (str(one[key]).strip() for key in ("id1", "ordinate_axis_units_lab"))
    name, unit = ("" if text == "NONE" else text for text in texts)
    is_acceleration = one["ordinate_spec_data_type"] == IS_ACCELERATION
    kind = "acceleration" if is_acceleration else "tacho" if name.lower() == TACHO else ""
    return Channel(name or str(number), kind, unit)


READERS: dict[str, Callable[..., RecordFile]] = {
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
    times = columns[TIME]
    return ENCODERS[suffix](columns, (len(times) - 1) / float(times[-1] - times[0]))


def _encode_wav(columns: Columns, rate: float) -> bytes:
    """Return 32-bit floats, 1.0 being 1 m/s2, so that no full scale has to be known."""
    from scipy.io import wavfile

    if abs(rate - round(rate)) > 1e-6 * rate:
        text = f"a WAV file has a whole number of samples a second, and the record {rate:.9g}"
        raise RecordError(f"{text}: choose .mat or .csv")
    signals = [values for name, values in columns.items() if name != TIME]
    file = io.BytesIO()
    wavfile.write(file, round(rate), np.stack(signals, axis=1).astype(np.float32))
    return file.getvalue()


def _encode_mat(columns: Columns, rate: float) -> bytes:
    """Return the columns as double variables of a MAT file of version 5, with the rate."""
    from scipy.io import savemat

    file = io.BytesIO()
    savemat(file, {**columns, RATE: rate}, oned_as="column")
    head = f"MATLAB 5.0 MAT-file, written by {PROGRAM}".encode().ljust(116)  # no date: same bytes
    return head[:116] + file.getvalue()[116:]


def _encode_uff(columns: Columns, rate: float) -> bytes:
    """Return a data set 58 a signal, as text: samples of 12 digits, and a time step of 6."""
    pyuff, sets = _pyuff(), []
    names = {VALUE: ("acceleration", IS_ACCELERATION, "m/s2"), TACHO: (TACHO, 0, "NONE")}
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


ENCODERS: dict[str, Callable[[Columns, float], bytes]] = {
    ".wav": _encode_wav, ".mat": _encode_mat, ".uff": _encode_uff,
}  # fmt: skip

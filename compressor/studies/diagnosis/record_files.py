"""A data set on disk: windows as netCDF-4, features as Parquet, and a card that tells what it is.

Parquet needs pyarrow, which `pip install 'compsim[dataset]'` brings; without it the same features
are in the netCDF file alone.
"""

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from compressor.program import PROGRAM, Progress
from compressor.store import RECORD_HEADER, Folder, publish, writable_folder, write_dataset
from compressor.studies.diagnosis.data_card import data_card
from compressor.studies.diagnosis.data_set import (
    LABELS,
    WORDS,
    DataSetError,
    DataSetOptions,
    make_data_set,
)
from compressor.studies.diagnosis.features import MIN_REVOLUTIONS, RecordError
from compressor.vibration import Record, smooth_pulses

if TYPE_CHECKING:
    import xarray as xr

WINDOWS, FEATURES_FILE, CARD = "windows.nc", "features.parquet", "README.md"
NO_PARQUET = (
    f"{FEATURES_FILE} is left out: pyarrow is not installed; get it by pip install "
    "'compsim[dataset]' and run the same command again"
)


@dataclass(frozen=True)
class Written:
    """The files that were written, by name with their bytes, and what was left out and why."""

    files: dict[str, int]
    remark: str


def build_data_set(
    results: Folder, study: str, folder: Folder, options: DataSetOptions, progress: Progress
) -> tuple["xr.Dataset", Written]:
    """Make the data set of a stored study in a folder, that is made where it is missing.

    Raises StoreError and DataSetError, what can be told beforehand before records are read.
    """
    refuse_foreign(folder)
    writable_folder(folder, make=False)
    dataset = make_data_set(results, study, options, progress)
    return dataset, write_data_set(folder, dataset)


def write_data_set(folder: Folder, dataset: "xr.Dataset") -> Written:
    """Write a data set (`make_data_set`) into a folder; files of an earlier one are replaced.

    Each file is whole or absent. Raises StoreError where the disk refuses,
    DataSetError as `refuse_foreign` does.
    """
    refuse_foreign(folder)
    place = Path(folder)
    write_dataset(place / WINDOWS, dataset)
    table = parquet(columns(dataset))
    if table is None:
        (place / FEATURES_FILE).unlink(missing_ok=True)  # of an earlier data set
    else:
        publish(place / FEATURES_FILE, table)
    publish(place / CARD, data_card(dataset, table is not None).encode(errors="replace"))
    names = [WINDOWS, *([FEATURES_FILE] if table is not None else []), CARD]
    files = {name: (place / name).stat().st_size for name in names}
    return Written(files, NO_PARQUET if table is None else "")


def refuse_foreign(folder: Folder) -> None:
    """Raise DataSetError where a folder has a README.md that is no data set's card."""
    place = Path(folder)
    if (place / CARD).exists() and not (place / WINDOWS).exists():
        text = f"{place} has a {CARD} of something else, which the card would replace"
        raise DataSetError(f"{text}: choose another folder, such as {place / 'faults'}")


def columns(dataset: "xr.Dataset") -> dict[str, np.ndarray]:
    """Return a data set as columns, with a row for each window and noise level.

    Labels come first.
    """
    levels = dataset.sizes["noise"]
    found: dict[str, np.ndarray] = {
        name: np.repeat(dataset[name].values, levels)
        for name in ("window", "split", *WORDS, *LABELS, "first_pulse")
    }
    found["noise"] = np.tile(dataset["noise"].values, dataset.sizes["window"])
    flat = dataset["features"].values.reshape(-1, dataset.sizes["feature"])
    return found | dict(zip(dataset["feature"].values.tolist(), flat.T, strict=True))


def parquet(table: dict[str, np.ndarray]) -> bytes | None:
    """Return a table by column as the bytes of a Parquet file.

    None where pyarrow is not installed.
    """
    try:
        import pyarrow
        from pyarrow import parquet as format_
    except ImportError:
        return None
    file = io.BytesIO()
    columns: Any = pyarrow.table(table).replace_schema_metadata({"program": PROGRAM})
    format_.write_table(columns, file)
    return file.getvalue()


TIME, VALUE, TACHO = RECORD_HEADER
HEADER = ",".join(RECORD_HEADER)
UNEVEN = 0.1  # of a time step, by which a step may differ from the mean one
LOW, MIDDLE, HIGH = 0.25, 0.5, 0.75  # of a tacho's range: what lies between is no new level
MAX_PULSE_RATIO = 1.5  # longest over shortest time between pulses, beyond which one was missed


@dataclass(frozen=True)
class SteadySpeed:
    """In place of a tacho: revolutions a minute, and a time (s) of top dead centre."""

    rpm: float
    tdc: float

    def pulses(self, times: np.ndarray) -> np.ndarray:
        """Return the times of top dead centre within a record, (k,)."""
        if not (math.isfinite(self.rpm) and self.rpm > 0.0 and math.isfinite(self.tdc)):
            text = f"a speed of {self.rpm:g} rpm with top dead centre at {self.tdc:g} s"
            raise RecordError(f"{text}: give a finite speed above 0, and a finite time")
        turn = 60.0 / self.rpm
        first, last = (times[[0, -1]] - self.tdc) / turn
        return self.tdc + turn * np.arange(math.ceil(first), math.floor(last) + 1)


def read_record(path: str | Path, steady: SteadySpeed | None = None) -> Record:
    """Return the record of a CSV file with the columns time_s, acceleration_m_per_s2 and tacho.

    The tacho is any voltage that rises once a revolution, at top dead centre, through the middle of
    its range: a sine, a square or a short pulse. Pulses are interpolated between samples, and then
    smoothed by what is not known of them between two samples (`smooth_pulses`). Without that
    column, and only then, `steady` tells the speed. Other columns are ignored, and so are lines at
    the end in which these are empty. `clipped` is nan: the range is not known.

    Raises RecordError with file, line and column for what cannot be read: a missing column, what is
    no finite number, unequal time steps, pulses that are too few or irregular.
    """
    columns = _columns(Path(path), [TIME, VALUE], [TACHO])
    if (TACHO in columns) == (steady is not None):
        surplus = "has a tacho column: leave --rpm and --tdc out"
        lacks = f"has no column {TACHO}: add it, or give --rpm and --tdc for a steady speed"
        raise RecordError(f"{path}: {lacks if steady is None else surplus}")
    times = _even(path, columns[TIME])
    within = None
    if steady is None:
        pulses, within = _pulses(path, times, columns[TACHO])
    else:
        pulses = steady.pulses(times)
    if len(pulses) <= MIN_REVOLUTIONS:
        found = f"{len(pulses)} passes of top dead centre in {times[-1] - times[0]:g} s"
        raise RecordError(f"{path}: {found}: at least {MIN_REVOLUTIONS + 1}; record for longer")
    if within is not None:
        pulses = smooth_pulses(pulses, within)
    return Record(times, columns[VALUE], pulses, math.nan)


def _columns(path: Path, needed: list[str], also: list[str]) -> dict[str, np.ndarray]:
    """Return the columns of a CSV file by the names in its first line."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = csv.reader(file)
            header = [name.strip() for name in next(lines, [])]
            for name in needed:
                if name not in header:
                    has = ", ".join(header) or "nothing"
                    text = f"{path}:1: no column {name}, only {has}"
                    raise RecordError(f"{text}; begin the file with the line {HEADER}")
            places = {name: header.index(name) for name in [*needed, *also] if name in header}
            found: dict[str, list[float]] = {name: [] for name in places}
            blank = 0  # the first line without these cells: beyond the end of the record
            for cells in lines:
                texts = {name: "".join(cells[at : at + 1]) for name, at in places.items()}
                if not "".join(texts.values()).strip():
                    blank = blank or lines.line_num
                    continue
                if blank:
                    problem = "the cells are empty, and the record goes on below"
                    raise RecordError(f"{path}:{blank}: {problem}; cut it, or fill the gap")
                for name, text in texts.items():
                    where = f"{path}:{lines.line_num}:{places[name] + 1}: {name}"
                    found[name].append(_number(text, where))
    except OSError as error:
        remedy = f"give a CSV file with the columns {HEADER}, or a job's key"
        raise RecordError(f"{path}: cannot be read: {error.strerror}; {remedy}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise RecordError(f"{path}: is no CSV file in UTF-8: {error}") from error
    return {name: np.array(values) for name, values in found.items()}


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


def _even(path: str | Path, times: np.ndarray) -> np.ndarray:
    """Return the equally spaced times, as nearly equal ones that were rounded mean them."""
    if times.size < 2:
        raise RecordError(f"{path}: {times.size} samples are no record")
    step = (times[-1] - times[0]) / (times.size - 1)
    steps = np.diff(times)
    bad = np.flatnonzero(~(np.abs(steps - step) <= UNEVEN * abs(step)) | (steps <= 0.0))
    if bad.size:
        line = int(bad[0]) + 3  # after the header, the second sample of the step
        text = f"a step of {steps[bad[0]]:g} s, where the mean one is {step:g} s"
        remedy = "resample to equal steps, or write times with more digits"
        raise RecordError(f"{path}:{line}: {TIME}: {text}; {remedy}")
    return times[0] + step * np.arange(times.size)


def _pulses(
    path: str | Path, times: np.ndarray, tacho: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the times at which a tacho rises through its middle, and their uncertainty, s.

    A rise comes from low and goes high, or goes high from the first sample on. A level that jumps
    between two samples jumps anywhere between them; one that rises slowly is known better.
    """
    low, high = tacho.min(), tacho.max()
    if low == high:
        raise RecordError(f"{path}: {TACHO}: is {low:g} all the time; it must rise once a turn")
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
        raise RecordError(f"{path}: {TACHO}: {text}; one a revolution, none missed, none doubled")
    return np.array(found), np.array(within)

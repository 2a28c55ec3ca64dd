"""A measured record from a CSV file: an accelerometer's samples and a tacho, or a steady speed."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compressor.diagnosis.features import FEWEST, RecordError
from compressor.vibration import Record

TIME, VALUE, TACHO = "time_s", "acceleration_m_per_s2", "tacho"
HEADER = f"{TIME},{VALUE},{TACHO}"
UNEVEN = 0.1  # of a time step, by which a step may differ from the mean one
LOW, MIDDLE, HIGH = 0.25, 0.5, 0.75  # of a tacho's range: what lies between is no new level
APART = 1.5  # longest over shortest time between pulses, beyond which one was missed


@dataclass(frozen=True)
class SteadySpeed:
    """In place of a tacho: revolutions a minute, and a time (s) of top dead centre."""

    rpm: float
    tdc: float

    def pulses(self, times: np.ndarray) -> np.ndarray:
        """The times of top dead centre within a record, (k,)."""
        if not (math.isfinite(self.rpm) and self.rpm > 0.0 and math.isfinite(self.tdc)):
            text = f"a speed of {self.rpm:g} rpm with top dead centre at {self.tdc:g} s"
            raise RecordError(f"{text}: give a finite speed above 0, and a finite time")
        turn = 60.0 / self.rpm
        first, last = (times[[0, -1]] - self.tdc) / turn
        return self.tdc + turn * np.arange(math.ceil(first), math.floor(last) + 1)


def read_record(path: str | Path, steady: SteadySpeed | None = None) -> Record:
    """The record of a CSV file with the columns time_s, acceleration_m_per_s2 and tacho.

    The tacho is any voltage that rises once a revolution, at top dead centre, through the middle of
    its range; pulses are interpolated between samples. Without that column, and only then, `steady`
    tells the speed. Other columns are ignored. `clipped` is nan: the range is not known.

    Raises RecordError with file, line and column for what cannot be read: a missing column, what is
    no finite number, unequal time steps, pulses that are too few or irregular.
    """
    columns = _columns(Path(path), [TIME, VALUE], [TACHO])
    if (TACHO in columns) == (steady is not None):
        told = "has a tacho column: leave --rpm and --tdc out"
        lacks = f"has no column {TACHO}: add it, or give --rpm and --tdc for a steady speed"
        raise RecordError(f"{path}: {lacks if steady is None else told}")
    times = _even(path, columns[TIME])
    if steady is None:
        pulses = _pulses(path, times, columns[TACHO])
    else:
        pulses = steady.pulses(times)
    if len(pulses) <= FEWEST:
        found = f"{len(pulses)} passes of top dead centre in {times[-1] - times[0]:g} s"
        raise RecordError(f"{path}: {found}: at least {FEWEST + 1}; record for longer")
    return Record(times, columns[VALUE], pulses, math.nan)


def _columns(path: Path, needed: list[str], also: list[str]) -> dict[str, np.ndarray]:
    """Columns of a CSV file by the names in its first line."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = csv.reader(file)
            header = [name.strip() for name in next(lines, [])]
            for name in needed:
                if name not in header:
                    has = ", ".join(header) or "nothing"
                    text = f"{path}:1: no column {name}, only {has}"
                    raise RecordError(f"{text}; begin the file with the line {HEADER}")
            wanted = {name: header.index(name) for name in [*needed, *also] if name in header}
            found: dict[str, list[float]] = {name: [] for name in wanted}
            for cells in lines:
                for name, place in wanted.items():
                    where = f"{path}:{lines.line_num}:{place + 1}: {name}"
                    found[name].append(_number(cells, place, where))
    except OSError as error:
        remedy = f"give a CSV file with the columns {HEADER}, or a job's key"
        raise RecordError(f"{path}: cannot be read: {error.strerror}; {remedy}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise RecordError(f"{path}: is no CSV file in UTF-8: {error}") from error
    return {name: np.array(values) for name, values in found.items()}


def _number(cells: list[str], place: int, where: str) -> float:
    """A cell as a finite number."""
    text = cells[place] if place < len(cells) else ""
    try:
        value = float(text)
    except ValueError:
        remedy = "write numbers with a decimal point, and leave no cell empty"
        raise RecordError(f"{where}: {text!r} is no number; {remedy}") from None
    if not math.isfinite(value):
        raise RecordError(f"{where}: {text!r} is not finite; cut the record, or fill the gap")
    return value


def _even(path: str | Path, times: np.ndarray) -> np.ndarray:
    """Equally spaced times, as nearly equal ones that were rounded mean them."""
    if times.size < 2:
        raise RecordError(f"{path}: {times.size} samples are no record")
    step = (times[-1] - times[0]) / (times.size - 1)
    steps = np.diff(times)
    bad = np.flatnonzero(~(np.abs(steps - step) <= UNEVEN * abs(step)) | (steps <= 0.0))
    if bad.size:
        line = int(bad[0]) + 3  # after the header, the second sample of the step
        told = f"a step of {steps[bad[0]]:g} s, where the mean one is {step:g} s"
        remedy = "resample to equal steps, or write times with more digits"
        raise RecordError(f"{path}:{line}: {TIME}: {told}; {remedy}")
    return times[0] + step * np.arange(times.size)


def _pulses(path: str | Path, times: np.ndarray, tacho: np.ndarray) -> np.ndarray:
    """When a tacho rises through the middle of its range, coming from low and going high."""
    low, high = tacho.min(), tacho.max()
    if low == high:
        raise RecordError(f"{path}: {TACHO}: is {low:g} all the time; it must rise once a turn")
    share = (tacho - low) / (high - low)
    certain = np.flatnonzero((share < LOW) | (share > HIGH))
    is_high = share[certain] > HIGH
    rises = np.flatnonzero(~is_high[:-1] & is_high[1:])
    found = []
    for before, after in zip(certain[rises], certain[rises + 1], strict=True):
        k = before + int(np.argmax(share[before : after + 1] >= MIDDLE))
        part = (MIDDLE - share[k - 1]) / (share[k] - share[k - 1])
        found.append(times[k - 1] + part * (times[k] - times[k - 1]))
    gaps = np.diff(found)
    if gaps.size and gaps.max() > APART * gaps.min():
        told = f"pulses {gaps.min():g} to {gaps.max():g} s apart"
        raise RecordError(f"{path}: {TACHO}: {told}; one a revolution, none missed, none doubled")
    return np.array(found)

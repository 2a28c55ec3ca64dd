"""Indicator cards: cylinder pressure over the crank's angle, as measured, from CSV files.

A file has columns `crank_angle_deg` (0 at top dead centre, any step, rising) and `pressure_MPa`
(absolute), of one revolution or of several, which are averaged on the first one's angles. A case
holds where a card is and a digest of its numbers, `/data/head.csv@0123456789abcdef0123`; the digest
is what a job's key has of it.
"""

import csv
import hashlib
import math
import os
import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

from compressor.program import CompsimError

COLUMNS = ("crank_angle_deg", "pressure_MPa")
MARKED = re.compile(r"(?s)(.+)@([0-9a-f]{20})")
MAX_GAP = 20.0  # degrees between neighbours: more leaves a valve's opening to a guess
MAX_BYTES = 50_000_000
PRESSURES = (1e-3, 100.0)  # MPa: all below, or any above, are of another unit
CLOSING = 1e-6  # degrees: a last sample so near to a whole revolution is the first one's angle


class CardError(CompsimError):
    """A file that is no card; its text names file and line."""

    exit_code = 2


class Card(NamedTuple):
    """A mean revolution of a card."""

    angles: tuple[float, ...]  # degrees in [0, 360), rising
    pressures: tuple[float, ...]  # MPa
    revolutions: int
    scatter: float  # standard deviation of revolutions, rms over angles, MPa; 0 of one


def mark_card(value: str) -> str:
    """Return the path of a card with the digest of its numbers; one that has it as it is.

    Raises CardError for a file that is no card.
    """
    if MARKED.fullmatch(value):
        return value
    path = os.path.abspath(value)
    return f"{path}@{digest_of(read_card(path))}"


def digest_of(card: Card) -> str:
    """Return the digest of a card's numbers: 20 hexadecimal digits."""
    return hashlib.sha256(repr(card).encode()).hexdigest()[:20]


def open_card(value: str) -> Card:
    """Return the card that a case holds. Raises CardError where its numbers are no longer so."""
    found = MARKED.fullmatch(value)
    path, digest = found.groups() if found else (value, "")
    card = read_card(path)
    if digest != digest_of(card):
        raise CardError(f"{path}: has changed since the case was made: read the case file again")
    return card


def read_card(path: str) -> Card:
    """Return the mean revolution of a file. Raises CardError, with file and line."""
    try:
        about = os.stat(path)
        if about.st_size > MAX_BYTES:
            raise CardError(f"{path}: is larger than {MAX_BYTES / 1e6:g} MB")
        return _read_card(path, about.st_mtime_ns, about.st_size)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        text = error.strerror if isinstance(error, OSError) else str(error)
        raise CardError(f"{path}: cannot be read: {text}") from error


@lru_cache(maxsize=32)
def _read_card(path: str, modified: int, size: int) -> Card:
    with open(path, newline="", encoding="utf-8-sig") as file:
        rows = [*_rows(path, file)]
    if not rows:
        raise CardError(f"{path}:1: holds no samples")
    _check_pressures(path, rows)
    return _mean_revolution(path, rows)


Row = tuple[int, float, float]  # line, degrees, MPa


def _rows(path: str, file: Iterator[str]) -> Iterator[Row]:
    """Yield the samples of a file; angles rise."""
    reader = csv.reader(file)
    heads = [name.strip() for name in next(reader, [])]
    for name in COLUMNS:
        if name not in heads:
            given = ", ".join(heads) or "none"
            raise CardError(
                f"{path}:1: has no column {name}; its columns are {given[:100]}. A card needs "
                f"{' and '.join(COLUMNS)}, absolute: 1 bar is 0.1 MPa"
            )
    places = [heads.index(name) for name in COLUMNS]
    before = -math.inf
    for words in reader:
        line = reader.line_num
        if not any(word.strip() for word in words):
            continue
        numbers = []
        for name, place in zip(COLUMNS, places, strict=True):
            text = words[place].strip() if place < len(words) else ""
            try:
                number = float(text)
            except ValueError:
                number = math.nan
            if not math.isfinite(number):
                raise CardError(f"{path}:{line}: {name} needs a number, not {text[:40]!r}")
            numbers.append(number)
        angle, pressure = numbers
        if angle <= before:
            raise CardError(f"{path}:{line}: angles must rise, and {angle:g} follows {before:g}")
        if angle - before > MAX_GAP and before > -math.inf:
            raise CardError(
                f"{path}:{line}: a gap of {angle - before:g} degrees before {angle:g}; at most "
                f"{MAX_GAP:g} are bridged"
            )
        before = angle
        yield line, angle, pressure


def _check_pressures(path: str, rows: Sequence[Row]) -> None:
    """Raise CardError for pressures that cannot be absolute ones in MPa."""
    low, high = PRESSURES
    unit = "give absolute pressures in MPa: 1 bar is 0.1, 1 kPa 0.001, 1 Pa 1e-6"
    for line, _, pressure in rows:
        if pressure <= 0.0:
            raise CardError(f"{path}:{line}: {pressure:g} MPa is no absolute pressure; {unit}")
        if pressure > high:
            raise CardError(f"{path}:{line}: {pressure:g} MPa is above {high:g}; {unit}")
    if all(pressure < low for _, _, pressure in rows):
        raise CardError(f"{path}:{rows[0][0]}: all pressures are below {low:g} MPa; {unit}")


def _mean_revolution(path: str, rows: Sequence[Row]) -> Card:
    """Return the mean of the revolutions of samples, on the first one's angles."""
    first, last = rows[0][1], rows[-1][1]
    whole = round((last - first) / 360.0)
    if whole and abs(last - first - 360.0 * whole) <= CLOSING:
        rows = rows[:-1]  # the first angle again
    turns: dict[int, list[tuple[float, float]]] = {}
    for _, angle, pressure in rows:
        turns.setdefault(int((angle - first) // 360.0), []).append((angle, pressure))
    for number, turn in turns.items():
        lacking = first + 360.0 * (number + 1) - turn[-1][0]
        if lacking > MAX_GAP:
            raise CardError(
                f"{path}:{rows[-1][0]}: the card ends {lacking:g} degrees before its revolution "
                "does: give whole revolutions"
            )
    own = turns[0]
    columns = [[pressure for _, pressure in own]]
    for number in range(1, len(turns)):
        shifted = [(angle - 360.0 * number, pressure) for angle, pressure in turns[number]]
        columns.append([_between(angle, shifted) for angle, _ in own])
    count = len(columns)
    mean = [math.fsum(each) / count for each in zip(*columns, strict=True)]
    scatter = 0.0
    if count > 1:
        squares = [
            (one - middle) ** 2
            for column in columns
            for one, middle in zip(column, mean, strict=True)
        ]
        scatter = math.sqrt(math.fsum(squares) / (count - 1) / len(mean))
    turned = sorted((angle % 360.0, value) for (angle, _), value in zip(own, mean, strict=True))
    angles, pressures = zip(*turned, strict=True)
    if any(after <= before for before, after in pairwise(angles)):
        raise CardError(f"{path}: an angle stands twice in a revolution")
    return Card(angles, pressures, count, scatter)


def _between(angle: float, turn: Sequence[tuple[float, float]]) -> float:
    """Return the pressure of a revolution at an angle, straight between its samples."""
    first, last = turn[0], turn[-1]
    place = bisect_right(turn, (angle, math.inf))
    left = turn[place - 1] if place else (last[0] - 360.0, last[1])
    right = turn[place] if place < len(turn) else (first[0] + 360.0, first[1])
    share = (angle - left[0]) / (right[0] - left[0])
    return left[1] + share * (right[1] - left[1])

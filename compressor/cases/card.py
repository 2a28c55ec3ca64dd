"""Indicator cards: cylinder pressure over the crank's angle, as measured, from text files.

A file has a column `crank_angle_deg` (0 at top dead centre, any step, rising) and a pressure for
each end that it is of: `pressure_bar`, or `head_pressure_bar` and `crank_pressure_bar`; other units
stand in `IN_MPA`, and a `g` behind one says that it counts from the ambient pressure. It has one
revolution or several, which are averaged on the first one's angles. A case holds where a card is
and a digest of its numbers, `/data/head.csv@0123456789abcdef0123`; the digest is what a job's key
has of it.
"""

import hashlib
import math
import os
import re
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

from compressor.cases.text_table import TextTableError, open_text_table
from compressor.program import CompsimError

IN_MPA = {"mpa": 1.0, "kpa": 1e-3, "bar": 0.1, "psi": 6.894757293168e-3}
ATMOSPHERE_MPA = 0.101325
ANGLE = re.compile(r"(crank_)?angle(_deg|_degrees)?")  # names of columns, as `_plain` writes them
PRESSURE = re.compile(  # of an end, or called so, or both: he_barg, pressure_bar, he_pressure_bar
    rf"(?=.*_)((head|he|crank|ce)_(end_)?)?((pressure|p)_)?({'|'.join(IN_MPA)})([ag]?)"
)
NEEDED = (
    "a card needs crank_angle_deg and pressure_bar, or head_pressure_bar and crank_pressure_bar; "
    "or MPa, kPa, psi, all absolute; with a g, as in pressure_barg, they count from the ambient "
    "pressure"
)
MARKED = re.compile(r"(?s)(.+)@([0-9a-f]{20})")
MAX_GAP = 20.0  # degrees between neighbours: more leaves a valve's opening to a guess
MAX_BYTES = 50_000_000
PRESSURES = (1e-3, 100.0)  # MPa: all below, or any above, are of another unit
LEAST_GAUGE = -0.102  # MPa
CLOSING = 1e-6  # degrees: a last sample so near to a whole revolution is the first one's angle
DRIVING = -0.02  # of pressure range times stroke: work that the gas of no compressor gives


class CardError(CompsimError):
    """A file that is no card; its text names file and line."""


class Card(NamedTuple):
    """A mean revolution of a card."""

    angles: tuple[float, ...]  # degrees in [0, 360), rising
    pressures: tuple[float, ...]  # MPa
    revolutions: int
    scatter: float  # standard deviation of revolutions, rms over angles, MPa; 0 of one
    is_gauge: bool  # whether pressures count from the ambient one


def mark_card(value: str, end: str) -> str:
    """Return the path of an end's card with the digest of its numbers; one that has it as it is.

    end: head or crank. Raises CardError for a file that is no card.
    """
    if MARKED.fullmatch(value):
        return value
    path = os.path.abspath(value)
    return f"{path}@{digest_of(read_card(path, end))}"


def digest_of(card: Card) -> str:
    """Return the digest of a card's numbers: 20 hexadecimal digits."""
    return hashlib.sha256(repr(card).encode()).hexdigest()[:20]


def open_card(value: str, end: str) -> Card:
    """Return the card that a case holds of an end, head or crank.

    Raises CardError where its numbers are no longer so.
    """
    found = MARKED.fullmatch(value)
    path, digest = found.groups() if found else (value, "")
    remedy = "put the card of that time back, or run the case file again"
    try:
        card = read_card(path, end)
    except CardError as error:
        raise CardError(f"{error}; {remedy}") from error
    if digest != digest_of(card):
        raise CardError(f"{path}: has changed since the case was made; {remedy}")
    return card


def read_card(path: str, end: str) -> Card:
    """Return the mean revolution of an end in a file. Raises CardError, with file and line."""
    try:
        about = os.stat(path)
        if about.st_size > MAX_BYTES:
            raise CardError(f"{path}: is larger than {MAX_BYTES / 1e6:g} MB")
        return _read_card(path, end, about.st_mtime_ns, about.st_size)
    except OSError as error:
        raise CardError(f"{path}: cannot be read: {error.strerror}") from error
    except TextTableError as error:
        raise CardError(f"{error}; {NEEDED}") from error


@lru_cache(maxsize=32)
def _read_card(path: str, end: str, modified: int, size: int) -> Card:
    table = open_text_table(path)
    angle, pressure, factor, is_gauge = _find_columns(path, table.names, end)
    lines, (angles, values) = table.read_columns([angle, pressure])
    rows = [*zip(lines, angles, (factor * value for value in values), strict=True)]
    _check_angles(path, rows)
    _check_pressures(path, rows, table.names[pressure], is_gauge)
    return _mean_revolution(path, rows, is_gauge)


Row = tuple[int, float, float]  # line, degrees, MPa


def _plain(name: str) -> str:
    """Return a column's name in small letters, its other signs as `_`."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


def _find_columns(path: str, names: Sequence[str], end: str) -> tuple[int, int, float, bool]:
    """Return the columns of the angle and of an end's pressure, its unit in MPa, and if gauge.

    A column of the end's own comes before one that names none. Raises CardError.
    """
    plain = [_plain(name) for name in names]
    angles = [k for k, name in enumerate(plain) if ANGLE.fullmatch(name)]
    found = [(k, match) for k, name in enumerate(plain) if (match := PRESSURE.fullmatch(name))]
    own = [(k, match) for k, match in found if (match[2] or "")[:1] == end[0]]
    pressures = own or [(k, match) for k, match in found if not match[2]]
    for what, columns in (("crank angle", angles), (f"pressure of the {end} end", pressures)):
        if len(columns) != 1:
            given = ", ".join(names)[:100]
            number = "no column" if not columns else f"{len(columns)} columns"
            raise CardError(f"{path}: has {number} for the {what}; it has {given}; {NEEDED}")
    place, match = pressures[0]
    return angles[0], place, IN_MPA[match[6]], match[7] == "g"


def _check_angles(path: str, rows: Sequence[Row]) -> None:
    """Raise CardError for angles that do not rise, or leave a gap."""
    for (_, before, _), (line, angle, _) in pairwise(rows):
        if angle <= before:
            raise CardError(f"{path}:{line}: angles must rise, and {angle:g} follows {before:g}")
        if angle - before > MAX_GAP:
            raise CardError(
                f"{path}:{line}: a gap of {angle - before:g} degrees before {angle:g}; at most "
                f"{MAX_GAP:g} are bridged"
            )


def _check_pressures(path: str, rows: Sequence[Row], name: str, is_gauge: bool) -> None:
    """Raise CardError for pressures that cannot be of the unit of their column."""
    low, high = PRESSURES
    least = LEAST_GAUGE if is_gauge else 0.0
    unit = f"is {name} the column's unit? {NEEDED}"
    for line, _, pressure in rows:
        if pressure <= least:
            raise CardError(f"{path}:{line}: {pressure:g} MPa is below a vacuum; {unit}")
        if pressure > high:
            raise CardError(f"{path}:{line}: {pressure:g} MPa is above {high:g}; {unit}")
    if not rows:
        raise CardError(f"{path}: has no row with an angle and a pressure; {NEEDED}")
    if all(pressure < low for _, _, pressure in rows):
        raise CardError(f"{path}:{rows[0][0]}: all pressures are below {low:g} MPa; {unit}")


def _mean_revolution(path: str, rows: Sequence[Row], is_gauge: bool) -> Card:
    """Return the mean of the revolutions of samples, on the first one's angles."""
    import numpy as np  # of cases with a card alone

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
    own, *others = (np.array(turn).T for turn in turns.values())
    columns = [own[1], *(np.interp(own[0], at, values, period=360.0) for at, values in others)]
    mean, count = np.mean(columns, axis=0), len(columns)
    scatter = math.sqrt(np.var(columns, axis=0, ddof=1).mean()) if count > 1 else 0.0
    order = np.argsort(own[0] % 360.0)
    angles = (own[0] % 360.0)[order]
    if (np.diff(angles) <= 0.0).any():
        raise CardError(f"{path}: an angle stands twice in a revolution")
    return Card(tuple(angles.tolist()), tuple(mean[order].tolist()), count, scatter, is_gauge)


def taken_work(card: Card, end: str, crank_radius: float, rod_length: float) -> float:
    """Return the work that an end's gas takes in a revolution, over its pressure range and stroke.

    About 0.4 of a compressor, and negative of an engine. end: head or crank; lengths in one unit.
    """
    radians = [math.radians(angle) for angle in card.angles]
    places = [
        crank_radius * math.cos(a) + math.sqrt(rod_length**2 - (crank_radius * math.sin(a)) ** 2)
        for a in radians
    ]
    turn = [*zip(places, card.pressures, strict=True)]
    pairs = pairwise([*turn, turn[0]])
    work = math.fsum(0.5 * (p + q) * (y - x) for (x, p), (y, q) in pairs)
    span = 2.0 * crank_radius * (max(card.pressures) - min(card.pressures))
    return (work if end == "head" else -work) / span if span else 0.0

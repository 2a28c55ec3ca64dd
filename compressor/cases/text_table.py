"""Tables of numbers in text files, as instruments and spreadsheets write them.

Encoding, separator, decimal sign and the lines above the header are found. Records and indicator
cards are read by it.
"""

import codecs
import contextlib
import csv
import itertools
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from compressor.program import CompsimError, printable

SEPARATORS = {";": "semicolon", "\t": "tab", ",": "comma", " ": "blanks"}
DECIMALS = {".": "point", ",": "comma"}
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"),
         (codecs.BOM_UTF16_BE, "utf-16"))  # fmt: skip
SAMPLED_LINES = 1000  # from which separator and decimal sign are found
UNIT_WORDS = {  # of a line of units below the header
    "s", "ms", "us", "µs", "v", "mv", "g", "m/s2", "m/s²", "m/s^2", "mm/s2", "in/s2", "ft/s2",
    "deg", "degree", "degrees", "°", "mpa", "kpa", "pa", "bar", "barg", "bara", "psi", "psig",
    "psia", "-",
}  # fmt: skip


class TextTableError(CompsimError):
    """A text that is no table of numbers; its message names file, line and column."""


Row = tuple[int, list[str]]  # the number of its last line, and its cells


@dataclass(frozen=True)
class TextTable:
    """A table of a text file.

    names: of the columns, by number from 1 where there is no header; header_line: its number, 0
    without a header; numeric: whether a column holds numbers; rows: those below the header.
    """

    path: str
    separator: str
    decimal: str
    names: tuple[str, ...]
    header_line: int
    numeric: tuple[bool, ...]
    rows: Sequence[Row]

    @property
    def layout(self) -> str:
        """Return how the file was read, in words."""
        header = f"header in line {self.header_line}" if self.header_line else "no header"
        signs = f"separator {SEPARATORS[self.separator]}, decimal {DECIMALS[self.decimal]}"
        return f"{signs}, {header}, {len(self.names)} columns"

    def read_columns(self, numbers: Sequence[int]) -> tuple[list[int], list[list[float]]]:
        """Return the lines of the rows, and columns by their numbers from 0.

        Rows at the end without any of these cells are left out. Raises TextTableError for a cell
        that is no finite number, and for a gap.
        """
        rows = [
            (line, [cells[at].strip() if at < len(cells) else "" for at in numbers])
            for line, cells in self.rows
        ]
        while rows and not any(rows[-1][1]):  # beyond the end of the table
            rows.pop()
        for line in (line for line, texts in rows if not any(texts)):
            problem = "the cells are empty, and the table goes on below"
            raise TextTableError(f"{self.path}:{line}: {problem}; cut it, or fill the gap")
        return [line for line, _ in rows], [
            [self._number(texts[k], line, at) for line, texts in rows]
            for k, at in enumerate(numbers)
        ]

    def _number(self, text: str, line: int, column: int) -> float:
        """Return a cell as a finite number. Raises TextTableError."""
        if (value := parse_number(text, self.decimal)) is not None and math.isfinite(value):
            return value
        where = f"{self.path}:{line}:{column + 1}: {self.names[column]}"
        shown = repr(printable(text[:40]))
        if value is not None or NOT_FINITE.fullmatch(text):
            remedy = "cut the table, or fill the gap"
            raise TextTableError(f"{where}: {shown} is not finite; {remedy}")
        remedy = (
            f"write numbers with a decimal {DECIMALS[self.decimal]}, without signs of thousands, "
            "and leave no cell empty"
        )
        raise TextTableError(f"{where}: {shown} is no number; {remedy}")


def parse_number(text: str, decimal: str = ".") -> float | None:
    """Return a cell as a number, None where it is none: no `_`, no sign of thousands."""
    text = text.strip()
    if decimal == ",":
        text = text.replace(".", "_").replace(",", ".")
    return float(text) if NUMBER.fullmatch(text) else None


def open_text_table(path: str | Path) -> TextTable:
    """Return the table of a text file. Raises TextTableError, or OSError."""
    text = decode_text(path, Path(path).read_bytes())
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    found: list[tuple[Merit, TextTable]] = []
    for mark in SEPARATORS:
        with contextlib.suppress(csv.Error):
            rows = [*_split(lines[:SAMPLED_LINES], mark)]
            found += filter(None, (_find_table(str(path), rows, mark, sign) for sign in DECIMALS))
    if not found:
        first = next((line for line in lines if line.strip()), "")
        tried = ", ".join(SEPARATORS.values())
        raise TextTableError(
            f"{path}: holds no rows of numbers (its first line: {printable(first[:60])!r}; "
            f"separators tried: {tried}; decimal point and comma)"
        )
    _, table = max(found, key=lambda one: one[0])
    first_line, width, header = table.rows[0][0], len(table.numeric), table.names
    if table.separator == "," and table.decimal == "." and 2 * len(header) == width:
        raise TextTableError(
            f"{path}:{first_line}: {width} cells below a header of {len(header)}: commas separate "
            "cells and decimals; write the file with another separator"
        )
    try:
        rows = [row for row in _split(lines, table.separator) if row[0] >= first_line]
    except csv.Error as error:
        raise TextTableError(f"{path}: is no table: {error}") from error
    if len(header) < width:
        names = tuple(str(k + 1) for k in range(width))
        return replace(table, rows=rows, names=names, header_line=0)
    while len(header) > width and not header[-1]:
        header = header[:-1]
    numeric = (*table.numeric, *[False] * (len(header) - width))
    return replace(table, rows=rows, names=header, numeric=numeric)


def decode_text(path: str | Path, data: bytes) -> str:
    """Return the text of bytes in UTF-8, UTF-16, or else Latin 1. Raises TextTableError."""
    encoding = next((name for mark, name in MARKS if data.startswith(mark)), "utf-8")
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        if encoding != "utf-8":
            raise TextTableError(f"{path}: is no text in {encoding.upper()}: {error}") from error
        text = data.decode("latin-1")
    if re.search("[\x00-\x08\x0e-\x1f]", text[:10000]):
        raise TextTableError(f"{path}: is no text file: it has bytes that no text has")
    return text


def _split(lines: Sequence[str], separator: str) -> Iterator[Row]:
    """Yield the rows of lines, blank ones too."""
    if separator == " ":
        yield from ((number, line.lstrip("#% ").split()) for number, line in enumerate(lines, 1))
    else:
        reader = csv.reader(lines, delimiter=separator)
        yield from ((reader.line_num, cells) for cells in reader)


Merit = tuple[bool, int]  # of a way to read a table: the greater, the more likely


def _find_table(
    path: str, rows: Sequence[Row], separator: str, decimal: str
) -> tuple[Merit, TextTable] | None:
    """Return the table in rows, up to the last column of numbers; None where there is none.

    Rows have a shape: which of their cells are numbers. The shape that holds most numbers is the
    table's. Rows above its first one that have a number in one of its columns belong to it, and are
    damaged; the row of words above is the header.
    """
    rows = [row for row in rows if any(map(str.strip, row[1]))]
    kinds = [[_kind(cell, decimal) for cell in cells] for _, cells in rows]
    shapes = Counter("".join(one).rstrip(EMPTY) for one in kinds)
    merits = {one: shapes[one] * (one.count(DIGITS) - one.count(WORDS)) for one in shapes}
    shape = max(merits, key=lambda one: merits[one], default="")
    if DIGITS not in shape:
        return None
    first = next(k for k, one in enumerate(kinds) if "".join(one).rstrip(EMPTY) == shape)
    while first > 0 and _is_damaged(kinds[first - 1], shape):
        first -= 1
    columns = itertools.zip_longest(*kinds[first:], fillvalue=EMPTY)
    numeric = [one.count(DIGITS) > one.count(WORDS) for one in columns]
    width = max((k + 1 for k, is_number in enumerate(numeric) if is_number), default=0)
    if not width or (separator == " " and not all(numeric[:width])):
        return None  # words that are apart by blanks are text
    header = tuple(_names(rows[:first])) if first else ()
    header_line = rows[first - 1][0] if first else 0
    merit = sum(map(bool, header)) == width and WORDS not in shape, merits[shape]
    columns_read = tuple(numeric[:width])
    return merit, TextTable(
        path, separator, decimal, header, header_line, columns_read, rows[first:]
    )


DIGITS, WORDS, EMPTY = "0", "w", " "  # what a cell is


def _kind(cell: str, decimal: str) -> str:
    if not cell.strip():
        return EMPTY
    return WORDS if parse_number(cell, decimal) is None else DIGITS


def _is_damaged(kinds: Sequence[str], shape: str) -> bool:
    """Return whether a row of other shape has a number in a column of numbers."""
    return len(kinds) >= len(shape) and any(
        one == other == DIGITS for one, other in zip(kinds, shape, strict=False)
    )


def _names(rows: Sequence[Row]) -> list[str]:
    """Return the names of columns of the last row; one of units is joined to the row above."""
    names = [cell.strip() for cell in rows[-1][1]]
    names[0] = names[0].lstrip("#% ")
    bare = [name.strip("[]()") for name in names]
    are_units = UNIT_WORDS.issuperset({unit.lower() for unit in bare} - {""})
    if are_units and len(rows) > 1 and len(rows[-2][1]) == len(names):
        above = _names(rows[-2:-1])
        names = [
            f"{name} [{unit}]" if unit else name for name, unit in zip(above, bare, strict=True)
        ]
    return names

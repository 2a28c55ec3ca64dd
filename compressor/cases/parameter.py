"""One row of the table of parameters, and what a value of it must satisfy.

`compressor.cases.table` builds the whole table from these; units are those of the case file, and
`to_si` turns a value into SI.
"""

import math
import re
import reprlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

IMPLAUSIBLE = 0.1  # of the journal radius: a penetration the contact law was never meant for
NAME = re.compile(r"[A-Za-z0-9._-]{1,64}")

# case-file unit -> (SI unit, numerator, denominator): SI value = value * numerator / denominator
UNITS = {
    "": ("1", 1, 1),
    "mm": ("m", 1, 1000),
    "m": ("m", 1, 1),
    "kg": ("kg", 1, 1),
    "kg m2": ("kg m2", 1, 1),
    "m/s2": ("m/s2", 1, 1),
    "rpm": ("rad/s", math.pi, 30),
    "MPa": ("Pa", 1_000_000, 1),
    "N": ("N", 1, 1),
    "N/mm": ("N/m", 1000, 1),
    "N/mm^p": ("N/m^p", 1, 1),  # times 1000^exponent: see compressor.solve.si_record
    "N s/mm": ("N s/m", 1000, 1),
    "mm/s": ("m/s", 1, 1000),
    "s": ("s", 1, 1),
    "deg": ("rad", math.pi, 180),
    "Hz": ("Hz", 1, 1),
    "rev": ("rev", 1, 1),
}


@dataclass(frozen=True)
class Problem:
    """What is wrong with one key of a case."""

    key: str
    message: str


class CaseError(ValueError):
    """A case that cannot be simulated; `problems` lists everything that is wrong with it."""

    def __init__(self, problems: list[Problem]):
        self.problems = problems
        super().__init__(problems)

    def __str__(self) -> str:
        return "; ".join(f"{p.key}: {p.message}" for p in self.problems)


SHORT = reprlib.Repr()
SHORT.maxstring = SHORT.maxother = SHORT.maxlong = 60


def shown(value: Any) -> str:
    """A value as an error message quotes it: control characters escaped, long values cut."""
    if isinstance(value, bool):
        return str(value).lower()
    return SHORT.repr(value)


def to_si(value: float, unit: str) -> float:
    """A case-file value in SI; powers of ten are divided, so that 0.1 mm is exactly 1e-4 m."""
    _, numerator, denominator = UNITS[unit]
    return value * numerator / denominator


@dataclass(frozen=True)
class Parameter:
    """One row of the table of parameters; `low` and `high` are in the case file's unit."""

    key: str
    unit: str
    default: Any
    low: float
    high: float
    above: bool  # whether `low` itself is excluded
    source: str
    phrase: str
    kind: str  # number | integer | boolean | choice | text | materials | accuracy
    choices: tuple[str, ...] = ()
    optional: bool = False
    identity: bool = True  # whether it is part of a job's identity

    @property
    def range(self) -> str:
        """The allowed values, for a table or an error."""
        if self.kind == "choice":
            return " | ".join(self.choices)
        if self.kind == "boolean":
            return " | ".join([*self.choices, "true", "false"])
        if self.kind == "accuracy":
            return " | ".join(self.choices) + " | {metric: relative error}"
        if self.kind == "materials":
            return "two of " + ", ".join(self.choices)
        if self.kind == "text":
            return "[A-Za-z0-9._-], at most 64"
        opening = "(" if self.above else "["
        return " | ".join([*self.choices, f"{opening}{self.low:g}, {self.high:g}]"])

    def check(self, value: Any) -> str | None:
        """What is wrong with a scalar value of this parameter, or None."""
        if self.kind in ("choice", "text", "accuracy"):
            return self._check_text(value)
        if self.kind == "materials":
            return self._check_materials(value)
        if isinstance(value, str) and value in self.choices:
            return None
        if self.kind == "boolean":
            words = ", ".join([*self.choices, "true"])
            good = isinstance(value, bool)
            return None if good else f"needs {words} or false, not {shown(value)}"
        if isinstance(value, bool) or not isinstance(value, int | float):
            return f"needs {' or '.join([*self.choices, 'a number'])}, not {shown(value)}"
        if not _is_finite(value):
            return "must be finite"
        if self.kind == "integer" and value != int(value):
            return f"needs a whole number, not {value!r}"
        if value < self.low or value > self.high or (self.above and value == self.low):
            return f"{value:g} is outside {self.range}" + (f" {self.unit}" if self.unit else "")
        return None

    def _check_text(self, value: Any) -> str | None:
        if not isinstance(value, str):
            return f"needs text, not {shown(value)}"
        if self.kind == "text":
            good = NAME.fullmatch(value) and not value.startswith(".")
            return None if good else f"{shown(value)} is no name: use {self.range}, no leading dot"
        return None if value in self.choices else f"{shown(value)} is none of {self.range}"

    def _check_materials(self, value: Any) -> str | None:
        if not isinstance(value, tuple | list) or len(value) != 2:
            return "needs a pair of materials, such as [steel, steel]"
        bad = [name for name in value if name not in self.choices]
        if not bad:
            return None
        return f"unknown material {shown(bad[0])}; known: {', '.join(self.choices)}"


def _is_finite(value: float) -> bool:
    """Whether a number fits a float; an integer may be too large to be asked by math."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def parameter(
    default: Any, unit: str, span: tuple[float, float], source: str, phrase: str, **more: Any
) -> Any:
    """A dataclass field that is also a row of the table; `more`: other fields of `Parameter`."""
    row = {"unit": unit, "low": span[0], "high": span[1], "above": False, "source": source}
    row |= {"phrase": phrase, "kind": "number"}
    return field(default=default, metadata=row | more)


def choice(default: Any, choices: tuple[str, ...], source: str, phrase: str, **more: Any) -> Any:
    """A field whose value is one of a few words, or of another `kind` that is given."""
    row = {"unit": "", "low": 0.0, "high": 0.0, "above": False, "source": source}
    row |= {"phrase": phrase, "kind": "choice", "choices": choices}
    return field(default=default, metadata=row | more)


def parameter_table(rows: Iterable[Parameter]) -> str:
    """The table of parameters in Markdown; `compressor.cases.table.table` has the rows."""
    lines = ["| key | unit | default | range | source | what it is |", "|---|---|---|---|---|---|"]
    for row in rows:
        default = "" if row.default is None or row.kind == "text" else str(row.default)
        default = shown(row.default) if row.kind == "boolean" else default.removesuffix(".0")
        cells = (f"`{row.key}`", row.unit, default, row.range, row.source, row.phrase)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"

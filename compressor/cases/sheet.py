"""The jobs of a sweep that differ in numbers alone, as one case whose numbers are columns.

What a case fills in, the rules of `conflicts` and the text that a key is the hash of are the same
code for one job and for all. A sheet says which jobs *may* not fit; whether one does, and why, is
told of it alone.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from compressor.cases.case import Case, canonical, digest, identity, parts_of
from compressor.cases.checks import SHORTHANDS, single, stands_for, value_of
from compressor.cases.columns import ArrayValue, Mixed, places_where
from compressor.cases.combinations import Alike
from compressor.cases.conflicts import RULES
from compressor.cases.keys import nest_values

COLUMN_PLACE = re.compile(r'"@(\d+)"')  # where a column stands in a text


@dataclass(frozen=True)
class CaseBatch:
    """Some jobs of a study: `numbers` among them, (m,), and their case, with the keys given.

    The case has a `ArrayValue` wherever they may differ.
    """

    numbers: np.ndarray
    case: Case
    given: frozenset[str]

    @classmethod
    def of(cls, name: str, jobs: Alike, before: int) -> "CaseBatch":
        """Return the sheet of jobs of a block, `before` which the study has others.

        `name`: the study's.

        Raises CaseError where values do not fit that all jobs share.
        """
        parts, given = parts_of(nest_values(jobs.chosen) | {"name": name})
        changes: dict[str, dict[str, ArrayValue]] = {}
        for key, column in jobs.columns.items():
            for part in stands_for(key) or (key,):
                group, _, inner = part.rpartition(".")
                changes.setdefault(group, {})[inner] = column
        for group, columns in changes.items():
            parts[group] = replace(parts[group], **columns)
        return cls(jobs.places + before, Case(**parts), given)

    def __len__(self) -> int:
        return len(self.numbers)

    @cached_property
    def _columns(self) -> list[tuple[str, dict[str, ArrayValue]]]:
        """The columns of each group that has some."""
        found = []
        for item in fields(Case):
            inner = getattr(vars(self.case)[item.name], "__dict__", {})
            columns = {key: value for key, value in inner.items() if isinstance(value, ArrayValue)}
            found += [(item.name, columns)] if columns else []
        return found

    def _picked(self, pick: Callable[[np.ndarray], Any]) -> Case:
        """Return the case with something made of each column in its place."""
        made = object.__new__(Case)
        values = vars(made)
        values.update(vars(self.case))
        for name, columns in self._columns:
            whole = values[name]
            group = object.__new__(type(whole))
            vars(group).update(vars(whole))
            vars(group).update({key: pick(column.numbers) for key, column in columns.items()})
            values[name] = group
        return made

    def at(self, place: int) -> Case:
        """Return the case of one job, of which it is known that its values fit."""
        made = self._picked(lambda numbers: numbers[place].item())
        vars(made)["problems"] = ()
        return made

    def doubtful(self) -> np.ndarray:
        """Return whether a rule may find values that do not fit each other, of each job, (m,)."""
        found = np.zeros(len(self), dtype=bool)
        for rule in RULES:

            def speaks(places: np.ndarray, rule: Any = rule) -> bool:
                some = self._picked(lambda numbers: ArrayValue(numbers[places]))
                return any(True for _ in rule(some, self.given))

            try:
                found |= places_where(speaks, len(self))
            except (ArithmeticError, TypeError, ValueError):  # of what is no column's to do
                found[:] = True
        return found

    def has(self, condition: Callable[[Case], Any]) -> bool:
        """Return whether a condition holds for any of the jobs."""

        def holds(places: np.ndarray) -> bool:
            return bool(condition(self._picked(lambda numbers: ArrayValue(numbers[places]))))

        return bool(places_where(holds, len(self)).any())

    def keys(self) -> list[str]:
        """Return the keys of the jobs: of all from one text, in which the numbers change."""
        columns: list[ArrayValue] = []

        def held(value: ArrayValue) -> str:
            columns.append(value)
            return f"@{len(columns) - 1}"

        try:
            with np.errstate(divide="raise", over="raise", invalid="raise"):
                text = canonical(identity(self.case, with_solver=True), held)
        except (Mixed, ArithmeticError, TypeError, ValueError):
            return [self.at(place).key for place in range(len(self))]
        if not columns:
            return [digest(text)] * len(self)
        pieces = COLUMN_PLACE.split(text)
        frame = "%s".join(piece.replace("%", "%%") for piece in pieces[::2])
        texts = {id(column): list(map(repr, column.numbers.tolist())) for column in columns}
        rows = zip(*(texts[id(columns[int(place)])] for place in pieces[1::2]), strict=True)
        return [digest(frame % row) for row in rows]

    def values(self, key: str) -> list[Any]:
        """Return the value of a dotted key in each job, as `value_of` gives it."""
        if key in SHORTHANDS:
            rows = zip(*(self.values(part) for part in stands_for(key)), strict=True)
            return [single(size for size in sizes if size > 0) for sizes in rows]
        value = value_of(self.case, key)
        return value.numbers.tolist() if isinstance(value, ArrayValue) else [value] * len(self)

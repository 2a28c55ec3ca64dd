"""The jobs of a block: every combination of its factors' values, checked in columns.

Numbers by the column: one for each job of a sweep, so that one call works on all jobs. A `Column`
stands where a case has a number. What is written for one case, such as a rule of `conflicts`, then
works on all at once, by numpy. Where a condition holds for some jobs alone, it raises `Mixed`, and
the jobs are cut in two (`places_where`).

What a case fills in, the rules of `conflicts` and the text that a key is the hash of are the same
code for one job and for all. A sheet says which jobs *may* not fit; whether one does, and why, is
told of it alone.
"""

import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from compressor.cases.case import Case, canonical, digest, identity, parts_of
from compressor.cases.checks import SHORTHANDS, single, stands_for, value_of
from compressor.cases.conflicts import IN_PLACE_OF, RULES
from compressor.cases.keys import Leaves, covers, nest_values
from compressor.cases.swept import Test
from compressor.cases.table import OF_JOINTS, outside_identity, table
from compressor.cases.yaml_reader import Node

if TYPE_CHECKING:
    import numpy as np

Axis = tuple[Sequence[Any], np.ndarray]  # a key's values, and which of them each job has, (jobs,)


class Mixed(Exception):
    """A condition that holds for some jobs alone; `holds`: for which, boolean, (jobs,)."""

    def __init__(self, holds: np.ndarray):
        super().__init__("a condition holds for some jobs alone")
        self.holds = holds


def _numbers(value: Any) -> Any:
    return value.numbers if isinstance(value, Column) else value


def _by(operation: Callable[[Any, Any], Any]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return the operator and its reflection; what is neither a number nor a column is left to
    Python.
    """

    def direct(self: "Column", other: Any) -> Any:
        if not isinstance(other, Column | int | float | complex):
            return NotImplemented
        return Column(operation(self.numbers, _numbers(other)))

    def reflected(self: "Column", other: Any) -> Any:
        if not isinstance(other, int | float | complex):
            return NotImplemented
        return Column(operation(other, self.numbers))

    return direct, reflected


def _power(base: Any, exponent: Any) -> np.ndarray:
    """Return the powers as Python takes them: numpy's may differ in the last bit."""
    bases, exponents = np.broadcast_arrays(base, exponent)
    return np.array(list(map(pow, bases.tolist(), exponents.tolist())))


class Column:
    """The numbers of some jobs, (jobs,), which calculate and compare as one number does.

    A comparison gives a column of truths; its own truth is theirs where all are equal, and raises
    Mixed where they are not. What no column can do raises TypeError.
    """

    __slots__ = ("numbers",)
    __array_ufunc__ = None
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, numbers: np.ndarray):
        self.numbers = numbers

    def __bool__(self) -> bool:
        holds = self.numbers != 0
        if holds.all():
            return True
        if not holds.any():
            return False
        raise Mixed(holds)

    def __round__(self) -> "Column":
        return Column(np.rint(self.numbers).astype(np.int64))

    def __abs__(self) -> "Column":
        return Column(np.abs(self.numbers))

    __add__, __radd__ = _by(operator.add)
    __sub__, __rsub__ = _by(operator.sub)
    __mul__, __rmul__ = _by(operator.mul)
    __truediv__, __rtruediv__ = _by(operator.truediv)
    __pow__, __rpow__ = _by(_power)
    __lt__, __le__ = _by(operator.lt)[0], _by(operator.le)[0]
    __gt__, __ge__ = _by(operator.gt)[0], _by(operator.ge)[0]
    __eq__, __ne__ = _by(operator.eq)[0], _by(operator.ne)[0]


def places_where(test: Callable[[np.ndarray], bool], count: int) -> np.ndarray:
    """For which of `count` jobs a test holds, boolean, (count,).

    test: of the jobs at some places at once; it may raise Mixed, and is then asked of both parts.
    A division by zero, an overflow and the like raise FloatingPointError.
    """
    found = np.zeros(count, dtype=bool)
    left = [np.arange(count)]
    with np.errstate(divide="raise", over="raise", invalid="raise"):
        while left:
            places = left.pop()
            try:
                found[places] = test(places)
            except Mixed as cut:
                left += [places[cut.holds], places[~cut.holds]]
    return found


def alike(axes: Iterable[Axis], count: int) -> list[np.ndarray]:
    """Return the places of `count` jobs, for each combination of what is no number."""
    codes = np.zeros(count, dtype=np.int64)
    for values, which in axes:
        if not is_numeric(values):
            kinds: dict[tuple[type, str], int] = {}
            code = [kinds.setdefault((type(v), repr(v)), len(kinds)) for v in values]
            _, codes = np.unique(codes * len(kinds) + np.array(code)[which], return_inverse=True)
    order = np.argsort(codes, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(codes[order])) + 1)


def is_numeric(values: Sequence[Any]) -> bool:
    """Return whether all values are floats, so that a column can hold them."""
    return all(type(value) is float for value in values)


RIVALS = dict(IN_PLACE_OF) | {other: one for one, other in IN_PLACE_OF}
Row = tuple[Node, ...]


class Alike(NamedTuple):
    """Jobs of a block that differ in numbers alone: `places` among its jobs, (m,).

    chosen: the values of the first by dotted key; columns: those that differ, of all.
    """

    places: "np.ndarray"
    chosen: dict[str, Node]
    columns: "dict[str, Column]"

    def some(self, places: "np.ndarray") -> dict[str, Node]:
        """Return the values of some of them by dotted key, columns where they may differ."""

        some = {key: Column(column.numbers[places]) for key, column in self.columns.items()}
        return self.chosen | {key: replace(self.chosen[key], value=c) for key, c in some.items()}


@dataclass(frozen=True)
class Block:
    """The combinations of a block; `kept` holds the numbers, in C order, of those not excluded."""

    leaves: Leaves
    fixed: dict[str, Node]
    factors: tuple[tuple[tuple[str, ...], list[Row]], ...]  # keys, and their values together
    kept: Sequence[int]
    is_grid: bool  # whether every key is an axis of its own, and no combination is left out

    def chosen(self, number: int) -> dict[str, Node]:
        """Return the values of one combination by dotted key."""
        found = dict(self.fixed)
        for keys, rows in reversed(self.factors):
            number, place = divmod(number, len(rows))
            found.update(zip(keys, rows[place], strict=True))
        if "joint" in self.swept and found["joint"].value == "none":
            gone = [key for key in found if any(covers(group, key) for group in OF_JOINTS)]
            for key in gone:
                del found[key]
        return found

    @property
    def swept(self) -> list[str]:
        """The keys of all factors."""
        return [key for keys, _ in self.factors for key in keys]

    def alike(self) -> list[Alike]:
        """Return all jobs, those together that differ in numbers alone."""
        import numpy as np

        if not len(self.kept):
            return []
        left, axes = np.fromiter(self.kept, np.int64, len(self.kept)), {}
        for keys, rows in reversed(self.factors):
            left, which = np.divmod(left, len(rows))
            for key, nodes in zip(keys, zip(*rows, strict=True), strict=True):
                axes[key] = [node.value for node in nodes], which
        numeric = {key: np.array(axis[0]) for key, axis in axes.items() if is_numeric(axis[0])}
        found = []
        for places in alike(axes.values(), len(self.kept)):
            chosen = self.chosen(self.kept[int(places[0])])
            columns = {
                key: Column(values[axes[key][1][places]])
                for key, values in numeric.items()
                if key in chosen
            }
            found.append(Alike(places, chosen, columns))
        return found

    def where(self, test: Test) -> "np.ndarray":
        """For which jobs a comparison holds, boolean, (jobs,)."""
        import numpy as np

        found = np.zeros(len(self.kept), dtype=bool)
        for part in self.alike():

            def holds(places: np.ndarray, part: Alike = part) -> bool:
                return test(reader(part.some(places)))

            try:
                found[part.places] = places_where(holds, len(part.places))
            except TypeError:  # of what is no column's to do, such as the one value of two keys
                numbers = (self.kept[place] for place in part.places.tolist())
                found[part.places] = [test(reader(self.chosen(number))) for number in numbers]
        return found


def reader(chosen: Mapping[str, Node]) -> Callable[[str], Any]:
    """Return the function that gives a combination's value of a key, or its default, or None."""

    def value(key: str) -> Any:
        group = key.partition(".")[0]
        if key in chosen:
            return chosen[key].value
        if parts := stands_for(key):
            return single(chosen[part].value for part in parts if part in chosen)
        if RIVALS.get(key) in chosen or (key != group and group in chosen):
            return chosen[group].value if key in stands_for(group) else None
        return table()[key].default

    return value


def columns(blocks: Sequence[Block]) -> list[str]:
    """Return the keys by which the jobs of blocks differ: swept in one, or not the same in all."""
    found = dict.fromkeys(key for block in blocks for key in block.swept)
    fixed = dict.fromkeys(key for block in blocks for key in block.fixed)
    for key in [key for key in fixed if key not in outside_identity()]:
        if len({block.fixed[key].value if key in block.fixed else None for block in blocks}) > 1:
            found[key] = None
    return list(found)


HELD = re.compile(r'"@(\d+)"')  # where a column stands in a text


@dataclass(frozen=True)
class Sheet:
    """Some jobs of a study: `numbers` among them, (m,), and their case, with the keys given.

    The case has a `Column` wherever they may differ.
    """

    numbers: np.ndarray
    case: Case
    given: frozenset[str]

    @classmethod
    def of(cls, name: str, jobs: Alike, before: int) -> "Sheet":
        """Return the sheet of jobs of a block, `before` which the study has others; `name`: the
        study's.

        Raises CaseError where values do not fit that all jobs share.
        """
        parts, given = parts_of(nest_values(jobs.chosen) | {"name": name})
        changes: dict[str, dict[str, Column]] = {}
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
    def _columns(self) -> list[tuple[str, dict[str, Column]]]:
        """The columns of each group that has some."""
        found = []
        for item in fields(Case):
            inner = getattr(vars(self.case)[item.name], "__dict__", {})
            columns = {key: value for key, value in inner.items() if isinstance(value, Column)}
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
                some = self._picked(lambda numbers: Column(numbers[places]))
                return any(True for _ in rule(some, self.given))

            try:
                found |= places_where(speaks, len(self))
            except (ArithmeticError, TypeError, ValueError):  # of what is no column's to do
                found[:] = True
        return found

    def has(self, condition: Callable[[Case], Any]) -> bool:
        """Return whether a condition holds for any of the jobs."""

        def holds(places: np.ndarray) -> bool:
            return bool(condition(self._picked(lambda numbers: Column(numbers[places]))))

        return bool(places_where(holds, len(self)).any())

    def keys(self) -> list[str]:
        """Return the keys of the jobs: of all from one text, in which the numbers change."""
        columns: list[Column] = []

        def held(value: Column) -> str:
            columns.append(value)
            return f"@{len(columns) - 1}"

        try:
            with np.errstate(divide="raise", over="raise", invalid="raise"):
                text = canonical(identity(self.case, with_solver=True), held)
        except (Mixed, ArithmeticError, TypeError, ValueError):
            return [self.at(place).key for place in range(len(self))]
        if not columns:
            return [digest(text)] * len(self)
        pieces = HELD.split(text)
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
        return value.numbers.tolist() if isinstance(value, Column) else [value] * len(self)

"""The jobs of a block: every combination of its factors' values, but for those left out."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

from compressor.cases.case import Case, plain_values
from compressor.cases.checks import single, stands_for, values_given
from compressor.cases.conflicts import FILLED_IN, FILLING, IN_PLACE_OF
from compressor.cases.keys import Leaves, covers, nest_values
from compressor.cases.swept import Test
from compressor.cases.table import GROUPS, OF_JOINTS, outside_identity, table
from compressor.cases.yaml_reader import Node

RIVALS = dict(IN_PLACE_OF) | {other: one for one, other in IN_PLACE_OF}
MAX_PARTS = 4096  # groups of cases that a block holds at a time
Row = tuple[Node, ...]


@dataclass(frozen=True)
class Block:
    """The combinations of a block; name: of the study."""

    name: str
    leaves: Leaves
    fixed: dict[str, Node]
    factors: tuple[tuple[tuple[str, ...], list[Row]], ...]  # keys, and their values together
    numbers: Sequence[int]  # of the combinations that are not excluded, in C order
    is_grid: bool  # whether every key is an axis of its own, and no combination is left out

    def places(self, number: int) -> list[int]:
        """Return which of its rows each factor has in one combination."""
        found = []
        for _, rows in reversed(self.factors):
            number, place = divmod(number, len(rows))
            found.append(place)
        return found[::-1]

    def chosen(self, number: int) -> dict[str, Node]:
        """Return the values of one combination by dotted key."""
        found = dict(self.fixed)
        for (keys, rows), place in zip(self.factors, self.places(number), strict=True):
            found.update(zip(keys, rows[place], strict=True))
        if "joint" in self.swept and found["joint"].value == "none":
            gone = [key for key in found if any(covers(group, key) for group in OF_JOINTS)]
            for key in gone:
                del found[key]
        return found

    @cached_property
    def swept(self) -> list[str]:
        """Return the keys of all factors."""
        return [key for keys, _ in self.factors for key in keys]

    def case(self, number: int) -> Case:
        """Return the case of one combination; whether its values fit each other is not checked.

        Cases share the groups that are equal, so that one takes some microseconds.
        """
        places = self.places(number)
        parts = dict(self._shared_fields)
        for part, sources in self._sources.items():
            parts[part] = self._part(part, *[places[factor] for factor, _, _ in sources])
        return Case(**parts)

    def resolve_case(self, chosen: Mapping[str, Node]) -> Case:
        """Return the case of some values. Raises CaseError where they do not fit each other."""
        return Case.resolve(nest_values(chosen) | {"name": self.name})

    @cached_property
    def given(self) -> frozenset[str]:
        """Return the dotted keys that a case is given."""
        return frozenset(values_given(self._first))

    @cached_property
    def _first(self) -> dict[str, Any]:
        """Return the nested values of a case with the first value of each factor."""
        first = dict(self.fixed)
        for keys, rows in self.factors:
            first |= zip(keys, rows[0], strict=True)
        return plain_values(nest_values(first) | {"name": self.name}, [])

    @cached_property
    def _sources(self) -> dict[str, list[tuple[int, int, str]]]:
        """Return what sweeps each field of a case: (factor, place in its rows, key) a key."""
        found: dict[str, list[tuple[int, int, str]]] = {}
        for factor, (keys, _) in enumerate(self.factors):
            for place, key in enumerate(keys):
                for part in stands_for(key) or (key,):
                    found.setdefault(part.partition(".")[0], []).append((factor, place, part))
        return found

    @cached_property
    def _deciders(self) -> dict[str, set[int]]:
        """Return the factors that decide a key, by key; of keys and groups that differ at all."""
        swept: dict[str, set[int]] = {}
        for sources in self._sources.values():
            for factor, _, key in sources:
                swept.setdefault(key, set()).add(factor)
        found = {key: set(factors) for key, factors in swept.items()}
        for key, factors in swept.items():
            group = key.partition(".")[0]
            together = [one for one in table() if group in FILLING and covers(group, one)]
            filled = [one for one, by in FILLED_IN.items() if any(covers(key, b) for b in by)]
            for other in (*together, *filled):
                found.setdefault(other, set()).update(factors)
        return found

    def factors_of(self, keys: Iterable[str]) -> tuple[int, ...]:
        """Return the factors that decide any of some keys."""
        return tuple(sorted({f for key in keys for f in self._deciders.get(key, ())}))

    def factors_within(self, names: Iterable[str]) -> tuple[int, ...]:
        """Return the factors that decide anything of some groups or keys."""
        return self.factors_of(
            key
            for key in self._deciders
            for name in names
            if covers(name, key) or covers(key, name)
        )

    @cached_property
    def _shared_fields(self) -> dict[str, Any]:
        """Return the fields that are the same in all cases."""
        same = self._first.keys() - self._sources.keys()
        return {name: _field(name, self._first[name]) for name in same}

    @cached_property
    def _part(self) -> Callable[..., Any]:
        """Return the function that gives a field of a case by the rows of its sources."""

        def part(name: str, *rows: int) -> Any:
            chosen = {
                key: self.factors[factor][1][row][place]
                for (factor, place, key), row in zip(self._sources[name], rows, strict=True)
            }
            value = nest_values(chosen)[name]
            if isinstance(value, dict):
                value = {**self._first[name], **value}
            return _field(name, value)

        return lru_cache(MAX_PARTS)(part)

    def rows_of(self, number: int, part: str) -> tuple[int, ...]:
        """Return the rows of factors by which combinations differ in a field of a case."""
        places = self.places(number)
        return tuple(places[factor] for factor in self.factors_within([part]))

    def where(self, test: Test) -> list[bool]:
        """Return whether a comparison holds, of each job."""
        return [test(reader(self.chosen(number))) for number in self.numbers]


def _field(name: str, value: Any) -> Any:
    """Return the field of a case from a checked value: of a group, its mapping or its word."""
    if isinstance(value, dict):
        return GROUPS[name](**value)
    return GROUPS[name]() if name in GROUPS and value else value or None


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

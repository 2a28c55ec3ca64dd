"""The jobs of a block: every combination of its factors' values, but for those left out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from compressor.cases.case import Case
from compressor.cases.checks import single, stands_for
from compressor.cases.comparison import Test
from compressor.cases.conflicts import IN_PLACE_OF
from compressor.cases.keys import Leaves, covers, nest_values
from compressor.cases.table import OF_JOINTS, outside_identity, table
from compressor.cases.yaml_reader import Node

RIVALS = dict(IN_PLACE_OF) | {other: one for one, other in IN_PLACE_OF}
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
        """Return the case of one combination. Raises CaseError where its values do not fit."""
        return self.resolve_case(self.chosen(number))

    def resolve_case(self, chosen: Mapping[str, Node]) -> Case:
        """Return the case of some values. Raises CaseError where they do not fit each other."""
        return Case.resolve(nest_values(chosen) | {"name": self.name})

    def solver_of(self, number: int) -> tuple[int, ...]:
        """Return the places of the factors by which cases differ in `solve` or `output`."""
        pairs = zip(self.factors, self.places(number), strict=True)
        groups = ("solve", "output")
        return tuple(place for (keys, _), place in pairs if any(k.startswith(groups) for k in keys))

    def where(self, test: Test) -> list[bool]:
        """Return whether a comparison holds, of each job."""
        return [test(reader(self.chosen(number))) for number in self.numbers]


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

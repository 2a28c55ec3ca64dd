"""The jobs of a block: every combination of its factors' values, but for those left out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from compressor.cases.checks import single, stands_for
from compressor.cases.conflicts import IN_PLACE_OF
from compressor.cases.keys import Leaves, covers
from compressor.cases.swept import Test
from compressor.cases.table import OF_JOINTS, outside_identity, table
from compressor.cases.yaml_reader import Node

if TYPE_CHECKING:
    import numpy as np

    from compressor.cases.columns import ArrayValue

RIVALS = dict(IN_PLACE_OF) | {other: one for one, other in IN_PLACE_OF}
Row = tuple[Node, ...]


class Alike(NamedTuple):
    """Jobs of a block that differ in numbers alone: `places` among its jobs, (m,).

    chosen: the values of the first by dotted key; columns: those that differ, of all.
    """

    places: "np.ndarray"
    chosen: dict[str, Node]
    columns: "dict[str, ArrayValue]"

    def some(self, places: "np.ndarray") -> dict[str, Node]:
        """Return the values of some of them by dotted key, columns where they may differ."""
        from compressor.cases.columns import ArrayValue

        some = {key: ArrayValue(column.numbers[places]) for key, column in self.columns.items()}
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

        from compressor.cases.columns import ArrayValue, alike, is_numeric

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
                key: ArrayValue(values[axes[key][1][places]])
                for key, values in numeric.items()
                if key in chosen
            }
            found.append(Alike(places, chosen, columns))
        return found

    def where(self, test: Test) -> "np.ndarray":
        """For which jobs a comparison holds, boolean, (jobs,)."""
        import numpy as np

        from compressor.cases.columns import places_where

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

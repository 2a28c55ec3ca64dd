"""A study: the jobs of one case file, each built when it is asked for."""

import bisect
import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, overload

from compressor.cases import blocks
from compressor.cases.case import Case
from compressor.cases.conditions import Test
from compressor.cases.regimes import Regimes
from compressor.cases.yaml_reader import Node

TOLD_EVERY = 1000  # cases between two words on progress


@dataclass(frozen=True)
class Axis:
    """One swept key of a study, such as `machine.rod_mass_kg`, and its values.

    `spread`: where a design drew it, the function that takes shares of its range, 0 to 1, to
    values.
    """

    key: str
    values: tuple[Any, ...]
    spread: Callable[[float], float] | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Study:
    """One case file. In a grid, jobs are in C order over the axes, in the file's order.

    Otherwise every axis is a column, with a value for each job, None where the job has none.
    `fixed` has the values that are not swept, group by group as each block of the file gives them.
    With `regimes` the jobs are those that chains begin at, and `chains` has the cases of each, in
    the order of the jobs, by the values of the key that is followed.
    """

    name: str
    path: str
    axes: tuple[Axis, ...]
    cases: Sequence[Case]
    keys: tuple[str, ...] = ()  # of the cases
    is_grid: bool = True
    selected: Sequence[int] = ()  # numbers of the jobs to be run now
    regimes: Regimes | None = None
    chains: tuple[tuple[Case, ...], ...] = ()
    fixed: tuple[Mapping[str, Any], ...] = ()

    @property
    def jobs(self) -> int:
        return len(self.keys)

    def shard(self, number: int, of: int) -> "Study":
        """The study with the jobs of one shard selected, 1 <= number <= of.

        A job's key says which shard it belongs to, so that any number of machines agree without
        asking each other, and studies that share a job put it in the same one.
        """
        mine = [n for n in self.selected if int(self.keys[n], 16) % of == number - 1]
        return replace(self, selected=mine)


class Cases(Sequence[Case]):
    """The cases of blocks one after the other, each built when it is asked for."""

    def __init__(self, name: str, parts: Sequence[blocks.Block]):
        self.name, self.parts = name, parts
        self.ends = list(itertools.accumulate(len(part.kept) for part in parts))

    def __len__(self) -> int:
        return self.ends[-1] if self.ends else 0

    @overload
    def __getitem__(self, index: int) -> Case: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Case, ...]: ...
    def __getitem__(self, index: int | slice) -> Case | tuple[Case, ...]:
        if isinstance(index, slice):
            return tuple(self[n] for n in range(len(self))[index])
        number = range(len(self))[index]
        at = bisect.bisect_right(self.ends, number)
        part = self.parts[at]
        return self.case(part.chosen(part.kept[number - self.ends[at] + len(part.kept)]))

    def case(self, chosen: Mapping[str, Node]) -> Case:
        """The case of one combination. Raises CaseError where its values do not fit."""
        return Case.from_values(nested(chosen) | {"name": self.name})

    def combinations(self) -> Iterator[tuple[blocks.Block, dict[str, Node]]]:
        """The values of every case by dotted key, and the block that they are of."""
        for part in self.parts:
            for number in part.kept:
                yield part, part.chosen(number)

    def counted(
        self, told: Callable[[str, int, int], object]
    ) -> Iterator[tuple[blocks.Block, dict[str, Node]]]:
        """`combinations`; now and then `told` hears how many of how many have been given."""
        for number, one in enumerate(self.combinations()):
            if number % TOLD_EVERY == 0:
                told(self.name, number, len(self))
            yield one
        told(self.name, len(self), len(self))

    def where(self, test: Test) -> list[int]:
        """The numbers of the cases for which a comparison holds."""
        every = enumerate(self.combinations())
        return [n for n, (_, chosen) in every if test(blocks.reader(chosen))]


def nested(chosen: Mapping[str, Node]) -> dict[str, Any]:
    """Values by dotted key as a case file has them, group by group."""
    values: dict[str, Any] = {}
    for key, node in chosen.items():
        group, _, name = key.rpartition(".")
        value = node.value
        if key == "solve.accuracy" and isinstance(value, tuple):
            value = dict(value)  # as a case file has it
        (values.setdefault(group, {}) if group else values)[name] = value
    return values


class Jobs(Protocol):
    """What a study tells of its jobs, whether read from a case file or from a store."""

    @property
    def axes(self) -> Sequence[Any]: ...
    @property
    def is_grid(self) -> bool: ...
    @property
    def jobs(self) -> int: ...


def points(study: Jobs) -> Iterator[dict[str, Any]]:
    """The swept values that each job has, by dotted key, in the order of the jobs.

    What is swept in other blocks only is left out.
    """
    keys = [axis.key for axis in study.axes]
    columns = [axis.values for axis in study.axes]
    rows: Iterable[tuple[Any, ...]]
    if study.is_grid:
        rows = itertools.product(*columns)
    else:
        rows = (tuple(column[n] for column in columns) for n in range(study.jobs))
    for values in rows:
        yield {key: value for key, value in zip(keys, values, strict=True) if value is not None}

"""A study: the jobs of one case file, each built when it is used."""

import itertools
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, overload

from compressor.cases.blocks import Block
from compressor.cases.case import Case


@dataclass(frozen=True)
class Axis:
    """One swept key of a study, such as `machine.rod_mass_kg`, and its values."""

    key: str
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Study:
    """One case file. In a grid, jobs are in C order over the axes, in the file's order.

    Otherwise every axis is a column, with a value for each job, None where the job has none.
    `title` and `notes` are what the page of the report says of the machine, "" without; `figures`:
    whose figures it draws of it, `paper` for the paper's.
    `fixed` has the values that are not swept, group by group as each block of the file gives them.
    """

    name: str
    path: str
    axes: tuple[Axis, ...]
    cases: Sequence[Case]
    keys: tuple[str, ...] = ()  # of the cases
    is_grid: bool = True
    selected: Sequence[int] = ()  # numbers of the jobs to be run now
    fixed: tuple[Mapping[str, Any], ...] = ()
    title: str = ""
    notes: str = ""
    figures: str = ""

    @property
    def jobs(self) -> int:
        return len(self.keys)

    def given(self, number: int) -> dict[str, Any]:
        """Return what the file gives of a job, nested as a case file has it."""
        assert isinstance(self.cases, Cases)
        block, place = self.cases.place_of(number)
        return {**block.given_of(place), "name": block.name}

    @property
    def is_of_one_solver(self) -> bool:
        """Return whether all jobs are known to have equal groups `solve` and `output`."""
        of_blocks = {repr((one.get("solve"), one.get("output"))) for one in self.fixed}
        is_swept = any(axis.key.startswith(("solve.", "output.")) for axis in self.axes)
        return len(of_blocks) == 1 and not is_swept

    def shard(self, number: int, of: int) -> "Study":
        """Return the study with the jobs of one shard selected, 1 <= number <= of.

        A job's key says which shard it belongs to, so that any number of machines agree without
        asking each other, and studies that share a job put it in the same one.
        """
        mine = [n for n in self.selected if int(self.keys[n], 16) % of == number - 1]
        return replace(self, selected=mine)


class Cases(Sequence[Case]):
    """The cases of blocks one after the other, each built when it is used.

    `keys`: of all of them, as soon as they are known.
    """

    def __init__(self, blocks: Sequence[Block]):
        self.blocks = blocks
        self.ends = [*itertools.accumulate(len(block.numbers) for block in blocks)]
        self.keys: Sequence[str] = ()

    def __len__(self) -> int:
        return self.ends[-1]

    def place_of(self, index: int) -> tuple[Block, int]:
        """Return the block of a case, and the number of its combination there."""
        at = bisect_right(self.ends, index)
        return self.blocks[at], self.blocks[at].numbers[index - self.ends[at]]

    def places(self) -> Iterator[tuple[Block, int]]:
        """Yield the block and the number in it of each case."""
        return ((block, number) for block in self.blocks for number in block.numbers)

    @overload
    def __getitem__(self, index: int) -> Case: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Case, ...]: ...
    def __getitem__(self, index: int | slice) -> Case | tuple[Case, ...]:
        numbers = range(len(self))[index]
        if isinstance(numbers, range):
            return tuple(self[number] for number in numbers)
        block, place = self.place_of(numbers)
        case = block.case(place)
        if self.keys:
            vars(case)["key"] = self.keys[numbers]
        return case


def points(study: Any) -> Iterator[dict[str, Any]]:
    """Yield the swept values that each job has, by dotted key, in the order of the jobs.

    What is swept in other blocks only is left out. study: of a file, or of a store.
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

"""A study: the jobs of one case file, each built when it is asked for."""

import bisect
import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, overload

from compressor.cases.case import Case
from compressor.cases.combinations import Block
from compressor.cases.keys import nest_values
from compressor.cases.parameter import CaseError
from compressor.cases.regimes import Regimes
from compressor.cases.swept import Test
from compressor.cases.yaml_reader import Node
from compressor.program import Progress, no_progress

if TYPE_CHECKING:
    import numpy as np

    from compressor.cases.sheet import CaseBatch

MANY_CASES = 20_000  # cases of a study that take seconds to be read


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

    def sheet_of(self, number: int) -> int:
        """Return a number that jobs share only if their cases differ in nothing but swept
        numbers.
        """
        return self.cases.sheet_of(number) if isinstance(self.cases, Cases) else number

    def shard(self, number: int, of: int) -> "Study":
        """Return the study with the jobs of one shard selected, 1 <= number <= of.

        A job's key says which shard it belongs to, so that any number of machines agree without
        asking each other, and studies that share a job put it in the same one.
        """
        mine = [n for n in self.selected if int(self.keys[n], 16) % of == number - 1]
        return replace(self, selected=mine)


class Cases(Sequence[Case]):
    """The cases of blocks one after the other, each built when it is asked for.

    Jobs that differ in numbers alone are one `CaseBatch`, which is made and checked at once.
    """

    def __init__(self, name: str, parts: Sequence[Block]):
        self.name, self.parts = name, parts
        self.ends = list(itertools.accumulate(len(part.kept) for part in parts))
        self._keys: list[str] = []

    def __len__(self) -> int:
        return self.ends[-1] if self.ends else 0

    @overload
    def __getitem__(self, index: int) -> Case: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Case, ...]: ...
    def __getitem__(self, index: int | slice) -> Case | tuple[Case, ...]:
        numbers = range(len(self))[index]
        if isinstance(numbers, range):
            return tuple(self[number] for number in numbers)
        sheet, place = self._places
        made = self.sheets[sheet[numbers]].at(int(place[numbers]))
        if self._keys:
            vars(made)["key"] = self._keys[numbers]  # which would take longer than the case
        return made

    @cached_property
    def sheets(self) -> "list[CaseBatch]":
        """All cases. Raises CaseError where fixed values of a block do not fit."""
        from compressor.cases.sheet import CaseBatch

        found, before = [], 0
        for part in self.parts:
            found += [CaseBatch.of(self.name, jobs, before) for jobs in part.alike()]
            before += len(part.kept)
        return found

    def sheet_of(self, number: int) -> int:
        """Return the number of a case's sheet."""
        return self._sheet_of[number]

    @cached_property
    def _sheet_of(self) -> list[int]:
        return self._places[0].tolist()

    @cached_property
    def _places(self) -> "tuple[np.ndarray, np.ndarray]":
        """Of each case its sheet, and its place there, both (cases,)."""
        import numpy as np

        sheet, place = np.zeros((2, len(self)), dtype=np.int64)
        for number, one in enumerate(self.sheets):
            sheet[one.numbers] = number
            place[one.numbers] = np.arange(len(one.numbers))
        return sheet, place

    def block_of(self, number: int) -> Block:
        """Return the block that a case is of."""
        return self.parts[bisect.bisect_right(self.ends, number)]

    def keys(self, progress: Progress = no_progress) -> list[str]:
        """Return the key of each case; `progress` is told how many of many are made."""
        if not self._keys:
            self._keys = self._each(lambda sheet: sheet.keys(), progress)
        return self._keys

    def values(self, key: str) -> list[Any]:
        """Return the value of a dotted key in each case, as `value_of` gives it."""
        return self._each(lambda sheet: sheet.values(key))

    def _each(
        self, of: "Callable[[CaseBatch], Sequence[Any]]", progress: Progress = no_progress
    ) -> list[Any]:
        """Return what a function gives for the jobs of each sheet, of all cases in their order."""
        found: list[Any] = [None] * len(self)
        done, total = 0, len(self)
        progress = progress if total >= MANY_CASES else no_progress
        for sheet in self.sheets:
            progress(done, total, "" if done else f"{self.name}: {total} jobs")
            for number, one in zip(sheet.numbers.tolist(), of(sheet), strict=True):
                found[number] = one
            done += len(sheet.numbers)
        progress(done, total, "")
        return found

    def doubtful(self) -> Iterator[tuple[Block, dict[str, Node]]]:
        """Yield the combinations in which a rule may find values that do not fit each other, in
        order.
        """
        try:
            sheets = self.sheets
        except CaseError:  # told of each combination
            yield from self.combinations()
            return
        numbers = (sheet.numbers[sheet.doubtful()] for sheet in sheets)
        for number in sorted(itertools.chain.from_iterable(one.tolist() for one in numbers)):
            part = self.block_of(number)
            before = self.ends[bisect.bisect_right(self.ends, number)] - len(part.kept)
            yield part, part.chosen(part.kept[number - before])

    def case(self, chosen: Mapping[str, Node]) -> Case:
        """Return the case of one combination. Raises CaseError where its values do not fit."""
        return Case.resolve(nest_values(chosen) | {"name": self.name})

    def combinations(self) -> Iterator[tuple[Block, dict[str, Node]]]:
        """Yield the values of every case by dotted key, and the block that they are of."""
        for part in self.parts:
            for number in part.kept:
                yield part, part.chosen(number)

    def where(self, test: Test) -> list[int]:
        """Return the numbers of the cases for which a comparison holds."""
        holds = itertools.chain.from_iterable(part.where(test).tolist() for part in self.parts)
        return [number for number, held in enumerate(holds) if held]


class StudyJobs(Protocol):
    """What a study tells of its jobs, whether read from a case file or from a store."""

    @property
    def axes(self) -> Sequence[Any]: ...
    @property
    def is_grid(self) -> bool: ...
    @property
    def jobs(self) -> int: ...


def points(study: StudyJobs) -> Iterator[dict[str, Any]]:
    """Yield the swept values that each job has, by dotted key, in the order of the jobs.

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

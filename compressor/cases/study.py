"""A study: the jobs of one case file, by blocks of fixed values and of swept ones that multiply.

A factor is one key, or several whose values advance together: a `zip` group, or the keys of a
sampling design. How many there are is known before any value is made; values are made when they
are first asked for, and so is each job's case.
"""

import contextlib
import itertools
import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Any

from compressor.cases.card import CardError, mark_card
from compressor.cases.case import Case
from compressor.cases.checks import (
    DOUBLES,
    expand_synonyms,
    hold_value,
    key_of,
    no_mapping,
    row_of,
    stands_for,
    suggestion,
    value_of,
    walk_leaves,
)
from compressor.cases.comparison import NoComparison, Test, comparison
from compressor.cases.keys import drop, path_of, put
from compressor.cases.parameter import CaseError, integer, make_group, quote_value
from compressor.cases.swept import FORMS, NoSweep, Sweep, design, design_size, sweep_of
from compressor.cases.table import outside_identity
from compressor.cases.yaml_reader import Place, Problem, Tree

Factors = list[tuple[str, ...]]  # keys that advance together
Located = dict[tuple[Place, str], Problem]  # by the place and the key that a problem is about


@dataclass(frozen=True)
class Block:
    """The jobs of a block: every combination of its factors' values, but for those left out.

    name: of the study. `given` has what is given by dotted key, `fixed` what is not swept of it,
    nested, and `sweeps` how the rest is, with the `sample` of a design.
    """

    name: str
    tree: Tree
    given: dict[str, Any]
    fixed: dict[str, Any]
    sweeps: dict[str, Sweep]
    factors: Factors
    sample: "Sample"
    exclusions: list[Test]

    @property
    def is_grid(self) -> bool:
        """Return whether every key is an axis of its own, and no combination is left out."""
        drawn = any(sweep.is_drawn for sweep in self.sweeps.values())
        return not (self.exclusions or drawn or any(len(keys) > 1 for keys in self.factors))

    def size(self, keys: tuple[str, ...]) -> int:
        """Return how many values keys that advance together have."""
        sweep = self.sweeps[keys[0]]
        return sweep.count or design_size(sweep.kind, self.sample.n or 0, len(keys))

    @property
    def combinations(self) -> int:
        """Return how many jobs there are with those that are left out."""
        return math.prod(map(self.size, self.factors))

    @cached_property
    def columns(self) -> dict[str, list[Any]]:
        """Return the values of each swept key."""
        found: dict[str, list[Any]] = {}
        for keys in self.factors:
            made = [self.sweeps[key].make() for key in keys]
            sweep, count = self.sweeps[keys[0]], self.sample.n
            if sweep.is_drawn and count:
                points = design(sweep.kind, count, len(keys), self.sample.seed)
                made = [
                    [*map(self.sweeps[key].spread, own.tolist())]
                    for key, own in zip(keys, points.T, strict=True)
                ]
            for key, column in zip(keys, made, strict=True):
                is_own = self.sweeps[key].path == path_of(key)
                found[key] = [hold_value(key, value) if is_own else value for value in column]
        return found

    @cached_property
    def cards(self) -> dict[str, dict[str, str]]:
        """Return the cards that are given, by key and path, each with the digest of its numbers.

        A job's key has the digest of when it was planned. Were a card read again where its case is
        made for a run, a file that has changed would be computed under the key of the old one.
        """
        given = {key: self.columns.get(key, [one]) for key, one in self.given.items()}
        return {
            key: {card: mark_path(key, card) for card in cards if isinstance(card, str)}
            for key, cards in given.items()
            if (row := row_of(key)) and row.kind == "card"
        }

    @property
    def numbers(self) -> Sequence[int]:
        """Return the numbers of the combinations that are not excluded, in C order."""
        return self.left_and_idle[0]

    @cached_property
    def left_and_idle(self) -> tuple[Sequence[int], set[int]]:
        """Return `numbers`, and which of the exclusions leave nothing out."""
        every = range(math.prod(len(self.columns[keys[0]]) for keys in self.factors))
        idle = {*range(len(self.exclusions))}
        if not idle:
            return every, idle
        left = []
        for number in every:
            job = reader(self.given_of(number), cache(partial(self._case_if_any, number)))
            holding = {n for n, test in enumerate(self.exclusions) if test(job)}
            idle -= holding
            left += [] if holding else [number]
        return left, idle

    def rows_of(self, number: int) -> dict[str, int]:
        """Return which of its values each swept key has in one combination."""
        found: dict[str, int] = {}
        for keys in reversed(self.factors):
            number, row = divmod(number, len(self.columns[keys[0]]))
            found |= dict.fromkeys(keys, row)
        return found

    def values_at(self, rows: Mapping[str, int]) -> dict[str, Any]:
        """Return nested values, as a case file has them, with these of the swept keys."""
        values = self.fixed
        for key, row in rows.items():
            values = put(values, self.sweeps[key].path, self.columns[key][row])
        return values

    def values_of(self, number: int) -> dict[str, Any]:
        """Return the values of one combination, nested as a case file has them."""
        values = self.values_at(self.rows_of(number))
        if "joint" in self.sweeps and values["joint"] == "none":
            return drop(values, ("clearance_mm",))
        return values

    def given_of(self, number: int) -> dict[str, Any]:
        """Return the values of one combination without synonyms."""
        return expand_synonyms(self.values_of(number))[0]

    def case(self, number: int) -> Case:
        """Return the case of one combination. Raises CaseError where its values do not fit."""
        values = {"name": self.name or "case", **self.values_of(number)}
        for key, marked in self.cards.items():
            if isinstance(card := value_of(values, key), str):
                values = put(values, path_of(key), marked[card])
        return Case.resolve(values)

    def _case_if_any(self, number: int) -> Case | None:
        """Return the case of one combination, None where its values do not fit."""
        with contextlib.suppress(CaseError):
            return self.case(number)
        return None

    def each_value(self) -> Iterator[dict[str, int]]:
        """Yield rows of the swept keys in which each value stands once at least."""
        for number in range(max(map(len, self.columns.values()), default=1)):
            yield {key: number % len(column) for key, column in self.columns.items() if column}

    def locate(self, error: CaseError, rows: Mapping[str, int]) -> Located:
        """Return a case's problems at the values that they are about, one of each value.

        rows: of the case's swept keys.
        """
        found: Located = {}
        for problem in error.problems:
            doubles = (double for double, half in DOUBLES.items() if half == problem.key)
            key = next((one for one in doubles if path_of(one) in self.tree.places), problem.key)
            message = problem.message
            parts = [key] if (key,) in self.tree.places else key.split(".")
            above = (".".join(parts[:n]) for n in range(len(parts), 0, -1))
            swept = next((own for one in above if (own := DOUBLES.get(one, one)) in rows), "")
            if swept:
                sweep, row = self.sweeps[swept], rows[swept]
                place = self.tree.at(*sweep.path, *[row] * (sweep.kind == "list"))[1]
            else:
                is_value = tuple(parts) in self.tree.places and not is_of_key(message)
                place = self.tree.at(*parts)[is_value]
            found.setdefault((place, key), Problem(key, message, place))
        return found

    def find_repeated(self) -> Iterator[Problem]:
        """Yield the values that stand twice in the lists of keys."""
        for keys in self.factors:
            sweep = self.sweeps[keys[0]]
            if sweep.kind != "list":
                continue
            seen: set[str] = set()
            columns = (self.columns[key] for key in keys)
            for number, values in enumerate(zip(*columns, strict=True)):
                if (text := repr(values)) in seen:
                    place = self.tree.at(*sweep.path, number)[1]
                    message = f"{', '.join(map(quote_value, values))} is in the list twice"
                    yield Problem(" with ".join(keys), message, place)
                seen.add(text)


def is_of_key(message: str) -> bool:
    """Return whether a problem is about a key, and not about its value."""
    return message.startswith("unknown key")


def mark_path(key: str, path: str) -> str:
    """Return the path of a card with the digest of its numbers; as it is where it is no card."""
    with contextlib.suppress(CardError, ValueError):  # which the case's check reports
        return mark_card(path, "crank" if key.endswith(".crank") else "head")
    return path


def reader(given: Mapping[str, Any], case: Callable[[], Case | None]) -> Callable[[str], Any]:
    """Return the function that gives a job's value of a key: as given, or else as its case has it.

    given: nested values without synonyms. case: makes the job's case, and is called only for what
    is not given; None where values do not fit, for which the default stands.
    """

    def value(key: str) -> Any:
        found, row = value_of(given, key), row_of(key)
        if found is not None or not row:
            return found
        made = case()
        return value_of(made, key) if made else row.default

    return value


def plan_block(tree: Tree, name: str) -> tuple[Block, list[Problem]]:
    """Return a block whose values are yet to be made, and what is wrong with how they are swept.

    name: of the study.
    """
    given: dict[str, Any] = {}
    fixed: dict[str, Any] = {}
    sweeps: dict[str, Sweep] = {}
    names: dict[str, str] = {}  # as the file gives keys, of which one may be double another
    problems = []
    for path, value in walk_leaves(tree.values):
        key = DOUBLES.get(key_of(path), key_of(path))
        other = names.setdefault(key, key_of(path))
        if other != key_of(path) and (key in sweeps or is_swept(key, value)):
            told = f"{other} is given, too: give one of the two"
            problems.append(Problem(key_of(path), told, tree.at(*path)[0]))
        given[key] = value
        if not is_swept(key, value):
            own = hold_value(key, value) if key == key_of(path) else value
            fixed = put(fixed, path, own)
            continue
        try:
            sweeps[key] = _sweep(path, key, value)
        except NoSweep as error:
            problems.append(Problem(key, str(error), tree.at(*path, *error.path)[1]))
    sample, wrong_design = _design_of(tree, sweeps)
    groups, wrong_zip = _zip_groups(tree, sweeps, {problem.key for problem in problems})
    exclusions, wrong_tests = _exclusions(tree)
    drawn = tuple(key for key, sweep in sweeps.items() if sweep.is_drawn)
    together = {key: group for group in [drawn, *groups] for key in group}
    factors = [*dict.fromkeys(together.get(key, (key,)) for key in sweeps)]
    block = Block(name, tree, given, fixed, sweeps, factors, sample, exclusions)
    return block, [*problems, *wrong_design, *wrong_zip, *wrong_tests]


def is_swept(key: str, value: Any) -> bool:
    """Return whether a value stands for many, unlike a pair of materials or an accuracy."""
    row = row_of(key)
    if row is None:
        return False
    if isinstance(value, dict):
        return key != "solve.accuracy"
    is_pair = row.kind == "materials"
    return isinstance(value, list) and (not is_pair or any(isinstance(n, list) for n in value))


def _sweep(path: tuple[Any, ...], key: str, value: Any) -> Sweep:
    """Return how a value sweeps a key. Raises NoSweep where it cannot."""
    row, parts = row_of(key), stands_for(key)
    if key in outside_identity():
        raise NoSweep("cannot be swept: it does not change what a job computes; give one value")
    if isinstance(value, dict) and FORMS.keys() & value and not (row and row.is_number):
        raise NoSweep(f"is no number, so that {next(iter(value))} cannot sweep it: give a list")
    names = [part.rpartition(".")[2] for part in parts]
    if parts and isinstance(value, list) and any(isinstance(one, dict) for one in value):
        form = f"{{{names[0]}: [...], {names[-1]}: ...}}"
        raise NoSweep(f"a list has values of all parts alike: sweep each part, {form}")
    try:
        return sweep_of(path, value, row is not None and row.kind == "integer")
    except NoSweep as error:
        if parts and isinstance(value, dict) and not FORMS.keys() & value:
            raise NoSweep(f"{error}; its parts are {' and '.join(names)}") from None
        raise


@make_group
class Sample:
    """How many samples a file's designs draw, and from which seed; `sample`."""

    n: int | None = integer(None, "[1, 1e15]", "samples of a design")
    seed: int = integer(0, "[0, 1e18]", "seed of a design")


def _design_of(tree: Tree, sweeps: dict[str, Sweep]) -> tuple[Sample, list[Problem]]:
    """Return how many samples from which seed a block draws, and what is wrong with that."""
    drawn = [sweep for sweep in sweeps.values() if sweep.is_drawn]
    sample, problems = read_own(Sample, "sample", tree)
    for sweep in drawn:
        if sweep.kind != drawn[0].kind:
            kinds = f"{drawn[0].kind} or {sweep.kind}"
            text = f"one design draws all sampled keys: {kinds}, not both"
            problems.append(tree.problem(sweep.path, text))
    if len(drawn) == 1 and drawn[0].kind == "saltelli":
        text = "saltelli exchanges keys one by one: draw two or more, or draw this one by sobol"
        problems.append(tree.problem(drawn[0].path, text))
    if drawn and sample.n is None and not problems:
        text = "needs a number of samples: add `sample: {n: 64, seed: 1}` to the file"
        problems.append(tree.problem(drawn[0].path, text))
    return Sample() if problems else sample, problems


def read_own(of: type[Any], name: str, tree: Tree) -> tuple[Any, list[Problem]]:
    """Return a group of a file that is no part of a case, and what is wrong with it."""
    values = tree.values.get(name, {})
    if not isinstance(values, dict):
        return of(), [tree.problem((name,), no_mapping(name, values))]
    try:
        return of(**values), []
    except CaseError as error:
        return of(), [
            tree.problem((name, *path_of(one.key)), one.message, is_of_key(one.message))
            for one in error.problems
        ]


def _zip_groups(
    tree: Tree, sweeps: dict[str, Sweep], wrong: set[str]
) -> tuple[Factors, list[Problem]]:
    """Return the groups of `zip`, swept keys with equally many values, and what is wrong with them.

    wrong: keys whose sweep is wrong, which is reported already.
    """
    value = tree.values.get("zip", [])
    found: Factors = []
    problems = []
    for number, keys in enumerate(value if isinstance(value, list) else [value]):
        message = _tell_zip(sweeps, keys, [key for group in found for key in group])
        if not message:
            found.append(tuple(sorted(keys, key=[*sweeps].index)))
        elif not (isinstance(keys, list) and wrong.intersection(map(str, keys))):
            problems.append(Problem("zip", message, tree.at("zip", number)[1]))
    return found, problems


def _tell_zip(sweeps: dict[str, Sweep], keys: Any, taken: Sequence[str]) -> str:
    """Return what is wrong with a group of keys that advance together; taken: by other groups."""
    if not isinstance(keys, list) or len(keys) < 2 or not all(isinstance(k, str) for k in keys):
        return "needs a list of groups of keys, such as [[machine.speed_rpm, clearance_mm]]"
    swept = {key: sweeps[key] for key in keys if key in sweeps}
    if any(sweep.is_drawn for sweep in swept.values()):
        return "sampled keys go together by their design already"
    for key in keys:
        if key not in swept:
            hint = "" if row_of(key) else suggestion(key, "")
            return f"{quote_value(key)} is not swept here{hint}"
        if key in taken or keys.count(key) > 1:
            return f"{key} is named twice"
    if len({sweep.count for sweep in swept.values()}) > 1:
        listed = ", ".join(f"{key} has {sweep.count}" for key, sweep in swept.items())
        return f"needs equally many values of each key: {listed}"
    return ""


def _exclusions(tree: Tree) -> tuple[list[Test], list[Problem]]:
    """Return the comparisons of `exclude`; where one holds, a combination is left out."""
    value = tree.values.get("exclude", [])
    texts = value if isinstance(value, list) else [value]
    tests, problems = [], []
    for number, text in enumerate(texts):
        try:
            tests.append(comparison(text))
        except NoComparison as error:
            problems.append(Problem("exclude", str(error), tree.at("exclude", number)[1]))
    return tests, problems


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
    `is_curve`: its jobs are along one key, or several that are zipped.
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
    is_curve: bool = False

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
        self.cards = [block.cards for block in blocks]  # read now, once for copies of this process
        self.ends = [*itertools.accumulate(len(block.numbers) for block in blocks)]
        self.keys: Sequence[str] = ()

    def __len__(self) -> int:
        return self.ends[-1]

    def place_of(self, index: int) -> tuple[Block, int]:
        """Return the block of a case, and the number of its combination there."""
        at = bisect_right(self.ends, index)
        return self.blocks[at], self.blocks[at].numbers[index - self.ends[at]]

    def __getitem__(self, index: Any) -> Any:
        number = range(len(self))[index]
        block, place = self.place_of(number)
        case = block.case(place)
        if self.keys:
            vars(case)["key"] = self.keys[number]
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

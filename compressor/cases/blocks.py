"""A block of a case file: fixed values, and factors of swept ones that multiply.

A factor is one key, or several whose values advance together: a `zip` group, or the keys of a
sampling design. How many there are is known before any value is made; values are made when they
are first asked for, and so is each job's case.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from compressor.cases.case import Case
from compressor.cases.checks import DOUBLES, hold_value, row_of, stands_for, suggestion, value_in
from compressor.cases.comparison import NoComparison, Test, comparison
from compressor.cases.conflicts import IN_PLACE_OF
from compressor.cases.keys import drop, key_of, leaves, path_of, put
from compressor.cases.parameter import CaseError, quote_value
from compressor.cases.swept import FORMS, NoSweep, Sweep, design, design_size, sweep_of
from compressor.cases.table import OF_JOINTS, WORDS, outside_identity
from compressor.cases.yaml_reader import FileProblem, Tree

RIVALS = dict(IN_PLACE_OF) | {other: one for one, other in IN_PLACE_OF}

Factors = list[tuple[str, ...]]  # keys that advance together


@dataclass(frozen=True)
class Block:
    """The jobs of a block: every combination of its factors' values, but for those left out.

    name: of the study. `given` has what is given by dotted key, `fixed` what is not swept of it,
    nested, and `sweeps` how the rest is. `samples` and `seed` are those of a design.
    """

    name: str
    tree: Tree
    given: dict[str, Any]
    fixed: dict[str, Any]
    sweeps: dict[str, Sweep]
    factors: Factors
    samples: int
    seed: int
    exclusions: list[Test]

    @property
    def is_grid(self) -> bool:
        """Return whether every key is an axis of its own, and no combination is left out."""
        drawn = any(sweep.is_drawn for sweep in self.sweeps.values())
        return not (self.exclusions or drawn or any(len(keys) > 1 for keys in self.factors))

    def size(self, keys: tuple[str, ...]) -> int:
        """Return how many values keys that advance together have."""
        sweep = self.sweeps[keys[0]]
        return sweep.count or design_size(sweep.kind, self.samples, len(keys))

    def sizes(self) -> dict[str, int]:
        """Return how many values each factor has, by its keys."""
        return {" with ".join(keys): self.size(keys) for keys in self.factors}

    @cached_property
    def columns(self) -> dict[str, list[Any]]:
        """Return the values of each swept key."""
        found: dict[str, list[Any]] = {}
        for keys in self.factors:
            made = [self.sweeps[key].make() for key in keys]
            if self.sweeps[keys[0]].is_drawn and self.samples:
                points = design(self.sweeps[keys[0]].kind, self.samples, len(keys), self.seed)
                shares = zip(*points, strict=True)
                made = [
                    [*map(self.sweeps[key].spread, own)]
                    for key, own in zip(keys, shares, strict=True)
                ]
            for key, column in zip(keys, made, strict=True):
                found[key] = [hold_value(key, value) for value in column]
        return found

    @cached_property
    def numbers(self) -> Sequence[int]:
        """Return the numbers of the combinations that are not excluded, in C order."""
        every = range(math.prod(len(self.columns[keys[0]]) for keys in self.factors))
        if not self.exclusions:
            return every
        jobs = ((number, reader(self.values_of(number))) for number in every)
        return [number for number, job in jobs if not any(test(job) for test in self.exclusions)]

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
            for key in OF_JOINTS:
                values = drop(values, (key,))
        return values

    def case(self, number: int) -> Case:
        """Return the case of one combination. Raises CaseError where its values do not fit."""
        return Case.resolve({"name": self.name or "case", **self.values_of(number)})

    def solver_of(self, number: int) -> tuple[int, ...]:
        """Return the rows of the keys by which cases differ in `solve` or `output`."""
        rows = self.rows_of(number).items()
        return tuple(row for key, row in rows if key.startswith(("solve", "output")))

    def each_value(self) -> Iterator[dict[str, int]]:
        """Yield rows of the swept keys in which each value stands once at least."""
        for number in range(max(map(len, self.columns.values()), default=1)):
            yield {key: number % len(column) for key, column in self.columns.items() if column}

    def locate(self, error: CaseError, rows: Mapping[str, int]) -> dict[Any, FileProblem]:
        """Return a case's problems at the values that they are about, by what tells them apart.

        Of wrong values that a form has made that is their key: the first is enough. rows: of the
        case's swept keys.
        """
        found: dict[Any, FileProblem] = {}
        for problem in error.problems:
            parts, message = problem.key.split("."), problem.message
            above = (".".join(parts[:n]) for n in range(len(parts), 0, -1))
            key = next((one for one in above if one in rows), "")
            once: Any = problem
            if key:
                sweep, row = self.sweeps[key], rows[key]
                path = (*sweep.path, row) if sweep.kind == "list" else sweep.path
                place = self.tree.at(*path)[1]
                if not error.is_misfit and sweep.kind != "list":
                    once = key
                if not error.is_misfit and not sweep.has_ends:
                    message = tell_draw(row + 1, len(self.columns[key]), message)
            else:
                place = self.tree.at(*parts)[tuple(parts) in self.tree.places]
            given = (word for word, half in DOUBLES.items() if half == problem.key)
            named = next((one for one in given if path_of(one) in self.tree.places), problem.key)
            found.setdefault(once, FileProblem(place, named, message))
        return found

    def find_repeated(self) -> Iterator[FileProblem]:
        """Yield the values that keys have twice."""
        for keys in self.factors:
            seen: set[str] = set()
            sweep = self.sweeps[keys[0]]
            is_list = sweep.kind == "list"
            for number, row in enumerate(zip(*(self.columns[key] for key in keys), strict=True)):
                text = repr(row)
                if text in seen:
                    where = "in the list" if is_list else "among its values"
                    listed = ", ".join(map(quote_value, row))
                    place = self.tree.at(*sweep.path, *[number] * is_list)[1]
                    message = f"{listed} is {where} twice"
                    yield FileProblem(place, " with ".join(keys), message)
                seen.add(text)


def tell_draw(number: int, of: int, message: str) -> str:
    """Return what is wrong with a value drawn from a distribution without ends."""
    return (
        f"draw {number} of {of}: {message}: a normal distribution has no ends; give it a smaller "
        "sd, or draw from {triangular: [least, likeliest, greatest]}"
    )


def reader(values: Mapping[str, Any]) -> Callable[[str], Any]:
    """Return the function that gives the value of a key in nested ones, or its default, or None."""

    def value(key: str) -> Any:
        found, row = value_in(values, key), row_of(key)
        if found is not None or not row or stands_for(key):
            return found
        has_rival = key in RIVALS and value_in(values, RIVALS[key]) is not None
        return None if has_rival else row.default

    return value


def plan_block(tree: Tree, name: str) -> tuple[Block, list[FileProblem]]:
    """Return a block whose values are yet to be made, and what is wrong with how they are swept.

    name: of the study.
    """
    given = {key_of(path): value for path, value in leaves(tree.values)}
    fixed: dict[str, Any] = {}
    sweeps: dict[str, Sweep] = {}
    problems = []
    for path, value in leaves(tree.values):
        key = key_of(path)
        if not is_swept(key, value):
            fixed = put(fixed, path, hold_value(key, value))
            continue
        try:
            sweeps[key] = _sweep(path, key, value)
        except NoSweep as error:
            problems.append(FileProblem(tree.at(*path, *error.path)[1], key, str(error)))
    samples, seed, wrong_design = _design_of(tree, sweeps)
    groups, wrong_zip = _zip_groups(tree, sweeps, {problem.key for problem in problems})
    exclusions, wrong_tests = _exclusions(tree)
    drawn = tuple(key for key, sweep in sweeps.items() if sweep.is_drawn)
    together = {key: group for group in [drawn, *groups] for key in group}
    factors = [*dict.fromkeys(together.get(key, (key,)) for key in sweeps)]
    block = Block(name, tree, given, fixed, sweeps, factors, samples, seed, exclusions)
    return block, [*problems, *wrong_design, *wrong_zip, *wrong_tests]


def is_swept(key: str, value: Any) -> bool:
    """Return whether a value stands for many, unlike a pair of materials or an accuracy."""
    if key in WORDS:
        return False
    if isinstance(value, dict):
        return key != "solve.accuracy"
    row = row_of(key)
    is_pair = row is not None and row.kind == "materials"
    return isinstance(value, list) and (not is_pair or any(isinstance(n, list) for n in value))


def _sweep(path: tuple[Any, ...], key: str, value: Any) -> Sweep:
    """Return how a value sweeps a key. Raises NoSweep where it cannot."""
    row, parts = row_of(key), stands_for(key)
    if key in outside_identity():
        raise NoSweep("cannot be swept: it does not change what a job computes")
    if isinstance(value, dict) and FORMS.keys() & value and not (row and row.is_number):
        raise NoSweep(f"is no number, so that {next(iter(value))} cannot sweep it: give a list")
    if parts and isinstance(value, list) and any(isinstance(one, dict) for one in value):
        first, *_, last = (part.rpartition(".")[2] for part in parts)
        form = f"{{{first}: [...], {last}: ...}}"
        raise NoSweep(f"a list has values of all parts alike: sweep each part, {form}")
    return sweep_of(path, value, row is not None and row.kind == "integer")


def _design_of(tree: Tree, sweeps: dict[str, Sweep]) -> tuple[int, int, list[FileProblem]]:
    """Return how many samples from which seed a block draws, and what is wrong with that."""
    drawn = [sweep for sweep in sweeps.values() if sweep.is_drawn]
    given = tree.values.get("sample", {})
    problems = [
        tree.problem(("sample", name), f"needs a whole number from {least}")
        for name, least in (("n", 1), ("seed", 0))
        if name in given and not (type(given[name]) is int and given[name] >= least)
    ]
    for sweep in drawn:
        if sweep.kind != drawn[0].kind:
            kinds = f"{drawn[0].kind} or {sweep.kind}"
            text = f"one design draws all sampled keys: {kinds}, not both"
            problems.append(tree.problem(sweep.path, text))
    if len(drawn) == 1 and drawn[0].kind == "saltelli":
        text = "saltelli exchanges keys one by one: draw two or more, or draw this one by sobol"
        problems.append(tree.problem(drawn[0].path, text))
    if drawn and "n" not in given:
        text = "needs a number of samples: add `sample: {n: 64, seed: 1}` to the file"
        problems.append(tree.problem(drawn[0].path, text))
    return 0 if problems else given.get("n", 0), given.get("seed", 0), problems


def _zip_groups(
    tree: Tree, sweeps: dict[str, Sweep], wrong: set[str]
) -> tuple[Factors, list[FileProblem]]:
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
            problems.append(FileProblem(tree.at("zip", number)[1], "zip", message))
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


def _exclusions(tree: Tree) -> tuple[list[Test], list[FileProblem]]:
    """Return the comparisons of `exclude`; where one holds, a combination is left out."""
    value = tree.values.get("exclude", [])
    texts = value if isinstance(value, list) else [value]
    tests, problems = [], []
    for number, text in enumerate(texts):
        try:
            tests.append(comparison(text))
        except NoComparison as error:
            problems.append(FileProblem(tree.at("exclude", number)[1], "exclude", str(error)))
    return tests, problems

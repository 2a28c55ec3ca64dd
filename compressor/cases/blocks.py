"""A block of a case file: fixed values, and factors of swept ones that multiply.

A factor is one key, or several whose values advance together: a `zip` group, or the keys of a
sampling design. Counts are known first (`plan_block`); values are made when the counts are bearable
(`Plan.block`), and each job's on access (`Block.values_of`).
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from compressor.cases.case import Case
from compressor.cases.checks import DOUBLES, hold_value, row_of, stands_for, suggestion, value_in
from compressor.cases.comparison import NoComparison, Test, comparison
from compressor.cases.conflicts import IN_PLACE_OF
from compressor.cases.keys import drop, key_of, leaves, path_of, put
from compressor.cases.parameter import CaseError, quote_value
from compressor.cases.swept import FORMS, NoSweep, Sweep, design, design_size, sweep_of
from compressor.cases.table import OF_JOINTS, WORDS, outside_identity
from compressor.cases.yaml_reader import FileProblem, Path, Place, Tree

MAX_EXCLUSIONS = 20
MAX_SEED = 2**63
NUMBERS = ("number", "integer")  # kinds of keys that forms sweep
RIVALS = dict(IN_PLACE_OF) | {other: one for one, other in IN_PLACE_OF}

Row = tuple[Any, ...]


@dataclass(frozen=True)
class Block:
    """The jobs of a block: every combination of its factors' values, but for those left out.

    name: of the study. `given` has what is given by dotted key, `fixed` what is not swept of it,
    nested, and `sweeps` how the rest is; a factor has keys, and the rows of their values together.
    """

    name: str
    tree: Tree
    fixed: dict[str, Any]
    sweeps: dict[str, Sweep]
    given: dict[str, Any]
    factors: tuple[tuple[tuple[str, ...], list[Row]], ...] = ()
    numbers: Sequence[int] = ()  # of the combinations that are not excluded, in C order
    is_grid: bool = False  # whether every key is an axis of its own, and no combination is left out

    def places(self, number: int) -> list[int]:
        """Return which of its rows each factor has in one combination."""
        found = []
        for _, rows in reversed(self.factors):
            number, place = divmod(number, len(rows))
            found.append(place)
        return found[::-1]

    def choose_swept(self, number: int) -> dict[str, Any]:
        """Return the swept values of one combination by dotted key."""
        found: dict[str, Any] = {}
        for (keys, rows), place in zip(self.factors, self.places(number), strict=True):
            found.update(zip(keys, rows[place], strict=True))
        return found

    def values_of(self, number: int) -> dict[str, Any]:
        """Return the values of one combination, nested as a case file has them."""
        values, swept = self.fixed, self.choose_swept(number)
        for key, value in swept.items():
            values = put(values, self.sweeps[key].path, value)
        if swept.get("joint") == "none":
            for key in OF_JOINTS:
                values = drop(values, (key,))
        return values

    def case(self, number: int) -> Case:
        """Return the case of one combination. Raises CaseError where its values do not fit."""
        return Case.resolve({"name": self.name or "case", **self.values_of(number)})

    def solver_of(self, number: int) -> tuple[int, ...]:
        """Return the places of the factors by which cases differ in `solve` or `output`."""
        pairs = zip(self.factors, self.places(number), strict=True)
        groups = ("solve", "output")
        return tuple(place for (keys, _), place in pairs if any(k.startswith(groups) for k in keys))

    def where(self, test: Test) -> list[bool]:
        """Return whether a comparison holds, of each job."""
        return [test(reader(self.values_of(number))) for number in self.numbers]

    def each_value(self) -> Iterator[tuple[dict[str, Any], dict[str, int]]]:
        """Yield values of jobs, with rows by key, in which each value stands once at least."""
        for number in range(max((len(rows) for _, rows in self.factors), default=1)):
            values, found = dict(self.fixed), {}
            for keys, rows in self.factors:
                for key, value in zip(keys, rows[number % len(rows)] if rows else (), strict=False):
                    values = put(values, self.sweeps[key].path, value)
                    found[key] = number % len(rows)
            yield values, found

    def rows_of(self, number: int) -> dict[str, int]:
        """Return which row each swept key has in one combination."""
        pairs = zip(self.factors, self.places(number), strict=True)
        return {key: place for (keys, _), place in pairs for key in keys}

    def locate(
        self, error: CaseError, rows: Mapping[str, int], path: str
    ) -> dict[Any, FileProblem]:
        """Return a case's problems at the values that they are about, by what tells them apart.

        Of wrong values that a form has made that is their key: the first is enough. rows: which
        row each swept key has in the case; path: of the file.
        """
        found: dict[Any, FileProblem] = {}
        for problem in error.problems:
            parts = problem.key.split(".")
            above = (".".join(parts[:n]) for n in range(len(parts), 0, -1))
            key = next((one for one in above if one in rows), None)
            if key is None:
                place = self._place_of(problem.key, path)
                found[problem] = FileProblem(place, self._name(problem.key), problem.message)
                continue
            sweep, message = self.sweeps[key], problem.message
            if not sweep.has_ends and not error.is_misfit:
                of = next(len(found) for keys, found in self.factors if key in keys)
                message = tell_draw(rows[key] + 1, of, message)
            once = key if sweep.kind != "list" and not error.is_misfit else problem
            place = self.place(sweep.place_of(rows[key]))
            found.setdefault(once, FileProblem(place, self._name(problem.key), message))
        return found

    def _name(self, key: str) -> str:
        """Return a key as the file has it: its double's where that is given."""
        given = (word for word, half in DOUBLES.items() if half == key)
        return next((word for word in given if path_of(word) in self.tree.places), key)

    def _place_of(self, key: str, path: str) -> Place:
        """Return where a key stands, or its group, or the block; path: of the file."""
        own = path_of(key)
        found = self.nearest(own)
        spots = self.tree.places.get(found)
        return spots[found == own] if spots else Place(path, 1, 1)

    def place(self, path: Path) -> Place:
        """Return where the value at a path stands, or what it is in."""
        return self.tree.places[self.nearest(path)][1]

    def key_place(self, path: Path) -> Place:
        """Return where the key at a path stands, or what it is in."""
        return self.tree.places[self.nearest(path)][0]

    def nearest(self, path: Path) -> Path:
        """Return a path, or that of the nearest thing that holds it and stands in the file."""
        while path and path not in self.tree.places:
            path = path[:-1]
        return path


def tell_draw(number: int, of: int, message: str) -> str:
    """Return what is wrong with a value drawn from a distribution without ends."""
    return (
        f"draw {number} of {of}: {message}: a normal distribution has no ends; give it a smaller "
        "sd, or draw from {triangular: [least, likeliest, greatest]}"
    )


def reader(values: Mapping[str, Any]) -> Callable[[str], Any]:
    """Return the function that gives the value of a key in nested ones, or its default, or None."""

    def value(key: str) -> Any:
        found = value_in(values, key)
        row = row_of(key)
        if found is not None:
            return found
        if RIVALS.get(key) and value_in(values, RIVALS[key]) is not None:
            return None
        return row.default if row and not stands_for(key) else None

    return value


@dataclass(frozen=True)
class Plan:
    """A block whose jobs are counted and not yet made; `samples` and `seed` are those of a design.

    `factors` has the keys that advance together.
    """

    tree: Tree
    given: dict[str, Any]
    fixed: dict[str, Any]
    sweeps: dict[str, Sweep]
    factors: list[tuple[str, ...]] = field(default_factory=list)
    samples: int = 0
    seed: int = 0
    exclusions: list[Test] = field(default_factory=list)

    def sizes(self) -> dict[str, int]:
        """Return how many values each factor has, by its keys."""
        return {" with ".join(keys): self.size(keys) for keys in self.factors}

    def size(self, keys: tuple[str, ...]) -> int:
        """Return how many values keys that advance together have."""
        sweep = self.sweeps[keys[0]]
        return sweep.count or design_size(sweep.kind, self.samples, len(keys))

    def rows(self, keys: tuple[str, ...]) -> list[Row]:
        """Return the values of keys that advance together."""
        sweeps = [self.sweeps[key] for key in keys]
        columns: list[list[Any]] = [sweep.make() for sweep in sweeps]
        if sweeps[0].is_drawn and self.samples:
            points = design(sweeps[0].kind, self.samples, len(keys), self.seed)
            shares = zip(*points, strict=True)
            columns = [[*map(one.spread, of)] for one, of in zip(sweeps, shares, strict=True)]
        held = [[hold_value(key, one) for one in of] for key, of in zip(keys, columns, strict=True)]
        return list(zip(*held, strict=True))

    def block(self, name: str) -> tuple[Block, list[FileProblem]]:
        """Return the block with all its values, and those that it has twice; name: of the study."""
        factors = tuple((keys, self.rows(keys)) for keys in self.factors)
        single_keys = not self.exclusions and all(len(keys) == 1 for keys in self.factors)
        is_grid = single_keys and not any(sweep.is_drawn for sweep in self.sweeps.values())
        numbers = range(math.prod(len(rows) for _, rows in factors))
        block = Block(
            name, self.tree, self.fixed, self.sweeps, self.given, factors, numbers, is_grid
        )
        problems = [*find_repeated(block)]
        if self.exclusions and not problems:
            kept = block.where(lambda value: not any(test(value) for test in self.exclusions))
            block = replace(block, numbers=[*itertools.compress(numbers, kept)])
            if numbers and not block.numbers:
                place = block.place(("exclude",))
                problems.append(FileProblem(place, "exclude", "leaves no job"))
        return block, problems


def find_repeated(block: Block) -> Iterator[FileProblem]:
    """Yield the values that keys have twice."""
    for keys, rows in block.factors:
        seen: set[str] = set()
        sweep = block.sweeps[keys[0]]
        where = "in the list" if sweep.kind == "list" else "among its values"
        for number, row in enumerate(rows):
            text = repr(row)
            if text in seen:
                listed = ", ".join(map(quote_value, row))
                place = block.place(sweep.place_of(number))
                yield FileProblem(place, " with ".join(keys), f"{listed} is {where} twice")
            seen.add(text)


def plan_block(tree: Tree) -> tuple[Plan, list[FileProblem]]:
    """Return a block as far as it is known before any value is made, and what is wrong with it."""
    fixed: dict[str, Any] = {}
    sweeps: dict[str, Sweep] = {}
    problems = []
    for path, value in leaves(tree.values):
        key = key_of(path)
        row = row_of(key)
        if not is_swept(key, value):
            fixed = put(fixed, path, hold_value(key, value))
            continue
        place = tree.places.get(path, tree.places.get(path[:1]))
        assert place
        if key in outside_identity():
            text = "cannot be swept: it does not change what a job computes"
            problems.append(FileProblem(place[1], key, text))
            continue
        kind = row.kind if row else ""
        try:
            if isinstance(value, dict) and FORMS.keys() & value and kind not in NUMBERS:
                raise NoSweep(
                    f"is no number, so that {next(iter(value))} cannot sweep it: give a list"
                )
            parts = stands_for(key)
            if parts and isinstance(value, list) and any(isinstance(one, dict) for one in value):
                first, *_, last = (part.rpartition(".")[2] for part in parts)
                form = f"{{{first}: [...], {last}: ...}}"
                raise NoSweep(f"a list has values of all parts alike: sweep each part, {form}")
            sweeps[key] = sweep_of(path, value, kind == "integer")
        except NoSweep as error:
            place = tree.places.get(path + error.path, place)
            problems.append(FileProblem(place[1], key, str(error)))
    wrong = {problem.key for problem in problems}
    given = {key_of(path): value for path, value in leaves(tree.values)}
    plan = Plan(tree, given, fixed, sweeps)
    samples, seed, faults = _design_of(plan)
    problems += faults
    groups, faults = _zip_groups(plan, wrong)
    problems += faults
    drawn = tuple(key for key, sweep in sweeps.items() if sweep.is_drawn)
    together = {key: group for group in [drawn, *groups] for key in group}
    factors = list(dict.fromkeys(together.get(key, (key,)) for key in sweeps))
    exclusions, faults = _exclusions(tree)
    return Plan(tree, given, fixed, sweeps, factors, samples, seed, exclusions), problems + faults


def is_swept(key: str, value: Any) -> bool:
    """Return whether a value stands for many, unlike a pair of materials or an accuracy."""
    if key in WORDS:
        return False
    if isinstance(value, dict):
        return key != "solve.accuracy"
    row = row_of(key)
    is_pair = row is not None and row.kind == "materials"
    return isinstance(value, list) and (not is_pair or any(isinstance(n, list) for n in value))


def _design_of(plan: Plan) -> tuple[int, int, list[FileProblem]]:
    """Return how many samples from which seed a block draws, and what is wrong with that."""
    problems = []

    def refuse(path: Path, message: str) -> None:
        place = plan.tree.places.get(path, plan.tree.places.get(path[:1]))
        assert place
        problems.append(FileProblem(place[1], key_of(path), message))

    drawn = [sweep for sweep in plan.sweeps.values() if sweep.is_drawn]
    found = {"n": 0, "seed": 0}
    given = plan.tree.values.get("sample", {})
    for name, least, most in (("n", 1, math.inf), ("seed", 0, MAX_SEED)):
        value = given.get(name, found[name])
        if name in given and not (type(value) is int and least <= value <= most):
            refuse(("sample", name), f"needs a whole number from {least}")
        else:
            found[name] = value
    for sweep in drawn:
        if sweep.kind != drawn[0].kind:
            kinds = f"{drawn[0].kind} or {sweep.kind}"
            refuse(sweep.path, f"one design draws all sampled keys: {kinds}, not both")
    if len(drawn) == 1 and drawn[0].kind == "saltelli":
        text = "saltelli exchanges keys one by one: draw two or more, or draw this one by sobol"
        refuse(drawn[0].path, text)
        found["n"] = 0  # their repetition is no second mistake
    if drawn and "n" not in given:
        text = "needs a number of samples: add `sample: {n: 64, seed: 1}` to the file"
        refuse(drawn[0].path, text)
    return found["n"], found["seed"], problems


def _zip_groups(plan: Plan, wrong: set[str]) -> tuple[list[tuple[str, ...]], list[FileProblem]]:
    """Return the groups of `zip`, swept keys with equally many values, and what is wrong with them.

    wrong: keys whose sweep is wrong, which is reported already.
    """
    value = plan.tree.values.get("zip", [])
    found: list[tuple[str, ...]] = []
    problems = []
    for number, keys in enumerate(value if isinstance(value, list) else [value]):
        path = ("zip", number) if isinstance(value, list) else ("zip",)
        message = _tell_zip(plan, keys, [key for group in found for key in group])
        if message and not (isinstance(keys, list) and wrong.intersection(map(str, keys))):
            place = plan.tree.places.get(path, plan.tree.places["zip",])
            problems.append(FileProblem(place[1], "zip", message))
        elif not message:
            found.append(tuple(sorted(keys, key=[*plan.sweeps].index)))
    return found, problems


def _tell_zip(plan: Plan, keys: Any, taken: Sequence[str]) -> str:
    """Return what is wrong with a group of keys that advance together; taken: by other groups."""
    if not isinstance(keys, list) or len(keys) < 2 or not all(isinstance(k, str) for k in keys):
        return "needs a list of groups of keys, such as [[machine.speed_rpm, clearance_mm]]"
    swept = {key: plan.sweeps[key] for key in keys if key in plan.sweeps}
    if any(sweep.is_drawn for sweep in swept.values()):
        return "sampled keys go together by their design already"
    for key in keys:
        if key not in swept:
            hint = "" if row_of(key) else suggestion(key, "")
            return f"{quote_value(key)} is not swept here{hint}"
    for number, key in enumerate(keys):
        if key in taken or key in keys[:number]:
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
    if len(texts) > MAX_EXCLUSIONS:
        text = f"has more than {MAX_EXCLUSIONS} comparisons: join by `or`"
        return [], [FileProblem(tree.places["exclude",][1], "exclude", text)]
    for number, text in enumerate(texts):
        try:
            if not isinstance(text, str):
                raise NoComparison("needs comparisons, such as clearance_mm > 0.2")
            tests.append(comparison(text))
        except NoComparison as error:
            spots = tree.places.get(("exclude", number), tree.places["exclude",])
            problems.append(FileProblem(spots[1], "exclude", str(error)))
    return tests, problems

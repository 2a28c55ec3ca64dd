"""A block of a case file: fixed values, and factors of swept ones that multiply.

A factor is one key, or several whose values advance together: a `zip` group, or the keys of a
sampling design. Counts are known first (`draft`); values are made when the counts are bearable
(`Draft.block`), and a combination of them on access (`Block.chosen`).
"""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from compressor.cases.checks import SWEEP, check_value, row_of, suggestion
from compressor.cases.combinations import Block, Row
from compressor.cases.comparison import NoComparison, Test, comparison
from compressor.cases.keys import Leaves
from compressor.cases.parameter import quote_value
from compressor.cases.swept import (
    SAMPLED,
    SweptKey,
    design,
    design_size,
    is_swept,
    sweep_of,
)
from compressor.cases.table import WORDS, outside_identity, table
from compressor.cases.yaml_reader import FileProblem, Node

MAX_EXCLUSIONS = 20
MAX_SEED = 2**63


@dataclass
class Draft:
    """A block that is being read: what is swept, how, and what is wrong with it."""

    leaves: Leaves
    problems: list[FileProblem]
    fixed: dict[str, Node] = field(default_factory=dict)
    sweeps: dict[str, SweptKey] = field(default_factory=dict)
    factors: list[tuple[str, ...]] = field(default_factory=list)  # keys that advance together
    samples: int = 0
    seed: int = 0
    exclusions: list[Test] = field(default_factory=list)

    def refuse(self, node: Node, key: str, message: str) -> None:
        self.problems.append(FileProblem(node.place, key, message))

    @property
    def is_sampled(self) -> bool:
        """Return whether any key is drawn by a design."""
        return any(sweep.kind in SAMPLED for sweep in self.sweeps.values())

    def sizes(self) -> dict[str, int]:
        """Return how many values each factor has, by its keys."""
        return {" with ".join(keys): self.size(keys[0]) for keys in self.factors}

    def size(self, key: str) -> int:
        together = next((keys for keys in self.factors if key in keys), (key,))
        return self.sweeps[key].count or design_size(
            self.sweeps[key].kind, self.samples, len(together)
        )

    def block(self, name: str) -> Block:
        """Return the block with all its values; name: of the study.

        Wrong values join `problems`, and leave the block without jobs.
        """
        factors = tuple((keys, self.rows(keys)) for keys in self.factors)
        count = math.prod(len(rows) for _, rows in factors)
        if self.problems:
            count = 0
        is_grid = not self.exclusions and not self.is_sampled and len(factors) == len(self.sweeps)
        block = Block(name, self.leaves, self.fixed, factors, range(count), is_grid)
        if not self.exclusions:
            return block
        selected = block.where(lambda value: not any(test(value) for test in self.exclusions))
        if count and not any(selected):
            self.refuse(self.leaves.values["exclude"], "exclude", "leaves no job")
        return replace(block, numbers=[*itertools.compress(range(count), selected)])

    def rows(self, keys: tuple[str, ...]) -> list[Row]:
        """Return the values of keys that advance together; [] where any is wrong.

        Wrong values and repetitions join `problems`.
        """
        points: list[list[float]] = []
        if self.sweeps[keys[0]].kind in SAMPLED:
            points = design(self.sweeps[keys[0]].kind, self.samples, len(keys), self.seed)
        columns = []
        for number, key in enumerate(keys):
            sweep = self.sweeps[key]
            drawn = sweep.placed([sweep.spread(point[number]) for point in points])
            columns.append(self.checked(sweep, drawn or sweep.nodes()))
        if len({len(column) for column in columns}) > 1:
            return []  # a value is wrong
        rows = list(zip(*columns, strict=True))
        seen: set[tuple[Any, ...]] = set()
        for row in rows:
            values = tuple(node.value for node in row)
            if values in seen:
                where = "in the list" if self.sweeps[keys[0]].kind == "list" else "among its values"
                listed = ", ".join(map(quote_value, values))
                self.refuse(row[0], " with ".join(keys), f"{listed} is {where} twice")
            seen.add(values)
        return rows

    def checked(self, sweep: SweptKey, nodes: Sequence[Node]) -> list[Node]:
        """Return the valid ones of a key's values; the others join `problems`.

        Of wrong values that a form such as `linspace` has made, the first alone.
        """
        valid = []
        for number, node in enumerate(nodes, 1):
            value = check(sweep.key, node, self.problems)
            if value is None and not sweep.has_ends:
                wrong = self.problems.pop()
                ends = "{triangular: [least, likeliest, greatest]}"
                text = f"draw {number} of {len(nodes)}: {wrong.message}: a normal distribution has"
                text += f" no ends; give it a smaller sd, or draw from {ends}"
                self.problems.append(replace(wrong, message=text))
            if value:
                valid.append(value)
            elif sweep.kind != "list":
                break
        return valid


def draft(leaves: Leaves, problems: list[FileProblem]) -> Draft:
    """Return a block as far as it is known before any value is made."""
    block = Draft(leaves, problems)
    for key, node in leaves.values.items():
        if key.partition(".")[0] in SWEEP:
            continue
        if not is_swept(key, node):
            if good := check(key, node, problems):
                block.fixed[key] = good
        elif key in outside_identity():
            block.refuse(node, key, "cannot be swept: it does not change what a job computes")
        elif sweep := sweep_of(key, node, problems):
            block.sweeps[key] = sweep
    sampled = _sampled_keys(block)
    groups = [*([sampled] if sampled else []), *_zip_groups(block)]
    first = {key: group for group in groups for key in group}
    block.factors = list(dict.fromkeys(first.get(key, (key,)) for key in block.sweeps))
    block.exclusions = list(_exclusions(block))
    return block


def check(key: str, node: Node, problems: list[FileProblem]) -> Node | None:
    """Return a node with its value as the case holds it; None for a wrong one, a problem."""
    if node.value is None or key in WORDS:  # reported before; or its word, which is valid
        return node if key in WORDS and node.value is WORDS[key] else None
    if isinstance(node.value, dict) and any(n.value is None for n in node.value.values()):
        return None
    row = row_of(key)
    assert row  # an unknown key was reported when it was read
    value, wrong = check_value(row.key, node.plain())
    parts = node.value if isinstance(node.value, dict) else {}
    for problem in wrong:
        part = parts.get(problem.key.removeprefix(f"{row.key}."))
        place, about = (part.place, problem.key) if part else (node.place, key)
        problems.append(FileProblem(place, about, problem.message))
    return None if wrong else replace(node, value=value)


def _sampled_keys(block: Draft) -> tuple[str, ...]:
    """Return the keys that one sampling design draws together, in the order of the file."""
    keys = tuple(key for key, sweep in block.sweeps.items() if sweep.kind in SAMPLED)
    for name, least, most in (("n", 1, math.inf), ("seed", 0, MAX_SEED)):
        node = block.leaves.values.get(f"sample.{name}")
        if node and not (type(node.value) is int and least <= node.value <= most):
            block.refuse(node, f"sample.{name}", f"needs a whole number from {least}")
        elif node and name == "n":
            block.samples = node.value
        elif node:
            block.seed = node.value
    kinds = list(dict.fromkeys(block.sweeps[key].kind for key in keys))
    for key in keys:
        sweep = block.sweeps[key]
        if sweep.kind != kinds[0]:
            message = f"one design draws all sampled keys: {kinds[0]} or {sweep.kind}, not both"
            block.refuse(sweep.node, key, message)
    if kinds == ["saltelli"] and len(keys) == 1:
        message = "saltelli exchanges keys one by one: draw two or more, or draw this one by sobol"
        block.refuse(block.sweeps[keys[0]].node, keys[0], message)
        block.samples = 0  # their repetition is no second mistake
    if keys and "sample.n" not in block.leaves.values:
        message = "needs a number of samples: add `sample: {n: 64, seed: 1}` to the file"
        block.refuse(block.sweeps[keys[0]].node, keys[0], message)
    return keys


def _zip_groups(block: Draft) -> Iterable[tuple[str, ...]]:
    """Yield the good groups of `zip`: swept keys, each in one group, with equally many values."""
    node = block.leaves.values.get("zip")
    taken: set[str] = set()
    for keys, group in _words(block, node) if node else ():
        swept = [key for key in keys if key in block.sweeps]
        sizes = {key: block.sweeps[key].count for key in swept}
        unswept = [key for key in keys if key not in swept]
        if any(block.sweeps[key].kind in SAMPLED for key in swept):
            block.refuse(group, "zip", "sampled keys go together by their design already")
        elif unswept and unswept[0] in block.leaves.values and unswept[0] not in block.fixed:
            pass  # how it is swept is wrong, and reported
        elif unswept:
            hint = "" if unswept[0] in table() else suggestion(unswept[0], "")
            block.refuse(group, "zip", f"{quote_value(unswept[0])} is not swept here{hint}")
        elif taken & {*keys} or len({*keys}) < len(keys):
            twice = next(key for key in keys if key in taken or keys.count(key) > 1)
            block.refuse(group, "zip", f"{twice} is named twice")
        elif len({*sizes.values()}) > 1:
            listed = ", ".join(f"{key} has {size}" for key, size in sizes.items())
            block.refuse(group, "zip", f"needs equally many values of each key: {listed}")
        else:
            taken |= {*keys}
            yield tuple(sorted(keys, key=[*block.sweeps].index))


def _words(block: Draft, node: Node) -> Iterable[tuple[list[str], Node]]:
    """Yield the groups of keys that `zip` lists."""
    groups = node.value if isinstance(node.value, list) else [node]
    for group in groups:
        items = group.value if isinstance(group.value, list) else []
        if len(items) > 1 and all(isinstance(item.value, str) for item in items):
            yield [item.value for item in items], group
        else:
            message = "needs a list of groups of keys, such as [[machine.speed_rpm, clearance_mm]]"
            block.refuse(group, "zip", message)


def _exclusions(block: Draft) -> Iterable[Test]:
    """Yield the comparisons of `exclude`; where one holds, a combination is left out."""
    node = block.leaves.values.get("exclude")
    if not node:
        return
    texts = node.value if isinstance(node.value, list) else [node]
    if len(texts) > MAX_EXCLUSIONS:
        block.refuse(node, "exclude", f"has more than {MAX_EXCLUSIONS} comparisons: join by `or`")
    for text in texts[:MAX_EXCLUSIONS]:
        if not isinstance(text.value, str):
            block.refuse(text, "exclude", "needs comparisons, such as clearance_mm > 0.2")
            continue
        try:
            yield comparison(text.value)
        except NoComparison as error:
            block.refuse(text, "exclude", str(error))

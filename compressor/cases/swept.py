"""How keys are swept: by a list, a mapping such as `{linspace: [0.1, 0.3, 5]}`, or a design.

How many values there are is known before any is made. Numbers are taken as the decimal fractions
that they are written as, so that `{range: [0.1, 0.5, 0.1]}` has 0.3, and equal values are
one job in whatever study.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from fractions import Fraction

from compressor.cases.parameter import Parameter
from compressor.cases.shorthands import row_of
from compressor.cases.yaml_reader import FileProblem, Node
from compressor.program import ignore_warnings

# designs of samples, which draw several keys together
SAMPLED = ("random", "lhs", "sobol", "saltelli")
# word -> what stands in its brackets
FORMS = {
    "linspace": "[first, last, count]",
    "logspace": "[first, last, count]",
    "range": "[first, last, step]",
} | dict.fromkeys(SAMPLED, "[least, greatest]")

Make = Callable[[], list[float]]
Spread = Callable[[float], float]  # of a coordinate in [0, 1)


@dataclass(frozen=True)
class Sweep:
    """One swept key. A list has `nodes`; a sampled key's values come from a design by `spread`."""

    key: str
    node: Node
    kind: str  # list, or a word of FORMS
    count: int  # 0 for a sampled key: its design has the count
    make: Make = list
    spread: Spread = float

    def nodes(self) -> list[Node]:
        """Return the values; made ones stand where their mapping does."""
        return self.node.value if self.kind == "list" else self.placed(self.make())

    def placed(self, values: list[float]) -> list[Node]:
        """Return the made values as nodes."""
        return [Node(value, self.node.place, self.node.key_place) for value in values]


def is_swept(key: str, node: Node) -> bool:
    """Return whether a value stands for many: not the pair of a contact's materials, nor an
    accuracy.
    """
    if isinstance(node.value, dict):
        return key != "solve.accuracy"
    if not isinstance(node.value, list):
        return False
    return key != "contact.materials" or any(isinstance(n.value, list) for n in node.value)


def sweep_of(key: str, node: Node, problems: list[FileProblem]) -> Sweep | None:
    """Return how a key is swept, or None, what is wrong having joined `problems`."""

    def refuse(message: str, at: Node = node) -> None:
        problems.append(FileProblem(at.place, key, message))

    if isinstance(node.value, list):
        if not node.value:
            refuse("is an empty list")
            return None
        return Sweep(key, node, "list", len(node.value))
    log = node.value.get("log")
    words = [word for word in node.value if word != "log"]
    if len(words) != 1 or words[0] not in FORMS:
        near = get_close_matches(words[0] if words else "", FORMS, n=1)
        hint = f"; did you mean {near[0]}?" if near else ""
        refuse(f"needs a value, a list of values or a mapping with one of {' '.join(FORMS)}{hint}")
    elif log and (words[0] not in SAMPLED or not isinstance(log.value, bool)):
        refuse(f"log is true or false, and for {' '.join(SAMPLED)} alone", log)
    elif not is_number(row_of(key)):
        refuse(f"is no number, so that {words[0]} cannot sweep it: give a list")
    else:
        numbers = _numbers(words[0], node.value[words[0]], refuse)
        if numbers:
            return _ranged(key, node, words[0], numbers, bool(log and log.value), refuse)
    return None


def is_number(row: Parameter | None) -> bool:
    """Return whether a row of the table is one of numbers."""
    return row is not None and row.kind in ("number", "integer")


def _numbers(word: str, node: Node, refuse: Callable[..., None]) -> list[Fraction]:
    """Return the numbers in the brackets of a word; none where anything is wrong with them."""
    items = [item.value for item in node.value] if isinstance(node.value, list) else []
    if len(items) != FORMS[word].count(",") + 1 or not all(map(_is_finite, items)):
        refuse(f"{word} needs {FORMS[word]}, finite numbers", node)
        return []
    return [Fraction(str(item)) for item in items]


def _is_finite(value: object) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and math.isfinite(value)  # type: ignore[arg-type]


def _ranged(
    key: str, node: Node, word: str, numbers: list[Fraction], log: bool,
    refuse: Callable[..., None],
) -> Sweep | None:  # fmt: skip
    """Return the sweep between two numbers, if both are good values of the key."""
    first, last, *more = numbers
    count, message = 0, ""
    if first == last and word != "range":
        message = f"{word} needs two different ends"
    elif word in SAMPLED and first > last:
        message = f"{word} needs {FORMS[word]}: {float(first):g} exceeds {float(last):g}"
    elif (word == "logspace" or log) and min(first, last) <= 0:
        message = f"{'log' if log else word} needs ends above 0"
    elif word in ("linspace", "logspace"):
        count = int(more[0])
        message = "" if count == more[0] >= 2 else f"{word} needs a whole count of 2 or more"
    elif word == "range" and (not more[0] or (last - first) / more[0] < 0):
        message = f"range never gets from {float(first):g} to {float(last):g} by this step"
    elif word == "range":
        count = (last - first) // more[0] + 1
        last = first + (count - 1) * more[0]
    if not message:
        row = row_of(key)
        bad = (row.check(float(end)) for end in (first, last) if row)
        message = next(filter(None, bad), "")
    if message:
        refuse(message, node.value[word])
        return None
    if word in SAMPLED:
        spread = _spread(float(first), float(last), log)
        row = row_of(key)
        if row and row.kind == "integer":
            return Sweep(key, node, word, 0, spread=lambda share: round(spread(share)))
        return Sweep(key, node, word, 0, spread=spread)
    return Sweep(key, node, word, count, make=between(word, first, last, count))


def between(word: str, first: Fraction, last: Fraction, count: int) -> Make:
    """Return the function that makes `count` values from first to last, evenly or with even
    ratios.
    """
    low, high = float(first), float(last)

    def even() -> list[float]:
        return [float(first + (last - first) * i / max(count - 1, 1)) for i in range(count)]

    def geometric() -> list[float]:
        inner = (low * (high / low) ** (i / (count - 1)) for i in range(1, count - 1))
        return [low, *map(rounded, inner), high]

    return geometric if word == "logspace" else even


def _spread(low: float, high: float, log: bool) -> Spread:
    """Return the function that takes [0, 1) to [low, high), evenly or with even ratios."""

    def spread(share: float) -> float:
        value = low * (high / low) ** share if log else low + (high - low) * share
        return min(max(rounded(value), low), high)

    return spread


def rounded(value: float) -> float:
    """Return a made value to 12 digits, which print alike wherever its last bits come from."""
    return float(f"{value:.12g}")


def counted(count: int) -> str:
    """Return a number of jobs as it is told, however large."""
    return str(count) if count < 10**100 else f"over 10^{int(count.bit_length() * 0.30103) - 1}"


def design_size(kind: str, count: int, keys: int) -> int:
    """Return how many points `design` makes."""
    return count * (keys + 2) if kind == "saltelli" else count


def design(kind: str, count: int, keys: int, seed: int) -> list[list[float]]:
    """Return the points of a sampling design: `count` of `keys` coordinates in [0, 1).

    The same seed gives the same points. `random` is uniform, `lhs` a Latin hypercube, `sobol`
    Sobol's sequence, scrambled, whose balance is best where `count` is a power of two. `saltelli`
    has `count` points A and as many B, both of one Sobol's sequence, and then for each coordinate A
    with that of B in its place: `design_size` points, from which a variance-based sensitivity is
    estimated (Saltelli et al., Computer Physics Communications 181, 2010, 259-270).
    """
    if kind == "saltelli":
        points = design("sobol", count, 2 * keys, seed)
        a, b = [row[:keys] for row in points], [row[keys:] for row in points]
        mixed = [
            [*one[:key], other[key], *one[key + 1 :]]
            for key in range(keys)
            for one, other in zip(a, b, strict=True)
        ]
        return a + b + mixed
    import numpy as np

    generator = np.random.default_rng(seed)
    if kind == "random":
        return generator.random((count, keys)).tolist()
    from scipy.stats import qmc  # takes half a second

    sampler = {"lhs": qmc.LatinHypercube, "sobol": qmc.Sobol}[kind](keys, seed=generator)
    with ignore_warnings("The balance properties of Sobol"):
        return sampler.random(count).tolist()

"""How keys are swept, by lists, ranges or designs, and which of the jobs a condition selects.

How many values there are is known before any is made. Numbers are taken as the decimal fractions
that they are written as, so that `{range: [0.1, 0.5, 0.1]}` has 0.3, and equal values are
one job in whatever study.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from statistics import NormalDist

from compressor.cases.checks import row_of
from compressor.cases.parameter import Parameter
from compressor.cases.table import table
from compressor.cases.yaml_reader import FileProblem, Node
from compressor.program import did_you_mean, ignore_warnings

# designs of samples, which draw several keys together
SAMPLED = ("random", "lhs", "sobol", "saltelli")
# word -> what stands in its brackets
FORMS = {
    "linspace": "[first, last, count]",
    "logspace": "[first, last, count]",
    "range": "[first, last, step]",
} | dict.fromkeys(SAMPLED, "[least, greatest]")
# of what designs draw, in place of [least, greatest] -> what stands behind the word
DISTRIBUTIONS = {
    "normal": "{mean: number, sd: number}",
    "triangular": "[least, likeliest, greatest]",
}

# keys whose one value is a list
PAIRS = frozenset(row.key for row in table().values() if row.kind == "materials")

Make = Callable[[], list[float]]
Spread = Callable[[float], float]  # of a coordinate in [0, 1)
LEAST_SHARE = 2.0**-54  # argument of a normal distribution's quantile: that of 0 is infinite


@dataclass(frozen=True)
class SweptKey:
    """One swept key. A list has `nodes`; a sampled key's values come from a design by `spread`.

    has_ends: whether these values have a least and a greatest one, as all but normal ones have.
    """

    key: str
    node: Node
    kind: str  # list, or a word of FORMS
    count: int  # 0 for a sampled key: its design has the count
    make: Make = list
    spread: Spread = float
    has_ends: bool = True

    def nodes(self) -> list[Node]:
        """Return the values; those that a form has made have the place of its mapping."""
        return self.node.value if self.kind == "list" else self.placed(self.make())

    def placed(self, values: list[float]) -> list[Node]:
        """Return the made values as nodes."""
        return [Node(value, self.node.place, self.node.key_place) for value in values]


def is_swept(key: str, node: Node) -> bool:
    """Return whether a value stands for many, unlike a pair of materials or an accuracy."""
    if isinstance(node.value, dict):
        return key != "solve.accuracy"
    if not isinstance(node.value, list):
        return False
    return key not in PAIRS or any(isinstance(n.value, list) for n in node.value)


def sweep_of(key: str, node: Node, problems: list[FileProblem]) -> SweptKey | None:
    """Return how a key is swept, or None, what is wrong having joined `problems`."""

    def refuse(message: str, at: Node = node) -> None:
        problems.append(FileProblem(at.place, key, message))

    if isinstance(node.value, list):
        if not node.value:
            refuse("is an empty list")
            return None
        return SweptKey(key, node, "list", len(node.value))
    log = node.value.get("log")
    words = [word for word in node.value if word != "log"]
    if len(words) != 1 or words[0] not in FORMS:
        near = did_you_mean(words[0], FORMS) if words else ""
        hint = f"; {near}" if near else ""
        refuse(f"needs a value, a list of values or a mapping with one of {' '.join(FORMS)}{hint}")
    elif log and (words[0] not in SAMPLED or not isinstance(log.value, bool)):
        refuse(f"log is true or false, and for {' '.join(SAMPLED)} alone", log)
    elif not is_number(row_of(key)):
        refuse(f"is no number, so that {words[0]} cannot sweep it: give a list")
    elif words[0] in SAMPLED and isinstance(node.value[words[0]].value, dict):
        return _sweep_distribution(key, node, words[0], refuse)
    else:
        numbers = _numbers(words[0], node.value[words[0]], refuse)
        if numbers:
            return _sweep_range(key, node, words[0], numbers, bool(log and log.value), refuse)
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


def _sweep_range(
    key: str, node: Node, word: str, numbers: list[Fraction], log: bool,
    refuse: Callable[..., None],
) -> SweptKey | None:  # fmt: skip
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
        return _sampled_key(key, node, word, _spread(float(first), float(last), log))
    return SweptKey(key, node, word, count, make=between(word, first, last, count))


def _sampled_key(
    key: str, node: Node, word: str, spread: Spread, has_ends: bool = True
) -> SweptKey:
    """Return a key that a design draws by a spread; whole numbers are rounded."""
    row = row_of(key)
    if row and row.kind == "integer":
        return SweptKey(
            key, node, word, 0, spread=lambda share: round(spread(share)), has_ends=has_ends
        )
    return SweptKey(key, node, word, 0, spread=spread, has_ends=has_ends)


def _sweep_distribution(
    key: str, node: Node, word: str, refuse: Callable[..., None]
) -> SweptKey | None:
    """Return the sweep by a distribution, such as {lhs: {normal: {mean: 0.2, sd: 0.02}}}."""
    inside = node.value[word]
    names = [*inside.value]
    if len(names) != 1 or names[0] not in DISTRIBUTIONS:
        near = did_you_mean(names[0], DISTRIBUTIONS) if names else ""
        known = " or ".join(f"{{{name}: {form}}}" for name, form in DISTRIBUTIONS.items())
        refuse(f"{word} needs {FORMS[word]}, {known}" + (f"; {near}" if near else ""), inside)
        return None
    if "log" in node.value:
        refuse(f"log is for {FORMS[word]}, not for {names[0]}", node.value["log"])
        return None
    name, body = names[0], inside.value[names[0]]
    numbers = _parts(name, body)
    if not numbers or not _is_distribution(name, numbers):
        needs = "sd above 0" if name == "normal" else "in rising order, the ends different"
        refuse(f"{name} needs {DISTRIBUTIONS[name]}, finite numbers, {needs}", body)
        return None
    row = row_of(key)
    bad = (row.check(end) for end in (numbers[:1] if name == "normal" else numbers) if row)
    if message := next(filter(None, bad), ""):
        refuse(message, body)
        return None
    spread = _normal(*numbers) if name == "normal" else _triangular(*numbers)
    return _sampled_key(key, node, word, spread, name != "normal")


def _parts(name: str, body: Node) -> list[float]:
    """Return the numbers of a distribution in their order; none where anything is wrong."""
    if name == "normal":
        whole = isinstance(body.value, dict) and {*body.value} == {"mean", "sd"}
        items = [body.value[part].value for part in ("mean", "sd")] if whole else []
    else:
        whole = isinstance(body.value, list) and len(body.value) == 3
        items = [item.value for item in body.value] if whole else []
    return [float(item) for item in items] if items and all(map(_is_finite, items)) else []


def _is_distribution(name: str, numbers: Sequence[float]) -> bool:
    """Return whether numbers are those of a distribution."""
    if name == "normal":
        return numbers[1] > 0.0
    return numbers[0] <= numbers[1] <= numbers[2] and numbers[0] < numbers[2]


def _normal(mean: float, sd: float) -> Spread:
    """Return the function that takes [0, 1) to the quantiles of a normal distribution."""
    quantile = NormalDist(mean, sd).inv_cdf
    return lambda share: round_made_value(
        quantile(min(max(share, LEAST_SHARE), 1.0 - 2.0 * LEAST_SHARE))
    )


def _triangular(low: float, middle: float, high: float) -> Spread:
    """Return the function that takes [0, 1) to the quantiles of a triangular distribution."""
    below = (middle - low) / (high - low)

    def spread(share: float) -> float:
        if share < below:
            value = low + math.sqrt(share * (high - low) * (middle - low))
        else:
            value = high - math.sqrt((1.0 - share) * (high - low) * (high - middle))
        return min(max(round_made_value(value), low), high)

    return spread


def between(word: str, first: Fraction, last: Fraction, count: int) -> Make:
    """Return the function that makes `count` values from first to last, in even steps or ratios."""
    low, high = float(first), float(last)

    def even() -> list[float]:
        return [float(first + (last - first) * i / max(count - 1, 1)) for i in range(count)]

    def geometric() -> list[float]:
        inner = (low * (high / low) ** (i / (count - 1)) for i in range(1, count - 1))
        return [low, *map(round_made_value, inner), high]

    return geometric if word == "logspace" else even


def _spread(low: float, high: float, log: bool) -> Spread:
    """Return the function that takes [0, 1) to [low, high), evenly or with even ratios."""

    def spread(share: float) -> float:
        value = low * (high / low) ** share if log else low + (high - low) * share
        return min(max(round_made_value(value), low), high)

    return spread


def round_made_value(value: float) -> float:
    """Return a made value to 12 digits, which print alike wherever its last bits come from."""
    return float(f"{value:.12g}")


def format_count(count: int) -> str:
    """Return a number of jobs as messages write it, however large."""
    return str(count) if count < 10**100 else f"over 10^{int(count.bit_length() * 0.30103) - 1}"


def design_size(kind: str, count: int, keys: int) -> int:
    """Return how many points `design` makes."""
    return count * (keys + 2) if kind == "saltelli" else count


def design(kind: str, count: int, keys: int, seed: int) -> list[list[float]]:
    """Return the points of a sampling design: `count` of `keys` coordinates in [0, 1).

    kind: a word of `SAMPLED`. The same seed gives the same points. `random` is uniform, `lhs` a
    Latin hypercube, `sobol` Sobol's sequence, scrambled, whose balance is best where `count` is a
    power of two. `saltelli` has `count` points A and as many B, both of one Sobol's sequence, and
    then for each coordinate A with that of B in its place: `design_size` points, from which a
    variance-based sensitivity is estimated (Saltelli et al., Computer Physics Communications 181,
    2010, 259-270).
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

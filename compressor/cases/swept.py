"""How values are swept, by lists, ranges or designs: axes of paths and values, which know no key.

How many values there are is known before any is made. Numbers are taken as the decimal fractions
that they are written as, so that `{range: [0.1, 0.5, 0.1]}` has 0.3, and equal values are
one job in whatever study.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from compressor.cases.yaml_reader import Path, is_number
from compressor.program import ignore_warnings

if TYPE_CHECKING:
    import numpy as np

# designs of samples, which draw several keys together
SAMPLED = ("random", "lhs", "sobol", "saltelli")
# word -> what stands in its brackets
FORMS = {
    "linspace": "[first, last, count]",
    "logspace": "[first, last, count]",
    "range": "[first, last, step]",
} | dict.fromkeys(SAMPLED, "[least, greatest]")

Spread = Callable[[float], float]  # of a share in [0, 1)


class NoSweep(ValueError):
    """A value that sweeps nothing: what is wrong, and the path within it."""

    def __init__(self, message: str, *path: str):
        super().__init__(message)
        self.path = path


@dataclass(frozen=True)
class Sweep:
    """How one value is swept; `spread` is that of a drawn one, whose `count` its design has."""

    path: Path
    kind: str  # list, or a word of FORMS
    count: int = 0
    make: Callable[[], list[Any]] = list
    spread: Spread = float

    @property
    def is_drawn(self) -> bool:
        """Return whether a design draws the values."""
        return self.kind in SAMPLED


def sweep_of(path: Path, value: Any, is_whole: bool = False) -> Sweep:
    """Return how a list or a form sweeps a value. Raises NoSweep for one that does not.

    is_whole: whether drawn numbers are rounded to whole ones.
    """
    if isinstance(value, list):
        if not value:
            raise NoSweep("is an empty list")
        return Sweep(path, "list", len(value), lambda: value)
    words, log = [word for word in value if word != "log"], value.get("log")
    if len(words) != 1 or words[0] not in FORMS:
        near = [word for word in words if word in FORMS]
        near += get_close_matches(words[0], FORMS, 1) if len(words) == 1 else []
        meant = [*near, "range" if "step" in words else "linspace"][0]
        raise NoSweep(
            f"needs a value, a list of values or a form such as {{{meant}: {FORMS[meant]}}}; there "
            f"are {', '.join(FORMS)}"
        )
    (word,) = words
    if log is not None and (word not in SAMPLED or not isinstance(log, bool)):
        raise NoSweep(f"log is true or false, and for {' '.join(SAMPLED)} alone", "log")
    numbers = _numbers(FORMS[word], value[word], word)
    if word not in SAMPLED:
        return _made_sweep(path, word, numbers)
    spread = _range(word, numbers, bool(log))
    drawn = (lambda share: round(spread(share))) if is_whole else spread
    return Sweep(path, word, spread=drawn)


def _numbers(form: str, values: Any, word: str) -> list[Fraction]:
    """Return the numbers in the brackets of a word."""
    items = values if isinstance(values, list) else []
    if len(items) != form.count(",") + 1 or not all(map(is_finite, items)):
        raise NoSweep(f"{word} needs {form}, finite numbers", word)
    return [Fraction(str(item)) for item in items]


def is_finite(value: object) -> bool:
    """Return whether a value is a finite number."""
    return is_number(value) and math.isfinite(value)  # type: ignore[arg-type]


def _made_sweep(path: Path, word: str, numbers: list[Fraction]) -> Sweep:
    """Return the sweep of linspace, logspace or range."""
    first, last, third = numbers
    low, high = float(first), float(last)
    if word == "range":
        if not third or (last - first) / third < 0:
            raise NoSweep(f"range never gets from {low:g} to {high:g} by this step", word)
        step, count = third, (last - first) // third + 1
    elif first == last:
        raise NoSweep(f"{word} needs two different ends", word)
    elif word == "logspace" and min(first, last) <= 0:
        raise NoSweep("logspace needs ends above 0", word)
    elif third < 2 or third != int(third):
        raise NoSweep(f"{word} needs a whole count of 2 or more", word)
    else:
        count = int(third)
        step = (last - first) / (count - 1)

    def even() -> list[float]:
        return [float(first + step * i) for i in range(count)]

    def geometric() -> list[float]:
        inner = (low * (high / low) ** (i / (count - 1)) for i in range(1, count - 1))
        return [low, *map(round_made_value, inner), high]

    return Sweep(path, word, count, geometric if word == "logspace" else even)


def _range(word: str, ends: list[Fraction], log: bool) -> Spread:
    """Return the function that takes [0, 1) to a range, evenly or with even ratios."""
    low, high = map(float, ends)
    if low == high:
        raise NoSweep(f"{word} needs two different ends", word)
    if low > high:
        raise NoSweep(f"{word} needs {FORMS[word]}: {low:g} exceeds {high:g}", word)
    if log and low <= 0:
        raise NoSweep("log needs ends above 0", word)

    def spread(share: float) -> float:
        value = low * (high / low) ** share if log else low + (high - low) * share
        return min(max(round_made_value(value), low), high)

    return spread


def round_made_value(value: float) -> float:
    """Return a made value to 12 digits, which print alike wherever its last bits come from."""
    return float(f"{value:.12g}")


def design_size(kind: str, count: int, keys: int) -> int:
    """Return how many points `design` makes."""
    return count * (keys + 2) if kind == "saltelli" else count


def design(kind: str, count: int, keys: int, seed: int) -> "np.ndarray":
    """Return the points of a sampling design: `count` of `keys` coordinates in [0, 1), a row each.

    kind: a word of `SAMPLED`. The same seed gives the same points. `random` is uniform, `lhs` a
    Latin hypercube, `sobol` Sobol's sequence, scrambled, whose balance is best where `count` is a
    power of two. `saltelli` has `count` points A and as many B, both of one Sobol's sequence, and
    then for each coordinate A with that of B in its place: `design_size` points, from which a
    variance-based sensitivity is estimated (Saltelli et al., Computer Physics Communications 181,
    2010, 259-270).
    """
    import numpy as np

    if kind == "saltelli":
        points = design("sobol", count, 2 * keys, seed)
        a, b = points[:, :keys], points[:, keys:]
        mixed = [np.where(np.arange(keys) == key, b, a) for key in range(keys)]
        return np.concatenate([a, b, *mixed])
    generator = np.random.default_rng(seed)
    if kind == "random":
        return generator.random((count, keys))
    from scipy.stats import qmc  # takes half a second

    sampler = {"lhs": qmc.LatinHypercube, "sobol": qmc.Sobol}[kind](keys, seed=generator)
    with ignore_warnings("The balance properties of Sobol"):
        return np.asarray(sampler.random(count))

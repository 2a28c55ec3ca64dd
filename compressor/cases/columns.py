"""Numbers by the column: one for each job of a sweep, so that one call works on all jobs.

A `ArrayValue` stands where a case has a number. What is written for one case, such as a rule of
`conflicts`, then works on all at once, by numpy. Where a condition holds for some jobs alone, it
raises `Mixed`, and the jobs are cut in two (`places_where`).
"""

import operator
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

Axis = tuple[Sequence[Any], np.ndarray]  # a key's values, and which of them each job has, (jobs,)


class Mixed(Exception):
    """A condition that holds for some jobs alone; `holds`: for which, boolean, (jobs,)."""

    def __init__(self, holds: np.ndarray):
        super().__init__("a condition holds for some jobs alone")
        self.holds = holds


def _numbers(value: Any) -> Any:
    return value.numbers if isinstance(value, ArrayValue) else value


def _by(operation: Callable[[Any, Any], Any]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return the operator and its reflection.

    What is neither a number nor a column is left to Python.
    """

    def direct(self: "ArrayValue", other: Any) -> Any:
        if not isinstance(other, ArrayValue | int | float | complex):
            return NotImplemented
        return ArrayValue(operation(self.numbers, _numbers(other)))

    def reflected(self: "ArrayValue", other: Any) -> Any:
        if not isinstance(other, int | float | complex):
            return NotImplemented
        return ArrayValue(operation(other, self.numbers))

    return direct, reflected


def _power(base: Any, exponent: Any) -> np.ndarray:
    """Return the powers as Python takes them: numpy's may differ in the last bit."""
    bases, exponents = np.broadcast_arrays(base, exponent)
    return np.array(list(map(pow, bases.tolist(), exponents.tolist())))


class ArrayValue:
    """The numbers of some jobs, (jobs,), which calculate and compare as one number does.

    A comparison gives a column of truths; its own truth is theirs where all are equal, and raises
    Mixed where they are not. What no column can do raises TypeError.
    """

    __slots__ = ("numbers",)
    __array_ufunc__ = None
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, numbers: np.ndarray):
        self.numbers = numbers

    def __bool__(self) -> bool:
        holds = self.numbers != 0
        if holds.all():
            return True
        if not holds.any():
            return False
        raise Mixed(holds)

    def __round__(self) -> "ArrayValue":
        return ArrayValue(np.rint(self.numbers).astype(np.int64))

    def __abs__(self) -> "ArrayValue":
        return ArrayValue(np.abs(self.numbers))

    __add__, __radd__ = _by(operator.add)
    __sub__, __rsub__ = _by(operator.sub)
    __mul__, __rmul__ = _by(operator.mul)
    __truediv__, __rtruediv__ = _by(operator.truediv)
    __pow__, __rpow__ = _by(_power)
    __lt__, __le__ = _by(operator.lt)[0], _by(operator.le)[0]
    __gt__, __ge__ = _by(operator.gt)[0], _by(operator.ge)[0]
    __eq__, __ne__ = _by(operator.eq)[0], _by(operator.ne)[0]


def places_where(test: Callable[[np.ndarray], bool], count: int) -> np.ndarray:
    """For which of `count` jobs a test holds, boolean, (count,).

    test: of the jobs at some places at once; it may raise Mixed, and is then asked of both parts.
    A division by zero, an overflow and the like raise FloatingPointError.
    """
    found = np.zeros(count, dtype=bool)
    left = [np.arange(count)]
    with np.errstate(divide="raise", over="raise", invalid="raise"):
        while left:
            places = left.pop()
            try:
                found[places] = test(places)
            except Mixed as cut:
                left += [places[cut.holds], places[~cut.holds]]
    return found


def alike(axes: Iterable[Axis], count: int) -> list[np.ndarray]:
    """Return the places of `count` jobs, for each combination of what is no number."""
    codes = np.zeros(count, dtype=np.int64)
    for values, which in axes:
        if not is_numeric(values):
            kinds: dict[tuple[type, str], int] = {}
            code = [kinds.setdefault((type(v), repr(v)), len(kinds)) for v in values]
            _, codes = np.unique(codes * len(kinds) + np.array(code)[which], return_inverse=True)
    order = np.argsort(codes, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(codes[order])) + 1)


def is_numeric(values: Sequence[Any]) -> bool:
    """Return whether all values are floats, so that a column can hold them."""
    return all(type(value) is float for value in values)

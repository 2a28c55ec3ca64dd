"""The keys of a block's jobs, and what does not fit in them, at little cost for each job.

A rule of a case, and a part of its key, read few of its values. An answer is computed once for all
combinations that agree in what it reads; a case is built only where an answer is missing.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from operator import itemgetter
from typing import Any, NamedTuple

from compressor.cases.case import IDENTITY, Case, digest, identity_parts, join_parts
from compressor.cases.checks import value_of
from compressor.cases.combinations import Block
from compressor.cases.conflicts import DECIDES_READING, IN_KEY_IF_READ, RULES, Rule, Watched
from compressor.cases.parameter import Problem

# parts of an identity that are not one group, and what they are made from
MADE_FROM = {
    "span": ("solve", "machine.speed_rpm"),
    "solver": ("solve",),
    "facts": (*IN_KEY_IF_READ, *DECIDES_READING),
}
Rows = Callable[[Sequence[int]], Any]  # of a combination's places: those that decide an answer


class ExaminedJob(NamedTuple):
    """A combination of a block: what does not fit in it, its key, and its values of columns."""

    number: int
    problems: Sequence[Problem]
    key: str
    values: Sequence[Any]


class _Shared:
    """A function of a case, computed once for the combinations that agree in what it reads.

    factors: those that decide the function; None: they are observed, by the keys that it reads.
    """

    def __init__(
        self, block: Block, function: Callable[[Any], Any], factors: tuple[int, ...] | None = None
    ):
        self.block, self.function, self.factors = block, function, factors
        self.answers: dict[tuple[int, ...], tuple[Rows, dict[Any, Any]]] = {}
        self.needs_case = factors is not None and self._are_many(factors)

    def _are_many(self, factors: Sequence[int]) -> bool:
        """Return whether factors have so many rows that hardly two combinations share them."""
        rows = math.prod(len(self.block.factors[factor][1]) for factor in factors)
        return 2 * rows > len(self.block.numbers)

    @property
    def is_constant(self) -> bool:
        """Return whether no factor decides the answer, once it was computed."""
        return () in self.answers

    def answer(self, number: int, places: Sequence[int], case: Case | None) -> Any:
        """Return the answer for a combination; case: that of the combination, if it is built."""
        if self.needs_case:
            return self.function(case or self.block.case(number))
        for rows_of, answers in self.answers.values():
            rows = rows_of(places)
            if rows in answers:
                return answers[rows]
        case = case or self.block.case(number)
        if self.factors is None:
            read: set[str] = set()
            answer = self.function(Watched(case, read.add))
            factors = self.block.factors_of(read)
        else:
            answer, factors = self.function(case), self.factors
        if factors not in self.answers:
            self.needs_case = self._are_many(factors)
            self.answers[factors] = (itemgetter(*factors) if factors else _no_rows), {}
        rows_of, answers = self.answers[factors]
        answers[rows_of(places)] = answer
        return answer


def _no_rows(places: Sequence[int]) -> None:
    """Return the rows that decide what no factor decides."""


def examine_jobs(block: Block, columns: Sequence[str]) -> Iterator[ExaminedJob]:
    """Yield the jobs of a block; columns: the keys whose values are wanted.

    A job in which something does not fit has no key and no values.
    """
    if not block.numbers:
        return
    rules = [_Shared(block, partial(_misfits, rule, block.given)) for rule in RULES]
    parts = _parts(block)
    values = _Shared(block, partial(_values, columns), block.factors_within(columns))
    same: dict[str, str] = {}  # parts of the key that are the same in all jobs
    for number in block.numbers:
        places = block.places(number)
        needed = any(one.needs_case for one in (*rules, *parts, values))
        case = block.case(number) if needed else None
        if problems := [one for rule in rules for one in rule.answer(number, places, case)]:
            yield ExaminedJob(number, problems, "", ())
            continue
        texts = dict(same)
        for part in parts:
            texts |= part.answer(number, places, case)
        key = digest(join_parts(texts))
        yield ExaminedJob(number, (), key, values.answer(number, places, case))
        if not same:  # what is constant is known after the first good job
            rules = [rule for rule in rules if not rule.is_constant]
            for part in [part for part in parts if part.is_constant]:
                same |= part.answer(number, places, case)
                parts.remove(part)


def _misfits(rule: Rule, given: frozenset[str], case: Case) -> list[Problem]:
    return [*rule(case, given)]


def _values(keys: Sequence[str], case: Case) -> list[Any]:
    return [value_of(case, key) for key in keys]


def _parts(block: Block) -> list[_Shared]:
    """Return the parts of a key, those together that depend on the same factors."""
    names: dict[tuple[int, ...], set[str]] = {}
    for name in IDENTITY:
        names.setdefault(block.factors_within(MADE_FROM.get(name, (name,))), set()).add(name)
    return [
        _Shared(block, partial(identity_parts, names=some), factors)
        for factors, some in names.items()
    ]

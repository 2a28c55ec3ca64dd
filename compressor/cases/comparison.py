"""Comparisons of keys with values, joined by `and`, `or` and `not`.

    clearance_mm >= 0.2 and not (load == none or machine.speed_rpm < 300)

They select jobs (`--only`, `exclude`), and say under which condition a case reads a key. Python's
parser reads a text into a tree; only comparisons may be in it, and nothing is ever run. Values mean
what they mean in a case file: `true` is a boolean and `none` a word. Numbers are compared by size,
words only with `==` and `!=`. Numbers are equal that are printed alike, in six digits: what `plan`
prints can be copied. A key that has no value differs from every value.
"""

import ast
import contextlib
import operator
import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from compressor.cases.checks import getter, row_of, suggestion
from compressor.cases.parameter import quote_value
from compressor.cases.table import GROUPS
from compressor.cases.yaml_reader import resolve_scalar
from compressor.digits import setting
from compressor.program import ignore_warnings

MAX_LENGTH = 1000  # characters
# what Python would read as more than a comparison: a comment, a string, letters like ours
BARRED = re.compile(r"[^\w\s.()<>=!+-]|\d_\d", re.ASCII)
LONE_EQUAL = re.compile(r"(?<![<>=!])=(?!=)")
SIGNS: dict[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge,
}  # fmt: skip
EQUAL = (operator.eq, operator.ne)
SUCH_AS = "write such as clearance_mm > 0.2 and load == gas"

Value = Callable[[str], Any]  # a key -> a job's value, or None
Test = Callable[[Value], bool]


class NoComparison(ValueError):
    """A text that is no comparison."""


def comparison(text: str) -> Test:
    """Return the test of a job that a text means. Raises NoComparison for one that means none."""
    try:
        return _test(_tree(text), lambda node: _compare_job(*_parts(node)))
    except RecursionError as error:
        raise NoComparison("is nested too deeply") from error


@lru_cache(None)
def condition(text: str) -> Callable[[Any], bool]:
    """Return the test of a case that one of our texts means; a bare key holds if it has a value."""

    def compare(node: ast.expr) -> Callable[[Any], bool]:
        if isinstance(node, ast.Name | ast.Attribute):
            get = getter(ast.unparse(node))
            return lambda case: bool(get(case))
        key, sign, wanted = _parts(node)
        return _compare(getter(key), sign, resolve_scalar(wanted))

    return _test(_tree(text), compare)


def _tree(text: Any) -> ast.expr:
    """Return the tree of a text; it may still hold what is no comparison."""
    if not isinstance(text, str):
        raise NoComparison("needs comparisons, such as clearance_mm > 0.2")
    if len(text) > MAX_LENGTH:
        raise NoComparison(f"is longer than {MAX_LENGTH} characters")
    code = re.sub(r"\s", " ", text).strip()
    if LONE_EQUAL.search(code):
        raise NoComparison("write == for equal")
    if not BARRED.search(code):
        with contextlib.suppress(SyntaxError, MemoryError), ignore_warnings():  # of `1or`
            return ast.parse(code, mode="eval").body
    raise NoComparison(f"cannot be read: {SUCH_AS}; write numbers without their unit")


def _test(node: ast.expr, compare: Callable[[ast.expr], Callable[[Any], bool]]) -> Any:
    """Return the test that a node means; compare: the function that makes that of a comparison."""
    if isinstance(node, ast.BoolOp):
        join = all if isinstance(node.op, ast.And) else any
        tests = [_test(part, compare) for part in node.values]
        return lambda subject: join(test(subject) for test in tests)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        inner = _test(node.operand, compare)
        return lambda subject: not inner(subject)
    return compare(node)


def _parts(node: Any) -> tuple[str, Any, str]:
    """Return the key, the sign and the value, as it is written, of a comparison."""
    one = isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in SIGNS
    if one and isinstance(node.left, ast.Name | ast.Attribute):
        sign, value = SIGNS[type(node.ops[0])], ast.unparse(node.comparators[0])
        return ast.unparse(node.left), sign, value
    what = quote_value(ast.unparse(node))
    raise NoComparison(f"needs a key, a sign and a value in place of {what}: {SUCH_AS}")


def _compare_job(key: str, sign: Any, text: str) -> Test:
    """Return the test of one comparison with a value of a key in the table."""
    row, wanted = row_of(key), resolve_scalar(text)
    if key in GROUPS:
        raise NoComparison(f"{key} is a group: compare one of its keys")
    if row is None:
        raise NoComparison(f"unknown key {quote_value(key)}{suggestion(key, '')}")
    if row.kind in ("materials", "text", "card"):
        raise NoComparison(f"{key} cannot be compared")
    wanted = row.choice_of(wanted)
    word = wanted if row.is_number else key
    if isinstance(word, str) and sign not in EQUAL and (word == key or word in row.choices):
        raise NoComparison(f"{word} is a word: compare it by == or !=")
    if wanted not in row.choices and (
        type(wanted) not in (int, float) if row.is_number else row.check(wanted)
    ):
        raise NoComparison(f"{key} needs {'a number' if row.is_number else row.needed}, not {text}")
    return _compare(lambda value: value(key), sign, wanted)


def print_number(value: Any) -> Any:
    """Return a number as the program prints it; a word, or no value, as it is."""
    return setting(value) if isinstance(value, int | float) else value


def _compare(get: Callable[[Any], Any], sign: Any, wanted: Any) -> Callable[[Any], bool]:
    """Return the test of one value; a word, or no value, is neither more nor less than a number."""
    if sign in EQUAL:
        printed = print_number(wanted)
        return lambda subject: bool(sign(print_number(get(subject)), printed))

    def test(subject: Any) -> bool:
        found = get(subject)
        return found is not None and not isinstance(found, str) and bool(sign(found, wanted))

    return test

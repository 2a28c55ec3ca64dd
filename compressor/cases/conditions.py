"""Which jobs are meant: comparisons of keys with values, joined by `and`, `or` and `not`.

    clearance_mm >= 0.2 and not (load == none or machine.speed_rpm < 300)

Python's parser reads a text into a tree; only the nodes named here may be in it, and nothing is
ever run. Values mean what they mean in a case file: `true` is a boolean and `none` a word. Numbers
are compared by size, words only with `==` and `!=`. A key that a job has no value for differs from
every value.
"""

import ast
import itertools
import operator
import re
from collections.abc import Callable
from typing import Any, NoReturn

from compressor.cases.parameter import Parameter, shown
from compressor.cases.shorthands import row_of
from compressor.cases.swept import is_number
from compressor.cases.unknown import suggestion
from compressor.cases.yaml_reader import resolved, shortened
from compressor.program import ignore_warnings

MAX_LENGTH = 1000  # characters
MAX_DEPTH = 50  # of parentheses, and of `not`
# what Python would read as more than a comparison: a lone =, a comment, a string, letters like ours
BARRED = re.compile(r"(?<![<>=!])=(?!=)|[^\w\s.()<>=!+-]", re.ASCII)
LEADING_ZEROS = re.compile(r"(?<![\w.])0+(?=\d)")  # which Python's numbers cannot have
TOKEN = re.compile(r"[<>=!]=|[\w.]+|\S")
SIGNS: dict[type[ast.cmpop], tuple[str, Callable[[Any, Any], bool]]] = {
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
}
WRITTEN = tuple(sign for sign, _ in SIGNS.values())
NEEDS_KEY = "needs a key, such as clearance_mm"
UNREADABLE = "cannot be read"
NEEDS_SIGN = f"needs one of {' '.join(WRITTEN)} after "
NEEDS_JOIN = "needs `and` or `or` before this"

Value = Callable[[str], Any]  # a key -> a job's value, or None
Test = Callable[[Value], bool]


class NoComparison(ValueError):
    """A text that is no comparison."""


def comparison(text: str) -> Test:
    """Return the test that a text means. Raises NoComparison, which tells where and why."""
    if len(text) > MAX_LENGTH:
        raise NoComparison(f"is longer than {MAX_LENGTH} characters")
    reader = _Reader(text)
    return reader.test(reader.tree(), 0)


class _Reader:
    """Turns the tree of a text into a test.

    `code` is what Python's parser gets: the text from its first word, with spaces for other white
    space and for leading zeros, so that places in it are `indent` before those in the text.
    """

    def __init__(self, text: str):
        self.text, self.indent = text, len(text) - len(text.lstrip())
        spaced = re.sub(r"\s", " ", text.lstrip())
        self.code = LEADING_ZEROS.sub(lambda zeros: " " * len(zeros[0]), spaced)

    def refuse(self, at: int, message: str) -> NoReturn:
        """Raise NoComparison about what stands at a place of the code."""
        rest = self.text[self.indent + at :].lstrip()
        where = f"character {len(self.text) - len(rest) + 1}, {shown(shortened(rest, 20))}"
        raise NoComparison(f"{message} (at {where if rest else 'the end'})")

    def tree(self) -> ast.expr:
        """Return the tree of the code; it may still hold what is no comparison."""
        if barred := BARRED.search(self.code):
            self.refuse(barred.start(), "write == for equal" if barred[0] == "=" else UNREADABLE)
        depths = itertools.accumulate((c == "(") - (c == ")") for c in self.code)
        if deep := [at for at, depth in enumerate(depths) if depth > MAX_DEPTH]:
            self.refuse(deep[0], f"is nested deeper than {MAX_DEPTH} levels")
        try:
            with ignore_warnings():  # of `1or`, which Python may refuse one day
                tree = ast.parse(self.code, mode="eval").body
        except SyntaxError as error:
            self.refuse(*_misfit(self.code, error))
        except (RecursionError, MemoryError):
            self.refuse(0, "is nested too deeply")
        for node in ast.walk(tree):
            if isinstance(node, ast.Call):  # a parenthesis after a whole comparison
                self.refuse(self.beyond(node.func), NEEDS_JOIN)
        return tree

    def beyond(self, node: ast.expr) -> int:
        """Return where the code goes on after a node and the parentheses around it."""
        end = node.end_col_offset or 0
        return len(self.code) - len(self.code[end:].lstrip(" )"))

    def written(self, node: ast.expr) -> str:
        """Return a key, a word or a number as it is written; "" for anything else."""
        if not isinstance(node, ast.Name | ast.Attribute | ast.Constant):
            return ""
        return self.code[node.col_offset : node.end_col_offset].replace(" ", "")

    def test(self, node: ast.expr, depth: int) -> Test:
        """Return the test that a node means."""
        if depth > MAX_DEPTH:
            self.refuse(node.col_offset, f"is nested deeper than {MAX_DEPTH} levels")
        if isinstance(node, ast.BoolOp):
            join = all if isinstance(node.op, ast.And) else any
            tests = [self.test(part, depth) for part in node.values]
            return lambda value: join(test(value) for test in tests)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            inner = self.test(node.operand, depth + 1)
            return lambda value: not inner(value)
        return self.compared(node)

    def compared(self, node: ast.expr) -> Test:
        """Return the test of one comparison of a key with a value."""
        left = node.left if isinstance(node, ast.Compare) else node
        while isinstance(left, ast.BinOp):
            left = left.left
        key, row = self.key(left)
        after = self.beyond(left)
        if not isinstance(node, ast.Compare) or left is not node.left:
            self.refuse(after, NEEDS_SIGN + key)
        if type(node.ops[0]) not in SIGNS:
            self.refuse(after, NEEDS_SIGN + key)
        sign, compare = SIGNS[type(node.ops[0])]
        numeric = is_number(row)
        if not numeric and sign not in ("==", "!="):
            self.refuse(after, f"{key} is a word: compare it by == or !=")
        right = node.comparators[0]
        wanted = row.choice_of(self.value(right))
        word = wanted in row.choices and sign in ("==", "!=")
        if not (word or (type(wanted) in (int, float) if numeric else not row.check(wanted))):
            self.refuse(right.col_offset, f"{key} needs {'a number' if numeric else row.range}")
        if len(node.ops) > 1:
            self.refuse(self.beyond(right), NEEDS_JOIN)
        missing = sign == "!="

        def test(value: Callable[[str], Any]) -> bool:
            found = value(key)
            if found is None or isinstance(found, str) is not isinstance(wanted, str):
                return missing  # a word is neither more nor less than a number
            return bool(compare(found, wanted))

        return test

    def key(self, node: ast.expr) -> tuple[str, Parameter]:
        """Return a key that can be compared, and the row that its values keep."""
        key = self.written(node)
        if not key or isinstance(node, ast.Constant):
            self.refuse(node.col_offset, NEEDS_KEY)
        row = row_of(key)
        if row is None:
            self.refuse(node.col_offset, f"unknown key {shown(key)}{suggestion(key, '')}")
        if row.kind in ("materials", "text"):
            self.refuse(node.col_offset, f"{key} cannot be compared")
        return key, row

    def value(self, node: ast.expr) -> Any:
        """Return what a number or a word means in a case file; None for anything else."""
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            sign = "-" if isinstance(node.op, ast.USub) else "+"
            return resolved(sign + self.written(node.operand))
        return resolved(self.written(node))


def _misfit(code: str, error: SyntaxError) -> tuple[int, str]:
    """Return where a code cannot be read and why: words that cannot be neighbours, or Python's
    error.
    """
    earlier, before = "", ""
    ends, opened = False, 0  # ends: whether a comparison may end with `before`
    for token in TOKEN.finditer(code):
        word, at = token[0], token.start()
        needs_more = word in ("(", "not", "+", "-")
        named = word not in ("and", "or", "not") and (word[0].isalnum() or word[0] in "_.")
        if ends and (named or word in ("(", "not")):
            return at, NEEDS_JOIN if earlier in WRITTEN or before == ")" else NEEDS_SIGN + before
        if not (ends or named or needs_more):
            return at, _missing(before)
        opened += (word == "(") - (word == ")")
        if opened < 0:
            return at, "has no opening parenthesis for this"
        earlier, before, ends = before, word, named or word == ")"
    if not ends:
        return len(code), _missing(before)
    if opened:
        return len(code), "needs a closing parenthesis"
    unit = ": write numbers without their unit" if "literal" in error.msg else ""
    return error.offset - 1 if error.offset else len(code), UNREADABLE + unit


def _missing(before: str) -> str:
    """Return what is missing after a word of a code, "" at its beginning."""
    return f"needs a value after {before}" if before in (*WRITTEN, "+", "-") else NEEDS_KEY

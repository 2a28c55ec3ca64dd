"""Which jobs are meant: comparisons of keys with values, joined by `and`, `or` and `not`.

    either  := both ("or" both)*
    both    := term ("and" term)*
    term    := "not" term | "(" either ")" | key sign value
    sign    := "==" | "!=" | "<" | "<=" | ">" | ">="

A grammar of its own, so that nothing in a text is ever run. Numbers are compared by size, words
only with `==` and `!=`. A key that a job has no value for differs from every value.
"""

import operator
import re
from collections.abc import Callable
from typing import Any

from compressor.cases.keys import suggestion
from compressor.cases.parameter import Parameter, shown
from compressor.cases.shorthands import row_of
from compressor.cases.swept import is_number
from compressor.cases.yaml_reader import REAL, resolved, shortened

MAX_LENGTH = 1000  # characters
MAX_DEPTH = 50  # of parentheses and `not`
TOKEN = re.compile(rf"[<>=!]=|[<>()]|[A-Za-z_][A-Za-z0-9_.]*|{REAL.pattern}")
SIGNS: dict[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
JOINING = ("and", "or", "not")

Value = Callable[[str], Any]  # a key -> a job's value, or None
Test = Callable[[Value], bool]


class NoComparison(ValueError):
    """A text that does not follow the grammar."""


def comparison(text: str) -> Test:
    """The test that a text means. Raises NoComparison, which tells where and why."""
    if len(text) > MAX_LENGTH:
        raise NoComparison(f"is longer than {MAX_LENGTH} characters")
    parser = _Parser(text)
    test = parser.either(0)
    if parser.token:
        parser.refuse("needs `and` or `or` before this")
    return test


class _Parser:
    """Reads a text token by token; `token` is the next one, "" at the end, and stands at `at`."""

    def __init__(self, text: str):
        self.text, self.token, self.at, self.end = text, "", 0, 0
        self.advance()

    def refuse(self, message: str) -> None:
        rest = self.text[self.at :]
        where = (
            f"at character {self.at + 1}, {shown(shortened(rest, 20))}" if rest else "at the end"
        )
        raise NoComparison(f"{message} ({where})")

    def advance(self) -> str:
        """Go on to the next token; gives the one that is left behind."""
        old = self.token
        self.at = len(self.text) - len(self.text[self.end :].lstrip())
        found = TOKEN.match(self.text, self.at)
        if not found and self.at < len(self.text):
            hint = "write == for equal" if self.text[self.at] == "=" else "cannot be read"
            self.refuse(hint)
        self.token, self.end = (found[0], found.end()) if found else ("", self.at)
        return old

    def either(self, depth: int) -> Test:
        return self.joined("or", any, lambda: self.joined("and", all, lambda: self.term(depth)))

    def joined(self, word: str, join: Callable[..., bool], part: Callable[[], Test]) -> Test:
        tests = [part()]
        while self.token == word:
            self.advance()
            tests.append(part())
        return tests[0] if len(tests) == 1 else lambda value: join(test(value) for test in tests)

    def term(self, depth: int) -> Test:
        if depth > MAX_DEPTH:
            self.refuse(f"is nested deeper than {MAX_DEPTH} levels")
        if self.token == "not":
            self.advance()
            inner = self.term(depth + 1)
            return lambda value: not inner(value)
        if self.token != "(":
            return self.compared()
        self.advance()
        inner = self.either(depth + 1)
        if self.token != ")":
            self.refuse("needs a closing parenthesis")
        self.advance()
        return inner

    def compared(self) -> Test:
        """One comparison of a key with a value."""
        row = self.row()
        key = self.advance()
        if self.token not in SIGNS:
            self.refuse(f"needs one of {' '.join(SIGNS)} after {key}")
        numeric = is_number(row)
        if not numeric and self.token not in ("==", "!="):
            self.refuse(f"{key} is a word: compare it by == or !=")
        sign = self.advance()
        wanted = resolved(self.token)
        if not self.token or self.token in (*SIGNS, *JOINING, "(", ")"):
            self.refuse(f"needs a value after {sign}")
        if not (isinstance(wanted, int | float) if numeric else not row.check(wanted)):
            self.refuse(f"{key} needs {'a number' if numeric else row.range}")
        self.advance()
        missing = sign == "!="
        return lambda value: (
            missing if (found := value(key)) is None else SIGNS[sign](found, wanted)
        )

    def row(self) -> Parameter:
        """The row of the key that comes next."""
        key = self.token
        if not key or not (key[0].isalpha() or key[0] == "_") or key in JOINING:
            self.refuse("needs a key, such as clearance_mm")
        row = row_of(key)
        if row is None:
            self.refuse(f"unknown key {shown(key)}{suggestion(key, '')}")
        elif row.kind in ("materials", "text"):
            self.refuse(f"{key} cannot be compared")
        assert row
        return row

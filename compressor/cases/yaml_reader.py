"""Strict YAML 1.2: a text -> plain values, and where each of them stands.

PyYAML's composer reads; what a scalar means is decided here, by the core schema of YAML 1.2, so
that `1e5` is a number and `no` is text. A key that is given twice is noted with its place, and
reading goes on; broken syntax, aliases and tags end it.
"""

import math
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import yaml
from yaml.constructor import ConstructorError

from compressor.program import CompsimError, printable

START = "compsim init writes a case file to start from"
MAX_BYTES = 1 << 20

DECIMALS = re.compile(r"0\d+")  # behind a decimal comma, as in [0,05]
DECIMAL_COMMA = "a comma in a number? write {}; commas separate values"
NO_LIST = "several values are a list: write [{}, {}]"
NULLS = {"", "~", "null", "Null", "NULL"}
BOOLEANS = {"true": True, "True": True, "TRUE": True}
BOOLEANS |= {"false": False, "False": False, "FALSE": False}
INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
REAL = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")

Path = tuple[str | int, ...]  # of a value: the keys and the numbers in lists that lead to it


@dataclass(frozen=True, order=True)
class Place:
    """The place of a value; line and column count from 1, line 0 means the file as a whole."""

    file: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        name = printable(self.file)
        return f"{name}:{self.line}:{self.column}" if self.line else name


@dataclass(frozen=True)
class Problem:
    """What is wrong with one key of a case, and where in a file; key and place may be empty."""

    key: str
    message: str
    place: Place = Place("")

    def __str__(self) -> str:
        parts = (str(self.place), shorten(printable(self.key)), printable(self.message))
        return ": ".join(part for part in parts if part)


Places = Mapping[Path, tuple[Place, Place]]  # by path the place of a key and its value


@dataclass(frozen=True)
class Tree:
    """The plain values of a text, and where they stand; an item of a list has its place twice."""

    values: Any
    places: Places

    def at(self, *path: str | int) -> tuple[Place, Place]:
        """Return where the key and the value at a path stand, or what holds them."""
        while path and path not in self.places:
            path = path[:-1]
        return self.places[path]

    def problem(self, path: Path, message: str, of_key: bool = False) -> Problem:
        """Return what is wrong with the value at a path, or with its key."""
        return Problem(".".join(map(str, path)), message, self.at(*path)[not of_key])


Read = tuple[Tree | None, list[Problem]]  # None where nothing could be read


def shorten(text: str, most: int = 60) -> str:
    """Return the text of at most `most` characters."""
    return text if len(text) <= most else text[: most - 3] + "..."


def read_file(path: str) -> Read:
    """Return the content of a case file, and what is wrong with it."""
    try:
        with open(path, "rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        message = f"cannot be read: {getattr(error, 'strerror', None) or error}"
        hint = f"; {START}" * isinstance(error, FileNotFoundError)
        if isinstance(error, IsADirectoryError):
            hint = f"; give the files in it, compsim run {shlex.quote(path.rstrip('/'))}/*.yaml"
        return None, [Problem("", message + hint, Place(path))]
    if len(data) > MAX_BYTES:
        return None, [Problem("", "is larger than 1 MiB: no case file", Place(path))]
    try:
        text = data.decode().removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        place = _place_after(path, data[: error.start].decode())
        return None, [Problem("", "is not UTF-8 text; a case file is YAML", place)]
    return read_text(text, Place(path, 1, 1))


def read_text(text: str, start: Place) -> Read:
    """Return the values of a YAML text, and its problems.

    A `start` without a line is everything's place.
    """
    reader = _Reader(start)
    try:
        root = _Loader(text).get_single_node()
        values = root and reader.plain(root, (), reader.place(root))
    except yaml.MarkedYAMLError as error:
        return None, [_tell_syntax(text, error, start)]
    except yaml.reader.ReaderError as error:
        place = _place_after(start.file, text[: error.position]) if start.line else start
        told = f"must not hold the character U+{ord(text[error.position]):04X}"
        return None, [Problem("", told, place)]
    except (ValueError, OverflowError, RecursionError) as error:  # PyYAML on "\UFFFFFFFF"
        deep = isinstance(error, RecursionError)
        told = "is nested too deeply" if deep else "is no YAML: a number is too large here"
        return None, [Problem("", told, start)]
    if root is None:
        return None, [Problem("", f"is empty{f'; {START}' if start.line else ''}", start)]
    return Tree(values, reader.places), reader.problems


class _Loader(yaml.SafeLoader):
    """PyYAML's composer; what no case file has ends it."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        event = self.peek_event()
        if isinstance(event, yaml.AliasEvent):
            told = "aliases (*) are not allowed; write the value out"
        elif getattr(event, "tag", None) is not None:
            told = "tags (!) are not allowed"
        else:
            return super().compose_node(parent, index)
        raise ConstructorError(problem=told, problem_mark=event.start_mark)


class _Reader:
    """Nodes of PyYAML's to plain values, with their places and what is wrong with them."""

    def __init__(self, start: Place):
        self.start = start
        self.places: dict[Path, tuple[Place, Place]] = {}
        self.problems: list[Problem] = []

    def place(self, node: Any) -> Place:
        """Return where a node stands."""
        mark, start = node.start_mark, self.start
        return Place(start.file, mark.line + 1, mark.column + 1) if start.line else start

    def note(self, node: Any, path: Path, message: str) -> None:
        """Note what is wrong with a node."""
        key = ".".join(str(name) for name in path if isinstance(name, str))
        self.problems.append(Problem(key, message, self.place(node)))

    def plain(self, node: Any, path: Path, key_place: Place) -> Any:
        """Return the value of a node, and keep where it stands."""
        self.places[path] = key_place, self.place(node)
        if isinstance(node, yaml.MappingNode):
            return self.mapping(node, path)
        if isinstance(node, yaml.SequenceNode):
            return self.items(node, path)
        return resolve_scalar(node.value) if node.style is None else node.value

    def mapping(self, node: Any, path: Path) -> dict[str, Any]:
        """Return the values of a mapping by key."""
        found: dict[str, Any] = {}
        before, last = node.start_mark.index, None  # where the item before ends, and its value
        for name_node, inner in node.value:
            name, apart = name_node.value, name_node.start_mark.index - before
            before = inner.end_mark.index
            whole = (*path, name)
            if not isinstance(name, str) or not name or not name.isprintable():
                self.note(name_node, path, "a key must be plain text")
            elif is_number(last) and is_number(resolve_scalar(name)) and inner.value == "":
                told = NO_LIST.format(last, name)
                if apart == 1 and name.isdecimal() and isinstance(last, int):
                    told = DECIMAL_COMMA.format(read_comma(str(last), name))
                self.note(name_node, (*path, [*found][-1]), told)
            elif name in found:
                first = self.places[whole][0]
                line = f" at line {first.line}" if first.line else ""
                self.note(name_node, whole, f"is given twice; first{line}")
            else:
                found[name] = last = self.plain(inner, whole, self.place(name_node))
        return found

    def items(self, node: Any, path: Path) -> list[Any]:
        """Return the values of a list."""
        found: list[Any] = []
        for number, item in enumerate(node.value):
            text = item.value if isinstance(item, yaml.ScalarNode) and not item.style else ""
            if found and DECIMALS.fullmatch(text):
                self.note(item, path, DECIMAL_COMMA.format(read_comma(str(found[-1]), text)))
            found.append(self.plain(item, (*path, number), self.place(item)))
        return found


def _tell_syntax(text: str, error: yaml.MarkedYAMLError, start: Place) -> Problem:
    """Return what is wrong with the syntax of a text; a beginner's slip at its own line."""
    mark, told = error.problem_mark or error.context_mark, str(error.problem)
    line, column = (mark.line, mark.column) if mark else (0, 0)
    place = Place(start.file, line + 1, column + 1) if start.line and mark else start
    if isinstance(error, ConstructorError):  # YAML, but no case file's
        return Problem("", told, place)
    if told == "but found another document":
        return Problem("", "a second document begins here; a case file holds one", place)
    if "'\\t'" in told:
        return Problem("", f"is no YAML: {told}; indent with spaces, not tabs", place)
    if mark and start.line and (slip := find_slip(text, line)):
        return Problem("", slip[1], Place(start.file, slip[0] + 1, 1))
    return Problem("", f"is no YAML: {shorten(told, 120)}", place)


def find_slip(text: str, last: int) -> tuple[int, str] | None:
    """Return the line (from 0) at which a beginner's mistake stands, and what to do; or None.

    last: the line that a parser stopped at, often the one behind the mistake.
    """
    lines = enumerate(text.split("\n")[: last + 1])
    filled = [(n, line) for n, line in lines if line.strip() and line.strip()[0] != "#"][-2:]
    for number, line in filled:
        if found := NO_SPACE.match(line):
            return number, f"put a space after the colon: {found[1]}: {found[2]}"
        if found := EQUALS.match(line):
            return number, f"write a colon and a space in place of =: {found[1]}: {found[2]}"
    first, second = (len(line) - len(line.lstrip()) for _, line in [*filled, *filled][:2])
    if first == second or not KEY.match(filled[-1][1]):
        return None
    return filled[-1][0], (
        f"is indented by {second} columns, the line before by {first}: keys of one group stand in "
        "one column, and a group's own line ends in its colon"
    )


NO_SPACE = re.compile(r"\s*([A-Za-z]\w*):([^\s:/][^:]*?)\s*(?:#.*)?$")
EQUALS = re.compile(r"\s*([A-Za-z]\w*)\s*=\s*(.*?)\s*(?:#.*)?$")
KEY = re.compile(r"\s*[A-Za-z]\w*\s*:(\s|$)")


def _place_after(path: str, before: str) -> Place:
    """Return the place that follows the text `before`."""
    return Place(path, before.count("\n") + 1, len(before) - before.rfind("\n"))


def read_comma(whole: str, behind: str) -> str:
    """Return what to write of a number before and behind a comma, in its likely readings.

    >>> read_comma("0", "05"), read_comma("1", "000"), read_comma("500", "5")
    ('0.05', '1.000, or 1000 for thousands', '500.5, or [500, 5] for two values')
    """
    readings = [f"{whole}.{behind}"]
    if len(behind) == 3 and behind.isdecimal() and whole.strip("+-") != "0":
        readings.append(f"{whole}{behind} for thousands")
    if len(whole) > 2:
        readings.append(f"[{whole}, {behind}] for two values")
    return ", or ".join(readings[-2:])


def is_number(value: Any) -> bool:
    """Return whether a value is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def resolve_scalar(text: str) -> Any:
    """Return what a plain scalar means in the core schema of YAML 1.2."""
    if text in NULLS:
        return None
    if text in BOOLEANS:
        return BOOLEANS[text]
    if NOT_FINITE.fullmatch(text):
        return float(text.replace(".", ""))
    if INTEGER.fullmatch(text):
        # of many digits it is none that any key takes, and none that Python reads
        return int(text, 0 if text[:2] in ("0o", "0x") else 10) if len(text) < 300 else math.inf
    return float(text) if REAL.fullmatch(text) else text


class CaseFileError(CompsimError, ValueError):
    """Case files that cannot be read; raised by `load_cases`. Also a ValueError.

    `problems` lists everything wrong in all files, each with its `place` (file, line, column), its
    dotted `key` and a `message`. The error's text has a line for each:

    >>> import compressor
    >>> with open("typo.yaml", "w") as file:
    ...     print("joint: top\\nclearance: 0.2", file=file)
    >>> try:
    ...     compressor.load_cases("typo.yaml")
    ... except compressor.CaseFileError as error:
    ...     print(error)
    typo.yaml:1:8: joint: needs none, big_end, small_end or both, not 'top'
    typo.yaml:2:1: clearance: unknown key; did you mean clearance_mm?
    """

    prefix = ""  # each line begins with the file that it is about

    def __init__(self, problems: Sequence[Problem]):
        self.problems = sorted(set(problems), key=attrgetter("place", "key", "message"))
        super().__init__(self.problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))

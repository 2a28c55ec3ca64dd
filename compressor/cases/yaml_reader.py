"""Strict YAML 1.2: a text -> a tree of values with their places.

PyYAML's composer reads; what a scalar means is decided here, by the core schema of YAML 1.2, so
that `1e5` is a number and `no` is text. A value that is missing, or given twice, is noted with its
place, and reading goes on; broken syntax, aliases, tags and oversized files end it.
"""

import contextlib
import math
import re
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import yaml

from compressor.cases.parameter import NO_VALUE
from compressor.program import CompsimError, did_you_mean, printable

MAX_LOOKED_AT = 1000  # files of a folder
START = "compsim init writes a case file to start from"


def unreadable(path: str, error: OSError | ValueError) -> str:
    """Return why a file cannot be read, and what to give in its place."""
    message = f"cannot be read: {getattr(error, 'strerror', None) or error}"
    if isinstance(error, IsADirectoryError):
        return (
            f"{message}; give the files in it, compsim run {shlex.quote(path.rstrip('/'))}/*.yaml"
        )
    if not isinstance(error, FileNotFoundError):
        return message
    with contextlib.suppress(OSError):
        near = {one.stem: one for one in islice(Path(path).parent.glob("*.y*ml"), MAX_LOOKED_AT)}
        return f"{message}; {did_you_mean(Path(path).stem, near, near) or START}"
    return f"{message}; {START}"


MAX_BYTES = 1 << 20
MAX_DEPTH = 20
MAX_PARTS = 50_000  # keys, values and brackets, which take a second

OTHER_YAML = re.compile(r"%YAML (?!1\.2\s)")
NOT_ZERO = re.compile("[^eE]*[1-9]")
ODD_BREAKS = re.compile("[\x85\u2028\u2029]")  # lines for PyYAML, not for YAML 1.2 or an editor

DECIMALS = re.compile(r"0\d+")  # behind a decimal comma, as in [0,05]
NULLS = {"", "~", "null", "Null", "NULL"}
BOOLEANS = {"true": True, "True": True, "TRUE": True}
BOOLEANS |= {"false": False, "False": False, "FALSE": False}
INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
REAL = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")


@dataclass(frozen=True, order=True)
class Place:
    """The place of a value; line and column count from 1, line 0 means the file as a whole."""

    file: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        name = printable(self.file)
        return f"{name}:{self.line}:{self.column}" if self.line else name


@dataclass(frozen=True, order=True)
class FileProblem:
    """What is wrong with one key of a case file, and where; the key may be empty."""

    place: Place
    key: str
    message: str

    def __str__(self) -> str:
        parts = (str(self.place), shorten(printable(self.key)), printable(self.message))
        return ": ".join(part for part in parts if part)


@dataclass(frozen=True)
class Node:
    """A value and its place: a scalar, a list of nodes or a dict of them; None if refused."""

    value: Any
    place: Place
    key_place: Place  # of the key that the value belongs to

    def plain(self) -> Any:
        """Return the value without places."""
        if isinstance(self.value, list):
            return [item.plain() for item in self.value]
        if isinstance(self.value, dict):
            return {key: item.plain() for key, item in self.value.items()}
        return self.value


def shorten(text: str, most: int = 60) -> str:
    """Return the text of at most `most` characters."""
    return text if len(text) <= most else text[: most - 3] + "..."


def read_file(path: str, problems: list[FileProblem]) -> Node | None:
    """Return the content of a case file, or None; what is wrong with it joins `problems`."""
    try:
        with open(path, "rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        problems.append(FileProblem(Place(path), "", unreadable(path, error)))
        return None
    if len(data) > MAX_BYTES:
        problems.append(FileProblem(Place(path), "", "is larger than 1 MiB: no case file"))
        return None
    try:
        text = data.decode().removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        place = _place_at(path, data[: error.start].decode())
        problems.append(FileProblem(place, "", "is not UTF-8 text; a case file is YAML"))
        return None
    return read_text(text, Place(path, 1, 1), problems)


def read_text(text: str, start: Place, problems: list[FileProblem]) -> Node | None:
    """Return the value of a YAML text, or None; a `start` without a line is everything's place."""
    text = separate_by_spaces(text)
    if odd := ODD_BREAKS.search(text):
        problems.append(_forbidden(text, odd.start(), start))
        return None

    def place(mark: Any) -> Place:
        return Place(start.file, mark.line + 1, mark.column + 1) if mark and start.line else start

    def refuse(mark: Any, key: str, message: str) -> None:
        problems.append(FileProblem(place(mark), key, message))

    if OTHER_YAML.match(text):
        refuse(None, "", "case files are YAML 1.2")
    try:
        loader = _Loader(text)
        if root := loader.get_single_node():
            for noted in loader.notes:
                refuse(*noted)
            return _plain_node(root, "", None, place, refuse)
        refuse(None, "", f"is empty{f'; {START}' if start.line else ''}")
    except _Refused as error:
        refuse(*error.args)
    except yaml.MarkedYAMLError as error:
        mark, told = error.problem_mark or error.context_mark, str(error.problem)
        if told == "but found another document":
            refuse(mark, "", "a second document begins here; a case file holds one")
            return None
        hint = "; indent with spaces, not tabs" if "'\\t'" in told else ""
        slip = find_slip(text, mark.line) if mark and not hint else None
        if slip and start.line:
            problems.append(FileProblem(Place(start.file, slip[0] + 1, 1), "", slip[1]))
        else:
            refuse(mark, "", f"is no YAML: {shorten(told, 120)}{hint}")
    except yaml.reader.ReaderError as error:
        problems.append(_forbidden(text, error.position, start))
    except (ValueError, OverflowError):  # PyYAML on "\UFFFFFFFF" or %YAML 1.999...
        refuse(None, "", "is no YAML: a number is too large here")
    return None


def find_slip(text: str, last: int) -> tuple[int, str] | None:
    """Return the line (from 0) at which a beginner's mistake stands, and what to do; or None.

    last: the line that a parser stopped at, often the one behind the mistake.
    """
    lines = text.split("\n")[: last + 1]
    filled = [(n, line) for n, line in enumerate(lines) if line.strip() and line.strip()[0] != "#"]
    for number, line in filled[-2:]:
        if found := NO_SPACE.match(line):
            return number, f"put a space after the colon: {found[1]}: {found[2]}"
        if found := EQUALS.match(line):
            return number, f"write a colon and a space in place of =: {found[1]}: {found[2]}"
    if len(filled) < 2:
        return None
    earlier, (at_before, before), (number, line) = [(-1, ""), *filled][-3:]
    first, second, last_one = (len(one) - len(one.lstrip()) for one in (earlier[1], before, line))
    if second == last_one or not KEY.match(line):
        return None
    rule = "keys of one group stand in one column, and a group's own line ends in its colon"
    opens = first == second and GROUP.match(earlier[1])
    if second < last_one and (first == last_one or opens):  # it alone stands out of its group
        text = f"is indented by {second} columns, the line after it by {last_one}"
        return at_before, f"{text}: {rule}"
    return number, f"is indented by {last_one} columns, the line before by {second}: {rule}"


NO_SPACE = re.compile(r"\s*([A-Za-z]\w*):([^\s:/][^:]*?)\s*(?:#.*)?$")
EQUALS = re.compile(r"\s*([A-Za-z]\w*)\s*=\s*(.*?)\s*(?:#.*)?$")
KEY = re.compile(r"\s*[A-Za-z]\w*\s*:(\s|$)")
GROUP = re.compile(r"\s*[A-Za-z]\w*\s*:\s*(#.*)?$")
TABS = re.compile(r"""^([ ]*[^\s'"][^'"\n]*?)\t""", re.MULTILINE)


def separate_by_spaces(text: str) -> str:
    """Return a text with a space for each tab behind a line's first word and before any quote.

    YAML 1.2 has tabs there, PyYAML none; places stay.
    """
    while (changed := TABS.sub(r"\1 ", text)) != text:
        text = changed
    return text


def _forbidden(text: str, position: int, start: Place) -> FileProblem:
    place = _place_at(start.file, text[:position]) if start.line else start
    return FileProblem(place, "", f"must not hold the character U+{ord(text[position]):04X}")


def _place_at(path: str, before: str) -> Place:
    """Return the place that follows the text `before`."""
    return Place(path, before.count("\n") + 1, len(before) - before.rfind("\n"))


def resolve_scalar(text: str) -> Any:
    """Return what a plain scalar means in the core schema of YAML 1.2."""
    if text in NULLS:
        return None
    if text in BOOLEANS:
        return BOOLEANS[text]
    if NOT_FINITE.fullmatch(text):
        return float(text.replace(".", ""))
    if INTEGER.fullmatch(text):
        return _integer(text)
    if not REAL.fullmatch(text):
        return text
    number = float(text)
    if number == 0 and NOT_ZERO.match(text):  # smaller than any float: not the 0 of an ideal joint
        return math.nextafter(0, -1 if text[0] == "-" else 1)
    return number


def _integer(text: str) -> float:
    """Return an integer; one beyond any float is infinite, since its digits may be a million."""
    if text[:2] in ("0o", "0x"):
        value = int(text, 0)
        return value if value.bit_length() < 1000 else math.inf
    return int(text) if len(text) <= 300 else float(text)


class _Refused(Exception):
    """The end of the reading of a file: a mark of PyYAML's, a key and a message."""


REFUSED = "refused"  # tag of an alias


class _Loader(yaml.SafeLoader):
    """PyYAML's composer, which notes what no case file has: aliases, anchors and tags."""

    def __init__(self, text: str):
        super().__init__(text)
        self.parts = 0
        self.path: list[str] = []
        self.notes: list[tuple[Any, str, str]] = []

    def compose_node(self, parent: Any, index: Any) -> Any:
        event, name = self.peek_event(), getattr(index, "value", "")
        self.path.append(name if isinstance(name, str) else "")
        self.parts += 1
        key = ".".join(filter(None, self.path))
        if len(self.path) > MAX_DEPTH or self.parts > MAX_PARTS:
            is_deep = len(self.path) > MAX_DEPTH
            what = f"nested deeper than {MAX_DEPTH} levels" if is_deep else "is too long"
            raise _Refused(event.start_mark, key, what + " to be a case file" * (not is_deep))
        if isinstance(event, yaml.AliasEvent):
            self.note(event, key, "aliases (*) are not allowed; write the value out")
            self.get_event()
            self.path.pop()
            return yaml.ScalarNode(REFUSED, "", event.start_mark)  # type: ignore[arg-type]
        if event.anchor is not None:
            self.note(event, key, "anchors (&) are not allowed; write the value out")
        elif event.tag is not None:
            self.note(event, key, "tags (!) are not allowed")
        node = super().compose_node(parent, index)
        self.path.pop()
        return node

    def note(self, event: Any, key: str, message: str) -> None:
        """Keep what is wrong with a mark on a value."""
        self.notes.append((event.start_mark, key, message))


def _plain_node(
    node: Any, key: str, key_mark: Any, place: Callable[[Any], Place],
    refuse: Callable[[Any, str, str], None],
) -> Node:  # fmt: skip
    """Return a node of PyYAML's as one of ours, with all that is in it."""
    value: Any = None
    if isinstance(node, yaml.MappingNode):
        value = {}
        for name_node, inner in node.value:
            name, mark = name_node.value, name_node.start_mark
            whole = f"{key}.{name}" if key else name
            if not isinstance(name, str):
                refuse(mark, key, "a key must be plain text")
            elif not name:
                refuse(mark, key, "a key is missing before the colon")
            elif name == "<<" and name_node.style is None:
                refuse(mark, key, "merge keys (<<) are not allowed; write the values out")
            elif name in value:
                line = f" at line {value[name].key_place.line}" * bool(place(mark).line)
                refuse(mark, whole, f"is given twice; first{line}")
            else:
                value[name] = _plain_node(inner, whole, mark, place, refuse)
    elif isinstance(node, yaml.SequenceNode):
        value = []
        for item in node.value:
            text = item.value if isinstance(item, yaml.ScalarNode) and not item.style else ""
            if value and DECIMALS.fullmatch(text):
                message = f"a decimal comma? write {value[-1].plain()}.{text}"
                refuse(item.start_mark, key, f"{message}; commas separate values")
            value.append(_plain_node(item, key, None, place, refuse))
    else:
        value = resolve_scalar(node.value) if node.style is None else node.value
        if value is None and node.tag != REFUSED:
            refuse(node.start_mark, key, NO_VALUE)
    return Node(value, place(node.start_mark), place(key_mark or node.start_mark))


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

    exit_code = 2
    prefix = ""  # each line begins with the file that it is about

    def __init__(self, problems: Sequence[FileProblem]):
        self.problems = sorted(set(problems))
        super().__init__(self.problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))

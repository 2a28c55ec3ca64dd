"""Strict YAML 1.2: a text -> a tree of values with their places.

The only module that imports yaml, and only its parser: what a scalar means is decided here, by
the core schema of YAML 1.2, so that `1e5` is a number and `no` is text. What a case file must not
hold (aliases, tags, duplicate keys, ...) is noted with its place, and reading goes on;
only broken syntax and oversized files end it.
"""

import math
import re
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import yaml

from compressor.cases.parameter import NO_VALUE
from compressor.program import CompsimError, did_you_mean, printable

SUFFIXES = (".yaml", ".yml")
RESULTS = (b"\x89HDF", b"CDF\x01", b"CDF\x02", b"CDF\x05")  # how HDF5 and netCDF files begin
START = "compsim init writes a case file to start from"
MAX_LOOKED_AT = 1000  # entries of a folder
MAX_NAMES = 5


def unreadable(path: str, error: OSError | ValueError) -> str:
    """Return why a file cannot be read, and what to do about it."""
    message = f"cannot be read: {getattr(error, 'strerror', None) or error}"
    if isinstance(error, FileNotFoundError):
        return f"{message}; {_instead(Path(path))}"
    if isinstance(error, IsADirectoryError):
        inside = case_files(Path(path))
        line = f"compsim run {shlex.quote(path.rstrip('/'))}/*.yaml"
        return f"{message}; {f'it holds case files: {line}' if inside else 'give a case file'}"
    return message


def no_text(data: bytes) -> str:
    """Return the error of a file that is no text in UTF-8."""
    if data.startswith(RESULTS):
        return "is a file of results (netCDF or HDF5); a case file is YAML text"
    return "is not UTF-8 text"


def case_files(folder: Path) -> list[Path]:
    """Return the case files in a folder, by their names."""
    try:
        entries = sorted(islice(folder.iterdir(), MAX_LOOKED_AT))
    except OSError:
        return []
    return [path for path in entries if path.suffix in SUFFIXES and path.is_file()]


def _instead(path: Path) -> str:
    """Return what to give in place of a file that is not there."""
    if "*" in path.name:
        return f"no file has such a name; {START}"
    found = {path.stem: path for path in [*case_files(Path("configs")), *case_files(path.parent)]}
    near = did_you_mean(path.stem, found, found)
    if near or not found:
        return near or START
    names = [*map(str, found.values())]
    return f"there are {', '.join(names[:MAX_NAMES])}{', …' * (len(names) > MAX_NAMES)}"


MAX_BYTES = 1 << 20
MAX_DEPTH = 20
MAX_PARTS = 50_000  # keys, values and brackets, which take a second

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


class _Unreadable(Exception):
    """The end of the reading of a file; carries the last problem."""


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
        problems.append(FileProblem(place, "", no_text(data)))
        return None
    return read_text(text, Place(path, 1, 1), problems)


def read_text(text: str, start: Place, problems: list[FileProblem]) -> Node | None:
    """Return the value of a YAML text, or None; a `start` without a line is everything's place."""
    text = separate_by_spaces(text)
    builder = _Builder(text, start, problems)
    if odd := ODD_BREAKS.search(text):
        problems.append(_forbidden(text, odd.start(), start))
        return None
    try:
        return builder.document()
    except _Unreadable as error:
        problems.append(error.args[0])
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = builder.place(mark)
        hint = "; indent with spaces, not tabs" if "'\\t'" in str(error.problem) else ""
        slip = find_slip(text, mark.line) if mark and not hint else None
        if slip and start.line:
            problems.append(FileProblem(Place(start.file, slip[0] + 1, 1), "", slip[1]))
            return None
        problems.append(
            FileProblem(place, "", f"is no YAML: {shorten(str(error.problem), 120)}{hint}")
        )
    except yaml.reader.ReaderError as error:
        problems.append(_forbidden(text, error.position, start))
    except (ValueError, OverflowError):  # PyYAML on "\UFFFFFFFF" or %YAML 1.999...
        problems.append(FileProblem(builder.last, "", "is no YAML: a number is too large here"))
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


class _Builder:
    """A builder of nodes from the parser's events; notes what a strict reader refuses."""

    def __init__(self, text: str, start: Place, problems: list[FileProblem]):
        self.start, self.last, self.problems, self.parts = start, start, problems, 0
        self.events: Iterator[Any] = self._events(text)

    def _events(self, text: str) -> Iterator[Any]:
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            self.parts += 1
            self.last = self.place(event.start_mark)
            if self.parts > MAX_PARTS:
                raise _Unreadable(FileProblem(self.last, "", "is too long to be a case file"))
            yield event

    def place(self, mark: Any) -> Place:
        if mark is None or not self.start.line:
            return self.start
        return Place(self.start.file, mark.line + 1, mark.column + 1)

    def note(self, event: Any, key: str, message: str) -> None:
        self.problems.append(FileProblem(self.place(event.start_mark), key, message))

    def document(self) -> Node | None:
        """Return the one document of the text."""
        next(self.events)  # the stream's start
        opening = next(self.events)
        if isinstance(opening, yaml.StreamEndEvent):
            hint = f"; {START}" if self.start.line else ""
            raise _Unreadable(FileProblem(self.start, "", f"is empty{hint}"))
        if opening.version not in (None, (1, 2)):
            self.note(opening, "", "case files are YAML 1.2")
        node = self.node(next(self.events), "", 0, None)
        next(self.events)  # the document's end
        more = next(self.events)
        if not isinstance(more, yaml.StreamEndEvent):
            self.note(more, "", "a second document begins here; a case file holds one")
        return node

    def node(self, event: Any, key: str, depth: int, key_place: Place | None) -> Node:
        """Return the value that begins with an event, and all that is in it."""
        place = self.place(event.start_mark)
        if depth > MAX_DEPTH:
            message = f"nested deeper than {MAX_DEPTH} levels"
            raise _Unreadable(FileProblem(place, key, message))
        self.refuse_marks(event, key)
        value: Any = None
        if isinstance(event, yaml.MappingStartEvent):
            value = self.mapping(key, depth)
        elif isinstance(event, yaml.SequenceStartEvent):
            value = self.sequence(key, depth)
        elif isinstance(event, yaml.ScalarEvent):
            value = self.scalar(event, key)
        return Node(value, place, key_place or place)

    def refuse_marks(self, event: Any, key: str) -> None:
        """Note an alias, an anchor or a tag."""
        if isinstance(event, yaml.AliasEvent):
            self.note(event, key, "aliases (*) are not allowed; write the value out")
        elif event.anchor is not None:
            self.note(event, key, "anchors (&) are not allowed; write the value out")
        elif event.tag is not None:
            self.note(event, key, "tags (!) are not allowed")

    def scalar(self, event: Any, key: str) -> Any:
        value = resolve_scalar(event.value) if event.style is None else event.value
        if value is None:
            self.note(event, key, NO_VALUE)
        return value

    def sequence(self, key: str, depth: int) -> list[Node]:
        items: list[Node] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            text = getattr(event, "value", None)
            if items and text and event.style is None and DECIMALS.fullmatch(text):
                before = items[-1].plain()
                message = f"a decimal comma? write {before}.{text}; commas separate values"
                self.note(event, key, message)
            items.append(self.node(event, key, depth + 1, None))
        return items

    def mapping(self, owner: str, depth: int) -> dict[str, Node]:
        entries: dict[str, Node] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            name = self.name(event, owner, depth)
            key = f"{owner}.{name}" if owner and name else name or owner
            value = self.node(next(self.events), key, depth + 1, self.place(event.start_mark))
            if name in entries:
                first = entries[name].key_place
                where = f" at line {first.line}" if first.line else ""
                self.note(event, key, f"is given twice; first{where}")
            elif name is not None:
                entries[name] = value
        return entries

    def name(self, event: Any, owner: str, depth: int) -> str | None:
        """Return the text of a key, or None if it is refused."""
        if not isinstance(event, yaml.ScalarEvent):
            if not isinstance(event, yaml.AliasEvent):
                self.note(event, owner, "a key must be plain text")
            self.node(event, owner, depth + 1, None)
            return None
        self.refuse_marks(event, owner)
        if event.value == "<<" and event.style is None:
            self.note(event, owner, "merge keys (<<) are not allowed; write the values out")
            return None
        if not event.value:
            self.note(event, owner, "a key is missing before the colon")
            return None
        return event.value


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

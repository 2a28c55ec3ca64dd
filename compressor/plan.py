"""Case files to jobs: every list is an axis, axes multiply, and all errors are told at once.

A file becomes values by dotted key (`compressor.reading`), overrides take their places, and each
value is checked alone against the table of parameters. Only a file in which every value is good has
its cases built, which finds the values that do not fit each other.
"""

import itertools
import json
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from compressor.case import Case, checked, table
from compressor.leaves import Leaves, leaves
from compressor.overrides import overridden, read_overrides
from compressor.parameter import CaseError, Problem, shown
from compressor.reading import FileProblem, Node, Place, read_file, resolved

MAX_JOBS = 10_000
MAX_CONFLICTS = 20  # told of one file; a sweep can have another in every job
UNSWEPT = (  # no part of a job's identity
    "name",
    "solve.error_bars",
    "solve.timeout_s",
    "output.keep",
    "output.precision",
    "output.compress",
)
WORD = re.compile(r"[A-Za-z][A-Za-z0-9._-]*")


class CaseFileError(ValueError):
    """Case files that cannot be read; `problems` lists everything wrong, each with its place."""

    def __init__(self, problems: Sequence[FileProblem]):
        self.problems = sorted(set(problems))
        super().__init__(self.problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))


@dataclass(frozen=True)
class Axis:
    """One swept key of a study, such as `machine.rod_mass_kg`, and its values."""

    key: str
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Study:
    """One case file: its cases in C order over the axes, which stand in the file's order."""

    name: str
    path: str
    axes: tuple[Axis, ...]
    cases: tuple[Case, ...]


@dataclass(frozen=True)
class _Draft:
    """A study that is being read; `name` is empty where the file gives no valid one."""

    path: str
    name: str
    leaves: Leaves
    problems: list[FileProblem]


def load_cases(*paths: str | os.PathLike[str]) -> list[Case]:
    """The cases of YAML case files, in the order of the files and of their axes.

    Raises CaseFileError with everything that is wrong in all files, each with its place.
    """
    return [case for study in load_studies(*paths) for case in study.cases]


def load_studies(*paths: str | os.PathLike[str], overrides: Sequence[str] = ()) -> list[Study]:
    """The studies of YAML case files; each override, `key=value`, replaces a value in all of them.

    Raises CaseFileError with everything that is wrong in all files and overrides.
    """
    problems: list[FileProblem] = []
    changes = read_overrides(overrides, problems)
    drafts = [_draft(os.fsdecode(path), changes, problems) for path in paths]
    _refuse_shared_names(drafts)
    studies = [_study(draft) for draft in drafts]
    problems += [problem for draft in drafts for problem in draft.problems]
    if problems:
        raise CaseFileError(problems)
    return studies


def _draft(path: str, changes: Mapping[str, Leaves], earlier: Sequence[FileProblem]) -> _Draft:
    problems = list(earlier)
    root = read_file(path, problems)
    found = Leaves({}, {})
    if root and isinstance(root.value, dict):
        found = leaves(root, problems)
    elif root and root.value is not None:
        message = "needs keys at the top, such as `joint: big_end`"
        problems.append(FileProblem(root.place, "", message))
    found = overridden(found, changes)
    name = _name(path, found, problems) if root else ""
    return _Draft(path, name, found, problems)


def _name(path: str, found: Leaves, problems: list[FileProblem]) -> str:
    """The study's name: the file's value, checked later with all others, or the file's stem."""
    if "name" in found.values:
        name = found.values["name"].value
        return "" if table()["name"].check(name) else name
    name = Path(path).stem
    message = table()["name"].check(name)
    if message:
        message = f"the file's name gives none: {message}; set name"
        problems.append(FileProblem(Place(path, 1, 1), "name", message))
    return "" if message else name


def _refuse_shared_names(drafts: Sequence[_Draft]) -> None:
    """A name is where a study is stored, and file systems may not tell `A` from `a`."""
    first: dict[str, _Draft] = {}
    for draft in drafts:
        other = first.setdefault(draft.name.casefold(), draft)
        if draft.name and other is not draft:
            given = draft.leaves.values.get("name")
            place = given.place if given else Place(draft.path, 1, 1)
            message = f"{other.path} and {draft.path} would be stored under one name, {draft.name}"
            draft.problems.append(FileProblem(place, "name", message))


def _study(draft: _Draft) -> Study:
    """The study of a draft; without cases if the draft has problems, to which its own are added."""
    fixed: dict[str, Node] = {}
    swept: dict[str, list[Node]] = {}
    for key, node in draft.leaves.values.items():
        values = _axis_values(key, node, draft.problems)
        if values is not None:
            swept[key] = _checked_axis(key, values, draft.problems)
        elif good := _checked(key, node, draft.problems):
            fixed[key] = good
    _refuse_size(swept, draft)
    cases = () if draft.problems else tuple(_cases(draft, fixed, swept))
    axes = (Axis(key, tuple(node.value for node in nodes)) for key, nodes in swept.items())
    return Study(draft.name, draft.path, tuple(axes), cases)


# How an axis is written -> the function that gives its values.
AXIS_KINDS: dict[str, Callable[[Node], list[Node]]] = {"list": lambda node: node.value}


def _axis_values(key: str, node: Node, problems: list[FileProblem]) -> list[Node] | None:
    """The values that a node sweeps, none if it sweeps in no valid way; None for a single value."""
    kind = _axis_kind(key, node)
    if kind == "value":
        return None
    if kind not in AXIS_KINDS:
        message = "needs a value or a list of values, not a mapping"
    elif key in UNSWEPT:
        message = "cannot be swept: it does not change what a job computes"
    else:
        values = AXIS_KINDS[kind](node)
        if values:
            return values
        message = "is an empty list"
    problems.append(FileProblem(node.place, key, message))
    return []


def _axis_kind(key: str, node: Node) -> str:
    if isinstance(node.value, dict):
        return "value" if key == "solve.accuracy" else "mapping"
    if not isinstance(node.value, list):
        return "value"
    pair = key == "contact.materials" and not any(isinstance(n.value, list) for n in node.value)
    return "value" if pair else "list"


def _checked_axis(key: str, values: list[Node], problems: list[FileProblem]) -> list[Node]:
    """The valid values of an axis; each of the others, and each repetition, is a problem."""
    found = [good for value in values if (good := _checked(key, value, problems))]
    seen: set[Any] = set()
    for node in found:
        if node.value in seen:
            message = f"{shown(node.value)} is in the list twice"
            problems.append(FileProblem(node.place, key, message))
        seen.add(node.value)
    return found


def _checked(key: str, node: Node, problems: list[FileProblem]) -> Node | None:
    """A node with its value as the case holds it; None if that is wrong, which joins `problems`."""
    if node.value is None or key == "friction":  # told when it was read; or false, which is valid
        return node if node.value is False else None
    if isinstance(node.value, dict) and any(n.value is None for n in node.value.values()):
        return None
    found: list[Problem] = []
    row = "clearance_mm.big_end" if key == "clearance_mm" else key
    value = checked(row, node.plain(), found)
    parts = node.value if isinstance(node.value, dict) else {}
    for problem in found:
        part = parts.get(problem.key.removeprefix(f"{row}."))
        place, about = (part.place, problem.key) if part else (node.place, key)
        problems.append(FileProblem(place, about, problem.message))
    return None if found else replace(node, value=value)


def _refuse_size(swept: Mapping[str, list[Node]], draft: _Draft) -> None:
    count = math.prod(len(nodes) for nodes in swept.values())
    if count > MAX_JOBS:
        longest = max(swept, key=lambda key: len(swept[key]))
        sizes = " x ".join(f"{key} ({len(nodes)})" for key, nodes in swept.items())
        message = f"{count} jobs are more than {MAX_JOBS}: {sizes}"
        place = draft.leaves.values[longest].place
        draft.problems.append(FileProblem(place, longest, message))


def _cases(draft: _Draft, fixed: dict[str, Node], swept: dict[str, list[Node]]) -> Iterator[Case]:
    """The case of every combination; those that do not fit together are problems of the draft."""
    found: dict[Problem, FileProblem] = {}
    for nodes in itertools.product(*swept.values()):
        chosen = fixed | dict(zip(swept, nodes, strict=True))
        if "joint" in swept and chosen["joint"].value == "none":
            chosen = {key: n for key, n in chosen.items() if not key.startswith("clearance_mm")}
        try:
            yield Case.from_values(_nested(chosen) | {"name": draft.name})
        except CaseError as error:
            for problem in error.problems:
                found.setdefault(problem, _located(problem, chosen, draft))
    draft.problems.extend(itertools.islice(found.values(), MAX_CONFLICTS))
    if len(found) > MAX_CONFLICTS:
        message = f"{len(found)} conflicts between swept values; the first {MAX_CONFLICTS} are"
        draft.problems.append(FileProblem(Place(draft.path), "", message))


def _nested(chosen: Mapping[str, Node]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for key, node in chosen.items():
        group, _, name = key.rpartition(".")
        value = node.value
        if key == "solve.accuracy" and isinstance(value, tuple):
            value = dict(value)  # as a case file has it
        (values.setdefault(group, {}) if group else values)[name] = value
    return values


def _located(problem: Problem, chosen: Mapping[str, Node], draft: _Draft) -> FileProblem:
    """A case's problem at the value it is about, or else at the key or group that is nearest."""
    group = problem.key.partition(".")[0]
    for key in (problem.key, group):
        if key in chosen:
            return FileProblem(chosen[key].place, key, problem.message)
    for key in (problem.key, group):
        if key in draft.leaves.places:
            return FileProblem(draft.leaves.places[key], problem.key, problem.message)
    return FileProblem(Place(draft.path, 1, 1), problem.key, problem.message)


def to_yaml(case: Case) -> str:
    """A resolved case as the text of a case file, which reads back to an equal case."""
    lines = []
    for key, value in case.values().items():
        if isinstance(value, dict):
            lines.append(f"{key}:")
            lines += [f"  {name}: {_scalar(item)}" for name, item in value.items()]
        else:
            lines.append(f"{key}: {_scalar(value)}")
    return "\n".join(lines) + "\n"


def _scalar(value: Any) -> str:
    """A value in YAML: as JSON, but plain where a word reads back as text."""
    if isinstance(value, str) and WORD.fullmatch(value) and resolved(value) == value:
        return value
    return json.dumps(value)

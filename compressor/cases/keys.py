"""Values of a file, a block or a `key=value`: in one form, and one over another.

In that form there is no key that is unknown, a group's word and a key's double are written out, and
cards have the path as seen from the file that names them.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from compressor.cases.checks import (
    DOUBLES,
    MAPPINGS,
    SWEEP,
    TWICE,
    accepted_keys,
    describe_unknown,
    expand_synonyms,
    halve,
    no_mapping,
    stands_for,
)
from compressor.cases.conflicts import IN_PLACE_OF
from compressor.cases.swept import DISTRIBUTIONS, FORMS
from compressor.cases.table import GROUPS, OF_JOINTS, WORDS, parts_by_key
from compressor.cases.yaml_reader import FileProblem, Path, Place, Places, Tree, read_text, shorten

Written = tuple[Tree, list[FileProblem]]


def write_out(tree: Tree) -> Written:
    """Return the values of a file or a block in the one form, and what is wrong with its keys."""
    values: dict[str, Any] = {}
    problems = []
    for name, value in tree.values.items():
        if name not in accepted_keys(""):
            problems.append(tree.problem((name,), describe_unknown(name, "", value=value), True))
        elif _is_group(name, value):
            known = accepted_keys(name)
            within = {key: one for key, one in value.items() if key in known and one is not None}
            values[name] = (
                True if value == {} and WORDS.get(name) else within
            )  # all of its defaults
            for key in value.keys() - {*known}:
                message = describe_unknown(key, name, value=value[key])
                problems.append(tree.problem((name, key), message, True))
        elif name in MAPPINGS and value is not None:
            problems.append(tree.problem((name,), no_mapping(name, value)))
        elif value is not None:  # which is reported
            values[name] = value
    tree, wrong = _halve_doubles(Tree(values, tree.places))
    if isinstance(gas := tree.values.get("gas"), dict) and "indicator" in gas:
        folder = os.path.dirname(tree.at("gas", "indicator")[1].file)
        if os.path.isdir(folder):
            tree.values["gas"] = gas | {"indicator": _beside(folder, gas["indicator"])}
    return tree, problems + wrong


def _is_group(name: str, value: Any) -> bool:
    """Return whether a value is a group's keys."""
    return (name in GROUPS or name in MAPPINGS) and isinstance(value, dict)


def _is_by_part(key: str, value: Any) -> bool:
    """Return whether a value is one for each part, and no sweep of one for all."""
    parts = parts_by_key().get(key)
    if parts is None or not isinstance(value, dict) or not value:
        return False
    words = [*FORMS, *DISTRIBUTIONS]
    is_form = len(value) <= 2 and any(get_close_matches(word, words, n=1) for word in value)
    return not is_form or not value.keys().isdisjoint(parts)


def _halve_doubles(tree: Tree) -> Written:
    """Return the values with each double as the key that it is twice of."""
    values, wrong = expand_synonyms(tree.values, _halve_swept)
    places, problems = dict(tree.places), []
    for double, key in DOUBLES.items():
        old, new = path_of(double), path_of(key)
        if new not in places:
            places |= {new + path[2:]: spot for path, spot in places.items() if path[:2] == old}
    for problem in wrong:
        key_place, place = places[path_of(problem.key)]
        if rival := tree.places.get(path_of(DOUBLES[problem.key])):
            place = max(key_place, rival[0])
        problems.append(FileProblem(place, problem.key, problem.message))
    return Tree(values, places), problems


def _halve_swept(value: Any, first: int | None = None) -> Any:
    """Return a value with its numbers halved, of a list the `first` ones; None: all.

    A form such as `{linspace: [160, 200, 5]}` has two ends and a count, a range a step.
    """
    if isinstance(value, dict):
        return {
            word: _halve_swept(item, None if word in ("range", "triangular") else 2)
            for word, item in value.items()
        }
    if isinstance(value, list):
        return [*map(_halve_swept, value[:first]), *(value[first:] if first else [])]
    return halve(value)


def _beside(folder: str, value: Any) -> Any:
    """Return the paths of cards, one, in a list or by end, as seen from another folder."""
    if isinstance(value, list):
        return [_beside(folder, item) for item in value]
    if isinstance(value, dict):
        return {end: _beside(folder, item) for end, item in value.items()}
    return os.path.join(folder, value) if isinstance(value, str) else value


def leaves(values: Mapping[str, Any], above: str = "") -> Iterator[tuple[Path, Any]]:
    """Yield the path and the value, or the sweep, of each key; of a value by part each part's."""
    for name, value in values.items():
        key = f"{above}{name}"
        if name in SWEEP and not above:
            continue
        if (not above and _is_group(name, value)) or _is_by_part(key, value):
            yield from leaves(value, f"{key}.")
        else:
            yield path_of(key), value


def path_of(key: str) -> Path:
    """Return the path of a dotted key."""
    return tuple(key.split("."))


def key_of(path: Path) -> str:
    """Return the dotted key of a path."""
    return ".".join(map(str, path))


def put(values: Mapping[str, Any], path: Path, value: Any, above: str = "") -> dict[str, Any]:
    """Return nested values with another one at a path; above: the dotted key that holds them.

    What stood for several parts, one of which the path names, stands for the others.
    """
    first, *rest = map(str, path)
    if not rest:
        return {**values, first: value}
    whole, inner = f"{above}.{first}".strip("."), values.get(first)
    parts = parts_by_key().get(whole, ())
    if not isinstance(inner, dict) or (parts and not _is_by_part(whole, inner)):
        inner = dict.fromkeys(parts, inner) if first in values else {}
    return {**values, first: put(inner, tuple(rest), value, whole)}


def drop(values: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Return nested values without the one at a path."""
    first, *rest = map(str, path)
    inner = values.get(first)
    if rest and isinstance(inner, dict):
        return {**values, first: drop(inner, tuple(rest))}
    return {key: value for key, value in values.items() if rest or key != first}


def merge_block(file: Tree, block: Tree) -> Tree:
    """Return a file's values with all those of one of its blocks."""
    changes = dict(leaves(block.values))
    for key in SWEEP:
        value = block.values.get(key)
        if isinstance(value, dict):
            changes |= {(key, inner): one for inner, one in value.items()}
        elif value is not None:
            changes[key,] = value
    return override(file, changes, block.places)


def override(file: Tree, changes: Mapping[Path, Any], places: Places) -> Tree:
    """Return a file's values with others, and without what these stand in place of."""
    values = dict(file.values)
    for path, value in changes.items():
        values = put(values, path, value)
    given = {key_of(path) for path in changes}
    given |= {part for key in given for part in stands_for(key)}
    gone = [pair[pair[0] in given] for pair in IN_PLACE_OF if len(given.intersection(pair)) == 1]
    gone += OF_JOINTS if changes.get(("joint",)) == "none" else ()
    for key in gone:
        if not any(covers(key, one) for one in given):
            values = drop(values, path_of(key))
    above = {path[:n] for path in changes for n in range(1, len(path))}
    kept = {
        path: spots
        for path, spots in file.places.items()
        if not any(path[:n] in changes for n in range(1, len(path) + 1))
    }
    new = {path: spots for path, spots in places.items() if path not in above & {*kept}}
    return Tree(values, kept | new)


def read_overrides(
    texts: Sequence[str],
) -> tuple[dict[Path, Any], dict[Path, tuple[Place, Place]], list[FileProblem]]:
    """Return the values of each `key=value` of the command line, their places and problems."""
    keys: list[str] = []
    values: dict[Path, Any] = {}
    places: dict[Path, tuple[Place, Place]] = {}
    problems: list[FileProblem] = []
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        place, own = Place(f"--set {shorten(text)}"), DOUBLES.get(key, key)
        if not key or not equals:
            message = "needs the form key=value, such as joint=both"
            problems.append(FileProblem(place, "", message))
        elif any(meet(own, other) for other in keys):
            problems.append(FileProblem(place, key, "is set twice"))
        elif rival := next((one for one in keys if _are_rivals(own, one)), None):
            problems.append(FileProblem(place, key, TWICE.format(rival)))
        else:
            tree, wrong = read_text(value, place)
            problems += wrong
            if tree is not None and tree.values is not None:
                whole, wrong = write_out(_under(key, tree, place))
                problems += wrong
                keys.append(own)
                places |= {path: spots for path, spots in whole.places.items() if path}
                found: Any = whole.values
                for name in path_of(own):
                    found = found.get(name) if isinstance(found, dict) else None
                values |= {path_of(own): found} if found is not None else {}
    return values, places, problems


def _under(key: str, tree: Tree, place: Place) -> Tree:
    """Return a tree under a dotted key; a part's name is the third."""
    whole, _, part = key.rpartition(".")
    path = path_of(key) if part in parts_by_key().get(whole, ()) else tuple(key.split(".", 1))
    values = tree.values
    for one in reversed(path):
        values = {str(one): values}
    places = {path + inner: spot for inner, spot in tree.places.items()}
    return Tree(values, places | {path[:n]: (place, place) for n in range(len(path))})


def _are_rivals(key: str, other: str) -> bool:
    """Return whether one of two keys stands in place of the other."""
    return any(
        meet(key, one) and meet(other, rival)
        for pair in IN_PLACE_OF
        for one, rival in (pair, pair[::-1])
    )


def meet(key: str, other: str) -> bool:
    """Return whether one of two keys is the other, or in the group that the other names."""
    return covers(key, other) or covers(other, key)


def covers(outer: str, key: str) -> bool:
    """Return whether a key is another one, or in the group that the other names."""
    return f"{key}.".startswith(f"{outer}.")

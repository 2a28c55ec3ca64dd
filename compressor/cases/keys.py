"""Values of a file, a block or a `key=value` by path, and one over another."""

import os
from collections.abc import Mapping, Sequence
from typing import Any

from compressor.cases.checks import DOUBLES, SWEEP, key_of, stands_for, walk_leaves
from compressor.cases.conflicts import IN_PLACE_OF
from compressor.cases.swept import FORMS
from compressor.cases.table import parts_by_key
from compressor.cases.yaml_reader import Path, Place, Problem, Tree, read_text, shorten


def path_of(key: str) -> Path:
    """Return the path of a dotted key."""
    return tuple(key.split("."))


def covers(outer: str, key: str) -> bool:
    """Return whether a key is another one, or in the group that the other names."""
    return f"{key}.".startswith(f"{outer}.")


def put(values: Mapping[str, Any], path: Path, value: Any, above: str = "") -> dict[str, Any]:
    """Return nested values with another one at a path; above: the dotted key that holds them.

    What stood for several parts, one of which the path names, stands for the others.
    """
    first, *rest = map(str, path)
    if not rest:
        return {**values, first: value}
    whole, inner = f"{above}.{first}".strip("."), values.get(first)
    parts = parts_by_key().get(whole, ())
    if not isinstance(inner, dict) or (rest[0] in parts and FORMS.keys() & inner):
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
    changes = dict(walk_leaves(block.values))
    for key in SWEEP:
        value = block.values.get(key)
        if isinstance(value, dict):
            changes |= {(key, name): one for name, one in value.items()}
        elif value is not None:
            changes[key,] = value
    return override(file, Tree(changes, block.places))


def override(file: Tree, changes: Tree) -> Tree:
    """Return a file's values with others by path, and without what these stand in place of."""
    values = dict(file.values)
    for path, value in changes.values.items():
        values = put(values, path, value)
    given = {key_of(path) for path in changes.values}
    given |= {part for key in given for part in stands_for(key)}
    rivals = IN_PLACE_OF + tuple(DOUBLES.items())
    gone = [pair[pair[0] in given] for pair in rivals if len(given.intersection(pair)) == 1]
    gone += ["clearance_mm"] if changes.values.get(("joint",)) == "none" else []
    for key in gone:
        if not any(covers(key, one) for one in given):
            values = drop(values, path_of(key))
    above = {path[:n] for path in changes.values for n in range(1, len(path))}
    kept = {
        path: spots
        for path, spots in file.places.items()
        if not any(path[:n] in changes.values for n in range(1, len(path) + 1))
    }
    new = {path: s for path, s in changes.places.items() if path not in above & {*kept}}
    return Tree(values, kept | new)


def read_overrides(texts: Sequence[str]) -> tuple[Tree, list[Problem]]:
    """Return the values, by path, of each `key=value` of the command line, and their problems."""
    values: dict[Path, Any] = {}
    places: dict[Path, tuple[Place, Place]] = {}
    problems: list[Problem] = []
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        place, path = Place(f"--set {shorten(text)}"), path_of(key)
        if not key or not equals:
            message = "needs the form key=value, such as joint=both"
            problems.append(Problem("", message, place))
            continue
        if any(path[: len(one)] == one[: len(path)] for one in values):
            problems.append(Problem(key, "is set twice", place))
        tree, wrong = read_text(value, place)
        problems += wrong
        if tree:
            values[path] = tree.values
            places |= {path + inner: spots for inner, spots in tree.places.items()}
            places |= {path[:n]: (place, place) for n in range(1, len(path))}
    return Tree(values, places), problems


def place_cards(tree: Tree) -> None:
    """Write the paths of a file's cards as they are seen from where the program runs."""
    blocks = tree.values.get("blocks")
    for values in (tree.values, *(blocks if isinstance(blocks, list) else ())):
        gas = values.get("gas") if isinstance(values, dict) else None
        if isinstance(gas, dict) and "indicator" in gas:
            gas["indicator"] = _beside(os.path.dirname(tree.at()[1].file), gas["indicator"])


def _beside(folder: str, value: Any) -> Any:
    """Return the paths of cards, one, in a list or by end, as seen from another folder."""
    if isinstance(value, list):
        return [_beside(folder, item) for item in value]
    if isinstance(value, dict):
        return {end: _beside(folder, item) for end, item in value.items()}
    return os.path.join(folder, value) if isinstance(value, str) else value

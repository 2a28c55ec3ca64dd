"""Values by dotted key: of a case file's tree, of `key=value` texts, of blocks, one over another.

The error of an unknown key says what was probably meant (`describe_unknown`).
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

from compressor.cases.checks import (
    DOUBLES,
    MAPPINGS,
    SHORTHANDS,
    TWICE,
    accepted_keys,
    by_part,
    check_double,
    describe_unknown,
    halve,
    lacking_part,
    no_mapping,
    stands_for,
)
from compressor.cases.conflicts import IN_PLACE_OF
from compressor.cases.groups import CARD_KEYS
from compressor.cases.parameter import NO_VALUE
from compressor.cases.swept import FORMS
from compressor.cases.table import GROUPS, OF_JOINTS, WORDS
from compressor.cases.yaml_reader import FileProblem, Node, Place, read_text, shorten

MAX_SUGGESTIONS = 100  # keeps a hostile file from taking long


@dataclass(frozen=True)
class Leaves:
    """The values of a case file by dotted key, and where each known key and group stands.

    A block has its own place at "".
    """

    values: dict[str, Node]
    places: dict[str, Place]


def leaves(root: Node, problems: list[FileProblem]) -> Leaves:
    """Return the leaves of a tree; unknown keys, and values in place of groups, are problems."""
    found = Leaves({}, {})
    for name, node in _known_entries("", root, problems):
        found.places[name] = node.key_place
        mapping = isinstance(node.value, dict)
        if mapping and not node.value and WORDS.get(name):
            found.values[name] = replace(node, value=True)  # all of its defaults
        elif (name in GROUPS or name in MAPPINGS) and mapping and not _is_sweep(name, node):
            for inner, item in _known_entries(name, node, problems):
                _add_leaf(found, f"{name}.{inner}", item, problems)
        elif name in SHORTHANDS or (name in WORDS and node.value is WORDS[name]):
            found.values[name] = node
        elif name in GROUPS or name in MAPPINGS:
            problems.append(FileProblem(node.place, name, no_mapping(name, node.plain())))
        else:
            found.values[name] = node
    return found


def _add_leaf(found: Leaves, key: str, node: Node, problems: list[FileProblem]) -> None:
    """Add a leaf of a group to those found: a synonym as its key, a value by part as several."""
    if keys := by_part(key, node.value):
        if message := lacking_part(key, node.value):
            problems.append(FileProblem(node.place, key, message))
        for part, one in keys.items():
            if part in node.value:
                own = node.value[part]
                found.values[one] = _beside_file(own) if one in CARDS else own
                found.places[one] = node.value[part].key_place
        return
    if key in CARDS:
        node = _beside_file(node)
    own = DOUBLES.get(key, key)
    doubled = next((word for word, half in DOUBLES.items() if half == own), own)
    if own in found.values and own != doubled:
        problems.append(FileProblem(node.key_place, doubled, TWICE.format(own)))
    wrong = check_double(key, node.value) if own != key else None
    if wrong:
        problems.append(FileProblem(node.place, key, wrong))
        node = replace(node, value=None)
    found.values[own] = node if own == key else _halve_node(node)
    found.places[own] = node.key_place


CARDS = tuple(f"gas.{key}" for key in CARD_KEYS)


def _beside_file(node: Node) -> Node:
    """Return a node with the paths of cards in it as seen from the file that names them."""
    if isinstance(node.value, list):
        return replace(node, value=[*map(_beside_file, node.value)])
    folder = os.path.dirname(node.place.file)
    if not isinstance(node.value, str) or not os.path.isdir(folder):
        return node
    return replace(node, value=os.path.join(folder, node.value))


def _halve_node(node: Node, first: int | None = None) -> Node:
    """Return a node with its numbers halved, of a list the `first` ones; None: all.

    A form such as `{linspace: [160, 200, 5]}` has two ends and a count, a range a step.
    """
    if isinstance(node.value, dict):
        inner = {
            word: _halve_node(item, None if word in ("range", "triangular") else 2)
            for word, item in node.value.items()
        }
        return replace(node, value=inner)
    if isinstance(node.value, list):
        items = node.value[:first]
        return replace(node, value=[*map(_halve_node, items), *node.value[len(items) :]])
    return replace(node, value=halve(node.value))


def _is_sweep(name: str, node: Node) -> bool:
    """Return whether a group's mapping sweeps a value that stands for the whole group."""
    few = name in SHORTHANDS and len(node.value) <= 2  # a word of FORMS, and `log`
    return few and any(get_close_matches(word, FORMS, n=1) for word in node.value)


def _known_entries(
    group: str, node: Node, problems: list[FileProblem]
) -> Iterable[tuple[str, Node]]:
    """Yield the entries of a group (for "", of a file) that are known and have a value."""
    for name, item in node.value.items():
        if name not in accepted_keys(group):
            message = "unknown key"
            if len(problems) < MAX_SUGGESTIONS:
                message = describe_unknown(name, group, value=item.plain())
                empty = item.place, NO_VALUE  # an unknown key has no default
                problems[:] = [one for one in problems if (one.place, one.message) != empty]
            key = f"{group}.{name}" if group else name
            problems.append(FileProblem(item.key_place, key, message))
        elif item.value is not None:
            yield name, item


def read_overrides(texts: Sequence[str], problems: list[FileProblem]) -> dict[str, Leaves]:
    """Return the leaves of each `key=value` of the command line, by its key."""
    found: dict[str, Leaves] = {}
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        place, own = Place(f"--set {shorten(text)}"), DOUBLES.get(key, key)
        if not key or not equals:
            message = "needs the form key=value, such as joint=both"
            problems.append(FileProblem(place, "", message))
        elif any(covers(own, other) or covers(other, own) for other in found):
            problems.append(FileProblem(place, key, "is set twice"))
        elif node := read_text(value, place, problems):
            group, dot, inner = key.partition(".")
            node = Node({inner: node}, place, place) if dot else node
            whole = leaves(Node({group: node}, place, place), problems)
            found[own] = whole
    return found


def override_leaves(file: Leaves, overrides: Mapping[str, Leaves]) -> Leaves:
    """Return a file's leaves with every override in place of the leaves at or under its key."""
    new = {key: node for change in overrides.values() for key, node in change.values.items()}
    places = {key: place for change in overrides.values() for key, place in change.places.items()}
    replaced = [*overrides]
    for one, other in IN_PLACE_OF:
        replaced += [other] * (one in new) + [one] * (other in new)
    if "joint" in new and new["joint"].value == "none":
        replaced += OF_JOINTS
    remaining = {
        key: node
        for outer, value in file.values.items()
        for key, node in _open_group(outer, value, new).items()
        if key in new or not any(covers(other, key) for other in replaced)
    }
    return Leaves(remaining | new, places | file.places)


def merge_leaves(file: Leaves, block: Leaves) -> Leaves:
    """Return a file's leaves with every leaf of one of its blocks in place of the file's."""
    changes = {key: Leaves({key: node}, {}) for key, node in block.values.items()}
    merged = override_leaves(file, changes)
    return Leaves(merged.values, file.places | block.places)


def _open_group(key: str, node: Node, new: Mapping[str, Node]) -> dict[str, Node]:
    """Return a leaf by key; one of a whole group is split where an override sets a part of it."""
    if not any(other.startswith(f"{key}.") for other in new):
        return {key: node}
    return dict.fromkeys(stands_for(key), node)


def covers(outer: str, key: str) -> bool:
    """Return whether a key is another one, or in the group that the other names."""
    return f"{key}.".startswith(f"{outer}.")


def nest_values(chosen: Mapping[str, Node]) -> dict[str, Any]:
    """Return the values by dotted key as a case file has them, group by group."""
    values: dict[str, Any] = {}
    for key, node in chosen.items():
        group, _, name = key.rpartition(".")
        value = node.value
        if key == "solve.accuracy" and isinstance(value, tuple):
            value = dict(value)  # as a case file has it
        (values.setdefault(group, {}) if group else values)[name] = value
    return values

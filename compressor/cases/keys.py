"""Values by dotted key: of a case file's tree, of `key=value` texts, of blocks, one over another.

An unknown key is told what was probably meant.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

from compressor.cases.conflicts import IN_PLACE_OF
from compressor.cases.parameter import shown
from compressor.cases.shorthands import SHORTHANDS, stands_for
from compressor.cases.swept import FORMS
from compressor.cases.table import GROUPS, OF_JOINTS, WORDS, Settings, table
from compressor.cases.yaml_reader import FileProblem, Node, Place, read_text, shortened

MAX_SUGGESTIONS = 100  # keeps a hostile file from taking long
# keys of a case file that are no part of a case: how values are swept together
SWEEP = ("sample", "zip", "exclude", "blocks", "regimes")
MAPPINGS = {  # of these, what stands in them
    "sample": ("n", "seed"),
    "regimes": (
        "over", "from", "to", "n", "log", "direction", "section_deg", "settle_rev", "measure_rev",
        "exponent",
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Leaves:
    """The values of a case file by dotted key, and where each known key and group stands.

    A block has its own place at "".
    """

    values: dict[str, Node]
    places: dict[str, Place]


def leaves(root: Node, problems: list[FileProblem]) -> Leaves:
    """The leaves of a tree; keys that are unknown, or no group where one is due, are problems."""
    found = Leaves({}, {})
    for name, node in _known("", root, problems):
        found.places[name] = node.key_place
        mapping = isinstance(node.value, dict)
        if mapping and not node.value and WORDS.get(name):
            found.values[name] = replace(node, value=True)  # all of its defaults
        elif (name in GROUPS or name in MAPPINGS) and mapping and not _is_sweep(name, node):
            for inner, item in _known(name, node, problems):
                found.values[f"{name}.{inner}"] = item
                found.places[f"{name}.{inner}"] = item.key_place
        elif name in WORDS and node.value is not WORDS[name]:
            word = shown(WORDS[name])
            message = f"needs {word} or a mapping of keys, not {shown(node.plain())}"
            problems.append(FileProblem(node.place, name, message))
        elif (name in GROUPS or name in MAPPINGS) and name not in (*WORDS, *SHORTHANDS):
            message = f"needs a mapping of keys, not {shown(node.plain())}"
            problems.append(FileProblem(node.place, name, message))
        else:
            found.values[name] = node
    return found


def _is_sweep(name: str, node: Node) -> bool:
    """Whether a group's mapping sweeps a value that stands for the whole group."""
    few = name in SHORTHANDS and len(node.value) <= 2  # a word of FORMS, and `log`
    return few and any(get_close_matches(word, FORMS, n=1) for word in node.value)


def _known(group: str, node: Node, problems: list[FileProblem]) -> Iterable[tuple[str, Node]]:
    """The entries of a group (or, for "", of a file) that it may hold and that have a value."""
    for name, item in node.value.items():
        if name not in _allowed(group):
            hint = suggestion(name, group) if len(problems) < MAX_SUGGESTIONS else ""
            key = f"{group}.{name}" if group else name
            problems.append(FileProblem(item.key_place, key, "unknown key" + hint))
        elif item.value is not None:
            yield name, item


def _allowed(group: str) -> list[str]:
    if group in MAPPINGS:
        return [*MAPPINGS[group]]
    names = [item.name for item in dataclasses.fields(GROUPS[group] if group else Settings)]
    return names if group else [*names, *SWEEP]


def suggestion(name: str, group: str) -> str:
    """The end of an error about an unknown key: what was probably meant, if anything."""
    if name in table():
        outer, _, inner = name.partition(".")
        return f"; write {inner} inside {outer}"
    if name.partition(":")[0] in _allowed(group):
        return "; put a space after the colon"
    near = _nearest(name, _allowed(group), cutoff=0.6)
    if near:
        return f"; did you mean {group}.{near}?" if group else f"; did you mean {near}?"
    near = _nearest(name, [_leaf(key) for key in table()], cutoff=0.8)
    meant = [key for key in table() if _leaf(key) == near]
    return f"; did you mean {' or '.join(meant)}?" if meant else ""


def _leaf(key: str) -> str:
    return key.rpartition(".")[2]


def _nearest(name: str, allowed: Sequence[str], cutoff: float) -> str | None:
    """The allowed key with another unit, or else the one most alike."""
    stems = {_stem(key): key for key in reversed(allowed)}
    for stem in sorted(stems, key=len, reverse=True):
        if stem != stems[stem] and f"{name}_".startswith(f"{stem}_"):
            return stems[stem]
    return next(iter(get_close_matches(name, allowed, n=1, cutoff=cutoff)), None)


def _stem(name: str) -> str:
    """A key's name without its unit."""
    for row in table().values():
        if _leaf(row.key) == name and row.unit:
            unit = row.unit.replace(" ", "_").replace("/", "_per_").replace("^p", "15")
            return name.removesuffix(f"_{unit}")
    return name


def read_overrides(texts: Sequence[str], problems: list[FileProblem]) -> dict[str, Leaves]:
    """The leaves of each `key=value` of the command line, by its key."""
    found: dict[str, Leaves] = {}
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        place = Place(f"--set {shortened(text)}")
        if not key or not equals:
            message = "needs the form key=value, such as joint=both"
            problems.append(FileProblem(place, "", message))
        elif any(covers(key, other) or covers(other, key) for other in found):
            problems.append(FileProblem(place, key, "is set twice"))
        elif node := read_text(value, place, problems):
            group, dot, inner = key.partition(".")
            node = Node({inner: node}, place, place) if dot else node
            found[key] = leaves(Node({group: node}, place, place), problems)
    return found


def overridden(file: Leaves, overrides: Mapping[str, Leaves]) -> Leaves:
    """A file's leaves with every override in place of the leaves at or under its key."""
    new = {key: node for change in overrides.values() for key, node in change.values.items()}
    places = {key: place for change in overrides.values() for key, place in change.places.items()}
    gone = [*overrides]
    for one, other in IN_PLACE_OF:
        gone += [other] * (one in new) + [one] * (other in new)
    if "joint" in new and new["joint"].value == "none":
        gone += OF_JOINTS
    kept = {
        key: node
        for outer, value in file.values.items()
        for key, node in _opened(outer, value, new).items()
        if key in new or not any(covers(other, key) for other in gone)
    }
    return Leaves(kept | new, places | file.places)


def merged(file: Leaves, block: Leaves) -> Leaves:
    """A file's leaves with every leaf of one of its blocks in place of the file's."""
    changes = {key: Leaves({key: node}, {}) for key, node in block.values.items()}
    found = overridden(file, changes)
    return Leaves(found.values, file.places | block.places)


def _opened(key: str, node: Node, new: Mapping[str, Node]) -> dict[str, Node]:
    """A value that stands for a whole group, split up if an override sets a part of the group."""
    if not any(other.startswith(f"{key}.") for other in new):
        return {key: node}
    return dict.fromkeys(stands_for(key), node)


def covers(outer: str, key: str) -> bool:
    """Whether a key is another one, or in the group that the other names."""
    return f"{key}.".startswith(f"{outer}.")

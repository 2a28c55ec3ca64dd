"""Values in place of a case file's: `key=value` on the command line, and blocks of the file."""

from collections.abc import Mapping, Sequence

from compressor.cases.conflicts import IN_PLACE_OF
from compressor.cases.keys import Leaves, leaves
from compressor.cases.yaml_reader import FileProblem, Node, Place, cut, read_text
from compressor.metrics import JOINTS


def read_overrides(texts: Sequence[str], problems: list[FileProblem]) -> dict[str, Leaves]:
    """The leaves of each `key=value` of the command line, by its key."""
    found: dict[str, Leaves] = {}
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        place = Place(f"--set {cut(text)}")
        if not key or not equals:
            message = "needs the form key=value, such as joint=both"
            problems.append(FileProblem(place, "", message))
        elif any(_covers(key, other) or _covers(other, key) for other in found):
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
        gone.append("clearance_mm")
    kept = {
        key: node
        for outer, value in file.values.items()
        for key, node in _opened(outer, value, new).items()
        if key in new or not any(_covers(other, key) for other in gone)
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
    return {f"{key}.{joint}": node for joint in JOINTS} if key == "clearance_mm" else {}


def _covers(outer: str, key: str) -> bool:
    return f"{key}.".startswith(f"{outer}.")

"""Shorthands: a group's name with one value for several of its keys, as in `clearance_mm: 0.2`.

The one place that knows which there are. A shorthand is an axis of a sweep like any key, so that
it stays one until a case is built.
"""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from compressor.cases.parameter import Parameter
from compressor.cases.table import WORDS, Settings, table
from compressor.metrics import JOINTS


class Shorthand(NamedTuple):
    """The keys that a group's name stands for, what their value is, and a name for each of it."""

    keys: tuple[str, ...]
    phrase: str
    each: str


SHORTHANDS = {
    "clearance_mm": Shorthand(
        tuple(f"clearance_mm.{joint}" for joint in JOINTS),
        "radial clearance, of both joints or each",
        "radial clearance",
    )
}


def stands_for(key: str) -> tuple[str, ...]:
    """Return the keys that a shorthand sets; none where a key is no shorthand."""
    return SHORTHANDS[key].keys if key in SHORTHANDS else ()


def row_of(key: str) -> Parameter | None:
    """Return the row of the table that a key's values must keep; None where there is none."""
    return table().get(next(iter(stands_for(key)), key))


def phrase_of(key: str) -> str:
    """Return what a key's values are called: of a shorthand, what each of its keys' is."""
    row = row_of(key)
    return SHORTHANDS[key].each if key in SHORTHANDS else row.phrase if row else key


def expanded(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the nested values with every shorthand written out as the group that it stands for."""
    return {
        key: {name.rpartition(".")[2]: value for name in stands_for(key)}
        if key in SHORTHANDS and not isinstance(value, Mapping)
        else value
        for key, value in values.items()
    }


def single(values: Iterable[Any]) -> Any:
    """Return the one value that all are equal to, or None."""
    found = {*values}
    return found.pop() if len(found) == 1 else None


def value_of(case: Settings, key: str) -> Any:
    """Return a case's value of a dotted key; None where it has none, or no single one."""
    if key in WORDS:
        return getattr(case, key) is not None
    if key in SHORTHANDS:
        return single(size for part in stands_for(key) if (size := value_of(case, part)) > 0)
    value: Any = case
    for part in key.split("."):
        value = getattr(value, part, None)
    return value


def value_in(values: Mapping[str, Any], key: str) -> Any:
    """Return the value of a dotted key in nested values; None where they have none, or no single
    one.
    """
    value: Any = values
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    if not isinstance(value, Mapping):
        return value
    return single(size for size in value.values() if size > 0) if key in SHORTHANDS else None

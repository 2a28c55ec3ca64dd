"""Values checked against the table of parameters: one value, one group, or a key at the top."""

import dataclasses
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any

from compressor.cases.accuracy import checked_targets
from compressor.cases.parameter import NO_VALUE, Problem
from compressor.cases.table import GROUPS, WORDS, table
from compressor.cases.unknown import no_mapping, unknown

PLAIN = (int, float, str)


def checked(key: str, value: Any, problems: list[Problem]) -> Any:
    """Return a value as its dataclass holds it; its default if it is wrong, which joins
    `problems`.
    """
    row, before = table()[key], len(problems)
    if value is None and row.optional:
        return row.default
    if row.kind == "accuracy" and isinstance(value, Mapping):
        targets = checked_targets(key, value, problems)
        return targets if len(problems) == before else row.default
    if not isinstance(value, PLAIN):
        value = _scalar(value)
    message = row.check(value)
    if message:
        problems.append(Problem(key, message))
        return row.default
    if row.kind == "number" and not isinstance(value, str):
        return float(value) + 0.0  # no -0.0: equal cases have one key
    if row.kind == "integer":
        return int(value)
    return tuple(value) if row.kind == "materials" else row.choice_of(value)


def _scalar(value: Any) -> Any:
    """Return a scalar of numpy or xarray as Python has it; any other value as it is."""
    return value.item() if getattr(value, "ndim", None) == 0 and hasattr(value, "item") else value


def checked_part(key: str, value: Any, problems: list[Problem]) -> Any:
    """Return the dataclass, scalar or None that stands for a key at the top of a case file.

    What is wrong with its value joins `problems`.
    """
    if key in GROUPS:
        if key in WORDS and value is WORDS[key]:
            return GROUPS[key]() if value else None
        if not isinstance(value, Mapping):
            problems.append(Problem(key, NO_VALUE if value is None else no_mapping(key, value)))
            return None
        try:
            found, wrong = _shared_group(key, tuple((n, v, type(v)) for n, v in value.items()))
        except TypeError:  # a list or a mapping is in it
            found, wrong = _group(key, value.items())
        problems += wrong
        return found
    if key not in table() or "." in key:
        message = unknown(str(key), "", file=False, value=value)
        problems.append(Problem(str(key), message))
        return None
    return checked(key, value, problems)


@lru_cache(maxsize=256)
def _shared_group(key: str, items: tuple[tuple[str, Any, type], ...]) -> tuple[Any, list[Problem]]:
    """Return a group from its values, and what is wrong; jobs of a sweep share those they have
    alike.

    Types are part of the values, since 1, 1.0 and true are equal.
    """
    return _group(key, [(name, value) for name, value, _ in items])


def _group(key: str, items: Iterable[tuple[str, Any]]) -> tuple[Any, list[Problem]]:
    """Return a group from its values, the defaults in place of wrong ones, and what is wrong."""
    problems: list[Problem] = []
    fields = {item.name for item in dataclasses.fields(GROUPS[key])}
    good = {}
    for name, value in items:
        if name in fields:
            good[name] = checked(f"{key}.{name}", value, problems)
        else:
            problems.append(Problem(f"{key}.{name}", unknown(str(name), key, value=value)))
    return GROUPS[key](**good), problems


def values_given(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values that are set in nested values, by dotted key."""
    found: dict[str, Any] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            found |= {f"{key}.{name}": item for name, item in value.items() if item is not None}
        else:
            found[key] = value
    return found

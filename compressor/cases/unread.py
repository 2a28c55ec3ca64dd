"""Keys that a case does not read: the one rule, of which `keys_read` has the jobs of files.

Who reads a key stands in the table of parameters (`read`). Where a file gives a key and none of the
jobs it is given for reads it, the file's author believes in what does not count.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from compressor.cases.parameter import Problem
from compressor.cases.readers import Reader
from compressor.cases.shorthands import SHORTHANDS, row_of
from compressor.cases.table import GROUPS, WORDS, Settings, group_readers, table


def conditions(key: str) -> list[tuple[str, Reader]]:
    """Return what holds where a case reads a key, each with what is unread where it does not."""
    group = key.partition(".")[0]
    whole = group_readers(group) if group in GROUPS else ()
    row = table().get(key)  # a group's name has none
    own = row.read[len(whole) :] if row else ()
    return [*((group, one) for one in whole), *((key, one) for one in own)]


def reads(case: Settings, key: str) -> bool:
    """Return whether a case reads a key."""
    return all(reader.reads(case) for _, reader in conditions(key))


def is_off(key: str, value: Any) -> bool:
    """Return whether a value says that there is none of something, as is so by default."""
    row = row_of(key)
    return not value and not (row and row.default)


def problem_of(key: str, reader: Reader) -> Problem:
    """Return the problem of a key or group that nothing reads."""
    what = "group" if key in GROUPS and key not in SHORTHANDS else "key"
    remedy = f"set that, or leave the {what} out"
    return Problem(key, f"nothing reads this {what}: it needs {reader.words}; {remedy}")


def unread_values(case: Settings, values: Mapping[str, Any]) -> Iterator[Problem]:
    """Find the keys of one case that it does not read; values: those given, by dotted key.

    A value that the case would have without it passes, so that `Case.values` reads back; a group
    that a case has only if it is named does not.
    """
    for key, value in values.items():
        for unread, reader in conditions(key):
            if reader.reads(case):
                continue
            named = unread in WORDS and WORDS[unread]
            if not is_off(key, value) and (named or value != default_in(case, key)):
                yield problem_of(unread, reader)
            break


def values_read(case: Any) -> dict[str, Any]:
    """Return the values of a case, nested, without those that it does not read."""
    found: dict[str, Any] = {}
    for key, value in case.values().items():
        if not isinstance(value, Mapping):
            found[key] = value
        elif inner := {name: v for name, v in value.items() if reads(case, f"{key}.{name}")}:
            found[key] = inner
    return found


def default_in(case: Settings, key: str) -> Any:
    """Return the value that a case would have of a key if it were not given."""
    row = row_of(key)
    group, _, name = key.rpartition(".")
    within = getattr(case, group, None) if row else None
    if row is None or row.default is not None or within is None or not isinstance(case, Settings):
        return row.default if row else None
    without: Any = {group: replace(within, **{name: None})}
    return getattr(getattr(replace(case, **without), group), name)

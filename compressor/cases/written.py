"""A case as the text of a case file: the whole of it, or what differs from the defaults."""

import json
import re
from collections.abc import Mapping
from typing import Any

from compressor.cases.case import Case
from compressor.cases.parameter import CaseError
from compressor.cases.table import WORDS
from compressor.cases.unread import values_read
from compressor.cases.yaml_reader import resolved

WORD = re.compile(r"[A-Za-z][A-Za-z0-9._-]*")


def to_yaml(case: Case, brief: bool = False) -> str:
    """Return a resolved case as the text of a case file, which reads back to an equal case.

    Values that the case does not read are left out. A job of a sweep over loads or laws may have
    some that are not the defaults: its text reads back to a case of the same physics and another
    key. brief: without the name and all that is so by default; it then reads back to an equal job.
    """
    values = _needed(values_read(case)) if brief else values_read(case)
    lines = []
    for key, value in values.items():
        if isinstance(value, Mapping):
            lines.append(f"{key}:")
            lines += [f"  {name}: {_scalar(item)}" for name, item in value.items()]
        else:
            lines.append(f"{key}: {_scalar(value)}")
    return "\n".join(lines) + "\n"


def _needed(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values of a case without those that follow from the others."""
    case, kept = Case.resolve(values), dict(values)
    for key, value in values.items():
        for name in value if isinstance(value, Mapping) else ():
            rest = {inner: item for inner, item in kept[key].items() if inner != name}
            if _is_same(kept | {key: rest or WORDS.get(key, {})}, case):
                kept[key] = rest or WORDS.get(key, {})
        rest = {outer: item for outer, item in kept.items() if outer != key}
        if key == "name" or _is_same(rest, case):
            kept = rest
    return kept or {"load": case.load}  # a file needs a key


def _is_same(values: Mapping[str, Any], case: Case) -> bool:
    """Return whether values make a case."""
    try:
        return Case.resolve({"name": case.name, **values}) == case
    except CaseError:
        return False


def _scalar(value: Any) -> str:
    """Return a value in YAML: as JSON, but plain where a word reads back as text."""
    if isinstance(value, str) and WORD.fullmatch(value) and resolved(value) == value:
        return value
    return json.dumps(value)

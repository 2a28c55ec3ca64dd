"""A case as the text of a case file: the whole of it, or what differs from the defaults."""

import json
import re
from collections.abc import Mapping
from typing import Any

from compressor.cases.case import Case
from compressor.cases.parameter import CaseError
from compressor.cases.table import WORDS
from compressor.cases.yaml_reader import resolved

WORD = re.compile(r"[A-Za-z][A-Za-z0-9._-]*")


def to_yaml(case: Case, brief: bool = False) -> str:
    """A resolved case as the text of a case file, which reads back to an equal case.

    brief: without the name and all that is so by default; it then reads back to an equal job.
    """
    values = _needed(case) if brief else case.values()
    lines = []
    for key, value in values.items():
        if isinstance(value, Mapping):
            lines.append(f"{key}:")
            lines += [f"  {name}: {_scalar(item)}" for name, item in value.items()]
        else:
            lines.append(f"{key}: {_scalar(value)}")
    return "\n".join(lines) + "\n"


def _needed(case: Case) -> dict[str, Any]:
    """The values of a case without those that follow from the others."""
    kept = case.values()
    for key, value in case.values().items():
        for name in value if isinstance(value, Mapping) else ():
            rest = {inner: item for inner, item in kept[key].items() if inner != name}
            if _is_same(kept | {key: rest or WORDS.get(key, {})}, case):
                kept[key] = rest or WORDS.get(key, {})
        rest = {outer: item for outer, item in kept.items() if outer != key}
        if key == "name" or _is_same(rest, case):
            kept = rest
    return kept or {"load": case.load}  # a file needs a key


def _is_same(values: Mapping[str, Any], case: Case) -> bool:
    """Whether values make a case."""
    try:
        return Case.from_values({"name": case.name, **values}) == case
    except CaseError:
        return False


def _scalar(value: Any) -> str:
    """A value in YAML: as JSON, but plain where a word reads back as text."""
    if isinstance(value, str) and WORD.fullmatch(value) and resolved(value) == value:
        return value
    return json.dumps(value)

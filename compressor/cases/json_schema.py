"""The JSON Schema of case files, so that editors complete their keys and mark mistakes.

Pydantic writes that of one value, and the table of parameters has the rest: here a key may also be
swept. What it does not check, such as whether values fit each other, reading the file does
(`compressor.cases.load`).
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from compressor.cases.checks import DOUBLES, keys_of, phrase_of, row_of, row_of_double
from compressor.cases.load import WHOLE_FILE, Report
from compressor.cases.parameter import Parameter, rows_of
from compressor.cases.study import Sample
from compressor.cases.swept import FORMS, SAMPLED
from compressor.cases.table import GROUPS, WORDS, outside_identity, parts_by_key, table

# keys of which one part may be given alone
MAY_LACK = ("clearance_mm", "healthy_clearance_mm", "gas.indicator", "gas.clearance_percent")

Schema = dict[str, Any]


def case_schema() -> Schema:
    """Return the JSON Schema of a whole case file, in the dialect 2020-12."""
    keys = dict.fromkeys(key.partition(".")[0] for key in table())
    found = {key: _group(key) if key in GROUPS else _value_or_parts(key) for key in keys}
    swept = {"enum": [key for key in (*parts_by_key(), *table()) if key not in outside_identity()]}
    group = {"type": "array", "items": swept, "minItems": 2, "uniqueItems": True}
    text = {"type": "string"}
    found |= {
        "sample": _group_of_file(Sample),
        "zip": {"description": "keys whose values advance together", **_list(group)},
        "exclude": {
            "description": "comparisons; jobs for which one holds are left out",
            "anyOf": [text, _list(text)],
        },
        "report": _group_of_file(Report),
    }
    block = _mapping({key: item for key, item in found.items() if key not in WHOLE_FILE})
    about = "sets of jobs, one after the other; each over the keys of the file"
    found["blocks"] = {"description": about, **_list(block), "minItems": 1}
    dialect = "https://json-schema.org/draft/2020-12/schema"
    title = "compsim case file"
    return {"$schema": dialect, "title": title, **_mapping(found), "$defs": {"made": _forms()}}


def _mapping(properties: Mapping[str, Schema], *required: str) -> Schema:
    needed = {"required": [*required]} if required else {}
    return {"type": "object", "properties": properties, "additionalProperties": False} | needed


def _list(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def _group_of_file(of: type) -> Schema:
    """Return the schema of a group of a file that is no part of a case."""
    rows = [row for item in fields(of) for row in rows_of(item.name, item)]
    about = (of.__doc__ or "").partition("\n")[0]
    return {"description": about, **_mapping({row.key: _single_value(row) for row in rows})}


def _group(name: str) -> Schema:
    """Return the schema of a group of keys."""
    own = [key for key in keys_of(lambda key: key) if key.startswith(f"{name}.")]
    found = {key.partition(".")[2]: _value_or_parts(key) for key in own}
    for double in DOUBLES:
        if double.startswith(f"{name}."):
            found[double.partition(".")[2]] = _value(row_of_double(double))
    mapping = _mapping(found)
    about = (GROUPS[name].__doc__ or "").partition("\n")[0]
    if name in WORDS:
        return {"description": about, "anyOf": [{"const": WORDS[name]}, mapping]}
    return {"description": about, **mapping}


def _value_or_parts(key: str) -> Schema:
    """Return the schema of a key, which may have a value for each part."""
    row = row_of(key)
    assert row
    if key not in parts_by_key():
        return _value(row)
    parts = parts_by_key()[key]
    each = _mapping({part: _value(table()[f"{key}.{part}"]) for part in parts})
    each |= {"minProperties": 1} if key in MAY_LACK else {"required": [*parts]}
    found = _value(replace(row, phrase=phrase_of(key)))
    about = {word: found.pop(word) for word in ("description", "default") if word in found}
    return about | {"anyOf": [*found.get("anyOf", [found]), each]}


def _value(row: Parameter) -> Schema:
    """Return the schema of a parameter: one value, or a sweep of it."""
    single = _single_value(row)
    about = f"{row.phrase}, {row.unit}" if row.unit else row.phrase
    found: Schema = {"description": f"{about} ({row.source})"}
    if row.default is not None and row.kind != "text":
        found["default"] = row.default
    if not row.identity:
        return found | single
    listed = {**_list(single), "minItems": 1, "uniqueItems": True}
    return found | {"anyOf": [single, listed, *[{"$ref": "#/$defs/made"}] * row.is_number]}


def _single_value(row: Parameter) -> Schema:
    """Return the schema of one value of a parameter."""
    words = (*row.choices, *(alias for alias, _ in row.aliases))
    return replace(row, optional=False, choices=words).adapter.json_schema()


def _forms() -> Schema:
    """Return the schema of values that are made, such as {linspace: [0.1, 0.3, 5]}."""
    number = {"type": "number"}
    forms = []
    for word, inside in FORMS.items():
        count = inside.count(",") + 1
        numbers = {**_list(number), "minItems": count, "maxItems": count, "description": inside}
        forms.append(_mapping({word: numbers}, word))
        if word in SAMPLED:
            forms[-1] = _mapping({word: numbers, "log": {"type": "boolean"}}, word)
    return {"anyOf": forms}

"""The JSON Schema of case files, so that editors complete their keys and mark mistakes.

Pydantic writes that of one value, and the table of parameters has the rest: here a key may also be
swept. What it cannot check, such as whether values fit each other, reading the file does
(`compressor.cases.load`).
"""

from dataclasses import replace
from typing import Any

from compressor.cases.checks import DOUBLES, FIGURES, REPORT, phrase_of, row_of
from compressor.cases.conflicts import IN_PLACE_OF
from compressor.cases.parameter import NAME, Parameter, adapter_of
from compressor.cases.swept import DISTRIBUTIONS, FORMS, SAMPLED
from compressor.cases.table import GROUPS, WORDS, outside_identity, parts_by_key, table

DIALECT = "https://json-schema.org/draft/2020-12/schema"
NUMBER, TEXT = {"type": "number"}, {"type": "string"}
# keys of which one part may be given alone
MAY_LACK = ("clearance_mm", "healthy_clearance_mm", "gas.indicator", "gas.clearance_percent")
WHOLE_FILE = ("name", "blocks", "report")  # what cannot stand in a block

Schema = dict[str, Any]


def case_schema() -> Schema:
    """Return the JSON Schema of a whole case file, in the dialect 2020-12."""
    keys = dict.fromkeys(key.partition(".")[0] for key in table())
    found = {key: _group(key) if key in GROUPS else _value_or_parts(key) for key in keys}
    found |= _sweeps()
    in_block = {key: item for key, item in found.items() if key not in WHOLE_FILE}
    blocks = {"type": "array", "minItems": 1, "items": _mapping(in_block)}
    blocks["description"] = "sets of jobs, one after the other; each over the keys of the file"
    top = _mapping(found | {"blocks": blocks})
    made = {"made": _forms(), "distribution": _distributions()}
    return {"$schema": DIALECT, "title": "compsim case file", **top, "$defs": made}


def _mapping(properties: Schema, *required: str) -> Schema:
    needed = {"required": [*required]} if required else {}
    return {"type": "object", "properties": properties, "additionalProperties": False} | needed


def _group(name: str) -> Schema:
    """Return the schema of a group of keys."""
    own = [key for key in table() if key.startswith(f"{name}.")]
    keys = dict.fromkeys(".".join(key.split(".")[:2]) for key in own)
    found = {key.partition(".")[2]: _value_or_parts(key) for key in keys}
    doubles = [pair for pair in DOUBLES.items() if pair[0].startswith(f"{name}.")]
    for word, key in doubles:
        row = table()[key]
        span = {"default": 2 * row.default, "low": 2 * row.low, "high": 2 * row.high}
        row = replace(row, key=word, phrase=f"twice {key}, in its place", **span)
        found[word.partition(".")[2]] = _value(row)
    mapping = _mapping(found)
    pairs = [pair for pair in IN_PLACE_OF if pair[0].startswith(f"{name}.")] + doubles
    if pairs:
        rivals = ([key.split(".")[1] for key in pair] for pair in pairs)
        mapping["allOf"] = [{"not": {"required": pair}} for pair in rivals]
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
    listed = {"type": "array", "items": single, "minItems": 1, "uniqueItems": True}
    return found | {"anyOf": [single, listed, *[{"$ref": "#/$defs/made"}] * row.is_number]}


def _single_value(row: Parameter) -> Schema:
    """Return the schema of one value of a parameter."""
    if row.kind == "text":
        return {**TEXT, "pattern": rf"^(?!\.){NAME.pattern}$"}
    words = (*row.choices, *(alias for alias, _ in row.aliases))
    return adapter_of(replace(row, optional=False, choices=words)).json_schema()


def _forms() -> Schema:
    """Return the schema of values that are made, such as {linspace: [0.1, 0.3, 5]}."""
    counted = {**NUMBER, "multipleOf": 1, "minimum": 2}
    forms = []
    for word, inside in FORMS.items():
        items = [counted if part.strip(" []") == "count" else NUMBER for part in inside.split(",")]
        numbers = {"type": "array", "prefixItems": items, "items": False, "minItems": len(items)}
        more = {"log": {"type": "boolean"}} if word in SAMPLED else {}
        forms.append(_mapping({word: numbers | {"description": inside}} | more, word))
        if word in SAMPLED:
            forms.append(_mapping({word: {"$ref": "#/$defs/distribution"}}, word))
    return {"anyOf": forms}


def _distributions() -> Schema:
    """Return the schema of what designs draw from, such as {normal: {mean: 0.2, sd: 0.02}}."""
    shapes = {
        "normal": _mapping({"mean": NUMBER, "sd": {**NUMBER, "exclusiveMinimum": 0}}, "mean", "sd"),
        "triangular": {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3},
    }
    return {
        "anyOf": [
            _mapping({name: shapes[name] | {"description": inside}}, name)
            for name, inside in DISTRIBUTIONS.items()
        ]
    }


def _sweeps() -> Schema:
    """Return the schemas of the keys that say how values are swept together."""
    whole = {"type": "integer", "minimum": 1}
    sample = _mapping({"n": whole, "seed": {"type": "integer", "minimum": 0}})
    keys = {"enum": [key for key in (*parts_by_key(), *table()) if key not in outside_identity()]}
    group = {"type": "array", "items": keys, "minItems": 2, "uniqueItems": True}
    texts = {"type": "array", "items": TEXT}
    report = {name: {**TEXT, "minLength": 1, "maxLength": most} for name, most in REPORT.items()}
    report["figures"] = {"enum": [*FIGURES]}
    about = {
        "sample": ("how many samples, and from which seed", sample),
        "zip": ("keys whose values advance together", {"type": "array", "items": group}),
        "exclude": ("comparisons; jobs for which one holds are left out", {"anyOf": [TEXT, texts]}),
        "report": ("what the page of the report says of the machine", _mapping(report)),
    }
    return {key: {"description": phrase, **schema} for key, (phrase, schema) in about.items()}

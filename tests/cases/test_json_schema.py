"""The JSON Schema takes what the reader takes; what is wrong: test_mistaken_cases.py."""

import json

import jsonschema
import pytest
from compsim import cli
from conftest import CONFIGS
from test_pages import blocks

from compressor.cases.json_schema import case_schema
from compressor.cases.load import load_studies
from compressor.cases.table import parts_by_key, table
from compressor.cases.yaml_reader import Place, read_text

SCHEMA = jsonschema.Draft202012Validator(case_schema())
EXAMPLES = [path.read_text(encoding="utf-8") for path in CONFIGS] + blocks("yaml")
OTHERS = [
    "joint: big_end\nclearance_mm: 0.1\ncontact: {materials: [steel, copper]}",
    "solve: {accuracy: {peak_acceleration: 0.01, max_penetration: 0.05}}",
    "solve: {max_steps: {range: [10, 30, 10]}, error_bars: false}",
    "joint: both\nclearance_mm: {big_end: 0.1, small_end: [0.1, 0.2]}",
    "joint: both\nclearance_mm: {random: [0.01, 1], log: true}\nsample: {n: 2, seed: 3}",
    "load: [none, spring]\nexclude: [load == none]\nfriction: false",
    "joint: both\nclearance_mm: 0.1\nmachine: {pin_radius_mm: {big_end: [50, 60], small_end: 35}}",
]


def test_the_schema_is_one_and_is_printed(capsys):
    jsonschema.Draft202012Validator.check_schema(SCHEMA.schema)
    assert cli.main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == SCHEMA.schema


@pytest.mark.parametrize("text", EXAMPLES + OTHERS)
def test_what_reads_is_valid(text, tmp_path):
    (tmp_path / "case.yaml").write_text(text, encoding="utf-8")
    load_studies(tmp_path / "case.yaml")
    tree, _ = read_text(text, Place("x", 1, 1))
    SCHEMA.validate(tree.values)


def values(row):
    """Values at, and just beyond, the bounds of a parameter, and some of other types."""
    if row.kind != "card":  # whether a file is there, no schema can tell
        yield "nonsense"
    yield from (7, True, [], {}, row.default)
    if row.kind in ("number", "integer"):
        yield from (row.low, row.high, row.low - 1, row.high * 1.01, (row.low + row.high) // 2)
    yield from row.choices


@pytest.mark.parametrize("row", table().values(), ids=lambda row: row.key)
def test_a_value_is_valid_where_the_table_takes_it(row):
    *above, name = row.key.split(".")
    others = [part for part in parts_by_key().get(".".join(above), ()) if part != name]
    for value in values(row):
        if value in ([], {}) or value is None:
            good = False
        else:
            good = row.check(value) is None
        nested = {name: value} | dict.fromkeys(others, value)
        for one in reversed(above):
            nested = {one: nested}
        assert SCHEMA.is_valid(nested) == good, value

"""The JSON Schema of case files says what the reader says, as far as it can tell."""

import json

import jsonschema
import pytest
from compsim import cli
from conftest import CONFIGS
from test_pages import blocks

from compressor.cases.json_schema import case_schema
from compressor.cases.load import CaseFileError, load_studies
from compressor.cases.table import parts_by_key, table
from compressor.cases.yaml_reader import Place, read_text

SCHEMA = jsonschema.Draft202012Validator(case_schema())
EXAMPLES = [path.read_text(encoding="utf-8") for path in CONFIGS] + blocks("yaml")
OTHERS = [
    "joint: big_end\nclearance_mm: 0.1\ncontact: {materials: [steel, copper]}",
    "joint: big_end\nclearance_mm: 0.1\ncontact: {materials: [[steel, copper], [steel, steel]]}",
    "solve: {accuracy: {peak_acceleration: 0.01, max_penetration: 0.05}}",
    "solve: {max_steps: {range: [10, 30, 10]}, error_bars: false}",
    "joint: both\nclearance_mm: {big_end: 0.1, small_end: [0.1, 0.2]}",
    "joint: both\nclearance_mm: {random: [0.01, 1], log: true}\nsample: {n: 2, seed: 3}",
    "load: [none, spring]\nexclude: [load == none]\nfriction: false",
    "joint: both\nclearance_mm: 0.1\nmachine: {pin_radius_mm: {big_end: [50, 60], small_end: 35}}",
    "machine: {rod_mass_kg: {sobol: {normal: {mean: 4, sd: 0.2}}}}\nsample: {n: 2}",
    "machine: {rod_mass_kg: {lhs: {triangular: [3, 4, 6]}}}\nsample: {n: 2}",
]
WRONG = [
    "joint: big_en",
    "speed_rpm: 500",
    "machine: {speed_rmp: 500}",
    "machine: 5",
    "machine: {speed_rpm: '500'}",
    "machine: {speed_rpm: []}",
    "machine: {rod_mass_kg: {linspace: [1, 2]}}",
    "machine: {rod_mass_kg: {lnspace: [1, 2, 3]}}",
    "machine: {rod_mass_kg: {linspace: [1, 2, 3], log: true}}",
    "machine: {rod_mass_kg: {linspace: {triangular: [3, 4, 6]}}}",
    "machine: {rod_mass_kg: [4, 4]}",
    "joint: both\nclearance_mm: 0.1\nmachine: {pin_radius_mm: {big_end: 60}}",
    "joint: big_end\nclearance_mm: {}",
    "output: {keep: [series, metrics]}",
    "name: ../x",
    "name: .x",
    "name: [a, b]",
    "friction: true",
    "friction: {static: -1}",
    "contact: {materials: [steel]}",
    "contact: {materials: [steel, wood]}",
    "solve: {accuracy: good}",
    "solve: {accuracy: {}}",
    "solve: {accuracy: {peak: 0.01}}",
    "solve: {max_steps: 1.5}",
    "joint: big_end\nclearance_mm: {sobol: [0.1, 0.2]}\nsample: {n: 0}",
    "joint: big_end\nclearance_mm: [0.1, 0.2]\nzip: [[clearance_mm]]",
    "load: [none, spring]\nexclude: 5",
    "blocks: []",
    "blocks: [{name: x}]",
    "blocks: [{blocks: [{load: none}]}]",
]


def plain(text):
    tree, problems = read_text(text, Place("x", 1, 1))
    assert problems == []
    return tree.values


def reads(text, place):
    (place / "case.yaml").write_text(text, encoding="utf-8")
    try:
        load_studies(place / "case.yaml")
    except CaseFileError:
        return False
    return True


def test_the_schema_is_one_and_is_printed(capsys):
    jsonschema.Draft202012Validator.check_schema(SCHEMA.schema)
    assert cli.main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == SCHEMA.schema


@pytest.mark.parametrize("text", EXAMPLES + OTHERS)
def test_what_reads_is_valid(text, tmp_path):
    assert reads(text, tmp_path)
    SCHEMA.validate(plain(text))


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_marked(text, tmp_path):
    assert not reads(text, tmp_path)
    assert not SCHEMA.is_valid(plain(text))


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

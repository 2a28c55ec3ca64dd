"""One value for several keys of a group: what it stands for, and that one place knows."""

import ast
from pathlib import Path

import pytest

from compressor.cases.case import Case
from compressor.cases.checks import (
    row_of,
    single,
    stands_for,
    value_in,
    value_of,
)
from compressor.cases.table import GROUPS, parts_by_key, table

ROOT = Path(__file__).parents[2]


def test_a_key_by_part_stands_for_the_key_of_each():
    for name in parts_by_key():
        assert name not in GROUPS
        assert [*stands_for(name)] == [key for key in table() if key.startswith(f"{name}.")]
    assert stands_for("machine") == stands_for("machine.speed_rpm") == ()


def test_a_key_by_part_has_the_row_of_the_keys_that_it_stands_for():
    for name in parts_by_key():
        kept = {(r.kind, r.low, r.high, r.unit) for r in map(row_of, stands_for(name)) if r}
        row = row_of(name)
        assert row
        assert kept == {(row.kind, row.low, row.high, row.unit)}
    assert row_of("machine.speed_rpm") is table()["machine.speed_rpm"]
    assert row_of("machine") is row_of("nonsense") is None


@pytest.mark.parametrize(("values", "one"), [([1, 1.0], 1), ([1, 2], None), ([], None)])
def test_a_single_value_is_one_that_all_share(values, one):
    assert single("clearance_mm", values) == one


@pytest.mark.parametrize(
    ("clearance", "value"),
    [
        ({"joint": "both", "clearance_mm": 0.1}, 0.1),
        ({"joint": "big_end", "clearance_mm": 0.1}, 0.1),
        ({"joint": "both", "clearance_mm": {"big_end": 0.1, "small_end": 0.2}}, None),
        ({}, None),
    ],
)
def test_a_shorthand_has_a_value_where_the_joints_with_clearance_share_one(clearance, value):
    case = Case.from_values(clearance)
    assert value_of(case, "clearance_mm") == value_in(case.values(), "clearance_mm") == value


def test_values_are_found_by_dotted_key():
    case = Case.from_values({"friction": False, "machine": {"speed_rpm": 300}})
    assert value_of(case, "machine.speed_rpm") == value_in(case.values(), "machine.speed_rpm")
    assert value_of(case, "friction") is value_in(case.values(), "friction") is False
    assert value_of(case, "friction.static") is value_in(case.values(), "friction.static") is None
    assert value_in(case.values(), "machine") is None


def special_cases(source: str) -> list[int]:
    """Lines that ask for the shorthand of clearance by name, or take one joint for all."""
    found = []
    for node in ast.walk(ast.parse(source)):
        asks = isinstance(node, ast.Compare) or (
            isinstance(node, ast.Call) and ast.unparse(node.func).endswith("startswith")
        )
        texts = [n.value for n in ast.walk(node) if isinstance(n, ast.Constant)] if asks else []
        if any(str(text).startswith("clearance_mm") for text in texts):
            found.append(node.lineno)
        if isinstance(node, ast.Subscript) and ast.unparse(node) == "JOINTS[0]":
            found.append(node.lineno)
    return found


def test_only_one_module_knows_of_the_shorthand():
    paths = [*ROOT.glob("compressor/**/*.py"), *ROOT.glob("cmd/**/*.py")]
    found = {str(p): special_cases(p.read_text(encoding="utf-8")) for p in paths}
    assert {name: lines for name, lines in found.items() if lines} == {}

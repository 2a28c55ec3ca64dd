"""What is shared by jobs of a sweep: every key that a swept one decides is known to differ."""

import dataclasses
import random

import pytest

from compressor.cases.case import Case, parts_of
from compressor.cases.combinations import Block
from compressor.cases.conflicts import Watched
from compressor.cases.keys import Leaves
from compressor.cases.table import GROUPS, table
from tests.cases.test_combinations import SWEPT, drawn

BASES = [
    {"joint": "big_end", "clearance_mm": 0.2},
    {"joint": "both", "clearance_mm": 0.2, "friction": {"law": "lugre"}, "wear": True},
    {"joint": "both", "clearance_mm": 0.2, "load": "gas", "guide": True, "body": True,
     "sensor": True, "drive": True, "rod": True, "machine": {"small_end_pin_radius_mm": 9}},
    {"joint": "small_end", "clearance_mm": 0.2, "lubricant": True,
     "contact": {"law": "johnson", "length_mm": 20, "materials": ["steel", "copper"]}},
]  # fmt: skip


def leaf_values(case):
    """The values of a case by dotted key, and of each group whether the case has it."""
    found = {}
    for item in dataclasses.fields(Case):
        value = getattr(case, item.name)
        if item.name not in GROUPS:
            found[item.name] = value
            continue
        found[item.name] = value is not None
        for key, inner in vars(value).items() if value is not None else ():
            found[f"{item.name}.{key}"] = inner
    return found


def with_value(base, key, value):
    group, _, name = key.rpartition(".")
    if not group:
        return base | {name: value}
    given = base.get(group)
    if group == "clearance_mm":
        given = {"big_end": 0.2, "small_end": 0.2}
    return base | {group: (given if isinstance(given, dict) else {}) | {name: value}}


@pytest.mark.parametrize("base", BASES, ids=lambda base: base["joint"])
@pytest.mark.parametrize("key", SWEPT)
def test_what_a_key_decides_is_known_to_differ(base, key):
    values = drawn(table()[key], random.Random(key))
    if key == "machine.pin_radius_mm":
        values.append(9)  # that of the small end in one base, whose key then says nothing
    if key == "joint":
        values = ["none", "big_end", "small_end", "both"]
    block = Block("x", Leaves({}, {}), {}, (((key,), [()] * len(values)),), range(2), True)
    built = [Case(**parts_of(with_value(base, key, value), True)[0]) for value in values]
    first, *others = map(leaf_values, built)
    for other in others:
        differing = {k for k in first | other if first.get(k) != other.get(k)}
        inside = {k for k in differing if k.partition(".")[0] in first | other}
        for name in inside:
            group = name.partition(".")[0]
            assert block.factors_of([name, group]) == (0,), name


def test_a_watched_case_notes_what_is_read_also_by_properties():
    case, read = Case.from_values(BASES[0]), []
    watched = Watched(case, read.append)
    assert watched.duration == case.duration
    assert watched.machine.pin_radius("small_end") == case.machine.pin_radius("small_end")
    assert {"solve.duration_rev", "machine.speed_rpm", "machine.pin_radius_mm"} <= {*read}
    assert "machine.rod_mass_kg" not in read

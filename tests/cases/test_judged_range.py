"""The range that the program was judged on: one source for the table, the draw and the warning."""

import re

import pytest

from compressor.cases.case import Case
from compressor.cases.checks import row_of
from compressor.cases.conflicts import outside_judged
from compressor.cases.examples import templates
from compressor.cases.table import parts_by_key, table

LOOSE = {"joint": "both", "clearance_mm": 0.2}


def outside(**values):
    return outside_judged(Case.from_values({**LOOSE, **values}))


def test_the_defaults_are_inside():
    groups = dict.fromkeys(("drive", "rod", "lubricant"), True)
    assert outside(guide={"clearance_mm": 0.1}, **groups) == {}


def test_the_ends_are_inside():
    for key in ("machine.rod_mass_kg", "machine.speed_rpm", "contact.stiffness_N_per_mm15"):
        group, _, name = key.partition(".")
        for end in row_of(key).judged:
            assert key not in outside(**{group: {name: end}})
            beyond = end * (0.9 if end == row_of(key).judged[0] else 1.1)
            assert key in outside(**{group: {name: beyond}})
    both = {"big_end": 2.0, "small_end": 5.0}
    assert {*outside(clearance_mm=both)} == {f"clearance_mm.{joint}" for joint in both}


def test_what_is_not_read_is_not_outside():
    ideal = {"contact": {"damping_N_s_per_mm": 1e5}, "friction": {"static": 0.9}}
    assert outside_judged(Case.resolve(ideal)) == {}
    assert {*outside(**ideal)} == {"contact.damping_N_s_per_mm", "friction.static"}
    other = {"contact": {"exponent": 1.1, "stiffness_N_per_mm15": 100.0}}  # in another unit
    assert outside(**other) == {}


def test_the_example_draws_extremes_from_the_judged_ranges():
    """Each key that has a range is drawn from it, in numbers of four digits."""
    text = templates()["extremes"].path.read_text(encoding="utf-8")
    for key, row in table().items():
        if row.judged:
            whole, _, name = key.rpartition(".")
            if whole in parts_by_key() and whole != "clearance_mm":
                name = whole.rpartition(".")[2]
            spans = re.findall(rf"\b{name}: {{sobol: \[(.*?), (.*?)\]", text)
            found = [(float(low), float(high)) for low, high in spans]
            low, high = row.judged
            assert any(one == pytest.approx((low or one[0], high), rel=1e-3) for one in found), key

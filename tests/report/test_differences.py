"""What differs from the defaults: each key once, with its unit, and nothing that only follows."""

import pytest

from compressor.cases.case import Case
from compressor.report.paper_sections import differences


def told(values):
    return {one.key: (one.value, one.default) for one in differences(Case.from_values(values))}


def test_the_default_case_differs_in_nothing():
    assert told({}) == {}
    assert told({"name": "other", "output": {"keep": "metrics"}}) == {}


WORN = {"joint": "big_end", "clearance_mm": 0.2}
WORN_SAYS = told(WORN)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"machine": {"rod_mass_kg": 3}}, {"machine.rod_mass_kg": ("3 kg", "4.7 kg")}),
        (
            {"machine": {"rod_mass_kg": 3, "rod_inertia_kg_m2": 0.2}},
            {
                "machine.rod_mass_kg": ("3 kg", "4.7 kg"),
                "machine.rod_inertia_kg_m2": ("0.2 kg m2", "0.141 kg m2"),
            },
        ),
        ({"machine": {"rod_length_mm": 500}}, {"machine.rod_length_mm": ("500 mm", "600 mm")}),
        (WORN | {"contact": {"exponent": 1.6}}, {"contact.exponent": ("1.6", "1.5")}),
        ({"load": "none"}, {"load": ("none", "spring")}),
        ({"solve": {"duration_rev": 6}}, {"solve.duration_rev": ("6 rev", "4 rev")}),
        ({"solve": {"duration_s": 0.48}}, {}),  # the same four revolutions
        ({"solve": {"duration_s": 0.96}}, {"solve.duration_s": ("0.96 s", "none")}),
        ({"solve": {"accuracy": "fine", "method": "BDF"}}, {}),  # how, not what
        (
            WORN | {"contact": {"materials": ["steel", "copper"]}},
            {
                "contact.materials": ("steel, copper", "none"),
                "contact.geometry": ("external", "none"),
            },
        ),
    ],
)
def test_keys_that_differ(values, expected):
    assert told(values) == (WORN_SAYS if "joint" in values else {}) | expected


def test_a_group_that_is_left_out_or_added_is_one_difference():
    (friction,) = differences(Case.from_values({"friction": False}))
    assert friction.key == "friction"
    assert friction.value == "false"
    assert "static 0.23" in friction.default
    (body,) = differences(Case.from_values({"body": {"mass_kg": 600}}))
    assert body.said.startswith("body: freedoms xy, mass_kg 600, ")
    assert body.default == "none"


def test_what_others_say_is_left_out():
    case = Case.from_values({"joint": "both", "clearance_mm": 0.2, "machine": {"speed_rpm": 400}})
    (one,) = differences(case, ("joint", "clearance_mm"))
    assert one.said == "machine.speed_rpm, crank speed: 400 rpm (default: 500 rpm)"


def test_a_value_without_which_nothing_fits_is_a_difference():
    """A stroke of the follower beyond the default crank's."""
    values = {"machine": {"crank_radius_mm": 200}, "spring": {"stroke_mm": 300}}
    assert told(values) == {
        "machine.crank_radius_mm": ("200 mm", "120 mm"),
        "spring.stroke_mm": ("300 mm", "120 mm"),
    }

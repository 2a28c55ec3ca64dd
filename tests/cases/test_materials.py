"""Eq. 15: Table 3's stiffness from Table 2's steel, and Hertz's other sign for a pin in a bore."""

import math

import pytest

from compressor.cases.case import Case
from compressor.cases.materials import contact_stiffness
from compressor.solve.si_record import record


def test_the_papers_stiffness_is_that_of_two_discs():
    assert contact_stiffness("steel", "steel", 0.010, 0.0099) / 1000**1.5 == pytest.approx(
        3.3606e5, rel=1e-4
    )


@pytest.mark.parametrize("clearance", [0.1, 0.2, 0.3])
def test_a_pin_in_a_bore_is_stiffer_by_the_root_of_the_radii_s_sum_over_their_difference(clearance):
    stiffness = {}
    for geometry in ("external", "internal"):
        contact = {"materials": ["steel", "steel"], "geometry": geometry}
        case = Case.from_values({"joint": "both", "clearance_mm": clearance, "contact": contact})
        stiffness[geometry] = record(case)["stiffness"]
    expected = math.sqrt((20.0 + clearance) / clearance)
    assert stiffness["internal"] / stiffness["external"] == pytest.approx([expected] * 2)


def test_an_ideal_joint_beside_a_worn_one_has_no_bore_to_differ_from():
    contact = {"materials": ["steel", "steel"], "geometry": "internal"}
    case = Case.from_values({"joint": "big_end", "clearance_mm": 0.2, "contact": contact})
    big, small = record(case)["stiffness"]
    assert big > 10 * small > 0.0

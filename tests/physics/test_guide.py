"""Corners of the crosshead on its guide: their force, and whose keys it goes by."""

import math

import pytest

from compressor.cases.case import Case
from compressor.physics.contact_laws import power, rise
from compressor.physics.mechanism import corner_force
from compressor.solve.si_record import record


def record_of(guide=None, **contact):
    joint = {"joint": "big_end", "clearance_mm": 0.2} if contact else {}
    values = joint | {"guide": {"clearance_mm": 0.1} | (guide or {}), "contact": contact}
    return record(Case.from_values(values))


def test_a_guide_has_keys_of_its_own_and_else_those_of_the_joints():
    usual, own = record_of(), record_of({"damping_N_s_per_mm": 9, "full_damping_mm": 0.02})
    joints = record_of(damping_N_s_per_mm=9, full_damping_mm=0.02)
    for p, damping in ((usual, 3.36e5), (own, 9e3), (joints, 9e3)):
        full = 1e-4 if p is usual else 2e-5
        elastic = p["guide_stiffness"] * power(1e-5, 1.5)
        force = elastic + damping * rise(1e-5 / full) * 0.1
        assert corner_force(1e-5, 0.1, p) == pytest.approx((force, elastic), rel=1e-14)
    shape = record_of({"exponent": 2})
    assert shape["guide_stiffness"] == pytest.approx(3.36e5 * 1000.0**2)
    assert shape["exponent"] == 1.5
    assert math.isclose(corner_force(1e-3, 0.0, shape)[0], 3.36e5, rel_tol=1e-12)


@pytest.mark.parametrize("law", [
    {"law": "impact"}, {"law": "hertz"}, {"law": "flores", "restitution": 0.7},
])  # fmt: skip
def test_damping_of_the_guide_moves_the_crosshead_whatever_the_law(law):
    """9, 336 and 5000 N s/mm gave one motion where the joints' law was not ADAMS's."""
    found = []
    for damping in (9, 5000):
        p = record_of({"damping_N_s_per_mm": damping}, **law)
        found.append(corner_force(2e-5, 0.05, p)[0])
    assert found[0] < found[1]

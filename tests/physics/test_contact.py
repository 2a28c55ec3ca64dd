"""Contact at joints and guide: ADAMS's curves, balances, stiffness by materials, keys."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from compressor.cases.case import Case
from compressor.cases.materials import contact_stiffness
from compressor.physics.contact import joint_contact
from compressor.physics.contact_laws import normal_force, power, rise
from compressor.physics.mechanism import corner_force
from compressor.solve.si_record import record

K = 3.36e5 * 1000**1.5


def law(**values):
    return record(Case.from_values({"joint": "big_end", "clearance_mm": 0.2, **values}))


@pytest.mark.parametrize(
    ("s", "h"),
    [(-1, 0), (-5e-3, 0), (0, 0), (0.25, 0.15625), (0.5, 0.5), (1, 1), (1.005, 1), (9, 1)],
)
def test_rise_is_a_cubic_and_constant_outside_to_the_bit(s, h):
    assert rise(s) == h


@pytest.mark.parametrize("force", [825, 3087])
def test_static_penetration(force):
    assert normal_force((force / K) ** (2 / 3), 0.0, 1.0, K, 2e-4, law())[0] == pytest.approx(force)


vectors = st.tuples(
    *[st.floats(-3e-4, 3e-4)] * 2, *[st.floats(-1, 1)] * 2, *[st.floats(-80, 80)] * 2
)


@given(vectors)
def test_joint_contact_balances_angular_momentum_and_only_loses_energy(state):
    """At the big end, by its eccentricity, the rate of that, and both spins."""
    (ex, ey), p = state[:2], law()
    found = joint_contact(0, state[:4], state[4:], state[:4], p)
    # the journal's moment about its own centre, moved to the bore's centre with its force there
    journal = (p.pin_radius[0] - found.penetration) * found.friction
    moved = journal + ex * -found.fy - ey * -found.fx
    cancelled = found.normal * math.hypot(ex, ey)
    rounding = 1e-9 * (1 + abs(journal)) + 1e-15 * cancelled
    assert moved + found.moment == pytest.approx(0, abs=rounding)
    assert found.friction * found.slip <= 0
    assert found.normal >= 0
    assert (found.normal > 0) <= (found.penetration > 0)


@pytest.mark.parametrize(
    ("radii", "stiffness"), [((0.010, 0.0099), 3.3606e5), ((0.010, 0.0102), 3.3858e5)]
)
def test_stiffness_of_steel_on_steel(radii, stiffness):
    found = contact_stiffness("steel", "steel", *radii) / 1000**1.5
    assert found == pytest.approx(stiffness, rel=2e-4)


def test_materials_give_each_joint_its_stiffness():
    """Hertz's other sign: a pin in a bore is stiffer by the root of the radii's sum over c."""
    values = {"joint": "both", "clearance_mm": {"big_end": 0.1, "small_end": 0.3}}
    contact = {"materials": ["steel", "copper"]}
    found = record(Case.from_values(values | {"contact": contact}))["stiffness"]
    expected = [contact_stiffness("steel", "copper", 0.010, 0.010 + c) for c in (1e-4, 3e-4)]
    assert found == pytest.approx(expected)
    assert math.isclose(expected[0], contact_stiffness("copper", "steel", 0.0101, 0.010))
    internal = record(Case.from_values(values | {"contact": contact | {"geometry": "internal"}}))
    stiffer = [math.sqrt((20.0 + c) / c) for c in (0.1, 0.3)]
    assert internal["stiffness"] / found == pytest.approx(stiffer)
    values = {"contact": {"materials": ["steel", "steel"], "geometry": "internal"}}
    one_ideal = law(**values)["stiffness"]  # which has no bore to differ from
    assert one_ideal[1] == pytest.approx(contact_stiffness("steel", "steel", 0.010, 0.010))


# ---- corners of the crosshead on its guide


def guided(guide=None, **contact):
    joint = {"joint": "big_end", "clearance_mm": 0.2} if contact else {}
    values = joint | {"guide": {"clearance_mm": 0.1} | (guide or {}), "contact": contact}
    return record(Case.from_values(values))


def test_a_guide_has_keys_of_its_own_and_else_those_of_the_joints():
    usual, own = guided(), guided({"damping_N_s_per_mm": 9, "full_damping_mm": 0.02})
    joints = guided(damping_N_s_per_mm=9, full_damping_mm=0.02)
    for p, damping in ((usual, 3.36e5), (own, 9e3), (joints, 9e3)):
        full = 1e-4 if p is usual else 2e-5
        elastic = p["guide_stiffness"] * power(1e-5, 1.5)
        force = elastic + damping * rise(1e-5 / full) * 0.1
        assert corner_force(1e-5, 0.1, p) == pytest.approx((force, elastic), rel=1e-14)
    shape = guided({"exponent": 2})
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
        p = guided({"damping_N_s_per_mm": damping}, **law)
        found.append(corner_force(2e-5, 0.05, p)[0])
    assert found[0] < found[1]

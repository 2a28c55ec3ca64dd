"""The contact law against closed forms and ADAMS's definitions."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from compressor.cases.case import Case
from compressor.cases.materials import contact_stiffness
from compressor.physics.contact import friction_coefficient, joint_contact
from compressor.physics.contact_laws import normal_force, rise
from compressor.solve.si_record import record

K = 3.36e5 * 1000**1.5
C = 2e-4  # m


def law(**values):
    return record(Case.from_values({"joint": "big_end", "clearance_mm": 0.2, **values}))


@pytest.mark.parametrize(("s", "h"), [(-1, 0), (0, 0), (0.25, 0.15625), (0.5, 0.5), (1, 1), (9, 1)])
def test_rise_values(s, h):
    assert rise(s) == pytest.approx(h)


@pytest.mark.parametrize("s", [1e-3, 5e-3, 9e-3])
def test_rise_is_constant_outside_to_the_bit(s):
    """There the cubic would be off by 3 s^2."""
    assert (rise(-s), rise(1.0 + s)) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("slip", "mu"), [(0, 0), (0.005, 0.158125), (0.01, 0.23), (0.055, 0.19), (0.1, 0.15), (3, 0.15)]
)
def test_friction_values(slip, mu):
    assert friction_coefficient(slip, 0.0, law()) == pytest.approx(mu)


@pytest.mark.parametrize(("force", "depth_mm"), [(825, 0.018), (3087, 0.044)])
def test_static_penetration(force, depth_mm):
    assert (force / K) ** (2 / 3) * 1e3 == pytest.approx(depth_mm, abs=5e-4)
    assert normal_force((force / K) ** (2 / 3), 0.0, 1.0, K, C, law())[0] == pytest.approx(force)


def test_the_clamp_never_pulls():
    assert normal_force(1e-5, -100.0, 1.0, K, C, law())[0] == 0.0
    assert normal_force(0.0, 5.0, 1.0, K, C, law())[0] == 0.0
    assert normal_force(-1e-9, 5.0, 1.0, K, C, law())[0] == 0.0


def bounce(speed, p, mass=5.0):
    """Contact time, exit speed and depth of a mass that strikes the contact at `speed`."""

    def derivative(_, y):
        return [y[1], -normal_force(y[0], y[1], 1.0, K, C, p)[0] / mass]

    def leaves(_, y):
        return y[0]

    leaves.terminal, leaves.direction = True, -1
    scale = speed * 1e-4
    run = solve_ivp(
        derivative, (0, 1), [1e-15, speed], "DOP853", events=leaves, rtol=1e-10,
        atol=scale * 1e-10, dense_output=True,
    )  # fmt: skip
    depth = run.sol(np.linspace(0, run.t[-1], 2001))[0].max()
    return run.t[-1], abs(run.y[1, -1]), depth


@pytest.mark.parametrize("speed", [0.01, 0.1, 1.0])
def test_undamped_bounce_is_hertzian(speed):
    seconds, out, depth = bounce(speed, law(contact={"damping_N_s_per_mm": 0}))
    deepest = (5 * 5.0 * speed**2 / (4 * K)) ** 0.4
    assert depth == pytest.approx(deepest, rel=1e-5)
    assert seconds == pytest.approx(2.9432 * deepest / speed, rel=1e-4)
    assert out == pytest.approx(speed, rel=1e-8)


@pytest.mark.parametrize(
    ("speed", "restitution"), [(0.01, 0.90), (0.1, 0.31), (0.2, 0.16), (1, 0.03)]
)
def test_restitution_of_the_paper_s_contact(speed, restitution):
    assert bounce(speed, law())[1] / speed == pytest.approx(restitution, abs=0.006)


vectors = st.tuples(
    *[st.floats(-3e-4, 3e-4)] * 2, *[st.floats(-1, 1)] * 2, *[st.floats(-80, 80)] * 2
)


def touch(state, p):
    """Contact at the big end, by its eccentricity, the rate of that, and both spins."""
    return joint_contact(0, state[:4], state[4:], state[:4], p)


@given(vectors)
def test_joint_contact_balances_angular_momentum(state):
    (ex, ey), p = state[:2], law()
    found = touch(state, p)
    # the journal's moment about its own centre, moved to the bore's centre with its force there
    journal = (p.pin_radius[0] - found.penetration) * found.friction
    moved = journal + ex * -found.fy - ey * -found.fx
    cancelled = found.normal * math.hypot(ex, ey)
    rounding = 1e-9 * (1 + abs(journal)) + 1e-15 * cancelled
    assert moved + found.moment == pytest.approx(0, abs=rounding)


@given(vectors)
def test_joint_contact_only_loses_energy_to_friction(state):
    found = touch(state, law())
    assert found.friction * found.slip <= 0
    assert found.normal >= 0
    assert (found.normal > 0) <= (found.penetration > 0)


def test_concentric_circles_exert_no_force():
    assert touch((0.0, 0.0, 1.0, 1.0, 50.0, 3.0), law())[:5] == (0, 0, 0, 0, 0)


def test_contact_pushes_the_journal_back():
    found = touch((2.5e-4, 0.0, 0.0, 0.0, 0.0, 0.0), law())
    assert found.fx == pytest.approx(
        K * (0.5e-4) ** 1.5
    )  # on the rod; the journal gets its opposite
    assert found.penetration == pytest.approx(0.5e-4)


@pytest.mark.parametrize(
    ("radii", "stiffness"), [((0.010, 0.0099), 3.3606e5), ((0.010, 0.0102), 3.3858e5)]
)
def test_stiffness_of_steel_on_steel(radii, stiffness):
    assert contact_stiffness("steel", "steel", *radii) / 1000**1.5 == pytest.approx(
        stiffness, rel=2e-4
    )


@pytest.mark.parametrize("clearance", [0.1, 0.2, 0.3])
def test_a_pin_in_a_bore_is_stiffer_by_the_root_of_the_radii_s_sum_over_their_difference(clearance):
    """Hertz's other sign; an ideal joint beside it has no bore to differ from."""
    stiffness = {}
    for geometry in ("external", "internal"):
        contact = {"materials": ["steel", "steel"], "geometry": geometry}
        stiffness[geometry] = law(clearance_mm=clearance, contact=contact)["stiffness"]
    big, small = stiffness["internal"] / stiffness["external"]
    assert big == pytest.approx(math.sqrt((20.0 + clearance) / clearance))
    assert small == pytest.approx(1.0)


def test_materials_give_each_joint_its_stiffness():
    case = Case.from_values(
        {
            "joint": "both",
            "clearance_mm": {"big_end": 0.1, "small_end": 0.3},
            "contact": {"materials": ["steel", "copper"]},
        }
    )
    expected = [contact_stiffness("steel", "copper", 0.010, 0.010 + c) for c in (1e-4, 3e-4)]
    assert record(case).stiffness == pytest.approx(np.array(expected))
    assert math.isclose(expected[0], contact_stiffness("copper", "steel", 0.0101, 0.010))

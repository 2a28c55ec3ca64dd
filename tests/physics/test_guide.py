"""Corners of the crosshead on its guide: what a strike gives back, and how the law follows."""

import math

import pytest
from scipy.integrate import solve_ivp

from compressor.cases.case import Case, CaseError
from compressor.physics.contact_laws import power, rise
from compressor.physics.mechanism import approach_speed, corner_force
from compressor.solve.si_record import record

LEVER = 0.05  # m
MASS = 1.0 / (1.0 / 14.0 + LEVER**2 * 12.0 / (14.0 * (0.12**2 + 0.08**2)))  # kg, at the lever


def record_of(guide=None, **contact):
    joint = {"joint": "big_end", "clearance_mm": 0.2} if contact else {}
    values = joint | {"guide": {"clearance_mm": 0.1} | (guide or {}), "contact": contact}
    return record(Case.from_values(values))


def given_back(p, speed):
    """What a free strike gives back of the speed (m/s) at which a corner meets its guide."""

    def move(t, y):
        return [y[1], -corner_force(y[0], y[1], LEVER, p)[0] / MASS]

    def leaves(t, y):
        return y[0] if t > 1e-9 else 1.0

    leaves.terminal, leaves.direction = True, -1
    end = solve_ivp(
        move, (0.0, 0.1), [1e-15, speed], "DOP853", rtol=1e-10, atol=1e-14, events=leaves
    )
    return -end.y[1, -1] / speed


# of the table in physics/README.md, Other contact laws: what comes back for the restitution asked
@pytest.mark.parametrize(
    ("law", "asked", "expected"),
    [
        ("lankarani_nikravesh", 0.5, 0.7252), ("hunt_crossley", 0.3, 0.5813),
        ("flores", 0.7, 0.6832), ("gonthier", 0.9, 0.8764), ("hu_guo", 0.3, 0.2707),
    ],
)  # fmt: skip
@pytest.mark.parametrize("speed", [0.02, 2.0])
def test_a_free_strike_gives_back_what_the_joints_law_does(law, asked, expected, speed):
    p = record_of(law=law, restitution=asked, least_approach_mm_per_s=1e-3)
    assert given_back(p, speed) == pytest.approx(expected, abs=1e-3)


def test_the_speed_of_approach_is_that_of_the_strike_throughout():
    """By depth and rate alone, at every moment of a strike that has energy in its contact."""
    p = record_of(law="flores", restitution=0.5)
    chi = p["guide_hysteresis"].item()

    def move(t, y):
        elastic = p["guide_stiffness"] * max(y[0], 0.0) ** 1.5
        return [y[1], -elastic * (1.0 + chi * y[1] / 0.3) / MASS]

    path = solve_ivp(move, (0.0, 2.5e-4), [0.0, 0.3], "DOP853", rtol=1e-11, atol=1e-15)
    for depth, rate in path.y.T[1:]:
        stored = p["guide_stiffness"] * depth**2.5 / 2.5
        assert approach_speed(rate, stored, MASS, chi) == pytest.approx(0.3, rel=1e-6)


def test_a_guide_has_keys_of_its_own_and_else_those_of_the_joints():
    usual, own = record_of(), record_of({"damping_N_s_per_mm": 9, "full_damping_mm": 0.02})
    joints = record_of(damping_N_s_per_mm=9, full_damping_mm=0.02)
    for p, damping in ((usual, 3.36e5), (own, 9e3), (joints, 9e3)):
        full = 1e-4 if p is usual else 2e-5
        elastic = p["guide_stiffness"] * power(1e-5, 1.5)
        force = elastic + damping * rise(1e-5 / full) * 0.1
        assert corner_force(1e-5, 0.1, LEVER, p) == pytest.approx((force, elastic), rel=1e-14)
    own = record_of({"restitution": 0.9}, law="flores", restitution=0.5)
    assert own["guide_hysteresis"] == pytest.approx(1.6 * 0.1 / 0.9)
    assert own["hysteresis"] == pytest.approx(1.6)
    shape = record_of({"exponent": 2})
    assert shape["guide_stiffness"] == pytest.approx(3.36e5 * 1000.0**2)
    assert shape["exponent"] == 1.5
    assert math.isclose(corner_force(1e-3, 0.0, LEVER, shape)[0], 3.36e5, rel_tol=1e-12)


def test_a_restitution_of_the_guide_needs_a_law_that_has_one():
    with pytest.raises(CaseError, match=r"guide\.restitution"):
        Case.from_values({"guide": {"clearance_mm": 0.1, "restitution": 0.5}})


@pytest.mark.parametrize("law", ["impact", "hertz"])
def test_damping_of_the_guide_moves_the_crosshead_whatever_the_law(law):
    """9, 336 and 5000 N s/mm gave one motion where the joints' law was not ADAMS's."""
    found = []
    for damping in (9, 5000):
        p = record_of({"damping_N_s_per_mm": damping}, law=law)
        found.append(corner_force(2e-5, 0.05, LEVER, p)[0])
    assert found[0] < found[1]

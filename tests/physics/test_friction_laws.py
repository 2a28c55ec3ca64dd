"""What every friction law must satisfy, and its values; bristles by hand."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from compressor.cases.case import Case
from compressor.cases.table import table
from compressor.metrics import JOINTS
from compressor.physics.contact import (
    ContactState,
    FrictionLaw,
    bristle_rate,
    friction_coefficient,
    stribeck,
    write_carried_rates,
)
from compressor.solve.si_record import record

laws = pytest.mark.parametrize("law", table()["friction.law"].choices)
# by law: slips (m/s), and coefficients that they have
VALUES = {
    "adams": {0: 0, 0.005: 0.158125, 0.01: 0.23, 0.055: 0.19, 0.1: 0.15, 3: 0.15},
    "coulomb_tanh": {0.01: 0.15 * math.tanh(1.0)},
    "threlfall": {0.005: 0.15 * (1 - math.exp(-1.5)) / (1 - math.exp(-3.0)), 0.02: 0.15},
    "ambrosio": {0.01: 0.0, 0.055: 0.075, 0.2: 0.15},
    "lugre": {0.01: 0.15 + 0.08 * math.exp(-1.0)},
}


def friction(law, **more):
    """A record with a friction law: 0.23, 0.15, 10 and 100 mm/s by default."""
    values = {"friction": {"law": law, **more}}
    return record(Case.from_values({"joint": "big_end", "clearance_mm": 0.2, **values}))


def settled(slip, p):
    """The coefficient in steady sliding: bristles as they then are."""
    bristle = 0.0
    if p["friction"] == FrictionLaw.LUGRE:
        bristle = math.copysign(stribeck(slip, p) / p["bristle_stiffness"], slip)
    return friction_coefficient(slip, bristle, p)


@laws
def test_the_coefficient_is_odd_bounded_and_continuous_and_has_its_values(law):
    p = friction(law)
    for slip, mu in VALUES[law].items():
        assert settled(slip, p) == pytest.approx(mu, rel=1e-12)
    assert settled(10.0, p) == pytest.approx(0.15, rel=1e-9)
    for slip in np.geomspace(1e-6, 10.0, 200):
        mu = settled(slip, p)
        assert settled(-slip, p) == pytest.approx(-mu, rel=1e-12)
        assert 0.0 <= mu <= 0.23 + 1e-12
    step = 1e-6
    ends = np.linspace(-0.2, 0.2, 801) - 0.5 * step  # and so about each corner
    jumps = [friction_coefficient(v + step, 0.0, p) - friction_coefficient(v, 0.0, p) for v in ends]
    assert np.abs(jumps).max() < 60.0 * step  # the steepest of all is 47 s/m


@pytest.mark.parametrize("slip", [0.002, 0.01, -0.3])
def test_bristles_bend_as_their_equation_solved_by_hand(slip):
    """At a constant slip z = g / sigma_0 (1 - e^(-sigma_0 |v| t / g)), as if it were a spring."""
    p = friction("lugre")
    most = math.copysign(stribeck(slip, p) / p["bristle_stiffness"], slip)
    rate = abs(slip / most)
    times = np.linspace(0.0, 5.0 / rate, 9)
    found = solve_ivp(
        lambda t, z: [bristle_rate(slip, z[0], p)], times[[0, -1]], [0.0], t_eval=times,
        rtol=1e-10, atol=1e-16,
    )  # fmt: skip
    left = np.exp(-rate * times)
    np.testing.assert_allclose(found.y[0], most * (1 - left), atol=1e-8 * abs(most))
    rubbing = p["bristle_stiffness"] * most * (1 - left) + p["bristle_damping"] * slip * left
    mu = [friction_coefficient(slip, bristle, p) for bristle in found.y[0]]
    np.testing.assert_allclose(mu, rubbing + p["viscous"] * slip, rtol=1e-6)


@pytest.mark.parametrize("joint", [0, 1])
def test_bristles_bend_at_the_worn_joint_alone(joint):
    values = {"joint": JOINTS[joint], "clearance_mm": 0.2, "friction": {"law": "lugre"}}
    p = record(Case.from_values(values))
    place = 2 * p["freedoms"]
    y, rates = np.full(place + 4, 1e-6), np.full(place + 4, math.nan)
    sliding = ContactState(*np.zeros(len(ContactState._fields)))._replace(slip=0.02)
    write_carried_rates(sliding, sliding, 0.5, y, p, rates)
    expected = np.zeros(4)
    expected[2 + joint] = 0.5 * bristle_rate(0.02, 1e-6, p)
    np.testing.assert_array_equal(rates[place:], expected)
    assert expected.any()

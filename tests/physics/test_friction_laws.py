"""What every friction law must satisfy, its values, and runs with it by other integrators."""

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
from compressor.solve.simulate import simulate

LAWS = [law.name.lower() for law in FrictionLaw if law]
laws = pytest.mark.parametrize("law", LAWS)
SLIPS = np.concatenate(([0.0], np.geomspace(1e-6, 10.0, 200)))


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


def test_every_choice_of_a_case_file_is_compiled():
    assert {*LAWS} == {*table()["friction.law"].choices}


@laws
def test_the_coefficient_is_odd_and_bounded(law):
    p = friction(law)
    for slip in SLIPS[1:]:
        mu = settled(slip, p)
        assert settled(-slip, p) == pytest.approx(-mu, rel=1e-12)
        assert 0.0 <= mu <= 0.23 + 1e-12
    assert settled(10.0, p) == pytest.approx(0.15, rel=1e-9)


def steepest(p):
    """The greatest slope of a record's friction coefficient over the slip (s/m), by its formula."""
    law, rise_over = p["friction"], p["stiction_velocity"].item()
    if law == FrictionLaw.ADAMS:
        return 1.5 * p["static"].item() / rise_over
    if law == FrictionLaw.THRELFALL:
        return 3.0 / (1.0 - math.exp(-3.0)) * p["dynamic"].item() / rise_over
    if law == FrictionLaw.AMBROSIO:
        return p["dynamic"].item() * p["per_transition"].item()
    if law == FrictionLaw.LUGRE:
        return (p["bristle_damping"] + p["viscous"]).item()
    return p["dynamic"].item() / rise_over


@laws
def test_the_coefficient_is_continuous_and_no_steeper_than_told(law):
    p = friction(law)
    slips = np.linspace(-0.2, 0.2, 16_001)
    values = np.array([friction_coefficient(slip, 0.0, p) for slip in slips])
    slope = np.abs(np.diff(values) / np.diff(slips)).max()
    told = steepest(p)
    if law == "lugre":  # the bristles' own damping, where they are not bent
        assert slope == pytest.approx(told, rel=1e-3)
    else:
        assert told * 0.99 <= slope <= told * (1 + 1e-9)


@pytest.mark.parametrize(
    ("law", "slip", "mu"),
    [
        ("coulomb_tanh", 0.01, 0.15 * math.tanh(1.0)),
        ("threlfall", 0.005, 0.15 * (1 - math.exp(-1.5)) / (1 - math.exp(-3.0))),
        ("threlfall", 0.02, 0.15),
        ("ambrosio", 0.01, 0.0),
        ("ambrosio", 0.055, 0.075),
        ("ambrosio", 0.2, 0.15),
        ("adams", 0.01, 0.23),
    ],
)
def test_values(law, slip, mu):
    assert settled(slip, friction(law)) == pytest.approx(mu, rel=1e-12)


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
    np.testing.assert_allclose(found.y[0], most * (1 - np.exp(-rate * times)), atol=1e-8 * most)


def test_bristles_stick():
    """Held below the static coefficient the bodies come to rest; ADAMS's law lets them creep."""
    p, adams = friction("lugre"), friction("adams")
    held, mass = 0.1, 2.0  # tangential over normal force; mass (kg) under a normal force of 1 kN

    def rates(t, y):
        slip, bristle = y
        mu = friction_coefficient(slip, bristle, p)
        return [(held - mu) * 1000.0 / mass, bristle_rate(slip, bristle, p)]

    end = solve_ivp(rates, (0.0, 0.5), [0.0, 0.0], method="LSODA", rtol=1e-9, atol=1e-12).y[:, -1]
    assert abs(end[0]) < 1e-9  # m/s
    assert end[1] * p["bristle_stiffness"] == pytest.approx(held, rel=1e-6)
    creep = solve_ivp(
        lambda t, y: [(held - friction_coefficient(y[0], 0.0, adams)) * 1000.0 / mass],
        (0.0, 0.5), [0.0], method="LSODA", rtol=1e-9, atol=1e-12,
    ).y[0, -1]  # fmt: skip
    assert creep > 1e-3


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


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize(("law", "joint"), [("lugre", "both"), ("ambrosio", "big_end")])
def test_runs_keep_their_energy_and_agree_with_other_methods(law, joint):
    """Of the explicit pair, the stiff partner and SciPy's DOP853."""
    values = {"joint": joint, "clearance_mm": 0.2, "friction": {"law": law},
              "output": {"keep": "series"}}  # fmt: skip
    solve = {"duration_rev": 0.35, "settle_rev": 0.1, "error_bars": False, "output_step_deg": 1}
    runs = {
        method: simulate(Case.from_values({**values, "solve": {**solve, "rtol": rtol,
                                                                "method": method}}))
        for method, rtol in (("auto", 1e-8), ("RODAS", 1e-8), ("DOP853", 1e-9))
    }  # fmt: skip
    exact = runs["auto"]["acceleration"].values
    for method, run in runs.items():
        assert run["status"].item() == "ok", (method, run.attrs.get("detail"))
        away = np.linalg.norm(run["acceleration"].values - exact) / np.linalg.norm(exact)
        assert away < 2e-4, (method, away)

"""What every contact law must satisfy; Johnson's and Liu's, of a pin in its bore, as told."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import lambertw

from compressor.cases.case import Case
from compressor.cases.laws import CYLINDRICAL
from compressor.cases.table import table
from compressor.physics.contact_laws import (
    FLATTEST,
    HYSTERESIS,
    JOHNSON_DEEPEST,
    Law,
    elastic_force,
    elastic_form,
    johnson,
    johnson_form,
    liu,
    normal_force,
)
from compressor.physics.record import Load
from compressor.solve.request import Stop, check_depth, greatest_depths
from compressor.solve.si_record import record

DEPTH = 3e-5  # m
APPROACH = 0.2  # m/s
CLEARANCE = 2e-4  # m
RESTITUTION = 0.8
laws = pytest.mark.parametrize("law", [law.name.lower() for law in Law])
exponents = pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])


def restitutes(law):
    """Whether a law damps by how fast bodies have met."""
    return Law[law.upper()] in HYSTERESIS


def contact(law, exponent=1.5, **more):
    """A record with a law, and the stiffness of its joint."""
    values = {"law": law, "exponent": exponent, "restitution": RESTITUTION, **more}
    if law in CYLINDRICAL:
        values |= {"length_mm": 20, "modulus_GPa": 110}
    p = record(
        Case.resolve({"joint": "big_end", "clearance_mm": 1000 * CLEARANCE, "contact": values})
    )
    return p, float(p["stiffness"][0])


@pytest.mark.parametrize(("key", "names"), [("contact.law", Law), ("load", Load)])
def test_every_choice_of_a_case_file_is_compiled(key, names):
    by_keys = {"cylinder", "card"}  # of load: gas
    assert ({name.lower() for name in names.__members__} - by_keys) == set(table()[key].choices)


@laws
@exponents
def test_the_energy_is_the_work_of_the_elastic_force(law, exponent):
    p, stiffness = contact(law, exponent)
    for most in (DEPTH, 1e-3 * DEPTH):
        work, _ = quad(lambda depth: elastic_force(depth, stiffness, CLEARANCE, p), 0.0, most)
        assert elastic_form(stiffness, CLEARANCE, p).energy(most) == pytest.approx(work, rel=1e-7)


@laws
@exponents
def test_the_closed_form_is_of_the_elastic_force(law, exponent):
    p, stiffness = contact(law, exponent)
    form = elastic_form(stiffness, CLEARANCE, p)
    elastic = elastic_force(DEPTH, stiffness, CLEARANCE, p)
    assert form.static_depth(elastic) == pytest.approx(DEPTH, rel=1e-12)
    near = [elastic_force(DEPTH * (1 + side), stiffness, CLEARANCE, p) for side in (-1e-5, 1e-5)]
    for depth in (DEPTH, 1e-3 * DEPTH, 1e3 * DEPTH):  # damping rises, and is full
        _, unclamped = normal_force(depth, 1.0, 1.0, stiffness, CLEARANCE, p)
        damped = unclamped - elastic_force(depth, stiffness, CLEARANCE, p)
        known = 0.0 if restitutes(law) else damped  # before bodies meet
        assert form.damping(depth) == pytest.approx(known, rel=1e-9)
    assert form.tangent(DEPTH) == pytest.approx((near[1] - near[0]) / (2e-5 * DEPTH), rel=1e-8)
    speed = np.sqrt(2.0 * form.energy(DEPTH) / 3.0)
    assert form.impact_depth(3.0, speed) == pytest.approx(DEPTH, rel=1e-12)


@laws
def test_the_force_is_elastic_and_damped_and_never_pulls(law):
    p, stiffness = contact(law)
    elastic = elastic_force(DEPTH, stiffness, CLEARANCE, p)
    damping = elastic_form(stiffness, CLEARANCE, p).damping(DEPTH)
    if restitutes(law):
        damping = elastic * HYSTERESIS[Law[law.upper()]](RESTITUTION) / APPROACH
    assert damping > 0.0 or law == "hertz"
    for rate in (0.01, 0.0, -1e-4):
        expected = elastic + damping * rate
        assert normal_force(DEPTH, rate, APPROACH, stiffness, CLEARANCE, p) == pytest.approx(
            (expected, expected)
        )
    force, unclamped = normal_force(DEPTH, -100.0, APPROACH, stiffness, CLEARANCE, p)
    assert force == 0.0 > unclamped or law == "hertz"
    assert normal_force(0.0, 1.0, 1.0, stiffness, CLEARANCE, p) == (0.0, 0.0)


# ---- a pin in its bore

LINE = math.pi * 1.1e11 * 0.02  # pi E* L, N/m
SOFT = LINE / (2.0 * math.sqrt(2.0 * CLEARANCE))
EDGE = 4.0 * CLEARANCE * FLATTEST * math.exp(-1.0 - FLATTEST)  # m, where Johnson's law is left
depths = pytest.mark.parametrize("depth", [1e-15, 1e-10, 1e-7, 2e-6, 2.1e-6, 1e-5, 4e-5, 1e-4])


@depths
def test_johnson_s_force_solves_his_equation(depth):
    force = johnson(depth, LINE, CLEARANCE)
    penetration = force / LINE * (math.log(4.0 * LINE * CLEARANCE / force) - 1.0)
    assert penetration == pytest.approx(depth, rel=1e-13)
    share = -lambertw(-math.e * depth / (4.0 * CLEARANCE), -1).real
    assert force == pytest.approx(LINE * depth / share, rel=1e-13)


def test_johnson_s_law_goes_on_along_its_tangent():
    """No depth in use gets there: the equation has no solution beyond 0.541 of the clearance."""
    assert JOHNSON_DEEPEST * CLEARANCE < EDGE < 4.0 * CLEARANCE * math.exp(-2.0)
    before, at, after = (johnson(EDGE * (1.0 + s), LINE, CLEARANCE) for s in (-1e-6, 0.0, 1e-6))
    form = johnson_form(LINE, CLEARANCE)
    assert (after - at) / (1e-6 * EDGE) == pytest.approx(form.tangent(EDGE), rel=1e-5)
    assert (at - before) / (1e-6 * EDGE) == pytest.approx(form.tangent(EDGE), rel=1e-4)
    for depth in (1.1 * EDGE, 4.0 * EDGE):
        work, _ = quad(lambda reached: johnson(reached, LINE, CLEARANCE), 0, depth, points=[EDGE])
        assert form.energy(depth) == pytest.approx(work, rel=1e-7)


@depths
def test_liu_s_force_is_his_formula(depth):
    """Of a pressure over an arc whose half angle has the cosine c / (c + delta)."""
    expected = math.sqrt(depth / (2.0 * (CLEARANCE + depth)))
    if depth > 1e-10:  # the cosine has digits left
        half = 0.5 * math.acos(CLEARANCE / (CLEARANCE + depth))
        assert math.sin(half) == pytest.approx(expected, rel=1e-4)
    assert liu(depth, SOFT, CLEARANCE) == pytest.approx(0.5 * LINE * depth * expected, rel=1e-13)


@pytest.mark.parametrize(("law", "exponent"), [
    ("impact", 1.0), ("impact", 1.5), ("impact", 2.2), ("johnson", 1.5), ("liu", 1.5),
])  # fmt: skip
def test_an_impact_takes_as_long_as_its_motion(law, exponent):
    """A free mass against the elastic force: by SciPy's integrator, until it comes back."""
    p, stiffness = contact(law, exponent)
    form, mass, speed = elastic_form(stiffness, CLEARANCE, p), 5.0, 0.3
    depth = form.impact_depth(mass, speed)
    assert form.energy(depth) == pytest.approx(0.5 * mass * speed**2, rel=1e-12)

    def back(t, y):
        return y[0]

    def rates(t, y):
        pushed = elastic_force(y[0], stiffness, CLEARANCE, p) if y[0] > 0.0 else 0.0
        return y[1], -pushed / mass

    back.terminal, back.direction = True, -1
    run = solve_ivp(rates, (0.0, 0.1), (1e-14, speed), "DOP853", rtol=1e-9, atol=1e-15, events=back)
    assert run.t_events[0][0] == pytest.approx(form.impact_time(depth, speed), rel=1e-5)
    assert run.y[0].max() <= depth * (1.0 + 1e-6)
    assert form.impact_time(0.0, 0.0) == math.inf


@pytest.mark.parametrize(("law", "most"), [("johnson", (0.5e-4, 1.5e-4)), ("liu", (1e-3, 1e-3))])
def test_johnson_s_law_holds_up_to_half_the_clearance_of_each_joint(law, most):
    """The smaller one's limit stopped the other joint."""
    clearance = {"big_end": 0.1, "small_end": 0.3}
    contact = {"law": law, "length_mm": 20, "materials": ["steel", "copper"]}
    p = record(Case.from_values({"joint": "both", "clearance_mm": clearance, "contact": contact}))
    assert greatest_depths(p) == pytest.approx(most, rel=1e-12)
    check_depth(0.99 * np.array(most), p)
    with pytest.raises(Stop, match=r"^\S+: \S+ mm"):
        check_depth(np.array([1.01 * most[0], 0.0]), p)

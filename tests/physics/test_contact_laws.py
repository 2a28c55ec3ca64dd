"""What every contact law must satisfy, whatever its formula."""

import numpy as np
import pytest
from scipy.integrate import quad

from compressor.cases.case import Case
from compressor.cases.laws import CYLINDRICAL
from compressor.cases.table import table
from compressor.physics.contact_laws import (
    FLATTEST,
    HYSTERESIS,
    Law,
    elastic_force,
    elastic_form,
    normal_force,
)
from compressor.physics.record import Load
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
    words = {name.lower() for name in names.__members__} - by_keys
    assert words == set(table()[key].choices)


@laws
@exponents
def test_the_energy_is_the_work_of_the_elastic_force(law, exponent):
    p, stiffness = contact(law, exponent)
    work, _ = quad(lambda depth: elastic_force(depth, stiffness, CLEARANCE, p), 0.0, DEPTH)
    assert elastic_form(stiffness, CLEARANCE, p).energy(DEPTH) == pytest.approx(work, rel=1e-7)


def test_johnson_s_energy_is_its_work_along_the_tangent_too():
    """Beyond the depth from which the force goes on straight, half of the clearance."""
    p, stiffness = contact("johnson")
    for depth in (0.6 * CLEARANCE, 2.0 * CLEARANCE):
        corner = [FLATTEST * 4.0 * CLEARANCE * np.exp(-1.0 - FLATTEST)]
        work, _ = quad(
            lambda reached: elastic_force(reached, stiffness, CLEARANCE, p), 0.0, depth,
            points=corner,
        )  # fmt: skip
        energy = elastic_form(stiffness, CLEARANCE, p).energy(depth)
        assert corner[0] < depth
        assert energy == pytest.approx(work, rel=1e-7)


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


def test_a_number_without_a_law_is_refused():
    p, stiffness = contact("impact")
    p["law"] = 99
    with pytest.raises(ValueError, match="99"):
        elastic_form(stiffness, CLEARANCE, p)

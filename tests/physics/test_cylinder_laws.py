"""Johnson's and Liu's laws of a pin in its bore: by Lambert's function, limits and quadrature."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import lambertw

from compressor.cases.case import Case
from compressor.physics.contact_laws import (
    FLATTEST,
    JOHNSON_DEEPEST,
    johnson,
    johnson_form,
    liu,
    liu_form,
)
from compressor.solve.request import Stop, check_depth, greatest_depths
from compressor.solve.si_record import record

CLEARANCE = 1e-4  # m
LINE = math.pi * 1.1e11 * 0.02  # pi E* L, N/m
SOFT = LINE / (2.0 * math.sqrt(2.0 * CLEARANCE))
EDGE = 4.0 * CLEARANCE * FLATTEST * math.exp(-1.0 - FLATTEST)  # m, where Johnson's law is left
depths = pytest.mark.parametrize("depth", [1e-15, 1e-10, 1e-7, 2e-6, 2.1e-6, 1e-5, 4e-5, 5e-5])


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
    slope = johnson_form(LINE, CLEARANCE).tangent(EDGE)
    assert (after - at) / (1e-6 * EDGE) == pytest.approx(slope, rel=1e-5)
    assert (at - before) / (1e-6 * EDGE) == pytest.approx(slope, rel=1e-4)


@depths
def test_liu_s_force_is_his_formula(depth):
    """Of a pressure over an arc whose half angle has the cosine c / (c + delta)."""
    half = 0.5 * math.acos(CLEARANCE / (CLEARANCE + depth)) if depth > 1e-10 else None
    expected = math.sqrt(depth / (2.0 * (CLEARANCE + depth)))
    if half:
        assert math.sin(half) == pytest.approx(expected, rel=1e-4)
    assert liu(depth, SOFT, CLEARANCE) == pytest.approx(0.5 * LINE * depth * expected, rel=1e-13)


@pytest.mark.parametrize("form", [johnson_form(LINE, CLEARANCE), liu_form(SOFT, CLEARANCE)])
def test_an_impact_takes_as_long_as_its_motion(form):
    """A free mass against the force: by SciPy's integrator, until it comes back."""
    mass, speed = 5.0, 0.3
    depth = form.impact_depth(mass, speed)
    assert form.energy(depth) == pytest.approx(0.5 * mass * speed**2, rel=1e-12)

    def back(t, y):
        return y[0]

    back.terminal, back.direction = True, -1
    run = solve_ivp(
        lambda t, y: (y[1], -form.force(y[0]) / mass if y[0] > 0.0 else 0.0),
        (0.0, 1e-2), (1e-14, speed), method="DOP853", rtol=1e-9, atol=1e-15, events=back,
    )  # fmt: skip
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

"""Step control against its formulas, and the test for stiffness on linear problems."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics.march import new_stepper, new_work
from compressor.physics.runge_kutta import FLOWS, STAGES, A
from compressor.physics.step_control import (
    LIMITED_REACH,
    MIN_ERROR,
    STABILITY_LIMIT,
    STEPS_BEFORE_STIFF,
    TEST_INTERVAL,
    Mode,
    choose_method,
    first_step,
    next_step_length,
    refuse,
    stiff_rate,
)
from compressor.physics.systems import derivative_with_flows
from compressor.solve.si_record import record

H = 1e-3
SIZE = np.array([1.0, 2.0, 0.5, 4.0])


def stepper(mode=Mode.AUTO, **fields):
    made = new_stepper(mode)
    for name, value in fields.items():
        setattr(made, name, value)
    return made


@pytest.mark.parametrize(("stiff", "order"), [(0, 5), (1, 4)])
@pytest.mark.parametrize("before", [0.9, 0.01])
@pytest.mark.parametrize("error", [1.0, 0.3, 0.02])
def test_an_accepted_step_is_followed_by_pi_control(stiff, order, before, error):
    """h' / h = 0.9 error^(-0.7 / k) before^(0.4 / k)."""
    w = stepper(stiff=stiff, error=math.log(before))
    found = next_step_length(w, H, error)
    assert found == pytest.approx(H * 0.9 * error ** (-0.7 / order) * before ** (0.4 / order))
    assert w.error == pytest.approx(math.log(error))


def test_a_step_grows_and_shrinks_within_limits():
    assert next_step_length(stepper(), H, 0.0) == pytest.approx(5 * H)
    assert next_step_length(stepper(error=math.log(1e-4)), H, 1.0) == pytest.approx(
        0.9 * 10**-0.32 * H
    )
    assert next_step_length(stepper(error=math.log(1e-30)), H, 1.0) == pytest.approx(0.2 * H)
    w = stepper()
    next_step_length(w, H, 1e-9)
    assert w.error == MIN_ERROR == pytest.approx(math.log(1e-4))


@pytest.mark.parametrize(("stiff", "order"), [(0, 5), (1, 4)])
def test_a_refused_step_is_taken_again_shorter(stiff, order):
    w = stepper(stiff=stiff)
    for error, factor in (
        (1.5, 0.9 * 1.5 ** (-1 / order)), (1e9, 0.2), (math.inf, 0.1), (math.nan, 0.1)
    ):  # fmt: skip
        refuse(w, H, error)
        assert w.h == pytest.approx(factor * H)
    assert w.rejected == 4


def moving(t, phase, clearance_mm=9, speed=1.0):
    """Both ends displaced, and their rates: in flight, or in contact where clearances are small."""
    p = record(Case.from_values({"joint": "both", "clearance_mm": clearance_mm, "load": "gas"}))
    z = np.zeros(8 + FLOWS)
    z[:4] = 1e-3, -2e-3, 5e-4, 1e-3
    z[4:8] = np.array([0.1, -0.2, 0.3, 0.5]) * speed
    work = new_work(8)
    derivative_with_flows(t, z, phase, p, work.k[0])
    return p, z, work


@pytest.mark.parametrize(
    ("rtol", "clearance_mm", "speed", "loose"),
    [(1e-3, 9, 1, 1e-6), (1e-7, 9, 1, 1e-6), (1e-3, 1, 0, 10), (1e-9, 1, 0, 10)],
)
def test_the_first_step_is_hairer_s(rtol, clearance_mm, speed, loose):
    """Solving Ordinary Differential Equations I, II.4, at order 5 with the norm over the motion."""
    t, phase, atol = 0.09, 3, np.repeat([1e-6, loose], 4)
    p, z, work = moving(t, phase, clearance_mm, speed)
    w = stepper(t=t, rtol=rtol)
    found = first_step(w, z, work, atol, phase, p, 1.0)
    assert w.evaluations == 1
    scale = atol + rtol * np.abs(z[:8])
    rates, after = work.k[0].copy(), np.empty(z.size)

    def norm(values):
        return np.sqrt(np.mean((values[:8] / scale) ** 2))

    guess = 0.01 * norm(z) / norm(rates)
    derivative_with_flows(t + guess, z + guess * rates, phase, p, after)
    change = norm(after - rates) / guess
    steepest = max(norm(rates), change)
    bold = (0.01 / steepest) ** (1 / 5)
    assert (bold < 100 * guess) == (loose >= 1)  # each of the two bounds it
    assert found == pytest.approx(min(100 * guess, bold), rel=1e-9)


def test_a_first_step_ends_before_the_corner_and_starts_from_rest():
    p, z, work = moving(0.09, 3)
    atol = np.full(8, 1e-6)
    assert first_step(stepper(t=0.09, rtol=1e-3), z, work, atol, 3, p, 0.09 + 1e-9) <= 1e-9 * 1.001
    z[:] = 0.0
    derivative_with_flows(0.09, z, 3, p, work.k[0])
    assert 0 < first_step(stepper(t=0.09, rtol=1e-3), z, work, atol, 3, p, 1.0) <= 1e-4


def linear_step(eigenvalue):
    """Work and start of an explicit step of z' = eigenvalue z in every number."""
    work, z = new_work(SIZE.size), np.ones(SIZE.size + FLOWS)
    for stage in range(STAGES):
        work.new[:] = z + H * A[stage] @ work.k
        work.k[stage] = eigenvalue * work.new
    return work, z


@pytest.mark.parametrize("eigenvalue", [-3e3, 40.0])
def test_an_explicit_step_tells_the_eigenvalue(eigenvalue):
    work, z = linear_step(eigenvalue)
    assert stiff_rate(stepper(), H, z, work, SIZE) == pytest.approx(abs(eigenvalue), rel=1e-9)


def stiff_work(eigenvalues):
    """Work of a stiff step whose Jacobian has these eigenvalues."""
    work = new_work(SIZE.size)
    basis = np.linalg.qr(np.random.default_rng(1).normal(size=(4, 4)))[0] * SIZE[:, None]
    work.jacobian[:4] = basis @ np.diag(eigenvalues) @ np.linalg.inv(basis)
    return work


def test_a_stiff_step_tells_the_largest_eigenvalue():
    work = stiff_work([-5e4, -30.0, -2.0, 1.0])
    found = stiff_rate(stepper(stiff=1), H, np.zeros(4 + FLOWS), work, SIZE)
    assert found == pytest.approx(5e4, rel=1e-3)


def explicit_steps(w, reach, limit=1000):
    """Steps at a reach (of the stability boundary) until the stiff partner takes over."""
    work, z = linear_step(-reach * STABILITY_LIMIT / H)
    for steps in range(1, limit):
        w.steps = steps
        choose_method(w, H, z, work, SIZE)
        if w.stiff:
            return steps
    return limit


def test_stability_that_holds_the_steps_calls_the_stiff_partner():
    looks = math.ceil(STEPS_BEFORE_STIFF / TEST_INTERVAL)
    assert explicit_steps(stepper(), 1.05 * LIMITED_REACH) == looks * TEST_INTERVAL
    assert explicit_steps(stepper(), 0.95 * LIMITED_REACH) == 1000
    assert explicit_steps(stepper(Mode.EXPLICIT), 1.05 * LIMITED_REACH) == 1000

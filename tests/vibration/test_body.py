"""Oscillators and the body on its foundation against closed forms."""

import numpy as np
import pytest

from compressor.cases.optional_groups import Body
from compressor.vibration.body import (
    Forces,
    body_motion,
    casing_motion,
    oscillate,
    point_acceleration,
)

FREQUENCY, DAMPING = 20.0, 0.03
OMEGA = 2 * np.pi * FREQUENCY
DAMPED = OMEGA * np.sqrt(1 - DAMPING**2)


def free(times, displacement, velocity):
    """The free motion from a displacement and a velocity."""
    swing = (velocity + DAMPING * OMEGA * displacement) / DAMPED * np.sin(DAMPED * times)
    return np.exp(-DAMPING * OMEGA * times) * (displacement * np.cos(DAMPED * times) + swing)


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_a_steady_sine():
    """A machine's 25 Hz over 1 kHz of casing, at the samples of a sensor."""
    times = np.linspace(0, 0.04, 4097)
    v = 2 * np.pi * 25.0
    for frequency in (20.0, 1000.0):
        omega = 2 * np.pi * frequency
        found = oscillate(np.cos(v * times), times[1], frequency, DAMPING, steady=True)
        gain = 1 / (omega**2 - v**2 + 2j * DAMPING * omega * v)
        whole = gain * np.exp(1j * v * times)
        close(found.displacement, whole.real)
        close(found.velocity, (1j * v * whole).real)
        close(found.acceleration, (-(v**2) * whole).real)


@pytest.mark.parametrize("step", [1e-6, 1e-3, 0.1, 3.0])
def test_a_cubic_is_exact_at_any_step(step):
    """The particular solution of a cubic force is a cubic; its free part is known."""
    times = step * np.arange(40)
    cubic = np.array([0.7, -0.2, 0.3, 1.1])  # of the displacement, in powers of t / (4 s)
    powers = (times[:, None] / 4.0) ** np.arange(4)
    shape = powers @ cubic
    slope = powers[:, :3] @ (cubic[1:] * [1, 2, 3]) / 4.0
    bend = powers[:, :2] @ (cubic[2:] * [2, 6]) / 16.0
    force = bend + 2 * DAMPING * OMEGA * slope + OMEGA**2 * shape
    found = oscillate(force, step, FREQUENCY, DAMPING)
    expected = shape + free(times, -shape[0], -slope[0])
    np.testing.assert_allclose(found.displacement, expected, atol=1e-9 * np.abs(shape).max())


# ---- the body

STEP, COUNT = 1e-4, 4001
TIMES = STEP * np.arange(COUNT)


def forces(x=0.0, y=0.0, moment=0.0, guide=0.0):
    """Forces that are constant, or given over time."""
    full = [np.broadcast_to(np.asarray(one, float), COUNT) for one in (x, y, moment, guide)]
    still = np.zeros(COUNT)
    return Forces(STEP, np.stack(full[:2], axis=1), full[2], np.stack([still, full[3]], axis=1),
                  np.stack([full[0], still], axis=1))  # fmt: skip


def stepped(height, frequency, damping):
    """The displacement under a force that comes at time 0 and stays."""
    omega = 2 * np.pi * frequency
    damped = omega * np.sqrt(1 - damping**2)
    swing = np.cos(damped * TIMES) + damping * omega / damped * np.sin(damped * TIMES)
    return height / omega**2 * (1 - np.exp(-damping * omega * TIMES) * swing)


def test_a_step_moves_each_freedom_by_its_closed_form():
    body = Body(freedoms="xy_rocking", frequency_y_Hz=12.0, frequency_rocking_Hz=7.0,
                centre_x_mm=0.0, centre_y_mm=0.0)  # fmt: skip
    found = body_motion(body, forces(1000.0, -500.0, 80.0), steady=False)
    for motion, height, frequency in (
        (found["x"], 2.0, 60.0), (found["y"], -1.0, 12.0), (found["rocking"], 2.0, 7.0)
    ):  # fmt: skip
        close(motion.displacement, stepped(height, frequency, 0.03))


def test_only_the_freedoms_that_are_named_move():
    found = body_motion(Body(freedoms="y"), forces(1000.0, 1000.0, 50.0), steady=False)
    assert not found["x"].displacement.any()
    assert found["y"].displacement.any()
    assert not found["rocking"].displacement.any()


def test_the_moment_is_taken_about_the_mass_centre():
    """A force through the mass centre does not rock the body."""
    body = Body(freedoms="xy_rocking", centre_x_mm=300.0, centre_y_mm=-200.0)
    x, y = 1000.0, -400.0
    through = 0.3 * y - (-0.2) * x  # its moment about the crank's centre
    found = body_motion(body, forces(x, y, through), steady=False)
    assert np.abs(found["rocking"].displacement).max() < 1e-15


def test_a_point_off_the_centre_moves_with_rocking():
    body = Body(freedoms="xy_rocking", centre_x_mm=0.0, centre_y_mm=0.0)
    found = body_motion(body, forces(moment=80.0), steady=False)
    turning = found["rocking"].acceleration
    np.testing.assert_allclose(point_acceleration(found, "y", (0.6, 0.2)), 0.6 * turning)
    np.testing.assert_allclose(point_acceleration(found, "x", (0.6, 0.2)), -0.2 * turning)


def test_a_casing_mode_answers_the_force_at_its_place():
    body = Body(casing_mass_kg=10.0, casing_frequency_Hz=50.0, casing_damping_ratio=0.02)
    given = forces(x=30.0, guide=20.0)
    omega = 2 * np.pi * 50.0
    rate = omega * np.sqrt(1 - 0.02**2)
    decay = np.exp(-0.02 * omega * TIMES)
    shape = decay * (np.cos(rate * TIMES) - 0.02 * omega / rate * np.sin(rate * TIMES))
    for force, height in ((given.guide[:, 1], 2.0), (given.bearing[:, 0], 3.0)):
        found = casing_motion(body, force, STEP).acceleration
        np.testing.assert_allclose(found, height * shape, atol=1e-9)

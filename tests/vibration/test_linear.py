"""Oscillators against closed forms: steps, sines and cubics are exact, at any step."""

import numpy as np
import pytest

from compressor.vibration.body import one_step, oscillate

STEP = 4e-5
FREQUENCY, DAMPING = 20.0, 0.03
OMEGA = 2 * np.pi * FREQUENCY
DAMPED = OMEGA * np.sqrt(1 - DAMPING**2)


def free(times, displacement, velocity):
    """The free motion from a displacement and a velocity."""
    swing = (velocity + DAMPING * OMEGA * displacement) / DAMPED * np.sin(DAMPED * times)
    return np.exp(-DAMPING * OMEGA * times) * (displacement * np.cos(DAMPED * times) + swing)


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_a_step_from_rest():
    times = STEP * np.arange(5001)
    found = oscillate(np.full(times.size, 3.0), STEP, FREQUENCY, DAMPING)
    still = 3.0 / OMEGA**2
    close(found.displacement, still + free(times, -still, 0.0))
    acceleration = 3.0 - 2 * DAMPING * OMEGA * found.velocity - OMEGA**2 * found.displacement
    close(found.acceleration, acceleration)


@pytest.mark.parametrize("frequency", [1.0, 8.3, 20.0, 45.0])
def test_a_sine_from_rest(frequency):
    """Response and free motion of q'' + 2 zeta w q' + w^2 q = sin(v t)."""
    times = STEP * np.arange(25001)
    v = 2 * np.pi * frequency
    found = oscillate(np.sin(v * times), STEP, FREQUENCY, DAMPING)
    gain = 1 / (OMEGA**2 - v**2 + 2j * DAMPING * OMEGA * v)
    forced = (gain * np.exp(1j * v * times)).imag
    close(found.displacement, forced + free(times, -gain.imag, -(1j * v * gain).imag))


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


def test_integrals_of_a_step_against_the_series():
    """Sum of j! h^(j+k+1) s^k / (j+k+1)!, which converges at once for a small s h."""
    from math import factorial

    root, step = complex(-3.0, 125.0), 1e-3
    whole, shares = one_step(root, step)
    assert abs(whole - np.exp(root * step)) < 1e-15
    for j, share in enumerate(shares):
        terms = [
            factorial(j) * step ** (j + k + 1) * root**k / factorial(j + k + 1) for k in range(20)
        ]
        assert abs(share - sum(terms)) < 1e-14 * abs(share)


def test_what_no_oscillator_takes():
    with pytest.raises(ValueError, match="between 0 and 1, not at 1"):
        oscillate(np.ones(9), STEP, FREQUENCY, 1.0)

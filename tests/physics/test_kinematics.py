"""Ideal motion against closed forms, finite differences and the paper's series."""

import math

import mpmath
import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics.kinematics import (
    MAX_SERIES_ANGLE,
    exact_motion,
    ideal,
    ideal_after,
    small_angle,
)
from compressor.solve.si_record import record

R, L, OMEGA = 0.12, 0.6, 500 * math.pi / 30


@pytest.mark.parametrize(
    ("degrees", "x", "a"), [(0, 0.72, -394.784), (180, 0.48, 263.189), (360, 0.72, -394.784)]
)
def test_dead_centres(degrees, x, a):
    found = exact_motion(math.radians(degrees), R, L, OMEGA)
    assert found[0] == pytest.approx(x, abs=1e-15)
    assert found[1] == pytest.approx(0.0, abs=1e-12)
    assert found[2] == pytest.approx(a, abs=5e-4)


def test_rates_are_derivatives():
    theta = np.linspace(0.1, 6.2, 50)
    h = 1e-5
    for order in (0, 1):
        ahead, behind = (exact_motion(theta + s * h, R, L, OMEGA)[order] for s in (1, -1))
        expected = exact_motion(theta, R, L, OMEGA)[order + 1]
        assert (ahead - behind) / (2 * h / OMEGA) == pytest.approx(expected, rel=1e-7, abs=1e-5)


def test_compiled_equals_array_form():
    p = record(Case())
    times = np.linspace(0, 0.48, 97)
    rows = np.array([ideal(t, p) for t in times])
    expected = np.transpose(exact_motion(p.omega * times, R, L, p.omega))
    assert rows[:, 6:] == pytest.approx(expected, rel=1e-13, abs=1e-11)
    assert rows[:, 2] == pytest.approx(R / L * np.sin(p.omega * times), abs=1e-15)
    assert rows[:, 2] ** 2 + rows[:, 3] ** 2 == pytest.approx(1.0, abs=1e-15)


def off(angle):
    """How far sine and cosine of a small angle are off, in their last digits; of 30 digits."""
    with mpmath.workdps(30):
        exact = mpmath.sin(mpmath.mpf(float(angle))), mpmath.cos(mpmath.mpf(float(angle)))
        pairs = zip(small_angle(angle), exact, strict=True)
        return [float((mpmath.mpf(found) - e) / np.spacing(abs(float(e)))) for found, e in pairs]


def test_sine_and_cosine_of_a_small_angle_are_exact_and_their_series_lack_no_term():
    """On both sides of the change from series to library, at MAX_SERIES_ANGLE.

    Just below it a lost term is missed most: by a bias of more than its last digit.
    """
    near = np.linspace(-1.05 * MAX_SERIES_ANGLE, 1.05 * MAX_SERIES_ANGLE, 401)
    for angle in np.concatenate((near, [1e-9, -2.0, 0.7])):
        assert np.abs(off(angle)).max() <= 1.0
    below = np.linspace(0.99 * MAX_SERIES_ANGLE, 0.999 * MAX_SERIES_ANGLE, 200)
    assert np.mean([off(angle) for angle in below], axis=0) == pytest.approx(0, abs=0.25)


def test_the_motion_a_span_later_is_that_of_the_later_time():
    p = record(Case())
    for t, span in ((0.0, 0.0), (0.013, 1e-5), (0.05, 1e-4), (0.11, 0.07)):
        base = (math.cos(p.omega * t), math.sin(p.omega * t))
        found, expected = np.array(ideal_after(base, span, p)), np.array(ideal(t + span, p))
        assert found == pytest.approx(expected, rel=1e-13, abs=1e-11)


def test_rod_spin_and_its_rate_are_derivatives():
    p = record(Case())
    h = 1e-6
    for t in np.linspace(0, 0.12, 13):
        early, now, late = (ideal(t + s, p) for s in (-h, 0.0, h))
        angle = [math.atan2(m.sin_phi, m.cos_phi) for m in (early, late)]
        assert (angle[1] - angle[0]) / (2 * h) == pytest.approx(now.rate, rel=1e-6, abs=1e-6)
        assert (late.rate - early.rate) / (2 * h) == pytest.approx(now.spin_up, rel=1e-6, abs=1e-4)

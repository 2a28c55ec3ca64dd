"""Peak and rms in segments of crank angle, against plain NumPy."""

import math

import numpy as np
import pytest

from compressor.vibration.segments import segment_levels


def test_levels_are_those_of_plain_numpy():
    rng = np.random.default_rng(2)
    angle, values = rng.uniform(-400, 1000, 20_000), rng.normal(size=20_000)
    peak, rms = segment_levels(angle, values)
    for k in range(36):
        inside = values[(angle % 360 >= 10 * k) & (angle % 360 < 10 * (k + 1))]
        assert peak[k] == np.abs(inside).max()
        assert rms[k] == pytest.approx(np.sqrt(np.mean(inside**2)), rel=1e-12)


def test_a_segment_without_samples_has_no_number():
    peak, rms = segment_levels(np.array([0.0, 90.0, 360.0 - 1e-12]), np.array([1.0, -2.0, 3.0]), 4)
    np.testing.assert_array_equal(peak, [3.0, 2.0, np.nan, np.nan])
    np.testing.assert_allclose(rms, [math.sqrt(5.0), 2.0, np.nan, np.nan])


def test_an_angle_at_a_begin_lies_in_the_segment_that_begins_there():
    turns = np.arange(72) * 10.0 / 360.0  # of which some are rounded down
    peak, _ = segment_levels(360.0 * turns, np.arange(72.0))
    np.testing.assert_array_equal(peak, np.arange(36.0) + 36.0)

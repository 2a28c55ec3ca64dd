"""How a journal moves in its bearing: against motions that are known, and the paper's runs."""

import numpy as np
import pytest

from compressor.analysis.orbit import turning_points


@pytest.mark.parametrize("turns", [1, 3])
def test_turns_of_a_known_force(turns):
    angle = np.arange(0, 360.0 * turns, 0.3)
    force = np.sin(np.radians(angle - 40.0))
    assert turning_points(angle, force) == pytest.approx((40.0, 220.0), abs=0.3)
    assert turning_points(angle, force + 2.0) == ()


def test_a_force_that_trembles_about_zero_turns_once():
    angle = np.arange(0, 720.0, 0.3)
    trembling = np.sin(np.radians(angle)) + 0.05 * np.sin(np.radians(40 * angle))
    assert turning_points(angle, trembling) == pytest.approx((0.0, 180.0), abs=2.0)


def test_turns_about_top_dead_centre_are_one():
    angle = np.arange(0, 1080.0, 0.3)
    at = turning_points(angle, np.sin(np.radians(angle + 0.5 * np.cos(np.radians(angle / 3)))))
    assert len(at) == 2

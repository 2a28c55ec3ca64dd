"""Hours of a clearance between the stages of a wear run."""

import math

import numpy as np

from compressor.analysis.wear import interpolate_hours


def test_a_clearance_is_reached_on_a_straight_line():
    hours, opened = np.array([0.0, 2.0, 3.0]), np.array([1.0, 2.0, 4.0])
    assert interpolate_hours(hours, opened, 3.0) == 2.5
    assert [interpolate_hours(hours, opened, one) for one in (0.5, 1.0, 2.0)] == [0.0, 0.0, 2.0]
    assert math.isinf(interpolate_hours(hours, opened, 4.5))

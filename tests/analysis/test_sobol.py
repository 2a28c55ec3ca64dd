"""The parts of a `saltelli` design, and indices of a plane, which are known."""

import numpy as np
import pytest

from compressor.analysis.effects import saltelli_design
from compressor.cases.swept import design


def test_the_indices_of_a_plane():
    """y = x1 + 2 x2 over the unit square: a fifth and four fifths, without interactions."""
    points = np.array(design("saltelli", 256, 3, 1))
    found = saltelli_design(points).indices(points[:, 0] + 2.0 * points[:, 1])
    for order in ("first_order", "total_order"):
        assert found[order] == pytest.approx([0.2, 0.8, 0.0], abs=0.02)
        assert (found[f"{order}_low"] <= [0.2, 0.8, 0.0]).all()
        assert (found[f"{order}_high"] >= [0.2, 0.8, 0.0]).all()


def test_only_a_design_is_one():
    points = np.array(design("saltelli", 8, 3, 1))
    assert saltelli_design(points[:, [2, 0, 1]]) is not None  # the order of columns is no matter
    assert saltelli_design(points[:-1]) is None
    assert saltelli_design(np.array(design("sobol", 40, 3, 1))) is None
    assert saltelli_design(points.astype(object)) is None


def test_the_first_points_of_a_design_are_one():
    points = np.array(design("saltelli", 64, 2, 1))
    part = saltelli_design(points).first(16)
    assert np.array_equal(points[part.mixed[1], 1], points[part.b, 1])
    assert part.indices(points[:, 0])["first_order"] == pytest.approx([1.0, 0.0], abs=0.05)

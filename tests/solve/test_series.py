"""Time series of two runs: where they are compared, and how far apart they are."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.metrics import NUMBERS, SERIES
from compressor.physics import COLUMNS, Column
from compressor.solve.series import (
    COMPARED_PER_REV,
    MAX_COMPARED,
    MIN_COMPARED,
    compared_per_rev,
    compared_times,
    distances,
)

BOTH = {"joint": "both", "clearance_mm": 0.2}


def case(**solve):
    return Case.from_values({**BOTH, "solve": {"duration_rev": 1, "settle_rev": 0.5, **solve}})


@pytest.mark.parametrize(
    ("duration", "settle", "count"),
    [
        (4, 1, 3 * COMPARED_PER_REV),
        (0.01, 0, MIN_COMPARED),
        (0.01, 0.005, MIN_COMPARED),
        (1000, 0, MAX_COMPARED),
        (2.5, 1, 1.5 * COMPARED_PER_REV),
    ],
)
def test_runs_are_compared_evenly_from_settling_to_the_end(duration, settle, count):
    of = case(duration_rev=duration, settle_rev=settle)
    times = compared_times(of)
    assert times.size == count
    step = (of.duration - of.settle) / count
    np.testing.assert_allclose(np.diff(times), step, rtol=1e-6)
    np.testing.assert_allclose(times[[0, -1]], [of.settle + step / 2, of.duration - step / 2])


def test_revolutions_are_compared_at_the_same_angles():
    of = case(duration_rev=3.7, settle_rev=0.6)
    angles = np.mod(compared_times(of)[: 3 * compared_per_rev(of)] / of.turn, 1.0).reshape(3, -1)
    np.testing.assert_allclose(angles[1:], angles[:1].repeat(2, axis=0), atol=1e-12)


def test_distances_are_relative_and_by_joint():
    ours, theirs = np.zeros((4, COLUMNS)), np.zeros((4, COLUMNS))
    ours[:, Column.ACCELERATION] = [3, 0, 4, 0]
    theirs[:, Column.ACCELERATION] = [3, 0, 4, 0.5]
    ours[:, Column.FORCE + 2] = [0, 2, 0, 0]  # of the small end, along x
    theirs[:, Column.FORCE + 2] = [0, 2, 0.3, 0]
    theirs[:, Column.FORCE + 3] = [0, 0.4, 0, 0]  # and y
    found = distances(ours, theirs)
    assert found.keys() == SERIES.keys()
    assert found["acceleration"] == pytest.approx(0.1)
    assert found["contact_force"].tolist() == pytest.approx([0.0, 0.25])
    assert found["velocity"] == 0.0
    for name, value in found.items():
        joint = (2,) if "joint" in NUMBERS[f"{name}_error"].dims else ()
        assert np.shape(value) == joint, name

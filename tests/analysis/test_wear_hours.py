"""What rubs in a run, and the hours of a clearance between the stages of a wear run."""

import math

import numpy as np
import pytest
from published import COEFFICIENT, rubbing

from compressor.analysis.wear import interpolate_hours, rubbing_work
from compressor.solve import simulate


@pytest.mark.parametrize(("joint", "more"), [
    ("big_end", {}), ("small_end", {}), ("big_end", {"drive": {"flywheel_kg_m2": 0.5}}),
    ("small_end", {"guide": {"clearance_mm": 0.1, "friction": 0}}), ("small_end", {"rod": True}),
])  # fmt: skip
def test_what_rubs_is_what_friction_takes_over_its_coefficient(joint, more):
    """By the ledger of the dense solution; also in time of its own, and with a pin that tilts."""
    run = simulate(rubbing(joint, **more))
    here = 0 if joint == "big_end" else 1
    found = rubbing_work(run)
    assert found[here] == pytest.approx(float(run["friction_loss"]) / COEFFICIENT, rel=3e-3)
    assert found[1 - here] == 0.0


def test_what_rubs_is_told_a_revolution():
    """Of settled ones alone: twice as many give the same."""
    solve = {"settle_rev": 2, "duration_rev": 3, "rtol": 1e-8, "error_bars": False}
    one, two = (
        rubbing_work(simulate(rubbing("big_end", solve=solve | {"duration_rev": n}, load="spring")))
        for n in (3, 4)
    )
    assert two[0] == pytest.approx(one[0], rel=1e-3)


def test_a_clearance_is_reached_on_a_straight_line():
    hours, opened = np.array([0.0, 2.0, 3.0]), np.array([1.0, 2.0, 4.0])
    assert interpolate_hours(hours, opened, 3.0) == 2.5
    assert [interpolate_hours(hours, opened, one) for one in (0.5, 1.0, 2.0)] == [0.0, 0.0, 2.0]
    assert math.isinf(interpolate_hours(hours, opened, 4.5))

"""Wear over hours: Archard's volume, convergence in step and sectors, and lives."""

import itertools
import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.studies.wear.stages import (
    Worn,
    first_stage,
    life,
    next_stage,
    stages_dataset,
    wear_bores,
)

VALUES = {"joint": "big_end", "clearance_mm": 0.2, "solve": {"accuracy": "draft"}}


def followed(wear, **values):
    """A machine, and its stages up to the last."""
    of = Worn(Case.from_values({**VALUES, **values, "wear": {"limit_mm": 0.26, **wear}}))
    stages = [first_stage(of)]
    while not of.over(stages[-1]):
        stages.append(next_stage(of, stages[-1]))
    return of, stages


@pytest.fixture(scope="module")
def machine():
    return followed({"step_mm": 0.01})


def test_a_volume_is_the_coefficient_times_what_has_slid(machine):
    """V = k N |v| t: by the motions midway, run again from where each began."""
    of, stages = machine
    found = stages_dataset(of, stages)
    k = 1e-8 * 1e-9  # m3/(N m)
    volume = 0.0
    for before, after in itertools.pairwise(stages):
        turns = (after["hours"] - before["hours"]) * 3600.0 / of.case.turn
        half = 0.5 * (after["hours"] - before["hours"]) * 3600.0 / before["turn"]
        depth = half * k * before["rubbing_work"] / of.sector_area[:, np.newaxis]
        midway = wear_bores(of.case, before["worn_depth"] + depth, before["end_state"])
        volume += k * midway.work.sum() * turns
    assert found["worn_volume"].values[-1, 0] == pytest.approx(volume, rel=1e-9)
    assert not found["worn_volume"].values[:, 1].any()
    assert not found["clearance"].values[:, 1].any()


def test_stages_grow_by_their_step_until_the_limit(machine):
    _, stages = machine
    deepest = [1e3 * stage["worn_depth"].max() for stage in stages]
    assert deepest[0] == 0.0
    assert np.diff(deepest) == pytest.approx(0.01, rel=0.2)
    assert deepest[-2] < 0.06 <= deepest[-1]
    assert (np.diff([stage["hours"] for stage in stages]) > 0).all()


def test_the_profile_is_smooth_and_lies_where_the_load_presses(machine):
    """Both lobes lie along the rod; from sector to sector the depth changes by little."""
    _, stages = machine
    worn = stages[-1]["worn_depth"][0]
    angles = 2 * math.pi / worn.size * np.arange(worn.size)
    assert math.cos(angles[worn.argmax()]) > 0.9
    second = np.where(np.cos(angles) < 0, worn, 0.0)
    assert math.cos(angles[second.argmax()]) < -0.9
    assert worn[np.abs(np.cos(angles)) < 0.1].max() < 0.1 * worn.max()
    curvature = np.abs(worn - 0.5 * (np.roll(worn, 1) + np.roll(worn, -1)))
    assert curvature.max() < 0.06 * worn.max()


def test_a_coefficient_is_a_scale_of_hours(machine):
    """The same profiles, a tenth of the hours: what the interval of a life rests on."""
    of, stages = machine
    tenfold, faster = followed({"step_mm": 0.01, "coefficient_mm3_per_N_m": 1e-7})
    one, other = (life(*pair) for pair in (
        (of, stages_dataset(of, stages)), (tenfold, stages_dataset(tenfold, faster))))  # fmt: skip
    assert other.hours == pytest.approx(one.hours / 10, rel=1e-5)
    assert (one.low, one.high) == pytest.approx((one.hours / 2, one.hours * 2))
    assert one.joint == "big_end"


def test_a_life_beyond_the_hours_is_not_told(machine):
    """Where even the greatest coefficient does not wear a joint out, no hours are named."""
    of, stages = followed({"hours": 1.0})
    found = life(of, stages_dataset(of, stages))
    assert [math.isnan(v) for v in (found.low, found.hours, found.high)] == [True] * 3
    assert stages[-1]["hours"] == 2.0  # of the given coefficient: as the greatest wears in one
    assert found.clearance > 0.2e-3
    whole = life(machine[0], stages_dataset(*machine))
    of, stages = followed({"step_mm": 0.01, "hours": 0.75 * whole.hours})
    found = life(of, stages_dataset(of, stages))
    assert found.low == pytest.approx(whole.low, rel=1e-3)
    assert math.isnan(found.hours)
    assert math.isnan(found.high)


def test_a_motion_that_fails_ends_its_machine():
    _, stages = followed({}, solve={"accuracy": "draft", "max_steps": 300})
    assert len(stages) == 1
    assert stages[0]["reason"] == "budget_steps"
    assert "300 steps" in stages[0]["detail"]


def test_a_speed_that_gives_way_takes_longer_for_a_revolution():
    soft = {"drive": {"slope_N_m_s": 10.0, "flywheel_kg_m2": 5.0}, "load": "gas"}
    case = Case.from_values({**VALUES, **soft, "wear": True})
    found = wear_bores(case, np.zeros((2, 72)), None)
    assert not found.reason
    assert found.turn > 1.001 * case.turn

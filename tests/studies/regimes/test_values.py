"""One value of a chain: what it settles to, and where it begins."""

import math
from dataclasses import replace

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.solve.run import run_at_tolerance
from compressor.solve.simulate import simulate
from compressor.studies.regimes.group import Regimes
from compressor.studies.regimes.revolutions import (
    RevolutionSpan,
    bare_case,
    follow_revolutions,
    settle_motion,
)
from compressor.studies.regimes.values import NUMBERS, TEXTS, empty, run_value

ASKED = Regimes("clearance_mm", 0.1, 0.3, 2, settle_rev=12, measure_rev=12, exponent=False)
DRAFT = {"accuracy": "draft"}


def case(clearance=0.2, **more):
    return Case.from_values({"joint": "big_end", "clearance_mm": clearance, "solve": DRAFT} | more)


@pytest.fixture(scope="module")
def row():
    return run_value(case(), None, ASKED)


def test_the_paper_s_machine_repeats_itself_once_a_revolution(row):
    assert (row["status"], row["reason"], row["regime"]) == ("ok", "", "periodic")
    assert (row["period"], row["revolutions"], row["settled_rev"]) == (1, 6, 1)
    assert np.isfinite(row["section"][0, 0]).all()
    assert np.isnan(row["section"][1:]).all()
    assert row["mode_share"][0].tolist() == [0, 0, 1]
    assert np.isnan(row["mode_share"][1]).all()
    assert row["impacts_per_revolution"][0] == 0
    assert math.isnan(row["peak_approach_speed"][0])


def test_its_numbers_are_those_of_a_run_that_has_settled(row):
    run = simulate(case(solve={"settle_rev": 2, "duration_rev": 4}))
    for name in ("peak_acceleration", "rms_acceleration", "peak_contact_force"):
        np.testing.assert_allclose(row[name], run[name].values, rtol=0.02)
    place = run["eccentricity"].sel(joint="big_end").values[[1200, 2400]]
    np.testing.assert_allclose(row["section"][[0, 0], 0, :2], place, atol=2e-6)


def test_a_value_begins_at_the_state_that_it_is_given(row):
    """Its first revolution is a direct run from the end of the last value, and so are the others.

    Measured are six revolutions of a period of one, from where the metrics agree.
    """
    after, state, section = case(0.25), row["end_state"], RevolutionSpan(12, 0.0, 60.0)
    found = run_value(after, state, ASKED)
    settled, since = settle_motion(after, state, section)
    first = follow_revolutions(after, state, RevolutionSpan(1, 0.0, 60.0))
    run = run_at_tolerance(bare_case(after, 1), after.rtol, 60.0, False, None, state)
    np.testing.assert_array_equal(run.trajectory.states[0], state)
    np.testing.assert_allclose(first.state, run.trajectory.states[-1], rtol=1e-9)
    np.testing.assert_allclose(settled.points[0], first.points[0], rtol=1e-9)
    assert found["settled_rev"] == since == 1
    rest = follow_revolutions(after, settled.state, RevolutionSpan(6, 0.0, 60.0))
    np.testing.assert_allclose(found["end_state"], rest.state, rtol=1e-9)
    np.testing.assert_allclose(found["section"][0, 0], rest.points[-1, 0], rtol=1e-9)
    assert np.isnan(found["section"][0, 1]).all()  # the small end is ideal


def test_a_lively_motion_has_impacts_and_no_period():
    lively = case(0.3, contact={"damping_N_s_per_mm": 0.336})
    row = run_value(lively, None, replace(ASKED, exponent=True))
    assert (row["status"], row["revolutions"]) == ("ok", 12)
    assert math.isnan(row["period"])
    assert math.isnan(row["settled_rev"])
    assert row["regime"] == "chaotic"
    assert 10.0 < row["lyapunov_exponent"] - row["lyapunov_exponent_error"] < 30.0
    assert np.isfinite(row["section"][:, 0]).all()
    assert row["impacts_per_revolution"][0] > 5
    assert 0 < row["mean_approach_speed"][0] < row["peak_approach_speed"][0]
    assert row["mode_share"][0].sum() == pytest.approx(1)
    share = row["contact_loss_fraction"][0]
    assert 0.1 < share < row["mode_share"][0, 0] + 0.3
    assert 0 < row["rms_acceleration_standard_error"] < row["rms_acceleration"]


def test_a_motion_that_takes_two_revolutions_has_two_points():
    """With a seventieth of the paper's damping and 0.0776 mm (standard accuracy)."""
    values = {"joint": "big_end", "clearance_mm": 0.0776, "contact": {"damping_N_s_per_mm": 5}}
    row = run_value(Case.from_values(values), None, replace(ASKED, settle_rev=40))
    assert (row["regime"], row["period"], row["revolutions"]) == ("periodic", 2, 8)
    points = row["section"][:3, 0, :2]
    assert np.linalg.norm(points[1] - points[0]) > 0.01 * 0.0776e-3
    assert np.isnan(points[2]).all()


def test_the_same_value_has_the_same_bits(row):
    again = run_value(case(), None, ASKED)
    for name in (*TEXTS, *NUMBERS):
        np.testing.assert_array_equal(again[name], row[name])


def test_a_run_that_stops_is_a_row_with_the_state_that_it_began_from(row):
    short = case(solve=DRAFT | {"max_steps": 50})
    found = run_value(short, row["end_state"], ASKED)
    assert (found["status"], found["reason"]) == ("failed", "budget_steps")
    np.testing.assert_array_equal(found["end_state"], row["end_state"])
    assert np.isnan(run_value(short, None, ASKED)["end_state"]).all()
    assert math.isnan(found["peak_acceleration"])


def test_a_row_has_all_that_is_named():
    found = empty(ASKED, case())
    assert {*found} == {*TEXTS, *NUMBERS}
    assert found["section"].shape == (12, 2, 4)
    assert found["end_state"].shape == (4,)

"""Revolutions of a motion: runs join without a seam, and their points lie on the section."""

import math

import numpy as np
import pytest
from conftest import CHAOTIC

from compressor.cases.case import Case
from compressor.metrics import METRICS
from compressor.physics import Column
from compressor.solve.run import run_at_tolerance
from compressor.solve.series import rows_of
from compressor.solve.si_record import record
from compressor.studies.regimes.revolutions import (
    RevolutionSpan,
    bare_case,
    eccentricities,
    follow_revolutions,
    run_with_series,
    settle_motion,
)

DRAFT = {"solve": {"accuracy": "draft"}}
BIG_END = Case.from_values({"joint": "big_end", "clearance_mm": 0.2, **DRAFT})


def span(revolutions, section=0.0):
    return RevolutionSpan(revolutions, section, 60.0)


@pytest.mark.parametrize("section", [0.0, 1.0])
def test_revolutions_from_a_state_are_a_run_from_it(section):
    first = follow_revolutions(BIG_END, None, span(2, section))
    again = follow_revolutions(BIG_END, first.state, span(1, section))
    run = run_at_tolerance(bare_case(BIG_END, 1), BIG_END.rtol, 60.0, False, None, first.state)
    np.testing.assert_array_equal(run.trajectory.states[0], first.state)
    apart = np.abs(again.state - run.trajectory.states[-1]) / np.abs(again.state)
    assert apart.max() < (1e-12 if section == 0.0 else 1e-3)


def test_runs_join_without_a_seam():
    """A run of three revolutions is one of two and one, but for its steps' own errors."""
    whole = follow_revolutions(BIG_END, None, span(3, 2.0))
    first = follow_revolutions(BIG_END, None, span(2, 2.0))
    second = follow_revolutions(BIG_END, first.state, span(1, 2.0))
    np.testing.assert_allclose(second.points[0], whole.points[2], rtol=1e-3, atol=1e-8)
    np.testing.assert_array_equal(first.points, whole.points[:2])
    for name, row in METRICS.items():
        if row.bar.relative:
            np.testing.assert_allclose(second.numbers(1)[name], whole.numbers(1)[name], rtol=1e-3)


def test_points_are_the_eccentricities_at_the_section():
    section = math.radians(90)
    found = follow_revolutions(BIG_END, None, span(2, section))
    of = bare_case(BIG_END, 2)
    run = run_at_tolerance(of, BIG_END.rtol, 60.0, True)
    rows = rows_of(run.p, run.trajectory)
    at = [300, 1500]  # samples at 90 and 450 degrees
    place = rows[at, Column.ECCENTRICITY : Column.ECCENTRICITY + 4].reshape(2, 2, 2)
    np.testing.assert_allclose(found.points[:, :, :2], place, atol=1e-7)
    around = [rows[[k - 1, k + 1], Column.ECCENTRICITY : Column.ECCENTRICITY + 2] for k in at]
    rates = [(b - a) / (2 * 0.3 / 360 * of.turn) for a, b in around]
    np.testing.assert_allclose(found.points[:, 0, 2:], rates, atol=1e-3)
    assert (found.points[:, 1] == 0).all()


def test_a_start_has_journals_at_rest_in_their_bores():
    offset = {"big_end_x": 0.05, "big_end_y": -0.02, "small_end_x": 0.03, "small_end_y": 0.01}
    case = Case.from_values({"joint": "both", "clearance_mm": 0.2, "initial_offset_mm": offset})
    state = run_at_tolerance(bare_case(case, 1), case.rtol, 60.0, False).trajectory.states[0]
    found = eccentricities(record(case), state)
    assert found == pytest.approx(np.array([[5e-5, -2e-5, 0, 0], [3e-5, 1e-5, 0, 0]]), rel=1e-12)


def test_a_run_ends_once_enough_is_known():
    found = follow_revolutions(BIG_END, None, span(9, 1.0), lambda turns, points: len(points) == 2)
    assert (len(found.turns), len(found.points), found.reason) == (2, 2, "")
    assert found.turns[-1]["seconds"] == pytest.approx(BIG_END.turn, rel=1e-9)


def test_settling_is_told_with_the_revolution_from_which_on():
    found, since = settle_motion(BIG_END, None, span(20))
    assert since == 1 < len(found.turns) < 6
    later, at_once = settle_motion(BIG_END, found.state, span(20))
    assert at_once == 0
    assert len(later.turns) == 3
    chaotic = Case.from_values({**CHAOTIC, **DRAFT})
    lost, never = settle_motion(chaotic, None, span(6))
    assert (len(lost.turns), math.isnan(never)) == (6, True)


def test_a_run_with_series_is_measured_from_its_second_revolution_on():
    table, reason, _ = run_with_series(
        BIG_END, follow_revolutions(BIG_END, None, span(1)).state, span(2)
    )
    assert not reason
    assert table.attrs["settle"] == pytest.approx(BIG_END.turn)
    assert table.variables["time"].values.size == 2401


def test_a_run_that_fails_has_the_revolutions_before():
    values = {"joint": "big_end", "clearance_mm": 0.2}
    short = Case.from_values({**values, "solve": {"max_steps": 1200, "accuracy": "draft"}})
    found = follow_revolutions(short, None, span(50, 1.0))
    assert found.reason == "budget_steps"
    assert 0 < len(found.turns) == len(found.points) < 50
    assert np.isfinite(found.state).all()

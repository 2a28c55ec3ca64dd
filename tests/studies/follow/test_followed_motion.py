"""Followed motions: their periods, what makes two of them different, and one value of a chain."""

import math
import time

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics import Column, merge_tallies
from compressor.solve import metrics, record, run_at_tolerance, simulate
from compressor.solve.series import rows_of
from compressor.studies.follow import motion

RNG = np.random.default_rng(4)


def cycle(period, count, noise=0.0):
    """Places of a motion that repeats itself after `period` revolutions."""
    of = RNG.uniform(-1, 1, (period, 2, 2))
    return of[np.arange(count) % period] + noise * RNG.uniform(-1, 1, (count, 2, 2))


@pytest.mark.parametrize("period", range(1, motion.MAX_PERIOD + 1))
def test_a_period_is_found_once_two_of_it_and_four_revolutions_are_there(period):
    found = cycle(period, 2 * period + motion.MORE, 0.1 * motion.TOLERANCE)
    assert motion.period_of(found, motion.TOLERANCE) == period
    assert motion.period_of(found[1:], motion.TOLERANCE) is None


@pytest.mark.parametrize(
    ("r", "period"), [(2.9, 1), (3.2, 2), (3.5, 4), (3.55, 8), (3.83, 3), (3.565, 16), (4.0, None)]
)
def test_the_logistic_map_has_the_periods_that_it_is_known_for(r, period):
    """As the x of a joint, after a long transient."""
    x, found = 0.3, []
    for _ in range(5064):
        x = r * x * (1 - x)
        found.append(x)
    places = np.zeros((64, 2, 2))
    places[:, 0, 0] = found[-64:]
    assert motion.period_of(places, motion.TOLERANCE) == period


def test_a_slow_drift_is_no_period():
    """Neighbours agree, but not the first and the last."""
    drift = np.zeros((20, 2, 2))
    drift[:, 0, 0] = 0.5 * motion.TOLERANCE * np.arange(20)
    assert motion.period_of(drift, motion.TOLERANCE) is None
    assert motion.period_of(0.1 * drift, motion.TOLERANCE) == 1


def test_the_distance_of_sets_is_hausdorff_s():
    one = cycle(4, 4)
    assert motion.hausdorff_distance(one, np.roll(one, 1, axis=0)) == 0
    more = np.concatenate((one, np.add(one[:1], [[0.3, 0.4], [0, 0]])))
    assert 0 < motion.hausdorff_distance(one, more) <= 0.5 + 1e-12
    assert motion.hausdorff_distance(one, more) == motion.hausdorff_distance(more, one)
    assert motion.hausdorff_distance(np.zeros((1, 2, 2)), np.full((1, 2, 2), [[3, 4], [0, 0]])) == 5


# ---- what makes two motions different ones


CASE = Case.from_values({"joint": "both", "clearance_mm": 0.2})


def row_of(regime, period=math.nan, places=(), rms=200.0, error=0.0):
    """A row of a motion with these places of the big end, in clearances."""
    found = motion.empty_row(CASE, 64) | {"status": "ok", "regime": regime}
    clearance = record(CASE)["clearance"][0]
    found["section"][: len(places)] = 0.0
    found["section"][: len(places), 0, :2] = clearance * np.reshape(places, (-1, 2))
    known = {"rms_acceleration": rms, "rms_acceleration_standard_error": error, "period": period}
    return found | {name: np.asarray(value) for name, value in known.items()}


def periodic(period=1, at=0.0, step=0.1):
    return row_of("periodic", float(period), [(at + step * k, 0.0) for k in range(period)])


def chaotic(rms=200.0, error=1.0):
    return row_of("chaotic", rms=rms, error=error)


UNKNOWN = motion.empty_row(CASE, 64) | {"status": "failed"}
UNDECIDED = row_of("undecided")
TWO = periodic(2)
TURNED = TWO | {"section": np.concatenate((TWO["section"][1::-1], TWO["section"][2:]))}


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (periodic(), periodic(), False),
        (periodic(), periodic(at=0.9 * motion.APART_TOLERANCES * motion.TOLERANCE), False),
        (periodic(), periodic(at=1.1 * motion.APART_TOLERANCES * motion.TOLERANCE), True),
        (TWO, periodic(1), True),
        (TWO, periodic(2), False),
        (periodic(2, step=motion.TOLERANCE), periodic(), False),
        (TWO, TURNED, False),
        (periodic(), chaotic(), True),
        (chaotic(), chaotic(), False),
        (chaotic(200, 1), chaotic(204, 1), False),
        (chaotic(200, 1), chaotic(205, 1), True),
        (chaotic(), UNDECIDED, False),
        (periodic(), UNDECIDED, False),
        (UNKNOWN, periodic(), False),
        (UNKNOWN, UNKNOWN, False),
    ],
)
def test_what_makes_two_motions_different(one, other, expected):
    assert motion.differ(CASE, one, other) is expected
    assert motion.differ(CASE, other, one) is expected


# ---- one value of a chain


HOW = {"most": 12, "wants_exponent": False}
DRAFT = {"accuracy": "draft"}


def case(clearance=0.2, **more):
    return Case.from_values({"joint": "big_end", "clearance_mm": clearance, "solve": DRAFT} | more)


BIG_END = case()


def soon():
    return time.monotonic() + 60.0


@pytest.fixture(autouse=True)
def settle_soon(monkeypatch):
    monkeypatch.setattr(motion, "SETTLE_REV", 12)


@pytest.fixture(scope="module")
def row():
    return motion.run_value(BIG_END, None, **HOW)


def test_runs_join_without_a_seam():
    """A run of three revolutions is one of two and one, but for its steps' own errors."""
    whole = motion.follow_revolutions(BIG_END, None, 3, soon())
    first = motion.follow_revolutions(BIG_END, None, 2, soon())
    second = motion.follow_revolutions(BIG_END, first.state, 1, soon())
    np.testing.assert_allclose(second.points[0], whole.points[2], rtol=1e-3, atol=1e-8)
    np.testing.assert_allclose(first.points, whole.points[:2], rtol=1e-12)
    one, other = (metrics(run.p, run.turns[-1])["rms_acceleration"] for run in (second, whole))
    np.testing.assert_allclose(one, other, rtol=1e-3)


def test_points_are_the_eccentricities_at_top_dead_centre():
    found = motion.follow_revolutions(BIG_END, None, 2, soon())
    of = motion.bare_case(BIG_END, 2)
    run = run_at_tolerance(of, BIG_END.rtol, 60.0, True)
    rows = rows_of(run.p, run.trajectory)
    at = [1200, 2400]  # samples at 360 and 720 degrees
    place = rows[at, Column.ECCENTRICITY : Column.ECCENTRICITY + 4].reshape(2, 2, 2)
    np.testing.assert_allclose(found.points[:, :, :2], place, atol=1e-7)
    around = rows[[1199, 1201], Column.ECCENTRICITY : Column.ECCENTRICITY + 2]
    rate = np.subtract(*around[::-1]) / (2 * 0.3 / 360 * of.turn)
    # across dead centre, where a segment of the load begins
    np.testing.assert_allclose(found.points[0, 0, 2:], rate, atol=2e-3)
    assert (found.points[:, 1] == 0).all()


def test_a_start_has_journals_at_rest_in_their_bores():
    offset = {"big_end_x": 0.05, "big_end_y": -0.02, "small_end_x": 0.03, "small_end_y": 0.01}
    both = Case.from_values({"joint": "both", "clearance_mm": 0.2, "initial_offset_mm": offset})
    states = run_at_tolerance(motion.bare_case(both, 1), both.rtol, 60.0, False).trajectory.states
    found = motion.poincare_points(record(both), [*states[:1]])
    assert found == pytest.approx(np.array([[[5e-5, -2e-5, 0, 0], [3e-5, 1e-5, 0, 0]]]), rel=1e-12)


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
    after, state = case(0.25), row["end_state"]
    found = motion.run_value(after, state, **HOW)
    settled, since = motion.settle_motion(after, state, soon())
    first = motion.follow_revolutions(after, state, 1, soon())
    run = run_at_tolerance(motion.bare_case(after, 1), after.rtol, 60.0, False, state)
    np.testing.assert_array_equal(run.trajectory.states[0], state)
    np.testing.assert_allclose(first.state, run.trajectory.states[-1], rtol=1e-9)
    np.testing.assert_allclose(settled.points[0], first.points[0], rtol=1e-9)
    assert found["settled_rev"] == since == 1
    rest = motion.follow_revolutions(after, settled.state, 6, soon())
    together = metrics(rest.p, merge_tallies(rest.turns))
    np.testing.assert_allclose(found["rms_acceleration"], together["rms_acceleration"], rtol=1e-9)
    np.testing.assert_allclose(found["end_state"], rest.state, rtol=1e-9)
    np.testing.assert_allclose(found["section"][0, 0], rest.points[-1, 0], rtol=1e-9)
    assert np.isnan(found["section"][0, 1]).all()  # the small end is ideal


def test_a_settling_run_that_is_made_again_counts_its_own_revolutions(monkeypatch, row):
    """With those of the run whose energy did not balance it ended after one, settled nowhere."""
    residuals = iter([1.0])
    monkeypatch.setattr("compressor.solve.energy_residual", lambda tally: next(residuals, 0.0))
    settled, since = motion.settle_motion(BIG_END, row["end_state"], soon())
    assert (len(settled.turns), since) == (3, 0)


def test_a_motion_that_takes_two_revolutions_has_two_points(monkeypatch):
    """With a seventieth of the paper's damping and 0.0776 mm (standard accuracy)."""
    monkeypatch.setattr(motion, "SETTLE_REV", 40)
    values = {"joint": "big_end", "clearance_mm": 0.0776, "contact": {"damping_N_s_per_mm": 5}}
    row = motion.run_value(Case.from_values(values), None, **HOW)
    assert (row["regime"], row["period"], row["revolutions"]) == ("periodic", 2, 8)
    points = row["section"][:3, 0, :2]
    assert np.linalg.norm(points[1] - points[0]) > 0.01 * 0.0776e-3
    assert np.isnan(points[2]).all()


def test_a_run_that_stops_is_a_row_with_the_state_that_it_began_from(row):
    short = case(solve=DRAFT | {"max_steps": 50})
    found = motion.run_value(short, row["end_state"], **HOW)
    assert (found["status"], found["reason"]) == ("failed", "budget_steps")
    np.testing.assert_array_equal(found["end_state"], row["end_state"])
    assert np.isnan(motion.run_value(short, None, **HOW)["end_state"]).all()
    assert math.isnan(found["peak_acceleration"])

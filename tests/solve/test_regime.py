"""Regimes: found without being asked, within a budget, and never where a promise is kept."""

import itertools
import math
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import CHAOTIC

from compressor.cases.case import Case
from compressor.metrics import METRICS, SERIES
from compressor.outcome import Regime
from compressor.physics import COLUMNS, Column
from compressor.solve import search as search_module
from compressor.solve.search import (
    LOOK_RTOL,
    LOOK_SHIFT,
    PARTED_DISTANCE,
    SHIFT,
    SURE_FACTOR,
    Parting,
    Search,
    predictability_horizon,
    repeats,
)
from compressor.solve.series import compared_per_rev, compared_times
from compressor.solve.simulate import measure, observe, simulate

PAPER = {"joint": "big_end", "clearance_mm": 0.2}
NO_ERRORS = dict.fromkeys(SERIES, 0.0)


def case(values=PAPER, **solve):
    return Case.from_values({**values, "solve": solve, "output": {"keep": "metrics"}})


AVERAGED = {"accuracy": {"rms_acceleration": 0.4}}


@pytest.fixture(scope="module")
def heard():
    """Numbers and time series of a chaotic run that is to average, with a sensor beside it."""
    body = {"frequency_x_Hz": 4.0, "frequency_y_Hz": 30.0}
    sensor = {"threshold_m_per_s2": 50.0}
    more = {"body": body, "sensor": sensor, "solve": {**AVERAGED, "duration_rev": 11}}
    return observe(Case.from_values(CHAOTIC | more))


@pytest.fixture(scope="module")
def chaotic(heard):
    return heard[0]


def test_chaos_is_found_without_being_asked(chaotic):
    assert (chaotic.status, chaotic.attributes["regime"]) == ("ok", "chaotic")
    parted = chaotic.numbers["predictability_horizon"]
    alone = predictability_horizon(case(CHAOTIC), shift=LOOK_SHIFT)
    assert parted == pytest.approx(alone, rel=0.05)
    assert chaotic.numbers["revolutions"] == 10
    assert chaotic.numbers["revolutions_to_one_percent"] > 10
    short = measure(case(CHAOTIC, duration_rev=2)).attributes
    assert (short["regime"], short["promise"]) == ("chaotic", "none")


def test_single_peaks_of_chaos_have_no_digits_and_averages_do(chaotic):
    for name, row in METRICS.items():
        value, bar = chaotic.numbers[name], chaotic.numbers[f"{name}_error"]
        if row.kind == "greatest":
            assert np.isinf(bar[value != 0]).all(), name
        else:
            assert np.isfinite(bar).all(), name
    assert 0 < chaotic.numbers["rms_acceleration_error"] < chaotic.numbers["rms_acceleration"]
    assert np.isinf(chaotic.numbers["acceleration_error"])
    low, high = chaotic.numbers["peak_acceleration_quantile"]
    assert low < high <= chaotic.numbers["peak_acceleration"]


def test_a_sensor_s_averages_have_intervals_and_its_peaks_none(heard):
    """Batch means over the ten revolutions, by Student's t of 9 degrees, 97.5 %."""
    numbers, series = heard[0].numbers, heard[1]
    for name in ("sensor_peak", "sensor_crest_factor", "sensor_kurtosis", "sensor_segment_peak"):
        assert np.isinf(numbers[f"{name}_error"]).all()
    per_turn = series["sensor_acceleration"][1].reshape(10, -1)
    square = np.mean(per_turn**2, axis=1)
    error = 2.262157 * square.std(ddof=1) / math.sqrt(10)
    assert numbers["sensor_rms_error"] == pytest.approx(error / (2 * numbers["sensor_rms"]), 1e-3)
    bar = numbers["sensor_counts_per_rev_error"][0]
    assert 0 < bar < 0.5 * numbers["sensor_counts_per_rev"][0]


def test_averages_of_chaos_are_those_of_an_implicit_method():
    """Beyond the horizon the two solutions have nothing else in common."""
    values = {"joint": "both", "clearance_mm": 0.2, "contact": {"damping_N_s_per_mm": 0.336}}
    long = {"duration_rev": 16, "settle_rev": 4, "output_step_deg": 3.6}
    ours = measure(case(values, **long))
    other = measure(case(values, **long, method="RODAS", rtol=1e-5, error_bars=False))
    assert ours.attributes["regime"] == "chaotic"
    rms, error = (ours.numbers[f"rms_acceleration{of}"] for of in ("", "_standard_error"))
    scatter = math.sqrt(2.0) * error  # of both runs
    assert abs(rms - other.numbers["rms_acceleration"]) < 4.0 * scatter
    assert 0.0 < error < 0.1 * rms


def test_accuracy_by_number_is_kept_by_averages_of_chaos_alone(chaotic):
    """Of a single peak no number can be promised; of an average, what its bar allows."""
    assert (chaotic.status, chaotic.attributes["promise"]) == ("ok", "none")
    for unmet in ({"rms_acceleration": 1e-4}, {"peak_acceleration": 0.4}):
        found = measure(case(CHAOTIC, accuracy=unmet, duration_rev=1.5))
        assert (found.status, found.reason) == ("failed", "accuracy_not_reached"), unmet
        assert "chaotic" in found.detail


@pytest.mark.parametrize("joint", ["none", "big_end", "small_end", "both"])
def test_the_paper_s_cases_are_periodic_and_not_searched(joint, monkeypatch):
    monkeypatch.setattr(Search, "parts", None)
    values = {"joint": joint} | ({} if joint == "none" else {"clearance_mm": 0.2})
    found = measure(case(values, duration_rev=8))
    assert (found.attributes["promise"], found.attributes["regime"]) == ("kept", "periodic")
    assert found.numbers["period_rev"] == 1
    assert 1 <= found.numbers["settled_rev"] <= 3
    assert math.isnan(found.numbers["predictability_horizon"])
    assert math.isnan(found.numbers["revolutions"])


def test_a_run_without_errors_has_no_regime_unless_its_horizon_is_asked_for():
    assert measure(case(CHAOTIC, error_bars=False, duration_rev=2)).attributes["regime"] == ""
    asked = measure(case(CHAOTIC, error_bars=False, horizon=True, duration_rev=2))
    assert asked.attributes["regime"] == "chaotic"
    assert math.isnan(asked.numbers["revolutions"])
    assert math.isnan(asked.numbers["rms_acceleration_error"])


def test_a_tolerance_promises_nothing_and_is_searched_by_its_bars():
    found = measure(case(CHAOTIC, rtol=1e-6, duration_rev=2))
    assert (found.status, found.attributes["regime"]) == ("ok", "chaotic")
    found = measure(case(rtol=1e-6))
    assert found.attributes["regime"] == "periodic"


def test_motions_that_part_at_a_loose_tolerance_alone_are_no_chaos(monkeypatch):
    """Nor is it known that they never part."""
    of, asked = case(), []
    ends = iter([Parting(0.1 * of.turn, True, False), Parting(of.duration, False, True)])

    def compare(of, end, rtol, shift, timeout):
        asked.append((end / of.turn, rtol))
        return next(ends)._replace(evaluations=1000)

    monkeypatch.setattr(search_module, "compare_shifted", compare)
    search = Search(of)
    search.count(SimpleNamespace(evaluations=600_000, steps=100_000, rejected=0))
    assert not search.parts(whole=True)
    assert math.isnan(search.horizon)
    assert not search.stopped
    assert asked == [
        (4.0, LOOK_RTOL),
        (pytest.approx(0.15), pytest.approx(LOOK_RTOL / SURE_FACTOR)),
    ]


def test_a_case_that_needs_more_than_its_budget_is_refused_in_these_words(monkeypatch):
    """However fast the clock runs: the budget counts evaluations."""
    monkeypatch.setattr(search_module, "MIN_WORK", 0)
    monkeypatch.setattr(search_module, "WORK", 4.0)
    machine = {"rod_mass_kg": 6.276, "reciprocating_mass_kg": 11.54, "speed_rpm": 190.1}
    values = {"joint": "big_end", "clearance_mm": 0.06779, "machine": machine}  # ill-conditioned
    found = measure(case(values, accuracy="fine"))
    assert (found.status, found.reason) == ("failed", "accuracy_not_reached")
    assert "evaluations in all, the budget of a job's runs; solve.rtol sets" in found.detail
    assert found.numbers["acceleration_error"] > 1e-4
    slow, clock = itertools.count(), time.monotonic
    monkeypatch.setattr(time, "monotonic", lambda: clock() + 0.1 * next(slow))
    again = measure(case(values, accuracy="fine"))
    assert again.detail == found.detail
    assert again.attributes["regime"] == found.attributes["regime"]


def test_what_cannot_be_told_in_the_time_is_undecided(monkeypatch):
    monkeypatch.setattr(Search, "parts", lambda self, whole: False)
    found = measure(case(CHAOTIC, rtol=1e-6, duration_rev=2))
    assert (found.status, found.attributes["regime"]) == ("ok", Regime.UNDECIDED)
    found = measure(case(CHAOTIC, accuracy="reference", duration_rev=2))
    assert (found.reason, found.attributes["regime"]) == ("accuracy_not_reached", "undecided")


def samples(of, shape):
    """Rows of a motion whose acceleration has a value at each time."""
    times = compared_times(of)
    rows = np.ones((times.size, COLUMNS))
    rows[:, Column.ACCELERATION] = shape(times / of.turn)
    return rows


@pytest.mark.parametrize(
    ("shape", "error", "found"),
    [
        (lambda turns: np.sin(2 * np.pi * turns) + 2, 0.0, (1, 1.0)),
        (lambda turns: np.sin(np.pi * turns) + 2, 0.0, (2, 1.0)),
        (lambda turns: np.sin(2 * np.pi / 3 * turns) + 2, 0.0, (3, 1.0)),
        (lambda turns: np.cos(2 * np.pi * turns) + 10.0 ** (-2 * turns), 1e-6, (1, 3.0)),
        (lambda turns: np.cos(2 * np.pi * turns) + 10.0 ** (-2 * turns), 1e-2, (1, 1.0)),
        (lambda turns: np.cos(2 * np.pi * turns) + 0.1 * turns, 1e-3, (None, math.nan)),
    ],
)
def test_a_period_is_found_in_revolutions_from_where_a_motion_has_settled(shape, error, found):
    of = case(duration_rev=8)
    told = repeats(of, samples(of, shape), NO_ERRORS | {"acceleration": error})
    np.testing.assert_equal(told, found)


@pytest.mark.parametrize(("duration", "settle"), [(0.5, 0), (1.5, 1), (2.9, 1)])
def test_less_than_two_revolutions_tell_no_period(duration, settle):
    of = case(duration_rev=duration, settle_rev=settle)
    assert repeats(of, samples(of, np.ones_like), NO_ERRORS)[0] is None
    whole = replace(of, solve=replace(of.solve, duration_rev=settle + 2.0))
    assert compared_per_rev(whole)
    assert repeats(whole, samples(whole, np.ones_like), NO_ERRORS) == (1, settle)


# ---- how long a motion can be foretold: what parts two runs is the motion, not their steps

REGULAR = {"joint": "both", "clearance_mm": 0.3}
QUICK = {"duration_rev": 1.2, "settle_rev": 0}
BRIEF = {"duration_rev": 1.2, "settle_rev": 0.2, "output_step_deg": 0.9}


def test_a_horizon_is_that_of_tighter_runs_on_a_finer_grid():
    """Its own runs err far below the shift, it looks often enough, and not at the case's solver."""
    made, pair = case(CHAOTIC, **QUICK), []
    for shift in (0.0, SHIFT * 0.3 / math.sqrt(2)):  # mm
        solve = {**QUICK, "rtol": 1e-12, "output_step_deg": 0.02, "error_bars": False}
        offset = {"big_end_x": shift, "big_end_y": shift}
        values = {**CHAOTIC, "initial_offset_mm": offset, "solve": solve}
        pair.append(simulate(Case.from_values(values))["eccentricity"].sel(joint="big_end"))
    apart = np.hypot(*(pair[1] - pair[0]).values.T) / 0.3e-3
    parted = float(pair[0]["time"][np.flatnonzero(apart > PARTED_DISTANCE)[0]])
    horizon = predictability_horizon(made)
    assert 0.9 * made.turn < horizon < made.duration
    assert horizon == pytest.approx(parted, rel=0.01)
    assert predictability_horizon(made, rtol=1e-13) == pytest.approx(horizon, rel=0.01)
    assert predictability_horizon(case(CHAOTIC, **QUICK, method="RODAS", rtol=1e-3)) == horizon


def test_a_run_that_stops_before_they_part_tells_of_no_horizon():
    """It was the time of the stop, and the motion was called chaotic."""
    assert math.isnan(predictability_horizon(case(REGULAR, **QUICK, max_steps=100)))
    assert math.isnan(predictability_horizon(case(REGULAR, **QUICK), timeout=0.0))
    found = measure(
        case(REGULAR, **QUICK, horizon=True, max_steps=10_000)
    )  # enough for all but those runs
    assert (found.status, found.attributes["regime"]) == ("ok", "predictable")
    assert math.isnan(found.numbers["predictability_horizon"])


def test_a_motion_that_can_be_foretold_keeps_its_bars():
    plain, asked = (
        measure(case(REGULAR, **BRIEF, horizon=asked)).numbers for asked in (False, True)
    )
    assert asked["predictability_horizon"] == math.inf
    for name in (*METRICS, *(f"{one}_error" for one in METRICS)):
        assert np.array_equal(asked[name], plain[name]), name

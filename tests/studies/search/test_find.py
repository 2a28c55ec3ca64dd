"""Searches on functions with a known threshold or maximum, with bars, failures and jumps."""

import math

import numpy as np
import pytest

from compressor.outcome import ROW
from compressor.studies import find
from compressor.studies.frame import StudyError

SCAN = [number / 8 for number in range(9)]
FAILED = find.JobReading(reason="the job failed, budget_steps: more than 5 steps")
ABOVE = find.comparison("peak_acceleration > 1")


def jobs(function, bar=0.0, calls=None):
    """Points of a function of the share; where it gives None the job failed."""

    def evaluate(shares):
        if calls is not None:
            calls.append([*shares])
        found = []
        for share in shares:
            value = function(share)
            told = FAILED if value is None else find.JobReading(value, bar)
            found.append(find.Point(share, 10.0 * share, told, failed=value is None))
        return found

    return evaluate


def test_a_limit_may_have_a_unit():
    assert find.comparison("peak_contact_force.small_end > 166 kN").limit == 166e3
    assert find.comparison("peak_acceleration >= 2 g").limit == pytest.approx(19.6133)
    assert find.comparison("contact_loss_fraction.big_end < 5 %").limit == 0.05


@pytest.mark.parametrize("threshold", [0.0001, 0.2, 0.3721, 0.5, 0.99])
@pytest.mark.parametrize("at_once", [1, 2, 5])
def test_a_threshold_is_between_the_ends(threshold, at_once):
    calls = []
    evaluate = jobs(lambda x: 1.0 + x - threshold, calls=calls)
    found = find.find_first(evaluate, ABOVE.holds, SCAN, 1e-3, at_once)
    assert found.kind == "found"
    assert found.low.share <= threshold < found.high.share
    assert found.high.share - found.low.share <= 1e-3 * (1 + 1e-9)
    assert found.blind == ()
    # so many sections as at_once points make of a step: 1/8 by 1 + at_once until 1e-3
    assert len(calls) - 1 <= math.ceil(math.log(125) / math.log(1 + at_once))
    assert max(map(len, calls[1:])) <= at_once


@pytest.mark.parametrize(
    ("function", "bar", "kind", "low", "high"),
    [
        (lambda x: 2.0 if x >= 0.7 else 0.0, 0.0, "found", 0.7, 0.7),
        # the first of several changes
        (lambda x: 1.0 + math.sin(4 * math.pi * (x - 0.05)), 0.0, "found", 0.05, 0.05),
        # with a bar the comparison is told outside 0.4 - bar ... 0.4 + bar alone
        *((lambda x: 0.6 + x, b, "undecided", 0.4 - b, 0.4 + b) for b in (0.003, 0.02, 0.2)),
        # failed jobs are gone around
        (lambda x: None if 0.3 < x < 0.5 else 0.6 + x, 0.0, "undecided", 0.3, 0.5),
        (lambda x: None if x > 0.8 else 0.6 + x, 0.0, "found", 0.4, 0.4),
    ],
)
def test_the_first_change_is_closed_in_on(function, bar, kind, low, high):
    found = find.find_first(jobs(function, bar), ABOVE.holds, SCAN, 1e-6, 2)
    assert found.kind == kind
    assert low - 1.001e-6 <= found.low.share <= low + 1e-9
    assert high - 1e-9 <= found.high.share <= high + 1.001e-6
    assert bool(found.blind) == (kind == "undecided")
    assert all(low - 1e-9 <= point.share <= high + 1e-9 for point in found.blind)


@pytest.mark.parametrize(
    ("value", "bar", "kind"),
    [(0.5, 0.1, "nowhere"), (2.0, 0.1, "at_low"), (0.5, 0.6, "unclear"), (None, 0.0, "unclear")],
)
def test_nothing_changes(value, bar, kind):
    calls = []
    found = find.find_first(jobs(lambda x: value, bar, calls), ABOVE.holds, SCAN, 1e-3)
    assert found.kind == kind
    assert calls == [SCAN]
    assert len(found.blind) == (9 if kind == "unclear" else 0)


def test_noise_ends_where_it_is_told():
    """Noise as large as its bar: the threshold stays inside, and the search comes to an end."""
    noise = np.random.default_rng(1)
    evaluate = jobs(lambda x: 0.6 + x + noise.uniform(-0.05, 0.05), 0.05)
    found = find.find_first(evaluate, ABOVE.holds, SCAN, 1e-4, 2)
    assert found.low.share <= 0.4 <= found.high.share
    assert found.high.share - found.low.share <= 0.2
    assert len(found.points) < 60


@pytest.mark.parametrize("peak", [0.0, 0.21, 0.5, 0.937, 1.0])
@pytest.mark.parametrize("greatest", [True, False])
def test_an_extremum_is_found(peak, greatest):
    sign = 1.0 if greatest else -1.0
    found = find.find_extremum(jobs(lambda x: -sign * (x - peak) ** 2), greatest, SCAN, 1e-4)
    assert found.kind == "found"
    assert found.best.share == pytest.approx(peak, abs=2e-4)
    assert found.within == (found.best,)
    left = -1.0 if found.low is None else found.low.share
    right = 2.0 if found.high is None else found.high.share
    assert left < found.best.share < right


def test_the_highest_of_two_peaks_counts():
    def function(x):
        return math.exp(-(((x - 0.2) / 0.1) ** 2)) + 1.1 * math.exp(-(((x - 0.77) / 0.1) ** 2))

    assert find.find_extremum(jobs(function), True, SCAN, 1e-4).best.share == pytest.approx(
        0.77, abs=1e-3
    )


def test_points_whose_bars_reach_the_best_are_as_good():
    """-(x - 0.4)^2 with bars of 0.005: what is less than 0.1 away cannot be told apart."""
    found = find.find_extremum(jobs(lambda x: -((x - 0.4) ** 2), 0.005), True, SCAN, 1e-4)
    assert found.best in found.within
    assert all(abs(point.share - 0.4) <= 0.1 + 1e-3 for point in found.within)
    assert (found.low.share, found.high.share) == (0.25, 0.625)
    flat = find.find_extremum(jobs(lambda x: 7.0), True, SCAN, 1e-2)
    assert (flat.low, flat.high, len(flat.within)) == (None, None, len(flat.points))


def test_an_extremum_goes_around_failures_and_tells_of_them():
    found = find.find_extremum(
        jobs(lambda x: None if 0.35 < x < 0.45 else -((x - 0.4) ** 2)), True, SCAN, 1e-3
    )
    assert found.kind == "undecided"
    assert 0.45 <= found.best.share < 0.47
    assert found.low.share == 0.25
    assert 0.375 in [point.share for point in found.blind]
    none = find.find_extremum(jobs(lambda x: None), True, SCAN, 1e-3)
    assert (none.kind, none.best, len(none.blind)) == ("unclear", None, 9)


def numbers(**values):
    row = np.full(1, np.nan, ROW)[0]
    for name, value in values.items():
        row[name] = value
    return row


def test_a_reading_is_number_and_bar():
    goal = find.goal_of("contact_loss_fraction.small_end", "greatest")
    row = numbers(contact_loss_fraction=[0.1, 0.2], contact_loss_fraction_error=[1e-3, 2e-3])
    assert goal.read(row, "predictable") == find.JobReading(0.2, 2e-3)
    row["contact_loss_fraction_error"] = np.nan
    assert goal.read(row, "") == find.JobReading(0.2, 0.0, barred=False)
    row["contact_loss_fraction_error"] = np.inf
    assert "not known" in goal.read(row, "undecided").reason
    assert "has no" in goal.read(numbers(), "predictable").reason
    axis = find.goal_of("peak_contact_force_axis.big_end.y", "least")
    row = numbers(peak_contact_force_axis=[[1, 2], [3, 4]], peak_contact_force_axis_error=0.5)
    assert axis.read(row, "periodic") == find.JobReading(2.0, 0.5)


def test_a_chaotic_peak_is_the_mean_of_revolutions():
    """Of 31 revolutions 15 batches of 2 are taken; Student's t at 97.5 % with 14 is 2.1448."""
    row = numbers(
        peak_acceleration=900.0, peak_acceleration_error=np.inf, peak_acceleration_mean=700.0,
        peak_acceleration_mean_standard_error=10.0, revolutions=31,
    )  # fmt: skip
    told = find.goal_of("peak_acceleration", "greatest").read(row, "chaotic")
    assert (told.value, told.averaged, told.reason) == (700.0, True, "")
    assert told.bar == pytest.approx(21.448, abs=1e-3)
    row["peak_acceleration_mean_standard_error"] = np.inf
    assert (
        "too few revolutions" in find.goal_of("peak_acceleration", ">").read(row, "chaotic").reason
    )


@pytest.mark.parametrize(
    ("sign", "there"), [(">", False), (">=", True), ("<", False), ("<=", True)]
)
def test_a_limit_without_a_bar_is_decided(sign, there):
    assert find.Goal("peak_acceleration", (), sign, 5.0).holds(find.JobReading(5.0, 0.0)) is there
    assert find.Goal("peak_acceleration", (), sign, 5.0).holds(find.JobReading(5.0, 1e-9)) is None
    assert find.Goal("peak_acceleration", (), sign, 5.0).holds(FAILED) is None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("xyz > 1", "there are peak_acceleration, "),
        ("peak_contact_force > 1", "write peak_contact_force.big_end|small_end"),
        ("peak_acceleration.small_end > 1", "write peak_acceleration"),
        ("peak_contact_force.knee > 1", "write peak_contact_force.big_end|small_end"),
        ("peak_acceleration == 1", "is no comparison"),
        ("peak_acceleration > nan", "is no comparison"),
        ("1 < peak_acceleration < 2", "is no comparison"),
        ("peak_acceleration > 1.5 * base", "'* base' is no unit of it"),
        ("peak_acceleration > 2 kN", "'kN' is no unit of it; there are m/s2, m/s², g"),
    ],
)
def test_what_is_no_comparison_is_refused(text, told):
    with pytest.raises(StudyError) as refusal:
        find.comparison(text)
    assert told in str(refusal.value)

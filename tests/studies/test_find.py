"""Searches on functions whose answer is known, and `compsim find` confirmed by direct runs."""

import contextlib
import io
import json
import math
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from compsim import cli
from conftest import jobs_here

from compressor.cases import Case, load_studies
from compressor.outcome import ROW
from compressor.solve.simulate import simulate
from compressor.store import read_store, read_studies
from compressor.studies import find
from compressor.studies.frame import KeySpan, StudyError

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
    assert find.comparison("rod_load_reversal_angle < 360 deg").limit == 2.0 * math.pi


@pytest.mark.parametrize("threshold", [0.0001, 0.2, 0.3721, 0.5, 0.99])
@pytest.mark.parametrize("at_once", [1, 2, 5])
def test_a_threshold_is_between_the_ends(threshold, at_once):
    calls = []
    evaluate = jobs(lambda x: 1.0 + x - threshold, calls=calls)
    found = find.find_first(evaluate, ABOVE.holds, SCAN, 1e-3, at_once)
    assert found.kind == "found"
    assert found.low.share <= threshold < found.high.share
    assert found.high.share - found.low.share <= 1e-3 * (1 + 1e-9)
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


@pytest.mark.parametrize(("values", "line"), [
    ((2.0, 0.5), "at 0 already, the lower end of the range"), ((0.5, 2.0), "between 0 and 10"),
    ((None, 2.0), "at or below 10"), ((0.5, 0.5), "scan 9 points 1.25 apart: finer changes"),
])  # fmt: skip
def test_an_answer_says_where_it_lies(values, line):
    answer = find.interval(jobs(lambda x: values[int(x)])([0.0, 1.0]), ABOVE.holds)
    question = find.Question("f.yaml", KeySpan("clearance_mm", 0.0, 10.0), ABOVE)
    _, said, *_ = find.list_answer(question, answer, "results", "si")
    assert " ".join(said.split()).startswith(line)


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


@pytest.mark.parametrize(("at", "low", "width"), [(0.77, 0.2, 0.1), (0.385, 0.3, 0.012)])
def test_the_highest_of_two_peaks_counts(at, low, width):
    def function(x):
        return math.exp(-(((x - low) / 0.1) ** 2)) + 1.1 * math.exp(-(((x - at) / width) ** 2))

    found = find.find_extremum(jobs(function), True, SCAN, 1e-4)
    assert at - 1e-3 < found.low.share < found.best.share < found.high.share < at + 1e-3


def test_points_whose_bars_reach_the_best_are_as_good():
    """-(x - 0.4)^2 with bars of 0.005: what is less than 0.1 away cannot be told apart."""
    found = find.find_extremum(jobs(lambda x: -((x - 0.4) ** 2), 0.005), True, SCAN, 1e-4)
    assert all(abs(point.share - 0.4) <= 0.1 + 1e-3 for point in found.within)
    assert (found.low.share, found.high.share) == (0.25, 0.625)
    flat = find.find_extremum(jobs(lambda x: 7.0), True, SCAN, 1e-2)
    assert (flat.low, flat.high, flat.within) == (None, None, flat.points)


def test_an_extremum_goes_around_failures_and_tells_of_them():
    evaluate = jobs(lambda x: None if 0.35 < x < 0.45 else -((x - 0.4) ** 2))
    found = find.find_extremum(evaluate, True, SCAN, 1e-3)
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
    goal = find.goal_of("peak_acceleration", "greatest")
    told = goal.read(row, "chaotic")
    assert (told.value, told.averaged, told.reason) == (700.0, True, "")
    assert told.bar == pytest.approx(21.448, abs=1e-3)
    row["peak_acceleration_mean_standard_error"] = np.inf
    assert "too few revolutions" in goal.read(row, "chaotic").reason


@pytest.mark.parametrize(
    ("sign", "there"), [(">", False), (">=", True), ("<", False), ("<=", True)]
)
def test_a_limit_without_a_bar_is_decided(sign, there):
    goal = find.Goal("peak_acceleration", (), sign, 5.0)
    assert goal.holds(find.JobReading(5.0, 0.0)) is there
    assert goal.holds(find.JobReading(5.0, 1e-9)) is None
    assert goal.holds(FAILED) is None


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
        (
            "rod_load_reversal_angle < 160",
            "160 rad is more than rod_load_reversal_angle can be, "
            "6.28; a unit such as deg goes behind the number",
        ),
        ("contact_loss_fraction.big_end > 5", "can be, 1; a unit such as % goes behind the"),
        ("peak_acceleration > 2 kN", "'kN' is no unit of it; there are m/s2, m/s², g"),
    ],
)
def test_what_is_no_comparison_is_refused(text, told):
    with pytest.raises(StudyError, match=re.escape(told)):
        find.comparison(text)


# ---- the command


LIMIT = 0.006
ASKED = [
    "find", "worn.yaml", "--over", "clearance_mm=0.002:0.2", "--log", "--scan", "5",
    "--tolerance", "0.04", "--first", f"contact_loss_fraction.small_end > {LIMIT}", "-j", "2",
]  # fmt: skip
CASE = {
    "joint": "small_end",
    "clearance_mm": 0.1,
    "contact": {"damping_N_s_per_mm": 20},
    "solve": {"duration_rev": 1, "settle_rev": 0.25, "accuracy": "draft"},
}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    place = tmp_path_factory.mktemp("find")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        Path("worn.yaml").write_text(json.dumps(CASE))
        with jobs_here(), contextlib.redirect_stdout(io.StringIO()) as out:
            assert cli.main([*ASKED, "--json", "--quiet"]) == 0
    return place, json.loads(out.getvalue())


@pytest.fixture
def folder(found, tmp_path, monkeypatch, in_process):
    shutil.copytree(found[0], tmp_path / "copy")
    monkeypatch.chdir(tmp_path / "copy")


def direct(clearance, accuracy, metric="contact_loss_fraction"):
    """A metric at the small end of a run of the case alone, outside of any store."""
    solve = CASE["solve"] | {"accuracy": accuracy}
    case = Case.from_values(CASE | {"clearance_mm": clearance, "solve": solve})
    return float(simulate(case)[metric].sel(joint="small_end"))


@pytest.mark.parametrize("accuracy", ["draft", "standard"])
def test_direct_runs_on_both_sides_confirm_the_interval(accuracy, found, folder):
    answer = found[1]
    assert answer["kind"] == "found"
    low, high = answer["low"], answer["high"]
    assert 1.0 < high["argument"] / low["argument"] <= 100**0.04 * (1 + 1e-6)
    assert direct(low["argument"], accuracy) <= LIMIT < direct(high["argument"], accuracy)
    for end in (low, high):
        difference = abs(direct(end["argument"], accuracy) - end["reading"]["value"])
        # two runs of other tolerances, each with its bar, of which one in 30 does not hold
        assert difference <= end["reading"]["bar"] * (3 if accuracy == "standard" else 1e-6)


def test_an_answer_is_said_in_plant_units(found, folder, compsim):
    asked = [*ASKED[:-4], "--first", "peak_contact_force.small_end > 5.5 kN", "-j", "2"]
    out = compsim(*asked, "--quiet", "--units", "plant").out
    assert out.startswith("peak_contact_force.small_end > 5.5 kN: ")
    first = float(re.search(r"^ +0\.002 +(\S+) ± ", out, re.MULTILINE)[1])
    assert first == pytest.approx(direct(0.002, "draft", "peak_contact_force") / 1e3, rel=1e-4)


def test_a_second_search_computes_nothing(found, folder, compsim):
    keys = read_store("results").keys()
    assert found[1]["run_now"] == len(found[1]["points"]) == len(keys)
    out, err = compsim(*ASKED, "--quiet")
    low, high = (f"{found[1][end]['argument']:.9g}" for end in ("low", "high"))
    head, *said, _ = (line.split(maxsplit=1) for line in out.splitlines()[:5])
    assert " ".join(head) == f"contact_loss_fraction.small_end > {LIMIT}: found"
    assert dict(said)["between"] == f"{low} and {high}"
    assert dict(said)["jobs"].startswith(f"{len(keys)}, 0 of them run now, in study worn-find-")
    rows = {line.split()[0]: line.split() for line in out.splitlines()[5:]}
    assert [*rows] == [f"{point['argument']:.9g}" for point in found[1]["points"]]
    assert (rows[low][-2], rows[high][-2]) == ("no", "yes")
    value, bar = float(rows[low][1]), float(rows[low][3])
    assert value == pytest.approx(found[1]["low"]["reading"]["value"], abs=bar)
    assert read_store("results").keys() == keys
    assert err == ""


def test_the_store_is_one_study_that_status_and_run_understand(found, folder, compsim):
    (study,) = read_studies("results")
    points = found[1]["points"]
    assert study.axes[0].values == tuple(point["argument"] for point in points)
    assert study.keys == tuple(point["key"] for point in points)
    assert study.is_trial  # a report puts it behind studies of a run
    assert f"{len(points)} ok" in compsim("status").out
    compsim("verify")
    again = study.again
    (same,) = load_studies(again.case_file, overrides=again.overrides)
    assert same.keys == study.keys


def test_failed_jobs_are_no_answer(folder, compsim):
    ask = ["find", "worn.yaml", "--over", "clearance_mm=0.01:0.02", "--scan", "3", "--quiet",
           "--first", "peak_acceleration > 1", "--set", "solve.max_steps=5"]  # fmt: skip
    out = compsim(*ask, code=3).out
    assert re.match(r"peak_acceleration > 1 m/s2: unclear\n", out)
    assert out.count("the job failed, budget_steps: more than 5 steps  failed  ") == 3

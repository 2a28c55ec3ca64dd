"""`compsim find`: a real search, confirmed by direct runs on both sides, and what it refuses."""

import contextlib
import io
import json
import re
import shutil
from pathlib import Path

import pytest
from compsim import cli
from conftest import jobs_here

from compressor.cases.load import load_cases, load_studies
from compressor.solve.simulate import simulate
from compressor.store.reader import read_store
from compressor.store.studies import read_studies
from compressor.studies.search.find import Point, interval
from compressor.studies.search.question import JobReading, Question, comparison
from compressor.studies.search.words import jsonable_answer, list_answer

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
    """A folder with a case file, its store after one search, and the answer as JSON."""
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
    text = CASE | {"clearance_mm": clearance, "solve": CASE["solve"] | {"accuracy": accuracy}}
    Path("direct.yaml").write_text(json.dumps(text))
    (case,) = load_cases("direct.yaml")
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


def test_a_limit_beside_the_first_point_is_said_in_plant_units(found, folder, capsys):
    """By points that are stored, and a few more; the first one is the base."""
    asked = [*ASKED[:-4], "--first", "peak_contact_force.small_end > 1.02 * base", "-j", "2"]
    assert cli.main([*asked, "--quiet", "--units", "plant"]) == 0
    first, second, *_ = capsys.readouterr().out.splitlines()
    low = direct(0.002, "draft", "peak_contact_force") / 1e3
    base, times = re.fullmatch(
        r"base, at clearance_mm = 0.002: (\S+) ± \S+ kN; (\S+) times it", first
    ).groups()
    assert float(base) == pytest.approx(low, rel=1e-2)
    limit = re.match(r"peak_contact_force.small_end > (\S+) kN first holds", second)[1]
    assert float(limit) == pytest.approx(1.02 * low, rel=1e-3)
    assert times == "1.02"


def test_a_second_search_computes_nothing(found, folder, capsys):
    keys = read_store("results").keys()
    assert found[1]["run_now"] == len(found[1]["points"]) == len(keys)
    assert cli.main([*ASKED, "--quiet"]) == 0
    out, err = capsys.readouterr()
    low, high = (f"{found[1][end]['argument']:.9g}" for end in ("low", "high"))
    assert max(map(len, out.splitlines())) <= 80
    *first, no, yes, finer, last = out.splitlines()
    assert " ".join(" ".join(first).split()) == (
        f"contact_loss_fraction.small_end > {LIMIT} first holds between "
        f"clearance_mm = {low} and {high}"
    )
    assert re.match(rf"  clearance_mm = {low}: no, 0\.0\d+ ± [\d.]+  job [0-9a-f]{{8}}$", no)
    assert re.match(rf"  clearance_mm = {high}: yes, 0\.0\d+ ± [\d.]+  job [0-9a-f]{{8}}$", yes)
    assert finer == "what is finer than the scan, 5 points a factor 3.162 apart, may be missed"
    assert (
        last == f"{len(keys)} jobs, 0 of them run now, in study worn-find-clearance_mm of results"
    )
    assert read_store("results").keys() == keys
    assert err == ""


def test_the_store_is_one_study_that_status_and_run_understand(found, folder, capsys):
    (study,) = read_studies("results")
    points = found[1]["points"]
    assert study.axes[0].values == tuple(point["argument"] for point in points)
    assert study.keys == tuple(point["key"] for point in points)
    assert cli.main(["status"]) == 0
    assert f"{len(points)} ok" in capsys.readouterr().out
    assert cli.main(["verify"]) == 0
    again = study.again
    (same,) = load_studies(again.case_file, overrides=again.overrides)
    assert same.keys == study.keys


def test_another_question_keeps_the_points_of_this_case(found, folder, capsys):
    ask = ["find", "worn.yaml", "--over", "clearance_mm=0.002:0.2", "--log", "--scan", "5",
           "--tolerance", "0.4", "--greatest", "peak_acceleration", "--quiet"]  # fmt: skip
    assert cli.main(ask) == 0
    out = capsys.readouterr().out
    assert out.startswith("peak_acceleration is greatest at clearance_mm = 0.2: ")
    (study,) = read_studies("results")
    assert {*study.axes[0].values} > {point["argument"] for point in found[1]["points"]}
    # a changed case has none of these points
    Path("worn.yaml").write_text(json.dumps(CASE | {"load": "none"}))
    few = [
        "--over",
        "clearance_mm=0.01:0.02",
        "--scan",
        "3",
        "--first",
        "impact_count.small_end > 1e9",
    ]
    assert cli.main(["find", "worn.yaml", *few, "--quiet"]) == 0
    assert "holds at none of 3 points" in capsys.readouterr().out
    (study,) = read_studies("results")
    assert study.axes[0].values == (0.01, 0.015, 0.02)


def test_failed_jobs_are_no_answer(folder, capsys):
    ask = ["find", "worn.yaml", "--over", "clearance_mm=0.01:0.02", "--scan", "3", "--quiet",
           "--first", "peak_acceleration > 1", "--set", "solve.max_steps=5"]  # fmt: skip
    assert cli.main(ask) == 3
    out = capsys.readouterr().out
    assert "surely holds at none of 3 points" in out
    assert out.count("the job failed, budget_steps: more than 5 steps") == 3


def test_later_crossings_are_named_in_the_unit_of_the_limit():
    """Six points without jobs, every second one above the limit."""
    goal = comparison("peak_contact_force.small_end > 1 kN")
    question = Question("worn.yaml", "clearance_mm", 0.0, 5.0, goal, scan=6)
    points = [
        Point(n / 5, float(n), JobReading(1200.0 if n in (0, 2, 4) else 800.0, 1.0), "k" * 20)
        for n in range(6)
    ]
    answer = interval(points, goal.holds)
    assert [*list_answer(question, answer, "results", None)][:-2] == [
        "peak_contact_force.small_end > 1 kN holds from the range's lower end on",
        "  clearance_mm = 0: yes, 1.200 ± 0.001 kN  job kkkkkkkk",
        "5 more crossings seen, not narrowed down:",
        "  stops holding between clearance_mm = 0 and 1",
        "  holds again between clearance_mm = 1 and 2",
        "  stops holding between clearance_mm = 2 and 3",
        "  holds again between clearance_mm = 3 and 4",
        "  stops holding between clearance_mm = 4 and 5",
    ]
    found = jsonable_answer(question, answer)
    assert [one["holds"] for one in found["crossings"]] == [False, True, False, True, False]
    assert (found["unit"], found["goal"]["limit"]) == ("N", 1000.0)

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

from compressor.cases import Case, load_studies
from compressor.solve.simulate import simulate
from compressor.store import read_store, read_studies

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
    first = re.search(r"^ +0\.002 +(\S+) ± ", out, re.MULTILINE)[1]
    assert float(first) == pytest.approx(
        direct(0.002, "draft", "peak_contact_force") / 1e3, rel=1e-4
    )


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

"""What a store says of its studies and jobs: `compsim status` and `compsim show`."""

import json
import shlex
from pathlib import Path

import pytest
from conftest import write_cases

from compressor.cases.load import load_studies
from compressor.store.status import report_job, standings
from compressor.sweep.sweep import sweep

SHORT = {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9}
MIX = {
    "joint": "both",
    "clearance_mm": [0.1, 0.2],
    "solve": SHORT | {"max_steps": [5, 10**6]},
    "output": {"keep": "metrics"},
}


@pytest.fixture
def mix(tmp_path, monkeypatch, in_process):
    """A study of four jobs of which two failed, one is ok and one is missing."""
    monkeypatch.chdir(tmp_path)
    only = "clearance_mm < 0.15 or solve.max_steps < 10"
    (study,) = load_studies(*write_cases(tmp_path, mix=MIX), only=only)
    sweep([study], tmp_path / "results", 1)
    return study


def test_status_counts_jobs_and_reasons(mix, compsim):
    (found,) = standings("results")
    assert (found.jobs, found.ok, found.failed, found.missing) == (4, 1, 2, 1)
    assert found.reasons == {"budget_steps": 2}
    out, err = compsim("status")
    assert " ".join(out.split("\n")[0].split()) == "mix 4 jobs 1 ok 2 failed 1 missing"
    assert "2 budget_steps: raise solve.max_steps" in out
    assert f"next: compsim run {mix.path} -r results\n" == err
    assert json.loads(compsim("status", "--json").out)[0]["reasons"] == {"budget_steps": 2}


def test_show_tells_how_a_job_ended(mix, compsim):
    by_end = {report_job("results", key).status: key for key in mix.keys}
    assert by_end.keys() == {"ok", "failed", "missing"}
    out = compsim("show", by_end["ok"][:12]).out
    assert f"job {by_end['ok']}: ok" in out
    assert "in mix clearance_mm=0.1 solve.max_steps=1000000" in out
    out = compsim("show", by_end["failed"]).out
    assert "failed: budget_steps: more than 5 steps" in out
    assert "what to do: raise solve.max_steps" in out
    lines = [line.split() for line in out.split("\n")]
    (stopped,) = (words for words in lines if words[:1] == ["stopped"])
    assert 0 < float(stopped[2]) < 0.03
    assert float(stopped[4]) == pytest.approx(float(stopped[2]) * 3000, rel=1e-3)
    out, err = compsim("show", by_end["missing"])
    assert "not run yet" in out
    assert err.startswith("next: compsim run ")


def test_the_next_run_has_the_same_jobs(tmp_path, monkeypatch, compsim, in_process):
    """What was set on the command line is part of them."""
    monkeypatch.chdir(tmp_path)
    write_cases(tmp_path, **{"one case": {"name": "one", "solve": SHORT}})
    setting = ["--set", "joint=big_end", "--set=clearance_mm=[0.1, 0.2]"]
    command = ["run", "one case.yaml", "-j", "1", "--quiet", *setting]
    compsim(*command, "--only", "clearance_mm < 0.15")
    next_run = compsim("status").err.removeprefix("next: ").strip()
    compsim(*shlex.split(next_run)[1:], "--quiet", "-j", "1")
    assert standings("results")[0].missing == 0


def test_damage_is_told_where_its_jobs_count_as_missing(mix, compsim):
    paths = [*Path("results/batches").iterdir()]
    for path in paths:
        path.write_bytes(path.read_bytes()[:-1])
    for words in (["status"], ["show", mix.keys[0]], ["status", "--json"]):
        out, err = compsim(*words)
        assert "missing" in out or "not run yet" in out
        said = " ".join(err.split())
        assert all(said.count(f"{path.name}: is damaged") == 1 for path in paths)
        assert "Warning" not in err  # said as other messages are, without a place in the source

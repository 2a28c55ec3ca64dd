"""What a store says of its studies and jobs: ends, promises, regimes, damage; status and show."""

import json
import shlex

import pytest
from conftest import SHORT, write_cases
from made_jobs import fill, study

from compressor.metrics import NUMBERS, QUANTILES
from compressor.outcome import REGIME_WORDS, Regime
from compressor.store.reader import open_study
from compressor.store.status import report_job, standings

BRIEF = {"duration_rev": 3.2, "settle_rev": 0.2, "output_step_deg": 0.9}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A folder with a study of four jobs: one is chaotic, one kept its promise, two failed."""
    folder = tmp_path_factory.mktemp("ring")
    values = {"clearance_mm": 0.3, "machine": {"rod_mass_kg": 1, "speed_rpm": 1000}}
    damping = {"damping_N_s_per_mm": [0, 336]}
    solve, output = {**BRIEF, "max_steps": [5, 10**6]}, {"keep": "metrics"}
    fill(folder, study("ring", solve, joint="big_end", contact=damping, output=output, **values))
    return folder


def test_promise_regime_and_statistics_of_each_job_are_kept(whole):
    found = open_study(whole)
    assert found["regime"].values.tolist() == [["", ""], ["chaotic", "periodic"]]
    assert found["promise"].values.tolist() == [["none", "none"], ["none", "kept"]]
    statistics = {name for name, row in NUMBERS.items() if row.when == "chaotic"}
    assert statistics <= {*found.variables}
    assert found["quantile"].values.tolist() == list(QUANTILES)
    chaotic = found["regime"] == "chaotic"
    assert (found["revolutions"].notnull() == chaotic).all()
    assert float(found["revolutions"].where(chaotic).max()) == 3


def test_status_counts_jobs_reasons_promises_and_regimes(whole, compsim):
    (found,) = standings(whole)
    assert (found.jobs, found.ok, found.failed, found.missing) == (4, 2, 2, 0)
    assert found.reasons == {"budget_steps": 2}
    assert found.promises == {"chaotic": 1, "kept": 1}
    assert found.regimes == {"chaotic": 1, "periodic": 1}
    out = compsim("status", "-r", whole).out
    assert max(map(len, out.splitlines())) <= 80
    out = " ".join(out.split())
    assert out.startswith("ring 4 jobs 2 ok 2 failed 0 missing")
    assert "2 budget_steps: raise solve.max_steps" in out
    reached = "1 chaotic (no accuracy target can hold), 1 reached their accuracy target"
    assert f"of those ok: {reached} of those ok" in out
    for regime in ("chaotic", "periodic"):
        assert f"of those ok: 1 {regime} ({REGIME_WORDS[Regime(regime)]})" in out
    (told,) = json.loads(compsim("status", "-r", whole, "--json").out)
    assert told["reasons"] == {"budget_steps": 2}


@pytest.fixture
def mix(tmp_path):
    """A folder with a study of a job that failed, one that is ok and one that is missing."""
    made = study("mix", SHORT | {"max_steps": [5, 10**6, 10**7]}, joint="both", clearance_mm=0.1)
    fill(tmp_path, made, skip=[2])
    return tmp_path, made


def test_show_tells_how_a_job_ended(mix, compsim):
    folder, made = mix
    failed, ok, missing = made.keys
    out = compsim("show", ok[:12], "-r", folder).out
    assert f"job {ok}: ok" in out
    assert "in mix solve.max_steps=1000000" in out
    out = compsim("show", failed, "-r", folder).out
    assert "failed: budget_steps: more than 5 steps" in out
    assert "what to do: raise solve.max_steps" in out
    lines = [line.split() for line in out.split("\n")]
    (stopped,) = (words for words in lines if words[:1] == ["stopped"])
    assert 0 < float(stopped[2]) < 0.03
    assert float(stopped[4]) == pytest.approx(float(stopped[2]) * 3000, rel=1e-3)
    assert report_job(folder, missing).status == "missing"
    out, err = compsim("show", missing, "-r", folder)
    assert "not run yet" in out
    assert err.startswith("next: compsim run ")


def test_the_next_run_has_the_same_jobs(tmp_path, monkeypatch, compsim, in_process):
    """What was set on the command line is part of them."""
    monkeypatch.chdir(tmp_path)
    write_cases(tmp_path, **{"one case": {"name": "one", "solve": SHORT}})
    setting = ["--set", "joint=big_end", "--set=clearance_mm=[0.1, 0.2]"]
    command = ["run", "one case.yaml", "-j", "1", "--quiet", *setting]
    compsim(*command, "--only", "clearance_mm < 0.15")
    assert standings("results")[0].missing == 1
    next_run = compsim("status").err.removeprefix("next: ").strip()
    assert not compsim(*shlex.split(next_run)[1:], "--quiet", "-j", "1").err
    assert standings("results")[0].missing == 0
    err = compsim(*command[:-1], "--set=clearance_mm=0.1").err
    said = "one: its study in results is replaced, and 1 of its jobs is in no study now (such as: "
    assert err.startswith(said)
    show = shlex.split(err.removeprefix(said).partition(")")[0])
    assert "ok" in compsim(*show[1:]).out


def test_damage_is_told_where_its_jobs_count_as_missing(mix, compsim):
    folder, made = mix
    paths = [*(folder / "batches").iterdir()]
    for path in paths:
        path.write_bytes(path.read_bytes()[:-1])
    for words in (["status"], ["show", made.keys[0]], ["status", "--json"]):
        out, err = compsim(*words, "-r", folder)
        assert "missing" in out or "not run yet" in out
        said = " ".join(err.split())
        assert all(said.count(f"{path.name}: is damaged") == 1 for path in paths)
        assert "Warning" not in err  # said as other messages are, without a place in the source

"""A case file with other jobs than before: said before the run, and nothing is lost."""

import json
from pathlib import Path

import pytest
from compsim import cli

from compressor.cases import MODEL_VERSION
from compressor.cases.load import load_studies
from compressor.outcome import without_run
from compressor.store import studies as stored_studies
from compressor.store.files import StoreWarning
from compressor.store.reader import open_study, read_store
from compressor.store.status import changes, report_job, standings, verify
from compressor.store.studies import StudyChange, read_studies, write_study
from compressor.store.writer import Writer

FEW = {"clearance_mm": [0.1, 0.2]}
MORE = {"clearance_mm": [0.1, 0.2, 0.3]}


@pytest.fixture
def wear(tmp_path, monkeypatch):
    """Makes the study `wear` of some values (JSON is YAML)."""
    monkeypatch.chdir(tmp_path)

    def make(**values):
        Path("wear.yaml").write_text(json.dumps({"joint": "both", **values}))
        return load_studies("wear.yaml")[0]

    return make


def run(study, jobs=None):
    """Store a study, and of its jobs the first so many as failed ones, which a run keeps, too."""
    with Writer("results") as writer:
        write_study("results", study, f"compsim run {len(study.keys)}", writer.found.keys)
        for case in study.cases[:jobs]:
            writer.add(without_run(case.attributes(), "internal_error", "made by hand"))


def names():
    return [study.name for study in read_studies("results", former=True)]


def test_a_study_that_shrinks_stays_as_a_former_one(wear):
    more = wear(**MORE)
    run(more)
    few = wear(**FEW)
    assert changes("results", [few]) == [StudyChange("wear", 3, 2, 2, 1, "wear~1", "")]
    assert names() == ["wear"]  # asked, not changed
    run(few)
    assert names() == ["wear", "wear~1"]
    assert [study.name for study in read_studies("results")] == ["wear"]
    now, before = read_studies("results", former=True)
    assert (now.former_of, before.former_of) == ("", "wear")
    assert (before.keys, before.command) == (more.keys, "compsim run 3")
    assert open_study("results", "wear~1")["clearance_mm"].values.tolist() == [0.1, 0.2, 0.3]
    assert open_study("results", "wear~1")["status"].values.tolist() == ["failed"] * 3
    assert open_study("results").sizes["clearance_mm"] == 2


def test_a_study_that_grows_or_repeats_leaves_no_former_one(wear):
    for values in (FEW, MORE, MORE):
        study = wear(**values)
        assert changes("results", [study]) == []
        run(study)
    assert names() == ["wear"]


def test_what_never_ran_is_not_kept(wear):
    run(wear(**MORE), 2)
    few = wear(**FEW)
    assert changes("results", [few]) == [StudyChange("wear", 3, 2, 2, 0, "", "")]
    run(few)
    assert names() == ["wear"]


def test_each_former_study_is_kept_once(wear):
    other = {"clearance_mm": [0.5]}
    for values in (MORE, FEW, MORE, FEW, other, MORE, other):
        run(wear(**values))
    assert names() == ["wear", "wear~1", "wear~2", "wear~3"]
    assert [study.jobs for study in read_studies("results", former=True)] == [1, 3, 2, 1]


def test_no_stored_job_is_in_no_study(wear):
    for values in (MORE, FEW, {"clearance_mm": [0.3, 0.4]}, {"machine": {"rod_mass_kg": [3, 4]}}):
        run(wear(**{"clearance_mm": 0.1, **values}))
        inside = {key for study in read_studies("results", former=True) for key in study.keys}
        assert read_store("results").keys() <= inside


def test_status_tells_of_former_studies_as_long_as_they_have_more(wear, capsys):
    run(wear(**MORE))
    run(wear(**FEW), 0)
    assert [(one.study, one.former_of, one.jobs) for one in standings("results")] == [
        ("wear", "", 2), ("wear~1", "wear", 3)
    ]  # fmt: skip
    assert cli.main(["status"]) == 0
    out, err = capsys.readouterr()
    assert "wear~1 3 jobs 0 ok 3 failed 0 missing" in " ".join(out.split())
    assert "wear as it was run on 20" in out
    assert err == ""
    run(wear(**MORE), 0)
    assert [one.study for one in standings("results")] == ["wear"]


def test_missing_jobs_of_a_former_study_are_not_run_by_its_case_file(wear, capsys):
    run(wear(clearance_mm=[0.3, 0.1, 0.2]), 1)
    run(wear(**FEW), 0)
    assert cli.main(["status"]) == 0
    out, err = capsys.readouterr()
    assert "wear~1 3 jobs 0 ok 1 failed 2 missing" in " ".join(out.split())
    assert err == "next: compsim run " + str(Path("wear.yaml").absolute()) + " -r results\n"


def test_a_job_of_a_former_study_is_found(wear):
    more = wear(**MORE)
    run(more)
    run(wear(**FEW))
    found = report_job("results", more.keys[2][:12])
    assert found.studies == {"wear~1": {"clearance_mm": 0.3}}
    assert found.again == ()
    assert report_job("results", more.keys[0]).studies.keys() == {"wear", "wear~1"}


def test_a_damaged_former_study_costs_itself_alone(wear):
    run(wear(**MORE))
    run(wear(**FEW))
    path = Path("results/former/wear~1.json").absolute()
    path.write_text(path.read_text().replace("0.3", "0.4"))
    with pytest.warns(StoreWarning, match=r"wear~1\.json: is damaged, .*; delete it: its jobs are"):
        assert [one.study for one in standings("results")] == ["wear"]
    (damage,) = verify("results")
    assert (damage.path.name, damage.remedy) == (path.name, "delete it: its jobs stay stored")
    path.unlink()
    assert verify("results") == []


@pytest.mark.parametrize("name", ["wear~1", "wear"])
def test_a_study_stands_where_its_name_belongs(name, wear):
    run(wear(**MORE))
    run(wear(**FEW))
    here, there = "studies/wear.json", "former/wear~1.json"
    source, target = (there, "studies/wear~1.json") if "~" in name else (here, "former/wear.json")
    Path("results", source).rename(Path("results", target))
    with pytest.raises(stored_studies.StoreError, match="is damaged, or of another version"):
        stored_studies.read_study(Path("results", target))


@pytest.mark.parametrize("command", ["run", "plan"])
def test_run_and_plan_say_so_first(command, wear, capsys, in_process):
    run(wear(**MORE))
    wear(**FEW)
    assert cli.main([command, "wear.yaml"]) in (0, 3)
    err = capsys.readouterr().err
    assert err.startswith(
        "wear: had 3 jobs, this file has 2, 2 of them as before; 1 finished before stays\n"
        "  stored, in the study wear~1:\n"
        "  compsim export wear~1 -r results -o wear~1.csv\n"
    )
    assert names() == (["wear", "wear~1"] if command == "run" else ["wear"])


def test_jobs_of_an_older_model_are_told_as_such(wear, monkeypatch):
    study = wear(**MORE)
    run(study)
    monkeypatch.setattr("compressor.cases.case.MODEL_VERSION", "next")
    monkeypatch.setattr(stored_studies, "MODEL_VERSION", "next")
    again = wear(**MORE)
    assert changes("results", [again]) == [StudyChange("wear", 3, 3, 0, 3, "wear~1", MODEL_VERSION)]

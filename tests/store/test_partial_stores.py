"""Stores that share a folder, were copied in part, or lack files: nothing is lost, all is told."""

import json
import shutil

import pytest

from compressor.cases.load import load_studies
from compressor.store.files import StoreError
from compressor.store.reader import open_study, read_job, read_store
from compressor.store.status import standings, verify
from compressor.store.writer import Writer
from compressor.sweep.sweep import sweep

SOLVE = {"duration_rev": 0.1, "settle_rev": 0, "output_step_deg": 1, "accuracy": "draft"}


@pytest.fixture
def run(tmp_path, in_process):
    """Runs the study `name`, of two healthy machines at a speed, into a folder; its remarks."""

    def run(folder, name="small", speed=500):
        path = tmp_path / f"{name}.yaml"
        values = {"load": ["none", "spring"], "machine": {"speed_rpm": speed}, "solve": SOLVE}
        path.write_text(json.dumps(values), encoding="utf-8")
        remarks = []
        sweep(load_studies(path), folder, 1, lambda done, total, remark: remarks.append(remark))
        return [remark for remark in remarks if remark]

    return run


def accelerations(folder, name="small"):
    return open_study(folder, name).acceleration.values


def test_a_run_on_one_store_leaves_what_another_has_in_shared_jobs(run, tmp_path):
    run(tmp_path / "a")
    expected = accelerations(tmp_path / "a")
    shared = (tmp_path / "a/jobs").rename(tmp_path / "shared")
    (tmp_path / "b").mkdir()
    for store in ("a", "b"):
        (tmp_path / store / "jobs").symlink_to(shared)
    for speed in (600, 500):  # other jobs, and the same ones
        run(tmp_path / "b", speed=speed)
        assert verify(tmp_path / "a") == []
        assert (accelerations(tmp_path / "a") == expected).all()
    assert len([*shared.glob("*.h5")]) == 6


def test_a_run_amid_a_copy_leaves_the_series_that_came_first(run, tmp_path):
    run(tmp_path / "whole")
    expected = accelerations(tmp_path / "whole")
    shutil.copytree(tmp_path / "whole/jobs", tmp_path / "copy/jobs")
    (remark,) = run(tmp_path / "copy", "other", speed=600)
    assert remark == (
        f"{tmp_path / 'copy/jobs'}: no row knows the jobs of 2 of its files; they stay, and "
        "compsim verify shows what to do"
    )
    shutil.copytree(tmp_path / "whole", tmp_path / "copy", dirs_exist_ok=True)
    assert verify(tmp_path / "copy") == []
    assert (accelerations(tmp_path / "copy") == expected).all()
    assert run(tmp_path / "copy", "other", speed=600) == []


def test_what_a_better_result_replaces_is_removed(run, tmp_path):
    """In the run itself, or by the next one: both rows are this store's."""
    run(tmp_path / "out")
    first = {*(tmp_path / "out/jobs").iterdir()}
    (study,) = load_studies(tmp_path / "small.yaml")
    from compressor.sweep.run_job import run_job

    with Writer(tmp_path / "out") as writer:
        for case in study.cases:
            writer.add(run_job(writer.place, case))
    assert first < {*(tmp_path / "out/jobs").iterdir()}
    with Writer(tmp_path / "out"):
        pass
    assert len([*(tmp_path / "out/jobs").iterdir()]) == 2
    assert not first & {*(tmp_path / "out/jobs").iterdir()}
    assert verify(tmp_path / "out") == []
    assert read_job(tmp_path / "out", study.keys[0]).status == "ok"


def test_a_result_that_replaces_another_but_lacks_its_series_costs_nothing(run, tmp_path):
    run(tmp_path / "out")
    expected = accelerations(tmp_path / "out")
    first = [*(tmp_path / "out/jobs").iterdir()]
    (study,) = load_studies(tmp_path / "small.yaml")
    from compressor.sweep.run_job import run_job

    with Writer(tmp_path / "out") as writer:
        writer.add(run_job(writer.place, study.cases[0]))
    (new,) = {*(tmp_path / "out/jobs").iterdir()} - {*first}
    new.unlink()
    with Writer(tmp_path / "out"):
        pass
    assert sorted((tmp_path / "out/jobs").iterdir()) == sorted(first)
    assert (accelerations(tmp_path / "out") == expected).all()


def test_a_copy_without_series_has_its_metrics(run, tmp_path):
    run(tmp_path / "full")
    shutil.copytree(tmp_path / "full", tmp_path / "part", ignore=shutil.ignore_patterns("jobs"))
    whole, part = (open_study(tmp_path / name) for name in ("full", "part"))
    assert part.status.values.tolist() == ["ok", "ok"]
    assert (part.peak_acceleration == whole.peak_acceleration).all()
    assert "acceleration" in whole
    assert "acceleration" not in part
    (one,) = standings(tmp_path / "part")
    assert (one.ok, one.failed, one.missing) == (2, 0, 0)
    assert one.caveats[0].startswith("2 of 2 jobs have metrics alone: the files of their time")
    assert len(verify(tmp_path / "part")) == 2
    (study,) = load_studies(tmp_path / "small.yaml", overrides=["output.keep=metrics"])
    assert sweep([study], tmp_path / "part", 1).run_now == 0
    assert sweep(load_studies(tmp_path / "small.yaml"), tmp_path / "part", 1).run_now == 2
    assert (accelerations(tmp_path / "part") == accelerations(tmp_path / "full")).all()
    assert verify(tmp_path / "part") == standings(tmp_path / "part")[0].caveats == []


def test_rows_that_are_gone_are_told_by_series_and_studies(run, tmp_path):
    run(tmp_path / "out")
    (study,) = load_studies(tmp_path / "small.yaml")
    shutil.rmtree(tmp_path / "out/rows")
    (damage,) = verify(tmp_path / "out")
    assert damage.problem == "no row knows the jobs of 2 of its files"
    assert {*damage.keys} == {*study.keys}
    assert damage.again[0].case_file == str(tmp_path / "small.yaml")
    shutil.rmtree(tmp_path / "out/jobs")
    (damage,) = verify(tmp_path / "out")
    assert damage.path == tmp_path / "out/studies/small.json"
    assert damage.problem == "no row knows 2 of its 2 jobs: not run yet, or gone"
    assert damage.again[0].case_file == str(tmp_path / "small.yaml")
    run(tmp_path / "out")
    assert verify(tmp_path / "out") == []


def test_a_study_that_is_gone_is_told_by_rows(run, tmp_path):
    run(tmp_path / "out")
    path = tmp_path / "out/studies/small.json"
    path.unlink()
    (damage,) = verify(tmp_path / "out")
    assert damage.path == path
    assert damage.problem == "is gone, and 2 stored jobs were run for it"
    assert damage.remedy == "run its case file again, which recomputes no job"
    assert run(tmp_path / "out") == []
    assert verify(tmp_path / "out") == []


def test_a_link_among_shards_does_not_lead_out_of_the_store(run, tmp_path):
    run(tmp_path / "out")
    run(tmp_path / "other", speed=600)
    (tmp_path / "out/shards").mkdir()
    for name, target in (("up", tmp_path / "other"), ("here", "."), ("nowhere", "gone")):
        (tmp_path / "out/shards" / name).symlink_to(target)
    assert len(read_store(tmp_path / "out").keys()) == 2
    assert verify(tmp_path / "out") == []
    assert run(tmp_path / "out") == []


def test_a_link_that_leads_nowhere_is_called_so(run, tmp_path):
    (tmp_path / "out").symlink_to("nowhere")
    with pytest.raises(StoreError, match="out: is a link that leads nowhere; choose another"):
        run(tmp_path / "out")


def test_jobs_that_a_run_is_about_to_store_are_not_missed(run, tmp_path):
    run(tmp_path / "out")
    for path in (tmp_path / "out/rows").iterdir():
        path.unlink()
    with Writer(tmp_path / "out"):
        assert verify(tmp_path / "out") == []
    assert len(verify(tmp_path / "out")) == 1

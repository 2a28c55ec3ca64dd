"""Studies of machines: what is stored, what goes on, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from compressor.cases.load import load_studies
from compressor.store.files import StoreError
from compressor.store.netcdf import write_dataset
from compressor.studies.claims import study as machine_study
from compressor.studies.claims.study import (
    ClaimsError,
    Judged,
    about_machine,
    cases_judged,
    judge_end,
    judge_machines,
    machines,
    machines_dataset,
    read_machines,
    rows_of,
)
from compressor.sweep.worker import JobLost, JobResult

QUICK = "solve: {accuracy: draft, duration_rev: 2, output_step_deg: 1}\n"
GRID = QUICK + "machine: {rod_mass_kg: [3, 4.7], reciprocating_mass_kg: [10, 14, 20]}\n"


@pytest.fixture
def plan(tmp_path):
    def plan(text):
        (tmp_path / "some.yaml").write_text(text)
        (study,) = load_studies(tmp_path / "some.yaml", variants=cases_judged)
        return study

    return plan


def verdict(number, chaotic=0):
    """A made-up verdict that tells machines apart."""
    numbers = tuple(number + 0.1 * claim for claim in range(8))
    return Judged(numbers, (0.01,) * 8, (-0.1,) * 4, (0.0,) * 4, chaotic)


def test_a_grid_has_its_axes_as_dimensions(plan):
    study = plan(GRID)
    rows = {str(n): verdict(n - 2.0) for n in range(5)} | {"5": Judged(failed="both 0.1: no")}
    found = machines_dataset(study, [*map(str, range(6))], rows)
    assert found["margin"].dims == ("rod_mass_kg", "reciprocating_mass_kg", "claim")
    at = found.sel(rod_mass_kg=4.7, reciprocating_mass_kg=10, claim=3)
    assert at["margin"].item() == pytest.approx(1.2)
    assert at["held"].item() == 1
    assert found["rod_mass_kg"].attrs["units"] == "kg"
    lost = found.sel(rod_mass_kg=4.7, reciprocating_mass_kg=20)
    assert lost["status"].item() == "failed"
    assert (lost["held"] == -1).all()


def test_other_studies_have_one_dimension(plan):
    study = plan(QUICK + "blocks: [{friction: false}, {machine: {rod_mass_kg: [3, 4]}}]\n")
    found = machines_dataset(study, ["a", "b", "c"], {"b": verdict(1.0)})
    assert found["margin"].dims == ("machine", "claim")
    assert found["friction"].values.tolist() == ["false", "true", "true"]
    assert found["status"].values.tolist() == ["", "ok", ""]


@pytest.mark.parametrize("text", [GRID, QUICK + "blocks: [{}, {machine: {rod_mass_kg: [3, 4]}}]\n"])
def test_what_is_stored_reads_back(plan, tmp_path, text):
    study = plan(text)
    keys = [f"k{n}" for n in range(study.jobs)]
    rows = {"k0": verdict(0.5, 3), "k2": Judged(failed="big_end 0.1: not_settled")}
    write_dataset(tmp_path / "some.nc", machines_dataset(study, keys, rows))
    again = read_machines(tmp_path / "some.nc")
    assert repr(rows_of(again)) == repr(rows)
    assert {*again.coords} >= {axis.key.rpartition(".")[2] for axis in study.axes}


def test_a_machine_that_took_its_worker_with_it_has_a_reason():
    assert judge_end(JobResult(0, verdict(1.0), 0.1)) == verdict(1.0)
    assert judge_end(JobLost(0, "worker_died", "exit code 9")).failed == "worker_died: exit code 9"


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("joint: both\nclearance_mm: 0.2\n", "joint"),
        ("load: [none, gas]\n", "load"),
        ("body: true\n", "body"),
    ],
)
def test_what_the_papers_cases_decide_is_refused(plan, text, key):
    with pytest.raises(ClaimsError, match=f"some.yaml: {key}: the paper's cases decide it"):
        machines(plan(text))


def test_a_study_goes_on_where_it_ended(plan, tmp_path, monkeypatch, in_process):
    """All at first, then what the file lacks, then nothing."""
    study = plan(QUICK + "machine: {rod_mass_kg: [3, 4.7]}\n")
    seen = []
    first = judge_machines(study, tmp_path / "out", 1, lambda *told: seen.append(told[:2]))
    assert seen == [(0, 2), (1, 2), (2, 2)]
    assert (first["status"] == "ok").all()
    assert len(np.unique(first["margin"].sel(claim=6))) == 2

    path = tmp_path / "out" / "some.nc"
    whole = read_machines(path)
    kept = rows_of(whole)
    last = str(whole["key"].values[1])
    part = {key: row for key, row in kept.items() if key != last}
    write_dataset(path, machines_dataset(study, whole["key"].values.tolist(), part))

    tasks = []

    def run(work, jobs, *rest):
        tasks.append([number for number, *_ in jobs])
        yield from (JobResult(number, work(case), 0.1) for number, case, _ in jobs)

    monkeypatch.setattr(machine_study, "run_here", run)
    again = judge_machines(study, tmp_path / "out", 2)
    xr.testing.assert_identical(again, first)
    xr.testing.assert_identical(read_machines(path), whole)
    judge_machines(replace(study, title="Unit 3"), tmp_path / "out", 2)
    assert tasks == [[1], []]
    assert about_machine(read_machines(path)) == ["Unit 3", ""]


def test_other_files_are_not_overwritten(plan, tmp_path):
    study = plan(QUICK)
    write_dataset(
        tmp_path / "some.nc", machines_dataset(study, ["a"], {}).drop_vars("share_margin")
    )
    with pytest.raises(StoreError, match="is no file of judged machines"):
        judge_machines(study, tmp_path, 2)

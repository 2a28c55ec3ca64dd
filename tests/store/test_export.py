"""Results for other programs: what `compsim export` writes reads back as what is stored."""

import csv
import shutil

import made_jobs
import numpy as np
import pytest
import xarray as xr
from conftest import SHORT, flip

from compressor.metrics import METRICS, SIZES
from compressor.store.export import export
from compressor.store.files import WrongName
from compressor.store.reader import open_study, read_job, read_store


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A grid of four jobs, of which two failed, one is ok and one is missing; two sampled jobs."""
    steps = SHORT | {"max_steps": [5, 10**6]}
    grid = made_jobs.study("grid", steps, joint="both", clearance_mm=[0.1, 0.2])
    listed = made_jobs.study(
        "list", SHORT | {"duration_rev": 1}, joint="big_end", clearance_mm=0.1, sample={"n": 2},
        machine={"speed_rpm": {"lhs": [400, 600]}}, output={"precision": "single"},
        body=True, sensor=True,
    )  # fmt: skip
    folder = tmp_path_factory.mktemp("export")
    made_jobs.fill(folder, grid, listed, skip=(3,))
    return folder


def table(path):
    """The rows of a CSV file by header."""
    with open(path, newline="", encoding="utf-8") as file:
        return [*csv.DictReader(file)]


def number(cell):
    return float(cell) if cell else np.nan


def test_metrics_in_csv_are_the_stored_ones_to_the_bit(results, tmp_path):
    assert export(results, ["grid"], tmp_path / "grid.csv") == (4, "job")
    rows = table(tmp_path / "grid.csv")
    study = open_study(results, "grid")
    for row in rows:
        where = {"clearance_mm": float(row["clearance_mm"]), "max_steps": int(row["max_steps"])}
        job = study.sel(where)
        assert row["status"] == job.status
        assert row["reason"] == job.reason
        assert row["key"] == job.key
        for name, (_, dims, unit, *_) in METRICS.items():
            ending = "" if unit == "1" else f" [{unit}]"
            for index in np.ndindex(*(SIZES[dim] for dim in dims)):
                labels = [str(job[dim].values[i]) for dim, i in zip(dims, index, strict=True)]
                cell = row["_".join([name, *labels]) + ending]
                np.testing.assert_array_equal(number(cell), job[name].values[index])
    assert sorted(row["status"] for row in rows) == ["failed", "failed", "missing", "ok"]


def test_a_study_and_a_job_are_written_by_xarray(results, tmp_path):
    """What the CHANGELOG names in place of an export in netCDF."""
    study = open_study(results, "grid")
    key = str(study["key"].values[(study.status == "ok").values][0])
    alike = {*METRICS} - {"peak_acceleration", "peak_contact_force"}  # the rest is as these are
    for name, whole in (("study", study), ("job", read_job(results, key))):
        made = whole.drop_vars(alike, errors="ignore")
        made.to_netcdf(tmp_path / f"{name}.nc")
        with xr.open_dataset(tmp_path / f"{name}.nc") as found:
            xr.testing.assert_equal(found, made)


def test_studies_together_have_a_dimension_of_jobs(results, tmp_path):
    export(results, [], tmp_path / "all.csv")
    rows, study = table(tmp_path / "all.csv"), open_study(results)
    assert [row["key"] for row in rows] == study.key.values.tolist()
    assert [row["study"] for row in rows] == ["grid"] * 4 + ["list"] * 2
    assert [number(row["speed_rpm"]) for row in rows] == study.speed_rpm.values.tolist()


@pytest.mark.parametrize(("name", "lacks"), [("grid", ""), ("list", "no column tacho: its sensor")])
def test_series_read_back_to_the_bit(results, name, lacks, tmp_path, compsim):
    study = open_study(results, name)
    key = str(study["key"].values[(study.status == "ok").values][0])
    assert lacks in compsim("export", key[:12], "-r", results, "-o", tmp_path / "job.csv").err
    job, rows = read_job(results, key), table(tmp_path / "job.csv")
    expected = {
        "time [s]": job.time,
        "acceleration [m/s2]": job.acceleration,
        "contact_force_big_end_x [N]": job.contact_force.sel(joint="big_end", axis="x"),
        "penetration_small_end [m]": job.penetration.sel(joint="small_end"),
    }
    assert next(iter(rows[0])) == "time [s]"
    for header, values in expected.items():
        found = [number(row[header]) for row in rows][: len(values)]  # a sensor's record is longer
        np.testing.assert_array_equal(found, values.values)


def test_damaged_series_are_told(results, tmp_path, compsim):
    stored = read_store(shutil.copytree(results, tmp_path / "results"))
    key = min(stored.keys())
    path, _ = stored.batch_of(stored.position(key))
    flip(path, stored.values(key, ["acceleration"])["acceleration"])
    err = compsim("export", key, "-r", tmp_path / "results", "-o", tmp_path / "x.csv", code=5).err
    assert f"{path}: is damaged" in err


def test_a_table_takes_no_other_s_place_unless_forced(results, tmp_path):
    (tmp_path / "grid.csv").touch()
    with pytest.raises(WrongName, match=r"grid\.csv: exists; --force replaces it"):
        export(results, ["grid"], tmp_path / "grid.csv")
    with pytest.raises(WrongName, match="has studies, or one job; export each job to a file of"):
        export(results, ["grid", "0a1b"], tmp_path / "two.csv")
    export(results, ["grid"], tmp_path / "grid.csv", force=True)
    assert len(table(tmp_path / "grid.csv")) == 4

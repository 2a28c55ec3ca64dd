"""Results for other programs: what `compsim export` writes reads back as what is stored."""

import csv
import shutil

import numpy as np
import pytest
import xarray as xr
from conftest import flip, keep, write_cases

from compressor.cases.load import load_studies
from compressor.metrics import METRICS, SIZES
from compressor.solve.simulate import simulate
from compressor.store.export import export
from compressor.store.files import StoreError, WrongName
from compressor.store.reader import open_study, read_job, read_store
from compressor.store.studies import write_study

SHORT = {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9}
GRID = {"joint": "both", "clearance_mm": [0.1, 0.2], "solve": SHORT | {"max_steps": [5, 10**6]}}
LIST = {
    "joint": "big_end",
    "clearance_mm": 0.1,
    "machine": {"speed_rpm": {"lhs": [400, 600]}},
    "sample": {"n": 2},
    "solve": SHORT,
    "output": {"precision": "single"},
}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A grid of four jobs, of which two failed, one is ok and one is missing; two sampled jobs."""
    place = tmp_path_factory.mktemp("export")
    folder = place / "results"
    for study in load_studies(*write_cases(place, grid=GRID, list=LIST)):
        write_study(folder, study, "compsim run")
        keep(folder, *(simulate(case) for n, case in enumerate(study.cases) if n != 3))
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
    for name, made in (("study", study), ("job", read_job(results, key))):
        made.to_netcdf(tmp_path / f"{name}.nc")
        with xr.open_dataset(tmp_path / f"{name}.nc") as found:
            xr.testing.assert_equal(found, made)


def test_studies_together_have_a_dimension_of_jobs(results, tmp_path):
    export(results, [], tmp_path / "all.csv")
    rows, study = table(tmp_path / "all.csv"), open_study(results)
    assert [row["key"] for row in rows] == study.key.values.tolist()
    assert [row["study"] for row in rows] == ["grid"] * 4 + ["list"] * 2
    assert [number(row["speed_rpm"]) for row in rows] == study.speed_rpm.values.tolist()


@pytest.mark.parametrize("name", ["grid", "list"])
def test_series_read_back_to_the_bit(results, name, tmp_path):
    (key, *_) = (k for k in open_study(results, name).key.values.flat if stored(results, k))
    export(results, [key[:12]], tmp_path / "job.csv")
    job = read_job(results, key)
    rows = table(tmp_path / "job.csv")
    expected = {
        "time [s]": job.time,
        "acceleration [m/s2]": job.acceleration,
        "contact_force_big_end_x [N]": job.contact_force.sel(joint="big_end", axis="x"),
        "penetration_small_end [m]": job.penetration.sel(joint="small_end"),
    }
    assert next(iter(rows[0])) == "time [s]"
    for header, values in expected.items():
        np.testing.assert_array_equal([number(row[header]) for row in rows], values.values)


def stored(results, key):
    try:
        return "time" in read_job(results, key).dims
    except StoreError:
        return False


@pytest.mark.parametrize(
    ("names", "file", "message"),
    [
        (["grid", "KEY"], "x.csv", "x.csv: has studies, or one job; export each job to a file"),
        (["grid"], "x.xls", "x.xls: is no name of a CSV file; end it in .csv"),
        (["grid"], "grid.csv", "grid.csv: exists; --force replaces it"),
    ],
)
def test_what_does_not_fit_is_refused(results, names, file, message, tmp_path):
    key = open_study(results, "list").key.values[0]
    names = [key if name == "KEY" else name for name in names]
    (tmp_path / "grid.csv").touch()
    with pytest.raises(WrongName, match=message):
        export(results, names, tmp_path / file)
    assert [path.name for path in tmp_path.iterdir()] == ["grid.csv"]
    export(results, ["grid"], tmp_path / "grid.csv", force=True)
    assert len(table(tmp_path / "grid.csv")) == 4


def test_damaged_jobs_are_told(results, tmp_path, compsim):
    """Damaged series are an error; a damaged batch leaves its jobs out of a study's table."""
    copy = tmp_path / "results"
    shutil.copytree(results, copy)
    stored = read_store(copy)
    hurt = min(stored.keys())
    path, _ = stored.batch_of(stored.position(hurt))
    whole = flip(path, stored.values(hurt, ["acceleration"])["acceleration"])
    err = compsim("export", hurt, "-r", copy, "-o", tmp_path / "x.csv", code=5).err
    assert f"{path}: is damaged" in err
    path.write_bytes(whole[:-1])
    err = compsim("export", "-r", copy, "-o", tmp_path / "x.csv").err
    assert f"{path}: is damaged" in " ".join(err.split())
    found = {row["key"]: row["status"] for row in table(tmp_path / "x.csv")}
    assert found[hurt] == "missing"

"""The store: files that others read, that are whole or absent, and studies as labelled data."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from compressor import labels, store
from compressor.case import Case, table
from compressor.plan import load_studies
from compressor.schema import METRICS
from compressor.simulation import simulate

SHORT = {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9}


def study(name, solve=SHORT, **values):
    """A study of given values, lists being swept, by way of a case file (JSON is YAML)."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"{name}.yaml")
        path.write_text(json.dumps({"solve": solve, **values}))
        return load_studies(path)[0]


def fill(folder, *studies, skip=()):
    """Store studies and all their jobs, but for the jobs at some positions."""
    for one in studies:
        store.write_study(folder, one, "by hand")
        for number, case in enumerate(one.cases):
            if number not in skip:
                store.write_job(folder, simulate(case))


JOBS = {
    "ok": {},
    "metrics": {"output": {"keep": "metrics"}},
    "failed": {"joint": "both", "clearance_mm": 0.1, "solve": {**SHORT, "max_steps": 5}},
}


@pytest.fixture(scope="module", params=list(JOBS))
def job(request):
    return simulate(Case.from_values({"solve": SHORT, **JOBS[request.param]}))


@pytest.fixture(scope="module")
def ideal():
    return simulate(Case.from_values({"solve": SHORT}))


# ---- one job ------------------------------------------------------------------------------------


def test_a_job_comes_back_identical(job, tmp_path):
    path = store.write_job(tmp_path, job)
    xr.testing.assert_identical(store.read_job(tmp_path, job.attrs["key"]), job)
    xr.testing.assert_identical(xr.open_dataset(path, engine="h5netcdf"), job)


def test_numbers_keep_their_kind_and_every_bit(ideal, tmp_path):
    store.write_job(tmp_path, ideal)
    back = store.read_job(tmp_path, ideal.attrs["key"])
    for name, item in ideal.variables.items():
        if item.dtype.kind in "fi":
            assert back[name].dtype == item.dtype, name
            assert back[name].values.tobytes() == item.values.tobytes(), name


def test_ncdump_reads_a_job(job, tmp_path):
    if not shutil.which("ncdump"):
        pytest.skip("ncdump is not installed (Debian: netcdf-bin)")
    path = store.write_job(tmp_path, job)
    header = subprocess.run(
        ["ncdump", "-h", str(path)], capture_output=True, text=True, check=True
    ).stdout
    assert "joint = 2 ;" in header
    assert "string joint(joint) ;" in header
    assert 'string peak_contact_force:units = "N" ;' in header
    assert "double peak_contact_force_axis(joint, axis) ;" in header
    assert ("double contact_force(time, joint, axis) ;" in header) == ("time" in job.dims)


def test_ten_lines_of_h5py_read_a_job(ideal, tmp_path):
    path = store.write_job(tmp_path, ideal)
    with h5py.File(path) as file:
        force = file["contact_force"]
        dims = [dim[0].name for dim in force.dims]
        joints = list(file["joint"].asstr())
        peak = force[:, joints.index("small_end"), 0].max()
        unit = force.attrs["units"]
        status = file["status"].asstr()[()]
    assert dims == ["/time", "/joint", "/axis"]
    assert (unit, status) == ("N", "ok")
    assert peak == ideal.contact_force.sel(joint="small_end", axis="x").max()


@pytest.mark.parametrize("text", ["", "nul \0 in it", "lone \udc80 surrogate", "Größe µ 漢"])
def test_any_text_can_be_stored(text, ideal, tmp_path):
    store.write_job(tmp_path, ideal.assign_attrs(detail=text))
    back = store.job_status(tmp_path, ideal.attrs["key"]).detail
    assert back == text.replace("\0", "\ufffd").replace("\udc80", "?")


def test_status_of_a_job(job, tmp_path):
    store.write_job(tmp_path, job)
    end = store.job_status(tmp_path, job.attrs["key"])
    assert (end.status, end.reason) == (str(job.status.values), str(job.reason.values))
    assert end.samples == job.sizes.get("time", 0)
    assert end.detail == job.attrs.get("detail", "")
    assert end.timeout == 600


def test_what_is_not_stored_is_no_job(tmp_path):
    key = Case().key
    assert store.job_status(tmp_path, key) is None
    assert not store.has_job(tmp_path, key)
    assert store.finished_keys(tmp_path) == set()
    with pytest.raises(store.StoreError, match="is not stored; run its study first"):
        store.read_job(tmp_path, key)


def test_finished_keys_are_whole_files(ideal, tmp_path):
    store.write_job(tmp_path, ideal)
    for name in (f".{Case().key}.h5.1.tmp", "notes.h5", f"{Case().key}.txt"):
        (tmp_path / "jobs" / name).touch()
    assert store.finished_keys(tmp_path) == {ideal.attrs["key"]}


@pytest.mark.parametrize("key", ["../../etc/passwd", "", "0" * 19, "0" * 21, "G" * 20])
def test_a_key_cannot_lead_out_of_the_store(key, tmp_path):
    with pytest.raises(store.StoreError, match="no job's key"):
        store.job_path(tmp_path, key)


def foreign(path):
    with h5py.File(path, "w") as file:
        file["x"] = 1.0


DAMAGE = {
    "empty": lambda path: path.write_bytes(b""),
    "cut short": lambda path: path.write_bytes(path.read_bytes()[:-1]),
    "cut to half": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "no HDF5": lambda path: path.write_text("not a job"),
    "another's HDF5": foreign,
    "another job's": lambda path: path.write_bytes(
        store._image(xr.Dataset({"status": "ok", "reason": ""}, attrs={"key": "0" * 20}))
    ),
}


@pytest.mark.parametrize("damage", list(DAMAGE))
@pytest.mark.parametrize("read", [store.job_status, store.read_job])
def test_a_damaged_file_is_named_with_a_remedy(damage, read, ideal, tmp_path):
    path = store.write_job(tmp_path, ideal)
    DAMAGE[damage](path)
    with pytest.raises(store.DamagedJob) as error:
        read(tmp_path, ideal.attrs["key"])
    assert str(path) in str(error.value)
    assert "run its study again" in str(error.value)
    assert store.known_status(tmp_path, ideal.attrs["key"]) is None


# ---- durability ---------------------------------------------------------------------------------

DYING_WRITER = """
    import os, signal, sys
    from compressor import labels, store
    folder, key, call = sys.argv[1:]
    dataset = store.read_job(folder, key).load()
    real, calls = getattr(os, call), []
    def dying(*arguments):
        os.kill(os.getpid(), signal.SIGKILL)
    setattr(os, call, dying)
    store.write_job(folder, dataset.assign_attrs(detail="the second writing"))
"""


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_killed_writer_leaves_the_old_file_whole(call, ideal, tmp_path):
    key = ideal.attrs["key"]
    store.write_job(tmp_path, ideal.assign_attrs(detail="the first writing"))
    writer = [sys.executable, "-c", textwrap.dedent(DYING_WRITER), str(tmp_path), key, call]
    assert subprocess.run(writer).returncode == -signal.SIGKILL
    assert store.job_status(tmp_path, key).detail == "the first writing"
    assert store.finished_keys(tmp_path) == {key}


def test_old_leftovers_are_removed_and_young_ones_kept(ideal, tmp_path):
    folder = store.write_job(tmp_path, ideal).parent
    old, young = folder / ".a.h5.1.tmp", folder / ".b.h5.2.tmp"
    for path in (old, young):
        path.touch()
    os.utime(old, (0, 0))
    store.discard_leftovers(tmp_path)
    assert (old.exists(), young.exists()) == (False, True)
    assert store.has_job(tmp_path, ideal.attrs["key"])


def test_file_and_folders_are_synced(ideal, tmp_path, monkeypatch):
    synced, real = [], os.fsync
    monkeypatch.setattr(
        os, "fsync", lambda fd: (synced.append(os.readlink(f"/proc/self/fd/{fd}")), real(fd))
    )
    store.write_job(tmp_path / "new", ideal)
    assert [path for path in synced if path.endswith(".tmp")]
    for folder in (tmp_path, tmp_path / "new", tmp_path / "new" / "jobs"):
        assert str(folder) in synced
    assert synced[-1] == str(tmp_path / "new" / "jobs")  # after the file has its name


@pytest.mark.parametrize("call", ["fsync", "replace"])
@pytest.mark.parametrize(
    ("number", "remedy"),
    [
        (errno.ENOSPC, "free some space"),
        (errno.EROFS, "permission"),
        (errno.EACCES, "permission"),
        (errno.EIO, "check the disk"),
    ],
)
def test_file_system_errors_have_a_remedy(call, number, remedy, ideal, tmp_path, monkeypatch):
    def refuse(*arguments):
        raise OSError(number, os.strerror(number))

    store.write_job(tmp_path, ideal)
    monkeypatch.setattr(os, call, refuse)
    with pytest.raises(store.StoreError) as error:
        store.write_job(tmp_path, ideal.assign_attrs(detail="new"))
    monkeypatch.undo()
    assert os.strerror(number) in str(error.value)
    assert remedy in str(error.value)
    assert store.job_status(tmp_path, ideal.attrs["key"]).detail == ""
    assert list(tmp_path.glob("jobs/.*")) == []


def test_a_file_where_a_folder_is_needed(ideal, tmp_path):
    (tmp_path / "results").write_text("mine")
    with pytest.raises(store.StoreError, match="is a file, where a folder is needed"):
        store.write_job(tmp_path / "results", ideal)


# ---- studies ------------------------------------------------------------------------------------


def test_a_study_is_stored_and_found(tmp_path):
    one = study("speeds", machine={"speed_rpm": [300, 500]}, load=["design", "none"])
    store.write_study(tmp_path, one, "compsim run speeds.yaml")
    (found,) = store.read_studies(tmp_path)
    assert (found.name, found.command) == ("speeds", "compsim run speeds.yaml")
    assert found.keys == tuple(case.key for case in one.cases)
    assert [(axis.key, axis.values, axis.units) for axis in found.axes] == [
        ("machine.speed_rpm", (300, 500), "rpm"),
        ("load", ("design", "none"), ""),
    ]
    assert list(store.points(found.axes))[1] == {"machine.speed_rpm": 300, "load": "none"}


def test_storing_a_study_again_leaves_its_file_alone(tmp_path):
    pairs = [["steel", "steel"], ["steel", "copper"]]
    one = study("pairs", contact={"materials": pairs})
    store.write_study(tmp_path, one, "first")
    before = (tmp_path / "studies/pairs.json").stat().st_mtime_ns
    store.write_study(tmp_path, one, "second")
    assert (tmp_path / "studies/pairs.json").stat().st_mtime_ns == before
    store.write_study(tmp_path, study("pairs", contact={"materials": pairs[:1]}), "third")
    assert store.read_studies(tmp_path)[0].command == "third"


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"axes": [], "keys": []}', "\xff"])
def test_a_damaged_study_is_named_with_a_remedy(text, tmp_path):
    store.write_study(tmp_path, study("one"))
    (tmp_path / "studies/one.json").write_text(text, encoding="latin-1")
    with pytest.raises(store.StoreError, match=r"one\.json.*delete it and run its case file again"):
        store.read_studies(tmp_path)


def test_an_empty_folder_says_what_to_do(tmp_path):
    with pytest.raises(store.StoreError, match="compsim run CONFIG"):
        store.open_study(tmp_path / "results")


@pytest.mark.parametrize(
    ("keys", "names"),
    [
        (["machine.rod_mass_kg"], ["rod_mass_kg"]),
        (["joint", "clearance_mm"], ["fault", "clearance_mm"]),
        (["gas.exponent", "contact.exponent"], ["gas_exponent", "contact_exponent"]),
        (["clearance_mm.big_end"], ["clearance_mm_big_end"]),
        (["initial_offset_mm.big_end_x"], ["initial_offset_mm_big_end_x"]),
    ],
)
def test_names_of_coordinates(keys, names):
    assert list(labels.coordinate_names(keys).values()) == names


def test_no_coordinate_hides_what_a_job_holds(ideal):
    names = {name for key in table() for name in labels.coordinate_names([key]).values()}
    assert names & {*ideal.variables, "key", "study", "job", "sample"} == set()


# ---- labelled data ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    """A 2 x 2 study of ideal joints; the last job is missing."""
    folder = tmp_path_factory.mktemp("grid")
    one = study("grid", load=["design", "none"], machine={"rod_mass_kg": [4, 5]})
    fill(folder, one, skip=(3,))
    return folder, one


def test_one_study_has_its_axes_as_dimensions(grid):
    folder, one = grid
    found = store.open_study(folder)
    assert found.key.dims == ("load", "rod_mass_kg")
    assert found.key.values.ravel().tolist() == [case.key for case in one.cases]
    assert found.rod_mass_kg.attrs["units"] == "kg"
    assert found.status.values.tolist() == [["ok", "ok"], ["ok", "missing"]]
    assert np.isnan(found.peak_acceleration.values).tolist() == [[False, False], [False, True]]
    assert set(METRICS) <= set(found)
    for name in found:
        assert found[name].attrs["long_name"], name


def test_a_series_is_that_of_its_job(grid):
    folder, one = grid
    found = store.open_study(folder).sel(load="none", rod_mass_kg=4)
    job = store.read_job(folder, one.cases[2].key)
    assert found.contact_force.dims == ("time", "joint", "axis")
    for name in ("time", "acceleration", "contact_force", "penetration"):
        assert found[name].attrs == job[name].attrs
        assert found[name].values.tobytes() == job[name].values.tobytes()


def test_only_the_job_asked_for_is_read(grid, monkeypatch):
    folder, one = grid
    read, real = [], labels.StudySeries._block
    monkeypatch.setattr(
        labels.StudySeries, "_block", lambda self, key: read.append(key) or real(self, key)
    )
    found = store.open_study(folder)
    assert found.acceleration.sizes["time"] == 101
    assert repr(found)
    assert read == []
    float(found.acceleration.sel(load="design", rod_mass_kg=5).max())
    assert read == [one.cases[1].key]


@pytest.mark.parametrize(
    "index",
    [
        (0, 1, 7),
        (slice(None), slice(None, None, -1), slice(100, None, -7)),
        (1, 1, slice(3)),
        ([1, 0], 0, [5, 2, 2]),
        (slice(0, 0), 0, slice(None)),
    ],
)
def test_lazy_indexing_is_numpy_s(grid, index):
    found = store.open_study(grid[0]).acceleration
    whole = xr.DataArray(found.values, dims=found.dims)
    assert found.shape == (2, 2, 101)
    assert np.array_equal(found[index].values, whole[index].values, equal_nan=True)


def test_different_time_grids_are_padded(tmp_path):
    solve = {"duration_rev": 1, "settle_rev": 0, "output_step_s": 1e-3}
    one = study("speeds", solve, machine={"speed_rpm": [300, 500]})
    fill(tmp_path, one)
    found = store.open_study(tmp_path)
    assert found.acceleration.dims == found.time.dims == ("speed_rpm", "sample")
    assert found.sizes["sample"] == 201
    slow, fast = found.time.values
    assert (slow[-1], fast[120]) == (0.2, 0.12)
    assert np.isnan(fast[121:]).all()
    assert np.isnan(found.acceleration.sel(speed_rpm=500)[121:]).all()
    assert np.isfinite(found.acceleration.sel(speed_rpm=500)[:121]).all()


def test_several_studies_have_jobs_with_coordinates(grid, tmp_path):
    shutil.copytree(grid[0], tmp_path, dirs_exist_ok=True)
    fill(tmp_path, study("faults", joint=["none", "both"], clearance_mm=[0.1]), skip=(0,))
    found = store.open_study(tmp_path)
    assert found.study.values.tolist() == ["faults"] * 2 + ["grid"] * 4
    assert found.fault.values.tolist() == ["none", "both"] + ["none"] * 4
    assert found["load"].values.tolist()[1:5] == ["design", "design", "design", "none"]
    assert found.rod_mass_kg.values.tolist() == [4.7, 4.7, 4, 5, 4, 5]
    assert found.clearance_mm.values[:2].tolist() == [0.1, 0.1]
    assert found.acceleration.dims == ("job", "time")
    assert store.open_study(tmp_path, "grid").key.shape == (2, 2)
    with pytest.raises(store.StoreError, match=r"'gird'.*it holds faults, grid"):
        store.open_study(tmp_path, "gird")


def test_a_study_of_one_job_has_no_axes(ideal, tmp_path):
    one = study("alone", output={"keep": "metrics"})
    fill(tmp_path, one)
    found = store.open_study(tmp_path)
    assert found.peak_acceleration.dims == ()
    assert found.peak_contact_force.dims == ("joint",)
    assert "acceleration" not in found


def test_failed_jobs_have_a_reason_and_no_metrics(tmp_path):
    fill(
        tmp_path,
        study("budgets", SHORT | {"max_steps": [5, 100000]}, joint="both", clearance_mm=0.1),
    )
    found = store.open_study(tmp_path)
    assert found.reason.values.tolist() == ["budget_steps", ""]
    assert np.isnan(found.peak_acceleration.values).tolist() == [True, False]
    assert np.isfinite(found.acceleration.sel(max_steps=5)[0])
    assert np.isnan(found.acceleration.sel(max_steps=5)[-1])


def test_a_study_without_any_job_is_all_missing(tmp_path):
    store.write_study(tmp_path, study("planned", clearance_mm=[0.1, 0.2], joint=["both"]))
    found = store.open_study(tmp_path)
    assert found.status.values.tolist() == [["missing"], ["missing"]]
    assert found.clearance_mm.attrs["units"] == "mm"

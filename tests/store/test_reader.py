"""The store: files that others read, that are whole or absent, and studies as labelled data."""

import errno
import io
import itertools
import json
import os
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from conftest import keep, write_named

from compressor.cases.case import Case
from compressor.cases.groups import Output
from compressor.cases.load import load_studies
from compressor.cases.study import points
from compressor.cases.table import table
from compressor.metrics import METRICS
from compressor.solve.simulate import simulate
from compressor.store import dataset as labels
from compressor.store import hdf5
from compressor.store import reader as store
from compressor.store.files import StoreError, StoreWarning, discard_leftovers
from compressor.store.hdf5 import DamagedJob
from compressor.store.series_file import (
    read_series,
    read_values,
    series_image,
    series_path,
    write_series,
)
from compressor.store.studies import encode, find_job, read_studies, write_study

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
        write_study(folder, one, "by hand")
        keep(folder, *(simulate(c) for n, c in enumerate(one.cases) if n not in skip))


JOBS = {
    "ok": {},
    "metrics": {"output": {"keep": "metrics"}},
    "failed": {"joint": "both", "clearance_mm": 0.1, "solve": {**SHORT, "max_steps": 5}},
    "failed metrics": {
        "joint": "both", "clearance_mm": 0.1, "solve": {**SHORT, "max_steps": 5},
        "output": {"keep": "metrics"},
    },
}  # fmt: skip


@pytest.fixture(scope="module", params=list(JOBS))
def job(request):
    return simulate(Case.from_values({"solve": SHORT, **JOBS[request.param]}))


@pytest.fixture(scope="module")
def ideal():
    return simulate(Case.from_values({"solve": SHORT}))


def file_of(folder, dataset):
    """The file with a stored job's time series."""
    (path,) = folder.glob(f"jobs/{dataset.attrs['key']}-*.h5")
    return path


# ---- one job ------------------------------------------------------------------------------------


def test_a_job_comes_back_identical(job, tmp_path):
    keep(tmp_path, job)
    assert job.regime.item() == job.attrs["regime"]
    assert job.promise.item() == job.attrs["promise"]
    xr.testing.assert_identical(store.read_job(tmp_path, job.attrs["key"]), job)
    if "time" in job.dims:
        path = file_of(tmp_path, job)
        xr.testing.assert_identical(xr.open_dataset(path, engine="h5netcdf"), job)


def test_numbers_keep_their_kind_and_every_bit(ideal, tmp_path):
    keep(tmp_path, ideal)
    back = store.read_job(tmp_path, ideal.attrs["key"])
    for name, item in ideal.variables.items():
        if item.dtype.kind in "fi":
            assert back[name].dtype == item.dtype, name
            assert back[name].values.tobytes() == item.values.tobytes(), name


def test_ncdump_reads_a_job_and_a_segment(job, ncdump, tmp_path):
    if "time" in job.dims:
        write_named(tmp_path, job, Output(precision="single", compress=True))
        name = file_of(tmp_path, job)
        text = ncdump("-v", "acceleration", name)
        assert "joint = 2 ;" in text
        assert "string joint(joint) ;" in text
        assert '\tpeak_contact_force:units = "N" ;' in text
        assert "double peak_contact_force_axis(joint, axis) ;" in text
        assert "float contact_force(time, joint, axis) ;" in text
    keep(tmp_path, job)
    (rows,) = tmp_path.glob("rows/*.h5")
    header = ncdump("-h", rows)
    assert "row = 1 ;" in header
    assert "double peak_contact_force(row, joint) ;" in header


def test_ten_lines_of_h5py_read_a_job(ideal, tmp_path):
    keep(tmp_path, ideal)
    with h5py.File(file_of(tmp_path, ideal)) as file:
        force = file["contact_force"]
        dims = [dim[0].name for dim in force.dims]
        joints = list(file["joint"].asstr())
        peak = force[:, joints.index("small_end"), 0].max()
        unit = force.attrs["units"].decode()
        status = file["status"].asstr()[()]
    assert dims == ["/time", "/joint", "/axis"]
    assert (unit, status) == ("N", "ok")
    assert peak == ideal.contact_force.sel(joint="small_end", axis="x").max()


@pytest.mark.parametrize("compress", [False, True])
def test_single_precision_rounds_series_alone(compress, ideal, tmp_path):
    full = write_named(tmp_path / "double", ideal, Output())
    path = write_named(tmp_path, ideal, Output(precision="single", compress=compress))
    back = xr.open_dataset(path, engine="h5netcdf")
    assert path.stat().st_size < full.stat().st_size or compress  # chunks cost a small file more
    for name, item in ideal.variables.items():
        rounded = "time" in item.dims and name not in ("time", "crank_angle")
        expected = item.values.astype("f4") if rounded else item.values
        np.testing.assert_array_equal(back[name].values, expected)
    with h5py.File(path) as file:
        assert (file["acceleration"].compression == "gzip") == compress
        assert file["acceleration"].shuffle == compress


def test_compression_loses_nothing(ideal, tmp_path):
    output = {"output": {"compress": True}}
    packed = ideal.assign_attrs(case=json.dumps(json.loads(ideal.attrs["case"]) | output))
    keep(tmp_path, packed)
    xr.testing.assert_identical(store.read_job(tmp_path, ideal.attrs["key"]), packed)


@pytest.mark.parametrize("text", ["", "nul \0 in it", "lone \udc80 surrogate", "Größe µ 漢"])
@pytest.mark.parametrize("kept", ["series", "metrics"])
def test_any_text_can_be_stored(kept, text, ideal, tmp_path):
    dataset = ideal if kept == "series" else ideal.drop_dims("time")
    bad = dataset.assign(status="failed").assign_attrs(detail=text)
    keep(tmp_path, bad)
    assert store.read_store(tmp_path).status(ideal.attrs["key"]).detail == text
    assert store.read_job(tmp_path, ideal.attrs["key"]).attrs["detail"] in (
        text,
        text.replace("\0", "\ufffd").replace("\udc80", "?"),
    )


def test_status_of_a_job(job, tmp_path):
    keep(tmp_path, job)
    end = store.read_store(tmp_path).status(job.attrs["key"])
    assert (end.status, end.reason) == (str(job.status.values), str(job.reason.values))
    assert end.samples == job.sizes.get("time", 0)
    assert end.detail == job.attrs.get("detail", "")
    assert end.numbers["steps"] == job.steps


def test_what_is_not_stored_is_no_job(tmp_path):
    key = Case().key
    assert store.read_store(tmp_path).status(key) is None
    assert store.read_store(tmp_path).keys() == set()
    with pytest.raises(StoreError, match="is not stored; run its study first"):
        store.read_job(tmp_path, key)


def test_a_job_without_row_is_not_stored_and_one_without_file_has_its_metrics(ideal, tmp_path):
    write_named(tmp_path, ideal, Output())
    assert store.read_store(tmp_path).keys() == set()
    keep(tmp_path, ideal)
    assert store.read_store(tmp_path).status(ideal.attrs["key"]).samples == ideal.sizes["time"]
    file_of(tmp_path, ideal).unlink()
    end = store.read_store(tmp_path).status(ideal.attrs["key"])
    assert (end.status, end.samples) == ("ok", 0)
    assert end.numbers["steps"] == ideal.steps


@pytest.mark.parametrize("key", ["../../etc/passwd", "", "0" * 19, "0" * 21, "G" * 20])
def test_a_key_cannot_lead_out_of_the_store(key, ideal, tmp_path):
    with pytest.raises(StoreError, match="key is 20 hexadecimal digits"):
        store.read_job(tmp_path, key)
    with pytest.raises(StoreError, match="key is 20 hexadecimal digits"):
        write_series(tmp_path, ideal.assign_attrs(key=key), Output())


SERVING = [  # output of what is stored, its reason, output of the case, serves
    ("series", "double", "", "metrics", "double", True),
    ("metrics", "double", "", "series", "double", False),
    ("series", "single", "", "series", "double", False),
    ("series", "double", "", "series", "single", True),
    ("metrics", "double", "budget_steps", "metrics", "double", True),
    ("metrics", "double", "budget_seconds", "metrics", "double", False),
    ("metrics", "double", "internal_error", "series", "double", True),
    ("metrics", "double", "worker_died", "series", "double", True),
    ("metrics", "double", "out_of_memory", "series", "double", True),
]


def stored_as(row, ideal, folder, key):
    """Store a job under a key as a row of SERVING says."""
    keeps, precision, reason, *_ = row
    text = json.dumps(Case.resolve({"output": {"keep": keeps, "precision": precision}}).values())
    dataset = ideal if keeps == "series" else ideal.drop_dims("time")
    dataset = dataset.assign(status="failed" if reason else "ok", reason=reason)
    keep(folder, dataset.assign_attrs(case=text, key=key))


@pytest.mark.parametrize("row", SERVING)
def test_what_a_stored_job_serves(row, ideal, tmp_path):
    *_, asks, exact, serves = row
    stored_as(row, ideal, tmp_path, ideal.attrs["key"])
    case = Case.resolve({"output": {"keep": asks, "precision": exact}})
    assert store.read_store(tmp_path).status(ideal.attrs["key"]).satisfies(case) == serves


def test_many_jobs_serve_as_each_does(ideal, tmp_path):
    """Jobs of one kind are asked once, and kinds differ in all that decides."""
    for number, row in enumerate([*SERVING, *SERVING[::2]]):
        stored_as(row, ideal, tmp_path, f"{number:020x}")
    barless = Case.from_values({"solve": SHORT | {"error_bars": False}})
    keep(tmp_path, simulate(barless))
    stored, told = store.read_store(tmp_path), set()
    positions = np.arange(len(stored.rows))[::-1]
    for keeps, precision, bars in itertools.product(
        ("series", "metrics"), ("double", "single"), (True, False)
    ):
        output = {"keep": keeps, "precision": precision}
        case = Case.resolve({"output": output, "solve": {"error_bars": bars}})
        each = [stored.status_at(position).satisfies(case) for position in positions]
        assert stored.serving(positions, case).tolist() == each
        told |= {*each}
    assert told == {True, False}
    assert stored.serving(positions[:0], case).tolist() == []


# ---- what a file may hold -----------------------------------------------------------------------


def linked(file, kind):
    file["x"] = kind


def filtered(file):
    data = np.zeros(100)
    file.create_dataset("x", data=data, chunks=(10,), scaleoffset=3)


def virtual(file):
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource("/etc/passwd", "x", (3,))
    file.create_virtual_dataset("x", layout)


FOREIGN = {
    "soft link": lambda file: linked(file, h5py.SoftLink("/status")),
    "external link": lambda file: linked(file, h5py.ExternalLink("/etc/passwd", "/")),
    "group": lambda file: file.create_group("x"),
    "external storage": lambda file: file.create_dataset(
        "x", (3,), "u1", external=[("/etc/passwd", 0, 3)]
    ),
    "virtual dataset": virtual,
    "foreign filter": filtered,
    "references": lambda file: file.create_dataset("x", data=file.ref, dtype=h5py.ref_dtype),
    "compound": lambda file: file.create_dataset("x", data=np.zeros(2, "i4,f8")),
    "opaque": lambda file: file.create_dataset("x", data=np.void(b"pickle")),
    "bomb": lambda file: file.create_dataset("x", (10**12,), "f8"),
}


def changed(dataset, change):
    """The bytes of a job's file after a change to what it holds."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_named(Path(folder), dataset, Output())
        with h5py.File(path, "a") as file:
            change(file)
        return path.read_bytes()


def planted(folder, dataset, data):
    """Store a job whose file holds other bytes, with a digest that fits."""
    keep(folder, dataset)
    path = file_of(folder, dataset)
    path.unlink()
    new = series_path(folder, dataset.attrs["key"], hdf5.digest(data))
    new.write_bytes(data)
    return new


@pytest.mark.parametrize("change", list(FOREIGN))
def test_what_a_file_must_not_hold_is_refused(change, ideal, tmp_path):
    path = planted(tmp_path, ideal, changed(ideal, FOREIGN[change]))
    for read in (read_series, lambda path: read_values(path, ["acceleration", "x"])):
        with pytest.raises(DamagedJob, match=r"is refused: x .*; run its study again"):
            read(path)
    (alone,) = read_values(path, ["acceleration", "absent"]).values()  # HDF5 meets no x
    np.testing.assert_array_equal(alone, ideal.acceleration)


@pytest.mark.parametrize(
    ("shift", "value"),
    [(4, 8), (4, 2**31), (12, 99), (-16, 39)],
    ids=["no heap", "a heap beyond the end", "no item", "a heap without items"],
)
def test_a_text_that_is_not_where_it_says_is_refused(shift, value, ideal, tmp_path):
    data = bytearray(series_image(ideal, Output()))
    with h5py.File(io.BytesIO(data)) as file:
        start = file["joint"].id.get_offset()
        heap = int.from_bytes(data[start + 4 : start + 12], "little")
    at = start + shift if shift >= 0 else heap + 24
    data[at : at + 4] = value.to_bytes(4, "little")
    with pytest.raises(DamagedJob, match="is no finished job of compsim"):
        read_series(planted(tmp_path, ideal, bytes(data)))


SCHEMA = {
    "another's HDF5": lambda file: [file.__delitem__(name) for name in list(file)],
    "another job's": lambda file: file.attrs.__setitem__("key", np.bytes_("0" * 20)),
    "a text of any length": lambda file: file.attrs.__setitem__("key", file.attrs["key"].decode()),
    "no key": lambda file: file.attrs.__delitem__("key"),
    "no status": lambda file: file.__delitem__("status"),
    "text for numbers": lambda file: (
        file.__delitem__("peak_acceleration"), file.__setitem__("peak_acceleration", "high")
    ),
}  # fmt: skip


@pytest.mark.parametrize("change", list(SCHEMA))
def test_a_file_that_is_no_job_is_refused(change, ideal, tmp_path):
    path = planted(tmp_path, ideal, changed(ideal, SCHEMA[change]))
    with pytest.raises(DamagedJob, match="is no finished job of compsim"):
        read_series(path)


@pytest.mark.parametrize("data", [b"", b"not a job", b"\x89HDF\r\n\x1a\n", b"\x80\x04."])
def test_what_is_no_hdf5_is_refused(data, ideal, tmp_path):
    path = planted(tmp_path, ideal, data)
    with pytest.raises(DamagedJob, match="is no finished job of compsim"):
        read_series(path)


# ---- durability ---------------------------------------------------------------------------------


def test_old_leftovers_are_removed_and_young_ones_kept(ideal, tmp_path):
    keep(tmp_path, ideal)
    old, young = tmp_path / "jobs/.a.h5.1.tmp", tmp_path / "jobs/.b.h5.2.tmp"
    for path in (old, young):
        path.touch()
    os.utime(old, (0, 0))
    discard_leftovers(tmp_path)
    assert (old.exists(), young.exists()) == (False, True)
    assert store.read_store(tmp_path).keys()


def test_file_and_folders_are_synced(ideal, tmp_path, monkeypatch):
    synced, real = [], os.fsync
    monkeypatch.setattr(
        os, "fsync", lambda fd: (synced.append(os.readlink(f"/proc/self/fd/{fd}")), real(fd))
    )
    keep(tmp_path / "new", ideal)
    for name in ("jobs", "rows"):
        folder = str(tmp_path / "new" / name)
        files = [n for n, p in enumerate(synced) if p.startswith(folder) and p.endswith(".tmp")]
        assert len(files) == 1
        assert folder in synced[files[0] :]  # after the file has its name
    assert str(tmp_path) in synced
    assert synced[-1] == str(tmp_path / "new" / "rows")  # the row last


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

    keep(tmp_path, ideal)
    monkeypatch.setattr(os, call, refuse)
    with pytest.raises(StoreError) as error:
        keep(tmp_path, ideal.assign_attrs(detail="new"))
    monkeypatch.undo()
    assert os.strerror(number) in str(error.value)
    assert remedy in str(error.value)
    xr.testing.assert_identical(store.read_job(tmp_path, ideal.attrs["key"]), ideal)
    waiting = [*tmp_path.glob("jobs/.*")]
    assert len(waiting) == (call == "replace")  # written whole; without its name it is no result


@pytest.mark.parametrize("number", [errno.EINVAL, errno.EOPNOTSUPP])
def test_a_folder_that_cannot_be_synced_is_let_pass(number, ideal, tmp_path, monkeypatch):
    real = os.fsync

    def sync(descriptor):
        if os.path.isdir(f"/proc/self/fd/{descriptor}"):
            raise OSError(number, os.strerror(number))
        real(descriptor)

    monkeypatch.setattr(os, "fsync", sync)
    keep(tmp_path / "fuse", ideal)
    assert store.read_store(tmp_path / "fuse").keys() == {ideal.attrs["key"]}


def test_a_file_where_a_folder_is_needed(ideal, tmp_path):
    (tmp_path / "results").write_text("mine")
    with pytest.raises(StoreError, match="is a file, where a folder is needed"):
        keep(tmp_path / "results", ideal)


# ---- studies ------------------------------------------------------------------------------------


def test_a_study_is_stored_and_found(tmp_path):
    one = study("speeds", machine={"speed_rpm": [300, 500]}, load=["spring", "none"])
    write_study(tmp_path, one, "compsim run speeds.yaml")
    (found,) = read_studies(tmp_path)
    assert (found.name, found.command) == ("speeds", "compsim run speeds.yaml")
    assert found.keys == tuple(case.key for case in one.cases)
    assert [(axis.key, axis.values, axis.units) for axis in found.axes] == [
        ("machine.speed_rpm", (300, 500), "rpm"),
        ("load", ("spring", "none"), ""),
    ]
    assert list(points(found))[1] == {"machine.speed_rpm": 300, "load": "none"}


def test_a_study_that_was_stored_with_older_words_has_today_s(tmp_path):
    one = study("loads", load=["spring", "none", "gas"], machine={"gravity_m_per_s2": 9.81})
    write_study(tmp_path, one, "first")
    path, (new,) = tmp_path / "studies/loads.json", read_studies(tmp_path)
    older = replace(new.axes[0], values=("design", "none", "typical"))
    path.write_bytes(encode(replace(new, axes=(older,), fixed={**new.fixed, "load": "design"})))
    before = path.read_bytes()
    assert read_studies(tmp_path) == [new]
    assert find_job(tmp_path, ["loads", "load=typical"], [new], set()) == one.cases[2].key
    assert find_job(tmp_path, ["loads", "load=gas"], [new], set()) == one.cases[2].key
    write_study(tmp_path, one, "second")
    assert path.read_bytes() == before != encode(new)  # the same study


def test_storing_a_study_again_leaves_its_file_alone(tmp_path):
    pairs = [["steel", "steel"], ["steel", "copper"]]
    worn = {"joint": "big_end", "clearance_mm": 0.2}
    one = study("pairs", **worn, contact={"materials": pairs})
    write_study(tmp_path, one, "first")
    before = (tmp_path / "studies/pairs.json").stat().st_mtime_ns
    write_study(tmp_path, one, "second")
    assert (tmp_path / "studies/pairs.json").stat().st_mtime_ns == before
    write_study(tmp_path, study("pairs", **worn, contact={"materials": pairs[:1]}), "third")
    assert read_studies(tmp_path)[0].command == "third"


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"axes": [], "keys": []}', "\xff"])
def test_a_damaged_study_is_named_with_a_remedy(text, tmp_path):
    write_study(tmp_path, study("one"))
    (tmp_path / "studies/one.json").write_text(text, encoding="latin-1")
    with pytest.raises(StoreError, match=r"one\.json.*delete it and run its case file again"):
        read_studies(tmp_path)


@pytest.mark.parametrize(
    "change",
    [
        {"name": "../two"}, {"keys": ("../evil",)}, {"fixed": []}, {"command": 5},
        {"versions": {"compsim": 1}}, {"axes": ({"key": "time", "values": [1.0], "units": ""},)},
        {"axes": ({"key": "load", "values": ["\x1b[31m"], "units": ""},)},
        {"axes": ({"key": "load", "values": [{}], "units": ""},)},
        {"axes": ({"key": "load", "values": ["none"], "units": "\a"},)},
        {"axes": ({"key": "load", "values": ["none"], "units": ""},) * 2},
    ],
    ids=str,
)  # fmt: skip
def test_a_study_that_nobody_wrote_is_refused(change, tmp_path):
    write_study(tmp_path, study("one"))
    path = tmp_path / "studies/one.json"
    plain = json.loads(path.read_text()) | change
    del plain["digest"]
    head = json.dumps(plain, indent=1).removesuffix("\n}").encode()
    path.write_bytes(head + f',\n "digest": "{hdf5.digest(head)}"\n}}\n'.encode())
    with pytest.raises(StoreError, match=r"one\.json.*delete it and run its case file again"):
        read_studies(tmp_path)


def test_an_empty_folder_says_what_to_do(tmp_path):
    with pytest.raises(StoreError, match="compsim run CONFIG"):
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
    one = study("grid", load=["spring", "none"], machine={"rod_mass_kg": [4, 5]})
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


def test_a_table_of_a_study_has_its_machine(grid):
    found = store.open_study(grid[0])
    assert found.rod_mass_kg.dims == ("rod_mass_kg",)
    table = found[["peak_acceleration", "speed_rpm", "reciprocating_mass_kg"]].to_dataframe()
    assert table.index.names == ["load", "rod_mass_kg"]
    assert {*table.speed_rpm} == {500.0}
    assert {*table.reciprocating_mass_kg} == {14.0}
    assert found.speed_rpm.attrs == {
        "units": "rpm", "long_name": "crank speed", "case_key": "machine.speed_rpm"
    }  # fmt: skip
    assert "rod_inertia_kg_m2" not in found  # it follows from the mass that is swept
    swept = study("stroke", machine={"stroke_mm": [200, 240], "speed_rpm": 300})
    write_study(grid[0], swept, "by hand")
    try:
        other = store.open_study(grid[0], "stroke")
        assert other.speed_rpm.item() == 300.0
        assert other.crank_radius_mm.dims != ()
    finally:
        (grid[0] / "studies/stroke.json").unlink()


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
    float(found.acceleration.sel(load="spring", rod_mass_kg=5).max())
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
    assert found["load"].values.tolist()[1:5] == ["spring", "spring", "spring", "none"]
    assert found.rod_mass_kg.values.tolist() == [4.7, 4.7, 4, 5, 4, 5]
    assert found.clearance_mm.values[:2].tolist() == [0.1, 0.1]
    assert found.acceleration.dims == ("job", "time")
    assert found.reciprocating_mass_kg.dims == ("job",)
    with pytest.warns(StoreWarning, match="select both"):
        faults = store.open_study(tmp_path, "faults")
    assert faults.peak_contact_force.sel(joint="big_end").dims == ("fault", "clearance_mm")
    assert faults.clearance_mm.attrs["long_name"] == "radial clearance"
    assert store.open_study(tmp_path, "grid").key.shape == (2, 2)
    with pytest.raises(StoreError, match=r"'gird'; did you mean grid\?"):
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
    write_study(tmp_path, study("planned", clearance_mm=[0.1, 0.2], joint=["both"]))
    found = store.open_study(tmp_path)
    assert found.status.values.tolist() == [["missing"], ["missing"]]
    assert found.clearance_mm.attrs["units"] == "mm"

"""A folder of results as labelled data: axes, units, lazily read series."""

import shutil

import numpy as np
import pytest
import xarray as xr
from conftest import keep
from made_jobs import fill, study

from compressor.metrics import METRICS
from compressor.solve.simulate import simulate
from compressor.store.batch import read_series
from compressor.store.files import StoreError, StoreWarning
from compressor.store.reader import open_study, read_job, read_store
from compressor.store.studies import coordinate_names, write_study


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
    assert list(coordinate_names(keys).values()) == names


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    """A 2 x 2 study of ideal joints; the last job is missing."""
    folder = tmp_path_factory.mktemp("grid")
    one = study("grid", load=["spring", "none"], machine={"rod_mass_kg": [4, 5]})
    fill(folder, one, skip=(3,))
    return folder, one


def test_one_study_has_its_axes_as_dimensions(grid):
    folder, one = grid
    found = open_study(folder)
    assert found.key.dims == ("load", "rod_mass_kg")
    assert found.key.values.ravel().tolist() == [case.key for case in one.cases]
    assert found.rod_mass_kg.attrs["units"] == "kg"
    assert found.status.values.tolist() == [["ok", "ok"], ["ok", "missing"]]
    assert np.isnan(found.peak_acceleration.values).tolist() == [[False, False], [False, True]]
    assert set(METRICS) <= set(found)
    assert "quantile" not in found.dims  # statistics take no room where nothing is chaotic
    for name in found:
        assert found[name].attrs["long_name"], name


def test_a_table_of_a_study_has_its_machine(grid, tmp_path):
    found = open_study(grid[0])
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
    write_study(tmp_path, swept, "by hand")
    other = open_study(tmp_path, "stroke")
    assert other.speed_rpm.item() == 300.0
    assert other.crank_radius_mm.dims != ()


def test_a_series_is_that_of_its_job(grid):
    folder, one = grid
    found = open_study(folder).sel(load="none", rod_mass_kg=4)
    job = read_job(folder, one.cases[2].key)
    assert found.contact_force.dims == ("time", "joint", "axis")
    for name in ("time", "acceleration", "contact_force", "penetration"):
        assert found[name].attrs == job[name].attrs
        assert found[name].values.tobytes() == job[name].values.tobytes()


def test_only_the_jobs_asked_for_are_read(grid, monkeypatch):
    folder, one = grid
    read, name = [], "compressor.store.stored.read_series"
    monkeypatch.setattr(name, lambda *args: read.append(args) or read_series(*args))
    found = open_study(folder)
    assert found.acceleration.sizes["time"] == 101
    assert repr(found)
    (template,) = read  # for names, units and lengths
    float(found.acceleration.sel(load="spring", rod_mass_kg=5).max())
    stored = read_store(folder)
    path, row = stored.batch_of(stored.position(one.cases[1].key))
    assert read == [template, (path, [row], ["acceleration"])]


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
    found = open_study(grid[0]).acceleration
    whole = xr.DataArray(found.values, dims=found.dims)
    assert found.shape == (2, 2, 101)
    assert np.array_equal(found[index].values, whole[index].values, equal_nan=True)


def test_different_time_grids_are_padded(tmp_path):
    solve = {"duration_rev": 1, "settle_rev": 0, "output_step_s": 1e-3}
    fill(tmp_path, study("speeds", solve, machine={"speed_rpm": [300, 500]}))
    found = open_study(tmp_path)
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
    found = open_study(tmp_path)
    assert found.study.values.tolist() == ["faults"] * 2 + ["grid"] * 4
    assert found.fault.values.tolist() == ["none", "both"] + ["none"] * 4
    assert found["load"].values.tolist()[1:5] == ["spring", "spring", "spring", "none"]
    assert found.rod_mass_kg.values.tolist() == [4.7, 4.7, 4, 5, 4, 5]
    assert found.clearance_mm.values[:2].tolist() == [0.1, 0.1]
    assert found.acceleration.dims == ("job", "time")
    assert found.reciprocating_mass_kg.dims == ("job",)
    with pytest.warns(StoreWarning, match="select both"):
        faults = open_study(tmp_path, "faults")
    assert faults.peak_contact_force.sel(joint="big_end").dims == ("fault", "clearance_mm")
    assert faults.clearance_mm.attrs["long_name"] == "radial clearance"
    assert open_study(tmp_path, "grid").key.shape == (2, 2)
    with pytest.raises(StoreError, match=r"'gird'; did you mean grid\?"):
        open_study(tmp_path, "gird")


def test_jobs_that_were_simulated_for_metrics_have_no_series_beside_others(tmp_path):
    write_study(tmp_path, one := study("loads", load=["spring", "none"]), "by hand")
    keep(tmp_path, simulate(one.cases[0]), simulate(one.cases[1]).drop_dims("time"))
    found = open_study(tmp_path)
    assert found.status.values.tolist() == ["ok", "ok"]
    assert np.isfinite(found.acceleration.values).all(axis=1).tolist() == [True, False]
    assert np.isnan(found.acceleration.sel(load="none")).all()


def test_dask_threads_read_the_series_of_their_own_jobs(grid):
    alone = open_study(grid[0]).contact_force.values
    assert len({job.tobytes() for job in alone.reshape(4, -1)}) == 4  # they differ
    for _ in range(5):
        chunked = open_study(grid[0]).contact_force.chunk({"load": 1, "rod_mass_kg": 1})
        np.testing.assert_array_equal(chunked.compute(scheduler="threads"), alone)

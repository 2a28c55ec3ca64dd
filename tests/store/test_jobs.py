"""Jobs in batches: they come back as they were, to compsim and to other programs."""

import h5py
import numpy as np
import pytest
import xarray as xr
from conftest import SHORT, WORN_SENSOR, assert_same_bits, keep, write_batch
from made_jobs import batches, key, made

from compressor.cases.case import Case
from compressor.solve.simulate import simulate
from compressor.store.files import StoreError
from compressor.store.reader import read_job, read_store

STUCK = {"joint": "both", "clearance_mm": 0.1, "solve": {**SHORT, "max_steps": 5}}
JOBS = {
    "ok": {},
    "metrics": {"output": {"keep": "metrics"}},
    "failed": STUCK,
    "failed metrics": {**STUCK, "output": {"keep": "metrics"}},
    "sensor": {"body": True, "sensor": {**WORN_SENSOR, "length_rev": 2}, "joint": "big_end",
               "clearance_mm": 0.2, "solve": {**SHORT, "duration_rev": 2}},
}  # fmt: skip


@pytest.fixture(scope="module", params=list(JOBS))
def job(request):
    return simulate(Case.from_values({"solve": SHORT, **JOBS[request.param]}))


@pytest.fixture(scope="module")
def ideal():
    return simulate(Case.from_values({"solve": SHORT}))


def test_a_job_comes_back_identical_in_kind_and_bits(job, tmp_path):
    assert job.regime.item() == job.attrs["regime"]
    keep(tmp_path, job)
    assert_same_bits(read_job(tmp_path, job.attrs["key"]), job)
    stored = read_store(tmp_path)
    end = stored.status(job.attrs["key"])
    assert (end.status, end.reason) == (str(job.status.values), str(job.reason.values))
    assert end.samples == job.sizes.get("time", 0)
    assert stored.detail(0) == job.attrs.get("detail", "")


def test_single_precision_rounds_series_alone(ideal, tmp_path):
    output = {"precision": "single"}
    keep(tmp_path, rough := simulate(Case.from_values({"solve": SHORT, "output": output})))
    back = read_job(tmp_path, rough.attrs["key"])
    for name, item in ideal.variables.items():
        if name != "seconds":
            rounded = "time" in item.dims and name not in ("time", "crank_angle")
            expected = item.values.astype("f4") if rounded else item.values
            assert back[name].dtype == expected.dtype
            np.testing.assert_array_equal(back[name].values, expected)


def test_single_precision_saves_room(tmp_path):
    sizes = []
    for precision in ("double", "single"):
        job = made(1, samples=5000, precision=precision)
        job.series["contact_force"].values[:] = 0
        sizes.append(write_batch(tmp_path / precision, [job]).stat().st_size)
    assert sizes[1] < 0.3 * sizes[0]


def test_jobs_of_any_length_kind_and_variables_share_a_batch(tmp_path):
    """Also single precision beside double."""
    jobs = [made(n, samples=n * 7 % 5, precision=("double", "single")[n % 2]) for n in range(8)]
    write_batch(tmp_path, jobs)
    for back, job in zip(read_store(tmp_path).outcomes(np.arange(8)), jobs, strict=True):
        assert back.numbers.tobytes() == job.numbers.tobytes()
        assert back.attributes == job.attributes
        assert back.series.keys() == job.series.keys()
        for name, item in job.series.items():
            other = back.series[name]
            assert (other.dims, other.attrs) == (item.dims, item.attrs)
            assert other.values.dtype == item.values.dtype
            assert other.values.tobytes() == item.values.tobytes()


@pytest.mark.parametrize("text", ["", "nul \0 in it", "lone \udc80 surrogate", "Größe µ 漢"])
def test_any_text_can_be_stored(text, tmp_path):
    state = np.array([1.5, -0.0, np.nan])
    write_batch(tmp_path, [made(1, reason="non_finite", detail=text, state=state, complete=0)])
    stored = read_store(tmp_path)
    assert stored.detail(0) == text
    back = stored.outcome(0).attributes
    assert (back["detail"], back["complete"]) == (text, 0)
    assert back["state"].tobytes() == state.tobytes()


def test_what_is_not_stored_is_no_job(ideal, tmp_path):
    name = ideal.attrs["key"]
    assert read_store(tmp_path).keys() == set()
    assert read_store(tmp_path).status(name) is None
    with pytest.raises(StoreError, match="is not stored; run its study first"):
        read_job(tmp_path, name)


def test_xarray_opens_a_batch(ideal, tmp_path):
    """Jobs x metrics by their labels, and jobs x samples with units and joints."""
    failed = simulate(Case.from_values({"solve": SHORT, **STUCK}))
    cases = [ideal, failed]
    keep(tmp_path, *cases)
    for job, path in zip(cases, batches(tmp_path), strict=True):
        with xr.open_dataset(path, engine="h5netcdf") as found:
            assert found.value.dims == found.error.dims == ("job", "metric")
            one = found.sel(job=job.attrs["key"])
            assert (one.status, one.reason) == (job.status, job.reason)
            units = dict(zip(found.metric.values, found.unit.values, strict=True))
            if job is ideal:
                labels = {"peak_acceleration": "m/s2", "peak_contact_force.small_end": "N"}
                assert units.items() >= labels.items()
                assert one.value.sel(metric="peak_acceleration") == job.peak_acceleration
                assert one.error.sel(metric="peak_acceleration") == job.peak_acceleration_error
                force = job.peak_contact_force.sel(joint="small_end")
                assert one.value.sel(metric="peak_contact_force.small_end") == force
            force, count = one.contact_force.sel(joint="big_end", axis="y"), int(one.samples)
            assert force.attrs == job.contact_force.attrs
            expected = job.contact_force.sel(joint="big_end", axis="y")
            np.testing.assert_array_equal(force[:count], expected)
            np.testing.assert_array_equal(one.time[:count], job.time)
            assert found.attrs["comment"] == "SI units"


def test_a_few_lines_of_h5py_read_one_job(tmp_path):
    """As MATLAB's ncread does: variables by their names, texts as rows of characters."""
    jobs = [made(number, samples=4 + number) for number in range(3)]
    path = write_batch(tmp_path, jobs)
    with h5py.File(path) as file:
        row = [b"".join(one).decode() for one in file["job"]].index(key(1))
        count = file["samples"][row]
        acceleration = file["acceleration"][row, :count]
        unit = file["acceleration"].attrs["units"].decode()
        labels = [b"".join(one).decode() for one in file["metric"]]
        peak = file["value"][row, labels.index("peak_acceleration")]
    np.testing.assert_array_equal(acceleration, jobs[1].series["acceleration"].values)
    assert (unit, peak) == ("m/s2", 1.0)

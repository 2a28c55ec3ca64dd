"""Files that are filled into a kept layout: what they hold, and that they hold nothing else."""

import uuid

import numpy as np
import pytest
import xarray as xr

from compressor.cases import Output
from compressor.metrics import NUMBERS, SERIES, SIZES
from compressor.outcome import Outcome, row
from compressor.solve.series import FEATURES, SIGNALS
from compressor.store import hdf5
from compressor.store.series_file import series_image

OUTPUTS = [Output(precision=p, compress=c) for p in ("double", "single") for c in (False, True)]
TEXTS = ("", "plain", "Räder und 軸受", "a\tb\nc", "x" * 70_000, "é" * 40_000, "\ud800 and \0")
SPECIAL = (np.nan, np.inf, -np.inf, -0.0, 5e-324, 1.7976931348623157e308)
MORE = {name: ((), unit, phrase) for name, (_, unit, phrase) in FEATURES.items()}
FILLER_OF = hdf5._filler_of  # tests put others in its place
STATUSES = [("ok", ""), ("failed", "accuracy_not_reached")]


def make_values(random, shape):
    """Random numbers of many magnitudes, and now and then a special one."""
    values = np.array(random.normal(size=shape) * 10.0 ** random.integers(-300, 300, shape))
    special = random.random(shape) < 0.05
    values[special] = random.choice(SPECIAL, special.sum())
    return values


def make_job(random, samples, names, status):
    """A job of random numbers: names of series over time, of SERIES, SIGNALS and features."""
    numbers = row()
    for name in NUMBERS:
        if not NUMBERS[name].when or status[0] == "ok":
            values = make_values(random, numbers[name].shape)
            # nan of what few jobs have would be another layout
            numbers[name] = (
                np.where(np.isnan(values), 0.0, values) if NUMBERS[name].when else values
            )
    attributes = {
        "key": "".join(random.choice([*"0123456789abcdef"], 20)),
        "case": TEXTS[random.integers(len(TEXTS))],
        "detail": "d" * int(random.integers(200)),
        "complete": int(random.integers(2)),
        "settle": float(random.normal()),
        "rtol": np.float64(np.nan),
        "spans": random.normal(size=int(random.integers(1, 5))),
        "überschrift": TEXTS[random.integers(len(TEXTS))],
    }
    about = SERIES | SIGNALS | MORE
    series = {"time": (("time",), make_values(random, samples), {"units": "s"})}
    for name in names:
        dims, unit, phrase = about[name]
        values = make_values(random, (samples, *(SIZES[dim] for dim in dims)))
        series[name] = (("time", *dims), values, {"units": unit, "long_name": phrase})
    return Outcome(*status, numbers, attributes).table(series)


def layouts():
    """Names of series that jobs have, each with how the job ended."""
    for status in STATUSES:
        yield [*SERIES], status
        yield [*SERIES, *SIGNALS], status
        yield [*SERIES, *FEATURES], status
        yield [*reversed(SERIES)], status


def opened(data):
    """The Dataset that a file's bytes hold."""
    with hdf5.open_file(data, "a job's file") as file:
        return xr.Dataset(hdf5.variables(file, data), attrs=hdf5.attributes(file))


def forget_layouts():
    hdf5._template_of.cache_clear()
    FILLER_OF.cache_clear()


def stored_form(name, values, single):
    """What is stored of a variable's values."""
    is_rounded = single and name not in ("time", "crank_angle") and values.dtype.kind == "f"
    return values.astype("f4") if is_rounded else values


def stored_attribute(value):
    """What is stored of an attribute: a text without what HDF5 cannot hold, cut to 60,000 bytes."""
    if isinstance(value, str):
        whole = value.encode(errors="replace").decode().replace("\0", "\ufffd").encode()
        return whole[:60_000].decode(errors="ignore")
    return value


@pytest.mark.parametrize("output", OUTPUTS, ids=lambda o: f"{o.precision}-{o.compress}")
@pytest.mark.filterwarnings("ignore:overflow")
def test_a_file_holds_its_job_in_its_order(output):
    random = np.random.default_rng(1)
    forget_layouts()
    for number, (names, status) in enumerate(layouts()):
        samples = int(random.choice([1, 7, 601]))
        for _ in range(1 + number % 3):  # the first file of its layout, the second, the third
            job = make_job(random, samples, names, status)
            data = series_image(job, output)
        found = opened(data)
        assert [*found.variables] == [*job.variables]
        assert {*found.attrs} == {*job.attrs}
        for name, (dims, values, attrs) in job.variables.items():
            series = "time" in dims
            want = stored_form(name, values, series and output.precision == "single")
            back = found[name]
            assert back.dims == tuple(dims)
            assert dict(back.attrs) == attrs
            if values.dtype.kind == "f":
                assert back.dtype == want.dtype
                assert back.values.tobytes() == want.tobytes()
            else:
                assert back.values.tolist() == values.tolist()
        for name, value in job.attrs.items():
            np.testing.assert_equal(found.attrs[name], stored_attribute(value))


@pytest.mark.parametrize("output", OUTPUTS[1:3], ids=lambda o: f"{o.precision}-{o.compress}")
@pytest.mark.filterwarnings("ignore:overflow")
def test_bytes_do_not_depend_on_what_was_filled_in_before(output):
    random = np.random.default_rng(2)
    jobs = [make_job(random, 50, names, status) for names, status in layouts() for _ in range(3)]
    alone = []
    for job in jobs:
        forget_layouts()
        alone.append(series_image(job, output))
    forget_layouts()
    order = random.permutation(len(jobs))
    for at in [*order, *reversed(order), *order]:
        assert series_image(jobs[at], output) == alone[at]
    assert hdf5._template_of.cache_info().misses < len(jobs) / 2


@pytest.mark.parametrize("output", OUTPUTS[::2], ids=lambda o: o.precision)
@pytest.mark.filterwarnings("ignore:overflow")
def test_a_stencil_makes_the_bytes_that_hdf5_does(output, monkeypatch):
    random = np.random.default_rng(4)
    forget_layouts()
    jobs = [make_job(random, 30, [*SERIES], STATUSES[0]) for _ in range(8)]
    for job in jobs:  # of one kind, so that a stencil fits several
        job.attrs.update(case="c" * 40, detail="", überschrift="ü", spans=random.normal(size=2))
    made = [series_image(job, output) for job in jobs]
    assert hdf5._filler_of.cache_info().misses == 1
    monkeypatch.setattr(hdf5, "_filler_of", lambda layout, kinds: hdf5._template_of(layout))
    assert made == [series_image(job, output) for job in jobs]
    assert len({*made}) == len(jobs)


def test_no_stencil_is_made_where_more_than_values_changes(monkeypatch):
    """HDF5 puts checksums into files that know the order of their attributes."""
    random = np.random.default_rng(5)
    job = make_job(random, 30, [*SERIES], STATUSES[0])

    def new_file():
        access = hdf5.h5p.create(hdf5.h5p.FILE_ACCESS)
        access.set_libver_bounds(hdf5.h5f.LIBVER_V18, hdf5.h5f.LIBVER_LATEST)
        access.set_fapl_core(backing_store=False)
        return hdf5.h5f.create(uuid.uuid4().hex.encode(), fapl=access)

    def filler_of(*words, real=hdf5._filler_of):
        fillers.append(real(*words))
        return fillers[-1]

    fillers = []
    monkeypatch.setattr(hdf5, "_filler_of", filler_of)
    for make in (hdf5._new_file, new_file):
        monkeypatch.setattr(hdf5, "_new_file", make)
        forget_layouts()
        for _ in range(3):
            found = opened(series_image(job, Output()))
            np.testing.assert_array_equal(found["time"], job.variables["time"].values)
            assert found.attrs["key"] == job.attrs["key"]
    assert [one.stencil is None for one in fillers] == [False] * 3 + [True] * 3
    forget_layouts()


def test_xarray_and_h5py_open_a_filled_file(tmp_path):
    random = np.random.default_rng(3)
    forget_layouts()
    for _ in range(3):  # laid out for the first, a stencil cut for the second
        job = make_job(random, 40, [*SERIES, *SIGNALS], STATUSES[0])
        path = tmp_path / "job.h5"
        path.write_bytes(series_image(job, Output()))
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as found:
            for name, (dims, values, _) in job.variables.items():
                assert found[name].dims == tuple(dims)
                np.testing.assert_array_equal(found[name].values, values)


def test_layouts_of_large_files_and_of_single_files_are_not_kept():
    forget_layouts()
    hdf5.image({"x": (("x",), np.zeros(3), {})}, {})
    size = hdf5.MAX_TEMPLATE_BYTES // 8 + 1
    data = hdf5.image({"x": (("x",), np.arange(float(size)), {})}, {}, repeated=True)
    assert hdf5._filler_of.cache_info().currsize == 0
    with hdf5.open_file(data, "large") as file:
        assert (file["x"][()] == np.arange(size)).all()


def test_empty_and_missing_dimensions():
    variables = {
        "none": (("nothing",), np.zeros(0), {}),
        "grid": (("row", "column"), np.arange(6.0).reshape(2, 3), {}),
        "words": (("row",), np.array(["a", "ö"]), {}),
        "fixed": (("row",), np.array([b"ab", b"c"]), {}),
        "whole": ((), np.array(7), {}),
        "turned": (("column", "row"), np.arange(6.0).reshape(2, 3).T, {}),
    }
    for _ in range(3):
        data = hdf5.image(variables, {"empty": "", "names": ["a", "ö"]}, repeated=True)
        found = opened(data)
        for name, (dims, values, _) in variables.items():
            assert found[name].dims == dims
            assert found[name].values.tolist() == values.tolist()
        assert found.attrs["empty"] == ""
        assert [name.decode() for name in found.attrs["names"]] == ["a", "ö"]

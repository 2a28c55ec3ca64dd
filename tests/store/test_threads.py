"""A store read by several threads at once: each gets its own job's numbers, to the bit."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from test_reader import fill, study

from compressor.store.export import ExportOptions, export
from compressor.store.hdf5 import image, open_file
from compressor.store.reader import open_study
from compressor.store.series_file import read_bytes, read_values

TIMES = 5  # each that three threads read three jobs: images of one name clash at once


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the study `small`: a big end at three clearances."""
    folder = tmp_path_factory.mktemp("threads") / "results"
    fill(folder, study("small", joint="big_end", clearance_mm=[0.1, 0.2, 0.3]))
    return folder


@pytest.fixture(scope="module")
def alone(folder):
    """The accelerations of the three jobs, read in one thread; all differ."""
    found = open_study(folder, "small").acceleration.values
    assert not any(np.array_equal(found[n], found[n - 1]) for n in range(3))
    return found


def test_threads_read_the_series_of_their_own_jobs(folder, alone):
    right = 0
    with ThreadPoolExecutor(3) as pool:
        for _ in range(TIMES):
            series = open_study(folder, "small").acceleration
            found = pool.map(lambda n, s=series: s.isel(clearance_mm=n).values, range(3))
            right += sum(map(np.array_equal, found, alone))
    assert right == 3 * TIMES


def test_dask_threads_read_the_series_of_their_own_jobs(folder, alone):
    for _ in range(TIMES):
        chunked = open_study(folder, "small").acceleration.chunk({"clearance_mm": 1})
        np.testing.assert_array_equal(chunked.compute(scheduler="threads"), alone)


def test_an_image_opened_within_another_is_its_own(folder, alone):
    paths = sorted(folder.glob("jobs/*.h5"))
    apart = [read_values(path, ["acceleration"])["acceleration"] for path in paths]
    one, other = (read_bytes(path) for path in paths[:2])
    with open_file(one, paths[0]) as outer, open_file(other, paths[1]) as inner:
        made = image({"x": (("x",), np.arange(3.0), {})}, {})
        with open_file(made, paths[0]) as innermost:
            assert innermost["x"][()].tolist() == [0, 1, 2]
        np.testing.assert_array_equal(inner["acceleration"], apart[1])
        np.testing.assert_array_equal(outer["acceleration"], apart[0])


def test_threads_export_the_same_as_one(folder, tmp_path):
    def written(name):
        for form in ("csv", "netcdf"):
            export(folder, ["small"], tmp_path / name / form, ExportOptions(form, series=True))
        return {
            path.relative_to(tmp_path / name): path.read_bytes()
            for path in (tmp_path / name).rglob("*.*")
            if path.name != "small.nc"  # older HDF5 writes the time into it
        }

    expected = written("alone")
    with ThreadPoolExecutor(3) as pool:
        assert all(found == expected for found in pool.map(written, "abc"))
    assert len(expected) == 7

"""The library of a stored study: what it holds, and when its kept features are made again."""

import shutil
import warnings

import numpy as np
import pytest
from conftest import WORN_JOBS, struck

from compressor.store.files import StoreError, StoreWarning
from compressor.store.reader import read_store
from compressor.store.rows import Rows
from compressor.store.sensor_records import stored_record
from compressor.studies.compare import comparison
from compressor.studies.diagnosis import library as module
from compressor.studies.diagnosis.data_set import DataSetError, make_data_set
from compressor.studies.diagnosis.features import FEATURES, features
from compressor.studies.diagnosis.library import open_library, vector
from compressor.vibration.accelerometer import Record


@pytest.fixture(scope="module")
def folder(worn_store, tmp_path_factory):
    place = tmp_path_factory.mktemp("library") / "worn"
    shutil.copytree(worn_store, place)
    return place


@pytest.fixture(scope="module")
def library(folder):
    return open_library(folder, "worn")


def test_a_library_holds_joints_clearances_and_what_else_is_swept(library, folder):
    assert (len(library.keys), library.jobs) == (WORN_JOBS, WORN_JOBS)
    assert library.joints[:4].tolist() == ["none", "big_end", "small_end", "both"]
    assert (library.clearances[:4] > 0).tolist() == [[0, 0], [1, 0], [0, 1], [1, 1]]
    assert list(library.swept) == ["machine.rod_mass_kg"]
    job = read_store(folder).job(library.keys[5])
    case = f'"rod_mass_kg": {library.swept["machine.rod_mass_kg"][5]}'
    assert case in job.attrs["case"]


def test_features_are_those_of_the_records(library):
    ends = [c for c in library.clearances[7].tolist() if c]
    expected = features(*struck(library.joints[7], ends, 7))
    np.testing.assert_allclose(library.features[7], list(expected.values()), rtol=1e-9)


def test_kept_features_are_read_again(library, folder, monkeypatch):
    monkeypatch.setattr(module, "vector", None)  # would fail if it were called
    again = open_library(folder, "worn")
    np.testing.assert_array_equal(again.features, library.features)
    assert again.keys.tolist() == library.keys.tolist()


@pytest.mark.parametrize("harm", ["stale", "damaged", "other code", "another version"])
def test_features_that_cannot_be_trusted_are_made_again(harm, library, folder, monkeypatch):
    (path,) = (folder / "features").iterdir()
    kept = path.read_bytes()
    if harm == "damaged":
        path.write_bytes(kept[:-100])
    elif harm == "other code":
        monkeypatch.setattr(module.inspect, "getsource", lambda one: "changed")
    elif harm == "another version":
        monkeypatch.setattr(module, "PROGRAM", "compsim 99")
    else:
        monkeypatch.setattr(module, "_place", lambda stored, key: None)
        with pytest.raises(StoreError, match="has no sensor's record"):
            open_library(folder, "worn")
        monkeypatch.undo()
    told = []
    monkeypatch.setattr(module, "vector", lambda record: np.full(len(FEATURES), 7.0))
    again = open_library(folder, "worn", lambda done, total, remark: told.append(done))
    assert told == [*range(WORN_JOBS + 1)]
    assert (again.features == 7.0).all()
    path.write_bytes(kept)


def test_a_folder_that_cannot_be_written_costs_a_warning(library, folder, monkeypatch):
    def refuse(path, dataset):
        raise StoreError(path, "cannot be written", "free space")

    shutil.rmtree(folder / "features")
    monkeypatch.setattr(module, "write_dataset", refuse)
    monkeypatch.setattr(module, "vector", lambda record: np.full(len(FEATURES), 7.0))
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        again = open_library(folder, "worn")
    assert "features are not kept" in str(found[0].message)
    assert (again.features == 7.0).all()


def test_a_job_is_left_out(library):
    one = library.without(library.keys[3])
    assert library.keys[3] not in one.keys
    assert len(one.keys) == len(one.features) == len(one.joints) == WORN_JOBS - 1
    assert len(one.swept["machine.rod_mass_kg"]) == WORN_JOBS - 1


def test_a_job_gives_its_record_by_the_beginning_of_its_key(library, folder):
    key, record = stored_record(folder, library.keys[7][:12])
    assert key == library.keys[7]
    assert isinstance(record, Record)
    np.testing.assert_array_equal(vector(record), library.features[7])


def test_a_study_that_is_not_there_is_named(folder):
    with pytest.raises(StoreError, match="holds no study 'torn'; did you mean worn"):
        open_library(folder, "torn")


def test_jobs_without_a_sensor_are_told(paper_store):
    with pytest.raises(StoreError, match="study 'both' has no sensor's record"):
        open_library(paper_store, "both")
    key = sorted(read_store(paper_store).keys())[0]
    with pytest.raises(StoreError, match=f"job {key} has no sensor's record"):
        stored_record(paper_store, key)


def test_rows_of_another_version_are_left_out(worn_store, tmp_path, monkeypatch):
    """By identify, dataset and compare: of what was simulated nothing is known."""
    shutil.copytree(worn_store, tmp_path / "worn")
    _, record = stored_record(worn_store, min(read_store(worn_store).keys()))
    own = Rows.attributes
    monkeypatch.setattr(
        Rows, "attributes", lambda rows, at: {k: v for k, v in own(rows, at).items() if k != "case"}
    )
    shutil.rmtree(tmp_path / "worn" / "features", ignore_errors=True)
    with (
        pytest.warns(StoreWarning, match=f"{WORN_JOBS} of {WORN_JOBS} jobs are left out"),
        pytest.raises(StoreError, match="has no sensor's record"),
    ):
        open_library(tmp_path / "worn", "worn")
    with pytest.raises(DataSetError, match=f"{WORN_JOBS} damaged"):
        make_data_set(tmp_path / "worn", "worn")
    monkeypatch.setattr(comparison, "find_record", lambda *names: ("", record))
    with pytest.raises(comparison.CompareError, match=f"none of the {WORN_JOBS} jobs"):
        comparison.compare_record("record.csv", ["worn"], tmp_path / "worn", {})

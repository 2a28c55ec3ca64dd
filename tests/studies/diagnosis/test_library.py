"""The library of a stored study: what it holds of the records of its jobs."""

import numpy as np
import pytest
from conftest import WORN_JOBS, struck

from compressor.store.files import StoreError
from compressor.store.reader import read_store
from compressor.store.sensor_records import find_record
from compressor.studies.diagnosis.features import features
from compressor.studies.diagnosis.identify import read_library
from compressor.studies.frame import StudyError
from compressor.vibration import Record


@pytest.fixture(scope="module")
def library(worn_store):
    return read_library(worn_store, "worn")


def test_a_library_holds_joints_clearances_and_what_else_is_swept(library):
    assert (len(library.keys), library.jobs) == (WORN_JOBS, WORN_JOBS)
    assert library.joints[:4].tolist() == ["none", "big_end", "small_end", "both"]
    assert (library.clearances[:4] > 0).tolist() == [[0, 0], [1, 0], [0, 1], [1, 1]]
    assert library.swept == ["machine.rod_mass_kg"]
    assert len({*library.machines.tolist()}) == WORN_JOBS


def test_features_are_those_of_the_records(library):
    ends = [c for c in library.clearances[7].tolist() if c]
    expected = features(Record(*struck(library.joints[7], ends, 7), 0.0))
    np.testing.assert_allclose(library.features[7], list(expected.values()), rtol=1e-9)


def test_jobs_without_a_sensor_are_told(paper_store):
    with pytest.raises(StudyError, match="study both has no sensor's record"):
        read_library(paper_store, "both")
    key = sorted(read_store(paper_store).keys())[0]
    with pytest.raises(StoreError, match=f"job {key} has no sensor's record"):
        find_record(key, paper_store, {})

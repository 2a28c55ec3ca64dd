"""What is known of a finished job."""

import pickle
from dataclasses import replace

import numpy as np

import compressor
from compressor.cases.case import Case
from compressor.outcome import ROW, without_run


def test_an_outcome_without_a_run_says_whose_it_is_and_why():
    case = Case.from_values({})
    end = without_run(case.attributes(), "worker_died", "by signal 9", traceback="x")
    assert (end.status, end.reason, end.detail) == ("failed", "worker_died", "by signal 9")
    assert end.key == case.key
    assert end.attributes == case.attributes() | {
        "complete": 0,
        "program": f"compsim {compressor.__version__}",
        "detail": "by signal 9",
        "traceback": "x",
    }
    assert all(np.isnan(number).all() for number in end.numbers.item())


def test_attributes_that_are_handed_in_stay_as_they_are():
    said = {"key": "k"}
    without_run(said, "worker_died", "")
    assert said == {"key": "k"}


def test_an_outcome_that_a_worker_sends_is_the_same():
    sent = without_run({"key": "k"}, "worker_died", "")
    for name in ROW.names:
        sent.numbers[name] = np.arange(sent.numbers[name].size).reshape(sent.numbers[name].shape)
    came = pickle.loads(pickle.dumps(sent))
    assert came.numbers.dtype == ROW
    assert came.numbers.tobytes() == sent.numbers.tobytes()
    assert replace(came, numbers=sent.numbers) == sent
    came.numbers["peak_acceleration"] = 7.0  # as that of one that was made here

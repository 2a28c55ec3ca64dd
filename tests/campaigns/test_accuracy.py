"""What accuracy promises is kept, of a few cases that no campaign draws."""

import pytest
from measure_accuracy import TRUTH, apart, run, settled
from random_cases import strangers

from compressor.cases.case import Case
from compressor.cases.parameter import ACCURACY
from compressor.solve.simulate import simulate

SAMPLE = strangers(999, 6)


@pytest.mark.parametrize("values", SAMPLE)
def test_a_stranger_s_case_keeps_its_promise(values):
    found = simulate(Case.from_values(values))
    assert (found["status"].item(), found.attrs["promise"]) == ("ok", "kept")
    best = run(values, rtol=TRUTH)
    error = apart(settled(found), settled(best))
    # one bar in twenty or more is too short
    assert error <= 1.5 * found["acceleration_error"]
    assert max(error, found["acceleration_error"]) <= ACCURACY["standard"].promise
    away = abs(found["rms_acceleration"] - best["rms_acceleration"])
    assert away <= 1.5 * found["rms_acceleration_error"]

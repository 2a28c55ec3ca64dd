"""The one list of reasons: complete, stable, and told by everything that tells of a failure."""

import json
import pickle

import numpy as np

from compressor.reasons import Reason, remedy

STORED = {  # names that stores hold: never renamed
    "invalid_input", "non_finite", "penetration_implausible", "step_underflow", "crank_stalled",
    "budget_steps", "budget_seconds", "contact_underresolved", "energy_audit_failed",
    "accuracy_not_reached", "not_settled", "guide_implausible", "rod_implausible", "worker_died",
    "out_of_memory", "internal_error",
}  # fmt: skip


def test_the_names_stay():
    assert {str(reason) for reason in Reason} == STORED


def test_a_reason_is_its_name_wherever_it_goes():
    reason = Reason.NON_FINITE
    assert reason == "non_finite" == f"{reason}"
    assert pickle.loads(pickle.dumps(reason)) is reason
    assert json.dumps([reason]) == '["non_finite"]'
    assert np.asarray(reason).dtype.kind == "U"


def test_a_reason_of_another_version_has_a_remedy():
    assert remedy("flooded") == "compsim show JOB prints its detail"

"""The one list of reasons: complete, stable, and told by everything that tells of a failure."""

import ast
import json
import pickle

import numpy as np
import pytest
from test_layers import SOURCES

from compressor.reasons import Reason, remedy

PROGRAM = [name for name in SOURCES if name.startswith("compressor") and "reasons" not in name]
STORED = {  # names that stores hold: never renamed
    "invalid_input", "non_finite", "penetration_implausible", "step_underflow", "crank_stalled",
    "budget_steps", "budget_seconds", "contact_underresolved", "energy_audit_failed",
    "accuracy_not_reached", "not_settled", "guide_implausible", "rod_implausible", "worker_died",
    "out_of_memory", "internal_error",
}  # fmt: skip


def test_the_names_stay():
    assert {str(reason) for reason in Reason} == STORED


@pytest.mark.parametrize("reason", Reason)
def test_every_reason_has_a_meaning_and_a_remedy(reason):
    assert len(reason.meaning) > 20
    assert len(reason.remedy) > 20
    assert remedy(reason.value) == reason.remedy


def test_a_reason_is_its_name_wherever_it_goes():
    reason = Reason.NON_FINITE
    assert reason == "non_finite" == f"{reason}"
    assert pickle.loads(pickle.dumps(reason)) is reason
    assert json.dumps([reason]) == '["non_finite"]'
    assert np.asarray(reason).dtype.kind == "U"


def test_a_reason_of_another_version_has_a_remedy():
    assert remedy("flooded") == "compsim show JOB prints its detail"


@pytest.mark.parametrize("module", PROGRAM)
def test_no_module_spells_a_reason_itself(module):
    tree = ast.parse(SOURCES[module])
    words = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)}
    assert not words & STORED


@pytest.mark.parametrize("reason", Reason)
def test_every_reason_is_given_by_some_module(reason):
    used = f"Reason.{reason.name}"
    assert any(used in SOURCES[module] for module in PROGRAM)

"""What is kept of a run that stops: where, and why."""

import math

import pytest

from compressor.cases.case import Case
from compressor.cases.groups import METHODS
from compressor.solve.simulate import measure

BOTH = {"joint": "both", "clearance_mm": 0.3}


def test_a_slowing_crank_stops_at_the_time_that_passed():
    values = {"drive": {"torque_N_m": 1, "flywheel_kg_m2": 1}, "solve": {"max_steps": 400}}
    found = measure(Case.from_values(BOTH | values)).attributes
    turned = found["stop_crank_angle"] / (500 * math.pi / 30)
    assert found["stop_time"] > 1.0004 * turned  # the crank is behind a steady one


@pytest.mark.parametrize("method", [*METHODS])
@pytest.mark.parametrize("most", [1, 37])
def test_the_budget_of_steps_is_kept_exactly(method, most):
    found = measure(Case.from_values({**BOTH, "solve": {"max_steps": most, "method": method}}))
    assert found.reason == "budget_steps"
    assert found.numbers["steps"] + found.numbers["rejected"] == most


def test_a_contact_that_lies_within_one_step_is_named(monkeypatch):
    """RK45 at a loose tolerance steps over a pulse (physics/README.md, Reference numbers)."""
    values = {"load": "gas", "joint": "big_end", "clearance_mm": 0.2,
              "machine": {"rod_mass_kg": 3, "reciprocating_mass_kg": 6}}  # fmt: skip
    solve = {"duration_rev": 0.25, "settle_rev": 0, "rtol": 1e-5}
    case = Case.from_values({**values, "solve": solve | {"method": "RK45"}})
    found = measure(case)
    assert found.reason == "contact_underresolved"
    assert "N within one step of" in found.detail
    assert 4.6e-3 < found.attributes["stop_time"] < 5.0e-3  # where the step begins
    assert measure(Case.from_values({**values, "solve": solve})).status == "ok"

"""What is kept of a run that stops: where, in which state, and its last steps."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.cases.groups import METHODS
from compressor.physics import LAST_STEPS
from compressor.solve.run import COMPILED
from compressor.solve.simulate import measure

BOTH = {"joint": "both", "clearance_mm": 0.3}


def stopped(**values):
    return measure(Case.from_values({**BOTH, **values})).attributes


def words(attributes):
    return attributes["stop_history_words"].split("; ")


def test_the_history_ends_where_the_run_stopped():
    found = stopped(solve={"max_steps": 500})
    times, steps = found["stop_history_time"], found["stop_history_step"]
    assert len(times) == len(steps) == len(found["stop_history_error"]) == LAST_STEPS
    taken = np.array([text.endswith(("taken", "to an onset")) for text in words(found)])
    assert (times + np.where(taken, steps, 0))[-1] == pytest.approx(found["stop_time"], rel=1e-12)
    assert times[1:] == pytest.approx((times + np.where(taken, steps, 0))[:-1], rel=1e-12)
    errors = found["stop_history_error"]
    refused = np.array([text.endswith("refused") for text in words(found)])
    assert (errors[refused] > 1).all()
    assert (errors[[text.endswith("taken") for text in words(found)]] <= 1).all()


def test_the_history_of_a_slowing_crank_has_the_time_that_passed():
    found = stopped(drive={"torque_N_m": 1, "flywheel_kg_m2": 1}, solve={"max_steps": 400})
    times, steps = found["stop_history_time"], found["stop_history_step"]
    taken = np.array([text.endswith(("taken", "to an onset")) for text in words(found)])
    ends = times + np.where(taken, steps, 0)
    assert ends[-1] == pytest.approx(found["stop_time"], rel=1e-6)
    assert times[1:] == pytest.approx(ends[:-1], rel=1e-6)
    turned = found["stop_crank_angle"] / (500 * math.pi / 30)
    assert found["stop_time"] > 1.0004 * turned  # the crank is behind a steady one


@pytest.mark.parametrize("method", [*METHODS])
@pytest.mark.parametrize("most", [1, 37])
def test_the_budget_of_steps_is_kept_exactly(method, most):
    found = measure(Case.from_values({**BOTH, "solve": {"max_steps": most, "method": method}}))
    assert found.reason == "budget_steps"
    assert found.numbers["steps"] + found.numbers["rejected"] == most
    told = min(most, LAST_STEPS) if method in COMPILED else 0
    assert len(found.attributes["stop_history_time"]) == told


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

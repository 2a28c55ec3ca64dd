"""Runs of a double-acting cylinder: integrators agree, corners are landed on, features work."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.solve.simulate import simulate

MACHINE = {"stroke_mm": 180, "rod_length_mm": 450, "speed_rpm": 740, "reciprocating_mass_kg": 30}
DOUBLE = {
    "action": "double", "bore_mm": 220, "rod_diameter_mm": 60, "suction_MPa": 0.2,
    "discharge_MPa": 0.7, "exponent": 1.3, "clearance_percent": {"head": 12, "crank": 14},
    "valve_loss_percent": {"suction": 4, "discharge": 5}, "back_pressure_MPa": 0.1,
}  # fmt: skip
WORN = {"joint": "small_end", "clearance_mm": 0.2}
FEATURES = {
    "guide": {"guide": {"clearance_mm": 0.1}},
    "drive": {"drive": {"flywheel_kg_m2": 20, "torque_N_m": 600}},
    "oil": {"lubricant": True},
    "law": {"contact": {"law": "flores", "restitution": 0.7}},
}


def run(more, **solve):
    how = {"duration_rev": 1, "settle_rev": 0, "error_bars": False, **solve}
    values = {"load": "gas", "machine": MACHINE, "gas": DOUBLE, **WORN, **more, "solve": how}
    found = simulate(Case.from_values(values))
    assert found.status == "ok", found.attrs.get("detail")
    return found


def apart(one, other, name="acceleration"):
    a, b = one[name].values, other[name].values
    return float(np.linalg.norm(a - b) / np.linalg.norm(a))


@pytest.mark.parametrize("method", ["RODAS", "LSODA", "Radau"])
def test_another_integrator_finds_the_same(method):
    """The equations alone are shared; the forces of both faces among them."""
    ours, theirs = run({}, rtol=1e-9), run({}, rtol=1e-8, method=method)
    for name in ("acceleration", "contact_force", "piston_force"):
        assert apart(ours, theirs, name) < 1e-4, name
    for one in (ours, theirs):
        assert float(one.energy_residual) < 1e-5


@pytest.mark.parametrize("joint", ["big_end", "both"])
def test_the_promise_is_kept(joint):
    exact = run({"joint": joint}, rtol=1e-11)
    assert apart(exact, run({"joint": joint}, accuracy="standard")) < 5e-3
    assert apart(exact, run({"joint": joint}, accuracy="fine")) < 1e-4


def test_errors_fall_with_the_tolerance():
    """A corner that a step passes over would leave an error that the tolerance does not lower."""
    exact = run({}, rtol=1e-12)
    errors = [apart(exact, run({}, rtol=rtol)) for rtol in (1e-5, 1e-7, 1e-9)]
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
    assert errors[2] < 1e-6


@pytest.mark.parametrize("name", FEATURES)
def test_a_feature_works_with_it(name):
    """By explicit steps and by stiff ones; energy closes."""
    runs = [run(FEATURES[name], rtol=1e-8, method=one) for one in ("TSIT5", "RODAS")]
    assert apart(*runs) < 2e-4
    assert all(float(one.energy_residual) < 1e-5 for one in runs)


def test_single_acting_with_exact_corners_is_the_plain_load():
    plain = {"gas": {"switching": "exact"}, "machine": {}}
    single = {"gas": {"action": "single"}, "machine": {}}
    ours, theirs = (run(one, rtol=1e-9) for one in (single, plain))
    assert apart(ours, theirs) < 1e-9
    assert apart(ours, theirs, "contact_force") < 1e-9

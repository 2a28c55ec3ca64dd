"""Runs of a double-acting cylinder: corners are landed on, forces have no steps, cards press."""

import numpy as np
import pytest
from cylinder_made import DOUBLE, MACHINE, pressures
from test_feature_runs import apart
from test_feature_runs import run as run_whole

HEAVY = MACHINE | {"reciprocating_mass_kg": 30}
WORN = {"joint": "small_end", "clearance_mm": 0.2}


def run(more, **solve):
    values = {"load": "gas", "machine": HEAVY, "gas": DOUBLE, **WORN, **more}
    return run_whole(values, **{"duration_rev": 1, **solve})


def test_errors_fall_with_the_tolerance():
    """A corner that a step passes over would leave an error that the tolerance does not lower."""
    exact = run({}, rtol=1e-12)
    errors = [apart(exact, run({}, rtol=rtol)) for rtol in (1e-5, 1e-7, 1e-9)]
    assert errors[0] > errors[1] > errors[2]
    assert errors[0] > 100 * errors[2]  # of 10,000: one error is by chance a few times another
    assert errors[2] < 1e-6


ENDS = {
    "double": {},
    "head unloaded": {"unloaded": "head"},
    "crank end": {"action": "crank_end"},
    "single": {"action": "single", "rod_diameter_mm": None, "valve_loss_percent": 0},
}


@pytest.mark.parametrize("oil", [False, True])
@pytest.mark.parametrize("ends", ENDS)
def test_the_force_of_a_worn_machine_has_kinks_and_no_steps(ends, oil):
    """Between samples it changes by no more than the piston's way compresses gas that is shut in.

    With the space of the ideal machine at dead centres it stepped there by up to 340 N.
    """
    gas = {key: value for key, value in (DOUBLE | ENDS[ends]).items() if value is not None}
    if ends == "single":
        gas["clearance_percent"] = 12
    more = {"lubricant": True} if oil else {}
    found = run({"gas": gas, **more}, duration_rev=2, output_step_deg=0.1)
    force, x = found.piston_force.values, found.displacement.values
    spaces = 0.54 + 0.12 * 0.18 - x, x - 0.36 + 0.14 * 0.18
    steepest = 1.3 * 0.7e6 * 1.05 * np.pi * 0.11**2 * (1 / spaces[0] + 1 / spaces[1])  # N/m
    assert (np.abs(np.diff(force)) <= 1.05 * (steepest[1:] * np.abs(np.diff(x)) + 1e-6)).all()
    assert force.max() - force.min() > 1e4


CYCLE = ("suction_MPa", "discharge_MPa", "exponent", "clearance_percent", "valve_loss_percent")
MEASURED = {key: value for key, value in DOUBLE.items() if key not in CYCLE}


def cards(folder, step):
    """Cards of the ideal cycle, sampled every so many degrees from a quarter of a step on."""
    degrees = np.arange(0.25 * step, 360, step)
    for name, values in zip(("head", "crank"), pressures(degrees), strict=True):
        lines = [f"{a!r},{p!r}\n" for a, p in zip(degrees.tolist(), values.tolist(), strict=True)]
        (folder / f"{name}.csv").write_text("crank_angle_deg,pressure_MPa\n" + "".join(lines))
    return MEASURED | {"indicator": {end: str(folder / f"{end}.csv") for end in ("head", "crank")}}


@pytest.mark.parametrize(
    ("step", "force", "work"), [(0.25, 6e-5, 1e-4), (1, 3e-4, 2e-4), (5, 5e-3, 2e-3)]
)
def test_a_card_of_the_ideal_cycle_gives_the_ideal_run_back(tmp_path, step, force, work):
    """Within the error of its samples, which falls with their step (relative L2, and work)."""
    ideal, ours = {"joint": "none", "clearance_mm": {}}, cards(tmp_path, step)
    exact, found = run(ideal, rtol=1e-9), run(ideal | {"gas": ours}, rtol=1e-9)
    assert force / 20 < apart(exact, found, "piston_force") < force
    assert float(found.load_work / exact.load_work) == pytest.approx(1, abs=work)
    assert float(found.energy_residual) < 1e-9


def test_a_card_works_with_a_drive(tmp_path):
    """Whose crank goes on at a speed of its own: the card follows its angle."""
    ours = {"gas": cards(tmp_path, 1), "drive": {"flywheel_kg_m2": 20, "torque_N_m": 600}}
    found = run(ours, rtol=1e-9, duration_rev=2)
    node = np.array([0, 300, 700, 1000])
    degrees = np.degrees(found.crank_angle.values[node]) % 360
    head, crank = pressures(degrees)
    faces = np.pi * 0.11**2, np.pi * (0.11**2 - 0.03**2)
    force = 1e6 * (faces[0] * head - faces[1] * crank - (faces[0] - faces[1]) * 0.1)
    assert found.piston_force.values[node] == pytest.approx(force, rel=5e-3, abs=60)
    assert float(found.energy_residual) < 1e-5

"""Equations of motion against an independent derivation: sympy's Lagrangian at 40 digits."""

import math

import mpmath
import numpy as np
import pytest
import reference

from compressor.cases.case import Case
from compressor.physics.observe import COLUMNS, Column
from compressor.physics.systems import derivative, observe_at
from compressor.solve.si_record import record

STATES = 1000
SCENES = ("big_end", "small_end", "both")
LOADS = ("spring", "gas", "none")


def random_case(scene, rng):
    """A random case and the reference's parameters of the same machine."""
    load, clearance = LOADS[rng.integers(3)], float(rng.uniform(0.01, 1))
    masses = {"rod_mass_kg": rng.uniform(1, 10), "reciprocating_mass_kg": rng.uniform(1, 30)}
    values = {
        "load": load,
        "joint": scene,
        "clearance_mm": clearance,
        "machine": {
            **masses,
            "rod_centre_mm": rng.uniform(100, 500),
            "rod_inertia_kg_m2": rng.uniform(0.05, 1),
            "speed_rpm": rng.uniform(50, 3000),
            "gravity_m_per_s2": float(rng.choice([0, 9.81])),
        },
    }
    if rng.random() < 0.3:
        values["friction"] = False
    return Case.from_values(values)


def reference_params(case):
    """The same machine as `case` in the reference's words."""
    p = record(case)
    changes = {
        name: float(getattr(p, name))
        for name in (
            "omega",
            "rod_mass",
            "rod_centre",
            "rod_inertia",
            "reciprocating_mass",
            "gravity",
        )
    }
    clearance = dict(zip(reference.JOINTS, p.clearance.tolist(), strict=True))
    if not case.friction:
        changes |= {"mu_static": 0.0, "mu_dynamic": 0.0}
    return reference.paper_params(case.load, case.joint, clearance, **changes)


def random_state(scene, case, rng):
    """Deviations that bring the journals from free flight to deep contact."""
    n = 4 if scene == "both" else 2
    spread = np.full(n, 1.5e-3 * case.clearance_mm.big_end or 1.5e-3 * case.clearance_mm.small_end)
    spread[-1] /= 0.6
    return np.concatenate((rng.normal(size=n) * spread, rng.normal(size=n) * spread * 1000))


def absolute(scene, t, y, params):
    """The state's positions and rates in the reference's coordinates, 40 digits."""
    x, v, _, phi, rate, _ = reference.ideal_motion(t, params)
    q, qd = [x, phi], [v, rate]
    if scene == "both":
        theta = mpmath.mpf(params["omega"]) * mpmath.mpf(t)
        r, a = mpmath.mpf(params["crank_radius"]), mpmath.mpf(params["rod_centre"])
        turn = r * mpmath.mpf(params["omega"])
        centre = [r * mpmath.cos(theta) + a * mpmath.cos(phi),
                  r * mpmath.sin(theta) - a * mpmath.sin(phi)]  # fmt: skip
        rates = [-turn * mpmath.sin(theta) - a * mpmath.sin(phi) * rate,
                 turn * mpmath.cos(theta) - a * mpmath.cos(phi) * rate]  # fmt: skip
        q, qd = [x, *centre, phi], [v, *rates, rate]
    n = len(q)
    return [a + mpmath.mpf(b) for a, b in zip(q, y[:n], strict=True)], [
        a + mpmath.mpf(b) for a, b in zip(qd, y[n:], strict=True)
    ]


def ideal_accelerations(scene, t, params):
    """The reference's ideal accelerations in the scene's coordinates."""
    _, _, a, phi, rate, spin_up = reference.ideal_motion(t, params)
    if scene != "both":
        return [a, spin_up]
    theta = mpmath.mpf(params["omega"]) * mpmath.mpf(t)
    pin = mpmath.mpf(params["crank_radius"]) * mpmath.mpf(params["omega"]) ** 2
    arm = mpmath.mpf(params["rod_centre"])
    return [
        a,
        -pin * mpmath.cos(theta) - arm * (mpmath.cos(phi) * rate**2 + mpmath.sin(phi) * spin_up),
        -pin * mpmath.sin(theta) + arm * (mpmath.sin(phi) * rate**2 - mpmath.cos(phi) * spin_up),
        spin_up,
    ]


@pytest.mark.parametrize("scene", SCENES)
def test_random_states_agree_with_the_lagrangian(scene):
    rng = np.random.default_rng(20211 + SCENES.index(scene))
    struck = 0
    with mpmath.workdps(40):
        for _ in range(math.ceil(STATES / len(SCENES))):
            case = random_case(scene, rng)
            p, params = record(case), reference_params(case)
            t, phase = float(rng.uniform(0, 2 * case.turn)), int(rng.integers(4))
            y = random_state(scene, case, rng)
            q, qd = absolute(scene, t, y, params)
            expected = reference.accelerations(scene, q, qd, t, phase, params)
            ideal = ideal_accelerations(scene, t, params)
            found = np.empty_like(y)
            derivative(t, y, phase, p, found)
            n = len(q)
            scale = max(abs(float(e)) for e in [*expected, *ideal])
            assert found[:n].tolist() == y[n:].tolist()
            for mine, e, i in zip(found[n:], expected, ideal, strict=True):
                assert abs(float(mpmath.mpf(mine) - (e - i))) <= 1e-12 * scale
            struck += check_forces(scene, t, y, phase, p, (q, qd), params)
    assert struck > 0.2 * STATES / 3  # a good share of the states is in contact


def check_forces(scene, t, y, phase, p, absolute_state, params):
    """Forces at both joints against the reference's; True when a joint was in contact."""
    row = np.empty(COLUMNS)
    observe_at(t, y, phase, p, row)
    forces = reference.joint_forces(scene, *absolute_state, t, phase, params)
    expected = [float(f) for joint in reference.JOINTS for f in forces[joint]]
    found = row[Column.FORCE : Column.FORCE + 4]
    assert found == pytest.approx(expected, rel=1e-11, abs=1e-11 * max(map(abs, expected)))
    return bool((row[Column.NORMAL : Column.NORMAL + 2] > 0).any())


@pytest.mark.parametrize("load", LOADS)
def test_ideal_joint_forces_agree_with_newton_and_euler(load):
    case = Case.from_values({"load": load, "machine": {"gravity_m_per_s2": 9.81}})
    p = record(case)
    params = reference.paper_params(load, "none", 0.0, gravity=9.81)
    row = np.empty(COLUMNS)
    for k, t in enumerate(np.linspace(0.001, 0.119, 24)):
        observe_at(t, np.zeros(4), k % 4, p, row)
        forces = reference.ideal_joint_forces(t, k % 4, params)
        expected = [float(f) for joint in reference.JOINTS for f in forces[joint]]
        assert row[Column.FORCE : Column.FORCE + 4] == pytest.approx(expected, rel=1e-11, abs=1e-8)


def test_a_nanometre_of_clearance_keeps_its_digits():
    case = Case.from_values({"joint": "big_end", "clearance_mm": 1e-6})
    p, params = record(case), reference.paper_params("spring", "big_end", 1e-9)
    y = np.array([-0.7e-9, 1.1e-9, 3e-7, -2e-7])
    with mpmath.workdps(40):
        q, _qd = absolute("big_end", 0.013, y, params)
        theta = mpmath.mpf(params["omega"]) * mpmath.mpf(0.013)
        radius = mpmath.mpf(params["crank_radius"])
        pin = [radius * mpmath.cos(theta), radius * mpmath.sin(theta)]
        rod = mpmath.mpf(params["rod_length"])
        expected = [pin[0] - q[0] + rod * mpmath.cos(q[1]), pin[1] - rod * mpmath.sin(q[1])]
    row = np.empty(COLUMNS)
    observe_at(0.013, y, 0, p, row)
    found = row[Column.ECCENTRICITY : Column.ECCENTRICITY + 2]
    assert found == pytest.approx([float(e) for e in expected], rel=1e-13)

"""Equations of motion and forces by an independent derivation: SymPy's Lagrangian at 40 digits."""

import math

import mpmath
import numpy as np
import pytest
import reference

from compressor.cases.case import Case
from compressor.physics.observe import COLUMNS, Column
from compressor.physics.systems import derivative, observe_at
from compressor.solve.si_record import record

STATES = 240
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
    names = ["omega", "rod_mass", "rod_centre", "rod_inertia", "reciprocating_mass", "gravity"]
    changes = {name: float(getattr(p, name)) for name in names}
    clearance = dict(zip(reference.JOINTS, p.clearance.tolist(), strict=True))
    if not case.friction:
        changes |= {"mu_static": 0.0, "mu_dynamic": 0.0}
    return reference.paper_params(case.load, case.joint, clearance, **changes)


def random_state(scene, case, rng):
    """Eccentricities that bring the journals from free flight to deep contact, and their rates."""
    n = 4 if scene == "both" else 2
    spread = 1.5e-3 * (case.clearance_mm.big_end or case.clearance_mm.small_end)
    return rng.normal(size=2 * n) * np.repeat([spread, 1000 * spread], n)


def both_joints(scene, numbers):
    """Two vectors, of the big end and of the small end, from those of joints with clearance."""
    pairs = [list(map(mpmath.mpf, numbers[i : i + 2])) for i in range(0, len(numbers), 2)]
    nil = [mpmath.mpf(0)] * 2
    return {"big_end": [*pairs, nil], "small_end": [nil, *pairs], "both": pairs}[scene]


def absolute(scene, t, y, params):
    """The state's positions and rates in the reference's coordinates, 40 digits."""
    (bx, by), (sx, sy) = both_joints(scene, y[: len(y) // 2])
    (bu, bv), (su, sv) = both_joints(scene, y[len(y) // 2 :])
    r, a, length, omega = (
        mpmath.mpf(params[name]) for name in ("crank_radius", "rod_centre", "rod_length", "omega")
    )
    c, s = mpmath.cos(omega * mpmath.mpf(t)), mpmath.sin(omega * mpmath.mpf(t))
    phi = mpmath.asin((r * s - by + sy) / length)  # the loop over both joints, along y
    cos_phi, sin_phi = mpmath.cos(phi), mpmath.sin(phi)
    rate = (r * omega * c - bv + sv) / (length * cos_phi)
    x = r * c - bx + length * cos_phi + sx
    v = -r * omega * s - bu - length * sin_phi * rate + su
    if scene != "both":
        return [x, phi], [v, rate]
    centre = [r * c - bx + a * cos_phi, r * s - by - a * sin_phi]
    rates = [-r * omega * s - bu - a * sin_phi * rate, r * omega * c - bv - a * cos_phi * rate]
    return [x, *centre, phi], [v, *rates, rate]


def away(scene, t, positions, rates, accelerations, params):
    """Accelerations of the journals against their bores by the reference's of the bodies."""
    r, a, length, omega = (
        mpmath.mpf(params[name]) for name in ("crank_radius", "rod_centre", "rod_length", "omega")
    )
    phi, rate, spin_up = positions[-1], rates[-1], accelerations[-1]
    along = mpmath.cos(phi) * rate**2 + mpmath.sin(phi) * spin_up
    across = mpmath.cos(phi) * spin_up - mpmath.sin(phi) * rate**2
    angle = omega * mpmath.mpf(t)
    pin = [-r * omega**2 * mpmath.cos(angle), -r * omega**2 * mpmath.sin(angle)]
    crosshead = [accelerations[0], mpmath.mpf(0)]
    if scene == "both":
        big = [accelerations[1] + a * along, accelerations[2] + a * across]
        small = [accelerations[1] - (length - a) * along, accelerations[2] - (length - a) * across]
    else:
        big = [crosshead[0] + length * along, length * across]
        small = [pin[0] - length * along, pin[1] - length * across]
    found = {"big_end": [(pin, big)], "small_end": [(crosshead, small)],
             "both": [(pin, big), (crosshead, small)]}[scene]  # fmt: skip
    return [
        one - other for journal, bore in found for one, other in zip(journal, bore, strict=True)
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
            expected = away(scene, t, q, qd, expected, params)
            found = np.empty_like(y)
            derivative(t, y, phase, p, found)
            n = len(q)
            scale = max(abs(float(e)) for e in [*expected, p.crank_radius * p.omega**2])
            assert found[:n].tolist() == y[n:].tolist()
            for mine, e in zip(found[n:], expected, strict=True):
                assert abs(float(mpmath.mpf(mine) - e)) <= 1e-12 * scale
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


def test_a_nanometre_of_clearance_keeps_its_digits():
    """The force of a contact and the rates, against positions of metres with 40 digits."""
    case = Case.from_values({"joint": "big_end", "clearance_mm": 1e-6})
    p, params = record(case), reference.paper_params("spring", "big_end", 1e-9)
    y = np.array([-0.7e-9, 1.1e-9, 3e-7, -2e-7])
    with mpmath.workdps(40):
        state = absolute("big_end", 0.013, y, params)
        forces = reference.joint_forces("big_end", *state, 0.013, 0, params)["big_end"]
        expected = reference.accelerations("big_end", *state, 0.013, 0, params)
        expected = away("big_end", 0.013, *state, expected, params)
    row, rates = np.empty(COLUMNS), np.empty(4)
    observe_at(0.013, y, 0, p, row)
    derivative(0.013, y, 0, p, rates)
    assert row[Column.NORMAL] > 0.0
    found = row[Column.FORCE : Column.FORCE + 2]
    assert found == pytest.approx([float(f) for f in forces], rel=1e-12)
    assert rates[2:] == pytest.approx([float(e) for e in expected], rel=1e-12)


@pytest.mark.parametrize("scene", SCENES)
def test_eccentricity_matches_the_positions(scene):
    """The difference identities against plain trigonometry of the positions."""
    case = Case.from_values({"joint": scene, "clearance_mm": 0.2})
    p, rng = record(case), np.random.default_rng(4)
    for t in np.linspace(0.001, 0.11, 12):
        row = np.empty(COLUMNS)
        observe_at(t, random_state(scene, case, rng), 1, p, row)
        found = row[Column.ECCENTRICITY : Column.ECCENTRICITY + 4].reshape(2, 2)
        theta, phi = p.omega * t, row[Column.ROD_ANGLE]
        pin = p.crank_radius * np.array([math.cos(theta), math.sin(theta)])
        rod = p.rod_length * np.array([math.cos(phi), -math.sin(phi)])
        crosshead = np.array([row[Column.DISPLACEMENT], 0.0])
        # going round the loop: pin - e_big + rod + e_small = crosshead
        assert pin - found[0] + rod + found[1] == pytest.approx(crosshead, abs=1e-14)

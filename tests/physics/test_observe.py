"""Outputs recomputed from (t, y): inverse dynamics, power balance, eccentricities."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics.observe import COLUMNS, Column
from compressor.physics.systems import derivative, observe_at, start
from compressor.solve.si_record import offsets, record

JOINTS = ("big_end", "small_end", "both")


def case(joint, **values):
    clearance = {} if joint == "none" else {"joint": joint, "clearance_mm": 0.2}
    return Case.resolve({**clearance, **values})


def row_at(p, t, y, phase=1):
    row = np.empty(COLUMNS)
    observe_at(t, y, phase, p, row)
    return row


def random_state(joint, rng):
    n = 4 if joint == "both" else 2
    scale = np.full(n, 2.5e-4)
    scale[-1] = 5e-4
    return np.concatenate((rng.normal(size=n) * scale, rng.normal(size=n) * scale * 500))


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.parametrize("gravity", [0, 9.81])
def test_energy_changes_by_the_powers(joint, gravity):
    """dE/dt along the equations of motion equals the powers: an identity of the mechanics."""
    p = record(case(joint, machine={"gravity_m_per_s2": gravity}))
    rng = np.random.default_rng(1)
    for t in np.linspace(0.001, 0.11, 12):
        y = random_state(joint, rng)
        rate = np.empty_like(y)
        derivative(t, y, 1, p, rate)
        h = 1e-7
        energies = [
            row_at(p, t + s, y + s * rate)[[Column.KINETIC, Column.POTENTIAL]].sum()
            for s in (h, -h)
        ]
        row = row_at(p, t, y)
        power = row[Column.CRANK_POWER] + row[Column.LOAD_POWER]
        power -= row[Column.CONTACT_POWER] + row[Column.FRICTION_POWER]
        scale = abs(row[Column.CRANK_POWER : Column.KINETIC]).sum()
        assert (energies[0] - energies[1]) / (2 * h) == pytest.approx(power, abs=3e-5 * scale)


@pytest.mark.parametrize("joint", ["none", *JOINTS])
def test_joint_forces_move_crosshead_and_rod(joint):
    """Newton on the crosshead (x) and on crosshead plus rod, whatever the scene."""
    p, rng = record(case(joint)), np.random.default_rng(3)
    for t in np.linspace(0.001, 0.11, 12):
        y = np.zeros(4) if joint == "none" else random_state(joint, rng)
        row = row_at(p, t, y)
        small_x = row[Column.FORCE + 2]
        push = -row[Column.PISTON_FORCE] - small_x
        assert push == pytest.approx(p.reciprocating_mass * row[Column.ACCELERATION], abs=1e-7)


@pytest.mark.parametrize("joint", JOINTS)
def test_eccentricity_matches_the_positions(joint):
    """The difference identities against plain trigonometry of the positions."""
    p, rng = record(case(joint)), np.random.default_rng(4)
    for t in np.linspace(0.001, 0.11, 12):
        y = random_state(joint, rng)
        row = row_at(p, t, y)
        theta, phi = p.omega * t, row[Column.ROD_ANGLE]
        pin = p.crank_radius * np.array([math.cos(theta), math.sin(theta)])
        rod = p.rod_length * np.array([math.cos(phi), -math.sin(phi)])
        crosshead = np.array([row[Column.DISPLACEMENT], 0.0])
        found = row[Column.ECCENTRICITY : Column.ECCENTRICITY + 4].reshape(2, 2)
        # going round the loop: pin - e_big + rod + e_small = crosshead
        assert pin - found[0] + rod + found[1] == pytest.approx(crosshead, abs=1e-14)


@pytest.mark.parametrize("joint", JOINTS)
def test_initial_offset_shifts_the_journal(joint):
    shift = {"big_end_x": 0.05, "big_end_y": -0.08, "small_end_x": 0.02, "small_end_y": 0.11}
    one = case(joint, initial_offset_mm=shift)
    p = record(one)
    y = np.zeros(8 if joint == "both" else 4)
    start(offsets(one), y, p)
    found = row_at(p, 0.0, y, 0)[Column.ECCENTRICITY : Column.ECCENTRICITY + 4].reshape(2, 2)
    expected = offsets(one) * (p.clearance[:, None] > 0)
    assert found == pytest.approx(expected, abs=1e-17)

"""The general mechanism: Lagrange's equations by SymPy for each combination, scenes, energy."""

import itertools
import math

import numpy as np
import pytest
import sympy
from sympy.printing.pycode import PythonCodePrinter

from compressor.cases.case import Case
from compressor.metrics import JOINTS
from compressor.physics.kinematics import ideal
from compressor.physics.mechanism import ACROSS, BIG_SLOPE, SMALL_SLOPE, shapes, solve
from compressor.physics.observe import COLUMNS, WIDE, Column
from compressor.physics.record import (
    Coordinate,
    find_coordinates,
    new_record,
    place_coordinates,
    state_names,
)
from compressor.physics.systems import derivative, observe_at
from compressor.solve.si_record import record

SCENES = ("none", *JOINTS, "both")
FEATURES = ("driven", "tilting", "elastic")
COMBINATIONS = [
    (joint, {name for name, on in zip(FEATURES, some, strict=True) if on})
    for joint in SCENES
    for some in itertools.product((False, True), repeat=len(FEATURES))
]
NUMBERS = {
    "crank_inertia": 0.4, "unbalance": 0.3, "torque": 90.0, "torque_slope": 12.0,
    "guide_clearance": 2e-4, "guide_length": 0.06, "guide_height": 0.04, "guide_stiffness": 1e10,
    "guide_friction": 0.05, "guide_stiction": 0.01, "crosshead_inertia": 0.03,
    "guide_exponent": 1.5, "guide_damping": 3.36e5, "per_guide_full_damping": 1e4,
    "axial_stiffness": 3.4e8, "bending_stiffness": 1.3e5, "rod_damping": 1e-6,
}  # fmt: skip
# natural sizes of the coordinates and of their rates
SIZES = np.array([1.0, 2.5e-4, 2.5e-4, 2.5e-4, 2.5e-4, 2.2e-4, 1e-3, 1e-3, 2e-4, 1e-4, 1e-4])
RATES = np.array([50.0, 0.1, 0.1, 0.1, 0.1, 0.1, 1.0, 1.0, 0.5, 0.2, 0.2])


def featured(joint="none", features=(), values=None, **numbers):
    """A record of a case with features, their numbers those of NUMBERS."""
    clearance = {} if joint == "none" else {"joint": joint, "clearance_mm": 0.2}
    usual = record(Case.from_values(clearance | (values or {})))
    p = new_record(featured=True)
    for name in usual.dtype.names:
        p[name] = usual[name]
    for name, value in {**NUMBERS, **dict.fromkeys(features, 1), **numbers}.items():
        p[name] = value
    place_coordinates(p)
    return p


def state_of(p, w, rates):
    """The state of coordinates and their rates, (11,) each; the crank's speed is a rate."""
    y, n = np.zeros(len(state_names(p))), int(p["freedoms"])
    for place, coordinate in enumerate(find_coordinates(p)):
        y[place], y[n + place] = w[coordinate], rates[coordinate]
    if p["driven"]:
        y[p["at"][Coordinate.CRANK]] = rates[0] / p["omega"] - 1.0
    if p["carries"]:
        y[2 * n : 2 * n + 2] = p["least_approach"]
    return y


def random_motion(p, rng):
    """Coordinates and rates that a mechanism may have, zeros of what it does not."""
    w, rates = np.zeros(11), np.zeros(11)
    here = find_coordinates(p)
    w[here] = rng.normal(size=len(here)) * SIZES[here]
    rates[here] = rng.normal(size=len(here)) * RATES[here]
    w[0] = rng.uniform(0.0, 2.0 * math.pi)
    rates[0] = p["omega"] * (1.0 + (0.1 * rng.normal() if p["driven"] else 0.0))
    return w, rates


@pytest.fixture(scope="module")
def lagrange():
    """Mass matrix and the other side of Lagrange's equations, from the two energies.

    And A and b of the momentum of rod and crosshead, which changes by A w'' + b.

    The kinetic one is W_ij r_i' r_j' / 2 over positions r of the coordinates w, with SymPy's exact
    integrals over the rod in W. With J = dr/dw, two of Lagrange's terms are equal, second
    derivatives being symmetric, so that J^T W (J w'' + d(J w')/dw w') = -dV/dw.
    """
    fields = {
        "R": "crank_radius", "L": "rod_length", "m": "rod_mass", "I": "rod_inertia",
        "mp": "reciprocating_mass", "Jc": "crank_inertia", "unbalance": "unbalance",
        "Jp": "crosshead_inertia", "g": "gravity", "EA": "axial_stiffness",
        "EI": "bending_stiffness",
    }  # fmt: skip
    k = {name: sympy.Symbol(name) for name in fields}
    w, v = sympy.symbols("w0:11"), sympy.symbols("v0:11")
    s = sympy.Symbol("s")
    bore = k["R"] * sympy.Matrix([sympy.cos(w[0]), sympy.sin(w[0])]) - sympy.Matrix(w[1:3])
    length = k["L"] + w[10]
    sin_phi = (bore[1] + w[4] - w[5]) / length
    cos_phi = sympy.sqrt(1 - sin_phi**2)
    along, across = sympy.Matrix([cos_phi, -sin_phi]), sympy.Matrix([sin_phi, cos_phi])
    shapes = [sympy.Integer(1), s, sympy.sin(sympy.pi * s), sympy.sin(2 * sympy.pi * s),
              4 * s * (1 - s), s * (2 * s - 1)]  # fmt: skip
    places = [bore, k["L"] * along, w[7] * across, w[8] * across, w[9] * along, w[10] * along]
    x = bore[0] + length * cos_phi + w[3]
    positions = sympy.Matrix([*places, [x], [w[5]], [sympy.asin(sin_phi)], [w[6]], [w[0]]])
    inertia = sympy.zeros(17)
    for i, j in itertools.combinations_with_replacement(range(6), 2):
        mean = k["m"] * sympy.integrate(shapes[i] * shapes[j], (s, 0, 1))
        for one, other in ((2 * i, 2 * j), (2 * i + 1, 2 * j + 1)):
            inertia[one, other] = inertia[other, one] = mean
    own = [k["mp"], k["mp"], k["I"] - k["m"] * k["L"] ** 2 / 12, k["Jp"], k["Jc"]]
    for i, one in enumerate(own):
        inertia[12 + i, 12 + i] = one
    means = [sympy.integrate(one, (s, 0, 1)) for one in shapes]
    height = sum((mean * place[1] for mean, place in zip(means, places, strict=True)), 0)
    stored = k["g"] * (k["m"] * height + k["mp"] * w[5] + k["unbalance"] * sympy.sin(w[0]))
    stretch = sympy.diff(w[9] * shapes[4] + w[10] * shapes[5], s)
    bend = sympy.diff(w[7] * shapes[2] + w[8] * shapes[3], s, 2)
    stored += k["EA"] / 2 * sympy.integrate(sympy.expand(stretch**2), (s, 0, 1))
    stored += k["EI"] / 2 * sympy.integrate(sympy.expand(bend**2), (s, 0, 1))
    jacobian, rates = positions.jacobian(w), sympy.Matrix(v)
    bias = (jacobian * rates).jacobian(w) * rates
    pushed = [-sympy.diff(stored, one) for one in w]
    parts = jacobian.tolist(), list(bias), inertia.tolist(), pushed
    unsorted = PythonCodePrinter({"order": "none", "fully_qualified_modules": False})
    evaluate = sympy.lambdify(
        (w, v, tuple(k.values())), parts, modules="math", cse=True, printer=unsorted
    )

    def equations(w, v, p):
        found = evaluate(w, v, [p[name] for name in fields.values()])
        jacobian, bias, inertia, pushed = (np.array(part, float) for part in found)
        carried = jacobian.T @ inertia
        parts = inertia[[0, 1, 12, 13]]  # of the rod, whose first shape is 1, and crosshead
        return (
            carried @ jacobian, pushed - carried @ bias, parts @ jacobian, parts @ bias
        )  # fmt: skip

    return equations


@pytest.mark.parametrize(("joint", "features"), COMBINATIONS)
def test_accelerations_are_lagranges(lagrange, joint, features):
    """In free flight: between contacts, with weight, a motor's torque and an elastic rod."""
    values = {"load": "none", "machine": {"gravity_m_per_s2": 9.81, "rod_inertia_kg_m2": 0.15}}
    p = featured(joint, features, values, rod_damping=0.0, guide_friction=0.0)
    if not any(p["at"] >= 0):
        return
    rng = np.random.default_rng(11)
    far = {"clearance": [1.0 * (p["clearance"][i] > 0) for i in range(2)], "guide_clearance": 1.0}
    for name, value in far.items():
        p[name] = value
    moving = [int(one) for one in Coordinate if p["at"][one] >= 0]
    for _ in range(5):
        w, rates = random_motion(p, rng)
        t = w[0] / p["omega"]
        mass, other, _, _ = lagrange(w, rates, p)
        torque = p["torque"] + p["torque_slope"] * (p["omega"] - rates[0])
        force = other + np.eye(11)[0] * torque
        expected = np.linalg.solve(mass[np.ix_(moving, moving)], force[moving])
        y = state_of(p, w, rates)
        solve(ideal(t, p), y, 1, p)
        assert p["accelerations"][moving] == pytest.approx(expected, rel=1e-9, abs=1e-7)
        kinetic = 0.5 * rates @ mass @ rates
        row = np.empty(COLUMNS)
        observe_at(t, y, 1, p, row)
        assert row[Column.KINETIC] == pytest.approx(kinetic, rel=1e-12)


@pytest.mark.parametrize("unbalance", [0.3, -9.0])
@pytest.mark.parametrize(("joint", "features"), COMBINATIONS)
def test_the_frame_takes_the_momentum_that_the_parts_lose(lagrange, joint, features, unbalance):
    """Less their weight, in all and part by part; with load, contacts, all friction and a crank out
    of balance, towards its pin or opposite to it by a counterweight."""
    values = {"load": "gas", "machine": {"gravity_m_per_s2": 9.81}}
    p = featured(joint, features, values, rubbing=1, unbalance=unbalance)
    rng = np.random.default_rng(5)
    for _ in range(3):
        w, rates = random_motion(p, rng)
        t, y = w[0] / p["omega"], state_of(p, w, rates) if state_names(p) else np.zeros(4)
        solve(ideal(t, p), y, 1, p)
        gained = p["accelerations"]
        _, _, slope, bias = lagrange(w, rates, p)
        along = np.array([math.cos(w[0]), math.sin(w[0])])
        across = np.array([-along[1], along[0]])
        unbalance = p["unbalance"] * (gained[0] * across - rates[0] ** 2 * along)
        # what the rod and the crosshead gain, and what holds their weight
        rod, crosshead = (slope @ gained + bias).reshape(2, 2)
        rod[1] += p["gravity"] * p["rod_mass"]
        crosshead[1] += p["gravity"] * p["reciprocating_mass"]
        row = np.empty(WIDE)
        observe_at(t, y, 1, p, row)
        on_rod = row[Column.FORCE : Column.FORCE + 4].reshape(2, 2)
        lost, on_guide = -(rod + crosshead + unbalance), -on_rod[1] - crosshead
        limit = 1e-11 * (np.abs(lost).max() + row[Column.FORCE_SIZE : Column.FORCE_SIZE + 2].max())
        assert on_rod.sum(axis=0) == pytest.approx(rod, abs=limit)
        parts = {Column.SHAKING_FORCE: lost, Column.BEARING_FORCE: lost - on_guide,
                 Column.GUIDE_FORCE: on_guide[1:]}  # fmt: skip
        for column, expected in parts.items():
            assert row[column : column + expected.size] == pytest.approx(expected, abs=limit)


@pytest.mark.parametrize("forces", ["plain", "oil", "card"])
@pytest.mark.parametrize("gravity", [0, 9.81])
@pytest.mark.parametrize("joint", SCENES)
def test_a_scene_is_the_mechanism_without_features(joint, gravity, forces, tmp_path):
    """All that is observed, at random states: the hand-written equations are its special cases."""
    values = {"machine": {"gravity_m_per_s2": gravity, "rod_centre_mm": 250}}
    if forces == "oil" and joint != "none":
        values["lubricant"] = {"viscosity_mPa_s": 60, "bearing_length_mm": 15}
    if forces == "card":
        card = tmp_path / "card.csv"
        lines = (f"{k},{0.5 + 0.3 * math.cos(math.radians(k + 20)):.6f}" for k in range(360))
        card.write_text("crank_angle_deg,pressure_MPa\n" + "\n".join(lines), encoding="utf-8")
        values |= {"load": "gas", "gas": {"indicator": str(card)}}
    q = featured(joint, (), values, crank_inertia=0.0, unbalance=-0.3, guide_friction=0.0)
    clearance = {} if joint == "none" else {"joint": joint, "clearance_mm": 0.2}
    p = record(Case.from_values(clearance | values))
    p["unbalance"] = q["unbalance"]
    rng = np.random.default_rng(1)
    n = int(p["freedoms"])
    for t in np.linspace(0.001, 0.11, 9):
        y, z = np.zeros(len(state_names(p)) or 4), np.zeros(len(state_names(q)))
        if joint != "none":
            y[: 2 * n] = z[: 2 * n] = rng.normal(size=2 * n) * np.repeat([2.5e-4, 0.12], n)
        expected, found = np.empty(WIDE), np.empty(WIDE)
        observe_at(t, y, 1, p, expected)
        observe_at(t, z, 1, q, found)
        expected, found = expected[: Column.GUIDE_GAP], found[: Column.GUIDE_GAP]
        # a scene's ledger leaves out the weight of what is out of balance: nil over a revolution
        weight, angle = q["unbalance"] * gravity, q["omega"] * t
        found[Column.CRANK_POWER] -= weight * q["omega"] * math.cos(angle)
        found[Column.POTENTIAL] -= weight * math.sin(angle)
        floor = 1e-12 * np.abs(expected).max()
        assert found == pytest.approx(expected, rel=1e-11, abs=floor)


@pytest.mark.parametrize("unbalance", [0.3, -9.0])
@pytest.mark.parametrize(("joint", "features"), COMBINATIONS)
def test_energy_changes_by_the_powers(joint, features, unbalance):
    """dE/dt along the equations of motion equals the powers, with contacts and all friction.

    And what a record has served before leaves no bit in the next evaluation.
    """
    how = joint, features, {"machine": {"gravity_m_per_s2": 9.81}}
    p = featured(*how, rubbing=1, unbalance=unbalance)
    rng = np.random.default_rng(3)
    y = np.zeros(len(state_names(p)) or 4)
    for t in np.linspace(0.001, 0.11, 7):
        if state_names(p):
            w, rates = random_motion(p, rng)
            y = state_of(p, w, rates)
        rate, row, alone = np.zeros_like(y), np.empty(COLUMNS), np.empty(COLUMNS)
        derivative(t, y, 1, p, rate)
        observe_at(t, y, 1, p, row)
        observe_at(t, y, 1, featured(*how, rubbing=1, unbalance=unbalance), alone)
        assert row.tobytes() == alone.tobytes()
        h, energies = 1e-8, []
        for s in (h, -h):
            moved = np.empty(COLUMNS)
            observe_at(t + s, y + s * rate, 1, p, moved)
            energies.append(moved[Column.KINETIC] + moved[Column.POTENTIAL])
        power = row[Column.CRANK_POWER] + row[Column.LOAD_POWER]
        power -= row[Column.CONTACT_POWER] + row[Column.FRICTION_POWER]
        pace = 1.0 / (1.0 + y[p["at"][0]]) if p["driven"] else 1.0
        scale = np.abs(row[Column.CRANK_POWER : Column.KINETIC]).sum() + 1e-8 * sum(energies) / h
        change = (energies[0] - energies[1]) / (2.0 * h)
        assert change == pytest.approx(power * pace, abs=1e-4 * scale)
        assert row[Column.FRICTION_POWER] >= 0.0
        if not p["driven"]:  # the torque does the crank's work
            weight = p["gravity"] * p["unbalance"] * math.cos(p["omega"] * t)
            done = (row[Column.CRANK_TORQUE] + weight) * p["omega"]
            assert done == pytest.approx(row[Column.CRANK_POWER], abs=1e-9 * scale)


def test_ideal_joints_rub_by_their_forces():
    """The loss: mu r |F| at each pin, times how fast it turns in its bore, by closed formulas."""
    values = {
        "load": "gas",
        "machine": {"pin_radius_mm": 20},
        "friction": {"dynamic": 0.1, "ideal_joints": True},
    }
    p = featured("none", (), values, rubbing=1, guide_friction=0.0)
    for angle in (-0.4, 0.1, 0.3):  # both pins slide faster than friction depends on their speed
        row = np.empty(COLUMNS)
        observe_at(angle / p["omega"], np.zeros(4), 1, p, row)
        forces = np.hypot(*row[Column.FORCE : Column.FORCE + 4].reshape(2, 2).T)
        tilt = math.asin(p["crank_ratio"] * math.sin(angle))
        rod = p["omega"] * p["crank_ratio"] * math.cos(angle) / math.cos(tilt)
        lost = 0.1 * 0.02 * forces @ [p["omega"] + rod, rod]
        assert row[Column.FRICTION_POWER] == pytest.approx(lost, rel=1e-12)


def test_the_rod_s_ends_turn_with_its_shapes():
    """By how much each mode turns an end: the slope of its shape there, times the length."""
    step = 1e-6
    for slopes, end in ((BIG_SLOPE, 0.0), (SMALL_SLOPE, 1.0)):
        before, after = shapes(np.array([end - step])), shapes(np.array([end + step]))
        found = (after - before)[:, 0] / (2.0 * step)
        np.testing.assert_allclose(slopes[:ACROSS], found[:ACROSS], rtol=1e-9)
        assert not slopes[ACROSS:].any()  # what stretches it turns nothing

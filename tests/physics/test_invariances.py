"""Invariances of the whole program over random scenes, each with its bound and why that is it.

The compiled march is driven by a record (SI) and a `Request`, as `simulate` drives it. Scenes are
drawn from a range in which friction's stiffness does not decide (`scenes`). Whatever has no switch
but a number (gravity, back pressure, the spring's damping) is off at its neutral value already.
"""

import itertools

import numpy as np
import pytest
from conftest import jobs_here, write_cases
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from stores_compared import contents

from compressor.cases.case import Case
from compressor.cases.load import load_studies
from compressor.metrics import METRICS
from compressor.physics.observe import COLUMNS, Column
from compressor.physics.record import FREEDOMS, derive
from compressor.physics.systems import observe_all, start
from compressor.solve.request import Request
from compressor.solve.run import integrate
from compressor.solve.si_record import offsets, record, scene
from compressor.solve.simulate import measure
from compressor.sweep.sweep import sweep

pytestmark = pytest.mark.compiled
FEW = settings(max_examples=25, deadline=None, derandomize=True,
               suppress_health_check=[HealthCheck.too_slow])  # fmt: skip
JOINTS = st.sampled_from(["big_end", "small_end", "both"])
LOADS = st.sampled_from(["spring", "gas", "none"])
QUARTER = 0.25  # revolutions
# Runs that take other steps: an error of acceleration is a hundred tolerances as a rule, but was a
# hundred thousand in scenes whose light pieces part and meet again and again
RTOL, BOUND = 1e-11, 1e-5


@st.composite
def scenes(draw, joints=JOINTS, loads=LOADS, friction=None):
    """Values of a case: clearance 0.03-1 mm, rod 2-8 kg, recipr. mass 4-25 kg, 300-1500 rpm."""

    def between(low, high):
        return float(f"{draw(st.floats(low, high)):.4g}")

    values = {
        "joint": draw(joints),
        "load": draw(loads),
        "clearance_mm": float(f"{10 ** between(-1.5, 0):.4g}"),
        "machine": {
            "rod_mass_kg": between(2, 8),
            "reciprocating_mass_kg": between(4, 25),
            "speed_rpm": between(300, 1500),
        },
    }
    return values if friction is None else {**values, "friction": friction}


def request(values, rtol, turns=QUARTER, samples=300, method="auto"):
    case = Case.from_values(values)
    p = record(case)
    y = np.zeros(2 * FREEDOMS[scene(case)])
    start(offsets(case), y, p)
    times = turns * case.turn * (np.arange(samples + 1) / samples)
    return Request(p, y, times, 0.0, rtol, method)


def accelerations(p, found):
    """At the samples of a run, which must have reached its end."""
    assert found.reason == ""
    rows = np.empty((found.times.size, COLUMNS))
    observe_all(found.times, found.states, found.phases, p, rows)
    return rows[:, Column.ACCELERATION]


def apart(one, other):
    return float(np.linalg.norm(one - other) / np.linalg.norm(other))


# ---- mirror: y -> -y, omega -> -omega


def mirrored(y):
    """A state with its positions and rates along y turned."""
    return y * np.resize([1.0, -1.0], y.shape[-1])


@FEW
@given(scenes(loads=st.just("none"), friction=False), st.floats(-0.9, 0.9))
def test_a_mirrored_machine_moves_alike_to_the_bit(values, share):
    """Nothing but signs changes in any operation of the explicit method (the stiff partner takes
    its differences to one side, and STEP's rounding is not symmetrical)."""
    asked = request(values, 1e-6, method="TSIT5")
    asked.start[asked.start.size // 2 - 1] = share * values["clearance_mm"] * 1e-3
    found = integrate(asked)
    asked.p.omega, asked.start = -asked.p.omega, mirrored(asked.start)
    other = integrate(asked)
    assert found.reason == other.reason == ""
    np.testing.assert_array_equal(mirrored(other.states), found.states)
    assert other.steps == found.steps


# ---- units

# exponents of length, mass and time of what is no pure number and is not derived; the contact
# stiffness has length ** (1 - p) as well
DIMENSIONS = {
    "omega": (0, 0, -1), "crank_radius": (1, 0, 0), "rod_length": (1, 0, 0),
    "rod_mass": (0, 1, 0), "rod_centre": (1, 0, 0), "rod_inertia": (2, 1, 0),
    "reciprocating_mass": (0, 1, 0), "gravity": (1, 0, -2), "unbalance": (1, 1, 0),
    "pin_radius": (1, 0, 0), "clearance": (1, 0, 0), "damping": (0, 1, -1),
    "full_damping": (1, 0, 0),
    "stiction_velocity": (1, 0, -1), "friction_velocity": (1, 0, -1),
    "suction_force": (1, 1, -2), "discharge_force": (1, 1, -2), "back_force": (1, 1, -2),
    "head_clearance": (1, 0, 0), "spring_stiffness": (0, 1, -2), "spring_damping": (0, 1, -1),
    "preload": (1, 1, -2), "spring_stroke": (1, 0, 0), "least_approach": (1, 0, -1),
    "bristle_stiffness": (-1, 0, 0), "bristle_damping": (-1, 0, 1), "viscous": (-1, 0, 1),
    "crank_suction_force": (1, 1, -2), "crank_discharge_force": (1, 1, -2),
    "crank_clearance": (1, 0, 0),
}  # fmt: skip


def in_other_units(p, length, mass, time):
    """The record with every quantity told in units that are shorter by these factors."""
    other = p.copy()
    for name, (a, b, c) in DIMENSIONS.items():
        other[name] = p[name] * length**a * mass**b * time**c
    other["stiffness"] = p["stiffness"] * length ** (1 - p["exponent"]) * mass / time**2
    derive(other)
    return other


SHIFTS = st.integers(-10, 10)


@FEW
@given(scenes(friction=False), SHIFTS, SHIFTS, SHIFTS)
def test_units_touch_a_run_within_its_tolerance(values, a, b, c):
    """Not to the bit: natural sizes go through `**`, which rounds otherwise, and Hairer's first
    step takes the fifth root of a rate. With friction, rounding would decide at which step the
    stiff partner takes over."""
    length, mass, time = 4.0**a, 2.0**b, 2.0**c
    asked = request(values, RTOL)
    found = accelerations(asked.p, integrate(asked))
    p = in_other_units(asked.p, length, mass, time)
    begin = asked.start * np.repeat([length, length / time], asked.start.size // 2)
    other = integrate(Request(p, begin, asked.times * time, 0.0, RTOL))
    assert apart(accelerations(p, other) * time**2 / length, found) < BOUND


# ---- time


@FEW
@given(scenes(friction=False))
def test_a_run_goes_on_as_one_that_begins_a_turn_earlier(values):
    """Restarted from its state after a turn, but at time 0: within the errors of both."""
    asked = request(values, RTOL, turns=1 + QUARTER, samples=500)
    whole = integrate(asked)
    again = Request(asked.p, whole.states[400], asked.times[:101], 0.0, RTOL)
    second = accelerations(asked.p, whole)[400:]
    assert apart(accelerations(asked.p, integrate(again)), second) < BOUND


# ---- workers and order

SWEPT = {
    "joint": ["both", "big_end"], "clearance_mm": [0.1, 0.2], "load": ["spring", "none"],
    "solve": {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft"},
}  # fmt: skip


def swept(folder, workers, values):
    """A digest of what a sweep stores of each job, timings apart."""
    sweep(load_studies(*write_cases(folder, one=values)), folder / "out", workers)
    return contents(folder / "out")


def test_workers_and_order_change_no_bit(tmp_path):
    backwards = {key: v[::-1] if isinstance(v, list) else v for key, v in SWEPT.items()}
    with jobs_here():
        first = swept(tmp_path / "one", 1, SWEPT)
    assert len(first) == 8
    assert swept(tmp_path / "two", 2, backwards) == first


# ---- features that are off


@pytest.mark.parametrize("joint", ["big_end", "small_end", "both"])
def test_a_joint_without_clearance_costs_nothing(joint):
    """It is the ideal one to the bit, whatever it is called; no integrator is called."""
    ideal, named = (
        measure(Case.from_values({"solve": {"duration_rev": 1, "settle_rev": 0}, **values}))
        for values in ({}, {"joint": joint, "clearance_mm": 0})
    )
    for name in METRICS:
        np.testing.assert_array_equal(ideal.numbers[name], named.numbers[name])
    assert named.numbers["evaluations"] == 0


# ---- vanishing clearance


@settings(FEW, max_examples=6)
@given(scenes())
def test_a_clearance_that_vanishes_leaves_the_ideal_machine(values):
    """With the contact scaled along (K as c^-1.5, d_max as c, C_max as c^-0.5) the deviation goes
    as c: slope 1 within 0.1 in every decade from 1 mm to 1 micrometre, and on to a nanometre."""
    sizes, moved = np.array([1.0, 0.1, 0.01, 0.001, 1e-6]), []
    for size in sizes:
        contact = {
            "stiffness_N_per_mm15": 3.36e5 * size**-1.5,
            "full_damping_mm": 0.1 * size,
            "damping_N_s_per_mm": 336 * size**-0.5,
        }
        found = integrate(request({**values, "clearance_mm": size, "contact": contact}, 2e-5, 0.1))
        assert found.reason == ""
        moved.append(np.abs(found.states[:, 0]).max())
    assert (np.diff(np.log(moved)) / np.diff(np.log(sizes))) == pytest.approx(1.0, abs=0.1)


# ---- tolerance

LADDER = [10.0**-k for k in range(3, 11)]


@pytest.mark.parametrize(
    "more",
    [{}, *({"load": load, "friction": False} for load in ("spring", "gas", "none"))],
    ids=["paper", "spring", "gas", "none"],
)
@pytest.mark.parametrize("joint", ["big_end", "small_end", "both"])
def test_errors_are_proportional_to_the_tolerance(joint, more):
    """Slope 0.75 to 1.25 of the error of acceleration over seven decades (0.79 as products round).

    No rung is twice as bad as the one before: which of two is worse may be a matter of rounding.
    """
    values = {"joint": joint, "clearance_mm": 0.2, **more}
    asked = request(values, 1e-12)
    exact = accelerations(asked.p, integrate(asked))
    errors = []
    for asked.rtol in LADDER:
        errors.append(apart(accelerations(asked.p, integrate(asked)), exact))
    assert np.polyfit(np.log(LADDER), np.log(errors), 1)[0] == pytest.approx(1, abs=0.25)
    assert all(later < 2.0 * before for before, later in itertools.pairwise(errors))

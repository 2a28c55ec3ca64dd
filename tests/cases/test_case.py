"""The case: what makes it the same job, what it fills in, and what it refuses."""

import copy

import pytest
from hypothesis import given
from hypothesis import strategies as st

from compressor.cases.case import Case
from compressor.cases.parameter import ACCURACY, CaseError, to_si
from compressor.cases.table import table
from compressor.program import CompsimError
from compressor.solve.simulate import simulate

BIG_END = {"joint": "big_end", "clearance_mm": 0.1}
WORN = {"joint": "both", "clearance_mm": 0.2}
PAIRS = {"big_end": ["steel", "steel"], "small_end": ["steel", "copper"]}
LENGTHS = {"big_end": 20, "small_end": 15}
EXACT_GAS = {"switching": "exact"}
DOUBLE = {"action": "double", "rod_diameter_mm": 30}
CYLINDERS = (
    EXACT_GAS, DOUBLE, {"unloaded": "head"}, {"exponent": 1.3, **EXACT_GAS},
    {"piston_radius_mm": 60, "back_pressure_MPa": 0.1},
    {"action": "crank_end", "rod_diameter_mm": 30, "clearance_percent": 12},
    {"action": "crank_end", "rod_diameter_mm": 30, "clearance_percent": {"crank": 14}},
    {**DOUBLE, "clearance_percent": {"head": 12, "crank": 14}},
)  # fmt: skip


# Identity


@pytest.mark.parametrize(
    "values",
    [
        {"name": "other"},
        {"output": {"keep": "metrics"}},
        {"solve": {"timeout_s": 5}},
        {"solve": {"duration_s": 0.48, "output_step_s": 1e-4}},
        {"solve": {"error_bars": False}},
        {"machine": {"rod_centre_mm": 300, "gravity_m_per_s2": -0.0}},
        {"load": "spring", "joint": "none"},
    ],
)
def test_what_computes_the_same_has_one_key(values):
    assert Case.from_values(values).key == Case.from_values({}).key


@pytest.mark.parametrize(
    "values",
    [
        {"solve": {"accuracy": "fine"}},
        {"solve": {"rtol": ACCURACY["standard"].rtol}},
        {"solve": {"method": "BDF"}},
    ],
)
def test_how_it_is_solved_changes_the_key_but_not_the_physics(values):
    case, default = Case.from_values(values), Case.from_values({})
    assert case.key != default.key
    assert case.physics_key == default.physics_key


@pytest.mark.parametrize(
    "values",
    [
        {"machine": {"rod_mass_kg": 4.8}},
        {"load": "none"},
        {"friction": False},
        {"solve": {"settle_rev": 2}},
        {"solve": {"duration_rev": 5}},
        {"solve": {"output_step_deg": 0.6}},
        {**BIG_END, "contact": {"materials": ["steel", "steel"]}},
        BIG_END,
    ],
)
def test_what_computes_something_else_has_another_key(values):
    assert Case.from_values(values).physics_key != Case.from_values({}).physics_key


def test_a_clearance_that_no_joint_has_is_no_part_of_the_key():
    both = {"joint": "big_end", "clearance_mm": {"big_end": 0.1, "small_end": 0.2}}
    assert Case.resolve(both).key == Case.from_values(BIG_END).key


# What is filled in


@pytest.mark.parametrize(
    ("values", "centre", "inertia"),
    [
        ({}, 300.0, 0.141),  # the paper's rod, as a uniform bar
        ({"machine": {"rod_length_mm": 1200}}, 600.0, 4 * 0.141),
        ({"machine": {"rod_mass_kg": 9.4}}, 300.0, 2 * 0.141),
        ({"machine": {"rod_centre_mm": 0, "rod_inertia_kg_m2": 7}}, 0.0, 7.0),
    ],
)
def test_the_rod_is_uniform_unless_told(values, centre, inertia):
    machine = Case.from_values(values).machine
    assert machine.rod_centre_mm == centre
    assert machine.rod_inertia_kg_m2 == pytest.approx(inertia, rel=1e-14)


def test_a_value_of_none_is_the_default():
    values = {"contact": {"stiffness_N_per_mm15": None}, "solve": {"duration_rev": None}}
    assert Case.from_values(values) == Case.from_values({})


@pytest.mark.parametrize(
    ("joint", "expected"), [("big_end", (0.1, 0)), ("small_end", (0, 0.1)), ("both", (0.1, 0.1))]
)
def test_one_clearance_goes_to_the_joints_that_have_one(joint, expected):
    clearance = Case.from_values({"joint": joint, "clearance_mm": 0.1}).clearance_mm
    assert (clearance.big_end, clearance.small_end) == expected


def test_times_of_the_paper():
    case = Case.from_values({})
    assert (case.turn, case.duration, case.settle) == (0.12, 0.48, 0.12)
    assert case.steps == pytest.approx(4800, rel=1e-14)
    assert case.omega == pytest.approx(52.35987755982989, rel=1e-15)


def test_a_tenth_of_a_millimetre_is_exactly_1e_4_metres():
    assert to_si(0.1, "mm") == 1e-4


# What is refused


@pytest.mark.parametrize(
    "values",
    [
        {"load": "none", "spring": {"stroke_mm": 240}},
        {"load": "spring", "gas": {"discharge_MPa": 0.1}},
        {**BIG_END, "initial_offset_mm": {"small_end_x": 5}},
        {"lubricant": {"bearing_length_mm": 40}, "wear": True},
    ],
)
def test_what_is_not_simulated_is_not_checked(values):
    """A job of a sweep may have it, where another job reads it."""
    case = Case.resolve(values)
    assert Case.from_attribute(case.attributes()["case"]) == case


# Values


@pytest.mark.parametrize(
    "values",
    [
        {},
        BIG_END,
        {**BIG_END, "initial_offset_mm": {"big_end_x": 1.09}},
        {"joint": "both", "clearance_mm": {"big_end": 0.1, "small_end": 0.2}},
        {"clearance_mm": 0, "gas": {"back_pressure_MPa": 0}},  # what is off may be said to be off
        {"friction": False},
        {**BIG_END, "friction": {"law": "threlfall", "stiction_velocity_mm_per_s": 100}},
        {"solve": {"rtol": 1e-8}},
        {"solve": {"error_bars": False, "accuracy": {"rms_acceleration": 1e-3}}},
        {"solve": {"duration_s": 0.48, "output_step_s": 1e-4}},
        {**BIG_END, "contact": {"materials": ["steel", "copper"]}},
        {"guide": {"friction": 0.1}},
        {**BIG_END, "contact": {"law": "johnson", "length_mm": 20, "modulus_GPa": 110}},
        {**WORN, "machine": {"pin_radius_mm": {"big_end": 60, "small_end": 35}}},
        {**WORN, "lubricant": {"bearing_length_mm": {"big_end": 12, "small_end": 8}}},
        {**WORN, "contact": {"materials": PAIRS}},
        {**WORN, "contact": {"materials": ["steel", "copper"], "geometry": "external"}},
        {**WORN, "contact": {"law": "johnson", "materials": PAIRS, "length_mm": LENGTHS}},
        *({"load": "gas", "gas": gas} for gas in CYLINDERS),
    ],
)
def test_values_read_back_to_an_equal_case(values):
    case = Case.from_values(values)
    plain = case.values()
    assert Case.from_values(copy.deepcopy(plain)) == case
    assert Case.from_values(plain).key == case.key
    assert Case.from_attribute(case.attributes()["case"]) == case


@pytest.mark.parametrize(
    ("values", "switching", "back"),
    [
        ({}, "paper", 0.0),
        ({"gas": {"back_pressure_MPa": 0.1}}, "paper", 0.1),
        ({"gas": {"bore_mm": 220}}, "exact", 0.101325),
        ({"gas": {"bore_mm": 100}}, "exact", 0.101325),  # the paper's, but the file's own
        ({"gas": {"discharge_MPa": 0.5, "back_pressure_MPa": 0}}, "exact", 0.0),
        ({"gas": {"action": "single"}}, "exact", 0.101325),
        ({"gas": {"switching": "exact"}}, "exact", 0.0),
        ({"machine": {"stroke_mm": 180}}, "exact", 0.101325),
        ({"machine": {"rod_mass_kg": 5}}, "paper", 0.0),
    ],
)
def test_a_cylinder_of_one_s_own_has_exact_corners_and_the_atmosphere(values, switching, back):
    case = Case.from_values({"load": "gas", **values})
    assert (case.gas.switching, case.gas.back_pressure_MPa) == (switching, back)
    assert Case.from_values(case.values()) == case


def test_a_sweep_through_the_paper_s_value_keeps_one_s_own_cylinder(read):
    cases = read("load: gas\ngas: {discharge_MPa: [0.3, 0.393, 0.5]}").cases
    assert {(case.gas.switching, case.gas.back_pressure_MPa) for case in cases} == {
        ("exact", 0.101325)
    }


NUMBERS = [key for key, row in table().items() if row.kind in ("number", "integer")]


@given(
    st.sampled_from(["none", "big_end", "both"]),
    st.dictionaries(st.sampled_from(NUMBERS), st.floats() | st.integers(), max_size=4),
)
def test_any_number_is_either_refused_or_reads_back(joint, numbers):
    values: dict = {"load": "gas", "joint": joint, "gas": dict(EXACT_GAS)}
    if joint != "none":
        values["clearance_mm"] = {"big_end": 0.1, "small_end": 0.1}
    for key, number in numbers.items():
        group, _, name = key.partition(".")
        values.setdefault(group, {})[name] = number
    try:
        case = Case.from_values(values)
    except CaseError:
        return
    assert Case.from_values(case.values()) == case


@pytest.mark.parametrize(
    ("call", "value"),
    [
        (simulate, None),
        (simulate, {}),
        (Case.from_attribute, "{"),
        (Case.from_attribute, None),
        (Case.from_attribute, "[" * 10**5),
    ],
)
def test_values_of_another_kind_are_told(call, value):
    with pytest.raises(CompsimError, match="needs "):
        call(value)


def test_a_clearance_of_0_reads_back():
    """Such a job was stored and run, and could not be shown."""
    for values in ({"joint": "big_end", "clearance_mm": 0}, {"joint": "both", "clearance_mm": 0}):
        case = Case.from_values(values)
        assert Case.from_attribute(case.attributes()["case"]) == case
        assert Case.from_values(case.values()).key == case.key

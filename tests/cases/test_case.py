"""The case: what makes it the same job, what it fills in, and what it refuses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compressor.cases.case import Case
from compressor.cases.checks import known_keys
from compressor.cases.parameter import CaseError, to_si
from compressor.cases.table import table
from compressor.program import CompsimError
from compressor.solve.simulate import simulate

BIG_END = {"joint": "big_end", "clearance_mm": 0.1}


@pytest.mark.parametrize(
    "values",
    [
        {"solve": {"duration_s": 0.48, "output_step_s": 1e-4}},
        {"machine": {"rod_centre_mm": 300, "gravity_m_per_s2": -0.0}},
        {"load": "spring", "joint": "none"},
    ],
)
def test_what_computes_the_same_has_one_key(values):
    """Key by key: tests/cases/test_unread.py."""
    assert Case.from_values(values).key == Case.from_values({}).key


def test_a_clearance_that_no_joint_has_is_no_part_of_the_key():
    both = {"joint": "big_end", "clearance_mm": {"big_end": 0.1, "small_end": 0.2}}
    assert Case.resolve(both).key == Case.from_values(BIG_END).key


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


def test_a_tenth_of_a_millimetre_is_exactly_1e_4_metres():
    assert to_si(0.1, "mm") == 1e-4


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"joint": "both", "clearance_mm": 0},  # what is off may be said to be off
        {"clearance_mm": 0, "gas": {"back_pressure_MPa": 0}},
        {"solve": {"error_bars": False, "accuracy": {"rms_acceleration": 1e-3}}},
    ],
)
def test_values_read_back_to_an_equal_case(values):
    """Key by key: tests/cases/test_unread.py; key beside key: tests/cases/test_frozen.py."""
    case = Case.from_values(values)
    assert Case.from_values(case.values()) == case
    assert Case.from_attribute(case.attributes()["case"]) == case
    with pytest.raises(
        CaseError, match=r"another version \(speed: unknown.*run its case file again"
    ):
        Case.from_attribute('{"speed": 700}')


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
    values: dict = {"load": "gas", "joint": joint, "gas": {"switching": "exact"}}
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
    [(simulate, {}), (Case.from_attribute, "{"), (Case.from_attribute, "[" * 10**5)],
)
def test_values_of_another_kind_are_told(call, value):
    with pytest.raises(CompsimError, match="needs "):
        call(value)


# Mistakes that no file holds: mistakes.json has the others

WORN = {"joint": "big_end", "clearance_mm": 0.2}
AT_TOP = ", ".join(known_keys(""))
IN_MACHINE = ", ".join(known_keys("machine"))


def told(values) -> list[str]:
    with pytest.raises(CaseError) as caught:
        Case.from_values(values)
    return str(caught.value).split("\n")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"clearance_mm": [0.1, 0.2]},
         "clearance_mm: needs a number in [0, 1000] mm, not [0.1, 0.2]"),
        ({"machine": {"speed_rpm": np.array([300.0, 500.0])}},
         "machine.speed_rpm: needs a number in (0, 100000] rpm, not array([300., 500.])"),
        ({"machine": {"speed_rpm": {"range": [300, 500, 50]}}},
         "machine.speed_rpm: needs a number in (0, 100000] rpm, not {'range': [300, 500, 50]}"),
        ({"sample": {"n": 64}}, f"sample: unknown key; a case has {AT_TOP}"),
        ({"rotating": 5}, "rotating: unknown key; did you mean machine.balance.rotating?"),
        ({1: 2}, f"1: unknown key; a case has {AT_TOP}"),
        ({"machine": {1: 2}}, f"machine.1: unknown key; machine has {IN_MACHINE}"),
        ({"clearance_diametral_mm": 10**400},
         "clearance_diametral_mm: unknown key; write clearance_mm: inf, which is radial"),
        ({"machine": None}, "machine: has no value; leave the key out to get its default"),
        ({"solve": {"accuracy": []}},
         "solve.accuracy: needs draft, standard, fine or reference, or errors by metric such as "
         "{peak_acceleration: 0.01}, not []"),
        ({"solve": {"max_steps": float("inf")}},
         "solve.max_steps: must be finite: needs a whole number in [1, 1e+12], not inf"),
        ({"machine": {"rod_mass_kg": 10**400}},
         "machine.rod_mass_kg: must be finite: needs a number in (0, 1e+06] kg, not "
         f"1{'0' * 27}...{'0' * 29}"),
    ],
    ids=lambda part: str(part)[:40],
)  # fmt: skip
def test_values_that_no_file_holds(values, message):
    assert told(WORN | values) == [message]


@pytest.mark.parametrize("values", [5, "big-end.yaml", [WORN], None])
def test_what_is_no_mapping_is_told_how_one_looks(values):
    (message,) = told(values)
    assert message.startswith(
        "needs a mapping of keys, such as {'joint': 'big_end', 'clearance_mm': 0.2}, not "
    )
    assert issubclass(CaseError, ValueError)  # as callers in Python catch it


def test_numbers_words_and_truths_of_numpy_are_such():
    for number in (0.25, np.float64(0.25), np.float32(0.25), np.array(0.25)):
        case = Case.from_values({"joint": "big_end", "clearance_mm": number})
        assert (case.clearance_mm.big_end, type(case.clearance_mm.big_end)) == (0.25, float)
    solve = {"max_steps": np.int64(1000), "error_bars": np.bool_(False), "method": np.str_("BDF")}
    found = Case.from_values({"solve": solve}).solve
    assert (found.max_steps, found.error_bars, found.method) == (1000, False, "BDF")
    assert [type(v) for v in (found.max_steps, found.error_bars)] == [int, bool]

"""What `Case.from_values` says of mistakes: key, what was given, what is allowed, what to do.

Each is compared with what a case file with the same mistake is told, where a file can have it.
"""

import json

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.cases.checks import known_keys
from compressor.cases.load import CaseFileError, load_cases
from compressor.cases.parameter import CaseError
from compressor.program import CompsimError

WORN = {"joint": "big_end", "clearance_mm": 0.2}
AT_TOP = ", ".join(known_keys("", file=False))
IN_MACHINE = ", ".join(known_keys("machine"))


def told(values) -> list[str]:
    with pytest.raises(CaseError) as caught:
        Case.from_values(values)
    return str(caught.value).split("\n")


# mistakes that a case file can have, too
SHARED = [
    ({"machine": {"rod_mass": 3}},
     "machine.rod_mass: unknown key; did you mean machine.rod_mass_kg?"),
    ({"machine": {"mass": 3}},
     "machine.mass: unknown key; did you mean machine.rod_mass_kg or "
     "machine.reciprocating_mass_kg?"),
    ({"rpm": 700}, "rpm: unknown key; did you mean machine.speed_rpm?"),
    ({"machine.speed_rpm": 700}, "machine.speed_rpm: unknown key; write speed_rpm inside machine"),
    ({"machine": {"qqq": 1}}, f"machine.qqq: unknown key; machine has {IN_MACHINE}"),
    ({"machine": {"speed_rpm": "700 rpm"}},
     "machine.speed_rpm: needs a number in (0, 100000] rpm, not '700 rpm'; write 700"),
    ({"machine": {"crank_radius_mm": "0.12 m"}},
     "machine.crank_radius_mm: needs a number in (0, 100000] mm, not '0.12 m'; "
     "write a number alone, in mm"),
    ({"machine": {"rod_mass_kg": "4,7"}},
     "machine.rod_mass_kg: needs a number in (0, 1e+06] kg, not '4,7'; write 4.7"),
    ({"solve": {"rtol": "1e-6"}},
     "solve.rtol: needs a number in [1e-13, 0.1], not '1e-6'; write 1e-6 without quotes"),
    ({"machine": {"rod_mass_kg": True}},
     "machine.rod_mass_kg: needs a number in (0, 1e+06] kg, not true"),
    ({"machine": {"rod_mass_kg": 0}}, "machine.rod_mass_kg: 0 is outside (0, 1e+06] kg"),
    ({"machine": {"rod_mass_kg": -4.7}},
     "machine.rod_mass_kg: -4.7 is outside (0, 1e+06] kg"),
    ({"solve": {"max_steps": 1.5}},
     "solve.max_steps: needs a whole number in [1, 1e+12], not 1.5"),
    ({"solve": {"duration_rev": "atuo"}},
     "solve.duration_rev: needs auto or a number in (0, 100000] rev, not 'atuo'; "
     "did you mean auto?"),
    ({"solve": {"error_bars": "True"}},
     "solve.error_bars: needs true or false, not 'True'; did you mean true?"),
    ({"solve": {"error_bars": 1}}, "solve.error_bars: needs true or false, not 1"),
    ({"name": ".hidden"},
     "name: '.hidden' is no name: use [A-Za-z0-9._-], at most 64, no leading dot"),
    ({"solve": {"accuracy": "finer"}},
     "solve.accuracy: needs draft, standard, fine or reference, or errors by metric such as "
     "{peak_acceleration: 0.01}, not 'finer'; did you mean fine?"),
    ({"solve": {"accuracy": {"peak_aceleration": 0.01}}},
     "solve.accuracy.peak_aceleration: unknown metric; did you mean peak_acceleration or "
     "rms_acceleration?"),
    ({"load": "sprnig"}, "load: needs spring, gas or none, not 'sprnig'; did you mean spring?"),
    ({"name": "my case"},
     "name: 'my case' is no name: use [A-Za-z0-9._-], at most 64, no leading dot"),
    ({"contact": {"materials": ["steel"]}},
     "contact.materials: needs a pair of materials, steel or copper, such as [steel, steel], "
     "not ['steel']"),
    ({"contact": {"materials": ["steel", "coper"]}},
     "contact.materials: needs a pair of materials, steel or copper, such as [steel, steel], "
     "not ['steel', 'coper']; did you mean copper?"),
    ({"machine": 700},
     "machine: needs a mapping of keys, such as {crank_radius_mm: 120}, not 700"),
    ({"friction": True},
     "friction: needs false or a mapping of keys, such as {static: 0.23}, not true"),
    ({"machine": {"rod_mass_kg": None}},
     "machine.rod_mass_kg: has no value; leave the key out to get its default"),
    ({"clearance_mm": 11}, "clearance_mm: 11 mm exceeds the pin radius, 10 mm: lower it"),
    ({"spring": {"stroke_mm": 240}},
     "spring.stroke_mm: 240 mm must be less than the piston's stroke, 240 mm"),
    ({"friction": {"stiction_velocity_mm_per_s": 100}},
     "friction.friction_velocity_mm_per_s: 100 mm/s must exceed the stiction_velocity_mm_per_s, "
     "100 mm/s"),
    ({"contact": {"materials": ["steel", "steel"], "exponent": 2}},
     "contact.exponent: is 2, but Eq. 15's stiffness from materials needs exponent 1.5: leave it "
     "out, or give stiffness_N_per_mm15 in place of materials"),
    ({"joint": "both", "clearance_mm": {"big_end": 0.2}},
     "clearance_mm.small_end: is needed with joint: both; give it in mm, such as 0.2"),
    ({"gas": {"piston_radius_mm": 110, "suction_MPa": 0.2}},
     "gas: nothing reads this group: it needs load == gas; set that, or leave the group out"),
    ({"contact": {"law": "hertz", "damping_N_s_per_mm": 9}},
     "contact.damping_N_s_per_mm: nothing reads this key: it needs contact.law == impact; set "
     "that, or leave the key out"),
]  # fmt: skip


@pytest.mark.parametrize(("values", "message"), SHARED, ids=lambda part: str(part)[:40])
def test_values_and_files_are_told_alike(values, message, tmp_path):
    assert told(WORN | values) == [message]
    path = tmp_path / "case.yaml"
    path.write_text(json.dumps(WORN | values))  # which YAML reads, too
    with pytest.raises(CaseFileError) as caught:
        load_cases(path)
    (problem,) = caught.value.problems
    assert f"{problem.key}: {problem.message}" == message


# what only values can be
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
        ({"qqq": 1}, f"qqq: unknown key; a case has {AT_TOP}"),
        ({1: 2}, f"1: unknown key; a case has {AT_TOP}"),
        ({"machine": {1: 2}}, f"machine.1: unknown key; machine has {IN_MACHINE}"),
        ({"machine": None}, "machine: has no value; leave the key out to get its default"),
        ({"name": 5}, "name: needs text, not 5"),
        ({"solve": {"accuracy": []}},
         "solve.accuracy: needs draft, standard, fine or reference, or errors by metric such as "
         "{peak_acceleration: 0.01}, not []"),
        ({"solve": {"max_steps": float("inf")}},
         "solve.max_steps: must be finite: needs a whole number in [1, 1e+12], not inf"),
        ({"machine": {"rod_mass_kg": 10**400}},
         "machine.rod_mass_kg: must be finite: needs a number in (0, 1e+06] kg, not "
         f"1{'0' * 27}...{'0' * 29}"),
        ({"machine": {"rod_mass_kg": float("nan")}},
         "machine.rod_mass_kg: must be finite: needs a number in (0, 1e+06] kg, not nan"),
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


# All at once


def test_mistakes_are_told_at_once():
    assert told({
        "name": "a/b",
        "laod": "none",
        "joint": "both",
        "clearance_mm": {"big_end": -0.1},
        "machine": {"rod_mass": 3, "crank_radius_mm": 700, "speed_rpm": "500 rpm"},
        "contact": {"geometry": "internal", "exponent": 5},
        "friction": {"friction_velocity_mm_per_s": 1},
        "solve": {"duration_s": 0.48, "duration_rev": 4, "rtol": 1},
        "body": 3,
    }) == [
        "name: 'a/b' is no name: use [A-Za-z0-9._-], at most 64, no leading dot",
        "clearance_mm.big_end: -0.1 is outside [0, 1000] mm",
        "machine.speed_rpm: needs a number in (0, 100000] rpm, not '500 rpm'; write 500",
        "machine.rod_mass: unknown key; did you mean machine.rod_mass_kg?",
        "contact.exponent: 5 is outside [1, 3]",
        "body: needs true or a mapping of keys, such as {freedoms: xy}, not 3",
        "solve.rtol: 1 is outside [1e-13, 0.1]",
        "laod: unknown key; did you mean load?",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("values", "keys"),
    [
        # what does not fit together is found once the values are good
        ({"joint": "big_end", "clearance": 0.2}, ["clearance"]),
        ({"jiont": "big_end", "clearance_mm": 0.2}, ["jiont"]),
        ({"joint": "big_end", "clearance_mm": "big"}, ["clearance_mm"]),
        ({"laod": "gas", "gas": {"exponent": 1.3}, "spring": {"stroke_mm": 500}}, ["laod"]),
        ({"machine": {"rod_mass_kg": 0, "rod_length_mm": 1e6}}, ["machine.rod_mass_kg"]),
        ({"machine": {"crank_radius_mm": 700, "rod_length": 800}}, ["machine.rod_length"]),
        ({"solve": {"duration_s": "x", "output_step_deg": 0.7}}, ["solve.duration_s"]),
        ({"machine": 5, "spring": {"stroke_mm": 500}}, ["machine"]),
        ({"spring": {"stroke_mm": 500}, "qqq": 1}, ["qqq"]),
        ({"joint": "both", "clearance_mm": 11, "solve": {"rtol": 5}}, ["solve.rtol"]),
        ({"joint": "both", "clearance_mm": 11}, ["clearance_mm"]),
    ],
)  # fmt: skip
def test_no_mistake_is_told_that_follows_from_another(values, keys):
    with pytest.raises(CaseError) as caught:
        Case.from_values(values)
    assert [problem.key for problem in caught.value.problems] == keys


def test_the_error_is_one_of_the_program_and_of_a_value():
    with pytest.raises(CompsimError):
        Case.from_values({"joint": "top"})
    with pytest.raises(ValueError, match="needs none, big_end"):
        Case.from_values({"joint": "top"})


# Numbers of other libraries


@pytest.mark.parametrize(
    "number",
    [np.float64(0.25), np.float32(0.25), np.array(0.25), np.arange(0, 1, 0.25)[1]],
)
def test_numbers_of_numpy_are_numbers(number):
    values = {"joint": "big_end", "clearance_mm": number}
    assert Case.from_values(values).key == Case.from_values(values | {"clearance_mm": 0.25}).key


def test_whole_numbers_words_and_truths_of_numpy_are_such():
    solve = {"max_steps": np.int64(1000), "error_bars": np.bool_(False), "method": np.str_("BDF")}
    found = Case.from_values({"solve": solve}).solve
    assert (found.max_steps, found.error_bars, found.method) == (1000, False, "BDF")
    assert [type(v) for v in (found.max_steps, found.error_bars)] == [int, bool]

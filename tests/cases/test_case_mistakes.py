"""What `Case.from_values` says of values that no file holds: mistakes.json has the others."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.cases.checks import known_keys
from compressor.cases.groups import Machine
from compressor.cases.parameter import CaseError
from compressor.program import CompsimError

WORN = {"joint": "big_end", "clearance_mm": 0.2}
AT_TOP = ", ".join(known_keys(""))
IN_MACHINE = ", ".join(known_keys("machine"))


def told(values) -> list[str]:
    with pytest.raises(CaseError) as caught:
        Case.from_values(values)
    return str(caught.value).split("\n")


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


def test_the_error_is_one_of_the_program_and_of_a_value():
    with pytest.raises(CompsimError):
        Case.from_values({"joint": "top"})
    with pytest.raises(ValueError, match="needs none, big_end"):
        Case.from_values({"joint": "top"})


@pytest.mark.parametrize(
    ("value", "key"),
    [(-1, "pin_radius_mm"), ({"big_end": -1, "small_end": 5}, "pin_radius_mm.big_end")],
)
def test_a_group_names_its_keys_as_they_are_given(value, key):
    with pytest.raises(CaseError) as caught:
        Machine(pin_radius_mm=value)
    (problem,) = caught.value.problems
    assert str(problem) == f"{key}: -1 is outside (0, 10000] mm"


# Numbers of other libraries


@pytest.mark.parametrize(
    "number", [np.float64(0.25), np.float32(0.25), np.array(0.25), np.arange(0, 1, 0.25)[1]]
)
def test_numbers_of_numpy_are_numbers(number):
    values = {"joint": "big_end", "clearance_mm": number}
    assert Case.from_values(values).key == Case.from_values(values | {"clearance_mm": 0.25}).key


def test_whole_numbers_words_and_truths_of_numpy_are_such():
    solve = {"max_steps": np.int64(1000), "error_bars": np.bool_(False), "method": np.str_("BDF")}
    found = Case.from_values({"solve": solve}).solve
    assert (found.max_steps, found.error_bars, found.method) == (1000, False, "BDF")
    assert [type(v) for v in (found.max_steps, found.error_bars)] == [int, bool]

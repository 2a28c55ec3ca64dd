"""Pins of the machine that is there: a radius each, their contact, and what is told of it."""

import json
import math
from dataclasses import replace

import pytest

from compressor.cases.case import Case, CaseError
from compressor.cases.load import CaseFileError, load_studies
from compressor.cases.materials import composite_modulus, contact_stiffness
from compressor.cases.parameter import PerJoint
from compressor.physics.film import film
from compressor.solve.si_record import record

WORN = {"joint": "both", "clearance_mm": 0.2}
MATERIALS = {"materials": ["steel", "copper"]}


def case(**values):
    return Case.from_values(WORN | values)


def test_a_file_gives_one_radius_or_one_for_each_joint():
    one = case(machine={"pin_radius_mm": 35})
    both = case(machine={"pin_radius_mm": {"big_end": 35, "small_end": 35}})
    assert one == both
    assert one.key == both.key
    two = case(machine={"pin_radius_mm": {"big_end": 60, "small_end": 35}})
    assert record(two)["pin_radius"].tolist() == [0.06, 0.035]
    assert two.key != one.key


@pytest.mark.parametrize(
    "values", [{"joint": "top"}, {"clearance_mm": "0.1"}, {"clearance_mm": {"top": 1}}]
)
def test_a_case_is_replaced_in_the_words_of_a_case(values):
    with pytest.raises(CaseError) as replaced:
        replace(case(), **values)
    with pytest.raises(CaseError) as made:
        case(**values)
    assert str(replaced.value) == str(made.value)


def test_a_part_is_set_by_its_path_beside_the_other(tmp_path):
    path = tmp_path / "worn.yaml"
    path.write_text("joint: both\nclearance_mm: 0.1\n", encoding="utf-8")
    with pytest.raises(CaseFileError) as error:
        load_studies(path, overrides=["machine.pin_radius_mm.small_end=90"])
    assert "needs both, big_end and small_end, not small_end" in str(error.value)
    small = "machine.pin_radius_mm.small_end=90"
    for pins in (["machine.pin_radius_mm.big_end=60", small],
                 ["machine.pin_radius_mm={big_end: 60, small_end: 90}"]):  # fmt: skip
        (study,) = load_studies(path, overrides=pins)
        assert study.cases[0].machine.pin_radius_mm == PerJoint(60, 90)
    path.write_text("joint: both\nclearance_mm: 0.1\nmachine: {pin_radius_mm: 60}\n")
    (study,) = load_studies(path, overrides=[small])
    assert study.cases[0].machine.pin_radius_mm == PerJoint(60, 90)


def test_a_pin_of_a_file_s_own_lies_in_its_bore():
    """As of two discs, the paper's, K is a ninth of it."""
    own, paper = case(contact=MATERIALS, machine={"pin_radius_mm": 35}), case(contact=MATERIALS)
    assert (own.contact.geometry, paper.contact.geometry) == ("internal", None)
    bore = contact_stiffness("steel", "copper", 0.035, 0.0352, internal=True)
    assert record(own)["stiffness"] == pytest.approx(bore, rel=1e-14)
    discs = case(contact=MATERIALS | {"geometry": "external"}, machine={"pin_radius_mm": 35})
    assert discs.contact.geometry is None
    assert (record(discs)["stiffness"] < record(own)["stiffness"] / 9).all()


LENGTHS = {"big_end": 60, "small_end": 40}
PINS = {"pin_radius_mm": {"big_end": 60, "small_end": 35}}


def test_each_bearing_has_a_length_of_its_own():
    """The film of a joint is that of a machine whose bearings are all as long as its own."""
    oil = {"lubricant": {"bearing_length_mm": LENGTHS}, "machine": PINS}
    two = case(**oil)
    assert record(two)["film_length"].tolist() == [0.06, 0.04]
    for number, length in enumerate(LENGTHS.values()):
        one = case(machine=PINS, lubricant={"bearing_length_mm": length})
        assert one.lubricant.bearing_length_mm == PerJoint(length, length)
        forces = [
            film(number, (1e-4, -5e-5, 0.02, 0.01), (52.0, -8.0), record(both))
            for both in (two, one)
        ]
        assert forces[0] == forces[1]
        assert forces[0][0] != 0.0
    alike = case(lubricant={"bearing_length_mm": {"big_end": 15, "small_end": 15}})
    assert alike.key == case(lubricant={"bearing_length_mm": 15}).key


def test_each_pin_has_materials_and_a_length_of_its_own():
    pairs = {"big_end": ["steel", "steel"], "small_end": ["steel", "copper"]}
    two = case(machine=PINS, contact={"materials": pairs})
    expected = [
        contact_stiffness(*pair, radius, radius + 2e-4, internal=True)
        for pair, radius in zip(pairs.values(), (0.06, 0.035), strict=True)
    ]
    assert record(two)["stiffness"].tolist() == pytest.approx(expected, rel=1e-14)
    line = case(machine=PINS, contact={"law": "johnson", "materials": pairs, "length_mm": LENGTHS})
    expected = [
        math.pi * composite_modulus(*pair) * length / 1e3
        for pair, length in zip(pairs.values(), LENGTHS.values(), strict=True)
    ]
    assert record(line)["stiffness"].tolist() == pytest.approx(expected, rel=1e-14)


def test_files_have_a_pair_for_each_pin_and_sweep_lengths(tmp_path):
    values = WORN | {
        "machine": PINS,
        "contact": {
            "law": "liu",
            "materials": {"big_end": ["steel", "steel"], "small_end": ["steel", "copper"]},
            "length_mm": {"big_end": [50, 60], "small_end": 40},
        },
    }
    (tmp_path / "s.yaml").write_text(json.dumps(values))
    (study,) = load_studies(tmp_path / "s.yaml")
    assert [axis.key for axis in study.axes] == ["contact.length_mm.big_end"]
    assert [one.contact.length_mm for one in study.cases] == [PerJoint(50, 40), PerJoint(60, 40)]
    assert {one.contact.materials.small_end for one in study.cases} == {("steel", "copper")}


def test_what_is_wrong_with_one_bearing_is_told_of_it():
    lengths = {"big_end": 60, "small_end": 80}  # beyond the pin's diameter
    with pytest.raises(CaseError, match=r"bearing_length_mm.small_end: is 1\.14 times"):
        case(machine=PINS, lubricant={"bearing_length_mm": lengths})


def test_a_default_length_is_refused_as_a_default():
    """It was told as 0.105 times the pin for a key that nobody wrote."""
    with pytest.raises(CaseError) as caught:
        case(machine={"pin_radius_mm": 95}, lubricant={"viscosity_mPa_s": 48})
    (problem,) = caught.value.problems
    assert problem.key == "lubricant.bearing_length_mm"
    remedy = "20 mm is the default, of the paper's pin: give the length that bears"
    assert problem.message.endswith(remedy)

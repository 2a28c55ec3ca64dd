"""Keys of pins, cylinders and healthy clearances, and their words of the trade."""

import math
from dataclasses import replace

import pytest

from compressor.cases.case import Case, CaseError
from compressor.cases.checks import DOUBLES
from compressor.cases.materials import composite_modulus, contact_stiffness
from compressor.cases.parameter import PerJoint
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


def test_a_case_is_replaced_in_the_words_of_a_case():
    wrong = {"joint": "top"}, {"machine": {"speed": 7}}
    for values in (*wrong, {"clearance_mm": {"top": 1}}, {"clearance_mm": PerJoint([1], 2)}):
        with pytest.raises(CaseError) as replaced:
            replace(case(), **values)
        with pytest.raises(CaseError) as made:
            case(**values)
        assert str(replaced.value) == str(made.value)


def test_a_joint_needs_its_clearance_in_python_too():
    for values in ({}, {"clearance_mm": {"big_end": 0.2}}):
        with pytest.raises(CaseError, match=r"clearance_mm.small_end: is needed .*: both;"):
            Case(joint="both", **values)


def test_a_pin_of_a_file_s_own_lies_in_its_bore():
    """As of two discs, the paper's, K is a ninth of it."""
    own, paper = case(contact=MATERIALS, machine={"pin_radius_mm": 35}), case(contact=MATERIALS)
    assert (own.contact.geometry, paper.contact.geometry) == ("internal", "external")
    bore = contact_stiffness("steel", "copper", 0.035, 0.0352, internal=True)
    assert record(own)["stiffness"] == pytest.approx(bore, rel=1e-14)
    discs = case(contact=MATERIALS | {"geometry": "external"}, machine={"pin_radius_mm": 35})
    assert (record(discs)["stiffness"] < record(own)["stiffness"] / 9).all()


LENGTHS = {"big_end": 60, "small_end": 40}
PINS = {"pin_radius_mm": {"big_end": 60, "small_end": 35}}


def test_each_bearing_has_a_length_of_its_own():
    two = case(lubricant={"bearing_length_mm": LENGTHS}, machine=PINS)
    assert record(two)["film_length"].tolist() == [0.06, 0.04]
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


DOUBLE = {"action": "double", "rod_diameter_mm": 30}


def cylinder(gas):
    return Case.from_values({"load": "gas", "gas": gas})


def test_what_is_so_by_default_makes_no_other_job():
    whole = {"unloaded": "none", "valve_loss_percent": 0, "switching": "exact"}
    assert cylinder(DOUBLE).key == cylinder(DOUBLE | whole).key
    for key, parts in (("clearance_percent", ("head", "crank")),
                       ("valve_loss_percent", ("suction", "discharge"))):  # fmt: skip
        assert (
            cylinder(DOUBLE | {key: 12}).key
            == cylinder(DOUBLE | {key: dict.fromkeys(parts, 12)}).key
        )
    assert cylinder({"unloaded": "none"}).key == cylinder({"action": "single"}).key


def test_clearances_are_of_the_stroke():
    """240 mm here; the crank end has the head's millimetres where nothing else is given."""
    found = record(cylinder(DOUBLE))
    assert (found.head_clearance, found.crank_clearance) == (0.02, 0.02)
    found = record(cylinder(DOUBLE | {"clearance_percent": {"crank": 12.5}}))
    assert (found.head_clearance, found.crank_clearance) == pytest.approx((0.02, 0.03))


@pytest.mark.parametrize("clearance", [14, {"crank": 14}, {"head": 12, "crank": 14}])
def test_a_crank_end_alone_takes_its_clearance_in_every_form(clearance):
    """Facts of a cylinder: two of the forms were refused, with opposite advice."""
    one = cylinder({"action": "crank_end", "rod_diameter_mm": 20, "clearance_percent": clearance})
    assert record(one)["crank_clearance"] == pytest.approx(0.14 * 0.24)
    both = {"head": 12, "crank": 14}
    single = cylinder({"action": "single", "clearance_percent": both})
    assert record(single)["head_clearance"] == pytest.approx(0.0288)


BOTH = {"joint": "both", "clearance_mm": {"big_end": 0.08, "small_end": 0.25}}


@pytest.mark.parametrize(
    ("healthy", "worn"),
    [(None, "both"), (0, "both"), (0.07, "both"), (0.08, "small_end"), (0.25, "none"),
     ({"big_end": 0.1}, "small_end"), ({"small_end": 0.3}, "big_end"),
     ({"big_end": 0.1, "small_end": 0.3}, "none")],
)  # fmt: skip
def test_a_joint_is_worn_beyond_its_healthy_clearance(healthy, worn):
    named = {} if healthy is None else {"healthy_clearance_mm": healthy}
    case = Case.from_values(BOTH | named)
    assert case.worn_joint == worn
    assert case.key == Case.from_values(BOTH).key


@pytest.mark.parametrize("joint", ["none", "big_end"])
def test_joints_that_are_ideal_are_never_worn(joint):
    clearance = {} if joint == "none" else {"clearance_mm": 0.2}
    case = Case.from_values({"joint": joint, **clearance, "healthy_clearance_mm": 0.1})
    assert case.worn_joint == joint


@pytest.mark.parametrize("word", DOUBLES)
def test_a_word_of_the_trade_is_twice_a_key(word):
    group, _, name = word.partition(".")
    own = DOUBLES[word].partition(".")[2]
    more = {"load": "gas"} if group == "gas" else {}
    one = Case.from_values(more | {group: {name: 250}})
    assert one == Case.from_values(more | {group: {own: 125}})
    assert getattr(getattr(one, group), own) == 125.0


@pytest.mark.parametrize(
    ("machine", "overrides", "radii"),
    [
        ("stroke_mm: 180", [], [90]),
        ("stroke_mm: [160, 200]", [], [80, 100]),
        ("stroke_mm: {range: [160, 200, 20]}", [], [80, 90, 100]),
        ("crank_radius_mm: 3", ["machine.stroke_mm=[160, 200]"], [80, 100]),
        ("stroke_mm: 200", ["machine.crank_radius_mm=80"], [80]),
        ("crank_radius_mm: 90", ["blocks=[{machine: {stroke_mm: 200}}]"], [100]),
    ],
)
def test_a_stroke_may_stand_wherever_a_radius_may(read, machine, overrides, radii):
    study = read(f"load: none\nmachine: {{{machine}}}", *overrides)
    assert [case.machine.crank_radius_mm for case in study.cases] == radii
    assert {axis.key for axis in study.axes} <= {"machine.crank_radius_mm"}


def test_draws_of_a_stroke_lie_between_halves(read):
    study = read("load: none\nmachine: {stroke_mm: {lhs: [160, 200]}}\nsample: {n: 4}")
    assert all(80 <= case.machine.crank_radius_mm <= 100 for case in study.cases)

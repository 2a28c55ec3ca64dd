"""What a file means, before it runs: hand numbers of a nameplate, and mistakes that they show."""

import json
import math

import numpy as np
import pytest
from compsim import screen

from compressor.analysis import cautions, describe_machine
from compressor.analysis.machine_numbers import USUAL, machine_numbers, revolution_loads
from compressor.cases import Case, with_ideal_joints
from compressor.physics import COLUMNS, Column, exact_motion, observe_all, segments
from compressor.solve import record

# a machine of another nameplate, and what a hand calculation has for it
NAMEPLATE = """
joint: both
clearance_mm: {big_end: 0.07, small_end: 0.175}
machine:
  stroke_mm: 127
  rod_length_mm: 343
  speed_rpm: 985
  rod_mass_kg: 54
  rod_centre_mm: 114
  reciprocating_mass_kg: 118
  pin_radius_mm: {big_end: 95, small_end: 51}
  balance: {rotating: 1.0, reciprocating: 0.0}
load: gas
gas:
  action: double
  bore_mm: 267
  rod_diameter_mm: 50.8
  clearance_percent: {head: 17, crank: 21}
  suction_MPa: 0.4113
  discharge_MPa: 1.0413
  valve_loss_percent: {suction: 4, discharge: 5}
  back_pressure_MPa: 0.101
  exponent: 1.27
contact: {materials: [steel, copper]}
lubricant: {viscosity_mPa_s: 48, bearing_length_mm: 100}
"""
BY_HAND = {
    "cylinder, indicated power": 78.93,  # kW
    "cylinder, flow at suction": 607.6,  # m3/h
    "cylinder, volumetric efficiency at the head": 0.96 * 0.7909,  # before the valve
    "cylinder, volumetric efficiency at the crank": 0.96 * 0.7417,
    "cylinder, bore": 267,  # mm
    "gas load, tension": 37.1,  # kN
    "gas load, compression": 39.7,
    "rod load, tension": 62.18,
    "rod load, compression": 51.55,
    "rod load, reversal": 164.03,  # degrees
    "rod, crank ratio": 63.5 / 343,
    "cylinder, pressure ratio": 2.5317,
    "suction, a gauge reads": 3.1,  # bar
    "piston, mean speed": 2 * 0.127 * 985 / 60,
    "piston, inertia": 118 * 0.0635 * (985 * math.pi / 30) ** 2 * (1 + 63.5 / 343) / 1e3,
    "small end, pressure": 62.85e3 / (102 * 100),
    "counterweight, of rotating and reciprocating inertia": 100 * 54 * (1 - 114 / 343) / (54 + 118),
}
MISTAKES = {  # what was written in place of what, with the key that the remark names
    "the bore as a radius": ("bore_mm: 267", "bore_mm: 133.5", "gas.bore_mm"),
    "the whole bore as the radius": (
        "bore_mm: 267", "piston_radius_mm: 267", "gas.piston_radius_mm",
    ),
    "the crank radius as the stroke": ("stroke_mm: 127", "stroke_mm: 63.5", "machine.stroke_mm"),
    "a rod ten times too long": ("length_mm: 343", "length_mm: 3430", "machine.rod_length_mm"),
    "bar as MPa": (
        "0.4113\n  discharge_MPa: 1.0413", "4.113\n  discharge_MPa: 10.413", "gas.discharge_MPa",
    ),
    "a fraction as per cent": (
        "joint: both\nclearance_mm: {big_end: 0.07, small_end: 0.175}", "joint: both\n"
        "clearance_mm: {big_end: 0.01, small_end: 0.02}", "gas.clearance_percent",
    ),
    "ISO VG as mPa s": ("mPa_s: 48", "mPa_s: 150", "lubricant.viscosity_mPa_s"),
    "diametral as radial": ("small_end: 0.175", "small_end: 0.35", "clearance_mm"),
    "the centre from the other end": ("centre_mm: 114", "centre_mm: 229", "machine.rod_centre_mm"),
    "pins' diameters as radii": (
        "{big_end: 95, small_end: 51}", "{big_end: 190, small_end: 102}", "machine.pin_radius_mm",
    ),
    "a counterweight ten times too heavy": (
        "balance: {rotating: 1.0, reciprocating: 0.0}", "counterweight_kg_mm: 22893",
        "machine.counterweight_kg_mm",
    ),
    "a piston rod's radius": ("rod_diameter_mm: 50.8", "rod_diameter_mm: 5.08",
                              "gas.rod_diameter_mm"),
    "gauge pressures near the atmosphere": (
        "0.4113\n  discharge_MPa: 1.0413", "0.05\n  discharge_MPa: 0.25", "gas.suction_MPa",
    ),
}  # fmt: skip


def by_name(numbers):
    return {number.name: number for number in numbers}


def test_a_nameplate_s_numbers_are_those_by_hand(read):
    machine = describe_machine(read(NAMEPLATE))
    found = by_name(machine.numbers)
    for name, value in BY_HAND.items():
        assert found[name].low == found[name].high == pytest.approx(value, rel=1e-3), name
    assert machine.remarks() == {}
    lines = dict(machine.lines())
    assert lines["rod load"] == "tension 62.18 kN, compression 51.55 kN, reversal 164 degrees"
    assert lines["suction"] == "absolute 0.4113 MPa, a gauge reads 3.1 bar"


def test_a_load_of_no_tension_is_zero():
    """Where the suction pressure is on both faces it was -0 kN."""
    given = {"suction_MPa": 0.13, "discharge_MPa": 0.9, "back_pressure_MPa": 0.13}
    found = by_name(machine_numbers([Case.from_values({"load": "gas", "gas": given})]))
    assert math.copysign(1.0, found["gas load, tension"].low) == 1.0
    assert "big end, pin diameter" not in found  # which nobody gave, and no joint has play


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_remarked_on_with_its_key(name, read):
    before, after, key = MISTAKES[name]
    assert before in NAMEPLATE
    text = NAMEPLATE.replace(before, after)
    if key == "gas.clearance_percent":
        text = text.replace("{head: 17, crank: 21}", "{head: 0.17, crank: 0.21}")
    assert list(describe_machine(read(text)).remarks()) == [key]


def test_a_mass_in_grams_is_not_blamed_on_the_pressures(read):
    study = read(NAMEPLATE.replace("rod_mass_kg: 54", "rod_mass_kg: 54000"))
    machine, warned = describe_machine(study), {one.key for one in cautions(study)}
    assert "gas.discharge_MPa" in machine.remarks().keys() - machine.remarks(warned).keys()


CARDS = "\n".join(["crank_angle_deg,head_pressure_bar,crank_pressure_bar", *(
    f"{n},{30 + 20 * math.cos(math.radians(n)):.2f},{30 - 20 * math.cos(math.radians(n)):.2f}"
    for n in range(0, 360, 10)
)])  # fmt: skip


@pytest.mark.parametrize(
    ("action", "card", "key"),
    [("double", "{head: c.csv, crank: c.csv}", "gas.indicator.head"),
     ("crank_end", "{crank: c.csv}", "gas.indicator.crank")],
)  # fmt: skip
def test_a_remark_on_a_measured_cylinder_names_its_card(action, card, key, read, tmp_path):
    """It named gas.discharge_MPa, which nothing reads beside a card."""
    (tmp_path / "c.csv").write_text(CARDS, encoding="utf-8")
    text = f"load: gas\ngas: {{action: {action}, bore_mm: 267, rod_diameter_mm: 25, "
    remarks = describe_machine(read(f"{text}discharge_MPa: 1.0, indicator: {card}}}")).remarks()
    assert "stress" in remarks[key]
    assert "unit that the column's title says" in remarks[key]
    assert "gas.discharge_MPa" not in remarks


@pytest.mark.parametrize(
    ("given", "key"),
    [("lubricant: {bearing_length_mm: 15}", "lubricant.bearing_length_mm"),
     ("contact: {law: johnson, length_mm: 1, materials: [steel, steel]}", "contact.length_mm")],
)  # fmt: skip
def test_the_pressure_of_a_bearing_names_its_own_length(given, key, read):
    text = "joint: both\nclearance_mm: 0.05\nmachine: {speed_rpm: 2500, pin_radius_mm: 15}\n"
    remarks = describe_machine(read(text + given)).remarks()
    assert remarks[key].endswith("is usual; bearing length and pin are too small")


def test_of_many_jobs_both_ends_are_looked_at_and_the_part_is_told(read, capsys):
    study = read("load: none\nmachine: {speed_rpm: {linspace: [300, 600, 101]}}\n")
    machine = describe_machine(study)
    (speed,) = (one for one in machine.numbers if one.name == "piston, mean speed")
    assert (speed.low, speed.high) == pytest.approx((2.4, 4.8), rel=1e-3)  # 0.48 m a revolution
    assert 50 <= machine.looked_at <= 52
    screen.say_machines({"swept": machine})
    assert f"without clearance (by {machine.looked_at} of 101 jobs)" in capsys.readouterr().err


def test_a_sweep_that_reaches_into_what_is_usual_is_meant(read):
    swept = NAMEPLATE.replace("small_end: 0.175", "small_end: [0.1, 0.35]")
    machine = describe_machine(read(swept))
    assert machine.remarks() == {}
    assert by_name(machine.numbers)["small end, diametral clearance"].value() == "0.2 to 0.7 mm"


@pytest.mark.parametrize(
    ("before", "after", "key"),
    [("speed_rpm: 985", "speed_rpm: 16.4", "machine.speed_rpm"),
     ("stroke_mm: 127", "stroke_mm: 300", "machine.crank_radius_mm"),
     ("stroke_mm: 127", "crank_radius_mm: 200", "machine.crank_radius_mm")],
)  # fmt: skip
def test_what_a_caution_explains_is_not_remarked_on(before, after, key, read):
    """The bore stood beside the right caution, and the discharge pressure for the rod's stress."""
    study = read(NAMEPLATE.replace(before, after))
    machine, warned = describe_machine(study), {one.key for one in cautions(study)}
    assert key in warned
    assert machine.remarks(warned) == {}
    assert [*machine.remarks()] == ["machine.stroke_mm"]


DOUBLE = {"action": "double", "rod_diameter_mm": 40}


@pytest.mark.parametrize(
    ("load", "more"),
    [("none", {}), ("spring", {}), ("gas", {}), ("gas", DOUBLE),
     ("gas", DOUBLE | {"indicator": {"head": "c.csv", "crank": "c.csv"}})],
)  # fmt: skip
def test_loads_in_plain_python_are_those_of_the_machine_code(load, more, read, tmp_path):
    """The program reads them without it: to load it took ten times as long."""
    (tmp_path / "c.csv").write_text(CARDS, encoding="utf-8")
    values = {"load": load, "machine": {"gravity_m_per_s2": 9.81}} | ({"gas": more} if more else {})
    (case,) = read(json.dumps(values)).cases
    p, loads = record(case), revolution_loads(with_ideal_joints(case, features=False))
    _, phases = segments(p, case.turn)
    times = loads.angle / case.omega
    rows = np.empty((times.size, COLUMNS))
    every = np.repeat(phases, times.size // phases.size)
    observe_all(times, np.zeros((times.size, 4)), every, p, rows)
    np.testing.assert_allclose(loads.gas, -rows[:, Column.PISTON_FORCE], atol=1e-6)
    np.testing.assert_allclose(loads.rod, rows[:, Column.FORCE + 2], atol=1e-6)
    sizes = rows[:, Column.FORCE_SIZE : Column.FORCE_SIZE + 2]
    np.testing.assert_allclose(loads.sizes, sizes, atol=1e-6)
    _, _, a = exact_motion(loads.angle, 0.12, 0.6, case.omega)
    np.testing.assert_allclose(loads.inertia, -14.0 * a, atol=1e-6)
    found = by_name(machine_numbers([case]))
    assert (f"{load} load, compression" in found) == (load != "none")


def test_every_limit_is_of_a_number_that_there_is(read):
    found = by_name(describe_machine(read(NAMEPLATE)).numbers)
    assert {*USUAL} == {name for name, one in found.items() if not math.isnan(one.usual_low)}

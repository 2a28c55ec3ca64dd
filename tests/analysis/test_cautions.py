"""Warnings before a run: what is odd, told once, and nothing else; scales by closed forms."""

import json
import sys

import numpy as np
import pytest

from compressor.analysis.cautions import (
    Caution,
    cautions,
    contact_depths,
    greatest_force,
    remarks,
    slips,
)
from compressor.cases import Case
from compressor.metrics import JOINTS
from compressor.solve import record, simulate

BIG_END = {"joint": "big_end", "clearance_mm": 0.2}


def odd(**values):
    return [(key, words) for _, key, words in remarks(Case.from_values(values))]


@pytest.mark.parametrize("load", ["spring", "gas", "none"])
@pytest.mark.parametrize("joint", ["none", "big_end", "small_end", "both"])
def test_nothing_is_odd_about_the_defaults(load, joint):
    assert odd(load=load, joint=joint, **({} if joint == "none" else {"clearance_mm": 0.1})) == []


OILED = {"joint": "both", "clearance_mm": 0.1, "contact": {"materials": ["steel", "steel"]}}
TWO_PINS = {"pin_radius_mm": {"big_end": 60, "small_end": 35}}
LENGTHS = {"big_end": 70, "small_end": 20}


@pytest.mark.parametrize(
    ("values", "key", "words"),
    [
        (BIG_END | {"clearance_mm": 0.02}, "clearance_mm", "less than the contact gives way"),
        (BIG_END | {"machine": {"speed_rpm": 20000}}, "clearance_mm", "check the stiffness"),
        (BIG_END | {"friction": {"stiction_velocity_mm_per_s": 0.001}},
         "friction.stiction_velocity_mm_per_s", "judged on, 0.1 to 100"),
        (BIG_END | {"friction": {"static": 0.1}}, "friction.static", "below the dynamic one, 0.15"),
        ({"machine": {"crank_radius_mm": 180, "rod_length_mm": 450}},
         "machine.crank_radius_mm", "is half the stroke"),
        ({"machine": {"rod_mass_kg": 262}}, "machine.rod_mass_kg", "judged on"),
        (BIG_END | {"clearance_mm": 1.5}, "clearance_mm", "judged on"),
        (BIG_END | {"rod": {"depth_mm": 3, "width_mm": 40}}, "rod.depth_mm", "Euler's load"),
        (BIG_END | {"wear": True}, "wear", "compsim wear alone reads it"),
        # a default that decides, beside what is given
        (OILED | {"lubricant": {"viscosity_mPa_s": 48}, "machine": TWO_PINS},
         "lubricant.bearing_length_mm", "20 mm is the default, for the paper's pin of 10 mm "
         "radius, and yours has 60 and 35 mm: a film bears about as the cube of it"),
        (OILED | {"lubricant": {"bearing_length_mm": LENGTHS}, "machine": TWO_PINS},
         "lubricant.bearing_length_mm", "and yours has 35 mm"),
        (OILED | {"wear": True, "machine": TWO_PINS}, "wear.bore_length_mm", "60 and 35 mm"),
        ({"machine": {"rod_mass_kg": 54, "rod_length_mm": 343, "rod_centre_mm": 114}},
         "machine.rod_inertia_kg_m2", "0.529 kg m2 is the default, of a uniform bar, whose centre "
         "is in its middle, and that of yours is not: drawn rods have up to 2 times as much, and "
         "at most 1.41, with all"),
        ({"machine": {"rod_mass_kg": 54, "rod_length_mm": 343, "rod_centre_mm": 114,
                      "rod_inertia_kg_m2": 1.5}},
         "machine.rod_inertia_kg_m2", "1.5 kg m2 is more than 1.41, with all mass in the rod's"),
        ({"machine": {"rod_mass_kg": 54, "rod_length_mm": 343, "rod_centre_mm": 20}},
         "machine.rod_inertia_kg_m2", "0.5294 kg m2 is more than 0.349"),
        ({"body": {"mass_kg": 9000}, "sensor": True}, "body.casing_mass_kg",
         "360 kg is the default, a 25th of the body: levels of the sensor go as its inverse"),
        ({"body": {"mass_kg": 9000}}, "machine.balance", "nothing balances what turns"),
        ({"body": {"mass_kg": 9000, "frequency_x_Hz": 30}, "machine": {"speed_rpm": 985}},
         "body.frequency_x_Hz", "30 Hz is near 32.8 Hz, order 2 of the speed"),
        ({"body": {"mass_kg": 9000, "frequency_y_Hz": 15}, "machine": {"speed_rpm": 985}},
         "body.frequency_y_Hz", "15 Hz is near 16.4 Hz, order 1 of the speed"),
    ],
)  # fmt: skip
def test_what_is_odd_is_told_once(values, key, words):
    (_,) = (told for of, told in odd(**values) if of == key and words in told)


@pytest.mark.parametrize(
    "values",
    [
        OILED | {"lubricant": True},
        OILED | {"lubricant": {"bearing_length_mm": {"big_end": 70, "small_end": 50}},
                 "machine": TWO_PINS},
        {"machine": {"rod_mass_kg": 54, "rod_length_mm": 343}},
        {"machine": {"rod_mass_kg": 54, "rod_length_mm": 343, "rod_centre_mm": 114,
                     "rod_inertia_kg_m2": 0.9}},
        {"body": True, "sensor": True},
        {"body": {"mass_kg": 9000, "casing_mass_kg": 60}, "sensor": True},
        {"body": {"mass_kg": 9000}},
        {"body": {"mass_kg": 9000, "frequency_x_Hz": 37, "frequency_y_Hz": 50},
         "machine": {"speed_rpm": 985, "balance": {"rotating": 1.0, "reciprocating": 0.0}}},
        {"body": {"mass_kg": 9000}, "machine": {"counterweight_kg_mm": 100}},
    ],
)  # fmt: skip
def test_what_is_given_or_goes_with_the_defaults_is_not_told_of(values):
    keys = {"lubricant.bearing_length_mm", "machine.rod_inertia_kg_m2", "body.casing_mass_kg"}
    if "machine" in values and "body" in values:
        keys |= {"machine.balance", "body.frequency_x_Hz", "body.frequency_y_Hz"}
    assert not keys & {key for key, _ in odd(**values)}


def test_the_papers_bore_beside_a_stroke_of_ones_own_is_told(read):
    more = ("", "gas: {suction_MPa: 0.2}", "gas: {bore_mm: 100}", "gas: {bore_mm: [90, 100]}")
    texts = (f"{{load: [gas, none], machine: {{stroke_mm: 200}}, {one}}}" for one in more)
    found = [[c.jobs for c in cautions(read(text)) if c.key == "gas.bore_mm"] for text in texts]
    assert found == [[1], [1], [], []]


def test_a_unit_is_told_of_once_and_in_place_of_what_follows_from_it(read):
    text = "joint: big_end\nclearance_mm: [0.2, 0.3]\ncontact: {stiffness_N_per_mm15: 336}\n"
    told = (
        "336 N/mm^1.5, where 10000 to 1e+07 is usual; read as kN/mm^1.5: 3.36e+05 "
        "N/mm^1.5; 336 N/mm^1.5 is outside the range that the program was judged on, 3162.28 to "
        "3.16228e+07 N/mm^1.5"
    )
    assert cautions(read(text)) == [Caution("contact.stiffness_N_per_mm15", told, 2, 2)]


def test_a_large_sweep_is_sampled_evenly_and_always_the_same(read, monkeypatch):
    monkeypatch.setattr(sys.modules["compressor.analysis.cautions"], "MAX_JOBS", 100)
    many = read(
        "joint: big_end\nclearance_mm: {linspace: [0.2, 0.4, 20]}\n"
        "machine: {speed_rpm: [500, 20000], rod_mass_kg: {linspace: [3, 5, 5]}}\n"
    )
    (deep, *_) = found = cautions(many)
    assert found == cautions(many)
    assert 100 <= deep.of <= 102
    assert 0.4 < deep.jobs / deep.of < 0.6


# ---- slips of units: values that are in another unit, and some that are meant ------------------

SPEED, STIFFNESS = "machine.speed_rpm", "contact.stiffness_N_per_mm15"
SPRING, GAS = {"load": "spring"}, {"load": "gas", "gas": {"switching": "exact"}}
BAR = {"load": "gas", "gas": {"switching": "exact", "suction_MPa": 1.05}}


def values(key, value, **others):
    group, dot, name = key.partition(".")
    return {**others, group: {**others.get(group, {}), name: value} if dot else value}


# (key, values in the study, other keys, the unit they are in, what they are in the key's unit)
SLIPS = [
    (SPEED, 104.72, {}, "rad/s", "1000 rpm"),
    (SPEED, 8.333, {}, "Hz", "500 rpm"),
    (SPEED, [31.4, 52.4, 104.7], {}, "rad/s", "299.8 to 999.8 rpm"),
    (STIFFNESS, 3.36e8, BIG_END, "mN/mm^1.5", "3.36e+05 N/mm^1.5"),
    (STIFFNESS, 1.0625e10, BIG_END, "N/m^1.5", "3.36e+05 N/mm^1.5"),
    (STIFFNESS, [1e8, 2e8], BIG_END, "mN/mm^1.5", "1e+05 to 2e+05 N/mm^1.5"),
    ("spring.damping_N_s_per_mm", 23, SPRING, "N s/m", "0.023 N s/mm"),
    ("spring.stroke_mm", 0.12, SPRING, "m", "120 mm"),
    ("clearance_mm", 0.0002, {"joint": "both"}, "m", "0.2 mm"),
    ("clearance_mm", 5, {"joint": "both"}, "µm", "0.005 mm"),
    ("machine.pin_radius_mm", 0.01, {"friction": {"ideal_joints": True}}, "m", "10 mm"),
    ("machine.rod_mass_kg", 4700, {}, "g", "4.7 kg"),
    ("machine.rod_inertia_kg_m2", 141000, {}, "kg mm2", "0.141 kg m2"),
    ("gas.head_clearance_mm", 0.02, GAS, "m", "20 mm"),
    ("friction.stiction_velocity_mm_per_s", 0.01, BIG_END, "m/s", "10 mm/s"),
]  # fmt: skip
# (key, values in the study, other keys): all meant as they stand
MEANT = [
    (SPEED, 150, {}),
    (SPEED, 5484.21, {}),
    (SPEED, 245.045, {}),  # 2340 rpm in rad/s
    (SPEED, [120.0, 245.045, 370.09], {}),
    (SPEED, [50, 100, 200, 400], {}),  # a sweep that begins slowly
    (SPEED, 20000, {}),  # in no unit usual
    (STIFFNESS, 4.6e6, BIG_END),  # steel, a pin in a bore
    (STIFFNESS, 2e4, BIG_END),  # a plastic bushing
    (STIFFNESS, [1e5, 1e6, 1e8], BIG_END),  # towards rigid
    ("clearance_mm", [0.0001, 0.001, 0.01, 0.1], {"joint": "both"}),
    ("spring.stiffness_N_per_mm", 0, SPRING),
    ("machine.gravity_m_per_s2", 0.001, {}),
    ("machine.rod_mass_kg", [0.01, 0.1, 1], {}),
    ("friction.stiction_velocity_mm_per_s", 0.5, BIG_END),
]  # fmt: skip
# in another unit, and usual in the key's: no range can tell
HIDDEN = [(SPEED, 157.08, {}), (SPEED, 251.3, {}), ("gas.discharge_MPa", 3.93, BAR)]


@pytest.mark.parametrize(("key", "given", "others", "unit", "meant"), SLIPS)
def test_what_is_in_another_unit_is_told(key, given, others, unit, meant, read):
    (found,) = slips(read(json.dumps(values(key, given, **others))).cases)
    assert found.key == key
    assert f"; read as {unit}: " in found.message
    assert found.message.endswith(f" {meant}")


@pytest.mark.parametrize(("key", "given", "others"), MEANT + HIDDEN)
def test_what_is_usual_or_reaches_into_it_is_not(key, given, others, read):
    assert slips(read(json.dumps(values(key, given, **others))).cases) == []


def test_only_what_reads_a_key_counts():
    worn = Case.from_values({**BIG_END, "contact": {"stiffness_N_per_mm15": 3.36e8}})
    (found,) = slips([worn, Case.from_values({})])
    assert found.jobs == 1


# ---- scales


@pytest.mark.parametrize("load", ["spring", "gas", "none"])
@pytest.mark.parametrize("speed", [200, 2000])
def test_the_greatest_force_bounds_the_ideal_machine_s(load, speed):
    values = {"load": load, "machine": {"speed_rpm": speed, "gravity_m_per_s2": 9.81},
              "spring": {"damping_N_s_per_mm": 0.5}}  # fmt: skip
    case = Case.resolve(values)
    found = simulate(case)["peak_contact_force"].values
    most = [greatest_force(record(case), joint) for joint in JOINTS]
    for bound, force in zip(most, found, strict=True):
        assert force <= bound <= 3 * force
    worn = Case.resolve(values | {"joint": "both", "clearance_mm": 0.1})
    static = (np.array(most) / 1.0625e10) ** (2 / 3)  # of K delta^1.5 under that force
    assert [depth for _, depth in contact_depths(worn)] == pytest.approx(static, rel=1e-3)

"""Slips of units: judged on values that are in another unit, and on some that are meant."""

import json

import pytest

from compressor.cases.case import Case
from compressor.cases.load import load_studies
from compressor.cases.table import table
from compressor.solve.cautions import USUAL, is_usual, slips

WORN = {"joint": "big_end", "clearance_mm": 0.2}
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
    (STIFFNESS, 3.36e8, WORN, "mN/mm^1.5", "3.36e+05 N/mm^1.5"),
    (STIFFNESS, 1.0625e10, WORN, "N/m^1.5", "3.36e+05 N/mm^1.5"),
    (STIFFNESS, [1e8, 2e8], WORN, "mN/mm^1.5", "1e+05 to 2e+05 N/mm^1.5"),
    ("spring.damping_N_s_per_mm", 23, SPRING, "N s/m", "0.023 N s/mm"),
    ("spring.stroke_mm", 0.12, SPRING, "m", "120 mm"),
    ("clearance_mm", 0.0002, {"joint": "both"}, "m", "0.2 mm"),
    ("clearance_mm", 5, {"joint": "both"}, "µm", "0.005 mm"),
    ("machine.pin_radius_mm", 0.01, {"friction": {"ideal_joints": True}}, "m", "10 mm"),
    ("machine.rod_mass_kg", 4700, {}, "g", "4.7 kg"),
    ("machine.rod_inertia_kg_m2", 141000, {}, "kg mm2", "0.141 kg m2"),
    ("gas.head_clearance_mm", 0.02, GAS, "m", "20 mm"),
    ("friction.stiction_velocity_mm_per_s", 0.01, WORN, "m/s", "10 mm/s"),
]  # fmt: skip
# (key, values in the study, other keys): all meant as they stand
MEANT = [
    (SPEED, 150, {}),
    (SPEED, 5484.21, {}),
    (SPEED, 245.045, {}),  # 2340 rpm in rad/s
    (SPEED, [120.0, 245.045, 370.09], {}),
    (SPEED, [50, 100, 200, 400], {}),  # a sweep that begins slowly
    (SPEED, 20000, {}),  # in no unit usual
    (STIFFNESS, 4.6e6, WORN),  # steel, a pin in a bore
    (STIFFNESS, 2e4, WORN),  # a plastic bushing
    (STIFFNESS, [1e5, 1e6, 1e8], WORN),  # towards rigid
    ("clearance_mm", [0.0001, 0.001, 0.01, 0.1], {"joint": "both"}),
    ("spring.stiffness_N_per_mm", 0, SPRING),
    ("machine.gravity_m_per_s2", 0.001, {}),
    ("machine.rod_mass_kg", [0.01, 0.1, 1], {}),
    ("friction.stiction_velocity_mm_per_s", 0.5, WORN),
]  # fmt: skip
# in another unit, and usual in the key's: no range can tell
HIDDEN = [(SPEED, 157.08, {}), (SPEED, 251.3, {}), ("gas.discharge_MPa", 3.93, BAR)]


def study(tmp_path, key, given, others):
    path = tmp_path / "study.yaml"
    path.write_text(json.dumps(values(key, given, **others)), encoding="utf-8")
    return load_studies(path)[0]


@pytest.mark.parametrize(("key", "given", "others", "unit", "meant"), SLIPS)
def test_what_is_in_another_unit_is_told(key, given, others, unit, meant, tmp_path):
    (found,) = slips(study(tmp_path, key, given, others).cases)
    assert found.key == key
    assert f"; read as {unit}: " in found.message
    assert found.message.endswith(f" {meant}")


@pytest.mark.parametrize(("key", "given", "others"), MEANT + HIDDEN)
def test_what_is_usual_or_reaches_into_it_is_not(key, given, others, tmp_path):
    assert slips(study(tmp_path, key, given, others).cases) == []


def test_defaults_are_usual():
    for key in USUAL:
        default = table()[key].default if key in table() else None
        assert not default or is_usual(key, default), key


def test_only_what_reads_a_key_counts():
    worn = Case.from_values({**WORN, "contact": {"stiffness_N_per_mm15": 3.36e8}})
    (found,) = slips([worn, Case.from_values({})])
    assert found.jobs == 1

"""Mistakes of someone who writes a first case file: text, line and column, and what is answered."""

import pytest

from compressor.cases.card import UNITS
from compressor.cases.checks import OTHER_UNITS
from compressor.cases.load import CaseFileError, load_cases

MISTAKES = [
    # the key that was written, not the one that stands for it
    ("machine:\n  stroke_mm: 127 mm", "2:14: machine.stroke_mm: needs a number", "write 127"),
    ("load: gas\ngas: {bore_mm: 267 mm}", "2:16: gas.bore_mm: needs a number", "write 267"),
    ("machine: {stroke_mm: -3}", "1:22: machine.stroke_mm: -3 is outside", "(0, 200000] mm"),
    ("joint: big_end\nclearance_mm: [0.1, 0.2]\nmachine: {stroke_mm: 1400}",
     "3:22: machine.stroke_mm: the crank, 700 mm, must be shorter", "the rod, 600 mm"),
    ("machine: {speed_rpm: '700,800'}", "1:22", "write 700.800, or [700, 800]"),
    # diameters
    ("machine: {pin_diameter_mm: 102}", "1:11", "write machine.pin_radius_mm: 51, half of it"),
    ("clearance_diametral_mm: 0.35", "1:1", "radial, half of it: write clearance_mm: 0.175"),
    ("machine: {crank_pin_diameter_mm: 190}", "1:11", "pin_radius_mm: {big_end: 95, ...}, half"),
    ("machine: {crosshead_pin_diameter_mm: 102}", "1:11", "{small_end: 51, ...}, half of it"),
    ("gas: {piston_diameter_mm: 267}", "1:7", "unknown key; write gas.bore_mm: 267"),
    ("gas: {diameter_mm: 267}", "1:7", "write gas.bore_mm: 267"),
    ("machine: {crankpin_diameter_mm: 190}", "1:11", "pin_radius_mm: {big_end: 95, ...}, half"),
    ("machine: {big_end_diameter_mm: 190}", "1:11", "pin_radius_mm: {big_end: 95, ...}, half"),
    ("machine: {small_end_diameter_mm: 102}", "1:11", "pin_radius_mm: {small_end: 51, ...}, half"),
    ("machine: {wristpin_diameter_mm: 102}", "1:11", "pin_radius_mm: {small_end: 51, ...}, half"),
    ("machine: {crossheadpin_dia_mm: 102}", "1:11", "pin_radius_mm: {small_end: 51, ...}, half"),
    ("lubricant: {bearing_diameter_mm: 190}", "1:13", "machine.pin_radius_mm: 95, half of it"),
    ("machine: {pin_diameter_cm: 19}", "1:11", "machine.pin_radius_mm: 95, half of it"),
    ("machine: {rod_diameter_mm: 50.8}", "1:11", "gas.rod_diameter_mm: 50.8, the piston rod's"),
    ("machine: {stroke_in: 5}", "1:11", "write stroke_mm: 127"),
    # units
    ("gas: {suction_barg: 3.1}", "1:7", "write suction_MPa: 0.4113; pressures are absolute"),
    ("gas: {suction_psig: 45}", "1:7", "write suction_MPa: 0.4116; pressures are absolute"),
    ("gas: {suction_psi: 45}", "1:7",
     "write suction_MPa: 0.3103, absolute; to a gauge's add the atmosphere's 0.101325"),
    ("gas: {suction_bar: 4.1}", "1:7", "write suction_MPa: 0.41, absolute; to a gauge's add"),
    ("gas: {suction_psia: 45}", "1:7", "write suction_MPa: 0.3103"),
    ("gas: {suction_bara: 4.1}", "1:7", "write suction_MPa: 0.41"),
    ("joint: big_end\nclearance_mm: [0,05]", "2:18: clearance_mm", "decimal comma? write 0.05"),
    ("body: {mass_kg: 9}\nmachine: {reciprocating_mass_kg: 172}", "1:17: body.mass_kg",
     "the moving parts have 19.6 times the body's mass"),
    # another group's key
    ("machine: {exponent: 1.3}", "1:11: machine.exponent", "did you mean gas.exponent or"),
    # YAML: the line where it was made
    ("machine:\n  stroke_mm:127\n  rod_length_mm: 343", "2:1",
     "space after the colon: stroke_mm: 127"),
    ("machine:\n  stroke_mm = 127\n  rod_length_mm: 343", "2:1", "in place of =: stroke_mm: 127"),
    ("machine:\n  stroke_mm: 127\n   speed_rpm: 343", "3:1", "is indented by 3 columns, the line"),
    ("machine:\n  stroke_mm: 127\n speed_rpm: 343", "3:1", "is indented by 1 columns, the line"),
    ("joint: none\nmachine:  # ours\nstroke_mm: 127\n  rod_length_mm: 343", "4:1",
     "is indented by 2 columns, the line before by 0: keys of one group stand in one column"),
    ("machine:\n  stroke_mm: 127\nspeed_rpm: 985\n  rod_length_mm: 343", "4:1",
     "is indented by 2 columns, the line before by 0"),
    ("load: gas\n  bore_mm: 267", "2:1", "is indented by 2 columns, the line before by 0"),
    ("machine:\n\tstroke_mm: 127", "2:1", "indent with spaces, not tabs"),
    # materials that are not in the table
    ("joint: big_end\nclearance_mm: 0.1\ncontact: {materials: [steel, bronze]}", "3:22",
     "take copper, whose modulus is nearest"),
    ("joint: big_end\nclearance_mm: 0.1\ncontact: {materials: [steel, babbitt]}", "3:22",
     "take copper, the softer one"),
    # a method of before
    ("solve:\n  method: DOPRI5", "2:11", "take RK45, the same pair in SciPy"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "where", "answer"), MISTAKES, ids=[one[0] for one in MISTAKES])
def test_a_mistake_is_answered_where_it_was_made(text, where, answer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.yaml").write_text(text)
    with pytest.raises(CaseFileError) as caught:
        load_cases("m.yaml")
    lines = [line for line in str(caught.value).splitlines() if answer in line]
    assert lines, caught.value
    assert lines[0].startswith(f"m.yaml:{where}")
    assert "crank_radius_mm" not in lines[0]
    assert "piston_radius_mm" not in lines[0]


def told(text, tmp_path):
    """Return what is said of a file."""
    (tmp_path / "m.yaml").write_text(text)
    with pytest.raises(CaseFileError) as caught:
        load_cases(tmp_path / "m.yaml")
    return [problem.message for problem in caught.value.problems]


@pytest.mark.parametrize(
    "text",
    ["machine: {crank_diameter_mm: 300}", "machine: {main_bearing_diameter_mm: 200}",
     "machine: {conrod_diameter_mm: 60}", "rod: {diameter_mm: 50}", "wear: {bore_diameter_mm: 20}"],
)  # fmt: skip
def test_a_diameter_of_what_has_none_leads_to_no_other_part(text, tmp_path):
    """A crank's diameter led to its radius, which is half a stroke, a rod's to its depth."""
    group = text.partition(":")[0]
    assert told(text, tmp_path)[0].startswith(f"unknown key; {group} has ")


def test_an_unknown_key_without_a_value_has_no_default(tmp_path):
    """It was said to leave it out to get its default."""
    for text in ("machine:\n  rod_mas_kg:\n", "blocks: [{machine: {rod_mas_kg: }}]"):
        assert told(text, tmp_path) == ["unknown key; did you mean machine.rod_mass_kg?"]
    assert told("machine:\n  rod_mass_kg:\n", tmp_path) == [
        "has no value; leave the key out to get its default"
    ]
    beside = told("machine: {rod_mass_kg: , rod_mas: 3}", tmp_path)
    assert beside == [
        "has no value; leave the key out to get its default",
        "unknown key; did you mean machine.rod_mass_kg?",
    ]


def test_a_unit_of_pressure_is_the_same_in_keys_and_in_cards():
    both = {unit: UNITS[unit.lower()] for unit in OTHER_UNITS if unit.lower() in UNITS}
    assert {*both} == {"bar", "kPa", "psi"}
    assert {unit: OTHER_UNITS[unit] for unit in both} == {u: ("MPa", f) for u, f in both.items()}

"""Warnings before a run: what is odd, told once, and nothing about what is not."""

import page_tables
import pytest
from test_layers import ROOT

from compressor.analysis.cautions import cautions, remarks
from compressor.cases.case import Case
from compressor.cases.load import load_studies

STUDIES = load_studies(*sorted((ROOT / "configs").glob("*.yaml")))
BIG_END = {"joint": "big_end", "clearance_mm": 0.2}


def odd(**values):
    return [(key, words) for _, key, words in remarks(Case.from_values(values))]


@pytest.mark.parametrize("load", ["spring", "gas", "none"])
@pytest.mark.parametrize("joint", ["none", "big_end", "small_end", "both"])
def test_nothing_is_odd_about_the_defaults(load, joint):
    assert odd(load=load, joint=joint, **({} if joint == "none" else {"clearance_mm": 0.1})) == []


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_nothing_is_odd_about_the_paper_s_cases(study):
    assert cautions(study) == []


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


def study(tmp_path, text):
    path = tmp_path / "odd.yaml"
    path.write_text(text, encoding="utf-8")
    return load_studies(path, max_jobs=10**6)[0]


def test_a_sweep_is_told_of_once(tmp_path):
    found = cautions(study(tmp_path, "joint: both\nclearance_mm: [0.2, 0.3, 0.02, 0.03]\n"))
    (one,) = found
    assert (one.key, one.jobs, one.of) == ("clearance_mm", 2, 4)
    assert one.message.startswith("0.02 mm is less than the contact gives way, about 0.0")


def test_a_large_sweep_is_sampled_evenly_and_always_the_same(tmp_path):
    many = study(
        tmp_path,
        "joint: big_end\nclearance_mm: {linspace: [0.2, 0.4, 40]}\n"
        "machine: {speed_rpm: [500, 20000], rod_mass_kg: {linspace: [3, 5, 25]}}\n",
    )
    (deep, *_) = found = cautions(many)
    assert found == cautions(many)
    assert 500 <= deep.of <= 502
    assert 0.4 < deep.jobs / deep.of < 0.6


def test_the_pages_examples_that_are_plain_are_told_nothing(tmp_path):
    text = (page_tables.ROOT / "README.md").read_text(encoding="utf-8")
    example = text.split("```yaml\n# bearing-wear.yaml\n")[1].split("```")[0]
    assert cautions(study(tmp_path, example)) == []

"""Words of the trade: doubles of our keys are read, other units are answered with the number."""

from dataclasses import replace

import pytest
from conftest import refused

from compressor.cases.case import Case
from compressor.cases.checks import DOUBLES, probable_keys
from compressor.cases.parameter import CaseError
from compressor.cases.study import Axis
from compressor.cases.table import GROUPS, table


@pytest.mark.parametrize("word", DOUBLES)
def test_a_word_of_the_trade_is_twice_a_key(word):
    group, _, name = word.partition(".")
    own = DOUBLES[word].partition(".")[2]
    more = {"load": "gas"} if group == "gas" else {}
    one = Case.from_values(more | {group: {name: 250}})
    assert one == Case.from_values(more | {group: {own: 125}})
    assert getattr(getattr(one, group), own) == 125.0
    assert own in one.values()[group]
    assert name not in one.values()[group]


@pytest.mark.parametrize(
    ("swept", "radii"),
    [
        ("180", None),
        ("[160, 200]", (80.0, 100.0)),
        ("{linspace: [160, 200, 3]}", (80.0, 90.0, 100.0)),
        ("{range: [160, 200, 20]}", (80.0, 90.0, 100.0)),
        ("{logspace: [100, 200, 2]}", (50.0, 100.0)),
    ],
)
def test_a_stroke_is_swept_as_a_radius(read, swept, radii):
    study = read(f"machine: {{stroke_mm: {swept}}}\nload: none")
    assert study.axes == ((Axis("machine.crank_radius_mm", radii),) if radii else ())
    overridden = read("load: none\nmachine: {crank_radius_mm: 3}", f"machine.stroke_mm={swept}")
    assert overridden.keys == study.keys


def test_draws_lie_between_halves(read):
    study = read("load: none\nmachine: {stroke_mm: {lhs: [160, 200]}}\nsample: {n: 4}")
    assert all(80 <= case.machine.crank_radius_mm <= 100 for case in study.cases)


def test_a_block_and_the_command_line_replace_either_word(read):
    study = read(
        "load: none\nmachine: {crank_radius_mm: 90}\nblocks: [{machine: {stroke_mm: 200}}]"
    )
    assert study.cases[0].machine.crank_radius_mm == 100
    study = read("load: none\nmachine: {stroke_mm: 200}", "machine.crank_radius_mm=80")
    assert study.cases[0].machine.crank_radius_mm == 80


def test_a_file_gives_one_of_the_two(read):
    both = "machine.stroke_mm: stands in place of machine.crank_radius_mm: give one of the two"
    text = "machine: {crank_radius_mm: 90, stroke_mm: 180}\nload: none"
    assert refused(read, text) == [f"case.yaml:1:32: {both}"]
    with pytest.raises(CaseError) as caught:
        Case.from_values({"machine": {"crank_radius_mm": 90, "stroke_mm": 180}, "load": "none"})
    assert str(caught.value) == both
    assert (
        "set twice"
        in refused(read, "load: none", "machine.stroke_mm=180", "machine.crank_radius_mm=3")[0]
    )


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("gas: {load: gas}", "gas.load: unknown key; write load at the top, outside gas"),
        ("gas: {suction_bar: 2}", "gas.suction_bar: unknown key; write suction_MPa: 0.2"),
        ("gas: {suction_kPa: [200, 300]}", "unknown key; write suction_MPa: [0.2, 0.3]"),
        ("gas: {suction_bar: {lhs: [1, 2]}}", "; write suction_MPa: 1 bar is 0.1 MPa"),
        ("clearance_um: 250", "clearance_um: unknown key; write clearance_mm: 0.25"),
        ("machine: {stroke_cm: 18}", "stroke_cm: unknown key; write stroke_mm: 180"),
        ("machine: {rod_length_m: 0.45}", "unknown key; write rod_length_mm: 450"),
        ("gas: {clearance_pct: 8}",
         "clearance_pct: unknown key; write clearance_percent, a number or {head: 12, crank: 14}"),
        ("gas: {head_clearance_percent: 8}", "unknown key; write clearance_percent, a number or"),
        ("clearance_percent: 10", "; of the cylinder, write gas.clearance_percent, a number or "
         "{head: 12, crank: 14}; of joints, clearance_mm in mm"),
        ("stroke: 180", "; did you mean spring.stroke_mm or machine.stroke_mm?"),
        ("bore: 180", "; did you mean gas.bore_mm?"),
        ("load: none\nexclude: machine.stroke_mm > 180",
         "; write machine.crank_radius_mm, which is half of it"),
    ],
)  # fmt: skip
def test_what_is_written_otherwise_is_answered(read, text, hint):
    assert hint in refused(read, text)[0]


@pytest.mark.parametrize("group", GROUPS)
def test_no_hint_points_to_another_group(group):
    words = [key.rpartition(".")[2] for key in (*table(), *DOUBLES)]
    stems = [word.rpartition("_")[0] for word in words]
    for word in [*words, *stems, "bore", "stroke", "mass"]:
        assert all(key.startswith(f"{group}.") for key in probable_keys(word, group)), word
    assert probable_keys("stroke_mm", "contact") == probable_keys("bore_mm", "wear") == []


@pytest.mark.parametrize(("older", "word"), [("design", "spring"), ("typical", "gas")])
def test_a_load_has_the_paper_s_word(read, older, word):
    values = {"joint": "both", "clearance_mm": 0.2}
    one, other = (Case.from_values({**values, "load": load}) for load in (older, word))
    assert one == other == replace(Case.from_values(values), load=older)
    assert one.load == word
    text = one.attributes()["case"].replace(f'"load": "{word}"', f'"load": "{older}"')
    assert older in text
    assert Case.from_attribute(text) == one
    study = read(f"load: [none, {older}]")
    assert study.axes[0].values == ("none", word)
    assert read(f"load: [none, {older}]\nexclude: load == {older}").jobs == 1
    assert "twice" in refused(read, f"load: [{older}, {word}]")[0]

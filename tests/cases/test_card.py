"""Indicator cards: what is read of a file, what is refused by file and line, and jobs' keys."""

import json
import math
import os
from dataclasses import replace

import pytest

from compressor.cases.card import CardError, mark_card, open_card, read_card
from compressor.cases.case import Case, CaseError
from compressor.cases.load import CaseFileError, load_studies
from compressor.solve.cautions import remarks
from compressor.solve.simulate import measure

ANGLES = list(range(0, 360, 5))
SHORT = {"solve": {"duration_rev": 1, "settle_rev": 0}}


def pressure(angle):
    return 0.4 + 0.2 * math.cos(math.radians(angle))


def write(path, rows, head="crank_angle_deg,pressure_MPa"):
    path.write_text("\n".join([head, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return str(path)


@pytest.fixture
def card(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return write(tmp_path / "head.csv", [(angle, pressure(angle)) for angle in ANGLES])


def measured(path, **gas):
    return Case.from_values({"load": "gas", "gas": {"indicator": path} | gas, **SHORT})


def test_one_revolution(card):
    found = read_card(card)
    assert found.angles == tuple(map(float, ANGLES))
    assert found.pressures == pytest.approx([pressure(angle) for angle in ANGLES])
    assert (found.revolutions, found.scatter) == (1, 0.0)


def test_a_closing_sample_and_angles_from_anywhere(tmp_path, card):
    """From -180 to 180 degrees, with other columns; the last angle is the first."""
    rows = [(0.5, pressure(angle), angle) for angle in range(-180, 185, 5)]
    path = write(tmp_path / "b.csv", rows, "time, pressure_MPa ,crank_angle_deg")
    assert read_card(path).angles == read_card(card).angles
    assert read_card(path).pressures == pytest.approx(read_card(card).pressures, rel=1e-12)


def test_revolutions_are_averaged_on_the_first_one_s_angles(tmp_path, card):
    """Shifted by 0.01 MPa down, and up at other angles: their mean is between, straight lines."""
    angles = [0, 2.5, *range(5, 360, 5)]
    rows = [(angle, pressure(angle) - 0.01) for angle in ANGLES]
    rows += [(angle + 360, pressure(angle) + 0.01) for angle in angles]
    found = read_card(write(tmp_path / "two.csv", rows))
    assert found.revolutions == 2
    assert found.pressures == pytest.approx(read_card(card).pressures, rel=1e-12)
    assert found.scatter == pytest.approx(0.01 * math.sqrt(2), rel=1e-9)
    (told,) = (one for one in remarks(measured(str(tmp_path / "two.csv"))) if one.kind == "scatter")
    assert told.key == "gas.indicator"
    assert told.message.startswith("2 revolutions were averaged; they scatter by 0.014 MPa (rms)")


@pytest.mark.parametrize(
    ("rows", "head", "words"),
    [
        ([(0, 0.4), (10, 0.5)], "angle,pressure_MPa", ":1: has no column crank_angle_deg; its"),
        ([(0, 4)], "crank_angle_deg,pressure_bar", ":1: has no column pressure_MPa; its columns "
         "are crank_angle_deg, pressure_bar"),
        ([(0, 0.4), (10, 0.5), (10, 0.6)], None, ":4: angles must rise, and 10 follows 10"),
        ([(0, 0.4), (10, 0.5), (5, 0.6)], None, ":4: angles must rise, and 5 follows 10"),
        ([(0, 0.4), (10, "nan")], None, ":3: pressure_MPa needs a number, not 'nan'"),
        ([(0, 0.4), ("x", 0.5)], None, ":3: crank_angle_deg needs a number, not 'x'"),
        ([(0, 0.4), (10,)], None, ":3: pressure_MPa needs a number, not ''"),
        ([(0, 0.4), (30, 0.5)], None, ":3: a gap of 30 degrees before 30; at most 20"),
        ([(angle, 0.4) for angle in range(0, 300, 10)], None, ":31: the card ends 70 degrees "
         "before its revolution does"),
        ([(angle, 400) for angle in range(0, 360, 10)], None, ":2: 400 MPa is above 100; give "
         "absolute pressures in MPa: 1 bar is 0.1, 1 kPa 0.001, 1 Pa 1e-6"),
        ([(angle, 4e-7) for angle in range(0, 360, 10)], None, "all pressures are below 0.001"),
        ([(angle, -0.01) for angle in range(0, 360, 10)], None, ":2: -0.01 MPa is no absolute"),
        ([], None, ":1: holds no samples"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_file_and_line(tmp_path, rows, head, words):
    path = write(tmp_path / "bad.csv", rows, head or "crank_angle_deg,pressure_MPa")
    with pytest.raises(CardError) as caught:
        read_card(path)
    assert f"{path}{words}" in str(caught.value) or words in str(caught.value)
    assert str(caught.value).startswith(path)
    with pytest.raises(CaseError, match=r"gas\.indicator: .*bad\.csv"):
        measured(path)


def test_files_that_are_none(tmp_path):
    with pytest.raises(CaseError, match=r"gas\.indicator: .*none\.csv: cannot be read: No such"):
        measured(str(tmp_path / "none.csv"))
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(CardError, match="cannot be read"):
        read_card(str(tmp_path / "binary.csv"))


def test_the_key_has_the_numbers_and_not_the_place(tmp_path, card):
    one = measured(card)
    os.mkdir("other")
    same = write(tmp_path / "other" / "x.csv", [(a, pressure(a)) for a in ANGLES])
    assert measured(same).key == one.key
    other = write(tmp_path / "other" / "y.csv", [(a, pressure(a) + 1e-6) for a in ANGLES])
    assert measured(other).key != one.key
    assert one.gas.indicator == mark_card(card)
    assert Case.from_values(one.values()) == one
    assert Case.from_attribute(one.attributes()["case"]).key == one.key


def test_a_file_that_has_changed_is_not_run(tmp_path, card):
    case = measured(card)
    assert measure(case).status == "ok"
    write(tmp_path / "head.csv", [(a, pressure(a) + 0.1) for a in ANGLES])
    found = measure(case)
    assert (found.status, found.reason) == ("failed", "invalid_input")
    assert "head.csv: has changed since the case was made" in found.attributes["detail"]
    os.remove(card)
    assert "cannot be read" in measure(case).attributes["detail"]
    with pytest.raises(CardError):
        open_card(case.gas.indicator)
    assert measured(write(tmp_path / "head.csv", [(a, 0.2) for a in ANGLES])).key != case.key


def test_pressures_and_clearances_beside_a_card_make_no_other_job(card):
    """They are facts of the cylinder, which a file may have for the machine without a card."""
    nameplate = {"suction_MPa": 0.2, "discharge_MPa": 0.7, "exponent": 1.3, "clearance_percent": 12}
    values = {"load": "gas", "gas": {"indicator": card}}
    both = {"load": "gas", "gas": nameplate | {"indicator": card}}
    assert Case.from_values(both).key == Case.from_values(values).key


@pytest.mark.parametrize(
    ("gas", "words"),
    [
        ({"switching": "paper"}, "gas.switching: nothing reads this key"),
        ({"action": "double", "rod_diameter_mm": 30}, "gas.crank_indicator: is needed with action"),
        ({"action": "crank_end", "rod_diameter_mm": 30}, "gas.indicator: nothing reads"),
        ({"action": "double", "crank_indicator": "head.csv"}, "gas.rod_diameter_mm: is needed"),
        ({"indicator": {"head": "head.csv", "tail": "x"}}, "gas.indicator"),
        ({"indicator": 5}, "gas.indicator: needs the path of a CSV file with columns"),
    ],
)
def test_what_does_not_fit_is_told(card, gas, words):
    with pytest.raises(CaseError) as caught:
        measured(card, **gas)
    assert words in str(caught.value)


def test_paths_are_seen_from_the_case_file(tmp_path, card, monkeypatch):
    os.mkdir("deeper")
    write(tmp_path / "deeper" / "crank.csv", [(a, pressure(a)) for a in ANGLES])
    gas = {"action": "double", "rod_diameter_mm": 30,
           "indicator": {"head": "../head.csv", "crank": ["crank.csv", "../head.csv"]}}  # fmt: skip
    (tmp_path / "deeper" / "case.yaml").write_text(json.dumps({"load": "gas", "gas": gas, **SHORT}))
    (study,) = load_studies("deeper/case.yaml")
    assert [case.gas.cards["head"] for case in study.cases] == [mark_card(card)] * 2
    assert [len(axis.values) for axis in study.axes] == [2]
    gas["indicator"] = {"head": "none.csv"}
    (tmp_path / "deeper" / "case.yaml").write_text(json.dumps({"load": "gas", "gas": gas, **SHORT}))
    with pytest.raises(CaseFileError) as caught:
        load_studies("deeper/case.yaml")
    assert any("none.csv: cannot be read" in str(one) for one in caught.value.problems)


def test_a_case_in_python_is_checked_when_it_runs(card):
    case = measured(card)
    bad = replace(case, gas=replace(case.gas, indicator=card))  # without its digest
    assert bad.problems == ()  # which is then made
    assert "has changed" in measure(bad).attributes["detail"]

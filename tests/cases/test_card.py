"""Indicator cards: what is read of a file, what is refused by file and line, and jobs' keys."""

import json
import math
import os

import numpy as np
import pytest

from compressor.analysis.cautions import remarks
from compressor.analysis.cylinder import card_noise, fit_polytrope
from compressor.cases.card import CardError, mark_card, read_card
from compressor.cases.case import Case, CaseError
from compressor.cases.load import CaseFileError, load_studies
from compressor.solve.si_record import gas_nodes
from compressor.solve.simulate import measure

ANGLES = list(range(0, 360, 5))
SHORT = {"solve": {"duration_rev": 1, "settle_rev": 0}}


def pressure(angle):
    return 0.4 + 0.2 * math.cos(math.radians(angle))


def write(path, rows, head="crank_angle_deg,pressure_MPa"):
    path.write_text("\n".join([head, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return str(path)


def told_of(case):
    """What is told of the card of the head end."""
    return "".join(words for _, key, words in remarks(case) if key == "gas.indicator.head")


@pytest.fixture
def card(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return write(tmp_path / "head.csv", [(angle, pressure(angle)) for angle in ANGLES])


def measured(path, **gas):
    return Case.from_values({"load": "gas", "gas": {"indicator": path} | gas, **SHORT})


def test_a_closing_sample_and_angles_from_anywhere(tmp_path, card):
    """From -180 to 180 degrees, with other columns; the last angle is the first."""
    rows = [(0.5, pressure(angle), angle) for angle in range(-180, 185, 5)]
    path = write(tmp_path / "b.csv", rows, "time, pressure_MPa ,crank_angle_deg")
    for found in (read_card(card, "head"), read_card(path, "head")):
        assert found.angles == tuple(ANGLES)
        assert found.pressures == pytest.approx([pressure(angle) for angle in ANGLES], rel=1e-12)
        assert (found.revolutions, found.scatter) == (1, 0.0)


def test_revolutions_are_averaged_on_the_first_one_s_angles(tmp_path, card):
    """Shifted by 0.01 MPa down, and up at other angles: their mean is between, straight lines."""
    angles = [0, 2.5, *range(5, 360, 5)]
    rows = [(angle, pressure(angle) - 0.01) for angle in ANGLES]
    rows += [(angle + 360, pressure(angle) + 0.01) for angle in angles]
    found = read_card(write(tmp_path / "two.csv", rows), "head")
    assert found.revolutions == 2
    assert found.pressures == pytest.approx(read_card(card, "head").pressures, rel=1e-12)
    assert found.scatter == pytest.approx(0.01 * math.sqrt(2), rel=1e-9)
    told = told_of(measured(str(tmp_path / "two.csv")))
    assert told.startswith("2 revolutions were averaged; they scatter by 0.014 MPa (rms)")


@pytest.mark.parametrize(
    ("rows", "head", "words"),
    [
        ([(0, 0.4), (10, 0.5)], "turn,pressure_MPa", ": has no column for the crank angle; it has "
         "turn, pressure_MPa; a card needs crank_angle_deg and pressure_bar, or head_pressure_bar"),
        ([(0, 4), (10, 5)], "crank_angle_deg,crank_pressure_bar", ": has no column for the "
         "pressure of the head end; it has crank_angle_deg, crank_pressure_bar"),
        ([(0, 4, 4), (10, 5, 5)], "crank_angle_deg,pressure_bar,pressure_MPa", ": has 2 columns "
         "for the pressure of the head end"),
        ([(0, 0.4), (10, 0.5), (10, 0.6)], None, ":4: angles must rise, and 10 follows 10"),
        ([(0, 0.4), (30, 0.5)], None, ":3: a gap of 30 degrees before 30; at most 20"),
        ([(angle, 0.4) for angle in range(0, 300, 10)], None, ":31: the card ends 70 degrees "
         "before its revolution does"),
        ([(angle, 400) for angle in range(0, 360, 10)], None, ":2: 400 MPa is above 100; is "
         "pressure_MPa the column's unit?"),
        ([("", "", 1), ("", "", 2)], "crank_angle_deg,pressure_bar,time", ": has no row with an "
         "angle and a pressure"),
        ([(angle, 4e-7) for angle in range(0, 360, 10)], None, "all pressures are below 0.001"),
        ([(angle, -0.01) for angle in range(0, 360, 10)], None, ":2: -0.01 MPa is below a vacuum"),
        ([(angle, -1.2) for angle in range(0, 360, 10)], "crank_angle_deg,pressure_barg",
         ":2: -0.12 MPa is below a vacuum"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_file_and_line(tmp_path, rows, head, words):
    path = write(tmp_path / "bad.csv", rows, head or "crank_angle_deg,pressure_MPa")
    with pytest.raises(CardError) as caught:
        read_card(path, "head")
    assert f"{path}{words}" in str(caught.value) or words in str(caught.value)
    assert str(caught.value).startswith(path)
    with pytest.raises(CaseError, match=r"gas\.indicator: .*bad\.csv"):
        measured(path)


def test_the_key_has_the_numbers_and_not_the_place(tmp_path, card):
    one = measured(card)
    os.mkdir("other")
    same = write(tmp_path / "other" / "x.csv", [(a, pressure(a)) for a in ANGLES])
    assert measured(same).key == one.key
    other = write(tmp_path / "other" / "y.csv", [(a, pressure(a) + 1e-6) for a in ANGLES])
    assert measured(other).key != one.key
    assert one.gas.indicator.head == mark_card(card, "head")
    assert Case.from_values(one.values()) == one
    assert Case.from_attribute(one.attributes()["case"]).key == one.key


@pytest.mark.parametrize(
    ("gas", "words"),
    [
        ({"action": "double", "rod_diameter_mm": 30}, "gas.indicator.crank: is needed with action"),
        ({"action": "crank_end", "rod_diameter_mm": 30}, "gas.indicator: nothing reads"),
        ({"indicator": 5}, "gas.indicator: needs the path of a CSV file with columns"),
    ],
)
def test_what_does_not_fit_is_told(card, gas, words):
    with pytest.raises(CaseError) as caught:
        measured(card, **gas)
    assert words in str(caught.value)


@pytest.mark.parametrize("indicator", ["head.csv", ["head.csv", "other.csv"]])
@pytest.mark.parametrize("text", ["other pressures", "crank_angle_deg,pressure_MPa\n", ""])
def test_a_card_that_is_replaced_after_planning_fails_its_jobs(tmp_path, card, indicator, text):
    """By another card, a file that is none, and no file: no job runs under the key of the old."""
    write(tmp_path / "other.csv", [(angle, 2 * pressure(angle)) for angle in ANGLES])
    gas = {"indicator": indicator, "piston_radius_mm": [50, 51]}
    (tmp_path / "case.yaml").write_text(json.dumps({"load": "gas", "gas": gas, **SHORT}))
    (study,) = load_studies("case.yaml")
    if text == "other pressures":
        write(tmp_path / "head.csv", [(angle, pressure(angle) + 0.1) for angle in ANGLES])
    elif text:
        (tmp_path / "head.csv").write_text(text)
    else:
        os.remove(card)
    case = study.cases[1]
    assert (case.key, case.gas.piston_radius_mm) == (study.keys[1], 51)
    found = measure(case)
    assert (found.status, found.reason) == ("failed", "invalid_input")
    assert found.detail.endswith("put the card of that time back, or run the case file again")
    assert ("has changed since the case was made" in found.detail) == text.startswith("other")
    axes = {axis.key: axis.values for axis in study.axes}
    assert axes.get("gas.indicator", ("head.csv", "other.csv")) == ("head.csv", "other.csv")


def test_paths_are_seen_from_the_case_file(tmp_path, card, monkeypatch):
    os.mkdir("deeper")
    write(tmp_path / "deeper" / "crank.csv", [(a, pressure(a)) for a in ANGLES])
    gas = {"action": "double", "rod_diameter_mm": 30,
           "indicator": {"head": "../head.csv", "crank": ["crank.csv", "../head.csv"]}}  # fmt: skip
    (tmp_path / "deeper" / "case.yaml").write_text(json.dumps({"load": "gas", "gas": gas, **SHORT}))
    (study,) = load_studies("deeper/case.yaml")
    assert [case.gas.cards["head"] for case in study.cases] == [mark_card(card, "head")] * 2
    assert [len(axis.values) for axis in study.axes] == [2]
    gas["indicator"] = {"head": "none.csv"}
    (tmp_path / "deeper" / "case.yaml").write_text(json.dumps({"load": "gas", "gas": gas, **SHORT}))
    with pytest.raises(CaseFileError) as caught:
        load_studies("deeper/case.yaml")
    assert any("none.csv: cannot be read" in str(one) for one in caught.value.problems)


def cycle(angle, clearance=0.12, exponent=1.3, low=0.2, high=0.7, crank=False):
    """Pressure (MPa) of an ideal cycle of the default machine, at a crank angle (degrees)."""
    a = math.radians(angle)
    x = 120 * math.cos(a) + math.sqrt(600**2 - (120 * math.sin(a)) ** 2)
    swept = (720 - x) / 240
    if crank:
        swept = 1 - swept
    if (angle < 180) == crank:
        return min(high, low * ((clearance + 1) / (clearance + swept)) ** exponent)
    return max(low, high * (clearance / (clearance + swept)) ** exponent)


FINE = [0.5 * k for k in range(720)]
ROD = {"action": "double", "rod_diameter_mm": 30}


def head(path, scale=1.0, more=0.0, name="pressure_MPa", **how):
    rows = [(angle, scale * cycle(angle, **how) + more) for angle in FINE]
    return write(path, rows, f"crank_angle_deg,{name}")


@pytest.mark.parametrize(
    ("name", "scale", "more"),
    [
        ("head_pressure_bara", 10.0, 0.0),
        ("Pressure [kPa]", 1e3, 0.0),
        ("HE Pressure (psi)", 145.0377377, 0.0),
        ("HE [bar]", 10.0, 0.0),
        ("head_pressure_psig", 145.0377377, -14.69594878),
    ],
)
def test_units_of_a_card_stand_in_its_column(tmp_path, name, scale, more):
    plain = measured(head(tmp_path / "a.csv"))
    other = measured(head(tmp_path / "b.csv", scale, more, name))
    assert gas_nodes(other, "head") == pytest.approx(gas_nodes(plain, "head"), rel=1e-6, abs=0.1)
    is_gauge = name.endswith("g")
    assert ("1.01325 bar; set gas.ambient_MPa" in told_of(other)) == is_gauge
    if is_gauge:
        lower = measured(str(tmp_path / "b.csv"), ambient_MPa=0.09)
        fall = gas_nodes(other, "head") - gas_nodes(lower, "head")
        assert fall[:, 0] == pytest.approx(11325, rel=1e-6)


def test_an_analyser_s_file_has_both_ends_header_lines_and_decimal_commas(tmp_path):
    """As a case of two files in MPa, to the digits of the numbers; the ends are not exchanged."""
    lines = ["Analyser: PRO-4000", "", "Angle [deg];HE Pressure [barg];CE Pressure [barg];Flow"]
    for angle in FINE:
        bar = [10 * cycle(angle, crank=crank) - 1.01325 for crank in (False, True)]
        lines.append(f"{angle:.1f};{bar[0]:.6f};{bar[1]:.6f};7".replace(".", ","))
    path = tmp_path / "plant.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    ours = measured({"head": str(path), "crank": str(path)}, **ROD)
    ends = {"head": head(tmp_path / "he.csv"), "crank": head(tmp_path / "ce.csv", crank=True)}
    theirs = measured(ends, **ROD)
    for end in ends:
        nodes = gas_nodes(ours, end)[:, 0]
        assert nodes == pytest.approx(gas_nodes(theirs, end)[:, 0], rel=1e-6)
    with pytest.raises(CaseError) as caught:
        measured({"head": ends["crank"], "crank": ends["head"]}, **ROD)
    told = [str(one) for one in caught.value.problems]
    assert [one.partition(":")[0] for one in told] == ["gas.indicator.head", "gas.indicator.crank"]
    assert "is it the crank end's card" in told[0]
    assert "is it the head end's card" in told[1]


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({}, ""),
        ({"clearance": 0.2}, "fit a clearance of 20"),
        ({"scale": 1, "more": -0.101325}, "are its pressures of the unit"),
        ({"scale": 10, "name": "pressure_MPa"}, ""),  # a cycle is one at any scale
    ],
)
def test_a_card_is_held_against_its_own_lines(tmp_path, how, words):
    """The fit of both polytropic lines finds clearance and exponent."""
    case = measured(head(tmp_path / "a.csv", **how), clearance_percent=12)
    told = told_of(case)
    assert words in told
    assert words or "fit" not in told
    if "more" not in how:
        _, clearance, exponent = fit_polytrope(case, "head")
        assert clearance == pytest.approx(how.get("clearance", 0.12), rel=0.03)
        assert exponent == pytest.approx(1.3, abs=0.01)


def test_noise_of_a_card_is_told_and_smoothed(tmp_path):
    """0.003 MPa: told within a tenth, less by the window's width; a quiet card is not told."""
    noise = np.random.default_rng(3).normal(0, 0.003, len(FINE))
    rows = [(a, cycle(a) + n) for a, n in zip(FINE, noise.tolist(), strict=True)]
    path = write(tmp_path / "noisy.csv", rows)
    rough, smooth = measured(path), measured(path, smooth_deg=6)
    assert card_noise(rough, "head") == pytest.approx(0.003, rel=0.1)
    told = told_of(rough)
    assert "(rms), 2" in told
    assert "N on the piston; smoothed over 0 degrees" in told
    quiet = measured(head(tmp_path / "quiet.csv"))
    assert told_of(quiet) == ""
    left = [gas_nodes(one, "head")[:, 0] - gas_nodes(quiet, "head")[:, 0]
            for one in (rough, smooth)]  # fmt: skip
    assert left[1].std() < 0.5 * left[0].std()


@pytest.mark.parametrize("width", [2.0, 40.0])
def test_what_smoothing_takes_off_a_peak_is_told(tmp_path, width):
    """A peak as a valve makes it, narrower than the window or wider: by numpy's least squares."""
    rows = [(a, cycle(a) + 0.1 * np.exp(-(((a - 320) / width) ** 2))) for a in FINE]
    path = write(tmp_path / "peak.csv", rows)
    assert "smoothing" not in told_of(measured(path))
    within = np.arange(-6.0, 6.01, 0.25)  # degrees: a node each
    left = np.polyfit(within, 0.1 * np.exp(-((within / width) ** 2)), 3)[-1]
    told = f"lowers its peak by {0.1 - left:.3g} MPa, {(0.1 - left) / 0.006:.2g} % of its range"
    assert (told in told_of(measured(path, smooth_deg=12))) == (width < 6.0)

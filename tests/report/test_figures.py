"""The figures: every line is the stored series, every panel can be read, captions are right."""

import csv
import math
import re
from pathlib import Path

import matplotlib
import numpy as np
import pytest

from compressor.analysis import CLEARANCES, FAULTS, Cam, Cycle, label, paper_cases
from compressor.cases.case import Case
from compressor.report.figures import FIGURES, pictures
from compressor.report.figures.drawing import as_csv, panels_of
from compressor.report.figures.job import FILM, draw_analyst, draw_orbits
from compressor.report.figures.rows import SweptRow, draw_cycles
from compressor.report.figures.table import spell
from compressor.report.plots import keep_sensed
from compressor.solve import record, simulate

FIGURE = {int(name[-2:]): figure for name, figure in FIGURES["paper"].items()}
SETTLED = slice(1200, None)  # 0.3 degrees a sample: the first revolution is start-up
LAST = slice(-1201, None)  # the last revolution, both ends
SIZES = ("0.1", "0.2", "0.3")
RESPONSES = {8: "big_end", 11: "small_end", 14: "both"}
JOINTS = {9: ("big_end", "big_end"), 12: ("small_end", "small_end"),
          15: ("both", "big_end"), 16: ("both", "small_end")}  # fmt: skip


@pytest.fixture(scope="module")
def drawn(paper_runs):
    return {number: shown(number, paper_runs) for number in FIGURE}


def lines(panel):
    """The data of a panel's named lines, the highest first."""
    return [(one.x, one.y) for one in panel.traces[::-1] if one.name]


def check_lines(panel, expected):
    found = lines(panel)
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-10)


def curve(run, values, factor):
    """Crank angle of the last revolution, from its top dead centre, and values in a unit."""
    angle = run["crank_angle"].values[LAST] * 180 / np.pi
    return angle - angle[0], values.values[LAST] * factor


def views(drawn, number):
    """The panels of a figure: those in full, and the enlarged one, of each quantity."""
    panels = panels_of(drawn[number].figure)
    enlarged = [panel for panel in panels if "enlarged" in panel.title]
    found = []
    for view in sorted(enlarged, key=lambda panel: -panel.y.domain[1]):
        low, high = view.y.domain
        full = [p for p in panels if p not in enlarged and low - 0.01 < np.mean(p.y.domain) < high]
        found.append((full, view))
    return found


# ---- lines ------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [6, *RESPONSES])
def test_response_lines(drawn, paper_runs, number):
    worn = [f"{RESPONSES[number]} {size}" for size in SIZES] if number != 6 else ["typical"]
    series = [("displacement", 1000), ("velocity", 1), ("acceleration", 1)]
    for (full, enlarged), (name, factor) in zip(views(drawn, number), series, strict=True):
        expected = [curve(paper_runs[k], paper_runs[k][name], factor) for k in ("design", *worn)]
        check_lines(enlarged, expected)
        if len(full) == 1:
            check_lines(full[0], expected)
        else:
            for panel, one in zip(full, expected[1:], strict=True):
                check_lines(panel, [expected[0], one])


@pytest.mark.parametrize("number", JOINTS)
def test_contact_force_lines(drawn, paper_runs, number):
    fault, joint = JOINTS[number]
    for (full, enlarged), axis in zip(views(drawn, number), "xy", strict=True):
        expected = [
            curve(run, run["contact_force"].sel(joint=joint, axis=axis), 1 / 1000)
            for run in (paper_runs[f"{fault} {size}"] for size in SIZES)
        ]
        check_lines(enlarged, expected)
        for panel, one in zip(full, expected, strict=True):
            check_lines(panel, [one])


def test_piston_force_lines(drawn, paper_runs):
    runs = [paper_runs[name] for name in ("design", "typical")]
    expected = [curve(run, run["piston_force"], 1e-3) for run in runs]
    check_lines(panels_of(drawn[7].figure)[0], expected)


@pytest.mark.parametrize(("number", "joint"), [(10, "big_end"), (13, "small_end")])
def test_relation(drawn, paper_runs, number, joint):
    for panel, size in zip(panels_of(drawn[number].figure), SIZES, strict=True):
        run = paper_runs[f"{joint} {size}"]
        a = run["acceleration"].values[SETTLED]
        force = run["contact_force"].sel(joint=joint, axis="x").values[SETTLED]
        dots, fit = panel.traces
        np.testing.assert_allclose((dots.x, dots.y), (force / 1000, a), rtol=1e-13)
        slope, intercept = np.polyfit(a, force, 1)
        assert fit.x * 1000 == pytest.approx(slope * fit.y + intercept)


def test_pressure_volume(drawn, paper_runs):
    (panel,) = panels_of(drawn[3].figure)
    run = paper_runs["typical"]
    area = np.pi * 0.05**2
    volume = area * (0.740 - run["displacement"].values[SETTLED]) * 1000
    check_lines(panel, [(volume, run["piston_force"].values[SETTLED] / area / 1e6)])


CYLINDER = {"action": "double", "bore_mm": 220, "rod_diameter_mm": 60, "suction_MPa": 0.2,
            "discharge_MPa": 0.7, "clearance_percent": {"head": 12, "crank": 14}}  # fmt: skip


@pytest.mark.parametrize(
    ("gas", "pressures"),
    [
        (CYLINDER, (0.2, 0.7)),
        (CYLINDER | {"back_pressure_MPa": 0.1}, (0.2, 0.7)),
        (CYLINDER | {"action": "crank_end", "clearance_percent": 14}, (0.2, 0.7)),
        (CYLINDER | {"unloaded": "head"}, (0.2, 0.7)),
        ({"bore_mm": 220, "indicator": "card.csv"}, (0.3, 0.7)),
    ],
)
def test_pressure_volume_of_a_cylinder(tmp_path, monkeypatch, gas, pressures):
    """It was the force of both ends over the head's face."""
    monkeypatch.chdir(tmp_path)
    rows = (f"{a},{0.5 - 0.2 * math.sin(math.radians(a))}\n" for a in range(0, 360, 5))
    Path("card.csv").write_text("crank_angle_deg,pressure_MPa\n" + "".join(rows))
    case = Case.from_values({"load": "gas", "gas": gas})
    (panel,) = panels_of(FIGURE[3].make({"typical": simulate(case)}).figure)
    ((_, found),) = lines(panel)
    assert (found.min(), found.max()) == pytest.approx(pressures, rel=1e-3)


def test_cam(drawn):
    contour, follower = panels_of(drawn[4].figure)
    cam = Cam(record(paper_cases()["design"]))
    turn = np.radians(np.linspace(0, 360, 1441))
    path, circle = lines(contour)
    assert np.hypot(*circle) == pytest.approx(200)
    np.testing.assert_allclose(path, np.multiply(cam.contour(turn), 1000), atol=1e-9)
    assert contour.y.scaleanchor == "x"
    (printed,) = (one for one in follower.traces if one.name == "as printed, Eq. 10")
    (closed,) = (one for one in follower.traces if one.name == "closed cam, as simulated")
    np.testing.assert_allclose(closed.y, cam.follower(turn) * 1000, atol=1e-9)
    np.testing.assert_allclose(printed.y, cam.printed_follower(np.radians(printed.x)) * 1000)
    assert np.isnan(printed.y).sum() == 1  # at the jump


@pytest.mark.parametrize("number", [6, 8, 9, 11, 12, 14, 15, 16])
def test_enlarged_views_are_marked_and_hold_their_curves(drawn, number):
    for full, enlarged in ((one, view) for many, view in views(drawn, number) for one in many):
        (mark,) = [trace for trace in full.traces if not trace.name]
        (left, right), (low, high) = enlarged.x.range, enlarged.y.range
        assert (mark.x.min(), mark.x.max()) == pytest.approx((left, right))
        assert mark.y.min() <= low + 1e-9
        assert mark.y.max() >= high - 1e-9
        for x, y in lines(enlarged):
            inside = (x >= left) & (x <= right)
            assert inside.sum() > 50
            assert y[inside].min() > low
            assert y[inside].max() < high


# ---- how they look ----------------------------------------------------------------------------


@pytest.mark.parametrize("number", FIGURE)
def test_axes_name_their_units(drawn, number):
    panels = panels_of(drawn[number].figure)
    titles = [axis.title.text for panel in panels for axis in (panel.x, panel.y)]
    titles = [title for title in titles if title]
    assert len(titles) >= 2
    for title in titles:
        assert "(" in title, title
    for panel in panels:
        has_label = panel.y.title.text or "enlarged" in panel.title
        assert has_label or number in (10, 13)  # these share their axis
    heads = next(csv.reader(as_csv(drawn[number].figure).splitlines()))
    assert len({*heads}) == len(heads)  # two columns were both "0.2 mm: 0.2 mm: force (kN)"


@pytest.mark.parametrize("number", [3, 4, 6, 7, 10, 14, 15])  # one of each arrangement
def test_legends_cover_no_panel_and_nothing_warns(drawn, number, caplog):
    with matplotlib.rc_context(pictures.STYLE):
        figure = pictures.paint(drawn[number].figure)
        figure.draw_without_rendering()
    assert not caplog.records
    legends = [*figure.legends, *(p.get_legend() for p in figure.axes if p.get_legend())]
    assert legends or not any(len(panel.lines) > 1 for panel in figure.axes) or number in (3, 10)
    for legend in legends:
        box = legend.get_window_extent()
        assert not any(box.overlaps(panel.get_window_extent()) for panel in figure.axes)


def test_a_users_settings_neither_matter_nor_change(paper_runs):
    with matplotlib.rc_context({"axes.facecolor": "red", "font.size": 30.0, "axes.grid": False}):
        before = dict(matplotlib.rcParams)
        figure = FIGURE[7].make(paper_runs).figure
        mine = pictures.render(figure)
        assert dict(matplotlib.rcParams) == before
    assert mine == pictures.render(FIGURE[7].make(paper_runs).figure)


# ---- captions: numbers that are those of the drawn runs


NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def shown(number, runs):
    return FIGURE[number].make({name: runs[name] for name in FIGURE[number].needs})


def numbers(shown):
    """The numbers of a caption by the beginning of their label."""
    return {label: [float(one) for one in NUMBER.findall(text)] for label, text in shown.numbers}


def told(shown, words):
    (found,) = [values for label, values in numbers(shown).items() if words in label]
    return found


@pytest.fixture(scope="module")
def wild():
    """Runs under the paper's labels whose journals leave their bearings."""
    base = {"machine": {"rod_mass_kg": 1}, "contact": {"damping_N_s_per_mm": 0.3}}
    base |= {"solve": {"accuracy": "draft", "error_bars": False}}
    runs = {"design": simulate(Case.from_values({"machine": base["machine"]}))}
    for fault in FAULTS:
        for c in CLEARANCES:
            values = {**base, "joint": fault, "clearance_mm": c}
            runs[label(fault, c)] = simulate(Case.from_values(values))
    return runs


@pytest.mark.parametrize("number", FIGURE)
def test_a_caption_is_a_sentence_and_numbers(drawn, number):
    found = drawn[number]
    assert re.fullmatch(r"[A-Z(].*[a-z]\.", found.sentence, re.DOTALL)
    assert found.numbers
    assert all(NUMBER.search(text) for _, text in found.numbers)
    assert not re.search(r"[{}]|nan|inf|e[+-]\d|  ", found.caption)


@pytest.mark.parametrize(("number", "fault"), RESPONSES.items())
def test_peaks_lost_contact_and_differences_are_the_runs(drawn, paper_runs, wild, number, fault):
    for runs in (paper_runs, wild):
        found = shown(number, wild) if runs is wild else drawn[number]
        worn = [runs[label(fault, c)] for c in CLEARANCES]
        peaks = [float(run["peak_acceleration"]) for run in worn]
        assert told(found, "greatest acceleration") == pytest.approx(peaks, rel=1e-3)
        for joint in FAULTS[:2] if fault == "both" else [fault]:
            lost = [100 * float(run["contact_loss_fraction"].sel(joint=joint)) for run in worn]
            said = told(found, f"without contact at the {joint.replace('_', ' ')}")
            assert said == pytest.approx(lost, rel=1e-3)
            assert (max(said) > 0) is (runs is wild)
        share = 0.0
        for run in worn:  # displacement, from the mechanism without clearance in closed form
            case, turn = Case.from_values({}), run["crank_angle"].values[1200:]
            r, rod = case.machine.crank_radius_mm / 1e3, case.machine.rod_length_mm / 1e3
            ideal = r * np.cos(turn) + np.sqrt(rod**2 - (r * np.sin(turn)) ** 2)
            away = np.abs(run["displacement"].values[1200:] - ideal).max()
            share = max(share, 100 * away / np.ptp(ideal))
        assert told(found, "from no clearance")[0] == pytest.approx(share, rel=1e-3)


@pytest.mark.parametrize(("number", "where"), JOINTS.items())
def test_forces_are_those_of_the_joint(drawn, paper_runs, number, where):
    (fault, joint), found = where, drawn[number]
    runs = [paper_runs[label(fault, c)]["peak_contact_force_axis"] for c in CLEARANCES]
    for axis, words in (("x", "along the cylinder"), ("y", "across it")):
        peaks = [float(run.sel(joint=joint, axis=axis)) / 1e3 for run in runs]
        assert told(found, words) == pytest.approx(peaks, rel=1e-3)


def test_loads_are_told_by_their_peaks_and_corners(drawn, paper_runs):
    found = drawn[7]
    assert told(found, "force of the spring") == [3.345]
    assert told(found, "force of the gas") == [3.087]
    assert told(found, "corners of the spring") == [84.26, 180.0, 275.74]
    assert told(drawn[6], "greatest difference") == [0.0] * 3
    moved = paper_runs["typical"].assign(velocity=1.01 * paper_runs["typical"]["velocity"])
    assert told(shown(6, {**paper_runs, "typical": moved}), "greatest difference")[1] > 0.1


@pytest.mark.parametrize(("number", "joint"), [(10, "big_end"), (13, "small_end")])
def test_a_relation_is_told_by_its_numbers(drawn, paper_runs, number, joint):
    found, fits = drawn[number], []
    for size in SIZES:
        run = paper_runs[f"{joint} {size}"].isel(time=SETTLED)
        a, force = (
            run["acceleration"].values,
            run["contact_force"].sel(joint=joint, axis="x").values,
        )
        slope, intercept = np.polyfit(a, force, 1)
        fits.append((slope, intercept / 1e3, np.corrcoef(a, force)[0, 1] ** 2))
    for words, values in zip(("slope", "without", "r²"), zip(*fits, strict=True), strict=True):
        assert told(found, words) == pytest.approx(values, rel=1e-3)


def test_the_cam_and_the_gas_are_told_by_their_numbers(drawn):
    found = drawn[4]
    assert told(found, "as printed") == [208.7, 81.28]
    assert told(found, "closed cam") == [120.0]
    assert told(found, "same from") == [294.0]
    assert told(drawn[3], "phases") == [38.95, 180.0, 294.2]
    assert told(drawn[3], "off the") == [0.2]
    exact = simulate(Case.from_values({"load": "gas", "gas": {"switching": "exact"}}))
    assert told(shown(3, {"typical": exact}), "off the") == [0.0]


@pytest.mark.parametrize(
    ("values", "text"), [(1234.56, "1235 N"), ([0.0123456, -7.0], "0.01235, -7 N"), (1.4e-9, "0 N")]
)
def test_numbers_have_four_digits(values, text):
    assert spell(values, "N") == text
    assert spell(1234.56, "N", "plant") == "1.235 kN"


def test_captions_of_oiled_joints_speak_of_dry_contact():
    """A full film was "100 % flight", which reads as a disaster."""
    solve = {"duration_rev": 3, "settle_rev": 1, "accuracy": "draft", "output_step_deg": 0.5}
    values = {"joint": "big_end", "clearance_mm": 0.05, "solve": solve}
    dry = simulate(Case.from_values(values))
    full = simulate(Case.from_values({**values, "lubricant": {"viscosity_mPa_s": 3000}}))
    orbits = draw_orbits(full, None)
    assert FILM in orbits.caption
    assert "film" not in draw_orbits(dry, None).caption
    analyst = draw_analyst(full, None)
    assert dict(analyst.numbers)["dry contact at the big end"] == "none"
    assert "dry contact, big end" in analyst.figure.layout.yaxis.ticktext
    nearest = 1e6 * float(full["penetration"].sel(joint="big_end").values[2 * 720 :].max())
    assert numbers(orbits)["big end, off its wall"] == [100.0]
    assert numbers(orbits)["deepest, below 0 a gap"][0] == pytest.approx(nearest, rel=1e-3)


def test_a_chaotic_motion_is_told(paper_runs):
    run = paper_runs["both 0.3"].copy()
    assert "chaotic" not in draw_orbits(run, None).caption
    run.attrs = run.attrs | {"regime": "chaotic"}
    assert "The motion is chaotic" in draw_orbits(run, None).caption


ANGLES = np.arange(360.0)


def row(value, peak, is_sensed=True, **more):
    vibration = np.where(ANGLES == 90, peak, 1.0)
    cycle = Cycle(ANGLES, vibration, is_sensed, ANGLES, vibration, (10.0, 200.0), (), {})
    return SweptRow(value, cycle=cycle, **more)


def test_a_sensor_and_a_crosshead_are_not_compared():
    """The greatest "of the sensor's record" was the acceleration of a crosshead."""
    rows = [row("0.1", 40.0), row("0.2", 642.0, is_sensed=False), row("0.3", 50.0)]
    kept = keep_sensed(rows)
    assert [bool(one.cycle) for one in kept] == [True, False, True]
    found = draw_cycles(kept, "clearance (mm)")
    said = dict(found.numbers)
    assert said["greatest magnitude"] == "least 40 m/s² at 0.1, greatest 50 m/s² at 0.3"
    assert said["the greatest comes at"] == "90°, 5.099 g"
    assert found.sentence.endswith("Not drawn: 1 of 3 jobs (no sensor).")
    alone = [row("0.1", 40.0, is_sensed=False), row("0.2", 642.0, is_sensed=False)]
    assert keep_sensed(alone) == alone
    assert "acceleration of the crosshead" in draw_cycles(alone, "joint").sentence

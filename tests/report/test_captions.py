"""Captions: a fixed sentence, and labelled numbers that are those of the drawn runs."""

import re

import numpy as np
import pytest

from compressor.analysis import CLEARANCES, FAULTS, Cycle, label
from compressor.cases.case import Case
from compressor.report.figures import FIGURES
from compressor.report.figures.job import FILM, draw_analyst, draw_orbits
from compressor.report.figures.rows import SweptRow, draw_cycles
from compressor.report.figures.table import spell
from compressor.report.plots import keep_sensed
from compressor.solve.simulate import simulate

PAPER = FIGURES["paper"]
RESPONSES = {8: "big_end", 11: "small_end", 14: "both"}
FORCES = {9: ("big_end",) * 2, 12: ("small_end",) * 2, 15: ("both", "big_end"),
          16: ("both", "small_end")}  # fmt: skip
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def shown(number, runs):
    figure = PAPER[f"figure-{number:02d}"]
    return figure.make({name: runs[name] for name in figure.needs})


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


@pytest.mark.parametrize("name", PAPER)
def test_a_caption_is_a_sentence_and_numbers(paper_runs, name):
    found = shown(int(name[-2:]), paper_runs)
    assert re.fullmatch(r"[A-Z(].*[a-z]\.", found.sentence, re.DOTALL)
    assert found.numbers
    assert all(NUMBER.search(text) for _, text in found.numbers)
    assert not re.search(r"[{}]|nan|inf|e[+-]\d|  ", found.caption)


@pytest.mark.parametrize(("number", "fault"), RESPONSES.items())
def test_peaks_lost_contact_and_differences_are_the_runs(paper_runs, wild, number, fault):
    for runs in (paper_runs, wild):
        found = shown(number, runs)
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


@pytest.mark.parametrize(("number", "where"), FORCES.items())
def test_forces_are_those_of_the_joint(paper_runs, number, where):
    fault, joint = where
    found = shown(number, paper_runs)
    runs = [paper_runs[label(fault, c)]["peak_contact_force_axis"] for c in CLEARANCES]
    for axis, words in (("x", "along the cylinder"), ("y", "across it")):
        peaks = [float(run.sel(joint=joint, axis=axis)) / 1e3 for run in runs]
        assert told(found, words) == pytest.approx(peaks, rel=1e-3)


def test_loads_are_told_by_their_peaks_and_corners(paper_runs):
    found = shown(7, paper_runs)
    assert told(found, "force of the spring") == [3.345]
    assert told(found, "force of the gas") == [3.087]
    assert told(found, "corners of the spring") == [84.26, 180.0, 275.74]
    assert told(shown(6, paper_runs), "greatest difference") == [0.0] * 3
    moved = paper_runs["typical"].assign(velocity=1.01 * paper_runs["typical"]["velocity"])
    assert told(shown(6, {**paper_runs, "typical": moved}), "greatest difference")[1] > 0.1


def test_the_cam_and_the_gas_are_told_by_their_numbers(paper_runs):
    found = shown(4, paper_runs)
    assert told(found, "as printed") == [208.7, 81.28]
    assert told(found, "closed cam") == [120.0]
    assert told(found, "same from") == [294.0]
    assert told(shown(3, paper_runs), "phases") == [38.95, 180.0, 294.2]
    assert told(shown(3, paper_runs), "off the") == [0.2]
    exact = simulate(Case.from_values({"load": "gas", "gas": {"switching": "exact"}}))
    assert told(shown(3, {"typical": exact}), "off the") == [0.0]


@pytest.mark.parametrize(
    ("values", "text"), [(1234.56, "1235 N"), ([0.0123456, -7.0], "0.01235, -7 N"), (1.4e-9, "0 N")]
)
def test_numbers_have_four_digits(values, text):
    assert spell(values, "N") == text


def test_captions_of_oiled_joints_speak_of_dry_contact():
    """A full film was "100 % flight", which reads as a disaster."""
    solve = {"duration_rev": 3, "settle_rev": 1, "accuracy": "draft", "output_step_deg": 0.5}
    values = {"joint": "big_end", "clearance_mm": 0.05, "solve": solve}
    dry = simulate(Case.from_values(values))
    full = simulate(Case.from_values({**values, "lubricant": {"viscosity_mPa_s": 3000}}))
    told = {}
    for name in ("orbits", "impacts"):
        make = FIGURES["job"][name].make
        told[name] = make(full, None)
        assert FILM in told[name].caption
        assert "film" not in make(dry, None).caption
    assert numbers(told["impacts"])["dry contacts a revolution at the big end"] == [0.0]
    analyst = draw_analyst(full, None)
    assert dict(analyst.numbers)["dry contact at the big end"] == "none"
    assert "dry contact, big end" in analyst.figure.layout.yaxis.ticktext
    nearest = 1e6 * float(full["penetration"].sel(joint="big_end").values[2 * 720 :].max())
    assert numbers(told["orbits"])["big end, off its wall"] == [100.0]
    assert numbers(told["orbits"])["deepest, below 0 a gap"][0] == pytest.approx(nearest, rel=1e-3)


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

"""Captions are claims: they are chosen by what the drawn runs measure, and say its numbers."""

import re

import numpy as np
import pytest

from compressor.analysis import captions
from compressor.analysis.orbit import JournalMotion
from compressor.analysis.runs import CLEARANCES, FAULTS, label
from compressor.cases.case import Case
from compressor.report.figures import FIGURES
from compressor.solve.simulate import simulate

RESPONSES = {8: "big_end", 11: "small_end", 14: "both"}
FORCES = {9: ("big_end",) * 2, 12: ("small_end",) * 2, 15: ("both", "big_end"),
          16: ("both", "small_end")}  # fmt: skip
FIGURE = {figure.number: figure for figure in FIGURES}


def caption(number, runs):
    return captions.caption(number, {name: runs[name] for name in FIGURE[number].needs})


@pytest.fixture(scope="module")
def wild():
    """Runs under the paper's labels whose journals leave their bearings."""
    base = {"machine": {"rod_mass_kg": 1}, "contact": {"damping_N_s_per_mm": 0.3}}
    runs = {"design": simulate(Case.from_values({"machine": base["machine"]}))}
    for fault in FAULTS:
        for c in CLEARANCES:
            values = {**base, "joint": fault, "clearance_mm": c}
            runs[label(fault, c)] = simulate(Case.from_values(values))
    return runs


@pytest.mark.parametrize("number", FIGURE)
def test_captions_are_whole_sentences(paper_runs, number):
    text = caption(number, paper_runs)
    assert len(text) > 80
    assert text.endswith(".")
    assert not re.search(r"[{}]|nan|inf|e[+-]\d|  ", text)


@pytest.mark.parametrize(("number", "fault"), RESPONSES.items())
def test_no_flight_is_told_where_none_is(paper_runs, wild, number, fault):
    calm, loose = caption(number, paper_runs), caption(number, wild)
    runs = [paper_runs[label(fault, c)] for c in CLEARANCES]
    assert max(float(run["contact_loss_fraction"].max()) for run in runs) == 0
    assert "never leaves its bearing" in calm
    assert "without dry contact" not in calm
    least = [float(run["penetration"].sel(joint=joint).values[1200:].min())
             for run in runs for joint in (FAULTS[:2] if fault == "both" else [fault])]  # fmt: skip
    told = [float(text) for text in re.findall(r"by ([\d.]+) µm or more", calm)]
    assert min(told) == pytest.approx(1e6 * min(least), rel=0.06)
    assert "never leaves its bearing" not in loose
    assert "without dry contact for" in loose
    for name in ("lands", "landing", "thrown"):
        assert name not in calm + loose


@pytest.mark.parametrize(("number", "fault"), RESPONSES.items())
def test_peaks_are_the_runs_and_grow_only_if_they_do(paper_runs, wild, number, fault):
    for runs in (paper_runs, wild):
        found = [float(runs[label(fault, c)]["peak_acceleration"]) for c in CLEARANCES]
        text = caption(number, runs)
        assert ", ".join(f"{peak:.0f}" for peak in found) + " m/s²." in text
        grows = found == sorted(found)
        assert ("does not always grow" in text) is not grows


@pytest.mark.parametrize(("number", "where"), FORCES.items())
def test_forces_are_those_of_the_joint(paper_runs, number, where):
    fault, joint = where
    text = caption(number, paper_runs)
    for axis, words in (("x", "along the cylinder"), ("y", "across it")):
        peaks = [
            float(
                paper_runs[label(fault, c)]["peak_contact_force_axis"].sel(joint=joint, axis=axis)
            )
            for c in CLEARANCES
        ]
        assert ", ".join(f"{peak / 1e3:.2f}" for peak in peaks) + f" kN {words}" in text
    assert ("opposes" in text) is (joint == "small_end")


def test_slopes_are_those_of_the_fits(paper_runs):
    for number, joint in ((10, "big_end"), (13, "small_end")):
        kept = paper_runs[label(joint, 0.2)].isel(time=slice(1200, None))
        a = kept["acceleration"].values
        force = kept["contact_force"].sel(joint=joint, axis="x").values
        slope = np.cov(a, force)[0, 1] / np.var(a, ddof=1)
        assert f" {slope:.2f}, " in caption(number, paper_runs)


def test_what_is_left_of_the_loops_is_what_the_captions_say(paper_runs):
    """Without the load the small end's force is all inertia; the big end's nearly."""
    for joint, least in (("big_end", 0.99), ("small_end", 1 - 1e-9)):
        kept = paper_runs[label(joint, 0.2)].isel(time=slice(1200, None))
        a, load = kept["acceleration"].values, kept["piston_force"].values
        force = kept["contact_force"].sel(joint=joint, axis="x").values
        inertia = force + (load if joint == "small_end" else -load)
        before, after = (np.corrcoef(a, values)[0, 1] ** 2 for values in (force, inertia))
        assert before < 0.98
        assert after > least
    assert "and the rod" in caption(10, paper_runs)
    assert "and the rod" not in caption(13, paper_runs)


def test_loads_are_compared_by_their_numbers(paper_runs):
    text = caption(7, paper_runs)
    assert "3.35 kN, higher than the gas's 3.09 kN" in text
    assert "84.26°, 180.00°, 275.74°" in text
    other = {**paper_runs, "design": paper_runs["typical"], "typical": paper_runs["design"]}
    assert "no higher than" in caption(7, other)
    assert "coincide, as they must" in caption(6, paper_runs)
    moved = paper_runs["typical"].assign(velocity=1.01 * paper_runs["typical"]["velocity"])
    assert "differ by up to" in caption(6, {**paper_runs, "typical": moved})


def test_the_cam_and_the_gas_are_described_by_their_numbers(paper_runs):
    assert "rises by 208.7 mm and falls by 81.3 mm, so that the cam does not close" in caption(
        4, paper_runs
    )
    assert "rises and falls by 120.0 mm. From 294°" in caption(4, paper_runs)
    assert "38.95°, 180.00°, 294.20°, up to 0.2° off" in caption(3, paper_runs)
    exact = simulate(Case.from_values({"load": "gas", "gas": {"switching": "exact"}}))
    assert "off the exact ones" not in caption(3, {"typical": exact})


# ---- other machines ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("turns", "told"),
    [
        ([(70.0, 300.0), (72.0, 305.0), (74.0, 302.0)], ["70–74°", "300–305°"]),
        ([(2.0, 150.0), (149.0, 359.0), (1.0, 151.0)], ["359–2°", "149–151°"]),
        ([(150.0, 359.8), (0.4, 150.0), (0.1, 150.0)], ["150°", "0°"]),
        ([(180.0,), (180.2,), (179.9,)], ["180°"]),
        ([(), (), ()], []),
        ([(70.0,), (70.0, 300.0), ()], []),
    ],
)
def test_changes_about_top_dead_centre_belong_together(turns, told):
    assert [captions.format_span(span) for span in captions.angle_spans(turns)] == told


def courses(*turns, rings=(600.0, 500.0, 400.0)):
    """Three runs of a journal, of which no more is known than where its force turns."""
    return [JournalMotion("big_end", 0.0, 1e-5, 1.0, one, ring)
            for one, ring in zip(turns, rings, strict=True)]  # fmt: skip


def test_ringing_is_told_where_all_ring_after_the_same_change():
    same = courses((70.0, 300.0), (75.0, 300.0), (80.0, 300.0))
    assert captions.rings(same) == [
        "After the first change acceleration rings at 600, 500, 400 Hz."
    ]
    assert captions.rings(courses((359.0,), (1.0,), (2.0,)))
    assert not captions.rings(courses((2.0, 150.0), (150.0, 359.0), (1.0, 150.0)))
    assert not captions.rings(courses((70.0,), (70.0,), (70.0,), rings=(600.0, np.nan, 400.0)))

"""How a journal moves in its bearing: against motions that are known, and the paper's runs."""

import math

import numpy as np
import pytest
import xarray as xr

from compressor.analysis.orbit import course, ringing, turning_points
from compressor.analysis.runs import CLEARANCES, ideal_motion, label, settled_part
from compressor.cases.case import Case
from compressor.solve.cautions import contact_scales
from compressor.solve.simulate import simulate


@pytest.mark.parametrize("turns", [1, 3])
def test_turns_of_a_known_force(turns):
    angle = np.arange(0, 360.0 * turns, 0.3)
    force = np.sin(np.radians(angle - 40.0))
    assert turning_points(angle, force) == pytest.approx((40.0, 220.0), abs=0.3)
    assert turning_points(angle, force + 2.0) == ()


def test_a_force_that_trembles_about_zero_turns_once():
    angle = np.arange(0, 720.0, 0.3)
    trembling = np.sin(np.radians(angle)) + 0.05 * np.sin(np.radians(40 * angle))
    assert turning_points(angle, trembling) == pytest.approx((0.0, 180.0), abs=2.0)


def test_turns_about_top_dead_centre_are_one():
    angle = np.arange(0, 1080.0, 0.3)
    at = turning_points(angle, np.sin(np.radians(angle + 0.5 * np.cos(np.radians(angle / 3)))))
    assert len(at) == 2


@pytest.mark.parametrize("frequency", [250.0, 727.0])
def test_ringing_of_a_known_frequency(paper_runs, frequency):
    kept = settled_part(paper_runs["design"])
    time = kept["time"].values
    bursts = 50.0 * np.exp(-(time % 0.12 - 0.03) * 40) * np.sin(2 * np.pi * frequency * time)
    ideal = ideal_motion(kept)[2]
    known = kept.assign(acceleration=("time", ideal + bursts))
    assert ringing(known, 70.0) == pytest.approx(frequency, rel=0.02)


@pytest.mark.parametrize("rpm", [250, 500, 1000])
def test_a_slow_motion_s_foot_does_not_ring(rpm):
    """A motion of order 8, ten times as high as a burst of order 80, leaks beyond order 12."""
    run = simulate(Case.from_values({"machine": {"speed_rpm": rpm}}))
    kept = settled_part(run)
    angle = kept["crank_angle"].values
    slow = 100.0 * np.sin(8.0 * angle)
    burst = 10.0 * np.sin(80.0 * angle)
    known = kept.assign(acceleration=("time", ideal_motion(kept)[2] + slow + burst))
    assert ringing(known, 70.0) == pytest.approx(80.0 * rpm / 60.0, rel=0.02)
    alone = kept.assign(acceleration=("time", ideal_motion(kept)[2] + slow))
    assert not ringing(alone, 70.0) < 12.0 * rpm / 60.0


@pytest.mark.parametrize("joint", ["big_end", "small_end"])
@pytest.mark.parametrize("clearance", CLEARANCES)
def test_the_paper_s_journals_run_round_their_bearings(paper_runs, joint, clearance):
    run = paper_runs[label(joint, clearance)]
    found = course(run, joint)
    assert found.gap_fraction == 0.0
    assert 5e-6 < found.least < 20e-6
    assert found.laps == pytest.approx(1.0 if joint == "big_end" else -1.0, abs=0.02)
    assert len(found.turns) == 2


@pytest.mark.parametrize("clearance", CLEARANCES)
def test_what_rings_is_the_journal_s_swing_in_its_bearing(paper_runs, clearance):
    """sqrt(F / (m e)) by the force that acts then; not the contact's stiffness, overdamped."""
    run = paper_runs[label("big_end", clearance)]
    found = course(run, "big_end")
    case = Case.from_attribute(run.attrs["case"])
    (scales,) = contact_scales(case)
    assert scales.damping_ratio > 1
    kept = settled_part(run)
    after = (np.degrees(kept["crank_angle"].values) % 360.0 - found.turns[0]) % 360.0
    seen = (after > 5.0) & (after < 95.0)
    force = np.linalg.norm(kept["contact_force"].sel(joint="big_end").values[seen], axis=1)
    own = scales.swing_frequency * math.sqrt(force.mean() / scales.force)
    assert found.rings == pytest.approx(own, rel=0.25)
    assert found.rings < scales.swing_frequency


def test_a_journal_that_leaves_its_bearing_is_told():
    light = {"joint": "big_end", "clearance_mm": 0.3, "machine": {"rod_mass_kg": 1},
             "contact": {"damping_N_s_per_mm": 0.3}}  # fmt: skip
    found = course(simulate(Case.from_values(light)), "big_end")
    assert found.gap_fraction > 0.01
    assert found.least < 0


def test_a_course_in_a_circle():
    """A journal that is made to go round, three times a revolution and back."""
    run = simulate(Case.from_values({"joint": "big_end", "clearance_mm": 0.2}))
    angle = run["crank_angle"].values
    place = np.zeros((angle.size, 2, 2))
    place[:, 0] = 2e-4 * np.stack([np.cos(-3 * angle), np.sin(-3 * angle)], axis=1)
    turned = run.assign(eccentricity=(("time", "joint", "axis"), place))
    assert isinstance(turned, xr.Dataset)
    assert course(turned, "big_end").laps == pytest.approx(-3.0, abs=1e-9)

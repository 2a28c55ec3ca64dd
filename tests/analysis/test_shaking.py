"""How joints shake the frame: known forces, Parseval, and the paper's cases at full accuracy."""

import math

import numpy as np
import pytest

from compressor.analysis.runs import paper_cases
from compressor.analysis.shaking import (
    deviation_spectrum,
    frame_forces,
    near_a_turn,
    sensor_envelope,
    shaking,
    turning_points,
)
from compressor.cases.case import Case
from compressor.solve.simulate import simulate


@pytest.fixture(scope="module")
def exact():
    """The least and the greatest clearance at one joint, `accuracy: standard` as by default."""
    cases = paper_cases()
    names = [f"{joint} {c}" for joint in ("big_end", "small_end") for c in ("0.1", "0.3")]
    return {name: simulate(cases[name]) for name in names}


@pytest.mark.parametrize(
    ("name", "above"),
    [("big_end 0.1", 475), ("big_end 0.3", 1025), ("small_end 0.1", 639), ("small_end 0.3", 555)],
)
def test_force_above_order_12_of_the_paper_s_cases(exact, name, above):
    """Once measured apart from this code, by numpy's Fourier transform of 3 revolutions."""
    run = exact[name]
    assert shaking(run).spectrum.above == pytest.approx(above, rel=0.02)
    kept = slice(1200, 4800)
    force = frame_forces(run)["shaking_force"][kept, 0]
    lines = 2 * np.abs(np.fft.rfft(force) / force.size) ** 2
    root = math.sqrt(lines[12 * 3 + 1 :].sum() - lines[-1] / 2)
    assert shaking(run).spectrum.above == pytest.approx(root, rel=1e-3)


def test_why_it_rises_at_the_big_end_and_falls_at_the_small_end(exact):
    found = {name: shaking(run) for name, run in exact.items()}
    for name, one in found.items():
        assert math.hypot(one.near_turns, one.elsewhere) == pytest.approx(one.spectrum.above), name
    for joint in ("big_end", "small_end"):
        assert found[f"{joint} 0.3"].near_turns > 1.2 * found[f"{joint} 0.1"].near_turns
    assert found["big_end 0.3"].elsewhere > 2 * found["big_end 0.1"].elsewhere
    assert found["small_end 0.3"].elsewhere < 0.8 * found["small_end 0.1"].elsewhere


def test_without_friction_the_small_end_is_quiet_between_its_turns(exact):
    case = {"joint": "small_end", "clearance_mm": 0.1, "friction": False}
    smooth = shaking(simulate(Case.from_values(case)))
    assert smooth.elsewhere < 0.2 * shaking(exact["small_end 0.1"]).elsewhere


def test_ideal_joints_have_no_high_orders(paper_runs):
    found = shaking(paper_runs["design"])
    assert found.spectrum.above < 1e-6
    assert found.turns == ()
    assert deviation_spectrum(paper_runs["design"]).above < 1e-6


def test_a_known_force_has_its_lines_and_its_windows(paper_runs):
    """30 N of order 20 everywhere, and nothing else above order 12."""
    run = paper_runs["design"]
    angle = run["crank_angle"].values
    known = run.assign(piston_force=run["piston_force"] + 30 * np.sin(20 * angle))
    found = shaking(known)
    assert found.spectrum.above == pytest.approx(30 / math.sqrt(2), rel=1e-4)
    assert found.spectrum.amplitudes[20] == pytest.approx(30, rel=1e-4)
    assert found.elsewhere == pytest.approx(found.spectrum.above)
    assert found.near_turns == 0


def test_windows_about_turns_go_round():
    angle = np.arange(0.0, 360.0)
    near = near_a_turn(angle, (5.0, 330.0))
    assert near.sum() == 95  # from 320 to 55 degrees
    assert near[[0, 54, 320, 359]].all()
    assert not near[[55, 319]].any()


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


def test_a_journal_that_is_free_for_a_while_turns_once_or_not():
    """Each end of a flight counted as a change of sign."""
    angle = np.arange(0.0, 720.0, 0.1)
    force = np.where((angle % 360.0 > 100.0) & (angle % 360.0 < 140.0), 0.0, 1.0)
    assert turning_points(angle, force) == ()
    push = np.where((angle % 360.0 >= 140.0) & (angle % 360.0 < 300.0), -1.0, 1.0)
    assert turning_points(angle, force * push) == pytest.approx((140.0, 300.0), abs=0.2)


def test_turns_about_top_dead_centre_are_one():
    angle = np.arange(0, 1080.0, 0.3)
    at = turning_points(angle, np.sin(np.radians(angle + 0.5 * np.cos(np.radians(angle / 3)))))
    assert len(at) == 2


def test_a_sensor_s_band_holds_energy():
    case = {"joint": "big_end", "clearance_mm": 0.2, "body": True, "sensor": True,
            "solve": {"accuracy": "draft", "error_bars": False}}  # fmt: skip
    run = simulate(Case.from_values(case))
    found = sensor_envelope(run)
    values, time = run["sensor_acceleration"].values, run["sensor_time"].values
    power = np.abs(np.fft.rfft(values)) ** 2
    frequency = np.fft.rfftfreq(values.size, time[1] - time[0])
    inside = (frequency >= found.band[0]) & (frequency <= found.band[1])
    assert power[inside].sum() > 0.009 * power[1:].sum()
    assert sensor_envelope(run.drop_vars("sensor_acceleration")) is None

"""How joints shake the frame: known forces, Parseval, and the paper's cases at full accuracy."""

import math

import numpy as np
import pytest

from compressor.analysis.runs import paper_cases
from compressor.analysis.shaking import frame_forces, shaking
from compressor.solve.simulate import simulate
from compressor.vibration import RecordError


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
    assert shaking(run).above == pytest.approx(above, rel=0.02)
    kept = slice(1200, 4800)
    force = frame_forces(run)["shaking_force"][kept, 0]
    lines = 2 * np.abs(np.fft.rfft(force) / force.size) ** 2
    root = math.sqrt(lines[12 * 3 + 1 :].sum() - lines[-1] / 2)
    assert shaking(run).above == pytest.approx(root, rel=1e-3)


def test_ideal_joints_have_no_high_orders(paper_runs):
    assert shaking(paper_runs["design"]).above < 1e-6


def test_a_known_force_has_its_lines(paper_runs):
    """30 N of order 20 everywhere, and nothing else above order 12."""
    run = paper_runs["design"]
    angle = run["crank_angle"].values
    known = run.assign(piston_force=run["piston_force"] + 30 * np.sin(20 * angle))
    found = shaking(known)
    assert found.above == pytest.approx(30 / math.sqrt(2), rel=1e-4)
    assert found.amplitudes[20] == pytest.approx(30, rel=1e-4)


def test_samples_too_coarse_for_its_orders_are_refused(paper_runs):
    """Without lines above order 12 their rms would be 0."""
    run = paper_runs["big_end 0.3"]
    assert shaking(run.isel(time=slice(None, None, 40))).above > 0  # 12 degrees
    with pytest.raises(RecordError, match="order 12 is not below 12, half the samples a turn: run"):
        shaking(run.isel(time=slice(None, None, 50)))

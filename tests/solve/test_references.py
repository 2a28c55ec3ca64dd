"""The mechanism against numbers that others have published, and against equations written anew."""

import numpy as np
import pytest
from published import (
    ACCELERATION,
    POSITION,
    PUBLIC,
    RATE,
    SLIDERS,
    SLIDERS_WITHIN,
    exudyn_sliders,
    frame_orders,
    guided,
    rod_apart,
    simeon,
)
from scipy.interpolate import CubicSpline


def test_a_slider_with_play_flies_as_published():
    """Before its first contact: crank speed and height over clearance, to 1e-5."""
    run = guided(rtol=1e-11)
    speed = CubicSpline(run.time, run.crank_speed)
    height = CubicSpline(run.time, run.guide_height / 1e-3)
    assert speed([1e-3, 2e-3]) == pytest.approx([139.11588, 120.46388], abs=1e-5)
    assert height([1e-3, 2e-3]) == pytest.approx([0.077487, 0.494396], abs=1e-6)
    first = int(np.argmax(run.guide_gap.values < 0.0))
    closing = CubicSpline(run.time, run.guide_gap).roots(extrapolate=False)
    assert run.time[first - 1] < closing[0] < run.time[first]
    assert closing[0] == pytest.approx(2.6925e-3, abs=1e-7)
    # Siconos, SliderCrankMoreauJeanDirectProjectionOSI.ref, steps of 0.1 ms of order 1
    assert speed(1e-3) == pytest.approx(139.23030734, rel=5e-3)
    assert height(1e-3) == pytest.approx(0.07712895696, rel=5e-3)


def test_the_free_crank_keeps_its_energy():
    """Nothing drives it: what is lost is lost to the guide, before and after the first contact."""
    run = guided(rtol=1e-9, duration_s=8e-3)
    assert float(run.guide_gap.min()) < 0.0
    assert float(run.crank_work) == 0.0
    assert float(run.contact_damping_loss + run.friction_loss) > 0.0
    assert float(run.energy_residual) < 1e-6


def test_equations_written_anew_start_as_published():
    """With the public source's masses, to the digits of the published start."""
    found = simeon(0.0, POSITION, RATE, PUBLIC)
    assert found[1] == pytest.approx(ACCELERATION[1], abs=1e-5)
    assert found[4:] == pytest.approx(ACCELERATION[4:], abs=1e-7)
    assert found[[0, 2, 3]] == pytest.approx(ACCELERATION[[0, 2, 3]], abs=1e-6)


def test_an_elastic_rod_moves_by_the_same_equations():
    """Displacement, velocity, deflection across and along: SciPy's DOP853, with multipliers."""
    assert max(rod_apart(0.008).values()) < 1e-6


def test_a_frame_written_anew_moves_as_exudyn_s():
    """Held and free to move both ways, to the tolerance of Exudyn's own test."""
    assert exudyn_sliders() == pytest.approx(SLIDERS, abs=SLIDERS_WITHIN)


def test_a_body_driven_one_way_leaves_out_what_its_closed_form_says():
    """At 8 kg, up to a sixth of an order: with `back_action` both ways agree."""
    ours, both_ways = frame_orders()
    np.testing.assert_allclose(ours, both_ways, atol=1e-7 * abs(both_ways).max())

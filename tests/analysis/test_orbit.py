"""The orbit of a journal: against motions that are known, and the paper's runs."""

import numpy as np
import pytest
from bouncing import CLEARANCE, FLIGHT, SPEED, TURN, bounce, pressed, run_of, times

from compressor.analysis.orbit import NUMBERS, SERIES, orbit


def test_the_orbit_of_a_known_motion():
    time = times(0.03)
    run = run_of(time, {"big_end": bounce(time), "small_end": pressed(time)}, settle=0.12)
    found = orbit(run)
    big, small = found.sel(joint="big_end"), found.sel(joint="small_end")
    assert found["time"].values[0] == pytest.approx(0.12)
    assert found["crank_angle"].values[-1] == pytest.approx(4 * np.pi)
    for one in (big, small):
        assert float(one["laps"]) == pytest.approx(TURN * 0.12 / (2 * np.pi), rel=1e-9)
        turned = one["contact_angle"].diff("time").values
        np.testing.assert_allclose(turned, TURN * 1e-5, rtol=1e-6)
    deepest = SPEED * FLIGHT / 4 / CLEARANCE
    assert float(big["least_ratio"]) == pytest.approx(1 - deepest, rel=1e-4)
    assert float(big["off_wall_share"]) == pytest.approx(FLIGHT / 4.048e-3, abs=0.01)
    assert bool(big["leaves_wall"])
    np.testing.assert_allclose(small["eccentricity_ratio"], 1 + 2e-5 / CLEARANCE)
    assert not bool(small["leaves_wall"])
    assert not small["off_wall"].any()
    np.testing.assert_array_equal(big["in_flight"], big["off_wall"])


def test_everything_is_labelled():
    time = times(3.0)
    found = orbit(run_of(time, {"small_end": pressed(time)}))
    assert found["joint"].values.tolist() == ["small_end"]
    for name in (*SERIES, *NUMBERS, "crank_angle", "time"):
        assert found[name].attrs["units"]
        assert found[name].attrs["long_name"]


@pytest.mark.parametrize("label", ["big_end 0.2", "both 0.3"])
def test_the_paper_s_orbits_stay_on_the_wall(paper_runs, label):
    run = paper_runs[label]
    found = orbit(run)
    assert not found["leaves_wall"].any()
    assert (found["least_ratio"] > 1).all()
    for joint in found["joint"].values:
        way = 1.0 if joint == "big_end" else -1.0  # round the bearing once a revolution
        assert float(found["laps"].sel(joint=joint)) == pytest.approx(way, abs=0.01)


def test_an_orbit_needs_series_and_clearance(paper_runs):
    with pytest.raises(ValueError, match="no joint"):
        orbit(paper_runs["design"])
    with pytest.raises(ValueError, match="time series"):
        orbit(paper_runs["big_end 0.2"].drop_dims("time"))

"""Contact modes: shares and maps of contacts that are known, and of simulated ones."""

import numpy as np
import pytest
import xarray as xr
from bouncing import CONTACT, FLIGHT, TURN, bounce, pressed, run_of, times

from compressor.analysis.contacts import (
    FOLLOWING,
    MODES,
    contact_modes,
    impacts,
    measure_orbit,
    mode_map,
    mode_shares,
)
from compressor.cases.case import Case
from compressor.solve.simulate import simulate

IMPACTS = CONTACT / (CONTACT + FLIGHT)


def test_shares_of_known_bounces():
    time = times(0.03, 8)
    run = run_of(time, {"big_end": bounce(time), "small_end": pressed(time)}, settle=0.12)
    found = mode_shares(run)
    big, small = found.sel(joint="big_end"), found.sel(joint="small_end")
    assert big.values == pytest.approx([1 - IMPACTS, IMPACTS, 0.0], abs=2e-3)
    assert small.values.tolist() == [0.0, 0.0, 1.0]
    big, small = (measure_orbit(run, joint) for joint in ("big_end", "small_end"))
    assert big.laps == pytest.approx(small.laps) == pytest.approx(TURN * 0.12 / (2 * np.pi))
    assert (big.off_wall, small.off_wall) == (pytest.approx(1 - IMPACTS, abs=0.01), 0.0)


def test_a_landing_that_stays_is_impact_and_then_following():
    """Penetration d (1 - cos w t) about rest: the impact ends with its first minimum."""
    time = times(0.03)
    landed, period, deep = 0.05, 0.8e-3, 4e-5
    after = time - landed
    ring = deep * (1.0 - np.cos(2 * np.pi * after / period) * np.exp(-after / period))
    depth = np.where(after < 0, 0.05 * after, ring)
    run = run_of(time, {"big_end": (depth, np.where(after > 0, 1e8 * depth, 0.0))})
    mode = contact_modes(run)["mode"].sel(joint="big_end")
    names = np.array(MODES)[mode.values]
    since = after[names == "impact"]
    assert since[0] == pytest.approx(0.0, abs=2e-5)
    assert since[-1] == pytest.approx(period, rel=0.05)
    assert (names[after > period * 1.05] == "following").all()
    assert (names[after < -1e-9] == "flight").all()


def test_an_impact_that_never_rebounds_is_over_in_a_hertzian_contact_time():
    time = times(0.03)
    after = time - 0.05
    depth = np.where(after < 0, 0.1 * after, 2e-5 * -np.expm1(-after / 2e-4))
    run = run_of(time, {"big_end": (depth, np.where(after > 0, 1e8 * depth, 0.0))})
    mode = contact_modes(run)["mode"].sel(joint="big_end").values
    longest = 2.9432 * (5 * 18.7 * 0.1**2 / (4 * 1.0625e10)) ** 0.4 / 0.1
    assert (mode == 1).sum() * 1e-5 == pytest.approx(longest, rel=0.03)
    assert mode[-1] == FOLLOWING


def test_a_release_while_pressed_in_is_following():
    time = times(0.3)
    depth, force = pressed(time)
    force[100:110] = 0.0
    found = contact_modes(run_of(time, {"small_end": (depth, force)}))
    assert (found["mode"] == FOLLOWING).all()


def map_of(mode, step=0.25):
    """The map of a mode over (time, 1) that begins at top dead centre, samples a step apart."""
    angle = np.radians(np.arange(mode.size) * step)
    return mode_map(
        xr.Dataset(
            {"mode": (("time", "joint"), mode[:, None].astype(np.int8))},
            {"crank_angle": ("time", angle), "joint": ["big_end"]},
        )
    )


def test_a_map_puts_revolutions_together():
    """Flight from 90 to 180 degrees in one of three revolutions, following elsewhere."""
    mode = np.full(3 * 1440 + 1, FOLLOWING)
    mode[360:720] = 0
    found = map_of(mode)
    assert found["angle"].values[[0, -1]].tolist() == [0.5, 359.5]
    flight = found["share"].sel(joint="big_end", mode="flight").values
    np.testing.assert_allclose(flight[90:180], 1 / 3)
    assert flight[:90].max() == flight[180:].max() == 0.0
    assert (found["majority"] == FOLLOWING).all()
    np.testing.assert_allclose(found["share"].sum("mode"), 1.0)
    mode[1440 + 360 : 1440 + 720] = 0
    assert (map_of(mode)["majority"].values[90:180] == 0).all()


def test_bins_without_samples_are_told():
    found = map_of(np.full(181, FOLLOWING), 2.0)
    assert (found["majority"].values[1::2] == -1).all()
    assert np.isnan(found["share"].values[1::2]).all()


def test_shares_of_a_simulated_run_are_its_metrics():
    """Contact that is lost is flight, but for what is released while pressed in."""
    values = {"joint": "both", "clearance_mm": 0.3, "machine": {"speed_rpm": 1500},
              "contact": {"damping_N_s_per_mm": 1},
              "solve": {"duration_rev": 2, "output_step_deg": 0.1}}  # fmt: skip
    run = simulate(Case.from_values(values))
    found = mode_shares(run)
    lost = run["contact_loss_fraction"].values
    assert lost.max() > 0.01
    np.testing.assert_allclose(found.sel(mode="flight"), lost, atol=1e-3)


def test_the_paper_s_journals_only_follow(paper_runs):
    found = mode_shares(paper_runs["both 0.3"])
    assert found.sel(mode="following").values.tolist() == [1.0, 1.0]
    for joint, way in (("big_end", 1.0), ("small_end", -1.0)):  # round it once a revolution
        assert measure_orbit(paper_runs["both 0.3"], joint) == (pytest.approx(way, abs=0.01), 0.0)


@pytest.mark.parametrize(("viscosity", "struck"), [(1, 4), (30, 4), (3000, 0)])
def test_a_film_is_no_contact(viscosity, struck):
    """The force of the film across the gap was taken for contact: 0, 2 and 4 impacts were seen."""
    run = simulate(Case.from_values({
        "joint": "big_end", "clearance_mm": 0.1, "friction": False, "machine": {"rod_mass_kg": 1},
        "contact": {"damping_N_s_per_mm": 10}, "lubricant": {"viscosity_mPa_s": viscosity},
        "solve": {"duration_rev": 3, "settle_rev": 1, "accuracy": "draft", "output_step_deg": 0.1},
    }))  # fmt: skip
    assert len(impacts(run)) == run["impact_count"].sel(joint="big_end") == struck
    flight = mode_shares(run).sel(joint="big_end", mode="flight")
    lost = run["contact_loss_fraction"].sel(joint="big_end")
    assert flight == pytest.approx(float(lost), abs=0.1)

"""Impacts and modes of contact: closed forms of bounces, and what a run says of itself."""

import numpy as np
import pytest
from bouncing import CONTACT, FLIGHT, bounce, pressed, run_of, times

from compressor.analysis import impacts, settled_part
from compressor.analysis.contacts import FOLLOWING, contact_series, impacts_of, modes_of
from compressor.cases.case import Case
from compressor.solve.simulate import simulate

LIGHT = {"clearance_mm": 0.3, "contact": {"damping_N_s_per_mm": 1}}


def column(found, name):
    return np.array([getattr(one, name) for one in found])


@pytest.mark.parametrize(("step", "error"), [(0.3, 5e-7), (0.03, 5e-9)])
def test_known_bounces(step, error):
    """Times are multiples of a bounce's period, at odds with the sampling; the first begins at 0
    and follows no flight; the last is cut off."""
    time = times(step)
    found = impacts(run_of(time, {"big_end": bounce(time), "small_end": pressed(time)}))
    begins = np.arange(1, time[-1] // (CONTACT + FLIGHT) + 1) * (CONTACT + FLIGHT)
    assert len(found) == begins.size
    assert {one.joint for one in found} == {"big_end"}
    np.testing.assert_allclose(column(found, "time"), begins, atol=error)
    angles = column(found, "crank_angle")
    np.testing.assert_allclose(angles, begins * 3000.0 % 360.0, atol=3000 * error)
    assert column(found, "revolution").tolist() == (begins // 0.12 + 1).tolist()


def test_a_release_while_pressed_in_is_no_impact():
    time = times(0.3)
    depth, force = pressed(time)
    force[100:110] = 0.0
    run = run_of(time, {"big_end": (depth, force)})
    assert not impacts(run)
    assert (modes(run, "big_end") == FOLLOWING).all()
    depth[105] = -1e-9
    assert len(impacts(run_of(time, {"big_end": (depth, force)}))) == 1


@pytest.mark.parametrize(
    ("joint", "speed"), [("big_end", 1500), ("small_end", 1500), ("both", 1000)]
)
def test_impacts_are_as_many_as_the_run_counted(joint, speed):
    solve = {"duration_rev": 2, "accuracy": "fine", "output_step_deg": 0.03}
    more = {"joint": joint, "machine": {"speed_rpm": speed}, "solve": solve}
    run = simulate(Case.from_values(LIGHT | more))
    found = impacts(run)
    counts = [sum(one.joint == name for one in found) for name in run["joint"].values]
    assert counts == run["impact_count"].values.astype(int).tolist()
    assert sum(counts) >= 3
    # contact that is lost is flight, but for what is released while pressed in
    lost = run["contact_loss_fraction"].values
    assert lost.max() > 0.01
    flight = [shares(run, name)[0] for name in run["joint"].values]
    np.testing.assert_allclose(flight, lost, atol=1e-3)


def modes(run, joint):
    series = contact_series(run, joint)
    return modes_of(series, impacts_of(run, series))


def shares(run, joint):
    found = modes(settled_part(run), joint)[:-1]
    return np.bincount(found, minlength=3) / found.size


def test_shares_of_known_bounces():
    time, struck = times(0.03, 8), CONTACT / (CONTACT + FLIGHT)
    run = run_of(time, {"big_end": bounce(time), "small_end": pressed(time)}, settle=0.12)
    assert shares(run, "big_end") == pytest.approx([1 - struck, struck, 0.0], abs=2e-3)
    assert shares(run, "small_end").tolist() == [0.0, 0.0, 1.0]


def test_a_landing_that_stays_is_impact_and_then_following():
    """Penetration d (1 - cos w t) about rest: the impact ends with its first minimum."""
    time = times(0.03)
    landed, period, deep = 0.05, 0.8e-3, 4e-5
    after = time - landed
    ring = deep * (1.0 - np.cos(2 * np.pi * after / period) * np.exp(-after / period))
    depth = np.where(after < 0, 0.05 * after, ring)
    run = run_of(time, {"big_end": (depth, np.where(after > 0, 1e8 * depth, 0.0))})
    names = np.array(["flight", "impact", "following"])[modes(run, "big_end")]
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
    mode = modes(run, "big_end")
    longest = 2.9432 * (5 * 18.7 * 0.1**2 / (4 * 1.0625e10)) ** 0.4 / 0.1
    assert (mode == 1).sum() * 1e-5 == pytest.approx(longest, rel=0.03)
    assert mode[-1] == FOLLOWING


@pytest.mark.parametrize(("viscosity", "struck"), [(1, 4), (30, 4), (3000, 0)])
def test_a_film_is_no_contact(viscosity, struck):
    """The force of the film across the gap was taken for contact: 0, 2 and 4 impacts were seen."""
    run = simulate(Case.from_values({
        "joint": "big_end", "clearance_mm": 0.1, "friction": False, "machine": {"rod_mass_kg": 1},
        "contact": {"damping_N_s_per_mm": 10}, "lubricant": {"viscosity_mPa_s": viscosity},
        "solve": {"duration_rev": 3, "settle_rev": 1, "accuracy": "draft", "output_step_deg": 0.1},
    }))  # fmt: skip
    assert len(impacts(run)) == run["impact_count"].sel(joint="big_end") == struck
    lost = run["contact_loss_fraction"].sel(joint="big_end")
    assert shares(run, "big_end")[0] == pytest.approx(float(lost), abs=0.1)

"""The table of impacts: closed forms of bounces, and what a run says of itself."""

import numpy as np
import pytest
from bouncing import CONTACT, FLIGHT, SPEED, bounce, pressed, run_of, times

from compressor.analysis.contacts import impacts
from compressor.cases.case import Case
from compressor.solve.simulate import simulate

LIGHT = {"joint": "big_end", "clearance_mm": 0.3, "machine": {"speed_rpm": 1500},
         "contact": {"damping_N_s_per_mm": 1}}  # fmt: skip


def simulated(step_deg, **more):
    solve = {"duration_rev": 2, "accuracy": "fine", "output_step_deg": step_deg}
    return simulate(Case.from_values({**LIGHT, **more, "solve": solve}))


def column(found, name):
    return np.array([getattr(one, name) for one in found])


@pytest.fixture(scope="module")
def fine():
    return simulated(0.03)


@pytest.mark.parametrize(("step", "error"), [(0.3, 5e-5), (0.03, 2e-7)])
def test_known_bounces(step, error):
    """Times are multiples of a bounce's period, at odds with the sampling; the first begins at 0
    and follows no flight; the last is cut off."""
    time = times(step)
    found = impacts(run_of(time, {"big_end": bounce(time), "small_end": pressed(time)}))
    begins = np.arange(1, time[-1] // (CONTACT + FLIGHT) + 1) * (CONTACT + FLIGHT)
    assert len(found) == begins.size
    assert {one.joint for one in found} == {"big_end"}
    np.testing.assert_allclose(column(found, "time"), begins, atol=2e-9 if step == 0.3 else 2e-12)
    np.testing.assert_allclose(column(found, "crank_angle"), begins * 3000.0 % 360.0, atol=1e-5)
    assert column(found, "revolution").tolist() == (begins // 0.12 + 1).tolist()
    np.testing.assert_allclose(column(found, "approach_speed"), SPEED, rtol=error)


def test_start_up_is_left_out():
    time = times(0.3)
    found = impacts(run_of(time, {"big_end": bounce(time)}, settle=0.12))
    assert found[0].time == pytest.approx(30 * (CONTACT + FLIGHT))
    assert min(one.revolution for one in found) == 2


def test_a_release_while_pressed_in_is_no_impact():
    time = times(0.3)
    depth, force = pressed(time)
    force[100:110] = 0.0
    assert not impacts(run_of(time, {"big_end": (depth, force)}))
    depth[105] = -1e-9
    assert len(impacts(run_of(time, {"big_end": (depth, force)}))) == 1


def test_a_flight_of_few_samples_has_its_approach_speed():
    """Two samples without contact: through them and the first in contact goes a parabola."""
    time = times(0.3)
    depth = 2e-5 * np.cos(2 * np.pi * (time - 0.01) / 2e-2) ** 2 - 2.9e-7
    run = run_of(time, {"big_end": (depth, np.where(depth > 0, 5e7 * depth, 0.0))})
    found = impacts(run)
    zero = np.arcsin(np.sqrt(2.9e-7 / 2e-5))
    expected = 2e-5 * np.sin(2 * zero) * np.pi / 1e-2
    assert found
    assert column(found, "approach_speed") == pytest.approx(expected, rel=0.15)


@pytest.mark.parametrize(
    ("joint", "speed"), [("big_end", 1500), ("small_end", 1500), ("both", 1000)]
)
def test_impacts_are_as_many_as_the_run_counted(joint, speed):
    run = simulated(0.03, joint=joint, machine={"speed_rpm": speed})
    found = impacts(run)
    counts = [sum(one.joint == name for one in found) for name in run["joint"].values]
    assert counts == run["impact_count"].values.astype(int).tolist()
    assert sum(counts) >= 3
    assert all(one.approach_speed > 0 for one in found)


def test_sampling_errs_by_little(fine):
    """What is promised at 0.3 degrees, by impacts whose contact has ten samples or fewer."""
    coarse, exact = impacts(simulated(0.3)), impacts(fine)
    assert len(coarse) == len(exact) > 0
    for name, error in {"time": 1e-8, "approach_speed": 5e-5}.items():
        np.testing.assert_allclose(column(coarse, name), column(exact, name), rtol=error)

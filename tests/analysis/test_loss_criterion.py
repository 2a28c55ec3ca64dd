"""Expected contact loss: forces that turn at known rates, arcs that overlap, simulated flights."""

import numpy as np
import pytest

from compressor.analysis.loss_criterion import (
    INDICES,
    Lookout,
    arcs,
    compare_losses,
    indices_of,
    joined,
    loss_indices,
    outcomes,
    swing_mass,
)
from compressor.cases.case import Case
from compressor.solve import record
from compressor.solve.simulate import simulate


def case(**values):
    return Case.from_values({"joint": "both", "clearance_mm": 0.3, **values})


def test_a_force_that_turns_evenly():
    """Of one size, three turns a period: every index is a constant."""
    time = np.linspace(0.0, 0.12, 3601)
    rate = 3 * 2 * np.pi / 0.12
    force = 400.0 * np.stack([np.cos(rate * time), -np.sin(rate * time)], axis=1)
    found = indices_of(time, force, 4.7e-4)
    np.testing.assert_allclose(found["force"], 400.0)
    np.testing.assert_allclose(found["turn_rate"], -rate, rtol=1e-5)
    np.testing.assert_allclose(found["earles_wu"], rate / 400.0, rtol=1e-5)
    np.testing.assert_allclose(found["index"], rate / np.sqrt(400.0 / 4.7e-4), rtol=1e-5)
    assert found["direction"][-1] == pytest.approx(-6 * np.pi)


def test_a_force_that_reverses_past_zero():
    """F = (A cos wt, b): its direction turns fastest where it is least, at A w / b."""
    time = np.linspace(0.0, 0.12, 7201)
    spin, large, small = 2 * np.pi / 0.12, 3000.0, 100.0
    force = np.stack([large * np.cos(spin * time), np.full(time.size, small)], axis=1)
    found = indices_of(time, force, 1e-4)
    assert time[np.argmax(found["index"])] in (pytest.approx(0.03), pytest.approx(0.09))
    assert found["index"].max() == pytest.approx(
        large * spin / small * np.sqrt(1e-4 / small), rel=1e-4
    )
    still = indices_of(time, force * [1.0, 0.0], 1e-4)
    assert np.isfinite(still["index"][:10]).all()
    assert still["index"][:10] == pytest.approx(0.0)


def test_a_force_of_zero_is_infinitely_fast():
    time = np.linspace(0.0, 1.0, 5)
    force = np.array([[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
    assert np.isinf(indices_of(time, force, 1.0)["index"]).tolist() == [False, True] * 2 + [False]


@pytest.mark.parametrize(("joint", "lever"), [("big_end", 0.4), ("small_end", 0.2)])
def test_what_swings_is_the_rod_about_its_other_end(joint, lever):
    p = record(case(machine={"rod_mass_kg": 3, "rod_centre_mm": 200, "rod_inertia_kg_m2": 0.1}))
    mass = (0.1 + 3 * lever**2) / 0.6**2
    assert swing_mass(p, joint) == pytest.approx(mass * 3e-4, rel=1e-12)


def test_indices_scale_as_they_must():
    """With the clearance's root; without a load not at all with the speed."""
    wide, narrow = loss_indices(case()), loss_indices(case(clearance_mm=0.075))
    np.testing.assert_allclose(wide["index"], 2.0 * narrow["index"])
    np.testing.assert_allclose(wide["earles_wu"], narrow["earles_wu"])
    slow, fast = (
        loss_indices(case(load="none", machine={"speed_rpm": speed})) for speed in (500, 1500)
    )
    np.testing.assert_allclose(slow["index"], fast["index"], rtol=1e-6)
    np.testing.assert_allclose(9.0 * slow["force"], fast["force"], rtol=1e-9)
    for name in INDICES:
        assert wide[name].attrs["units"]
        assert wide[name].attrs["long_name"]
    assert wide["angle"].values[[0, -1]] == pytest.approx([0.0, 359.9])


def test_arcs_go_round():
    mask = np.zeros(360, bool)
    mask[[0, 1, 100, 358, 359]] = True
    assert arcs(mask) == [(100.0, 101.0), (358.0, 362.0)]
    assert arcs(~mask & True) == [(2.0, 100.0), (101.0, 358.0)]
    assert arcs(np.ones(4, bool)) == [(0.0, 360.0)]
    assert arcs(np.zeros(4, bool)) == []
    bounces = [(3.0, 5.0), (9.0, 12.0), (200.0, 210.0), (355.0, 358.0)]
    assert joined(bounces, 10.0) == [(200.0, 210.0), (355.0, 372.0)]
    assert joined(bounces, 1.0) == bounces


def test_hits_false_alarms_and_misses():
    predicted = [(70.0, 80.0), (150.0, 152.0), (350.0, 358.0)]
    lost = [(2.0, 9.0), (75.0, 90.0), (155.0, 160.0), (300.0, 301.0)]
    told = [outcome for outcome, _ in outcomes(predicted, lost, 0.0)]
    assert told == ["hit", "false_alarm", "false_alarm", "miss", "miss", "miss"]
    assert outcomes(predicted, lost, 5.0) == [
        ("hit", (70.0, 80.0)), ("hit", (150.0, 152.0)), ("hit", (350.0, 358.0)),
        ("miss", (300.0, 301.0)),
    ]  # fmt: skip


def simulated(joint, clearance=0.3, **machine):
    return simulate(
        Case.from_values(
            {"joint": joint, "clearance_mm": clearance, "machine": machine,
             "contact": {"damping_N_s_per_mm": 1}}
        )
    )  # fmt: skip


def test_losses_at_the_small_end_are_foretold():
    """Where the small end's force reverses, its direction turns fast: both times it lets go.

    With 0.3 mm the motion is chaotic, and lets go once or twice.
    """
    found = compare_losses(simulated("both", 0.26, speed_rpm=1500))
    small = found["joint_of"].values == "small_end"
    assert found["outcome"].values[small].tolist() == ["hit", "hit"]
    near = [(60.0, 90.0), (270.0, 300.0)]
    for (low, high), begin, end in zip(near, found["begin"], found["end"], strict=True):
        assert low < float(begin) < float(end) < high
    assert float(found["lost_share"].sel(joint="small_end")) > 0


def test_losses_at_the_big_end_are_missed_at_a_level_of_one():
    run = simulated("big_end", speed_rpm=1500)
    found = compare_losses(run)
    assert set(found["outcome"].values) == {"miss"}
    assert found["predicted_share"].item() == 0.0
    assert found["lost_share"].item() == pytest.approx(
        float(run["contact_loss_fraction"].sel(joint="big_end")), abs=0.02
    )
    lower = compare_losses(run, Lookout(level=0.5))
    assert lower["outcome"].values.tolist().count("hit") >= 1


def test_nothing_is_lost_in_the_paper_s_runs(paper_runs):
    found = compare_losses(paper_runs["big_end 0.2"])
    assert found.sizes["interval"] == 0
    assert found["lost_share"].values.tolist() == [0.0]
    with pytest.raises(ValueError, match="no joint"):
        loss_indices(Case())

"""Numbers of guide, drive, rod and friction against balances, closed forms and limits."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.solve.simulate import simulate

SHORT = {"duration_rev": 1, "settle_rev": 0.5}
FRICTION = {"ideal_joints": True}


def run(**values):
    values.setdefault("solve", SHORT)
    return simulate(Case.resolve(values))


@pytest.mark.parametrize(
    "case",
    [
        {"joint": "small_end", "clearance_mm": 0.2},
        {"joint": "both", "clearance_mm": 0.2},
        {"joint": "big_end", "clearance_mm": 0.2},
        {"friction": FRICTION},
        {"joint": "small_end", "clearance_mm": 0.2, "guide": {"clearance_mm": 0.05}},
        {"joint": "small_end", "clearance_mm": 0.2, "lubricant": True},
    ],
)
def test_over_a_revolution_the_crank_s_torque_leaves_by_the_guide(case):
    """Without friction's couple on the crosshead pin, 42.645 for 44.579 N m in the first case."""
    solve = {"duration_rev": 9, "settle_rev": 8}
    found = run(**case, load="gas", solve=solve, output={"signals": True})
    torque, moment = (found[f"mean_{name}"] for name in ("crank_torque", "guide_moment"))
    bars = found["mean_crank_torque_error"] + found["mean_guide_moment_error"]
    assert abs(torque - moment) <= bars + 1e-4 * abs(torque)
    # stored samples alias the couple of friction, which lasts shorter than their step
    last = found["guide_moment"].values[-1200:]
    assert last.mean() == pytest.approx(moment.item(), rel=0.03)


def test_the_torque_on_the_crank_is_not_the_motor_s():
    found = run(drive={"flywheel_kg_m2": 2}, output={"signals": True})
    force = found["contact_force"].sel(joint="big_end")
    angle = found["crank_angle"]
    by_rod = 0.12 * (np.cos(angle) * force.sel(axis="y") - np.sin(angle) * force.sel(axis="x"))
    np.testing.assert_allclose(found["crank_torque"], by_rod, rtol=0, atol=1e-9)
    # what is between them turns the flywheel
    speed, time = found["crank_speed"].values, found["time"].values
    turning = 2.0 * np.gradient(speed, time)[1:-1]
    between = (found["motor_torque"] - found["crank_torque"]).values[1:-1]
    # a difference over two samples misses the load's jumps
    assert np.median(np.abs(turning - between)) < 2e-4 * np.abs(between).max()
    assert np.abs(between).max() > 0.5 * np.abs(found["crank_torque"]).max()


def test_what_a_rod_s_material_takes_is_no_loss_of_a_contact():
    rod = {"youngs_modulus_GPa": 20, "damping_ratio": 0.05}
    alone = run(rod=rod)
    assert alone["contact_damping_loss"] == 0.0
    assert alone["rod_damping_loss"] == pytest.approx(0.0440, abs=1e-4)
    worn = run(rod=rod, joint="both", clearance_mm=0.1)
    assert worn["contact_damping_loss"] > 0.0
    assert worn["rod_damping_loss"] > 0.0
    assert run(joint="both", clearance_mm=0.1)["rod_damping_loss"] == 0.0


def test_a_drive_s_times_are_those_that_pass():
    drive = {"flywheel_kg_m2": 0.5, "slope_N_m_s": 0, "torque_N_m": 20}
    found = run(load="gas", drive=drive, solve={"duration_rev": 8, "settle_rev": 1})
    assert found["reason"] == "crank_stalled"
    time, angle = found["time"].values, found["crank_angle"].values
    assert 0.0 <= found.attrs["stop_time"] - np.nanmax(time) < 0.05
    assert np.array_equal(np.isnan(time), np.isnan(angle))
    begin = np.interp(2.0 * np.pi, angle[~np.isnan(angle)], time[~np.isnan(time)])
    assert found.attrs["settle"] == pytest.approx(begin, rel=1e-12)


def test_shares_and_means_of_a_drive_are_of_the_time():
    """By the samples of a machine that slows by a third within each revolution."""
    values = {"drive": {"flywheel_kg_m2": 0.5, "slope_N_m_s": 20}, "load": "gas"}
    found = run(**values, joint="both", clearance_mm=0.2, solve=SHORT | {"output_step_deg": 0.05})
    assert (found["impacts_per_rev"] == found["impact_count"] / 0.5).all()
    kept = found.isel(time=found["time"].values >= found.attrs["settle"] * (1 - 1e-12))
    time, step = kept["time"].values, np.diff(kept["time"].values)
    assert step.max() > 1.2 * step.min()
    squares = kept["acceleration"].values ** 2
    rms = np.sqrt(np.trapezoid(squares, time) / (time[-1] - time[0]))
    assert found["rms_acceleration"] == pytest.approx(rms, rel=2e-3)
    for joint in ("big_end", "small_end"):
        apart = (kept["penetration"].sel(joint=joint).values < 0.0).astype(float)
        share = np.trapezoid(apart, time) / (time[-1] - time[0])
        assert found["contact_loss_fraction"].sel(joint=joint) == pytest.approx(share, abs=0.01)


def test_a_healthy_machine_with_a_drive_does_not_deviate_from_the_ideal_one():
    """Its own speed gives way: compared with a steady crank it had 21.9 m/s2."""
    found = run(drive={"flywheel_kg_m2": 1}, solve={"duration_rev": 3, "settle_rev": 1})
    assert found["rms_acceleration_deviation"] < 1e-10


@pytest.mark.parametrize("slope", [1e6, 1e7, 1e9])
def test_a_steep_motor_keeps_its_digits(slope):
    """T + s (omega_0 - omega) had none left: energy_audit_failed from 1e6 on."""
    found = run(drive={"slope_N_m_s": slope}, solve={"duration_rev": 2, "settle_rev": 1})
    assert found["status"] == "ok"
    steady = run(solve={"duration_rev": 2, "settle_rev": 1})
    assert found["peak_acceleration"] == pytest.approx(steady["peak_acceleration"].item(), rel=2e-3)


def test_lugre_without_coefficients_is_no_friction():
    none = run(joint="big_end", clearance_mm=0.2, friction=False)
    zero = {"law": "lugre", "static": 0, "dynamic": 0}
    found = run(joint="big_end", clearance_mm=0.2, friction=zero)
    assert found["status"] == "ok"
    assert found["friction_loss"] == 0.0
    bar = found["rms_acceleration_error"] + none["rms_acceleration_error"]
    assert abs(found["rms_acceleration"] - none["rms_acceleration"]) <= bar


@pytest.mark.parametrize(
    ("values", "reason", "words"),
    [
        ({"guide": {"clearance_mm": 0.1, "friction": 3}}, "guide_implausible", "4 mm deep"),
        ({"rod": {"youngs_modulus_GPa": 0.001}}, "rod_implausible", "60 mm"),
        ({"rod": {"depth_mm": 4}}, "rod_implausible", "60 mm"),
    ],
)
def test_what_no_guide_or_rod_bears_ends_a_run(values, reason, words):
    solve = {"duration_rev": 0.5, "settle_rev": 0.25, "accuracy": "draft"}
    found = run(**values, solve=solve)
    assert (found["reason"], found["status"]) == (reason, "failed")
    assert words in found.attrs["detail"]


PINS = {"big_end": 60, "small_end": 35}


def test_pins_of_two_radii_are_each_joint_s_own():
    """As with one radius at the joint that has clearance; both matter where both have."""
    fast = {"duration_rev": 1, "settle_rev": 0.25, "accuracy": "fine"}
    contact = {"materials": ["steel", "copper"], "geometry": "internal"}

    def found(joint, **machine):
        machine["pin_radius_mm"] = machine.pop("pins")
        values = {"joint": joint, "clearance_mm": 0.2, "contact": contact, "machine": machine}
        return run(**values, solve=fast)

    for joint, own in (("big_end", 60.0), ("small_end", 35.0)):
        two = found(joint, pins=PINS)
        one = found(joint, pins=own)
        assert two["peak_contact_force"].equals(one["peak_contact_force"])
    both = found("both", pins=PINS)
    for radius in (60, 35):
        one = found("both", pins=radius)
        assert (both["peak_contact_force"] != one["peak_contact_force"]).all()

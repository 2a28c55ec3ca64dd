"""Runs with features, oil and other laws: integrators agree, energy closes; their numbers."""

import math

import numpy as np
import pytest
from cylinder_made import DOUBLE, MACHINE

from compressor.cases.case import Case
from compressor.solve import simulate
from compressor.solve.run import run_at_tolerance

BIG_END, SMALL_END, BOTH = (
    {"joint": joint, "clearance_mm": 0.2} for joint in ("big_end", "small_end", "both")
)
PIN = {"length_mm": 20, "materials": ["steel", "copper"]}
GUIDE, RUBBING = {"guide": {"clearance_mm": 0.1}}, {"friction": {"ideal_joints": True}}
COMBINATIONS = {
    "play": {**GUIDE, **RUBBING},
    "speed": {**BIG_END, "drive": True, "load": "gas", **RUBBING},
    "oil": {"joint": "both", "clearance_mm": 0.05, "lubricant": True},
    "elastic": {**SMALL_END, "rod": {"damping_ratio": 0.05}},
    "all": {
        **BOTH, "drive": {"flywheel_kg_m2": 1}, **GUIDE,
        "rod": {"damping_ratio": 0.05}, "machine": {"gravity_m_per_s2": 9.81},
    },
    "johnson": {**BOTH, "contact": {"law": "johnson", **PIN}},
    "liu": {**BOTH, "contact": {"law": "liu", **PIN}},
    "lugre": {**BOTH, "friction": {"law": "lugre"}},
    "ambrosio": {**BIG_END, "friction": {"law": "ambrosio"}},
    "lankarani": {**BOTH, "contact": {"law": "lankarani_nikravesh", "restitution": 0.6}},
    "cylinder": {
        **SMALL_END, "load": "gas", "machine": MACHINE, "gas": DOUBLE,
        "drive": {"flywheel_kg_m2": 20, "torque_N_m": 600},
    },
    "flores": {**SMALL_END, "contact": {"law": "flores", "restitution": 0.6}},
}  # fmt: skip
SHORT = {"lugre": 0.05, "all": 0.05, "elastic": 0.05, "oil": 0.03, "johnson": 0.03, "liu": 0.03}
UNDAMPED = "johnson", "liu"  # but for friction


def run(values, **solve):
    how = {"duration_rev": 0.5, "settle_rev": 0, "error_bars": False, **solve}
    found = simulate(Case.from_values({**values, "solve": how}))
    assert found.status == "ok", found.attrs.get("detail")
    return found


def apart(one, other, name="acceleration"):
    a, b = one[name].values, other[name].values
    return float(np.linalg.norm(a - b) / np.linalg.norm(a))


@pytest.mark.parametrize("name", COMBINATIONS)
def test_three_integrators_agree(name):
    """Explicit steps, stiff ones and SciPy's DOP853 share the equations alone."""
    rtol, bound = (1e-10, 1e-3) if name in UNDAMPED else (1e-8, 2e-4)
    how = {"duration_rev": SHORT.get(name, 0.15), "rtol": rtol}  # SciPy's steps in Python are many
    runs = [run(COMBINATIONS[name], method=one, **how) for one in ("TSIT5", "RODAS", "DOP853")]
    for one in runs:
        assert float(one.energy_residual) < 1e-5
    for other in runs[1:]:
        assert apart(runs[0], other) < bound
        assert apart(runs[0], other, "contact_force") < bound
        assert (other.impact_count == runs[0].impact_count).all()


def test_an_accuracy_is_kept():
    """What `standard` promises, against a tighter run."""
    span = {"duration_rev": 1, "settle_rev": 0.5}
    found = simulate(Case.from_values({**COMBINATIONS["all"], "solve": span}))
    assert found.attrs["promise"] == "kept"
    exact = run(COMBINATIONS["all"], **span, rtol=1e-7)
    settled = found.crank_angle > math.pi
    a, b = (one.acceleration.values[settled] for one in (found, exact))
    assert np.linalg.norm(a - b) / np.linalg.norm(b) < 5e-3


def test_a_narrow_guide_bears_what_an_ideal_one_does():
    """With play of a micrometre the crosshead rings on its guide; over 18 degrees it does not."""
    signals = {"output": {"signals": True}}
    ideal = run(signals, rtol=1e-7, duration_rev=1)
    narrow = {"clearance_mm": 0.001, "friction": 0}
    narrow = run({**signals, "guide": narrow}, rtol=1e-7, duration_rev=1)
    a, b = (one.guide_force.values[1:].reshape(20, 60).mean(axis=1) for one in (ideal, narrow))
    assert np.linalg.norm(a - b) / np.linalg.norm(a) < 0.02
    assert float(abs(narrow.guide_height).max()) < 30e-6


def test_bristles_start_without_a_jump():
    """Concentric circles had no slip, and a moment later 0.6 m/s: at 1e-12 no step was accepted."""
    case = Case.from_values({
        "joint": "big_end", "clearance_mm": 0.2, "friction": {"law": "lugre"},
        "solve": {"duration_rev": 0.02, "settle_rev": 0},
    })  # fmt: skip
    assert run_at_tolerance(case, 1e-12, 60.0, False).reason == ""


def test_without_viscosity_the_joint_is_dry():
    """The limit of no film, as the viscosity goes to zero."""
    dry = run({"joint": "small_end", "clearance_mm": 0.05}, rtol=1e-8)
    far = []
    for viscosity in (1e-3, 1e-4):
        oil = {"lubricant": {"viscosity_mPa_s": viscosity}}
        far.append(apart(dry, run({"joint": "small_end", "clearance_mm": 0.05, **oil}, rtol=1e-8)))
    assert far[0] / far[1] == pytest.approx(10.0, rel=0.3)
    assert far[1] < 5e-3


# ---- numbers against balances, closed forms and limits


def simulated(**values):
    values.setdefault("solve", {"duration_rev": 1, "settle_rev": 0.5})
    return simulate(Case.resolve(values))


@pytest.mark.parametrize(
    "case",
    [
        {"joint": "small_end", "clearance_mm": 0.2},
        {"joint": "both", "clearance_mm": 0.2},
        {"joint": "big_end", "clearance_mm": 0.2},
        RUBBING,
        {"joint": "small_end", "clearance_mm": 0.2, "guide": {"clearance_mm": 0.05}},
        {"joint": "small_end", "clearance_mm": 0.2, "lubricant": True},
    ],
)
def test_over_a_revolution_the_crank_s_torque_leaves_by_the_guide(case):
    """Without friction's couple on the crosshead pin, 42.645 for 44.579 N m in the first case."""
    solve = {"duration_rev": 6, "settle_rev": 5}
    found = simulated(**case, load="gas", solve=solve, output={"signals": True})
    torque, moment = (found[f"mean_{name}"] for name in ("crank_torque", "guide_moment"))
    bars = found["mean_crank_torque_error"] + found["mean_guide_moment_error"]
    assert abs(torque - moment) <= bars + 1e-4 * abs(torque)
    # stored samples alias the couple of friction, which lasts shorter than their step
    last = found["guide_moment"].values[-1200:]
    assert last.mean() == pytest.approx(moment.item(), rel=0.03)


def test_the_torque_on_the_crank_is_not_the_motor_s():
    found = simulated(drive={"flywheel_kg_m2": 2}, output={"signals": True})
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
    alone = simulated(rod=rod)
    assert alone["contact_damping_loss"] == 0.0
    assert alone["rod_damping_loss"] == pytest.approx(0.0440, abs=1e-4)
    worn = simulated(rod=rod, joint="both", clearance_mm=0.1)
    assert worn["contact_damping_loss"] > 0.0
    assert worn["rod_damping_loss"] > 0.0
    assert simulated(joint="both", clearance_mm=0.1)["rod_damping_loss"] == 0.0


def test_a_drive_s_times_are_those_that_pass():
    drive = {"flywheel_kg_m2": 0.5, "slope_N_m_s": 0, "torque_N_m": 20}
    found = simulated(load="gas", drive=drive, solve={"duration_rev": 8, "settle_rev": 1})
    assert found["reason"] == "crank_stalled"
    time, angle = found["time"].values, found["crank_angle"].values
    assert 0.0 <= found.attrs["stop_time"] - np.nanmax(time) < 0.05
    assert np.array_equal(np.isnan(time), np.isnan(angle))
    begin = np.interp(2.0 * np.pi, angle[~np.isnan(angle)], time[~np.isnan(time)])
    assert found.attrs["settle"] == pytest.approx(begin, rel=1e-12)


def test_shares_and_means_of_a_drive_are_of_the_time():
    """By the samples of a machine that slows by a third within each revolution."""
    values = {"drive": {"flywheel_kg_m2": 0.5, "slope_N_m_s": 20}, "load": "gas"}
    found = simulated(
        **values,
        joint="both",
        clearance_mm=0.2,
        solve={"duration_rev": 1, "settle_rev": 0.5, "output_step_deg": 0.05},
    )
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
    found = simulated(drive={"flywheel_kg_m2": 1}, solve={"duration_rev": 3, "settle_rev": 1})
    assert found["rms_acceleration_deviation"] < 1e-10


@pytest.mark.parametrize("slope", [1e6, 1e7, 1e9])
def test_a_steep_motor_keeps_its_digits(slope):
    """T + s (omega_0 - omega) had none left: energy_audit_failed from 1e6 on."""
    found = simulated(drive={"slope_N_m_s": slope}, solve={"duration_rev": 2, "settle_rev": 1})
    assert found["status"] == "ok"
    steady = simulated(solve={"duration_rev": 2, "settle_rev": 1})
    assert found["peak_acceleration"] == pytest.approx(steady["peak_acceleration"].item(), rel=2e-3)


def test_lugre_without_coefficients_is_no_friction():
    none = simulated(joint="big_end", clearance_mm=0.2, friction=False)
    zero = {"law": "lugre", "static": 0, "dynamic": 0}
    found = simulated(joint="big_end", clearance_mm=0.2, friction=zero)
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
    found = simulated(**values, solve=solve)
    assert (found["reason"], found["status"]) == (reason, "failed")
    assert words in found.attrs["detail"]


def test_pins_of_two_radii_are_each_joint_s_own():
    """As with one radius at the joint that has clearance; both matter where both have."""
    contact = {"materials": ["steel", "copper"], "geometry": "internal"}
    pins = {"big_end": 60, "small_end": 35}
    quick = {"duration_rev": 0.5, "settle_rev": 0, "error_bars": False}

    def found(joint, radius):
        values = {"joint": joint, "clearance_mm": 0.2, "contact": contact, "solve": quick}
        return simulated(**values, machine={"pin_radius_mm": radius})["peak_contact_force"]

    both = found("both", pins)
    for joint, own in pins.items():
        assert found(joint, pins).equals(found(joint, own))
        assert (both != found("both", own)).all()

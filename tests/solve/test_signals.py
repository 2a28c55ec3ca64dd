"""Forces on the frame: Newton's law of all moving parts, closed forms, energy, and the store."""

import json

import numpy as np
import pytest
from conftest import keep

from compressor.cases.case import Case
from compressor.cases.load import load_studies
from compressor.metrics import NUMBERS, SERIES
from compressor.solve.series import SIGNALS
from compressor.solve.simulate import measure, simulate
from compressor.store.demands import serving_both
from compressor.store.reader import open_study, read_store
from compressor.sweep.sweep import sweep

FINE = {"duration_rev": 0.3, "settle_rev": 0, "output_step_deg": 0.01, "error_bars": False,
        "accuracy": "reference"}  # fmt: skip
TURN = {"duration_rev": 2, "settle_rev": 1, "output_step_deg": 0.3}
SIGNALLED = {"output": {"signals": True}}


def run(**values):
    return simulate(Case.from_values({**SIGNALLED, **values}))


def slope(values, step):
    """First derivative by central differences of fourth order, without two samples at each end."""
    ahead, behind = values[3:-1] - values[1:-3], values[4:] - values[:-4]
    return (8.0 * ahead - behind) / (12.0 * step)


def rod_centre(found, machine):
    """The rod's mass centre from where its ends are: journals less their eccentricities, (m, 2)."""
    angle = found["crank_angle"].values
    radius, length = machine.crank_radius_mm / 1e3, machine.rod_length_mm / 1e3
    pin = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    phi = found["rod_angle"].values
    big = pin - found["eccentricity"].sel(joint="big_end").values
    share = machine.rod_centre_mm / 1e3
    along = np.stack([np.cos(phi), -np.sin(phi)], axis=1)
    small = big + length * along
    crosshead = np.stack([found["displacement"].values, np.zeros(angle.size)], axis=1)
    gap = crosshead - small - found["eccentricity"].sel(joint="small_end").values
    gap_other = small - crosshead - found["eccentricity"].sel(joint="small_end").values
    assert min(np.abs(gap).max(), np.abs(gap_other).max()) < 1e-9
    return big + share * along


@pytest.mark.parametrize("joint", ["none", "big_end", "small_end", "both"])
@pytest.mark.parametrize(("gravity", "counterweight"), [(0.0, 0.0), (9.81, 0.0), (9.81, 900.0)])
def test_the_frame_takes_the_momentum_that_the_parts_lose(joint, gravity, counterweight):
    clearance = {} if joint == "none" else {"clearance_mm": 0.2}
    machine = {"gravity_m_per_s2": gravity, "counterweight_kg_mm": counterweight}
    found = run(joint=joint, **clearance, machine=machine, solve=FINE)
    case = Case.from_attribute(found.attrs["case"])
    machine = case.machine
    times = found["time"].values
    step = times[1] - times[0]
    speed = slope(rod_centre(found, machine), step)
    momentum = machine.rod_mass_kg * speed
    momentum[:, 0] += machine.reciprocating_mass_kg * found["velocity"].values[2:-2]
    angle = found["crank_angle"].values[2:-2]
    turning = 1e-3 * counterweight * case.omega * np.stack([np.sin(angle), -np.cos(angle)], axis=1)
    expected = -slope(momentum + turning, step)
    expected[:, 1] -= (machine.rod_mass_kg + machine.reciprocating_mass_kg) * gravity
    shaking = found["shaking_force"].values[4:-4]
    # the force's slope has corners, where contact begins, at which differences do not hold
    for axis in range(2):
        away = np.abs(shaking[:, axis] - expected[:, axis])
        size = np.abs(shaking[:, axis]).max()
        assert np.quantile(away, 0.9) < 1e-6 * size


@pytest.mark.parametrize("joint", ["none", "big_end", "both"])
def test_the_torque_does_the_crank_s_work(joint):
    """The mean torque times the angle is what the energy ledger has, by Simpson's rule."""
    clearance = {} if joint == "none" else {"clearance_mm": 0.2}
    solve = {"duration_rev": 1, "settle_rev": 0, "output_step_deg": 0.02, "error_bars": False}
    found = run(joint=joint, **clearance, solve={**solve, "accuracy": "reference"})
    torque, angle = found["crank_torque"].values, found["crank_angle"].values
    step = angle[1] - angle[0]
    work = step / 3 * (torque[0] + 4 * torque[1:-1:2].sum() + 2 * torque[2:-1:2].sum() + torque[-1])
    assert work == pytest.approx(float(found["crank_work"]), rel=1e-5)


def test_the_torque_is_that_of_the_pin_and_its_friction():
    """R (cos F_y - sin F_x), less what friction takes at the journal's rim."""
    found = run(joint="big_end", clearance_mm=0.2, friction=False, solve=TURN)
    machine = Case.from_attribute(found.attrs["case"]).machine
    angle = found["crank_angle"].values
    force = found["contact_force"].sel(joint="big_end").values
    lever = machine.crank_radius_mm / 1e3
    expected = lever * (np.cos(angle) * force[:, 1] - np.sin(angle) * force[:, 0])
    np.testing.assert_allclose(found["crank_torque"].values, expected, atol=1e-6)
    rubbed = run(joint="big_end", clearance_mm=0.2, solve=TURN)
    force = rubbed["contact_force"].sel(joint="big_end").values
    alone = lever * (np.cos(angle) * force[:, 1] - np.sin(angle) * force[:, 0])
    rest = rubbed["crank_torque"].values - alone
    most = 0.3 * np.abs(force).max() * machine.pin_radius_mm.big_end / 1e3
    assert 0 < np.abs(rest).max() < most


def test_a_mirrored_machine_shakes_the_same_way():
    """Forces by sign: what the bearing and the guide take is all that is vertical."""
    found = run(joint="both", clearance_mm=0.2, machine={"gravity_m_per_s2": 9.81}, solve=TURN)
    up = found["bearing_force"].sel(axis="y") + found["guide_force"]
    np.testing.assert_allclose(found["shaking_force"].sel(axis="y"), up, rtol=1e-12, atol=1e-9)
    along = found["bearing_force"].sel(axis="x") + found["piston_force"]
    np.testing.assert_allclose(found["shaking_force"].sel(axis="x"), along, rtol=1e-12, atol=1e-9)
    couple = found["guide_moment"] - found["guide_force"] * found["displacement"]
    contact = found.sel(joint="small_end")
    (fx, fy), (ex, ey) = contact["contact_force"].values.T, contact["eccentricity"].values.T
    friction = (ey * fx - ex * fy) / np.maximum(np.hypot(ex, ey), 1e-30)
    arm = 0.01 - contact["penetration"]
    np.testing.assert_allclose(couple[1:], (arm * friction)[1:], rtol=0, atol=1e-6)
    assert np.abs(couple).max() > 1.0
    np.testing.assert_array_equal(
        found["rod_load"], found["contact_force"].sel(joint="small_end", axis="x")
    )


def test_signals_are_absent_unless_asked_for_and_change_nothing():
    values = {"joint": "big_end", "clearance_mm": 0.2, "solve": TURN}
    plain, more = simulate(Case.from_values(values)), run(**values)
    assert not SIGNALS.keys() & {*plain.variables}
    numbers = {name for name, row in NUMBERS.items() if row.when == "signals"}
    assert {*more.variables} - {*plain.variables} == {*SIGNALS} | numbers
    assert plain.attrs["key"] == more.attrs["key"]
    for name in plain.variables:
        if name != "seconds":
            np.testing.assert_array_equal(plain[name], more[name])
    for name, (dims, unit, _) in SIGNALS.items():
        assert more[name].dims == ("time", *dims)
        assert more[name].attrs["units"] == unit


BODY = {"body": True, "sensor": {"noise_m_per_s2": 0.05}}


@pytest.mark.parametrize("values", [{"joint": "big_end", "clearance_mm": 0.2}, {"joint": "none"}])
def test_metrics_of_signals_body_and_sensor_need_no_time_series(values):
    values = {**values, **BODY, "solve": {"duration_rev": 2, "accuracy": "draft"}}
    whole = simulate(Case.from_values({**values, "output": {"signals": True}}))
    alone = simulate(Case.from_values({**values, "output": {"signals": True, "keep": "metrics"}}))
    assert "time" not in alone.dims
    assert "sensor_acceleration" not in alone
    kinds = {"signals", "body", "sensor"}
    of_samples = {name for name, row in NUMBERS.items() if row.when in kinds}
    assert of_samples & {*alone.variables} == of_samples & {*whole.variables}
    assert {"peak_rod_load_tension", "sensor_rms", "body_velocity_rms"} <= {*alone.variables}
    for name in {*NUMBERS} & {*whole.variables} - {"seconds"}:
        np.testing.assert_array_equal(alone[name], whole[name], err_msg=name)


def test_a_sweep_of_metrics_keeps_no_series_of_body_and_signals(tmp_path, monkeypatch, in_process):
    monkeypatch.chdir(tmp_path)
    brief = {"duration_rev": 2, "accuracy": "draft"}
    values = {"joint": "none", "machine": {"speed_rpm": [490, 500]}, **BODY, "solve": brief}

    def counted(**output):
        (tmp_path / "s.yaml").write_text(json.dumps({**values, "output": output}))
        return sweep(load_studies(tmp_path / "s.yaml"), tmp_path / "results").run_now

    assert counted(keep="metrics") == 2
    assert not (tmp_path / "results/jobs").exists()
    study = open_study(tmp_path / "results")
    assert np.isfinite(study["sensor_rms"].values).all()
    assert "peak_rod_load_tension" not in study
    assert counted(keep="metrics", signals=True) == 2
    assert counted(keep="metrics", signals=True) == counted(keep="metrics") == 0
    assert np.isfinite(open_study(tmp_path / "results")["peak_rod_load_tension"].values).all()
    assert counted() == 2  # the series; signals stay
    assert counted(signals=True) == 0


def test_cases_that_share_a_job_keep_what_both_ask_for(tmp_path):
    one, other = (Case.from_values({"output": {"signals": asked}}) for asked in (False, True))
    assert one.key == other.key
    assert serving_both(one, other).output.signals
    keep(tmp_path, simulate(one))
    assert not read_store(tmp_path).status(one.key).satisfies(other)
    assert measure(other).attributes["signals"] == 1
    assert not SERIES.keys() & SIGNALS.keys()

"""Forces on the frame: sums, energy, and what is kept of them."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.metrics import NUMBERS
from compressor.solve.body import BODY as BODY_SERIES
from compressor.solve.series import SIGNALS
from compressor.solve.simulate import simulate

TURN = {"duration_rev": 2, "settle_rev": 1, "output_step_deg": 0.3}
SIGNALLED = {"output": {"signals": True}}


def run(**values):
    return simulate(Case.from_values({**SIGNALLED, **values}))


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


@pytest.mark.parametrize(
    ("asked", "series", "when", "is_same"),
    [(SIGNALLED, SIGNALS, "signals", True), ({"body": True}, BODY_SERIES, "body", False)],
)
def test_what_is_asked_for_besides_is_absent_else_and_changes_nothing(asked, series, when, is_same):
    values = {"joint": "big_end", "clearance_mm": 0.2, "solve": TURN}
    plain, more = (simulate(Case.from_values(values | one)) for one in ({}, asked))
    numbers = {name for name, row in NUMBERS.items() if row.when == when}
    assert {*more.variables} - {*plain.variables} == {*series} | numbers
    assert (plain.attrs["key"] == more.attrs["key"]) == is_same
    for name in plain.variables:
        if name != "seconds":
            np.testing.assert_array_equal(plain[name], more[name])
    for name, (dims, unit, _) in series.items():
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

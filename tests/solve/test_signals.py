"""Forces on the frame: sums, energy, what is kept of them, and a counterweight by hand."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.metrics import NUMBERS
from compressor.solve.body import BODY as BODY_SERIES
from compressor.solve.series import SIGNALS
from compressor.solve.si_record import record
from compressor.solve.simulate import simulate

TURN = {"duration_rev": 2, "settle_rev": 1, "output_step_deg": 0.3}
SIGNALLED = {"output": {"signals": True}}


def run(**values):
    return simulate(Case.from_values({**SIGNALLED, **values}))


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


# ---- a counterweight on the crank

WORN = {"joint": "big_end", "clearance_mm": 0.2}
OMEGA = 500 * math.pi / 30
ROTATING = 4.7 * 0.5 * 120.0  # kg mm: of a uniform rod half is at the crank pin


@pytest.mark.parametrize("weight", [100.0, ROTATING, 1962.0])
def test_order_1_falls_by_u_omega_squared_and_order_2_stays(weight):
    """By hand: X has 6152.1 N and 1086.7 N, Y what turns with the pin, 773.2 N, and no order 2."""
    found = run(machine={"counterweight_kg_mm": weight}, solve=TURN)
    force = found["shaking_force"].values[1200:2400]  # of the last revolution
    along, up = (2 / len(force) * np.fft.rfft(force, axis=0)).T
    taken, turning = 1e-3 * weight * OMEGA**2, 1e-3 * ROTATING * OMEGA**2
    assert turning == pytest.approx(773.2, abs=0.1)
    assert along[1].real == pytest.approx(6152.1 - taken, abs=0.5)
    assert abs(along[2]) == pytest.approx(1086.7, rel=1e-4)
    assert up[1].imag == pytest.approx(-(turning - taken), abs=1e-6 * turning)
    assert abs(up[2]) < 1e-9 * turning


def test_a_drive_s_unbalance_and_the_counterweight_are_one_number():
    def case(unbalance, weight):
        drive = {"flywheel_kg_m2": 2, "unbalance_kg_mm": unbalance}
        machine = {"gravity_m_per_s2": 9.81, "counterweight_kg_mm": weight}
        return Case.from_values(WORN | {"drive": drive, "machine": machine})

    assert record(case(800, 800)) == record(case(0, 0))
    assert record(case(300, 800))["unbalance"] == -0.5
    assert record(case(800, 300))["unbalance"] == 0.5


def test_a_share_of_the_masses_is_balanced():
    """By hand: 4.7 kg with the centre at 250 of 600 mm, 14 kg, and a crank of 120 mm."""
    share = {"rotating": 1.0, "reciprocating": 0.5}
    machine = {"rod_centre_mm": 250, "rod_inertia_kg_m2": 0.15, "balance": share}
    case = Case.from_values({"machine": machine})
    at_crosshead = 4.7 * 250 / 600
    expected = 120 * ((4.7 - at_crosshead) + 0.5 * (14 + at_crosshead))
    assert case.counterweight == pytest.approx(expected, rel=1e-14)
    assert record(case)["unbalance"] == pytest.approx(-1e-3 * expected, rel=1e-14)
    assert Case.from_values(case.values()) == case
    assert Case.from_attribute(case.attributes()["case"]).key == case.key
    turning = {"balance": {"rotating": 1, "reciprocating": 0}}  # the crank's own unbalance, too
    case = Case.from_values({"drive": {"unbalance_kg_mm": 700}, "machine": turning})
    assert case.counterweight == pytest.approx(700 + ROTATING, rel=1e-14)
    assert case.unbalance == pytest.approx(-ROTATING, rel=1e-14)

"""A counterweight on the crank: what it takes off the force on the frame, by hand, and no more."""

import math

import numpy as np
import pytest

from compressor.analysis.shaking import frame_forces
from compressor.cases.case import Case
from compressor.solve.si_record import record
from compressor.solve.simulate import simulate
from compressor.studies.tradeoff.explain import counterweight_words

TURN = {"duration_rev": 2, "settle_rev": 1, "output_step_deg": 0.3}
WORN = {"joint": "big_end", "clearance_mm": 0.2}
OMEGA = 500 * math.pi / 30
ROTATING = 4.7 * 0.5 * 120.0  # kg mm: of a uniform rod half is at the crank pin


def run(weight=None, **values):
    machine = values.pop("machine", {}) | ({"counterweight_kg_mm": weight} if weight else {})
    values = {"output": {"signals": True}, "solve": TURN, **values, "machine": machine}
    return simulate(Case.from_values(values))


def orders(found, axis, name="shaking_force"):
    """The lines of a signal over orders of the crank's speed, complex, of the last revolution."""
    force = found[name].sel(axis=axis).values[1200:2400]
    return 2 / force.size * np.fft.rfft(force)


@pytest.mark.parametrize("weight", [100.0, ROTATING, 1962.0])
def test_order_1_falls_by_u_omega_squared_and_order_2_stays(weight):
    """By hand: X has 6152.1 N and 1086.7 N, Y what turns with the pin, 773.2 N, and no order 2."""
    found, taken = run(weight), 1e-3 * weight * OMEGA**2
    turning = 1e-3 * ROTATING * OMEGA**2
    assert turning == pytest.approx(773.2, abs=0.1)
    along, up = orders(found, "x"), orders(found, "y")
    assert along[1].real == pytest.approx(6152.1 - taken, abs=0.5)
    assert abs(along[2]) == pytest.approx(1086.7, rel=1e-4)
    assert up[1].imag == pytest.approx(-(turning - taken), abs=1e-6 * turning)
    assert abs(up[2]) < 1e-9 * turning


def test_what_turns_with_the_pin_can_be_balanced_whole():
    found = run(ROTATING)
    assert np.abs(found["shaking_force"].sel(axis="y")).max() < 1e-6
    bearing, plain = (one["bearing_force"].sel(axis="y") for one in (found, run()))
    assert abs(2 / 1200 * np.fft.rfft(bearing.values[1200:2400])[1]) < abs(
        2 / 1200 * np.fft.rfft(plain.values[1200:2400])[1]
    )


def test_a_steady_crank_s_motion_stays_to_the_bit():
    plain, other = run(**WORN), run(900.0, **WORN)
    changed = {name for name in plain.variables if not plain[name].equals(other[name])}
    assert changed - {"seconds", "peak_shaking_force"} == {"shaking_force", "bearing_force"}
    angle = plain["crank_angle"].values
    crank = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for name in ("shaking_force", "bearing_force"):  # it pulls away from the pin
        away = (other[name] - plain[name]).values
        np.testing.assert_allclose(away, -0.9 * OMEGA**2 * crank, atol=1e-8)


def test_the_body_shakes_less():
    """Order 1 of its velocity falls as that of the force on it does."""
    plain, other = (run(weight, **WORN, body=True) for weight in (None, 1000.0))
    for axis in ("x", "y"):
        force, velocity = (
            abs(orders(other, axis, name)[1] / orders(plain, axis, name)[1])
            for name in ("shaking_force", "body_velocity")
        )
        assert velocity == pytest.approx(force, rel=1e-3)
    squares, lines = [], []
    for one in (plain, other):
        squares.append(float((one["body_velocity"].sel(axis="x")[1200:2400] ** 2).mean()))
        lines.append(abs(orders(one, "x", "body_velocity")[1]) ** 2 / 2)
    assert squares[1] < 0.7 * squares[0]  # 48 mm/s rms before, 39 behind
    assert squares[0] - squares[1] == pytest.approx(lines[0] - lines[1], rel=1e-6)


@pytest.mark.parametrize("features", [{}, {"guide": True}])
def test_series_give_the_forces_that_signals_store(features):
    stored = run(900.0, **WORN, **features, machine={"gravity_m_per_s2": 9.81})
    bare = stored.drop_vars([*frame_forces(stored)])
    for name, values in frame_forces(bare).items():
        size = np.abs(stored[name].values).max()
        np.testing.assert_allclose(values, stored[name].values, rtol=0, atol=1e-9 * size)


def test_a_drive_s_unbalance_and_the_counterweight_are_one_number():
    def case(unbalance, weight):
        drive = {"flywheel_kg_m2": 2, "unbalance_kg_mm": unbalance}
        machine = {"gravity_m_per_s2": 9.81, "counterweight_kg_mm": weight}
        return Case.from_values(WORN | {"drive": drive, "machine": machine})

    assert record(case(800, 800)) == record(case(0, 0))
    assert record(case(300, 800))["unbalance"] == -0.5
    assert record(case(800, 300))["unbalance"] == 0.5


def test_none_is_as_without_the_key():
    plain, none = (
        Case.from_values(WORN | {"machine": {"speed_rpm": 700, **more}})
        for more in ({}, {"counterweight_kg_mm": 0})
    )
    assert plain == none
    assert plain.key == none.key
    some = Case.from_values(WORN | {"machine": {"speed_rpm": 700, "counterweight_kg_mm": 9}})
    assert some.key != plain.key
    assert Case.from_values(some.values()) == some


def test_explain_says_what_it_comes_to():
    some = Case.from_values({"machine": {"counterweight_kg_mm": 1000}})
    assert counterweight_words(some) == "1000 kg mm opposite to the crank pin, 2742 N"

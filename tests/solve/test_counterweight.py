"""A counterweight on the crank: what it takes off the force on the frame, by hand, and no more."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case, with_ideal_joints
from compressor.cases.examples import templates
from compressor.cases.load import load_studies
from compressor.solve.si_record import record
from compressor.solve.simulate import simulate

TURN = {"duration_rev": 2, "settle_rev": 1, "output_step_deg": 0.3}
WORN = {"joint": "big_end", "clearance_mm": 0.2}
BALANCE = {"rotating": 1.0, "reciprocating": 0.5}
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
    machine = {"rod_centre_mm": 250, "rod_inertia_kg_m2": 0.15, "balance": BALANCE}
    case = Case.from_values({"machine": machine})
    at_crosshead = 4.7 * 250 / 600
    expected = 120 * ((4.7 - at_crosshead) + 0.5 * (14 + at_crosshead))
    assert case.counterweight == pytest.approx(expected, rel=1e-14)
    assert record(case)["unbalance"] == pytest.approx(-1e-3 * expected, rel=1e-14)
    assert Case.from_values(case.values()) == case
    assert Case.from_attribute(case.attributes()["case"]).key == case.key


def test_what_turns_with_the_pin_has_the_crank_s_own_unbalance():
    drive = {"unbalance_kg_mm": 700}
    case = Case.from_values(
        {"drive": drive, "machine": {"balance": {"rotating": 1, "reciprocating": 0}}}
    )
    assert case.counterweight == pytest.approx(700 + ROTATING, rel=1e-14)
    assert case.unbalance == pytest.approx(-ROTATING, rel=1e-14)


def test_orders_of_the_nameplate_machine_by_hand():
    """The example's, without clearance: 40 kg of rod, 2/3 of it at the pin, and 100 kg at 740 rpm.

    Order 1 of Y is exact. Order 2 of X has the first two terms of the series of the crosshead's
    acceleration by R / L; the third is a fortieth of the second.
    """
    (study,) = load_studies(templates()["machine"].path)
    values = with_ideal_joints(study.cases[0]).values()
    for group in ("body", "sensor"):
        values.pop(group, None)
    values |= {"solve": TURN, "output": {"signals": True}}
    found, square = simulate(Case.resolve(values)), (740 * math.pi / 30) ** 2
    along, up = orders(found, "x"), orders(found, "y")
    crosshead, ratio = 100 + 40 * 150 / 450, 90 / 450
    half = crosshead / 2  # which the counterweight balances, beside all of the pin
    assert up[1].imag == pytest.approx(0.09 * half * square, rel=1e-9)
    assert along[1].real == pytest.approx(0.09 * half * square, rel=1e-6)
    second = 0.09 * crosshead * (ratio + ratio**3 / 4 + 15 * ratio**5 / 128) * square
    assert along[2].real == pytest.approx(second, rel=1e-5)

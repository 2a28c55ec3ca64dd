"""A counterweight on the crank: what it takes off the force on the frame, by hand, and no more."""

import json
import math

import numpy as np
import pytest

from compressor.cases.case import Case, CaseError, with_ideal_joints
from compressor.cases.examples import example
from compressor.cases.load import load_studies
from compressor.solve.si_record import record
from compressor.solve.simulate import simulate
from compressor.store.reader import open_study
from compressor.studies.tradeoff.explain import counterweight_words
from compressor.sweep.sweep import sweep

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
    assert squares[1] < 0.7 * squares[0]
    assert squares[0] - squares[1] == pytest.approx(lines[0] - lines[1], rel=1e-6)


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
    shared = Case.from_values({"machine": {"balance": BALANCE}})
    assert counterweight_words(shared) == (
        "1263 kg mm opposite to the crank pin, 3463 N: 1 of what turns with the pin and 0.5 of "
        "what reciprocates"
    )


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


def test_one_number_is_the_share_of_both():
    one, two = (
        Case.from_values({"machine": {"balance": balance}})
        for balance in (0.5, {"rotating": 0.5, "reciprocating": 0.5})
    )
    assert one == two
    assert one.key == two.key
    assert one.counterweight == pytest.approx(0.5 * 120 * (14 + 4.7), rel=1e-14)


def test_what_turns_with_the_pin_has_the_crank_s_own_unbalance():
    drive = {"unbalance_kg_mm": 700}
    case = Case.from_values(
        {"drive": drive, "machine": {"balance": {"rotating": 1, "reciprocating": 0}}}
    )
    assert case.counterweight == pytest.approx(700 + ROTATING, rel=1e-14)
    assert case.unbalance == pytest.approx(-ROTATING, rel=1e-14)


@pytest.mark.parametrize(
    ("machine", "key", "words"),
    [
        ({"balance": {"rotating": 1}}, "machine.balance", "needs both, rotating and reciprocating"),
        ({"balance": 1, "counterweight_kg_mm": 9}, "machine.balance", "give one of the two"),
        ({"balance": 1.5}, "machine.balance", "outside"),
    ],
)
def test_what_is_wrong_with_a_balance_is_told(machine, key, words):
    with pytest.raises(CaseError) as error:
        Case.from_values({"machine": machine})
    assert any(one.key == key and words in one.message for one in error.value.problems)


def test_a_study_sweeps_counterweights_and_shares(tmp_path, monkeypatch, in_process):
    monkeypatch.chdir(tmp_path)
    brief = {"duration_rev": 0.25, "settle_rev": 0, "output_step_deg": 0.9, "accuracy": "draft"}
    machines = {
        "given": {"counterweight_kg_mm": [0, 500]},
        "shared": {"balance": {"rotating": 1.0, "reciprocating": [0.5, 1.0]}},
    }
    for name, machine in machines.items():
        values = {"machine": machine, "solve": brief, "output": {"signals": True}}
        (tmp_path / f"{name}.yaml").write_text(json.dumps(values))
        sweep(load_studies(tmp_path / f"{name}.yaml"), tmp_path / "results")
    given = open_study(tmp_path / "results", "given")
    assert given["counterweight_kg_mm"].values.tolist() == [0, 500]
    shared = open_study(tmp_path / "results", "shared")
    assert shared["balance_reciprocating"].values.tolist() == [0.5, 1.0]
    first = float(shared["bearing_force"].sel(axis="x").isel(time=0, balance_reciprocating=0))
    last = float(shared["bearing_force"].sel(axis="x").isel(time=0, balance_reciprocating=1))
    half = 1e-3 * 120 * 0.5 * (14 + 2.35)  # at top dead centre it pulls towards the crank
    assert last - first == pytest.approx(-half * OMEGA**2, rel=1e-9)


def test_orders_of_the_nameplate_machine_by_hand():
    """The example's, without clearance: 40 kg of rod, 2/3 of it at the pin, and 100 kg at 740 rpm.

    Order 1 of Y is exact. Order 2 of X has the first two terms of the series of the crosshead's
    acceleration by R / L; the third is a fortieth of the second.
    """
    (study,) = load_studies(example("machine"))
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

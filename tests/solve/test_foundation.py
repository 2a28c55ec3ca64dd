"""The body in a case: what a run stores of it, and how wrong it is to be driven one way."""

import json
import math

import numpy as np
import pytest
from conftest import keep
from scipy.integrate import solve_ivp

from compressor.analysis.shaking import healthy_body_velocity_rms
from compressor.cases.case import Case, CaseError
from compressor.cases.load import load_studies
from compressor.physics import COLUMNS, derivative_with_flows
from compressor.physics.systems import observe_at
from compressor.solve.body import BODY
from compressor.solve.si_record import record
from compressor.solve.simulate import measure, simulate
from compressor.store.reader import open_study, read_store
from compressor.studies.tradeoff.explain import body_words

TURN = {"duration_rev": 2, "settle_rev": 1, "output_step_deg": 0.3}
LOOSE = {"joint": "big_end", "clearance_mm": 0.2, "solve": TURN}
RECORDED = {"sensor_time", "sensor_acceleration", "tacho_time"}


def run(**values):
    return simulate(Case.from_values({**LOOSE, **values}))


def coupled(case, revolutions):
    """Velocities of a body coupled both ways, by SciPy on machine and body together, (m, 2).

    In the frame of the body the machine feels -m a on each of its parts. Contact forces follow
    from the state alone, so that nothing but the crosshead's weight is implicit.
    """
    p, body = record(case), case.body
    stiffness, damping = [
        np.array([what(2 * math.pi * getattr(body, f"frequency_{axis}_Hz")) for axis in "xy"])
        for what in (lambda w: w**2, lambda w: 2 * body.damping_ratio * w)
    ]
    row, rate = np.zeros(COLUMNS), np.zeros(12)
    masses = body.mass_kg + np.array([0.0, case.machine.reciprocating_mass_kg])

    def accelerations(t, z):
        observe_at(t, z[:8], 0, p, row)
        shaking = np.array([-row[9] + row[3], -row[10] - row[12]])
        return (shaking - body.mass_kg * (stiffness * z[8:10] + damping * z[10:])) / masses

    def slope(t, z):
        moved = accelerations(t, z)
        derivative_with_flows(t, np.append(z[:8], np.zeros(4)), 0, p, rate)
        felt = np.array([moved[0], moved[0], moved[1], 0.0])
        return np.concatenate([rate[:4], rate[4:8] - felt, z[10:], moved])

    times = np.linspace(0, revolutions * case.turn, 1201)
    start = np.zeros(12)
    found = solve_ivp(slope, (0, times[-1]), start, "LSODA", times, rtol=1e-4, atol=1e-7)
    return found.y[10:].T


@pytest.mark.slow
def test_a_body_coupled_both_ways_lies_within_the_stated_bound():
    """The bound is not idle, either: a tenth of it is reached."""
    solve = {"duration_rev": 2, "settle_rev": 0, "output_step_deg": 0.6}
    case = Case.from_values({
        "joint": "both", "clearance_mm": 0.1, "load": "none", "solve": solve,
        "body": {"mass_kg": 300.0, "frequency_x_Hz": 12.0, "frequency_y_Hz": 12.0, "start": "rest"},
    })  # fmt: skip
    found = simulate(case)
    other = coupled(case, 2)
    ours = found["body_velocity"].values
    apart = np.linalg.norm(ours - other, axis=0) / np.linalg.norm(other, axis=0)
    bound = found["one_way_error"].values
    assert (apart < bound).all()
    assert (apart > 0.1 * bound).all()
    assert (bound < 1.2).all()


def test_the_body_changes_nothing_of_the_machine():
    plain, more = run(), run(body=True)
    measured = {"body_velocity_rms", "body_velocity_rms_error"}
    assert {*more.variables} - {*plain.variables} == {*BODY, "one_way_error", *measured}
    for name in plain.variables:
        if name != "seconds":
            np.testing.assert_array_equal(plain[name], more[name])
    assert plain.attrs["key"] != more.attrs["key"]


def test_a_steady_body_follows_newton_s_law():
    """M a + c v + k x is the shaking force, on the settled part."""
    found = run(body=True, output={"signals": True})
    kept = slice(1200, None)
    for axis in ("x", "y"):
        one = {n: found[f"body_{n}"].sel(axis=axis).values[kept] for n in
               ("displacement", "velocity", "acceleration")}  # fmt: skip
        omega = 2 * math.pi * 60.0
        felt = one["acceleration"] + 2 * 0.03 * omega * one["velocity"]
        felt += omega**2 * one["displacement"]
        force = found["shaking_force"].sel(axis=axis).values[kept] / 500.0
        np.testing.assert_allclose(felt, force, rtol=0, atol=1e-9 * np.abs(force).max())
        assert one["displacement"][0] == pytest.approx(one["displacement"][-1], rel=1e-6)
    assert np.isnan(found["body_displacement"].values[:1200]).all()


def test_a_body_from_rest_is_there_from_the_start():
    found = run(
        body={"start": "rest"}, solve={**TURN, "settle_rev": "auto", "duration_rev": "auto"}
    )
    assert not found["body_displacement"].values[0].any()
    assert np.isfinite(found["body_displacement"].values).all()


@pytest.mark.parametrize("duration", ["auto", 6])
def test_a_steady_body_repeats_the_revolutions_that_auto_finds(duration):
    """What the same revolutions by number give, but for rounding of times."""
    more = {"body": True, "sensor": {"noise_m_per_s2": 0}}
    found = run(**more, solve={**TURN, "settle_rev": "auto", "duration_rev": duration})
    settled = float(found["settled_rev"])
    turns = round(float(found["time"][-1]) * 500 / 60)
    assert turns == (settled + 3 if duration == "auto" else duration)
    same = run(**more, solve={**TURN, "settle_rev": settled, "duration_rev": turns})
    for name in (*BODY, *RECORDED):
        size = np.nanmax(np.abs(same[name].values))
        np.testing.assert_allclose(found[name].values, same[name].values, rtol=0, atol=1e-8 * size)
    assert len(found["tacho_time"]) == turns - settled


def test_the_casing_s_mass_follows_the_body_s(tmp_path):
    """The default body's is what it was, so that keys of its jobs stay."""
    plain = Case.resolve({**LOOSE, "body": True})
    assert plain.body.casing_mass_kg == 20.0
    assert plain.key == Case.resolve({**LOOSE, "body": {"casing_mass_kg": 20}}).key
    (tmp_path / "s.yaml").write_text("body: {mass_kg: [500, 3500]}\n", encoding="utf-8")
    (study,) = load_studies(tmp_path / "s.yaml")
    assert [case.body.casing_mass_kg for case in study.cases] == [20.0, 140.0]
    given = Case.resolve({**LOOSE, "body": {"mass_kg": 3500, "casing_mass_kg": 20}})
    assert given.body.casing_mass_kg == 20.0


def test_a_finer_grid_says_the_same():
    """The body is sampled as finely as it needs, whatever is stored."""
    sensor = {"noise_m_per_s2": 0}
    coarse, fine = (
        run(body=True, sensor=sensor, solve={**TURN, "output_step_deg": step})
        for step in (0.6, 0.005)
    )
    one, other = coarse["sensor_acceleration"].values, fine["sensor_acceleration"].values
    assert one.size == other.size == 3072
    assert np.linalg.norm(one - other) < 0.01 * np.linalg.norm(other)


def test_a_sensor_hears_the_fault():
    """At the guide, healthy against a worn big end."""
    healthy = simulate(Case.from_values({"solve": TURN, "body": True, "sensor": True}))
    worn = run(body=True, sensor=True)
    assert {*RECORDED} <= {*worn.variables}
    levels = [float(one["sensor_acceleration"].std()) for one in (healthy, worn)]
    assert levels[1] > 5 * levels[0]


def test_a_sensor_hears_a_body_from_rest_over_the_whole_run():
    """Its record ends with that of the steady body, once the body's start is forgotten."""
    stiff = {"frequency_x_Hz": 200, "frequency_y_Hz": 200, "damping_ratio": 0.3}
    sensor = {"noise_m_per_s2": 0}
    rest = run(body={**stiff, "start": "rest"}, sensor=sensor)["sensor_acceleration"].values
    steady = run(body=stiff, sensor=sensor)["sensor_acceleration"].values
    assert rest.size == 2 * steady.size
    apart = rest[steady.size :] - steady
    assert np.linalg.norm(apart) < 0.05 * np.linalg.norm(steady)


def test_a_run_that_stops_has_a_body_of_nan():
    found = run(body=True, sensor=True, solve={**TURN, "max_steps": 50})
    assert np.isnan(found["body_displacement"].values).all()
    assert "sensor_acceleration" not in found


def test_bodies_and_sensors_are_stored_and_read(tmp_path):
    case = Case.from_values({**LOOSE, "body": True, "sensor": {"length_rev": 3, "seed": 4}})
    keep(tmp_path, simulate(case))
    stored = read_store(tmp_path).job(case.key)
    assert stored["sensor_acceleration"].dims == ("sensor_time",)
    assert stored["sensor_acceleration"].size == round(3 * 0.12 * 25600)
    assert stored["tacho_time"].size == 3
    assert Case.from_attribute(stored.attrs["case"]) == case
    assert measure(case).attributes["key"] == case.key


def test_a_study_of_bodies_opens(tmp_path, monkeypatch, in_process):
    from compsim import cli

    monkeypatch.chdir(tmp_path)
    text = {**LOOSE, "body": {"mass_kg": [500, 800]}, "sensor": {}}
    (tmp_path / "s.yaml").write_text(json.dumps(text))
    assert cli.main(["run", "s.yaml", "-j", "1"]) == 0
    study = open_study(tmp_path / "results")
    motion = study["body_displacement"].values[:, 1200:, 0]
    ratio = np.abs(motion[0]).max() / np.abs(motion[1]).max()
    assert ratio == pytest.approx(1.6, rel=0.01)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"sensor": True}, "sensor: nothing reads this group: it needs body;"),
        ({"body": {"mass_kg": 100}}, "moving parts have 19 % of the body's mass"),
        ({"body": {"frequency_x_Hz": 16.5}}, r"order 2 of the speed, 16\.7 Hz, is so near"),
        ({"body": True, "solve": {"duration_rev": 2.5}}, "whole settled revolutions"),
        (
            {"body": True, "solve": {"settle_rev": "auto", "duration_rev": 5.5}},
            "whole settled revolutions",
        ),
        (
            {"body": {"start": "rest"}, "sensor": {"length_rev": 3}},
            "it needs body.start == steady",
        ),
        (
            {"body": {"start": "rest"}, "sensor": {"speed_jitter": 0.01}},
            "it needs body.start == steady",
        ),
        ({"body": True, "sensor": {"low_pass_Hz": 20000}}, "less than half of rate_Hz"),
        ({"body": {"mass_kg": -1}}, r"body.mass_kg: -1 is outside"),
    ],
)
def test_what_a_body_needs_is_told(values, message):
    solve = TURN | values.get("solve", {})
    with pytest.raises(CaseError, match=message):
        Case.from_values({**LOOSE, **values, "solve": solve})


def test_the_default_foundation_holds_the_healthy_machine_by_hand():
    """Orders 1 and 2 of X, 6152.1 and 1086.7 N, and 1 of Y, 773.2 N, on 500 kg at 60 Hz."""
    case = Case.from_values({"body": True, "solve": TURN})

    def speed(order, force):
        w, natural = order * case.omega, 2 * math.pi * 60.0
        return force / 500.0 * w / abs(natural**2 - w**2 + 2j * 0.03 * natural * w)

    along = math.hypot(speed(1, 6152.1), speed(2, 1086.7)) / math.sqrt(2)
    expected = [along, speed(1, 773.2) / math.sqrt(2)]
    assert expected == pytest.approx([3.49e-3, 0.41e-3], rel=0.01)  # what pages say
    assert healthy_body_velocity_rms(case) == pytest.approx(expected, rel=1e-3)
    velocity = simulate(case)["body_velocity"].values[1200:2400]  # of the settled revolution
    assert np.sqrt((velocity**2).mean(axis=0)) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("keep", ["series", "metrics"])
def test_explain_says_how_fast_the_body_is_beside_the_healthy_one(keep):
    """Of a run without series it said that there was no whole settled revolution."""
    worn = run(body=True, output={"keep": keep})
    case = Case.from_values(LOOSE | {"body": True, "output": {"keep": keep}})
    words = body_words(case, worn)
    healthy = healthy_body_velocity_rms(Case.from_values({"body": True, "solve": TURN}))
    ours, theirs = (
        [f"{1e3 * one:.3g}" for one in rms] for rms in (worn["body_velocity_rms"].values, healthy)
    )
    assert words == (
        f"{ours[0]} and {ours[1]} mm/s rms along x and y, with ideal joints {theirs[0]} and "
        f"{theirs[1]}"
    )
    assert float(ours[0]) > float(theirs[0])

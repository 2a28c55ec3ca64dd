"""The body in a case: what a run stores of it."""

import math

import numpy as np
import pytest

from compressor.analysis.shaking import healthy_twin
from compressor.cases.case import Case
from compressor.solve.body import BODY
from compressor.solve.simulate import simulate

TURN = {"duration_rev": 2, "settle_rev": 1, "output_step_deg": 0.3}
LOOSE = {"joint": "big_end", "clearance_mm": 0.2, "solve": TURN}
RECORDED = {"sensor_time", "sensor_acceleration", "tacho_time"}


def run(**values):
    return simulate(Case.from_values({**LOOSE, **values}))


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


def test_a_run_that_stops_has_a_body_of_nan():
    found = run(body=True, sensor=True, solve={**TURN, "max_steps": 50})
    assert np.isnan(found["body_displacement"].values).all()
    assert "sensor_acceleration" not in found


def test_the_default_foundation_holds_the_healthy_machine_by_hand():
    """Orders 1 and 2 of X, 6152.1 and 1086.7 N, and 1 of Y, 773.2 N, on 500 kg at 60 Hz."""
    case = Case.from_values({"body": True, "solve": TURN})

    def speed(order, force):
        w, natural = order * case.omega, 2 * math.pi * 60.0
        return force / 500.0 * w / abs(natural**2 - w**2 + 2j * 0.03 * natural * w)

    along = math.hypot(speed(1, 6152.1), speed(2, 1086.7)) / math.sqrt(2)
    expected = [along, speed(1, 773.2) / math.sqrt(2)]
    assert expected == pytest.approx([3.49e-3, 0.41e-3], rel=0.01)  # what pages say
    run = simulate(case)
    assert healthy_twin(run)["body_velocity_rms"].values == pytest.approx(expected, rel=1e-3)
    velocity = run["body_velocity"].values[1200:2400]  # of the settled revolution
    assert np.sqrt((velocity**2).mean(axis=0)) == pytest.approx(expected, rel=1e-3)

"""Metrics of the body and of the sensor's record: plain NumPy of what is stored, and error bars."""

import math
import sys

import numpy as np
import pytest

from compressor.analysis.shaking import healthy_twin
from compressor.cases.case import Case
from compressor.metrics import of_source
from compressor.solve import body
from compressor.solve import run as run_module
from compressor.solve.series import finer
from compressor.solve.simulate import observe, simulate

TURNS = {"duration_rev": 3, "settle_rev": 1, "accuracy": "draft"}
BODY = {"body": {"frequency_x_Hz": 4.0, "frequency_y_Hz": 30.0}}
SENSED = {
    "joint": "big_end", "clearance_mm": 0.2, "solve": TURNS, **BODY,
    "sensor": {"threshold_m_per_s2": 10.0, "second_threshold_m_per_s2": 20.0},
}  # fmt: skip
OF_BODY = [row.name for row in of_source("body")]


@pytest.fixture(scope="module")
def sensed():
    return simulate(Case.from_values(SENSED))


def test_the_sensor_s_numbers_are_those_of_the_stored_record(sensed):
    """By plain NumPy: 500 rpm, two settled revolutions of 3072 samples from top dead centre."""
    record = sensed["sensor_acceleration"].values
    assert record.size == 2 * 3072
    assert sensed["tacho_time"].values[:2].tolist() == pytest.approx([0.0, 0.12], abs=1e-12)
    square = np.mean(record**2)
    assert float(sensed["sensor_peak"]) == np.abs(record).max()
    assert float(sensed["sensor_rms"]) == pytest.approx(math.sqrt(square), rel=1e-12)
    crest = np.abs(record).max() / math.sqrt(square)
    assert float(sensed["sensor_crest_factor"]) == pytest.approx(crest, rel=1e-12)
    central = record - record.mean()
    fourth = np.mean(central**4) / np.mean(central**2) ** 2
    assert float(sensed["sensor_kurtosis"]) == pytest.approx(fourth, rel=1e-12)
    degrees = sensed["sensor_time"].values * 500 * 6 % 360
    for begin, peak, rms in zip(
        sensed["segment"].values, sensed["sensor_segment_peak"].values,
        sensed["sensor_segment_rms"].values, strict=True,
    ):  # fmt: skip
        mine = record[(degrees >= begin - 1e-6) & (degrees < begin + 10 - 1e-6)]
        assert peak == np.abs(mine).max()
        assert rms == pytest.approx(np.sqrt(np.mean(mine**2)), rel=1e-12)
    for name, threshold in (("first", 10.0), ("second", 20.0)):
        over = (np.abs(record) > threshold).astype(int)
        falls = int((np.diff(over) == -1).sum())
        assert float(sensed["sensor_counts_per_rev"].sel(threshold=name)) == falls / 2 > 0
    assert float(sensed["sensor_segment_peak"].max()) == float(sensed["sensor_peak"])
    assert sensed["segment"].attrs["units"] == "deg"


def test_the_body_s_number_is_that_of_the_stored_velocity(sensed):
    """By the spectrum of the settled revolutions on the output grid, 10 kHz: lines 2 to 1000 Hz."""
    velocity = sensed["body_velocity"].values
    velocity = velocity[np.isfinite(velocity[:, 0])][:-1]
    lines = np.abs(np.fft.rfft(velocity, axis=0) / len(velocity)) ** 2 * 2
    frequency = np.arange(len(lines)) / 0.24
    inside = (frequency >= 2) & (frequency <= 1000)
    expected = np.sqrt(lines[inside].sum(axis=0))
    np.testing.assert_allclose(sensed["body_velocity_rms"].values, expected, rtol=1e-5)


def measured(values):
    return observe(Case.from_values(values))[0].numbers


@pytest.mark.parametrize("joint", ["big_end", "small_end"])
@pytest.mark.parametrize("place", [("guide", "y"), ("bearing", "x")])
def test_bars_hold_the_error(joint, place, monkeypatch):
    """Against a run at rtol 1e-9 whose forces are sampled three times as finely."""
    sensor = {"place": place[0], "direction": place[1], "threshold_m_per_s2": 15.0}
    values = {**SENSED, "joint": joint, "sensor": sensor}
    ours, real = measured(values), finer
    for module in (sys.modules["compressor.solve.simulate"], body, run_module):
        monkeypatch.setattr(module, "finer", lambda case: 3 * real(case))
    exact = measured({**values, "solve": {"duration_rev": 3, "settle_rev": 1, "rtol": 1e-9}})
    for name in OF_BODY:
        away, bar = np.abs(ours[name] - exact[name]), ours[f"{name}_error"]
        known = np.isfinite(ours[name])
        assert np.mean(away[known] <= bar[known]) >= 0.95, name  # as bars are meant, of segments
        if known.any() and "counts" not in name:  # and are short: longer in a silent segment
            assert np.median(bar[known] / np.abs(ours[name][known])) < 0.1, name
        assert known.any()


def test_a_bar_is_of_numerics_and_not_of_noise():
    """Ten times the noise: the bar of rms stays, though it is far less than what noise changes."""
    quiet, loud = (
        measured({**SENSED, "sensor": {"noise_m_per_s2": noise}}) for noise in (0.0, 2.0)
    )
    noise = math.sqrt(loud["sensor_rms"] ** 2 - quiet["sensor_rms"] ** 2)
    assert noise == pytest.approx(2.0, rel=0.1)
    assert loud["sensor_rms_error"] < 2 * quiet["sensor_rms_error"] < 0.2


@pytest.mark.parametrize("start", ["steady", "rest"])
def test_settled_revolutions_need_not_begin_at_top_dead_centre(start):
    """Segments are those of the crank; the tacho has its pulses at top dead centre."""
    body = {**BODY["body"], "start": start}
    sensor = {"noise_m_per_s2": 0}
    half, whole = (
        simulate(Case.from_values({
            **SENSED, "body": body, "sensor": sensor,
            "solve": {"duration_rev": settle + 2, "settle_rev": settle, "rtol": 1e-6},
        })) for settle in (2.5, 2)
    )  # fmt: skip
    if start == "steady":
        assert half["tacho_time"].values[0] == pytest.approx(0.06, abs=1e-9)
    for name in ("sensor_segment_rms", "sensor_segment_peak"):
        apart = np.abs(half[name].values - whole[name].values).max()
        assert apart < 0.05 * whole[name].values.max()


FINE = {"duration_rev": 2, "settle_rev": 1, "output_step_deg": 0.3}
LOOSE = {"joint": "big_end", "clearance_mm": 0.2, "solve": FINE}
RECORDED = {"sensor_time", "sensor_acceleration", "tacho_time"}


def run(**values):
    return simulate(Case.from_values({**LOOSE, **values}))


@pytest.mark.parametrize("duration", ["auto", 6])
def test_a_steady_body_repeats_the_revolutions_that_auto_finds(duration):
    """What the same revolutions by number give, but for rounding of times."""
    more = {"body": True, "sensor": {"noise_m_per_s2": 0}}
    found = run(**more, solve={**FINE, "settle_rev": "auto", "duration_rev": duration})
    settled = float(found["settled_rev"])
    turns = round(float(found["time"][-1]) * 500 / 60)
    assert turns == (settled + 3 if duration == "auto" else duration)
    same = run(**more, solve={**FINE, "settle_rev": settled, "duration_rev": turns})
    for name in (*body.BODY, *RECORDED):
        size = np.nanmax(np.abs(same[name].values))
        np.testing.assert_allclose(found[name].values, same[name].values, rtol=0, atol=1e-8 * size)
    assert len(found["tacho_time"]) == turns - settled


def test_a_run_that_stops_has_a_body_of_nan():
    found = run(body=True, sensor=True, solve={**FINE, "max_steps": 50})
    assert np.isnan(found["body_displacement"].values).all()
    assert "sensor_acceleration" not in found


def test_the_default_foundation_holds_the_healthy_machine_by_hand():
    """Orders 1 and 2 of X, 6152.1 and 1086.7 N, and 1 of Y, 773.2 N, on 500 kg at 60 Hz."""
    case = Case.from_values({"body": True, "solve": FINE})

    def speed(order, force):
        w, natural = order * case.omega, 2 * math.pi * 60.0
        return force / 500.0 * w / abs(natural**2 - w**2 + 2j * 0.03 * natural * w)

    along = math.hypot(speed(1, 6152.1), speed(2, 1086.7)) / math.sqrt(2)
    expected = [along, speed(1, 773.2) / math.sqrt(2)]
    assert expected == pytest.approx([3.49e-3, 0.41e-3], rel=0.01)  # what pages say
    run = simulate(case)
    assert healthy_twin(run)["body_velocity_rms"].values == pytest.approx(expected, rel=1e-3)
    assert np.isnan(run["body_displacement"].values[:1200]).all()
    velocity = run["body_velocity"].values[1200:2400]  # of the settled revolution
    assert np.sqrt((velocity**2).mean(axis=0)) == pytest.approx(expected, rel=1e-3)

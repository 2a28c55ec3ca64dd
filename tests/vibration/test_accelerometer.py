"""The sensor's chain, on forces whose record is known."""

import re

import numpy as np
import pytest

from compressor.cases.optional_groups import Body, Sensor
from compressor.cases.table import table
from compressor.vibration.accelerometer import analogue_rate, listen, paces
from compressor.vibration.body import Forces

TURN = 0.12
QUIET = {"noise_m_per_s2": 0.0, "rate_Hz": 5000.0, "mounting_Hz": 5000.0, "place": "body"}
BODY = Body(casing=False, centre_x_mm=0.0, centre_y_mm=0.0)


def shaken(order, height=5000.0, turns=1, body=BODY, **sensor):
    """A record of the body's y under one order of the speed; the sensor's gain is 1 well below."""
    sensor = Sensor(**{**QUIET, **sensor})
    count = round(turns * TURN * analogue_rate(body, sensor))
    angle = 2 * np.pi * turns * np.arange(count + 1) / count
    y = height * np.sin(order * angle)
    still = np.zeros_like(y)
    given = Forces(turns * TURN / count, np.stack([still, y], axis=1), still,
                   np.stack([still, y], axis=1), np.stack([still, still], axis=1))  # fmt: skip
    return listen(body, sensor, given, TURN, 0.6)


def amplitude(record, frequency):
    """Of a frequency in a record, by least squares."""
    phase = 2 * np.pi * frequency * record.times
    basis = np.stack([np.sin(phase), np.cos(phase)], axis=1)
    return np.linalg.norm(np.linalg.lstsq(basis, record.values, rcond=None)[0])


@pytest.mark.parametrize("order", [1, 4, 20])
def test_the_record_is_the_body_s_acceleration(order):
    """|H| = w^2 / |w0^2 - w^2 + 2 i zeta w w0| / M; mounting and filter add less than 1e-3."""
    record = shaken(order)
    w, w0 = 2 * np.pi * order / TURN, 2 * np.pi * 60.0
    expected = 5000 / 500 * w**2 / abs(w0**2 - w**2 + 2j * 0.03 * w * w0)
    resonance = 1 / (1 - (order / TURN / 5000.0) ** 2)
    assert amplitude(record, order / TURN) == pytest.approx(expected * resonance, rel=1e-5)


def test_the_mounting_resonance_amplifies_and_the_filter_cuts():
    """At half its resonance a sensor reads 4/3; beyond the corner next to nothing is left."""
    rate = {"rate_Hz": 20000.0, "low_pass_Hz": 8000.0, "mounting_Hz": 4000.0}
    order = 240  # 2 kHz
    plain = shaken(order, **{**rate, "mounting_Hz": 40000.0})
    raised = shaken(order, **rate)
    ratio = amplitude(raised, 2000.0) / amplitude(plain, 2000.0)
    assert ratio == pytest.approx(4 / 3 * (1 - 0.05**2), rel=2e-3)
    cut = shaken(1200, rate_Hz=20000.0, low_pass_Hz=2500.0, mounting_Hz=40000.0)
    whole = shaken(1200, rate_Hz=40000.0, low_pass_Hz=18000.0, mounting_Hz=40000.0)
    assert np.abs(cut.values).max() < 2e-5 * np.abs(whole.values).max()


@pytest.mark.parametrize("jitter", [0.0, 1e-9])
def test_what_repeats_itself_rings_from_the_first_revolution_on(jitter):
    """A casing mode and a mounting that would take a hundred revolutions to forget a start.

    |q''| of a mode under F sin(w t) is F / M w^2 / |w0^2 - w^2 + 2 i zeta w w0|, and the mounting
    enlarges it by w1^2 / |w1^2 - w^2 + 2 i zeta w w1|.
    """
    body = Body(mass_kg=1e7, casing_mass_kg=10.0, casing_frequency_Hz=400.0,
                casing_damping_ratio=1e-3, centre_x_mm=0.0, centre_y_mm=0.0)  # fmt: skip
    mounting = {"mounting_Hz": 900.0, "mounting_damping_ratio": 1e-3, "place": "guide"}
    record = shaken(45, 20.0, body=body, length_rev=5, speed_jitter=jitter, **mounting)
    w = 2 * np.pi * 45 / TURN
    expected = 2.0
    for frequency, scale in ((400.0, w**2), (900.0, (2 * np.pi * 900.0) ** 2)):
        w0 = 2 * np.pi * frequency
        expected *= scale / abs(w0**2 - w**2 + 2j * 1e-3 * w * w0)
    for turn in range(5):
        inside = (record.turns >= turn) & (record.turns < turn + 1)
        rms = np.sqrt(np.mean(record.values[inside] ** 2))
        assert rms == pytest.approx(expected / np.sqrt(2), rel=1e-3), turn


def test_noise_is_white_of_its_size_and_by_seed():
    noisy = {"noise_m_per_s2": 0.5, "length_rev": 60}
    record, again, other = (shaken(1, 0.0, seed=seed, **noisy) for seed in (7, 7, 8))
    assert record.values.std() == pytest.approx(0.5, rel=0.02)
    assert np.array_equal(record.values, again.values)
    assert not np.array_equal(record.values, other.values)
    assert abs(np.corrcoef(record.values[1:], record.values[:-1])[0, 1]) < 0.02


def test_what_is_beyond_the_range_is_clipped():
    loud = shaken(20, range_m_per_s2=5.0)
    assert np.abs(loud.values).max() == 5.0
    assert loud.clipped == pytest.approx(2 / np.pi * np.arccos(5.0 / 10.147), abs=0.01)
    assert shaken(20).clipped == 0.0


def test_the_tacho_gives_top_dead_centres():
    record = shaken(1, length_rev=5)
    np.testing.assert_allclose(record.tacho, TURN * np.arange(5), atol=1e-9)
    assert record.values.size == round(5 * TURN * 5000)
    late = shaken(1, length_rev=40, speed_jitter=0.01)
    assert 0.001 < np.diff(late.tacho).std() / TURN < 0.02


def test_synchronous_samples_take_the_jitter_out():
    """By the tacho's angle an order is a line again; by time it is not."""
    record = shaken(20, length_rev=40, speed_jitter=0.01, seed=3)
    pulses = np.append(record.tacho, record.tacho[-1] + np.diff(record.tacho).mean())
    turns = np.interp(record.times, pulses, np.arange(pulses.size))
    held = record.times < record.tacho[-1]
    basis = np.stack([np.sin(2 * np.pi * 20 * turns), np.cos(2 * np.pi * 20 * turns)], axis=1)[held]
    fit = np.linalg.norm(np.linalg.lstsq(basis, record.values[held], rcond=None)[0])
    assert fit > 0.9 * np.sqrt(2) * record.values[held].std()
    assert amplitude(record, 20 / TURN) < 0.5 * fit


def test_the_speed_s_deviation_has_the_rms_that_its_key_states():
    """The key was documented as the rms of speed; that is so at one point a revolution only."""
    sensor = Sensor(**QUIET, speed_jitter=0.01)
    times = np.linspace(0, 10_000 * TURN, 1_000_001)  # 100 a revolution
    course = paces(sensor, np.random.default_rng(1), times, TURN)
    rate = np.gradient(course, times) - 1.0
    of_turns = np.diff(course[::100]) / TURN - 1.0
    stated = re.findall(r"([\d.]+) of it", table()["sensor.speed_jitter"].phrase)
    assert rate[::100].std() == pytest.approx(0.01, rel=0.02)
    measured = [rate.std() / 0.01, of_turns.std() / 0.01]
    assert measured == pytest.approx([*map(float, stated)], rel=0.02)
    assert abs(course[-1] / times[-1] - 1) < 0.002

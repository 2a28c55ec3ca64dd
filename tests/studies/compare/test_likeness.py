"""How alike two records are: against sines, shifts and noise whose numbers are known."""

import math

import numpy as np
import pytest

from compressor.studies.compare.likeness import (
    SMALLEST,
    compare_lines,
    curves,
    spectral_distance,
    third_octaves,
)
from compressor.studies.frame import by_revolutions
from compressor.vibration import RecordError
from compressor.vibration.accelerometer import Record

RATE, TURN, WHOLE = 8000.0, 0.1003, 6
FIRST = 0.01237  # s, of the first pulse: between two samples
TIMES = np.arange(round((WHOLE + 0.5) * TURN * RATE)) / RATE
TACHO = FIRST + TURN * np.arange(WHOLE + 1)
ORDERS = 300


def record(*waves, noise=0.0, seed=1):
    """A record of sines: order, amplitude, and by how many degrees each comes later."""
    turns = (TIMES - FIRST) / TURN
    values = sum(a * np.sin(2 * np.pi * k * (turns - late / 360)) for k, a, late in waves)
    values = values + np.random.default_rng(seed).normal(0.0, noise, TIMES.size)
    return by_revolutions(Record(TIMES, values, TACHO, math.nan))


def likeness(one, two, orders=ORDERS):
    lines = [turned.lines(orders) for turned in (one, two)]
    return compare_lines(*lines, *map(curves, lines))


def test_a_record_is_turned_to_top_dead_centre():
    """Whatever lies between a sample and the pulse: lines of sines are imaginary, of their rms."""
    turned = record((3, 2.0, 0.0), (40, 1.0, 0.0))
    assert (len(turned.values), turned.rate) == (WHOLE, pytest.approx(RATE))
    assert turned.rpm == pytest.approx(60 / TURN)
    assert turned.highest == int(RATE / 2.56 * TURN)
    lines = turned.lines(ORDERS)
    expected = np.zeros(ORDERS, complex)
    expected[[2, 39]] = -2j / math.sqrt(2), -1j / math.sqrt(2)
    np.testing.assert_allclose(lines, np.broadcast_to(expected, lines.shape), atol=2e-3)


def test_curves_are_those_of_the_sines():
    found = curves(record((3, 2.0, 0.0), (40, 1.0, 0.0)).lines(ORDERS))
    angle = np.radians(found.angle)
    whole = 2 * np.sin(3 * angle) + np.sin(40 * angle)
    np.testing.assert_allclose(found.mean, whole, atol=0.02)
    assert np.sum(found.spectrum**2) == pytest.approx((4 + 1) / 2, rel=1e-3)
    np.testing.assert_allclose(found.envelope, 1.0, atol=0.02)  # of order 40 alone
    for k in (0, 7, 35):
        inside = (found.angle >= 10 * k - 1e-9) & (found.angle < 10 * k + 10 - 1e-9)
        assert found.peak[k] == pytest.approx(np.abs(whole[inside]).max(), abs=0.02)
        assert found.rms[k] == pytest.approx(np.sqrt(np.mean(whole[inside] ** 2)), abs=0.02)


@pytest.mark.parametrize("degrees", [0.0, 7.0, -20.0])
def test_a_shift_and_a_size_are_found_apart(degrees):
    """A shifted sine correlates by the cosine of its phase; the ratio of rms is that of size."""
    waves = [(5, 1.0), (6, 0.5)]
    late = record(*((k, 3 * a, degrees) for k, a in waves))
    found = likeness(late, record(*((k, a, 0.0) for k, a in waves)))
    power = {k: a**2 for k, a in waves}
    cosine = sum(p * math.cos(math.radians(k * degrees)) for k, p in power.items())
    assert found.correlation.value == pytest.approx(cosine / sum(power.values()), abs=1e-3)
    assert found.rms_ratio.value == pytest.approx(3.0, rel=1e-3)
    assert found.spectral_distance.value == pytest.approx(0.0, abs=0.2)


def test_a_record_is_like_itself():
    one = record((5, 1.0, 0.0), (40, 1.0, 30.0), noise=0.3)
    found = likeness(one, one)
    assert found.correlation.value == pytest.approx(1.0)
    assert found.envelope.value == pytest.approx(1.0)
    assert found.rms_ratio.value == 1.0
    assert found.spectral_distance.value == 0.0


def test_the_envelope_hears_bursts_whatever_rings_in_them():
    """Two bursts at the same angles, of other orders: their waves have nothing in common."""
    turns = (TIMES - FIRST) / TURN
    burst = sum(np.exp(-(((turns - at) % 1.0 - 0.1) ** 2) / 0.001) for at in (0.2, 0.6))
    one, two = (
        by_revolutions(Record(TIMES, burst * np.sin(2 * np.pi * k * turns), TACHO, math.nan))
        for k in (80, 117)
    )
    found = likeness(one, two)
    assert abs(found.correlation.value) < 0.05
    assert found.envelope.value > 0.98


def test_noise_costs_the_correlation_what_it_should():
    """Of a mean of n revolutions: 1 / sqrt(1 + noise / signal / n) by their powers in the band."""
    clean, noisy = record((5, 1.0, 0.0)), record((5, 1.0, 0.0), noise=1.0)
    orders = 300
    in_band = 2 * orders / (RATE * TURN)  # share of the noise's power
    expected = 1 / math.sqrt(1 + in_band / 0.5 / WHOLE)
    found = likeness(noisy, clean, orders)
    assert found.correlation.value == pytest.approx(expected, abs=3 * found.correlation.error)
    assert 0.003 < found.correlation.error < 0.1


def test_errors_are_those_of_the_revolutions():
    """Of the rms, by error propagation: s(mean square) / (2 root) / the job's rms."""
    rng = np.random.default_rng(5)
    lines = np.zeros((9, ORDERS), complex)
    lines[:, 4] = 1.0 + 0.02 * rng.normal(size=9)
    job = np.zeros((2, ORDERS), complex)
    job[:, 4] = 2.0
    found = compare_lines(lines, job, curves(lines), curves(job)).rms_ratio
    squares = np.abs(lines[:, 4]) ** 2
    assert found.value == pytest.approx(math.sqrt(squares.mean()) / 2.0)
    by_hand = squares.std(ddof=1) / 3.0 / (2.0 * math.sqrt(squares.mean())) / 2.0
    assert found.error == pytest.approx(by_hand, rel=0.02)
    assert math.isnan(compare_lines(job, job, curves(job), curves(job)).rms_ratio.error)


def test_spectra_are_compared_by_third_octaves():
    assert third_octaves(16).tolist() == [0, 1, 2, 3, 4, 5, 5, 6, 7, 7, 7, 8, 8, 8, 9, 9]
    squares = np.zeros(16)
    squares[[0, 1]] = 1.0
    other = np.zeros(16)
    other[[0, 1]] = 3.0, 1.0  # shares 3/4 and 1/4 beside 1/2 and 1/2
    by_hand = math.sqrt(((10 * math.log10(1.5)) ** 2 + (10 * math.log10(0.5)) ** 2) / 2)
    assert spectral_distance(other, squares) == pytest.approx(by_hand)
    assert spectral_distance(squares, 100 * other) == pytest.approx(by_hand)
    assert spectral_distance(squares, squares) == 0.0
    apart = np.zeros(16)
    apart[7] = 1.0
    alone = np.zeros(16)
    alone[0] = 1.0
    assert spectral_distance(apart, alone) == pytest.approx(-10 * math.log10(SMALLEST))
    assert math.isnan(spectral_distance(alone, 0 * alone))


def test_a_record_that_tells_nothing_is_refused():
    with pytest.raises(RecordError, match="2 tacho pulses are too few"):
        by_revolutions(Record(TIMES, 0 * TIMES, TACHO[:2], math.nan))

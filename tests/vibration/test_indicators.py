"""Indicators: against closed forms of sines, squares, ramps, bursts and noise."""

import math

import numpy as np
import pytest

from compressor.vibration.spectra import RecordError, energy_angle, high_pass_orders, shape

M = 720


def rms(values):
    return shape(values)[0]


def crest_factor(values):
    return shape(values)[1]


def kurtosis(values):
    return shape(values)[2]


def gini(values):
    return shape(values)[3]


ANGLE = 2 * np.pi * np.arange(4 * M) / M  # four revolutions
SINE = 2.5 * np.sin(3 * ANGLE)
SQUARE = np.where(ANGLE % 2.0 < 1.0, 0.7, -0.7)
BALANCED = np.tile([0.7, -0.7], 100)
NOISE = np.random.default_rng(11).standard_normal(200_000)
SILENCE = np.zeros(100)


def test_rms():
    assert rms(SINE) == pytest.approx(2.5 / math.sqrt(2), rel=1e-12)
    assert rms(SINE + 4.0) == pytest.approx(math.hypot(4.0, 2.5 / math.sqrt(2)), rel=1e-12)
    assert rms(SILENCE) == 0.0


def test_crest_factor():
    assert crest_factor(SINE) == pytest.approx(math.sqrt(2), rel=1e-12)
    assert crest_factor(SQUARE) == pytest.approx(1.0, rel=1e-12)
    assert crest_factor(np.eye(1, 400)[0]) == pytest.approx(20.0, rel=1e-12)


def test_kurtosis():
    assert kurtosis(SINE) == pytest.approx(1.5, rel=1e-12)
    assert kurtosis(SINE + 9.0) == pytest.approx(1.5, rel=1e-9)
    assert kurtosis(BALANCED) == pytest.approx(1.0, rel=1e-12)
    assert kurtosis(NOISE) == pytest.approx(3.0, abs=0.06)  # sqrt(24 / m) = 0.011
    # a share p of ones has 1 / (p (1 - p)) - 3
    assert kurtosis(np.eye(1, 50)[0]) == pytest.approx(1 / (0.02 * 0.98) - 3, rel=1e-12)


@pytest.mark.parametrize("size", [1, 2, 7, 1000])
def test_gini(size):
    assert gini(np.full(size, 0.3)) == pytest.approx(0.0, abs=1e-12)
    assert gini(np.eye(1, size)[0]) == pytest.approx(1 - 1 / size, abs=1e-12)
    ramp = np.arange(1.0, size + 1)
    assert gini(ramp) == pytest.approx((size - 1) / (3 * size), abs=1e-12)
    assert gini(-5e3 * ramp[::-1]) == pytest.approx((size - 1) / (3 * size), abs=1e-12)


@pytest.mark.parametrize("share", [0.001, 0.5, 0.9, 1.0])
def test_energy_angle_of_a_burst(share):
    burst = np.zeros(4 * M)
    burst[100:190] = 3.0 * (-1.0) ** np.arange(90)
    burst[M + 20 : M + 50] = -3.0
    assert energy_angle(burst, share) == pytest.approx(share * 120 / (4 * M), rel=1e-9)
    assert energy_angle(SQUARE, share) == pytest.approx(share, rel=1e-9)


def test_energy_angle_of_a_sine():
    """The loudest parts, |x| <= u about the peaks, hold (2u + sin 2u) / pi in an angle 2u / pi."""
    half = 0.7
    share = (2 * half + math.sin(2 * half)) / math.pi
    assert energy_angle(SINE, share) == pytest.approx(2 * half / math.pi, abs=2e-3)


@pytest.mark.parametrize("find", [crest_factor, kurtosis, gini, energy_angle])
def test_silence_has_no_shape(find):
    assert math.isnan(find(SILENCE))


@pytest.mark.parametrize("scale", [1e-6, 1e6])
@pytest.mark.parametrize("find", [crest_factor, kurtosis, gini, energy_angle])
def test_shape_knows_no_unit(find, scale):
    values = NOISE[:500]
    assert find(scale * values) == pytest.approx(find(values), rel=1e-12)
    assert rms(scale * values) == pytest.approx(scale * rms(values), rel=1e-12)


def test_high_pass_removes_orders_up_to_and_with_one():
    low = 4.0 + np.cos(ANGLE) + 3.0 * np.sin(11.75 * ANGLE) + 2.0 * np.sin(12 * ANGLE + 1.0)
    high = 0.2 * np.sin(12.25 * ANGLE + 0.4) + 0.1 * np.cos(300 * ANGLE)
    assert high_pass_orders(low + high, M, 12) == pytest.approx(high, abs=1e-12)
    kept = high + 2.0 * np.sin(12 * ANGLE + 1.0)
    assert high_pass_orders(low + high, M, 11.9) == pytest.approx(kept, abs=1e-12)
    assert high_pass_orders(kept + 1.0, M, 0) == pytest.approx(kept, abs=1e-12)


def test_high_pass_counts_lines_exactly():
    """1/49 times 49 is a little less than 1."""
    angle = 2 * np.pi * np.arange(49 * 16) / 16
    for one in range(1, 300):
        line = np.cos(one / 49 * angle)
        assert np.max(np.abs(high_pass_orders(line, 16, one / 49))) < 1e-12
        assert np.max(np.abs(high_pass_orders(line, 16, (one - 1) / 49) - line)) < 1e-12


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: rms(np.array([])), "at least one sample"),
        (lambda: gini(np.array([1.0, np.inf])), "first at index 1"),
        (lambda: high_pass_orders(SINE, M, M / 2), "choose a lower order"),
        (lambda: high_pass_orders(SINE, M, -1), "choose a lower order"),
        (lambda: high_pass_orders(SINE, M, math.nan), "choose a lower order"),
    ],
)
def test_bad_input_is_told_with_a_remedy(call, told):
    with pytest.raises(RecordError, match=told):
        call()

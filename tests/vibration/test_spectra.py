"""Orders, amplitudes, indicators and envelopes: against closed forms and signals that are known."""

import math

import numpy as np
import pytest

from compressor.vibration.monitor import count_peaks, segment_levels
from compressor.vibration.spectra import (
    RecordError,
    band_signal,
    energy_angle,
    envelope_spectrum,
    high_pass_orders,
    line_amplitudes,
    resample_angle,
    shape,
)

BLOCK = 240
M = 720  # samples a revolution


def noise(size: int, seed: int = 5) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(size)


# ---- amplitudes of lines


@pytest.mark.parametrize("block", [BLOCK, BLOCK + 1])
def test_a_line_has_its_own_amplitude(block):
    count = np.arange(4 * block)
    values = 1.7 + 2.5 * np.sin(2 * np.pi * 30 * count / block + 0.4)
    peak = line_amplitudes(values, block, rms=False)
    rms = line_amplitudes(values, block, rms=True)
    assert peak.size == rms.size == block // 2 + 1
    assert peak[[0, 30]] == pytest.approx([1.7, 2.5], abs=1e-9)
    assert rms[[0, 30]] == pytest.approx([1.7, 2.5 / np.sqrt(2)], abs=1e-9)


# ---- orders of the crank speed


def even(turns: float, a_turn: int = M, begin: float = 0.0) -> np.ndarray:
    return begin + 2 * np.pi * np.arange(round(turns * a_turn)) / a_turn


@pytest.mark.parametrize(("extra", "turns"), [(-1, 2), (0, 3), (1, 3), (M - 1, 3), (M, 4)])
def test_only_whole_revolutions_are_kept(extra, turns):
    angle = 2 * np.pi * np.arange(3 * M + extra) / M
    assert resample_angle(angle, np.cos(angle), M).shape == (turns * M,)


def test_a_sine_is_restored_from_unequal_angles():
    """The spline errs by the fourth power of the interval.

    At equal times; the speed swings by 20 % twice a revolution, and runs up.
    """
    errors = []
    for samples in (4001, 8001):
        time = np.linspace(0.0, 1.0, samples)
        angle = 2 * np.pi * 10 * (0.8 * time + 0.2 * time**2)
        angle += 0.1 * np.sin(2 * angle)
        found = resample_angle(angle, np.sin(5 * angle), 600)
        error = np.abs(found - np.sin(5 * even(found.size / 600, 600)))
        errors.append(np.max(error[600:-600]))  # the ends are worse
    assert errors[0] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.25)


def test_squares_of_the_spectrum_add_up_to_the_mean_square():
    values = 5.0 + noise(8 * M)
    for turns in (8, 1, 4):  # blocks are averaged by mean square; 17 samples are of no whole one
        found = line_amplitudes(np.append(values, np.full(17, 99.0)), turns * M, rms=True)
        assert np.sum(found**2) == pytest.approx(np.mean(values**2), rel=1e-12)


# ---- indicators

ANGLE = 2 * np.pi * np.arange(4 * M) / M  # four revolutions
SINE = 2.5 * np.sin(3 * ANGLE)
SQUARE = np.where(ANGLE % 2.0 < 1.0, 0.7, -0.7)
RAMP = np.arange(1.0, 1001.0)
SILENCE = np.zeros(100)


def one_of(size):
    """A single 1 among zeros, and its shape."""
    share = 1.0 / size  # a share p of ones has the kurtosis 1 / (p (1 - p)) - 3
    expected = math.sqrt(share), math.sqrt(size), 1 / (share * (1 - share)) - 3, 1 - share
    return np.eye(1, size)[0], expected


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (SINE, (2.5 / math.sqrt(2), math.sqrt(2), 1.5, None)),
        (SINE + 4.0, (math.hypot(4.0, 2.5 / math.sqrt(2)), None, 1.5, None)),
        (SQUARE, (0.7, 1.0, None, 0.0)),
        (np.tile([0.7, -0.7], 100), (0.7, 1.0, 1.0, 0.0)),
        one_of(2),
        one_of(50),
        one_of(400),
        (np.array([0.3]), (0.3, 1.0, None, 0.0)),
        (RAMP, (None, None, None, 999 / 3000)),
        (-5e3 * RAMP[::-1], (None, None, None, 999 / 3000)),
    ],
)
def test_rms_crest_factor_kurtosis_and_gini_s_index(values, expected):
    for found, one in zip(shape(values), expected, strict=True):
        if one is not None:  # which has a closed form
            assert found == pytest.approx(one, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("share", [0.001, 0.5, 0.9, 1.0])
def test_energy_angle_of_a_burst(share):
    burst = np.zeros(4 * M)
    burst[100:190] = 3.0 * (-1.0) ** np.arange(90)
    burst[M + 20 : M + 50] = -3.0
    assert energy_angle(burst, share) == pytest.approx(share * 120 / (4 * M), rel=1e-9)
    assert energy_angle(1e-6 * SQUARE, share) == pytest.approx(share, rel=1e-9)


def test_silence_has_no_shape():
    assert shape(SILENCE)[0] == 0.0
    assert np.isnan([*shape(SILENCE)[1:], energy_angle(SILENCE)]).all()


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


# ---- envelopes


RATE = 10_000.0  # samples a second
TIME = np.arange(30_000) / RATE


def test_lines_of_the_envelope():
    slow = 40.0 * np.cos(2 * np.pi * 5 * TIME) + 7.0  # outside of the band
    swell = 1.6 * (1.0 + 0.5 * np.cos(2 * np.pi * 10 * TIME + 0.2))
    values = slow + swell * np.sin(2 * np.pi * 2000 * TIME)
    frequency, found = envelope_spectrum(values, RATE, (1500.0, 2500.0))
    for at, amplitude in {0: 1.6, 10: 0.8, 20: 0.0}.items():
        one = found[np.argmin(np.abs(frequency - at))]
        assert one == pytest.approx(amplitude, abs=1e-9)
    assert frequency[-1] == RATE / 2
    assert np.sum(found > 1e-9) == 2


# ---- what a monitoring system reads


@pytest.mark.parametrize(
    ("values", "count"),
    [
        ([0, 5, 0], 1),
        ([0, 5, 6, 4, 0], 1),  # one peak, however long it lasts
        ([0, 5, 3, 5, 0], 2),  # 3 is not above 3
        ([0, 5, -5, 0], 1),  # does not come back below in between
        ([0, 5, 0, -5, 0], 2),  # to either side
        ([5, 0, 0], 1),  # cut off by the begin
        ([0, 0, 5], 0),  # by the end
        ([3, 3, 3], 0),
    ],
)
def test_peaks_over_a_threshold(values, count):
    assert count_peaks(np.array(values, float), 3.0) == count


def test_a_band_holds_its_lines_alone():
    """rms of lines at 10, 50 and 200 Hz of 3, 4 and 12: that of those inside, ends included."""
    time = np.arange(4000) / 4000
    values = sum(a * np.sin(2 * math.pi * f * time + f) for f, a in ((10, 3), (50, 4), (200, 12)))
    bands = (2, 1000, 169), (10, 50, 25), (11, 199, 16), (60, 100, 0), (0, 49, 9)
    for low, high, square in bands:
        found = shape(band_signal(values + 100.0 * (low > 0), 4000.0, low, high))[0]
        assert found == pytest.approx(math.sqrt(square / 2), abs=1e-9)


def test_an_angle_at_a_begin_lies_in_the_segment_that_begins_there():
    turns = np.arange(72) * 10.0 / 360.0  # of which some are rounded down
    peak, _ = segment_levels(360.0 * turns, np.arange(72.0))
    np.testing.assert_array_equal(peak, np.arange(36.0) + 36.0)


# ---- what is refused


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: resample_angle(even(0.9), even(0.9), M), "pass at least one revolution"),
        (lambda: resample_angle(even(2), np.full(2 * M, np.nan), M), "index 0: cut these off"),
        (lambda: resample_angle(even(2), np.ones((2 * M, 2)), M), "pass one real component"),
        (lambda: resample_angle(even(2), 1j * even(2), M), "complex128"),
        (lambda: shape(np.array([])), "at least one sample"),
        (lambda: shape(np.array([1.0, np.inf])), "first at index 1"),
        (lambda: high_pass_orders(SINE, M, M / 2), "choose a lower order"),
        (lambda: high_pass_orders(SINE, M, -1), "choose a lower order"),
        (lambda: high_pass_orders(SINE, M, math.nan), "choose a lower order"),
        (lambda: envelope_spectrum(TIME, RATE, (20.1, 20.2)), "choose a wider band"),
        (lambda: envelope_spectrum(TIME, RATE, (6000.0, 7000.0)), "band below 5000, half the rate"),
    ],
)
def test_bad_input_is_told_with_a_remedy(call, told):
    with pytest.raises(RecordError, match=told):
        call()

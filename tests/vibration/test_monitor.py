"""What a monitoring system reads of a record: against closed forms and plain NumPy."""

import math

import numpy as np
import pytest

from compressor.vibration.monitor import count_peaks, segment_levels
from compressor.vibration.spectra import band_signal, shape


def test_of_a_sine():
    """Amplitude A: two peaks a turn, and levels of its segments in closed form."""
    turns = np.arange(36000) / 3600
    wave = 7.0 * np.sin(2 * math.pi * turns)
    assert count_peaks(wave, 3.5) == 20
    assert count_peaks(wave, 7.1) == 0
    peak, root = segment_levels(360.0 * turns, wave)
    edges = np.radians(np.arange(37) * 10.0)
    square = 24.5 * (1 - np.diff(np.sin(2 * edges)) / (2 * np.diff(edges)))  # mean over 10 degrees
    np.testing.assert_allclose(root, np.sqrt(square), atol=0.01)
    highest = [np.abs(7 * np.sin(np.radians(at + np.linspace(0, 10, 99)))).max() for at in
               range(0, 360, 10)]  # fmt: skip
    np.testing.assert_allclose(peak, highest, atol=0.02)


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
    for low, high, square in (
        (2, 1000, 169),
        (10, 50, 25),
        (11, 199, 16),
        (60, 100, 0),
        (0, 49, 9),
    ):
        found = shape(band_signal(values + 100.0 * (low > 0), 4000.0, low, high))[0]
        assert found == pytest.approx(math.sqrt(square / 2), abs=1e-9)


def test_levels_are_those_of_plain_numpy():
    rng = np.random.default_rng(2)
    angle, values = rng.uniform(-400, 1000, 20_000), rng.normal(size=20_000)
    peak, rms = segment_levels(angle, values)
    for k in range(36):
        inside = values[(angle % 360 >= 10 * k) & (angle % 360 < 10 * (k + 1))]
        assert peak[k] == np.abs(inside).max()
        assert rms[k] == pytest.approx(np.sqrt(np.mean(inside**2)), rel=1e-12)


def test_an_angle_at_a_begin_lies_in_the_segment_that_begins_there():
    turns = np.arange(72) * 10.0 / 360.0  # of which some are rounded down
    peak, _ = segment_levels(360.0 * turns, np.arange(72.0))
    np.testing.assert_array_equal(peak, np.arange(36.0) + 36.0)

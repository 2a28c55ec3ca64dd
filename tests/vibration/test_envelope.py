"""Envelopes and the kurtogram: against modulated carriers, noise and impulses that are known."""

import numpy as np
import pytest

from compressor.vibration.spectra import RecordError, envelope_spectrum, kurtogram

RATE, SIZE = 10_000.0, 30_000  # samples a second; 3 s
TIME = np.arange(SIZE) / RATE
BAND = (1500.0, 2500.0)


def modulated(amplitude: float = 1.6, depth: float = 0.5) -> np.ndarray:
    swell = 1.0 + depth * np.cos(2 * np.pi * 10 * TIME + 0.2)
    return amplitude * swell * np.sin(2 * np.pi * 2000 * TIME)


def rings(rate: float, size: int, carrier: float, every: float) -> np.ndarray:
    """Decaying sines of 1 at the begin, 2 ms long, `every` so many seconds."""
    since = (np.arange(size) / rate + 0.3 * every) % every
    return np.exp(-since / 2e-3) * np.sin(2 * np.pi * carrier * since)


def noise(size: int, seed: int = 5) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(size)


def test_lines_of_the_envelope():
    slow = 40.0 * np.cos(2 * np.pi * 5 * TIME) + 7.0  # outside of the band
    frequency, found = envelope_spectrum(modulated() + slow, RATE, BAND)
    for at, amplitude in {0: 1.6, 10: 0.8, 20: 0.0}.items():
        one = found[np.argmin(np.abs(frequency - at))]
        assert one == pytest.approx(amplitude, abs=1e-9)
    assert frequency[-1] == RATE / 2
    assert np.sum(found > 1e-9) == 2


def test_bands_divide_the_range():
    frequency, bandwidth, kurtosis = kurtogram(noise(2**12), 2000.0, 3)
    parts = [1, 2, 3, 4, 6, 8]
    assert frequency.size == kurtosis.size == sum(parts)
    for parts_here in parts:
        here = np.isclose(bandwidth, 1000.0 / parts_here)
        assert np.sum(here) == parts_here
        lower = frequency[here] - bandwidth[here] / 2
        assert lower == pytest.approx(np.arange(parts_here) * 1000.0 / parts_here)


def test_stationary_noise_has_none():
    """Scattered by 1.7 over the root of the lines in a band."""
    found = np.array([kurtogram(noise(2**12, seed), 1.0, 4)[2] for seed in range(100)])
    scatter = 1.7 / np.sqrt(2**12 * kurtogram(noise(2**12), 1.0, 4)[1])
    assert np.mean(found / scatter) == pytest.approx(0.0, abs=0.1)
    assert np.std(found / scatter) == pytest.approx(1.0, abs=0.1)


def test_neighbours_share_the_power_of_a_line_between_them():
    """Two lines a and b in a band have 2 a^2 b^2 / (a^2 + b^2)^2 - 1."""
    size = 2**14
    count = 2 * np.pi * np.arange(size)
    values = np.sin(0.1875 * count) + np.sqrt(2) * np.sin(0.25 * count)
    frequency, _, kurtosis = kurtogram(values, 1.0, 2)
    assert frequency[-4:] == pytest.approx([0.0625, 0.1875, 0.3125, 0.4375])
    assert kurtosis[-3] == pytest.approx(-0.5, abs=0.01)
    assert kurtosis[-2] == pytest.approx(-1.0, abs=1e-9)


def test_a_sine_has_minus_one_in_its_bands_and_the_rest_is_silent():
    frequency, bandwidth, kurtosis = kurtogram(np.sin(2 * np.pi * 0.3 * np.arange(10_000)), 1.0, 5)
    own = np.abs(frequency - 0.3) < bandwidth / 2
    assert kurtosis[own] == pytest.approx(-1.0, abs=1e-9)
    far = np.abs(frequency - 0.3) > bandwidth
    assert np.isnan(kurtosis[far]).all()


@pytest.mark.parametrize("carrier", [2300.0, 4700.0, 8100.0])
def test_the_best_band_holds_the_carrier_of_impulses_in_noise(carrier):
    rate, size = 20_480.0, 2**16
    values = 2.0 * rings(rate, size, carrier, 0.1) + 0.3 * noise(size)
    frequency, bandwidth, kurtosis = kurtogram(values, rate, 6)
    one = np.nanargmax(kurtosis)
    half = bandwidth[one] / 2
    low, high = frequency[one] - half, frequency[one] + half
    assert low - 200.0 < carrier < high + 200.0
    assert high - low < 4000.0
    assert kurtosis[one] > 20 / np.sqrt(2 * half / rate * size)
    frequency, spectrum = envelope_spectrum(values, rate, (low, high))
    near = (frequency > 2.0) & (frequency < 50.0)
    assert frequency[near][np.argmax(spectrum[near])] % 10.0 == pytest.approx(0.0, abs=0.4)


def test_a_jump_from_end_to_begin_is_no_impulse():
    size = 2**14
    slow = 100.0 * np.sin(2 * np.pi * 3.25 * np.arange(size) / size)
    frequency, bandwidth, kurtosis = kurtogram(slow + noise(size), 1.0, 5)
    high = frequency - bandwidth / 2 > 0.05
    assert np.max(np.abs(kurtosis[high]) * np.sqrt(bandwidth[high] * size)) < 10.0


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: envelope_spectrum(TIME, RATE, (20.1, 20.2)), "choose a wider band"),
        (lambda: envelope_spectrum(TIME, RATE, (6000.0, 7000.0)), "band below 5000, half the rate"),
        (lambda: kurtogram(TIME, RATE, 8), "32768 samples, and there are 30000: choose fewer"),
        (lambda: kurtogram(np.full(SIZE, 0.1), RATE, 3), "constant"),
    ],
)
def test_bad_input_is_told_with_a_remedy(call, told):
    with pytest.raises(RecordError, match=told):
        call()

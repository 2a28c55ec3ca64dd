"""Windows and single-sided amplitudes: against closed forms."""

import numpy as np
import pytest

from compressor.vibration.spectra import WINDOWS, SignalError, line_amplitudes, noise_bandwidth

BLOCK = 240


@pytest.mark.parametrize(
    ("window", "lines", "within"),
    # flattop's from its five cosine terms: 1 + sum(a_k^2 / a_0^2) / 2
    [("rectangular", 1.0, 1e-12), ("hann", 1.5, 1e-12), ("flattop", 3.7702, 1e-4)],
)
def test_noise_bandwidths(window, lines, within):
    assert noise_bandwidth(window) == pytest.approx(lines, abs=within)


@pytest.mark.parametrize("block", [BLOCK, BLOCK + 1])
@pytest.mark.parametrize("window", WINDOWS)
def test_a_line_has_its_own_amplitude_with_any_window(window, block):
    count = np.arange(4 * block)
    values = 1.7 + 2.5 * np.sin(2 * np.pi * 30 * count / block + 0.4)
    peak = line_amplitudes(values, block, window, rms=False)
    rms = line_amplitudes(values, block, window, rms=True)
    assert peak.size == rms.size == block // 2 + 1
    assert peak[[0, 30]] == pytest.approx([1.7, 2.5], abs=1e-9)
    assert rms[[0, 30]] == pytest.approx([1.7, 2.5 / np.sqrt(2)], abs=1e-9)


def test_the_highest_line_of_an_even_block_is_not_doubled():
    values = 0.3 * (-1.0) ** np.arange(BLOCK)
    for rms in (False, True):
        assert line_amplitudes(values, BLOCK, "rectangular", rms)[-1] == pytest.approx(0.3)


def test_flattop_reads_a_line_between_two_lines():
    """Its scalloping loss is 0.01 dB, of the rectangular window 3.92 dB (Harris)."""
    values = np.sin(2 * np.pi * 30.5 * np.arange(BLOCK) / BLOCK)
    flat = line_amplitudes(values, BLOCK, "flattop", rms=False).max()
    sharp = line_amplitudes(values, BLOCK, "rectangular", rms=False).max()
    assert 20 * np.log10(flat) == pytest.approx(0.0, abs=0.02)
    assert 20 * np.log10(sharp) == pytest.approx(-3.92, abs=0.06)


@pytest.mark.parametrize("window", WINDOWS)
def test_white_noise_has_its_level(window):
    values = 0.8 * np.random.default_rng(3).standard_normal(400 * BLOCK)
    squares = line_amplitudes(values, BLOCK, window, rms=True)[10:-10] ** 2
    expected = 0.8**2 * 2 / BLOCK * noise_bandwidth(window)
    assert np.mean(squares) == pytest.approx(expected, rel=0.02)


def test_blocks_are_averaged_by_mean_square():
    loud = np.sin(2 * np.pi * 7 * np.arange(BLOCK) / BLOCK)
    values = np.concatenate([loud, 0.0 * loud, 3.0 * loud[:17]])  # the rest is no whole block
    found = line_amplitudes(values, BLOCK, "rectangular", rms=False)
    assert found[7] == pytest.approx(np.sqrt(0.5), abs=1e-12)


def test_an_unknown_window_names_the_known_ones():
    with pytest.raises(SignalError, match="choose one of rectangular, hann, flattop"):
        noise_bandwidth("hamming")

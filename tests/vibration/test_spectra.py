"""Single-sided amplitudes: against closed forms."""

import numpy as np
import pytest

from compressor.vibration.spectra import line_amplitudes

BLOCK = 240


@pytest.mark.parametrize("block", [BLOCK, BLOCK + 1])
def test_a_line_has_its_own_amplitude(block):
    count = np.arange(4 * block)
    values = 1.7 + 2.5 * np.sin(2 * np.pi * 30 * count / block + 0.4)
    peak = line_amplitudes(values, block, rms=False)
    rms = line_amplitudes(values, block, rms=True)
    assert peak.size == rms.size == block // 2 + 1
    assert peak[[0, 30]] == pytest.approx([1.7, 2.5], abs=1e-9)
    assert rms[[0, 30]] == pytest.approx([1.7, 2.5 / np.sqrt(2)], abs=1e-9)


def test_the_highest_line_of_an_even_block_is_not_doubled():
    values = 0.3 * (-1.0) ** np.arange(BLOCK)
    for rms in (False, True):
        assert line_amplitudes(values, BLOCK, rms)[-1] == pytest.approx(0.3)


def test_white_noise_has_its_level():
    values = 0.8 * np.random.default_rng(3).standard_normal(400 * BLOCK)
    squares = line_amplitudes(values, BLOCK, rms=True)[10:-10] ** 2
    expected = 0.8**2 * 2 / BLOCK
    assert np.mean(squares) == pytest.approx(expected, rel=0.02)


def test_blocks_are_averaged_by_mean_square():
    loud = np.sin(2 * np.pi * 7 * np.arange(BLOCK) / BLOCK)
    values = np.concatenate([loud, 0.0 * loud, 3.0 * loud[:17]])  # the rest is no whole block
    found = line_amplitudes(values, BLOCK, rms=False)
    assert found[7] == pytest.approx(np.sqrt(0.5), abs=1e-12)

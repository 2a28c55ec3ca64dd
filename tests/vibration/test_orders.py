"""Orders of the crank speed: against signals whose lines, means and energies are known."""

import numpy as np
import pytest

from compressor.vibration.spectra import RecordError, line_amplitudes, resample_angle

TURN = 2 * np.pi
M = 360


def even(turns: float, a_turn: int = M, begin: float = 0.0) -> np.ndarray:
    return begin + TURN * np.arange(round(turns * a_turn)) / a_turn


def at_varying_speed(turns: int, samples: int) -> np.ndarray:
    """Crank angles at equal times; the speed swings by 20 % twice a revolution, and runs up."""
    time = np.linspace(0.0, 1.0, samples)
    angle = TURN * turns * (0.8 * time + 0.2 * time**2)
    return angle + 0.1 * np.sin(2 * angle)


def noise(size: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(size)


@pytest.mark.parametrize(("extra", "turns"), [(-1, 2), (0, 3), (1, 3), (M - 1, 3), (M, 4)])
def test_only_whole_revolutions_are_kept(extra, turns):
    angle = TURN * np.arange(3 * M + extra) / M
    assert resample_angle(angle, np.cos(angle), M).shape == (turns * M,)


def test_a_sine_is_restored_from_unequal_angles():
    """The spline errs by the fourth power of the interval."""
    errors = []
    for samples in (4001, 8001):
        angle = at_varying_speed(10, samples)
        found = resample_angle(angle, np.sin(5 * angle), 600)
        error = np.abs(found - np.sin(5 * even(found.size / 600, 600)))
        errors.append(np.max(error[600:-600]))  # the ends are worse
    assert errors[0] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.25)


def test_resampling_gathers_a_line_that_varying_speed_smears():
    angle = at_varying_speed(20, 40_001)
    values = 1.5 * np.sin(24 * angle)
    even_values = resample_angle(angle, values, 2000)
    found = line_amplitudes(even_values, 2000, rms=False)
    assert found[24] == pytest.approx(1.5, abs=1e-4)
    assert np.max(np.delete(found, 24)) < 1e-4
    smeared = line_amplitudes(values[:-1], values.size // 20, rms=False)
    assert smeared[24] < 0.5


def test_squares_of_the_spectrum_add_up_to_the_mean_square():
    values = 5.0 + noise(8 * M)
    for turns in (8, 1, 4):
        found = line_amplitudes(values, turns * M, rms=True)
        assert np.sum(found**2) == pytest.approx(np.mean(values**2), rel=1e-12)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: resample_angle(even(0.9), even(0.9), M), "pass at least one revolution"),
        (lambda: resample_angle(even(2), np.full(2 * M, np.nan), M), "index 0: cut these off"),
        (lambda: resample_angle(even(2), np.ones((2 * M, 2)), M), "pass one real component"),
        (lambda: resample_angle(even(2), 1j * even(2), M), "complex128"),
    ],
)
def test_bad_input_is_told_with_a_remedy(call, told):
    with pytest.raises(RecordError, match=told):
        call()

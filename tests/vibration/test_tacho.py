"""Pulses: a steady machine loses the steps of its samples, a true change stays; windows."""

import numpy as np
import pytest

from compressor.vibration import Record, cut_windows
from compressor.vibration.tacho import smooth_pulses

RATE, TURN, TRIALS = 25600.0, 0.081, 8
HALF = 0.5 / RATE


def course(kind, count, rng):
    """Revolution times of a machine, in TURN, (count - 1,)."""
    place = np.arange(count - 1)
    deviations = {
        "steady": 0.0 * place,
        "jitter": 0.002 * rng.normal(size=count - 1),
        "small jitter": 0.0001 * rng.normal(size=count - 1),
        "running down": 0.02 * place,
        "hunting": 0.01 * np.sin(2 * np.pi * place / 5),
        "fast hunting": 0.001 * np.sin(2 * np.pi * place / 2.3),
    }
    return 1.0 + deviations[kind]


def errors(kind, count):
    """Rms errors of a revolution's time in samples: as sampled, and smoothed."""
    rng, found = np.random.default_rng(7), []
    for _ in range(TRIALS):
        turns = TURN * course(kind, count, rng)
        true = 0.01 + rng.random() / RATE + np.concatenate([[0.0], turns.cumsum()])
        sampled = np.ceil(true * RATE) / RATE - HALF  # as a level that jumps is read
        smooth = smooth_pulses(sampled, np.full(count, HALF))
        assert np.abs(smooth - sampled).max() <= HALF
        found.append([np.mean(np.diff(one - true) ** 2) for one in (sampled, smooth)])
    return RATE * np.sqrt(np.mean(found, axis=0))


@pytest.mark.parametrize(
    ("kind", "count", "factor"),
    [
        ("steady", 5, 0.7), ("steady", 11, 0.1), ("steady", 60, 0.02), ("small jitter", 11, 0.6),
        ("jitter", 11, 1.02), ("running down", 11, 1.02), ("hunting", 11, 1.02),
        ("hunting", 60, 1.02), ("fast hunting", 11, 1.8),
    ],
)  # fmt: skip
def test_a_steady_speed_is_smoothed_and_a_true_change_is_not(kind, count, factor):
    sampled, smooth = errors(kind, count)
    assert 0.3 < sampled < 0.5
    assert smooth < factor * sampled


def test_a_straight_line_and_well_known_pulses_stay():
    line = 0.3 + TURN * np.arange(400)
    np.testing.assert_allclose(smooth_pulses(line, np.full(400, HALF)), line, atol=1e-9)
    uneven = np.array([0.0, 0.08, 0.161, 0.24, 0.322])
    found = smooth_pulses(uneven, np.array([1e-8, 1e-8, HALF, 1e-8, 1e-8]))
    assert np.abs(found - uneven)[[0, 1, 3, 4]].max() <= 1e-8


def test_windows_reach_from_pulse_to_pulse():
    times = np.arange(1000) / 100.0
    tacho = 0.103 + 0.77 * np.arange(12)
    record = Record(times, np.sin(times), tacho, 0.0)
    found = [*cut_windows(record, 3)]
    assert [first for first, _ in found] == [0, 3, 6]
    for first, one in found:
        assert len(one.tacho) == 4
        assert 0.0 <= one.tacho[0] < 0.01
        assert 0.0 <= one.times[-1] - one.tacho[-1] < 0.01
        since = tacho[first] - one.tacho[0]
        assert one.times[0] == 0.0
        assert one.values == pytest.approx(np.sin(one.times + since), abs=1e-12)
    assert [*cut_windows(record, 12)] == []
    assert len([*cut_windows(record, 11)]) == 1

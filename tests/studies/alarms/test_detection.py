"""Limits and rates against their definitions, and how often intervals hold, by simulation."""

import math

import numpy as np
import pytest

from compressor.studies.alarms.alarms import compute_rate, find_limit, find_onset


def names(count, windows=1):
    return np.repeat([f"draw {n}" for n in range(count)], windows)


def test_a_limit_counts_draws_and_not_windows():
    """Against the definition, with ties, and draws of other lengths."""
    rng = np.random.default_rng(2)
    for _ in range(30):
        sizes = rng.integers(1, 5, 24)
        draws = np.repeat([f"{n}" for n in range(24)], sizes)
        scores = rng.integers(0, 12, draws.size).astype(float)
        rate = rng.uniform(0.02, 0.4)

        def bound(limit, draws=draws, scores=scores):
            shares = [np.mean(scores[draws == name] > limit) for name in {*draws.tolist()}]
            return (sum(shares) + 1) / 25

        allowed = [level for level in np.unique(scores) if bound(level) <= rate + 1e-12]
        assert find_limit(scores, draws, rate) == (min(allowed) if allowed else scores.max())


def test_wilsons_interval_in_closed_form():
    """Of none and of all: z^2 / (n + z^2) from the end; symmetric about a half."""
    square = 1.959963984540054**2
    assert compute_rate(np.zeros(10), names(10)) == pytest.approx((0, 0, square / (10 + square)))
    assert compute_rate(np.ones(10), names(10)) == pytest.approx((1, 10 / (10 + square), 1))
    _, low, high = compute_rate(np.arange(40) % 2, names(40))
    assert low + high == pytest.approx(1.0)
    assert (high - 0.5) ** 2 * (1 + square / 40) == pytest.approx(0.25 * square / 40)


def test_intervals_hold_by_draws_and_would_not_by_windows():
    rng = np.random.default_rng(4)
    held = np.zeros(2)
    for _ in range(400):
        trips = np.repeat(rng.random(30) < 0.8, 5).astype(float)  # windows of a draw are alike
        for way, draws in enumerate((names(30, 5), names(150))):
            one = compute_rate(trips, draws)
            held[way] += one[1] <= 0.8 <= one[2]
    assert held[0] / 400 > 0.92
    assert held[1] / 400 < 0.75


def test_the_clearance_from_which_on_is_in_its_interval():
    """Rates of 40 draws about known ones, which pass 90 % at the third clearance."""
    rng = np.random.default_rng(5)
    clearances, truth = [0.1, 0.2, 0.3, 0.4, 0.5], [0.1, 0.75, 0.93, 0.97, 1.0]
    held = 0
    for _ in range(300):
        rates = [compute_rate((rng.random(40) < one).astype(float), names(40)) for one in truth]
        found = find_onset(np.array(clearances), np.array(rates))
        assert found[1] <= found[0] <= found[2]
        held += found[1] <= 0.3 <= found[2]
    assert held / 300 > 0.94


def test_a_clearance_counts_from_which_on_it_holds():
    """What is detected between two that are not, is not: as between two resonances."""

    def onset(*shares):
        rates = np.array([(share, share - 0.1, min(share + 0.1, 1.0)) for share in shares])
        return find_onset(np.arange(1.0, len(shares) + 1.0), rates)

    assert onset(0.95, 0.7, 0.92, 1.0) == [3, 3, 4]
    assert onset(0.1, 0.2, 0.85) == [math.inf, 3, math.inf]
    assert onset(0.1, 0.2) == [math.inf] * 3

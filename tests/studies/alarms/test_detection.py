"""Limits and rates against their definitions, and how often intervals hold, by simulation."""

import math

import numpy as np
import pytest
import xarray as xr

from compressor.studies.alarms.detection import (
    Rate,
    compute_interval,
    compute_rate,
    draws_to_be_sure,
    find_limit,
    first_clearance,
    share_out,
)
from compressor.studies.alarms.words import detects_words


def names(count, windows=1):
    return np.repeat([f"draw {n}" for n in range(count)], windows)


@pytest.mark.parametrize(("rate", "place"), [(0.01, 0), (0.05, 0), (0.1, 1), (0.25, 4)])
def test_a_limit_leaves_so_many_scores_above(rate, place):
    """Of 19 draws with a window each: (k + 1) / 20 at most the rate, with k above the limit."""
    scores = np.random.default_rng(1).permutation(np.arange(19.0))
    assert find_limit(scores, names(19), rate) == 18.0 - place


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


def test_new_draws_trip_as_often_as_was_asked():
    """In the mean over sets of draws, whose windows are alike: 5 %, or less by discreteness."""
    rng = np.random.default_rng(3)
    shares = []
    for _ in range(400):
        level = rng.lognormal(0.0, 1.0, 60)
        scores = np.repeat(level, 3) * rng.lognormal(0.0, 0.1, 180)
        limit = find_limit(scores, names(60, 3), 0.05)
        new = rng.lognormal(0.0, 1.0, 500) * rng.lognormal(0.0, 0.1, 500)
        shares.append(np.mean(new > limit))
    error = np.std(shares) / math.sqrt(len(shares))
    assert 0.05 - 1 / 61 - 3 * error < np.mean(shares) < 0.05 + 3 * error


def test_wilsons_interval_in_closed_form():
    """Of none and of all: z^2 / (n + z^2) from the end; symmetric about a half."""
    square = 1.959963984540054**2
    assert compute_interval(0.0, 10) == pytest.approx((0.0, square / (10 + square)))
    assert compute_interval(1.0, 10) == pytest.approx((10 / (10 + square), 1.0))
    low, high = compute_interval(0.5, 40)
    assert low + high == pytest.approx(1.0)
    assert (high - 0.5) ** 2 * (1 + square / 40) == pytest.approx(0.25 * square / 40)
    assert draws_to_be_sure(0.9) == 35
    assert draws_to_be_sure(1.0) == math.inf
    assert compute_interval(1.0, 35)[0] >= 0.9 > compute_interval(1.0, 34)[0]


def test_intervals_hold_by_draws_and_would_not_by_windows():
    rng = np.random.default_rng(4)
    held = np.zeros(2)
    for _ in range(400):
        trips = np.repeat(rng.random(30) < 0.8, 5).astype(float)  # windows of a draw are alike
        for way, draws in enumerate((names(30, 5), names(150))):
            one = compute_rate(trips, draws)
            held[way] += one.low <= 0.8 <= one.high
    assert held[0] / 400 > 0.92
    assert held[1] / 400 < 0.75


def test_the_clearance_from_which_on_is_in_its_interval():
    """Rates of 40 draws about known ones, which pass 90 % at the third clearance."""
    rng = np.random.default_rng(5)
    clearances, truth = [0.1, 0.2, 0.3, 0.4, 0.5], [0.1, 0.75, 0.93, 0.97, 1.0]
    held = 0
    for _ in range(300):
        rates = [compute_rate((rng.random(40) < one).astype(float), names(40)) for one in truth]
        found = first_clearance(clearances, rates, 0.9)
        assert found.low <= found.clearance <= found.high
        held += found.low <= 0.3 <= found.high
    assert held / 300 > 0.94


def test_a_clearance_counts_from_which_on_it_holds():
    """What is detected between two that are not, is not: as between two resonances."""

    def rates(*shares):
        return [Rate(share, share - 0.1, min(share + 0.1, 1.0), 9) for share in shares]

    assert first_clearance([1, 2, 3, 4], rates(0.95, 0.7, 0.92, 1.0), 0.9) == (3, 3, 4)
    assert first_clearance([1, 2, 3], rates(0.1, 0.2, 0.85), 0.9) == (math.inf, 3, math.inf)
    assert first_clearance([1, 2], rates(0.1, 0.2), 0.9) == (math.inf,) * 3


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ((3.0, 2.0, 4.0), "detects from 3 mm [2 mm, 4 mm] on"),
        ((math.inf, 3.0, math.inf), "never detects [3 mm, > 5 mm]"),
        ((math.inf,) * 3, "never detects"),
    ],
)
def test_a_sentence_says_from_where_an_alarm_detects(ends, words):
    names = ("first_clearance", "first_clearance_low", "first_clearance_high")
    found = {name: ("joint", [end]) for name, end in zip(names, ends, strict=True)}
    found |= {"clearance": ("state", [1.0, 5.0]), "worn_joint": ("state", ["small_end"] * 2)}
    one = xr.Dataset(found, {"joint": ["small_end"]})
    assert detects_words(one, "small_end") == words


def test_a_draw_is_in_one_fold():
    draws, sound = np.tile(names(23), 3), np.arange(69) < 40
    folds = share_out(draws, sound, 5, 1)
    for name in {*draws.tolist()}:
        assert len({*folds[draws == name].tolist()}) == 1
    counts = np.bincount(folds[:23], minlength=5)
    assert counts.max() - counts.min() <= 1
    assert not np.array_equal(folds, share_out(draws, sound, 5, 2))


def test_draws_without_sound_windows_are_in_a_fold_of_their_own():
    draws = names(12, 2)
    folds = share_out(draws, np.arange(24) < 14, 5, 1)
    assert (folds[14:] == 5).all()
    assert {*folds[:14].tolist()} == {0, 1, 2, 3, 4}

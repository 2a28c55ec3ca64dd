"""Effects of swept keys, of functions whose effects are known."""

import math

import numpy as np
import pytest
from scipy.stats import spearmanr

from compressor.analysis.effects import correlate_ranks, grid_effects, sampled_effects


def table(function, *axes):
    return function(*np.meshgrid(*axes, indexing="ij")).astype(float)


def test_a_sum_has_no_interactions():
    """V(a) = 2/3 and V(2 b) = 4 * 5/4 over the points, whose sum is the variance."""
    values = table(lambda a, b: a + 2 * b, np.arange(3), np.arange(4))
    found = grid_effects(values)
    shares = np.array([2 / 3, 5]) / (2 / 3 + 5)
    assert found.main == pytest.approx(shares)
    assert found.total == pytest.approx(shares)
    assert found.strength is found.total


def test_a_product_of_signs_is_interaction_alone():
    found = grid_effects(table(lambda a, b, c: a * b + 0 * c, *[np.array([-1, 1])] * 3))
    assert found.main == pytest.approx([0, 0, 0])
    assert found.total == pytest.approx([1, 1, 0])


def test_ishigami_s_function_on_a_fine_grid():
    """Closed forms (Saltelli et al. 2008): main .3139, .4424, 0; total .5576, .4424, .2437."""
    x = np.pi * (2 * (np.arange(60) + 0.5) / 60 - 1)
    values = table(lambda a, b, c: np.sin(a) + 7 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a), x, x, x)
    found = grid_effects(values)
    assert found.main == pytest.approx([0.3139, 0.4424, 0.0], abs=2e-3)
    assert found.total == pytest.approx([0.5576, 0.4424, 0.2437], abs=2e-3)


def test_gaps_of_a_sum_are_filled_rightly():
    values = table(lambda a, b, c: a + 2 * b + c**2, np.arange(4), np.arange(5), np.arange(3))
    exact = grid_effects(values)
    values[0, 1, 2] = values[3, 3, 0] = values[2, 2, 2] = math.nan
    found = grid_effects(values)
    assert (exact.unknown, found.unknown) == (0, 3)
    assert found.main == pytest.approx(exact.main, abs=1e-6)
    assert found.total == pytest.approx(exact.total, abs=1e-6)
    values[:, :2] = math.nan  # values of an axis at which nothing is known
    assert grid_effects(values).main.sum() == pytest.approx(1.0, abs=1e-6)
    values[:2, 2:4] = math.nan
    assert grid_effects(values) is None


def test_what_never_changes_has_no_effects():
    assert np.isnan(grid_effects(np.full((3, 2), 5.0)).main).all()
    assert np.isnan(sampled_effects([np.arange(9.0)], np.full(9, 5.0)).main).all()


def test_other_designs_have_correlations_of_ranks():
    rng = np.random.default_rng(1)
    x, idle = rng.random((2, 200))
    load = np.array(["spring", "gas"])[rng.integers(2, size=200)]
    values = np.exp(-5 * x)
    found = sampled_effects([x, idle, load], values)
    assert found.kind == "rank"
    assert found.total is None
    assert found.main[0] == -1.0
    assert found.strength[0] == 1.0
    low, high = found.main_ends
    assert low[1] < 0 < high[1]
    assert np.isnan([low[2], high[2]]).all()  # of words
    assert found.main[2] < 0.3
    assert sampled_effects([x[:5]], values[:5]) is None


def test_of_two_words_the_ratio_is_the_correlation():
    rng = np.random.default_rng(2)
    code = rng.integers(2, size=80)
    values = rng.normal(size=80) + code
    found, low, high = correlate_ranks(np.array(["a", "b"])[code], values)
    assert found == pytest.approx(spearmanr(code, values).statistic)
    assert math.isnan(low)
    assert math.isnan(high)


def test_intervals_of_correlations_hold_as_often_as_they_say():
    """Of a bivariate normal Spearman's rho is 6 / pi asin(r / 2); 95 % of 400, within 3 sigma."""
    rng = np.random.default_rng(3)
    exact = 6 / np.pi * math.asin(0.6 / 2)
    held = 0
    for _ in range(400):
        x, noise = rng.normal(size=(2, 60))
        _, low, high = correlate_ranks(x, 0.6 * x + 0.8 * noise)
        held += low <= exact <= high
    assert held / 400 == pytest.approx(0.95, abs=0.033)

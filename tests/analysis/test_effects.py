"""Effects of swept keys, of functions whose effects are known."""

import math

import numpy as np
import pytest
from scipy.stats import spearmanr

from compressor.analysis import effects
from compressor.cases.swept import design


def table(function, *axes):
    return function(*np.meshgrid(*axes, indexing="ij")).astype(float)


def test_ishigami_s_function_on_a_fine_grid():
    """Closed forms (Saltelli et al. 2008): main .3139, .4424, 0; total .5576, .4424, .2437."""
    x = np.pi * (2 * (np.arange(60) + 0.5) / 60 - 1)
    values = table(lambda a, b, c: np.sin(a) + 7 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a), x, x, x)
    found = effects.grid_effects(values)
    assert found.main == pytest.approx([0.3139, 0.4424, 0.0], abs=2e-3)
    assert found.total == pytest.approx([0.5576, 0.4424, 0.2437], abs=2e-3)


def test_gaps_of_a_sum_are_filled_rightly():
    values = table(lambda a, b, c: a + 2 * b + c**2, np.arange(4), np.arange(5), np.arange(3))
    exact = effects.grid_effects(values)
    values[0, 1, 2] = values[3, 3, 0] = values[2, 2, 2] = math.nan
    found = effects.grid_effects(values)
    assert (exact.unknown, found.unknown) == (0, 3)
    assert found.main == pytest.approx(exact.main, abs=1e-6)
    assert found.total == pytest.approx(exact.total, abs=1e-6)
    values[:, :2] = math.nan  # values of an axis at which nothing is known
    assert effects.grid_effects(values).main.sum() == pytest.approx(1.0, abs=1e-6)
    values[:2, 2:4] = math.nan
    assert effects.grid_effects(values) is None


def test_other_designs_have_correlations_of_ranks():
    rng = np.random.default_rng(1)
    x, idle = rng.random((2, 200))
    load = np.array(["spring", "gas"])[rng.integers(2, size=200)]
    values = np.exp(-5 * x)
    found = effects.sampled_effects([x, idle, load], values)
    assert found.kind == "rank"
    assert found.total is None
    assert found.main[0] == -1.0
    assert found.strength[0] == 1.0
    low, high = found.main_ends
    assert low[1] < 0 < high[1]
    assert np.isnan([low[2], high[2]]).all()  # of words
    assert found.main[2] < 0.3
    assert effects.sampled_effects([x[:5]], values[:5]) is None


def test_of_two_words_the_ratio_is_the_correlation():
    rng = np.random.default_rng(2)
    code = rng.integers(2, size=80)
    values = rng.normal(size=80) + code
    found, _, _ = effects.correlate_ranks(np.array(["a", "b"])[code], values)
    assert found == pytest.approx(spearmanr(code, values).statistic)


def test_intervals_of_correlations_hold_as_often_as_they_say():
    """Of a bivariate normal Spearman's rho is 6 / pi asin(r / 2); 95 % of 400, within 3 sigma."""
    rng = np.random.default_rng(3)
    exact = 6 / np.pi * math.asin(0.6 / 2)
    held = 0
    for _ in range(400):
        x, noise = rng.normal(size=(2, 60))
        _, low, high = effects.correlate_ranks(x, 0.6 * x + 0.8 * noise)
        held += low <= exact <= high
    assert held / 400 == pytest.approx(0.95, abs=0.033)


# ---- designs of Saltelli; indices in closed form: tests/studies/test_machine_claims.py


def test_only_a_design_is_one():
    points = design("saltelli", 8, 3, 1)
    assert effects.saltelli_design(points[:, [2, 0, 1]]) is not None  # in any order of columns
    assert effects.saltelli_design(points[:-1]) is None
    assert effects.saltelli_design(design("sobol", 40, 3, 1)) is None
    assert effects.saltelli_design(points.astype(object)) is None


def test_blocks_drop_out_whole_and_a_power_of_two_is_left():
    """An unknown point of A, of B, or of a mixed part costs its block."""
    points = design("saltelli", 8, 3, 1)
    parts = effects.saltelli_design(points)
    unknown = np.zeros(len(points), bool)
    unknown[[parts.a[1], parts.b[3], parts.mixed[2, 4], parts.mixed[0, 4]]] = True
    left = parts.whole(unknown)
    kept = [0, 2, 5, 6]  # 7 is whole, too
    assert left.a.tolist() == parts.a[kept].tolist()
    assert left.b.tolist() == parts.b[kept].tolist()
    assert left.mixed.tolist() == parts.mixed[:, kept].tolist()
    assert parts.whole(unknown, 2).a.tolist() == parts.a[[0, 2]].tolist()
    assert parts.whole(np.ones(len(points), bool)).a.size == 0


def test_failed_runs_do_not_bias_the_indices():
    """A tenth of the points is unknown by chance."""
    points = design("saltelli", 512, 2, 1)
    values = points[:, 0] + 2.0 * points[:, 1]
    lost = np.random.default_rng(4).random(values.size) < 0.1
    found = effects.sampled_effects([*points.T], np.where(lost, np.nan, values))
    assert (found.kind, found.unknown, found.base) == ("saltelli", lost.sum(), 256)
    assert found.total == pytest.approx([0.2, 0.8], abs=0.04)
    assert (found.main_ends[0] <= found.main).all()
    assert (found.main_ends[1] >= found.main).all()
    points = design("saltelli", 256, 3, 1)
    whole = effects.sampled_effects([*points.T], points[:, 0] + 2.0 * points[:, 1])
    assert (whole.unknown, whole.base) == (0, 0)
    assert whole.total == pytest.approx([0.2, 0.8, 0.0], abs=0.03)
    assert whole.total_ends[1][2] == 0.0  # the third key changes nothing, surely
    (alone,) = design("saltelli", 64, 1, 1).T
    assert effects.sampled_effects([alone], alone).total == pytest.approx([1.0], abs=0.03)


def test_where_few_blocks_are_whole_ranks_remain():
    points = design("saltelli", 16, 6, 1)
    values = points[:, 0].copy()
    values[effects.saltelli_design(points).mixed[0, :10]] = np.nan
    assert effects.sampled_effects([*points.T], values).kind == "rank"

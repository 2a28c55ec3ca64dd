"""Approximate Bayesian computation against a posterior that is known exactly."""

import numpy as np
import pytest

from compressor.studies.diagnosis.approximate import (
    LEVEL,
    MIN_ACCEPTED,
    Posterior,
    misses,
    quantiles,
    weighted_quantiles,
    widening,
)

MANY, NOISE, PRIOR = 900, 0.5, 0.6
LOADING = np.array([1.0, -0.7, 0.4, 0.0])
NORMAL_95 = 1.6449  # standard deviations to each end of a 90 % interval


def drawn(count, seed):
    """Log clearances N(-1, PRIOR^2) and features: linear with Gaussian noise."""
    rng = np.random.default_rng(seed)
    logs = rng.normal(-1.0, PRIOR, count)
    return logs[:, None] * LOADING + rng.normal(0, NOISE, (count, 4)), logs


def exact(points):
    """Mean and standard deviation of the log clearance given features: conjugate Gaussian."""
    precision = 1 / PRIOR**2 + (LOADING**2).sum() / NOISE**2
    return (points @ LOADING / NOISE**2 - 1.0 / PRIOR**2) / precision, precision**-0.5


@pytest.fixture(scope="module")
def posterior():
    points, logs = drawn(MANY, 1)
    return Posterior.fit(points, np.exp(logs)[:, None])


@pytest.fixture(scope="module")
def told(posterior):
    points, logs = drawn(300, 2)
    found = [posterior.intervals(point)[0] for point in points]
    return points, logs, np.log([(one.low, one.median, one.high) for one in found])


def test_medians_and_widths_are_the_exact_ones(told):
    points, _, ends = told
    mean, spread = exact(points)
    assert np.abs(np.median(ends[:, 1] - mean)) < 0.1 * spread
    assert np.sqrt(((ends[:, 1] - mean) ** 2).mean()) < 0.4 * spread
    width = np.median(ends[:, 2] - ends[:, 0])
    assert width == pytest.approx(2 * NORMAL_95 * spread, rel=0.1)


def test_intervals_hold_the_truth_as_often_as_they_say(told):
    _, logs, ends = told
    assert 0.85 < ((ends[:, 0] <= logs) & (logs <= ends[:, 2])).mean() < 0.95


def test_what_is_said_of_coverage_is_so(posterior):
    assert posterior.covered == pytest.approx(LEVEL, abs=0.03)
    assert posterior.widening == pytest.approx(1.0, abs=0.12)


def test_useless_features_give_back_the_prior():
    rng = np.random.default_rng(3)
    clearances = np.exp(rng.uniform(np.log(0.05), np.log(0.5), (400, 1)))
    found = Posterior.fit(rng.normal(size=(400, 3)), clearances).intervals(np.zeros(3))[0]
    assert found.low == pytest.approx(0.05 * 10**0.05, rel=0.15)
    assert found.high == pytest.approx(0.05 * 10**0.95, rel=0.15)
    assert found.median == pytest.approx(0.05 * 10**0.5, rel=0.3)


def test_intervals_end_where_the_study_does(posterior):
    least, most = posterior.clearances.min(), posterior.clearances.max()
    for far in (-40.0, 40.0):
        found = posterior.intervals(far * LOADING)[0]
        assert least <= found.low <= found.median <= found.high <= most


def test_a_clearance_that_never_changes_is_told():
    points = np.random.default_rng(4).normal(size=(60, 2))
    found = Posterior.fit(points, np.full((60, 1), 0.2)).intervals(points[0])[0]
    assert (found.low, found.median, found.high) == pytest.approx((0.2, 0.2, 0.2))


def test_adjustment_moves_jobs_along_the_slope():
    """Logs that are their summaries: whatever is accepted moves to the record's summary."""
    logs = np.linspace(-1, 1, 4 * MIN_ACCEPTED)[:, None]
    noise = 1e-3 * np.random.default_rng(5).normal(size=logs.shape)
    found = quantiles(np.array([0.3]), logs + noise, logs)
    np.testing.assert_allclose(found, 0.3, atol=4e-3)


def test_quantiles_of_equal_weights_are_hazens():
    values = np.random.default_rng(6).normal(size=41)
    shares = (0.05, 0.5, 0.95)
    found = weighted_quantiles(values, np.ones(41), shares)
    np.testing.assert_allclose(found, np.quantile(values, shares, method="hazen"))


def test_a_weight_of_two_counts_as_two_values():
    twice = weighted_quantiles(np.array([1.0, 2, 3]), np.array([1.0, 2, 1]), (0.5,))
    assert twice == pytest.approx([2.0])
    assert weighted_quantiles(np.array([1.0, 2]), np.array([3.0, 1]), (0.5,)) < 1.5


def test_widening_holds_the_share_that_is_asked_for():
    told = np.tile([-1.0, 0.0, 1.0], (99, 1, 1))
    beyond = misses(told, np.linspace(0.01, 1.98, 99)[:, None])
    factor = widening(beyond)[0]
    assert (beyond <= factor).sum() == 90  # of 99: ceil(100 * 0.9)

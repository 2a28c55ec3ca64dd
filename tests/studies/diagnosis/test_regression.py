"""Kernel ridge and logistic regression against what is known of them."""

import numpy as np
import pytest
from scipy.stats import norm

from compressor.studies.diagnosis.approximate import KernelRidge, Logistic


@pytest.fixture(scope="module")
def sample():
    rng = np.random.default_rng(5)
    points = rng.normal(size=(120, 3))
    curve = np.sin(points[:, :1]) + 0.5 * points[:, 1:2] ** 2
    return points, np.column_stack([curve[:, 0], points[:, 2]]) + rng.normal(0, 0.1, (120, 2))


def test_left_out_is_what_a_fit_without_the_point_says(sample):
    points, targets = sample
    whole = KernelRidge.fit(points, targets)
    for i in (0, 17, 119):
        others = np.arange(len(points)) != i

        def kernel(one):
            squares = ((one[:, None] - points[others][None]) ** 2).mean(axis=2)  # noqa: B023
            return np.exp(-squares / (2 * whole.width**2))

        gram = kernel(points[others]) + whole.ridge * np.eye(others.sum())
        weights = np.linalg.solve(gram, targets[others] - whole.mean)
        expected = whole.mean + kernel(points[i : i + 1]) @ weights
        np.testing.assert_allclose(whole.left_out[i], expected[0], rtol=1e-6)


def test_a_curve_is_found_up_to_its_noise(sample):
    points, targets = sample
    found = KernelRidge.fit(points, targets)
    fresh = np.random.default_rng(6).normal(size=(200, 3)).clip(-1.5, 1.5)
    curve = np.sin(fresh[:, 0]) + 0.5 * fresh[:, 1] ** 2
    assert np.sqrt(((found.predict(fresh)[:, 0] - curve) ** 2).mean()) < 0.1


def test_targets_that_never_change_are_foretold():
    points = np.random.default_rng(7).normal(size=(40, 2))
    found = KernelRidge.fit(points, np.full((40, 1), 3.0))
    np.testing.assert_allclose(found.left_out, 3.0)
    np.testing.assert_allclose(found.predict(points + 1), 3.0)


def test_probabilities_are_those_of_bayes():
    """Three Gaussian classes of equal spread, for which logistic regression is exact."""
    rng, means, shares = np.random.default_rng(8), np.array([-1.5, 0.0, 2.0]), (0.5, 0.3, 0.2)
    labels = rng.choice(3, 4000, p=shares)
    found = Logistic.fit((means[labels] + rng.normal(size=4000))[:, None], labels)
    at = np.linspace(-3, 4, 30)
    weights = np.array(shares) * norm.pdf(at[:, None], means)
    exact = weights / weights.sum(axis=1, keepdims=True)
    assert np.abs(found.probabilities(at[:, None]) - exact).max() < 0.04


def test_classes_that_are_apart_stay_finite():
    points = np.r_[np.full(30, -1.0), np.full(30, 1.0)][:, None]
    labels = np.repeat([0, 1], 30)
    chances = Logistic.fit(points, labels).probabilities(points)
    assert np.isfinite(chances).all()
    assert (chances.argmax(axis=1) == labels).all()


def test_one_class_is_certain():
    found = Logistic.fit(np.arange(5.0)[:, None], np.zeros(5, int))
    np.testing.assert_array_equal(found.probabilities(np.zeros((1, 1))), [[1.0]])

"""Small systems of linear equations against NumPy's."""

import numpy as np
import pytest

from compressor.physics.mechanism import factorize_positive, substitute_positive
from compressor.physics.rosenbrock import factorize, substitute


@pytest.mark.parametrize("n", [4, 8])
def test_factors_solve_the_system(n):
    rng = np.random.default_rng(n)
    for _ in range(20):
        matrix, b = rng.normal(size=(n, n)), rng.normal(size=n)
        factors, pivots, x = matrix.copy(), np.zeros(n, dtype=np.int64), b.copy()
        assert factorize(factors, pivots)
        substitute(factors, pivots, x)
        assert matrix @ x == pytest.approx(b, abs=1e-10)


def test_a_singular_system_is_told():
    assert not factorize(np.zeros((4, 4)), np.zeros(4, dtype=np.int64))


@pytest.mark.parametrize("n", [0, 1, 4, 11])
def test_factors_solve_a_positive_system_of_any_scale(n):
    """As masses and inertias have: rows and columns of sizes that differ by many decades."""
    rng = np.random.default_rng(n)
    for _ in range(20):
        root, scale = rng.normal(size=(n, n)), 10.0 ** rng.uniform(-6, 6, n)
        matrix = scale[:, None] * (root @ root.T + np.eye(n)) * scale
        x = rng.normal(size=n) / scale
        factors, found = np.full((11, 11), np.nan), matrix @ x
        factors[:n, :n] = np.tril(matrix) + np.triu(np.full((n, n), np.nan), 1)
        assert factorize_positive(factors, n)
        substitute_positive(factors, found)
        assert found * scale == pytest.approx(x * scale, abs=1e-9)


@pytest.mark.parametrize("matrix", [[[0.0]], [[1.0, 2.0], [2.0, 1.0]], [[np.nan]]])
def test_a_system_that_is_not_positive_is_told(matrix):
    assert not factorize_positive(np.array(matrix), len(matrix))

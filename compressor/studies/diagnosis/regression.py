"""Regression by kernels, with what each point would be told had it been left out.

Ridge regression with a Gaussian kernel k(x, y) = exp(-|x - y|^2 / (2 F s^2)) on F scaled features:
with G = K + r I and centred targets Y, predictions are k(x) G^-1 Y. The error of point i left out
is [G^-1 Y]_i / [G^-1]_ii (Rasmussen and Williams 2006, Gaussian Processes for Machine Learning,
Eqs. 2.25 and 5.10-5.12), so that leaving out costs no more fits.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.spatial.distance import cdist
from scipy.special import logsumexp, softmax

WIDTHS = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)  # of the kernel, s
RIDGES = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1)
SAMPLE = 800  # points by which width and ridge are chosen
PENALTY = 1e-2  # on the squared weights of the logistic regression, over its points


@dataclass(frozen=True)
class KernelRidge:
    """A regression on points (n, F) of targets (n, t); `left_out`: each point's prediction, (n, t),
    by the n - 1 others."""

    points: np.ndarray
    width: float
    ridge: float
    mean: np.ndarray
    weights: np.ndarray
    left_out: np.ndarray

    @classmethod
    def fit(cls, points: np.ndarray, targets: np.ndarray) -> "KernelRidge":
        """Return the regression of the width and ridge with the least squares of errors left
        out.
        """
        some = slice(None, None, -(-len(points) // SAMPLE))
        scale = targets.var(axis=0) + 1e-300
        width, ridge = _chosen(points[some], targets[some] / np.sqrt(scale))
        gram = np.exp(-_squares(points, points) / (2.0 * width**2))
        gram[np.diag_indices_from(gram)] += ridge
        inverse = cho_solve(cho_factor(gram, lower=True), np.eye(len(points)))
        mean = targets.mean(axis=0)
        weights = inverse @ (targets - mean)
        left_out = targets - weights / np.diag(inverse)[:, None]
        return cls(points, width, ridge, mean, weights, left_out)

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Return the predictions at points (m, F): (m, t)."""
        kernel = np.exp(-_squares(points, self.points) / (2.0 * self.width**2))
        return self.mean + kernel @ self.weights


def _squares(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the mean squared difference of each pair of points."""
    return cdist(one, other, "sqeuclidean") / one.shape[1]


def _chosen(points: np.ndarray, targets: np.ndarray) -> tuple[float, float]:
    """Return the width and ridge with the least squares of errors left out."""
    squares = _squares(points, points)
    centred = targets - targets.mean(axis=0)
    least, best = np.inf, (WIDTHS[0], RIDGES[0])
    for width in WIDTHS:
        values, vectors = np.linalg.eigh(np.exp(-squares / (2.0 * width**2)))
        turned = vectors.T @ centred
        for ridge in RIDGES:
            shrunk = 1.0 / (np.maximum(values, 0.0) + ridge)
            diagonal = (vectors**2) @ shrunk
            errors = (vectors @ (shrunk[:, None] * turned)) / diagonal[:, None]
            if (total := float((errors**2).sum())) < least:
                least, best = total, (width, ridge)
    return best


@dataclass(frozen=True)
class Logistic:
    """Multinomial logistic regression on points (n, s) of labels 0 ... c - 1."""

    weights: np.ndarray  # (s + 1, c)

    @classmethod
    def fit(cls, points: np.ndarray, labels: np.ndarray) -> "Logistic":
        """By the greatest likelihood with a small ridge, which keeps separable classes finite."""
        design = np.column_stack([points, np.ones(len(points))])
        wanted = np.eye(int(labels.max()) + 1)[labels]
        shape = design.shape[1], wanted.shape[1]

        def loss(flat: np.ndarray) -> tuple[float, np.ndarray]:
            weights = flat.reshape(shape)
            scores = design @ weights
            value = (logsumexp(scores, axis=1) - (scores * wanted).sum(axis=1)).sum()
            slope = design.T @ (softmax(scores, axis=1) - wanted)
            return value + PENALTY * (flat**2).sum(), slope.ravel() + 2.0 * PENALTY * flat

        found = minimize(loss, np.zeros(np.prod(shape)), jac=True, method="L-BFGS-B")
        return cls(found.x.reshape(shape))

    def probabilities(self, points: np.ndarray) -> np.ndarray:
        """Of each label at points (m, s): (m, c)."""
        return softmax(np.column_stack([points, np.ones(len(points))]) @ self.weights, axis=1)

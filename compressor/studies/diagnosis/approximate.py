"""Regression by kernels, with each point's prediction when it is left out.

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
    """A regression on points (n, F) of targets (n, t).

    `left_out`: each point's prediction, (n, t), by the n - 1 others.
    """

    points: np.ndarray
    width: float
    ridge: float
    mean: np.ndarray
    weights: np.ndarray
    left_out: np.ndarray

    @classmethod
    def fit(cls, points: np.ndarray, targets: np.ndarray) -> "KernelRidge":
        """Return the regression whose width and ridge have the least leave-one-out errors."""
        sample = slice(None, None, -(-len(points) // SAMPLE))
        scale = targets.var(axis=0) + 1e-300
        width, ridge = _choose_kernel(points[sample], targets[sample] / np.sqrt(scale))
        gram = np.exp(-_squares(points, points) / (2.0 * width**2))
        gram[np.diag_indices_from(gram)] += ridge
        inverse = cho_solve(cho_factor(gram, lower=True), np.eye(len(points)))
        mean = targets.mean(axis=0)
        weights = inverse @ (targets - mean)
        # closed form of the n fits without one point each, but for the mean, which is of all
        left_out = targets - weights / np.diag(inverse)[:, None]
        return cls(points, width, ridge, mean, weights, left_out)

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Return the predictions at points (m, F): (m, t)."""
        kernel = np.exp(-_squares(points, self.points) / (2.0 * self.width**2))
        return self.mean + kernel @ self.weights


def _squares(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the mean squared difference of each pair of points."""
    return cdist(one, other, "sqeuclidean") / one.shape[1]


def _choose_kernel(points: np.ndarray, targets: np.ndarray) -> tuple[float, float]:
    """Return the width and ridge with the least squares of leave-one-out errors."""
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
        """Return the classifier of greatest likelihood, with a small ridge.

        The ridge keeps separable classes finite.
        """
        design = np.column_stack([points, np.ones(len(points))])
        one_hot = np.eye(int(labels.max()) + 1)[labels]
        shape = design.shape[1], one_hot.shape[1]

        def loss(flat: np.ndarray) -> tuple[float, np.ndarray]:
            weights = flat.reshape(shape)
            scores = design @ weights
            value = (logsumexp(scores, axis=1) - (scores * one_hot).sum(axis=1)).sum()
            slope = design.T @ (softmax(scores, axis=1) - one_hot)
            return value + PENALTY * (flat**2).sum(), slope.ravel() + 2.0 * PENALTY * flat

        found = minimize(loss, np.zeros(np.prod(shape)), jac=True, method="L-BFGS-B")
        return cls(found.x.reshape(shape))

    def probabilities(self, points: np.ndarray) -> np.ndarray:
        """Return the probability of each label at points (m, s): (m, c)."""
        return softmax(np.column_stack([points, np.ones(len(points))]) @ self.weights, axis=1)


NEAREST = 5  # jobs whose mean distance is compared
STRONGEST = 10  # principal components that foretell the others
FOLDS = 10  # of jobs, for the residuals' metric
WEAKEST = 1e-6  # share of the greatest variance, below which a component is rounding


@dataclass(frozen=True)
class Distance:
    """A record's distance and the median of the study's jobs'."""

    record: float
    usual: float


@dataclass(frozen=True)
class Strangeness:
    """What judges records by the scaled features of a study's n jobs, (n, F).

    turn: from these to c whitened components; back: from these to scaled features, (c, F); white:
    the jobs' components, (n, c); near, apart: sorted distances of the jobs, (n,); metric: whitens
    residuals; spread: of the residuals in each scaled feature, (F,).
    """

    turn: np.ndarray
    back: np.ndarray
    middle: np.ndarray
    white: np.ndarray
    near: np.ndarray
    regression: KernelRidge
    metric: np.ndarray
    apart: np.ndarray
    spread: np.ndarray

    @classmethod
    def fit(cls, points: np.ndarray) -> "Strangeness":
        """Return the judge of records whose features should be like those of n jobs, (n, F)."""
        middle = points.mean(axis=0)
        values, vectors = np.linalg.eigh(np.cov(points.T))
        axes = np.flatnonzero(values > WEAKEST * values.max())[::-1]
        turn, back = (
            vectors[:, axes] / np.sqrt(values[axes]),
            vectors[:, axes] * np.sqrt(values[axes]),
        )
        white = (points - middle) @ turn
        gaps = cdist(white, white)
        np.fill_diagonal(gaps, np.inf)
        near = np.sort(np.partition(gaps, NEAREST, axis=1)[:, :NEAREST].mean(axis=1))
        strong = min(STRONGEST, len(axes) // 2)
        regression = KernelRidge.fit(white[:, :strong], white[:, strong:])
        left = white[:, strong:] - regression.left_out
        apart = np.empty(len(points))
        fold = np.arange(len(points)) % FOLDS
        for number in range(FOLDS):
            mine = fold == number
            # by the spread of the other folds: a job must not narrow its own distance
            apart[mine] = np.linalg.norm(left[mine] @ _whitening(left[~mine]), axis=1)
        spread = np.maximum((left @ back.T[strong:]).std(axis=0), 1e-12)
        return cls(
            turn, back.T, middle, white, near, regression, _whitening(left), np.sort(apart), spread
        )

    def judge(self, point: np.ndarray) -> tuple[float, Distance, Distance]:
        """Return the p-value of scaled features (F,), and both distances.

        The p-value is twice the smaller of the two shares of jobs that lie at least as far off
        (Bonferroni), and is 2 / (n + 1) at least.
        """
        white = (point - self.middle) @ self.turn
        gaps = cdist(white[None], self.white)[0]
        near = float(np.partition(gaps, NEAREST)[:NEAREST].mean())
        apart = float(np.linalg.norm(self._residuals(white) @ self.metric))
        chance = min(_share(near, self.near), _share(apart, self.apart))
        usual = [float(np.median(each)) for each in (self.near, self.apart)]
        return min(1.0, 2.0 * chance), Distance(near, usual[0]), Distance(apart, usual[1])

    def nearest(self, point: np.ndarray) -> int:
        """Return the index of the nearest job."""
        return int(cdist(((point - self.middle) @ self.turn)[None], self.white)[0].argmin())

    def deviations(self, point: np.ndarray) -> np.ndarray:
        """Return how far each feature is from what others predict, (F,).

        In standard deviations.
        """
        left = self._residuals((point - self.middle) @ self.turn)
        return left @ self.back[-left.size :] / self.spread

    def _residuals(self, white: np.ndarray) -> np.ndarray:
        """Return the weaker components less their prediction by the strongest ones."""
        strong = self.regression.points.shape[1]
        return white[strong:] - self.regression.predict(white[None, :strong])[0]


def _whitening(residuals: np.ndarray) -> np.ndarray:
    """Return the matrix that makes residuals (n, c) uncorrelated with variance 1, (c, c)."""
    values, vectors = np.linalg.eigh(np.atleast_2d(np.cov(residuals.T)))
    return vectors / np.sqrt(np.maximum(values, WEAKEST * values.max()))


def _share(distance: float, own: np.ndarray) -> float:
    """Return the share of sorted distances, with the record's, that are at least as great."""
    return float((1 + len(own) - np.searchsorted(own, distance)) / (1 + len(own)))


ACCEPTED_SHARE = 0.3  # of the jobs that is accepted
MIN_ACCEPTED = 50  # accepted, or all where there are fewer
LEVEL = 0.9  # of the intervals


@dataclass(frozen=True)
class Interval:
    """What a clearance is: median and ends of the interval, mm."""

    median: float
    low: float
    high: float


@dataclass(frozen=True)
class Posterior:
    """Clearances of one kind of joint from a record's features.

    `widening`: of both halves of the intervals, by clearance, (k,); `covered`: the share of the
    jobs' clearances that lie in their intervals, where half of the jobs set the widening and the
    other half is judged, (k,).
    """

    regression: KernelRidge
    clearances: np.ndarray  # mm, (n, k)
    widening: np.ndarray
    covered: np.ndarray

    @classmethod
    def fit(cls, points: np.ndarray, clearances: np.ndarray) -> "Posterior":
        """Return the posterior of log clearances, calibrated on the jobs themselves."""
        logs = np.log(clearances)
        regression = KernelRidge.fit(points, logs)
        summaries = regression.left_out
        number = np.arange(len(points))
        intervals = np.array(
            [quantiles(summaries[i], summaries[number != i], logs[number != i]) for i in number]
        )
        beyond = misses(intervals, logs)
        even = number % 2 == 0
        halves = [(widening(beyond[a]), beyond[~a]) for a in (even, ~even)]
        covered = np.concatenate([judged <= width for width, judged in halves]).mean(axis=0)
        return cls(regression, clearances, widening(beyond), covered)

    def intervals(self, point: np.ndarray) -> list[Interval]:
        """Return the median and interval of each clearance at scaled features (F,).

        Ends are cut at the study's least and greatest clearance: nothing is known beyond.
        """
        logs = np.log(self.clearances)
        summary = self.regression.predict(point[None])[0]
        found = []
        rows = zip(
            quantiles(summary, self.regression.left_out, logs), self.widening, logs.T, strict=True
        )
        for (low, median, high), width, values in rows:
            ends = median - width * (median - low), median, median + width * (high - median)
            low, median, high = np.exp(np.clip(ends, values.min(), values.max())).tolist()
            found.append(Interval(median, low, high))
        return found


def quantiles(summary: np.ndarray, summaries: np.ndarray, logs: np.ndarray) -> np.ndarray:
    """Return the lower end, median and upper end of each log clearance, (k, 3).

    By rejection and linear adjustment. summary: the record's, (k,); summaries, logs: the jobs', (n,
    k).
    """
    scale = np.maximum((summaries - logs).std(axis=0), 1e-12)
    offsets = (summaries - summary) / scale
    distance = np.sqrt((offsets**2).sum(axis=1))
    count = min(len(distance), max(MIN_ACCEPTED, round(ACCEPTED_SHARE * len(distance))))
    accepted = np.argpartition(distance, count - 1)[:count]
    reach = distance[accepted].max() * (1.0 + 1e-9) + 1e-12
    weights = 1.0 - (distance[accepted] / reach) ** 2
    design = np.column_stack([np.ones(count), offsets[accepted]])
    root = np.sqrt(weights)[:, None]
    slopes = np.linalg.lstsq(root * design, root * logs[accepted], rcond=None)[0]
    adjusted = logs[accepted] - design[:, 1:] @ slopes[1:]
    levels = (1.0 - LEVEL) / 2.0, 0.5, (1.0 + LEVEL) / 2.0
    return np.array([weighted_quantiles(one, weights, levels) for one in adjusted.T])


def weighted_quantiles(
    values: np.ndarray, weights: np.ndarray, shares: tuple[float, ...]
) -> np.ndarray:
    """Return the quantiles of weighted values, linear between the middles of their weights."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    middles = (total - 0.5 * weights[order]) / total[-1]
    return np.interp(shares, middles, values[order])


def misses(intervals: np.ndarray, logs: np.ndarray) -> np.ndarray:
    """Return the factor on an interval's half by which it just holds the truth, (n, k).

    intervals: (n, k, 3) of `quantiles`; logs: the true log clearances, (n, k).
    """
    low, median, high = np.moveaxis(intervals, 2, 0)
    above = logs > median
    half = np.where(above, high - median, median - low)
    return np.abs(logs - median) / np.maximum(half, 1e-12)


def widening(beyond: np.ndarray) -> np.ndarray:
    """Return the least widening, (k,), by which the fraction LEVEL of intervals hold.

    beyond: `misses` of n jobs, (n, k).
    """
    count = len(beyond)
    rank = min(count, int(np.ceil((count + 1) * LEVEL)))
    return np.sort(beyond, axis=0)[rank - 1]

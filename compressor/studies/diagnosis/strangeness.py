"""Whether a record is like those of a study: a test by two distances, each ranked among its jobs.

The first is the mean distance from the nearest jobs, by whitened features: no job is like it. The
second asks whether its features go together as the study's do: the strongest principal components
foretell the weaker ones by a regression, and the distance is Mahalanobis's of what is left. It may
see another model, whose records lie between the study's own. Every job is ranked as a record that
the study does not have: it is left out of its neighbours and its regression, and the residuals'
metric is that of other jobs.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from compressor.studies.diagnosis.regression import KernelRidge

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
        middle = points.mean(axis=0)
        values, vectors = np.linalg.eigh(np.cov(points.T))
        kept = np.flatnonzero(values > WEAKEST * values.max())[::-1]
        turn, back = (
            vectors[:, kept] / np.sqrt(values[kept]),
            vectors[:, kept] * np.sqrt(values[kept]),
        )
        white = (points - middle) @ turn
        gaps = cdist(white, white)
        np.fill_diagonal(gaps, np.inf)
        near = np.sort(np.partition(gaps, NEAREST, axis=1)[:, :NEAREST].mean(axis=1))
        strong = min(STRONGEST, len(kept) // 2)
        regression = KernelRidge.fit(white[:, :strong], white[:, strong:])
        left = white[:, strong:] - regression.left_out
        apart = np.empty(len(points))
        fold = np.arange(len(points)) % FOLDS
        for number in range(FOLDS):
            mine = fold == number
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
        apart = float(np.linalg.norm(self._left(white) @ self.metric))
        chance = min(_share(near, self.near), _share(apart, self.apart))
        usual = [float(np.median(each)) for each in (self.near, self.apart)]
        return min(1.0, 2.0 * chance), Distance(near, usual[0]), Distance(apart, usual[1])

    def nearest(self, point: np.ndarray) -> int:
        """Return the index of the nearest job."""
        return int(cdist(((point - self.middle) @ self.turn)[None], self.white)[0].argmin())

    def off(self, point: np.ndarray) -> np.ndarray:
        """Return how far each feature is from what others foretell, in standard deviations,
        (F,).
        """
        left = self._left((point - self.middle) @ self.turn)
        return left @ self.back[-left.size :] / self.spread

    def _left(self, white: np.ndarray) -> np.ndarray:
        """Return what the strongest components do not foretell of the others."""
        strong = self.regression.points.shape[1]
        return white[strong:] - self.regression.predict(white[None, :strong])[0]


def _whitening(residuals: np.ndarray) -> np.ndarray:
    """Return what turns residuals (n, c) into uncorrelated ones of variance 1, (c, c)."""
    values, vectors = np.linalg.eigh(np.atleast_2d(np.cov(residuals.T)))
    return vectors / np.sqrt(np.maximum(values, WEAKEST * values.max()))


def _share(distance: float, own: np.ndarray) -> float:
    """Return the share of sorted distances, with the record's, that are at least as great."""
    return float((1 + len(own) - np.searchsorted(own, distance)) / (1 + len(own)))

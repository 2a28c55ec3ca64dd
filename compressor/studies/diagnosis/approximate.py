"""Approximate Bayesian computation of clearances over a study of one kind of joint.

Summaries are regressions of the log clearances on the features, semi-automatic after Fearnhead and
Prangle (2012, J. R. Stat. Soc. B 74, 419). The jobs whose summaries are nearest to the record's are
accepted, weighted by Epanechnikov's kernel, and moved along a local linear regression to where the
record lies (Beaumont, Zhang and Balding 2002, Genetics 162, 2025). A job's own summary comes from
the regression that leaves it out, so that its errors are those of a new record. Intervals are
widened about their medians until as many jobs, left out in turn, lie in theirs as should (split
conformal prediction: Vovk, Gammerman and Shafer 2005).
"""

from dataclasses import dataclass

import numpy as np

from compressor.studies.diagnosis.regression import KernelRidge

SHARE = 0.3  # of the jobs that is accepted
FEWEST = 50  # accepted, or all where there are fewer
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
        """points: scaled features, (n, F); clearances: mm, (n, k), above 0."""
        logs = np.log(clearances)
        regression = KernelRidge.fit(points, logs)
        summaries = regression.left_out
        number = np.arange(len(points))
        told = np.array(
            [quantiles(summaries[i], summaries[number != i], logs[number != i]) for i in number]
        )
        beyond = misses(told, logs)
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
    """Return the lower end, median and upper end of each log clearance, (k, 3), by rejection and
    adjustment.

    summary: the record's, (k,); summaries, logs: the jobs', (n, k).
    """
    scale = np.maximum((summaries - logs).std(axis=0), 1e-12)
    away = (summaries - summary) / scale
    distance = np.sqrt((away**2).sum(axis=1))
    count = min(len(distance), max(FEWEST, round(SHARE * len(distance))))
    accepted = np.argpartition(distance, count - 1)[:count]
    reach = distance[accepted].max() * (1.0 + 1e-9) + 1e-12
    weights = 1.0 - (distance[accepted] / reach) ** 2
    design = np.column_stack([np.ones(count), away[accepted]])
    root = np.sqrt(weights)[:, None]
    slopes = np.linalg.lstsq(root * design, root * logs[accepted], rcond=None)[0]
    moved = logs[accepted] - design[:, 1:] @ slopes[1:]
    wanted = (1.0 - LEVEL) / 2.0, 0.5, (1.0 + LEVEL) / 2.0
    return np.array([weighted_quantiles(one, weights, wanted) for one in moved.T])


def weighted_quantiles(
    values: np.ndarray, weights: np.ndarray, shares: tuple[float, ...]
) -> np.ndarray:
    """Return the quantiles of weighted values, linear between the middles of their weights."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    middles = (total - 0.5 * weights[order]) / total[-1]
    return np.interp(shares, middles, values[order])


def misses(told: np.ndarray, logs: np.ndarray) -> np.ndarray:
    """Return how many times as wide an interval's half would have to be to hold the truth, (n, k).

    told: (n, k, 3) of `quantiles`; logs: the true log clearances, (n, k).
    """
    low, median, high = np.moveaxis(told, 2, 0)
    above = logs > median
    half = np.where(above, high - median, median - low)
    return np.abs(logs - median) / np.maximum(half, 1e-12)


def widening(beyond: np.ndarray) -> np.ndarray:
    """Return the least widening, (k,), by which as many of `misses` (n, k) are held as LEVEL
    asks.
    """
    count = len(beyond)
    rank = min(count, int(np.ceil((count + 1) * LEVEL)))
    return np.sort(beyond, axis=0)[rank - 1]

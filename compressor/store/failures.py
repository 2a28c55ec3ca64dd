"""Where in a sweep jobs fail: keys and thresholds that best separate failed jobs from fine ones.

A decision tree of two levels by Gini's impurity (Breiman et al., Classification and Regression
Trees, 1984), whose first split must be better than chance makes it: it is compared with the best
splits of the same sweep with its failures shuffled.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

MIN_SIDE = 3  # jobs on each side of a split, and failed and fine ones of a study
LEVELS = 2
SHUFFLES, MAX_AS_GOOD = 99, 4  # as good as the true split in fewer than 5 %: p < 0.05
SEED = 1
MAX_JOBS = 4000  # of a study that the tree is made of, evenly drawn; all are counted
MIN_SHARE = 0.1  # of all failures, for a region to be named
MIN_EXCESS = 1.5  # share of failures in it over that in the study


@dataclass(frozen=True)
class Split:
    """A comparison that parts jobs, and by how much it lowers the impurity, from 0 to 0.5.

    sign: < or >= of a number, == or != of a word.
    """

    key: str
    sign: str
    value: float | str
    gain: float

    @property
    def text(self) -> str:
        """Return the comparison as `compsim run --only` takes it."""
        value = self.value if isinstance(self.value, str) else f"{self.value:.12g}"
        return f"{self.key} {self.sign} {value}"


@dataclass(frozen=True)
class Region:
    """Jobs for which comparisons hold, and how many of them failed."""

    splits: tuple[Split, ...]
    jobs: int
    failed: int

    @property
    def text(self) -> str:
        """Return all comparisons, joined."""
        return " and ".join(split.text for split in self.splits)


def find_regions(columns: Mapping[str, np.ndarray], failed: np.ndarray) -> list[Region]:
    """Return the regions of a sweep in which jobs fail more than elsewhere.

    Those with the most failures come first.

    columns: values of each key, (n,) numbers or words; failed: (n,) whether a job did; both of jobs
    that have run. Keys that some job does not have are left out. Nothing where too few failed, too
    few are fine, or no key parts them better than chance.
    """
    if min(failed.sum(), (~failed).sum()) < MIN_SIDE:
        return []
    known = {
        key: column
        for key, column in columns.items()
        if not (column.dtype.kind == "f" and np.isnan(column).any()) and np.unique(column).size > 1
    }
    some = np.linspace(0, failed.size - 1, min(failed.size, MAX_JOBS)).astype(int)
    drawn, drawn_failed = {key: column[some] for key, column in known.items()}, failed[some]
    best = best_split(drawn, drawn_failed)
    if best is None:
        return []
    rng = np.random.default_rng(SEED)
    gains = (best_split(drawn, rng.permutation(drawn_failed)) for _ in range(SHUFFLES))
    if sum(one is not None and one.gain >= best.gain for one in gains) > MAX_AS_GOOD:
        return []
    found = []
    for splits in _leaves(drawn, drawn_failed, (), LEVELS):
        inside = np.logical_and.reduce([holds(split, known[split.key]) for split in splits])
        found.append(Region(splits, int(inside.sum()), int(failed[inside].sum())))
    usual, whole = failed.mean(), failed.sum()
    named = (
        region
        for region in found
        if region.failed >= max(MIN_SHARE * whole, MIN_EXCESS * usual * region.jobs)
    )
    return sorted(named, key=lambda region: -region.failed)


def _leaves(
    columns: Mapping[str, np.ndarray], failed: np.ndarray, splits: tuple[Split, ...], levels: int
) -> Iterator[tuple[Split, ...]]:
    """Yield the splits that lead to each end of a tree."""
    split = best_split(columns, failed) if levels else None
    if split is None:
        yield splits
        return
    opposite = replace(split, sign={"<": ">=", "==": "!="}[split.sign])
    for one in (split, opposite):
        side = holds(one, columns[one.key])
        part = {key: column[side] for key, column in columns.items()}
        yield from _leaves(part, failed[side], (*splits, one), levels - 1)


COMPARE = {"<": np.less, ">=": np.greater_equal, "==": np.equal, "!=": np.not_equal}


def holds(split: Split, column: np.ndarray) -> np.ndarray:
    """Return whether a split's comparison holds, (n,)."""
    return COMPARE[split.sign](column, split.value).astype(bool)


def best_split(columns: Mapping[str, np.ndarray], failed: np.ndarray) -> Split | None:
    """Return the split that lowers the impurity most; None where none does.

    The first of equal ones. Each side has `MIN_SIDE` jobs at least.
    """
    found: Split | None = None
    for key, column in columns.items():
        best = (find_threshold if column.dtype.kind in "fiu" else find_word)(column, failed)
        if best is not None and best[1] > (found.gain if found else 1e-12):
            sign = "<" if column.dtype.kind in "fiu" else "=="
            found = Split(key, sign, best[0], best[1])
    return found


def find_threshold(column: np.ndarray, failed: np.ndarray) -> tuple[float, float] | None:
    """Return the threshold below which jobs differ most from the others, and its gain."""
    order = np.argsort(column, kind="stable")
    values, before = column[order].astype(float), np.cumsum(failed[order])[:-1]
    count = np.arange(1, values.size)
    allowed = (values[1:] > values[:-1]) & (count >= MIN_SIDE) & (values.size - count >= MIN_SIDE)
    if not allowed.any():
        return None
    gains = np.where(allowed, _gain(before, count, int(failed.sum()), failed.size), -1.0)
    at = int(gains.argmax())
    return round_between(values[at], values[at + 1]), float(gains[at])


def find_word(column: np.ndarray, failed: np.ndarray) -> tuple[str, float] | None:
    """Return the word whose jobs differ most from the others, and its gain."""
    words, places = np.unique(column.astype(str), return_inverse=True)
    count, inside = np.bincount(places), np.bincount(places, failed)
    allowed = (count >= MIN_SIDE) & (failed.size - count >= MIN_SIDE)
    if not allowed.any():
        return None
    gains = np.where(allowed, _gain(inside, count, int(failed.sum()), failed.size), -1.0)
    at = int(gains.argmax())
    return str(words[at]), float(gains[at])


def _gain(inside: np.ndarray, count: np.ndarray, failed: int, jobs: int) -> np.ndarray:
    """Return by how much Gini's impurity falls where `inside` of `count` jobs are failed ones."""

    def impurity(bad: np.ndarray, size: np.ndarray) -> np.ndarray:
        return 2.0 * bad * (size - bad) / np.maximum(size, 1)  # times the jobs

    whole = 2.0 * failed * (jobs - failed) / jobs
    parts = impurity(inside, count) + impurity(failed - inside, jobs - count)
    return (whole - parts) / jobs


def round_between(low: float, high: float) -> float:
    """Return a number of few digits above one value and at most another, near their middle."""
    middle = 0.5 * (low + high)
    for digits in range(2, 16):
        value = float(f"{middle:.{digits}g}")
        if low < value <= high:
            return value
    return high


def describe_failures(columns: Mapping[str, np.ndarray], failed: np.ndarray) -> list[str]:
    """Return a sentence for each region of `find_regions`."""
    whole = int(failed.sum())
    return [
        f"{region.failed} of the {whole} failed jobs lie where {region.text}: there "
        f"{region.failed} of {region.jobs} failed"
        for region in find_regions(columns, failed)
    ]

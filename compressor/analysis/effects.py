"""Which swept key matters for a quantity, and Sobol's indices."""

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from compressor.program import ignore_warnings

RESAMPLES = 1000
LEVEL = 0.95
SEED = 1  # of the resampling
ORDERS = ("first_order", "total_order")
MAX_GAPS = 0.2  # of a grid's points
FILLS = 500  # rounds of filling
FILLED = 1e-9  # of the values' span: no round changes more
MIN_POINTS = 8  # points of a ranking
MAX_BASE = 1024  # points of the parts of a `saltelli` design, beyond which its bootstrap is slow
RANKING_RESAMPLES = 400


@dataclass(frozen=True)
class SaltelliDesign:
    """Where the parts of a design stand among its points.

    a, b: the parts A and B, shape (n,) each; mixed: A with each column of B, shape (k, n).
    """

    a: np.ndarray
    b: np.ndarray
    mixed: np.ndarray

    def whole(self, unknown: np.ndarray, most: int = MAX_BASE) -> "SaltelliDesign":
        """Return the first blocks without an unknown point, of all points (n,): a power of two.

        A block is a point of A, that of B, and those of A with a column of B: the estimators take
        differences within it, so that what is left of one would count against nothing.
        """
        is_whole = ~(unknown[self.a] | unknown[self.b] | unknown[self.mixed].any(axis=0))
        places = np.flatnonzero(is_whole)[:most]
        places = places[: 1 << max(0, places.size.bit_length() - 1)]
        return SaltelliDesign(self.a[places], self.b[places], self.mixed[:, places])

    def indices(self, values: np.ndarray, resamples: int = RESAMPLES) -> dict[str, np.ndarray]:
        """Return Sobol's indices of a quantity over k keys with 95 % intervals, (k,) each.

        values: of all points, finite at those of the design, whose number is a power of two.
        `first_order` and `total_order`, with `_low` and `_high`, by SciPy: Saltelli et al.,
        Computer Physics Communications 181, 2010, and the bootstrap BCa. A key that changes
        nothing has none of the variance, surely.
        """
        from scipy.stats import sobol_indices  # takes half a second

        a, b, mixed = values[self.a], values[self.b], values[self.mixed]
        idle = (mixed == a).all(axis=1)
        several = np.concatenate([mixed, mixed])[: max(2, len(mixed))]  # SciPy takes no single key
        table = {"f_A": a[None], "f_B": b[None], "f_AB": several[:, None]}
        found = sobol_indices(func=table, n=a.size)
        with ignore_warnings(), seed_global_draws():  # of what changes nothing
            spread = found.bootstrap(LEVEL, resamples)
        rows = {}
        for order in ORDERS:
            interval = getattr(spread, order).confidence_interval
            ends = ("", getattr(found, order)), ("_low", interval.low), ("_high", interval.high)
            for end, row in ends:
                rows[f"{order}{end}"] = np.where(idle, 0.0, row[: len(mixed)])
        return rows


@contextlib.contextmanager
def seed_global_draws() -> Iterator[None]:
    """Fix NumPy's global draws for a block, since this bootstrap takes no generator."""
    state = np.random.get_state()  # noqa: NPY002
    np.random.seed(SEED)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(state)  # noqa: NPY002


def saltelli_design(columns: np.ndarray) -> SaltelliDesign | None:
    """Return the parts of a `saltelli` design; None where the columns, (points, k), are none."""
    count, keys = columns.shape
    n, rest = divmod(count, keys + 2)
    if rest or n < 2 or n & (n - 1) or columns.dtype == object:
        return None
    a, b = columns[:n], columns[n : 2 * n]
    blocks = np.arange(2 * n, count).reshape(keys, n)
    mixed = np.empty_like(blocks)
    for key in range(keys):  # the order of a file's columns is not that of its design
        expected = a.copy()
        expected[:, key] = b[:, key]
        same = [np.array_equal(columns[places], expected) for places in blocks]
        if sum(same) != 1:
            return None
        mixed[key] = blocks[same.index(True)]
    return SaltelliDesign(np.arange(n), np.arange(n, 2 * n), mixed)


@dataclass(frozen=True)
class Effects:
    """How much each of k keys does to a quantity.

    kind: `grid` and `saltelli`: shares of the variance, by the key alone and with its
    interactions; `rank`: correlations of ranks, of words the correlation ratio; no total.
    main, total: (k,); *_ends: the ends of the 95 % intervals, (2, k), None where the values are
    exact. unknown: points without a value. base: how many points of each part of a `saltelli`
    design were taken, where not all were; else 0.
    """

    kind: str
    main: np.ndarray
    total: np.ndarray | None = None
    main_ends: np.ndarray | None = None
    total_ends: np.ndarray | None = None
    unknown: int = 0
    base: int = 0

    @property
    def strength(self) -> np.ndarray:
        """Return what ranks the keys, (k,): total effects, or sizes of correlations."""
        return abs(self.main) if self.total is None else self.total


def grid_effects(values: np.ndarray) -> Effects | None:
    """Return the main and total effects of a grid's axes; None where too little of it is known.

    values: an axis a key, nan where unknown, not all the same. Every point of the grid counts
    alike, so that the decomposition of the variance (Hoeffding 1948; Sobol', Mathematics and
    Computers in Simulation 55, 2001, 271-280) is exact: S_i = V(E(y | x_i)) / V(y) and
    T_i = 1 - V(E(y | all but x_i)) / V(y) (Saltelli et al., Global Sensitivity Analysis: The
    Primer, 2008, chapters 1 and 4). Values of an axis at which nothing is known are left out. Other
    unknown points, at most MAX_GAPS of all, take the sum of their axes' main effects (Healy and
    Westmacott, Applied Statistics 5, 1956, 203-206).
    """
    whole_grid = values.size
    for axis in range(values.ndim):
        rest = tuple(n for n in range(values.ndim) if n != axis)
        values = np.compress(np.isfinite(values).any(axis=rest), values, axis=axis)
    unknown = ~np.isfinite(values)
    if not values.size or unknown.mean() > MAX_GAPS:
        return None
    lost = int(unknown.sum()) + whole_grid - values.size
    values = fill_unknown(values, unknown)
    axes = range(values.ndim)
    other_axes = [tuple(n for n in axes if n != axis) for axis in axes]
    scaled = (values - values.mean()) / np.ptp(values)
    whole = scaled.var()
    main = np.array([scaled.mean(axis=others).var() for others in other_axes]) / whole
    total = np.array([scaled.var(axis=axis).mean() for axis in axes]) / whole
    return Effects("grid", main, total, unknown=lost)


def fill_unknown(values: np.ndarray, unknown: np.ndarray) -> np.ndarray:
    """Return the values with unknown points filled by the sum of their axes' main effects.

    The main effects are found by iteration, since unknown points are part of the means: a design
    of all points would be too large for an axis of thousands.
    """
    if not unknown.any():
        return values
    found = np.where(unknown, values[~unknown].mean(), values)
    span = np.ptp(values[~unknown])
    for _ in range(FILLS):
        mean = found.mean()
        expected = np.full_like(found, mean)
        for axis in range(found.ndim):
            rest = tuple(n for n in range(found.ndim) if n != axis)
            expected += found.mean(axis=rest, keepdims=True) - mean
        change = abs(np.where(unknown, expected - found, 0.0)).max()
        found = np.where(unknown, expected, found)
        if change <= FILLED * span:
            break
    return found


def sampled_effects(columns: Sequence[np.ndarray], values: np.ndarray) -> Effects | None:
    """Return the effects of keys whose values a design drew; None where too little is known.

    columns: a key's value at each point, or words; values: (points,), nan where unknown, not all
    the same. Of a `saltelli` design Sobol's indices, by the first blocks without an unknown point,
    at most MAX_BASE; else correlations, each over the points that have its key.
    """
    good = np.isfinite(values)
    if good.sum() < MIN_POINTS:
        return None
    lost = int((~good).sum())
    numeric = all(column.dtype.kind in "fiu" for column in columns)
    design = saltelli_design(np.stack(columns, axis=1).astype(float)) if numeric else None
    whole = design.whole(~good) if design else None
    if design and whole and whole.a.size >= MIN_POINTS and good.mean() >= 1.0 - MAX_GAPS:
        found = whole.indices(values, RANKING_RESAMPLES)
        if not all(np.isfinite(row).all() for row in found.values()):
            return None  # some resamples are all the same
        main, total = (
            np.stack([found[f"{order}_low"], found[f"{order}_high"]]) for order in ORDERS
        )
        base = whole.a.size if whole.a.size < design.a.size else 0
        first, all_orders = (found[order] for order in ORDERS)
        return Effects("saltelli", first, all_orders, main, total, lost, base)
    known = [good & (c == c) & (c != "" if c.dtype.kind == "U" else True) for c in columns]
    rows = np.array([correlate_ranks(c[n], values[n]) for c, n in zip(columns, known, strict=True)])
    return Effects("rank", rows[:, 0], main_ends=rows[:, 1:].T, unknown=lost)


def correlate_ranks(column: np.ndarray, values: np.ndarray) -> tuple[float, float, float]:
    """Return the correlation of ranks of a key and a quantity with the ends of its 95 % interval.

    Of numbers Spearman's, the interval by Bonett and Wright (Psychometrika 65, 2000, 23-28). Of
    words the correlation ratio of the ranks, which is the root of Kruskal and Wallis' H / (n - 1),
    without an interval. nan where the key is the same at all points.
    """
    from scipy.stats import kruskal, norm, spearmanr  # takes half a second

    if values.size < MIN_POINTS or np.unique(column).size < 2:
        return math.nan, math.nan, math.nan
    if column.dtype.kind not in "fiu":
        groups = [values[column == word] for word in np.unique(column)]
        ratio = max(0.0, float(kruskal(*groups).statistic)) / (values.size - 1)
        return math.sqrt(ratio), math.nan, math.nan
    found = float(spearmanr(column, values).statistic)
    if abs(found) > 1.0 - 1e-12:
        return found, found, found
    reach = float(norm.ppf(0.5 + LEVEL / 2)) * math.sqrt((1 + found**2 / 2) / (values.size - 3))
    low, high = np.tanh(np.arctanh(found) + np.array([-reach, reach]))
    return found, float(low), float(high)

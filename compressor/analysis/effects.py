"""Which swept key matters for a quantity, and Sobol's indices."""

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compressor.program import ignore_warnings

RESAMPLES = 1000
LEVEL = 0.95
SEED = 1  # of the resampling
ORDERS = ("first_order", "total_order")


@dataclass(frozen=True)
class SaltelliDesign:
    """Where the parts of a design stand among its points.

    a, b: the parts A and B, shape (n,) each; mixed: A with each column of B, shape (k, n).
    """

    a: np.ndarray
    b: np.ndarray
    mixed: np.ndarray

    def first(self, count: int) -> "SaltelliDesign":
        """Return the design of the first points of the sequence.

        A power of two keeps its balance.
        """
        return SaltelliDesign(self.a[:count], self.b[:count], self.mixed[:, :count])

    def without(self, unknown: np.ndarray) -> "SaltelliDesign":
        """Return the design without each block that has an unknown point, of all points (n,).

        A block is a point of A, that of B, and those of A with a column of B: the estimators take
        differences within it, so that what is left of one would count against nothing.
        """
        whole = ~(unknown[self.a] | unknown[self.b] | unknown[self.mixed].any(axis=0))
        return SaltelliDesign(self.a[whole], self.b[whole], self.mixed[:, whole])

    def indices(self, values: np.ndarray, resamples: int = RESAMPLES) -> dict[str, np.ndarray]:
        """Return Sobol's indices of a quantity over k keys with 95 % intervals, (k,) each.

        values: of all points, finite and not all the same at the points of the design, shape
        (n (k + 2),). `first_order` and `total_order`, with `_low` and `_high`, by Saltelli et al.,
        Computer Physics Communications 181, 2010, Table 2 (b) and (f), less the mean; intervals by
        the bootstrap BCa over blocks. SciPy's sobol_indices gives the same, but takes only a power
        of two points, and several keys. A key that changes nothing has none of the variance,
        surely.
        """
        from scipy.stats import bootstrap  # takes half a second

        a, b, mixed = values[self.a], values[self.b], values[self.mixed]
        idle = (mixed == a).all(axis=1)
        mean = np.mean([a[None], b[None]], axis=(0, -1))
        a, b, mixed = a - mean, b - mean, mixed - mean

        def estimate(places: np.ndarray) -> np.ndarray:
            return sobol_estimates(a[places], b[places], mixed[:, places])

        with (
            ignore_warnings(),
            seed_global_draws(),
        ):  # warnings: the bootstrap of what changes nothing
            found = sobol_estimates(a, b, mixed)
            interval = bootstrap(
                [np.arange(a.size)], estimate, confidence_level=LEVEL, n_resamples=resamples,
                vectorized=False,
            ).confidence_interval  # fmt: skip
        rows = {}
        for n, order in enumerate(ORDERS):
            parts = ("", found[n]), ("_low", interval.low[n]), ("_high", interval.high[n])
            for end, row in parts:
                rows[f"{order}{end}"] = np.where(idle, 0.0, row)
        return rows


def sobol_estimates(a: np.ndarray, b: np.ndarray, mixed: np.ndarray) -> np.ndarray:
    """Return the first and total indices of k keys, (2, k).

    a, b: values at the parts A and B, (n,); mixed: at A with each column of B, (k, n).
    """
    variance = np.var([a[None], b[None]], axis=(0, -1))
    first = np.mean(b * (mixed - a), axis=-1) / variance
    total = 0.5 * np.mean((a - mixed) ** 2, axis=-1) / variance
    return np.stack([first, total])


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
    """Return the parts of a `saltelli` design.

    None where the columns, (points, k), are no such design.
    """
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


MAX_GAPS = 0.2  # of a grid's points
FILLS = 500  # rounds of filling
FILLED = 1e-9  # of the values' span: no round changes more
MIN_POINTS = 8  # points of a ranking
MAX_BASE = 1024  # points of the parts of a `saltelli` design, beyond which its bootstrap is slow
MAX_POINTS = 4000  # of the resampling
RANKING_RESAMPLES = 400
RANKING_SEED = 1


@dataclass(frozen=True)
class Effects:
    """How much each of k keys does to a quantity.

    kind: `grid` and `saltelli`: shares of the variance, by the key alone and with its
    interactions; `rank`: correlations of ranks, of words the correlation ratio; no total.
    main, total: (k,); *_ends: the ends of the 95 % intervals, (2, k), None where the values are
    exact. filled: points without a value of their own. base: how many points of each part
    of a `saltelli` design were taken, where not all were; else 0. dropped: blocks of it with a
    point without a value, which are left out, or points of a grid at values of an axis at which
    nothing is known; with_unknown: the effects with these blocks, their unknown points having the
    median, None where there are none.
    """

    kind: str
    main: np.ndarray
    total: np.ndarray | None = None
    main_ends: np.ndarray | None = None
    total_ends: np.ndarray | None = None
    filled: int = 0
    base: int = 0
    dropped: int = 0
    with_unknown: "Effects | None" = None

    @property
    def strength(self) -> np.ndarray:
        """Return what ranks the keys, (k,): total effects, or sizes of correlations."""
        return abs(self.main) if self.total is None else self.total


def grid_effects(values: np.ndarray) -> Effects | None:
    """Return the main and total effects of a grid's axes; None where too little of it is known.

    values: an axis a key, nan where unknown. Every point of the grid counts alike, so that the
    decomposition of the variance (Hoeffding 1948; Sobol', Mathematics and Computers in Simulation
    55, 2001, 271-280) is exact: S_i = V(E(y | x_i)) / V(y) and T_i = 1 - V(E(y | all but x_i)) /
    V(y) (Saltelli et al., Global Sensitivity Analysis: The Primer, 2008, chapters 1 and 4). Both
    are nan where all values are the same. Values of an axis at which nothing is known are left
    out. Other unknown points, at most MAX_GAPS of all, take the sum of their axes' main effects
    (Healy and Westmacott, Applied Statistics 5, 1956, 203-206).
    """
    whole_grid = values.size
    for axis in range(values.ndim):
        rest = tuple(n for n in range(values.ndim) if n != axis)
        values = np.compress(np.isfinite(values).any(axis=rest), values, axis=axis)
    unknown = ~np.isfinite(values)
    if not values.size or unknown.mean() > MAX_GAPS:
        return None
    filled, dropped = int(unknown.sum()), whole_grid - values.size
    values = fill_unknown(values, unknown)
    axes = range(values.ndim)
    other_axes = [tuple(n for n in axes if n != axis) for axis in axes]
    scaled = (values - values.mean()) / (np.ptp(values) or 1.0)
    whole = scaled.var()
    if not whole:
        nothing = np.full(values.ndim, math.nan)
        return Effects("grid", nothing, nothing, filled=filled, dropped=dropped)
    main = np.array([scaled.mean(axis=others).var() for others in other_axes]) / whole
    total = np.array([scaled.var(axis=axis).mean() for axis in axes]) / whole
    return Effects("grid", main, total, filled=filled, dropped=dropped)


def fill_unknown(values: np.ndarray, unknown: np.ndarray) -> np.ndarray:
    """Return the values with unknown points filled by the sum of their axes' main effects.

    The main effects are found by iteration, since unknown points are part of the means.
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

    columns: a key's value at each point, or words; values: (points,), nan where unknown. Of a
    `saltelli` design Sobol's indices, of a large one of its first MAX_BASE points, without the
    blocks that have an unknown point, and besides with them; else correlations, each over the
    points that have its key.
    """
    good = np.isfinite(values)
    if good.sum() < MIN_POINTS:
        return None
    if not np.ptp(values[good]):
        return Effects("rank", np.full(len(columns), math.nan))
    numeric = all(column.dtype.kind in "fiu" for column in columns)
    design = saltelli_design(np.stack(columns, axis=1).astype(float)) if numeric else None
    if design is not None and good.mean() >= 1.0 - MAX_GAPS:
        base = MAX_BASE if design.a.size > MAX_BASE else 0
        design = design.first(MAX_BASE)
        whole = design.without(~good)
        dropped, unknown = design.a.size - whole.a.size, int((~good).sum())
        if whole.a.size >= MIN_POINTS:
            found = _saltelli_effects(whole, values, unknown, base)
            if found is None or not dropped:
                return found
            filled = np.where(good, values, np.median(values[good]))
            other = _saltelli_effects(design, filled, unknown, base)
            return replace(found, dropped=dropped, with_unknown=other)
    known = [good & (c == c) & (c != "" if c.dtype.kind == "U" else True) for c in columns]
    rows = np.array([correlation(c[n], values[n]) for c, n in zip(columns, known, strict=True)])
    return Effects("rank", rows[:, 0], main_ends=rows[:, 1:].T, filled=int((~good).sum()))


def _saltelli_effects(
    design: SaltelliDesign, values: np.ndarray, unknown: int, base: int
) -> Effects | None:
    """Return Sobol's indices of a design; None where so few points differ that they have none."""
    found = design.indices(values, RANKING_RESAMPLES)
    if not all(np.isfinite(row).all() for row in found.values()):
        return None  # some resamples are all the same
    ends = {
        order: np.stack([found[f"{order}_low"], found[f"{order}_high"]])
        for order in ("first_order", "total_order")
    }
    return Effects(
        "saltelli", found["first_order"], found["total_order"], ends["first_order"],
        ends["total_order"], unknown, base,
    )  # fmt: skip


def correlation(column: np.ndarray, values: np.ndarray) -> tuple[float, float, float]:
    """Return the correlation of ranks of a key and a quantity with the ends of its 95 % interval.

    Of numbers Spearman's, the interval by Bonett and Wright (Psychometrika 65, 2000, 23-28). Of
    words the correlation ratio of the ranks, which is the root of Kruskal and Wallis' H / (n - 1),
    with an interval by the bootstrap. nan where the key is the same at all points.
    """
    from scipy.stats import norm, spearmanr  # takes half a second

    if values.size < MIN_POINTS:
        return math.nan, math.nan, math.nan
    if column.dtype.kind not in "fiu":
        return correlation_ratio(np.unique(column, return_inverse=True)[1], values)
    if not np.ptp(column.astype(float)):
        return math.nan, math.nan, math.nan
    found = float(spearmanr(column, values).statistic)
    if abs(found) > 1.0 - 1e-12:
        return found, found, found
    reach = float(norm.ppf(0.5 + LEVEL / 2)) * math.sqrt((1 + found**2 / 2) / (values.size - 3))
    low, high = np.tanh(np.arctanh(found) + np.array([-reach, reach]))
    return found, float(low), float(high)


def correlation_ratio(codes: np.ndarray, values: np.ndarray) -> tuple[float, float, float]:
    """Return the correlation ratio of ranks of values in groups, and its interval."""
    from scipy.stats import kruskal, rankdata

    if np.unique(codes).size < 2:
        return math.nan, math.nan, math.nan
    groups = [values[codes == code] for code in np.unique(codes)]
    found = math.sqrt(max(0.0, float(kruskal(*groups).statistic)) / (values.size - 1))
    rng = np.random.default_rng(RANKING_SEED)
    ranks, size = rankdata(values), min(values.size, MAX_POINTS)
    draws = []
    for _ in range(RANKING_RESAMPLES):
        picked = rng.integers(values.size, size=size)
        counts = np.bincount(codes[picked])
        sums = np.bincount(codes[picked], ranks[picked])
        one = ranks[picked]
        between = (sums[counts > 0] ** 2 / counts[counts > 0]).sum() / size - one.mean() ** 2
        draws.append(math.sqrt(max(0.0, between) / (one.var() or 1.0)))
    low, high = np.quantile(draws, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return found, min(found, float(low)), max(found, float(high))

"""Sobol's indices of what was computed on a `saltelli` design, with bootstrap intervals."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass

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
        """Return the design of the first points of the sequence; a power of two keeps its
        balance.
        """
        return SaltelliDesign(self.a[:count], self.b[:count], self.mixed[:, :count])

    def indices(self, values: np.ndarray, resamples: int = RESAMPLES) -> dict[str, np.ndarray]:
        """Return both indices of a quantity over k keys with their 95 % bootstrap intervals, (k,)
        each.

        values: of all points, finite and not all the same, shape (n (k + 2),). `first_order` and
        `total_order`, with `_low` and `_high`, by SciPy's sobol_indices (Saltelli et al., Computer
        Physics Communications 181, 2010). A key that changes nothing has none of the variance,
        surely.
        """
        from scipy.stats import sobol_indices  # takes half a second

        a, b, mixed = values[self.a], values[self.b], values[self.mixed]
        table = {"f_A": a[None], "f_B": b[None], "f_AB": mixed[:, None]}
        with ignore_warnings(), seeded():  # warnings: the bootstrap of what changes nothing
            found = sobol_indices(func=table, n=a.size, rng=np.random.default_rng(SEED))
            spread = found.bootstrap(confidence_level=LEVEL, n_resamples=resamples)
        idle = (mixed == a).all(axis=1)
        rows = {}
        for order in ORDERS:
            interval = getattr(spread, order).confidence_interval
            parts = ("", getattr(found, order)), ("_low", interval.low), ("_high", interval.high)
            for end, row in parts:
                rows[f"{order}{end}"] = np.where(idle, 0.0, np.ravel(row))
        return rows


@contextlib.contextmanager
def seeded() -> Iterator[None]:
    """Have NumPy's global draws be the same each time: this bootstrap takes no generator."""
    state = np.random.get_state()  # noqa: NPY002
    np.random.seed(SEED)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(state)  # noqa: NPY002


def saltelli_design(columns: np.ndarray) -> SaltelliDesign | None:
    """Return the parts of a `saltelli` design; None where the columns, (points, k), are no such
    design.
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

"""Which assumption decides which claim: variance-based sensitivities of the margins."""

import contextlib
import warnings
from collections.abc import Iterator

import numpy as np
import xarray as xr
from scipy.stats import sobol_indices

from compressor.machines.study import ClaimsError

CUT = 1.0  # margins beyond this are cut: how far beyond decides no claim
RESAMPLES = 1000
LEVEL = 0.95
SEED = 1  # of the resampling
ORDERS = ("first_order", "total_order")


def sensitivity(found: xr.Dataset) -> xr.Dataset | None:
    """Sobol's indices of each claim's margin over the swept assumptions; None without the design.

    found: of `judge_machines` on a study drawn by `saltelli`. `first_order` and `total_order` over
    (claim, assumption), with `_low` and `_high`, the ends of the 95 % bootstrap interval, by
    SciPy's sobol_indices (Saltelli et al., Computer Physics Communications 181, 2010). nan where a
    margin is the same at all machines. Margins are cut at ± 1. A machine without margins counts as
    the median one; `machines` and `unknown` tell how many there are. Raises ClaimsError where
    machines are missing.
    """
    names = [
        str(name) for name, one in found.coords.items()
        if one.dims == ("machine",) and "case_key" in one.attrs
    ]  # fmt: skip
    parts = (
        design_parts(np.stack([found[name].values for name in names], axis=1)) if names else None
    )
    if parts is None:
        return None
    if (found["status"] == "").any():
        raise ClaimsError("the study is not finished: run the same command again")
    margin = np.clip(found["margin"].transpose("claim", "machine").values, -CUT, CUT)
    unknown = np.isnan(margin)
    middle = np.nanmedian(margin, axis=1, keepdims=True)
    margin = np.where(unknown, middle, margin)
    a, b, mixed = (margin[:, part] for part in parts)  # (claim, n) twice, (claim, key, n)
    shape = (len(found["claim"]), len(names))
    values = {
        f"{order}{end}": np.full(shape, np.nan) for order in ORDERS for end in ("", "_low", "_high")
    }
    for claim in np.flatnonzero(np.ptp(margin, axis=1) > 0.0):
        for name, row in indices(a[claim], b[claim], mixed[claim]).items():
            values[name][claim] = row
    variables: dict[str, tuple] = {
        name: (("claim", "assumption"), array, {"units": "1", "long_name": phrase(name)})
        for name, array in values.items()
    }
    count = int(unknown.any(axis=0).sum())
    variables["unknown"] = ((), count, {"long_name": "machines without margins"})
    variables["machines"] = ((), margin.shape[1], {"long_name": "machines of the design"})
    coordinates = {"claim": found["claim"].values, "assumption": np.array(names, object)}
    return xr.Dataset(variables, coordinates)


def indices(a: np.ndarray, b: np.ndarray, mixed: np.ndarray) -> dict[str, np.ndarray]:
    """Both indices of one margin over k assumptions with their intervals, (k,) each.

    a, b: (n,); mixed: (k, n). An assumption that changes nothing has none of the variance, surely.
    """
    table = {"f_A": a[None], "f_B": b[None], "f_AB": mixed[:, None]}
    with warnings.catch_warnings(), seeded():
        warnings.simplefilter("ignore")  # the bootstrap of what changes nothing
        found = sobol_indices(func=table, n=a.size, rng=np.random.default_rng(SEED))
        spread = found.bootstrap(confidence_level=LEVEL, n_resamples=RESAMPLES)
    idle = (mixed == a).all(axis=1)
    values = {}
    for order in ORDERS:
        interval = getattr(spread, order).confidence_interval
        parts = ("", getattr(found, order)), ("_low", interval.low), ("_high", interval.high)
        for end, row in parts:
            values[f"{order}{end}"] = np.where(idle, 0.0, np.ravel(row))
    return values


@contextlib.contextmanager
def seeded() -> Iterator[None]:
    """Have NumPy's global draws be the same each time: this bootstrap takes no generator."""
    state = np.random.get_state()  # noqa: NPY002
    np.random.seed(SEED)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(state)  # noqa: NPY002


def phrase(name: str) -> str:
    """What an index or an end of its interval is, in words."""
    order, _, end = name.partition("_order")
    how = {"first": "by this assumption alone", "total": "with this assumption's interactions"}
    text = f"share of the margin's variance {how[order]}"
    return text + (f", {end[1:]} end of its 95 % interval" if end else "")


def design_parts(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Where the parts A, B and A with each column of B stand in a `saltelli` design.

    columns: (machines, k). Gives positions of the shapes (n,), (n,), (k, n); None where the columns
    are no such design.
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
    return np.arange(n), np.arange(n, 2 * n), mixed

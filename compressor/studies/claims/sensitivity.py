"""Which assumption decides which claim: variance-based sensitivities of the margins."""

import numpy as np
import xarray as xr

from compressor.analysis import saltelli_design
from compressor.studies.claims.study import ClaimsError

CUT = 1.0  # margins beyond this are cut: how far beyond decides no claim
ORDERS = ("first_order", "total_order")


def sensitivity(found: xr.Dataset) -> xr.Dataset | None:
    """Return Sobol's indices of each claim's margin over the swept assumptions; None without the
    design.

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
    columns = np.stack([found[name].values for name in names], axis=1) if names else None
    design = None if columns is None else saltelli_design(columns)
    if design is None:
        return None
    if (found["status"] == "").any():
        raise ClaimsError("the study is not finished: run the same command again")
    margin = np.clip(found["margin"].transpose("claim", "machine").values, -CUT, CUT)
    unknown = np.isnan(margin)
    middle = np.nanmedian(margin, axis=1, keepdims=True)
    margin = np.where(unknown, middle, margin)
    shape = (len(found["claim"]), len(names))
    values = {
        f"{order}{end}": np.full(shape, np.nan) for order in ORDERS for end in ("", "_low", "_high")
    }
    for claim in np.flatnonzero(np.ptp(margin, axis=1) > 0.0):
        for name, row in design.indices(margin[claim]).items():
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


def phrase(name: str) -> str:
    """Return what an index or an end of its interval is, in words."""
    order, _, end = name.partition("_order")
    how = {"first": "by this assumption alone", "total": "with this assumption's interactions"}
    text = f"share of the margin's variance {how[order]}"
    return text + (f", {end[1:]} end of its 95 % interval" if end else "")

"""What judged machines say, in words that are made of their numbers."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from compressor.analysis import saltelli_design
from compressor.cases import Case, value_in
from compressor.studies.claims.study import CLAIMS, ClaimsError

NAMES = {
    "apart": "flight and impact", "hit": "10° windows that are hit",
    "energy_angle": "the angle of the force's energy", "active": "the time in vibration",
}  # fmt: skip
WORDS = {
    "static": "static friction", "dynamic": "dynamic friction", "stiffness": "contact stiffness",
    "damping": "contact damping",
}  # fmt: skip
MASSES = ("machine.rod_mass_kg", "machine.reciprocating_mass_kg")


class Flips(NamedTuple):
    """Pairs of neighbours of a grid where a claim holds at one alone.

    `pairs`: all neighbours that were judged; `flips`: of these; `within`: of those, pairs with a
    margin within its error; `jump`: the median change of the margin between all neighbours.
    """

    pairs: int
    flips: int
    within: int
    jump: float


def flips(found: xr.Dataset, claim: int) -> Flips:
    """Return the `Flips` of a claim over a grid of machines."""
    one = found.sel(claim=claim)
    margin, error = one["margin"], one["error"]
    counts, jumps = [0, 0, 0], []
    for dim in margin.dims:
        a, b = (margin.isel({dim: part}).values for part in (slice(None, -1), slice(1, None)))
        ea, eb = (error.isel({dim: part}).values for part in (slice(None, -1), slice(1, None)))
        known = ~(np.isnan(a) | np.isnan(b))
        turned = known & ((a >= 0.0) != (b >= 0.0))
        doubtful = turned & ((np.abs(a) <= ea) | (np.abs(b) <= eb))
        counts = [
            n + int(more.sum()) for n, more in zip(counts, (known, turned, doubtful), strict=True)
        ]
        jumps.append(np.abs(a - b)[known])
    pairs, turned_over, within = counts
    return Flips(pairs, turned_over, within, float(np.median(np.concatenate(jumps))))


def is_mass_plane(found: xr.Dataset) -> bool:
    """Return whether machines are a grid over rod mass and reciprocating mass alone."""
    keys = [found[dim].attrs.get("case_key") for dim in found["status"].dims if dim in found.coords]
    return {*keys} == {*MASSES} and len(keys) == found["status"].ndim


def count_claims(found: xr.Dataset) -> tuple[int, dict[int, int], int]:
    """Return the numbers of machines: judged, by claim that holds, and with all holding."""
    held = found["held"].transpose("claim", ...).values.reshape(len(CLAIMS), -1)
    judged = held[:, (held >= 0).all(axis=0)]
    each = dict(zip(CLAIMS, (judged == 1).sum(axis=1).tolist(), strict=True))
    return judged.shape[1], each, int((judged == 1).all(axis=0).sum())


def summary(found: xr.Dataset) -> Iterator[str]:
    """Yield how many machines hold which claims, where, and how far claim 7 falls short."""
    judged, each, whole = count_claims(found)
    failed = int((found["status"] == "failed").sum())
    some = ", ".join(f"{claim} in {count}" for claim, count in each.items())
    yield f"Of {judged} machines each claim holds in so many: {some}."
    if failed:
        many = "1 machine has" if failed == 1 else f"{failed} machines have"
        yield f"{many} no verdict, as a case failed."
    yield f"All eight claims hold in {whole or 'none'} of them."
    yield from region(found)
    if not each[7]:
        best = found["margin"].sel(claim=7).max().item()
        yield (
            f"Claim 7 holds in none of these machines; the nearest one lacks {-100 * best:.2g} % "
            "of the revolution."
        )
    alone = ", ".join(
        f"{NAMES[str(name)]} in {int((found['share_margin'].sel(share=name) >= 0.0).sum())}"
        for name in found["share"].values
    )
    yield f"By one measure alone claim 7 would hold by {alone}."


def region(found: xr.Dataset) -> Iterator[str]:
    """Yield the ranges of the swept keys in which all claims hold, or all but claim 7."""
    held = found["held"] == 1
    for name, claims in (("All eight", CLAIMS), ("All but claim 7", (1, 2, 3, 4, 5, 6, 8))):
        all_hold = held.sel(claim=[*claims]).all("claim")
        count = int(all_hold.sum())
        if not count:
            continue
        ranges = []
        for key, coordinate in found.variables.items():  # in the order in which they were swept
            if "case_key" not in coordinate.attrs or coordinate.dtype == object:
                continue
            inside = found[key].where(all_hold)
            unit = coordinate.attrs.get("units", "").removeprefix("1")
            low, high = float(inside.min()), float(inside.max())
            ranges.append(
                f"{coordinate_in_words(str(key))} from {low:.3g} to {high:.3g} {unit}".rstrip()
            )
        yield f"{name} hold in {count}, with {', '.join(ranges)}."
        return


class Consistent(NamedTuple):
    """A machine of a mass plane (kg), and the least margin of some claims there and around it."""

    rod_mass: float
    reciprocating_mass: float
    least: float
    claims: tuple[int, ...]


def most_consistent(found: xr.Dataset) -> Consistent:
    """Return the place on the mass plane at which most claims hold, at its neighbours too.

    The place has the greatest least margin. Claims 1 and 2, which do not depend on masses, are left
    aside, and so are claims that hold at no machine. Machines at the plane's edge are not chosen.
    """
    rod, mass = (
        next(str(dim) for dim in found["status"].dims if found[dim].attrs["case_key"] == key)
        for key in MASSES
    )
    claims = tuple(c for c in CLAIMS[2:] if (found["held"].sel(claim=c) == 1).any())
    margin = found["margin"].sel(claim=[*claims]).min("claim").fillna(-np.inf)
    around = margin.rolling({rod: 3, mass: 3}, center=True).min()
    best = around.isel(around.fillna(-np.inf).argmax(...))
    return Consistent(float(best[rod]), float(best[mass]), float(best), claims)


def consistency(found: xr.Dataset) -> str:
    """Return the most consistent machine of a mass plane, in words."""
    best = most_consistent(found)
    names = ", ".join(map(str, best.claims))
    where = (
        f"rod mass {best.rod_mass:.3g} kg and reciprocating mass {best.reciprocating_mass:.3g} kg"
    )
    if best.least < 0.0:
        return f"Nowhere claims {names} hold at a machine and all around it; nearest is {where}."
    return (
        f"The most consistent machine has {where}: there and at all neighbours claims {names} hold "
        f"by {100 * best.least:.2g} % or more."
    )


def rank_assumptions(table: xr.Dataset) -> Iterator[str]:
    """Yield the assumption that has most of each margin's variance, of `sensitivity`."""
    names = [coordinate_in_words(str(name)) for name in table["assumption"].values]
    for claim in table["claim"].values.tolist():
        one = table.sel(claim=claim)
        total = one["total_order"].values
        if np.isnan(total).all():
            yield f"Claim {claim}: its margin is the same at all machines."
            continue
        order = np.argsort(-total)
        top = int(order[0])
        strongest = f"{names[top]}, {share(one, top)}"
        rivals = [
            names[n] for n in order[1:].tolist()
            if one["total_order_high"].values[n] >= one["total_order_low"].values[top]
        ]  # fmt: skip
        tail = f"; not distinguishable from {', '.join(rivals)}" if rivals else ""
        yield f"Claim {claim}: most by {strongest}{tail}."


def share(one: xr.Dataset, place: int) -> str:
    """Return a total index with its interval."""
    value, low, high = (
        float(one[f"total_order{end}"].values[place]) for end in ("", "_low", "_high")
    )
    return f"{value:.2f} [{low:.2f}, {high:.2f}]"


def change(found: xr.Dataset) -> Iterator[str]:
    """Yield whether a search found a machine at which all claims hold, as of `least_change`."""
    best = found.isel(machine=0)
    margin, sure = best["margin"].values, best["margin"].values - best["error"].values
    holding, known = int((margin >= 0.0).sum()), int((sure >= 0.0).sum())
    machines = int(found.attrs["looked"])
    if (sure >= 0.0).all():
        which = "with the least change" if found.attrs["least"] else "with these changes"
        yield (
            f"All eight claims hold, each beyond its error, at a machine {which} that a directed "
            f"search found among {machines}: {changes(best)}."
        )
    elif holding == margin.size:
        yield (
            f"Among {machines} machines that a directed search looked at, the best holds all eight "
            f"claims, but only {known} of them beyond their errors: {changes(best)}."
        )
    else:
        yield (
            "No machine was found at which all eight claims hold, among "
            f"{machines} that a directed search looked at. The one that lacks least: "
            f"{changes(best)}; there {holding} claims hold, {known} of them beyond their errors."
        )
    margins = ", ".join(
        f"{claim} {100 * m:+.3g} % ± {100 * e:.2g} %"
        for claim, m, e in zip(CLAIMS, margin.tolist(), best["error"].values.tolist(), strict=True)
    )
    yield f"Its margins: {margins}."


def changes(machine: xr.Dataset) -> str:
    """Return the values of a machine that are not the defaults, in words."""
    defaults = Case.from_values({}).values()
    parts = []
    for name, coordinate in machine.coords.items():
        key = coordinate.attrs.get("case_key", "")
        default = value_in(defaults, key) if key else None
        if isinstance(default, int | float) and float(coordinate) != float(default):
            unit = coordinate.attrs.get("units", "").removeprefix("1")
            parts.append(
                f"{coordinate_in_words(str(name))} {float(coordinate):.4g} {unit}".rstrip()
                + f" (not {default:g})"
            )
    return ", ".join(parts) or "nothing"


def coordinate_in_words(name: str) -> str:
    """Return a coordinate's name in words, without its unit."""
    words = name.split("_")
    units = {"kg", "mm", "per", "s", "N", "MPa", "rpm", "mm15"}
    while len(words) > 1 and words[-1] in units:
        words.pop()
    return WORDS.get(words[0], " ".join(words))


CUT = 1.0  # margins beyond this are cut: how far beyond decides no claim
ORDERS = ("first_order", "total_order")


def sensitivity(found: xr.Dataset) -> xr.Dataset | None:
    """Return Sobol's indices of each claim's margin over the swept assumptions.

    None without the design.

    found: of `judge_machines` on a study drawn by `saltelli`. `first_order` and `total_order` over
    (claim, assumption), with `_low` and `_high`, the ends of the 95 % bootstrap interval, by
    SciPy's sobol_indices (Saltelli et al., Computer Physics Communications 181, 2010). nan where a
    margin is the same at all machines. Margins are cut at ± 1. A machine without margins counts as
    the median one; `machines` and `unknown` are how many there are. Raises ClaimsError where
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
    """Return an index, or an end of its interval, in words."""
    order, _, end = name.partition("_order")
    meanings = {"first": "by this assumption alone", "total": "with this assumption's interactions"}
    text = f"share of the margin's variance {meanings[order]}"
    return text + (f", {end[1:]} end of its 95 % interval" if end else "")


def sentences(found: xr.Dataset) -> Iterator[str]:
    """Yield the findings of a file of judged machines."""
    if "looked" in found.attrs:
        yield from change(found)
        return
    yield from summary(found)
    if is_mass_plane(found) and min(found["status"].shape) > 2:
        yield consistency(found)
    table = sensitivity(found)
    if table is not None:
        yield from rank_assumptions(table)

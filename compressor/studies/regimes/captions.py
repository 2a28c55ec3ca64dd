"""Captions of a regimes study: what a machine that is followed along a parameter was seen to do.

The Dataset is that of a regimes study: `attrs["over"]` names the coordinate that was followed. "up"
is read from the least to the greatest of its values, "down" the other way.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from compressor.analysis import plural

PERIOD_1 = "period 1"
MAX_SPANS = 4  # of values that are listed; of more the first and the last


class SeenValue(NamedTuple):
    """A value on the way, the regime found there, and its largest exponent (1/rev) with error."""

    value: float
    regime: str
    exponent: float
    error: float

    @property
    def parts(self) -> bool:
        """Return whether close motions part: an exponent above 0 by more than its error."""
        return self.exponent - self.error > 0.0


def seen_values(chain: xr.Dataset) -> list[SeenValue]:
    """Return the values of one direction in its order, without those that failed."""
    over, found = chain.attrs["over"], []
    for i in np.argsort(chain[over].values, kind="stable"):
        one = chain.isel({over: i})
        regime = regime_of(one)
        if regime:
            exponent, error = (float(one[f"lyapunov_exponent{end}"]) for end in ("", "_error"))
            found.append(SeenValue(float(one[over]), regime, exponent, error))
    return found[::-1] if str(chain["direction"].values) == "down" else found


def regime_of(one: xr.Dataset) -> str:
    """Return the regime at one value in words: period n, chaotic, undecided.

    "" where there is none.
    """
    word = str(one["regime"].values)
    if str(one["status"].values) != "ok" or word != "periodic":
        return word if str(one["status"].values) == "ok" else ""
    period = float(one["period"])
    return f"period {period:g}" if np.isfinite(period) else "undecided"


def bifurcation(pair: xr.Dataset) -> str:
    """Describe one chain or both directions: regimes, exponents, where up and down differ.

    pair: dims direction, the followed one, and the variables' own.
    """
    over = pair.attrs["over"]
    values, unit = pair[over].values, unit_of(pair)
    sentences = [
        f"Poincaré points at {pair.attrs['section_deg']:g}° of the crank over "
        f"{phrase_of(pair, over)}, {plural(values.size, 'value')} from {number(values.min())} to "
        f"{number(values.max())}{unit}."
    ]
    for direction in pair["direction"].values:
        seen = seen_values(pair.sel(direction=direction))
        way = str(direction).capitalize()
        sentences += [f"{way}: {course(seen, unit)}", describe_exponent(seen, unit)]
    return " ".join([*sentences, *directions(pair), *failures(pair)])


def course(values: Sequence[SeenValue], unit: str) -> str:
    """Describe where period 1 is lost and comes back, and how often each regime was found."""
    regimes = [one.regime for one in values]
    if not values:
        return "no value has a result."
    if {*regimes} == {PERIOD_1}:
        return f"period 1 at all {plural(len(values), 'value')}."
    first = regimes.index(PERIOD_1) if PERIOD_1 in regimes else None
    changes = [i for i in range(1, len(values)) if regimes[i - 1] == PERIOD_1 != regimes[i]]
    counts = (f"{regime} at {count}" for regime, count in Counter(regimes).most_common())
    counted = f"of {plural(len(values), 'value')} {', '.join(counts)}"
    if first is None:
        return f"nowhere period 1; {counted}."
    begins = "" if first == 0 else f"period 1 first at {number(values[first].value)}{unit}; "
    if not changes:
        return f"{begins}it is kept to the end; {counted}."
    lost = values[changes[0]]
    back = PERIOD_1 in regimes[changes[0] :]
    later = values[changes[0] + regimes[changes[0] :].index(PERIOD_1)].value if back else 0.0
    returns = f", found again at {number(later)}{unit}" if back else " and not found again"
    return (
        f"{begins}period 1 is lost at {number(lost.value)}{unit}, to {lost.regime}{returns}; "
        f"{counted}."
    )


def describe_exponent(values: Sequence[SeenValue], unit: str) -> str:
    """Describe where the largest exponent is first surely above 0, or how near it came."""
    known = [one for one in values if np.isfinite(one.exponent)]
    if not known:
        return "No Lyapunov exponent is known."
    for one in known:
        if one.parts:
            return f"Its exponent is positive first at {number(one.value)}{unit}: {rate(one)}."
    top = max(known, key=lambda one: one.exponent)
    return (
        f"Its exponent is nowhere above 0 by more than its error: at most {rate(top)}, at "
        f"{number(top.value)}{unit}."
    )


def directions(pair: xr.Dataset) -> list[str]:
    """Describe whether up and down differ, where, and whether second attractors were confirmed."""
    if pair.sizes["direction"] < 2 or "differs" not in pair:
        return []
    over, unit = pair.attrs["over"], unit_of(pair)
    both = (pair["status"] == "ok").all("direction").values
    differs, confirmed = ((pair[name].values == 1) & both for name in ("differs", "confirmed"))
    if not both.any():
        return ["No value was reached by both."]
    if not differs.any():
        return [f"Up and down agree at all {plural(int(both.sum()), 'value')} that both reached."]
    sure, unsure = differs & confirmed, differs & ~confirmed
    texts, reached = [], plural(int(both.sum()), "value")
    if sure.any():
        texts.append(
            f"Up and down end in different motions at {int(sure.sum())} of {reached} that both "
            f"reached, {spans(pair[over].values, sure)}{unit}: a second attractor, confirmed by "
            "direct simulation."
        )
    if unsure.any():
        texts.append(
            f"At {int(unsure.sum())} of {reached}, {spans(pair[over].values, unsure)}{unit}, their "
            "numbers differ, but further simulation reached no second motion."
        )
    return texts


def failures(pair: xr.Dataset) -> list[str]:
    """Describe how many values failed, and why."""
    failed = pair["status"].values == "failed"
    if not failed.any():
        return []
    reasons = Counter(map(str, pair["reason"].values[failed])).most_common()
    text = ", ".join(f"{reason} ({count})" for reason, count in reasons)
    return [f"{plural(int(failed.sum()), 'run')} failed: {text}."]


def sections(shown: xr.Dataset, count: int) -> str:
    """Describe Poincaré sections at some of `count` values: the regime at each."""
    over, unit = shown.attrs["over"], unit_of(shown)
    texts = []
    for i in range(shown.sizes[over]):
        one = shown.isel({over: i})
        each = {str(d): regime_of(one.sel(direction=d)) for d in one["direction"].values}
        words = {word for word in each.values() if word}
        text = words.pop() if len(words) == 1 else ", ".join(
            f"{word} {direction}" for direction, word in each.items() if word
        )  # fmt: skip
        texts.append(f"{number(float(one[over]))}{unit} {text}")
    return (
        f"Once a revolution, at {shown.attrs['section_deg']:g}° of the crank: the journal's place "
        f"along the cylinder and its rate, at {len(texts)} of {count} values of "
        f"{phrase_of(shown, over)}, evenly among the regimes found: {'; '.join(texts)}."
    )


def periods(plane: xr.Dataset, other: str) -> str:
    """Describe a period map over the followed parameter and another: the share of each regime."""
    over = plane.attrs["over"]
    sentences = [
        f"Regimes over {phrase_of(plane, over)} ({plane.sizes[over]} values, followed) and "
        f"{phrase_of(plane, other)} ({plane.sizes[other]})."
    ]
    cells = plane.sizes[over] * plane.sizes[other]
    for direction in plane["direction"].values:
        chain = plane.sel(direction=direction)
        places = [(i, j) for i in range(plane.sizes[over]) for j in range(plane.sizes[other])]
        found = Counter(regime_of(chain.isel({over: i, other: j})) for i, j in places)
        texts = [f"{regime} at {n}" for regime, n in found.most_common() if regime]
        failed = int((chain["status"] == "failed").sum())
        texts += [f"failed at {failed}"] if failed else []
        unseen = cells - failed - sum(n for regime, n in found.items() if regime)
        texts += [f"not run at {unseen}"] if unseen else []
        sentences.append(f"{str(direction).capitalize()}, of {cells}: {', '.join(texts)}.")
    return " ".join(sentences)


def spans(values: np.ndarray, marked: np.ndarray) -> str:
    """Return the marked values as spans of neighbours, in rising order: 0.1, 0.3 to 0.5."""
    order = np.argsort(values, kind="stable")
    values, marked = values[order], marked[order]
    edges = np.flatnonzero(np.diff(np.concatenate(([0], marked.astype(int), [0]))))
    pairs = [(values[a], values[b - 1]) for a, b in edges.reshape(-1, 2)]
    if len(pairs) > MAX_SPANS:
        return f"between {number(pairs[0][0])} and {number(pairs[-1][1])}"
    return ", ".join(
        number(low) if low == high else f"{number(low)} to {number(high)}" for low, high in pairs
    )


def rate(one: SeenValue) -> str:
    """Return an exponent with its error, where that is known."""
    if not (np.isfinite(one.error) and one.error > 0.0):
        return f"{one.exponent:.3g} a revolution"
    places = max(0, 1 - math.floor(math.log10(one.error)))
    return f"{one.exponent:.{places}f} ± {one.error:.{places}f} a revolution"


def phrase_of(data: xr.Dataset, name: str) -> str:
    """Return a coordinate's phrase for a sentence."""
    return str(data[name].attrs.get("long_name") or data[name].attrs.get("case_key", name))


def unit_of(data: xr.Dataset) -> str:
    """Return the unit of the followed parameter with a space before it, "" where it has none."""
    unit = data[data.attrs["over"]].attrs.get("units", "")
    return f" {unit}" if unit not in ("", "1") else ""


def number(value: float) -> str:
    """Return a parameter's value in few digits."""
    return f"{value:.4g}"


# functions of the data: of a chain pair; of some values of it and how many there are; of a plane
# and the name of its other parameter
CAPTIONS: dict[str, Callable[..., str]] = {
    "bifurcation": bifurcation,
    "sections": sections,
    "periods": periods,
}

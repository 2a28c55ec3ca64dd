"""Figures of a regimes study: which of its chains and values are drawn, and why there are none."""

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from compressor.reasons import remedy
from compressor.report import (
    Drawing,
    PlotChoice,
    PlotError,
    Plotted,
    choose_figures,
    publish_drawings,
    shown_value,
)
from compressor.store import Folder
from compressor.studies.regimes.captions import CAPTIONS
from compressor.studies.regimes.dataset import open_regimes
from compressor.studies.regimes.figures import draw_bifurcation, draw_periods, draw_sections

MAX_SECTIONS = 6


def write(results: Folder, name: str, output: Folder, choice: PlotChoice) -> Iterator[Plotted]:
    """Draw a stored regimes study into files named after it; yield what was written.

    Raises PlotError where there is nothing to draw; StoreError where files cannot be written.
    """
    named = open_regimes(results, name).assign_attrs(study=name)
    title = named.attrs.get("title", "")
    yield from publish_drawings(regime_figures(named, choice), output, name, choice, title)


def regime_figures(dataset: xr.Dataset, choice: PlotChoice) -> Iterator[tuple[str, str, Drawing]]:
    """Yield the names, captions and drawings of a regimes study: bifurcation, sections, periods.

    dataset: dims of the study's other axes, `direction`, the followed one and the variables' own.
    Bifurcation and sections are of one machine: other axes have their first values, or those of
    `choice.at`. The period map is over one of them, `choice.over` or the first; it is left out
    where there is none. Raises PlotError where there is nothing to draw.
    """
    study = f"study {dataset.attrs.get('study', '')} of regimes".replace("  ", " ")
    figures = choose_figures(choice.what, [*CAPTIONS], study)
    over, axes = dataset.attrs["over"], other_axes(dataset)
    fixed = fixed_values(dataset, axes, choice.at)
    if choice.over:
        axis_of(dataset, [over, *axes], choice.over)
    pair = at(dataset, fixed)
    for name in figures:
        if name == "periods":
            if not axes and not choice.what:
                continue
            other = map_axis(dataset, axes, choice, study)
            part = at(dataset, {axis: value for axis, value in fixed.items() if axis != other})
            check_any(part, study)
            caption = CAPTIONS[name](part, other)
            yield name, caption + describe_fixed_axes(fixed, leave=other), draw_periods(part, other)
        elif name == "sections":
            check_any(pair, study)
            shown = pair.isel({over: chosen_values(pair)})
            caption = CAPTIONS[name](shown, pair.sizes[over])
            yield name, caption + describe_fixed_axes(fixed), draw_sections(shown)
        else:
            check_any(pair, study)
            yield name, CAPTIONS[name](pair) + describe_fixed_axes(fixed), draw_bifurcation(pair)


def other_axes(dataset: xr.Dataset) -> list[str]:
    """Return the dims of a study's other axes."""
    own = ("direction", dataset.attrs["over"])
    return [str(dim) for dim in dataset["status"].dims if dim not in own]


def axis_of(dataset: xr.Dataset, axes: Sequence[str], name: str) -> str:
    """Return the dim of an axis that is meant by its name, key, or the end of its key."""
    keys = {axis: str(dataset[axis].attrs.get("case_key", axis)) for axis in axes}
    found = [axis for axis, key in keys.items() if name in (axis, key) or key.endswith(f".{name}")]
    if len(found) != 1:
        problem = f"no axis {name!r}" if not found else f"several axes {name!r}"
        listed = ", ".join(keys.values()) or "none"
        raise PlotError(f"the study has {problem} to choose: its axes are {listed}")
    return found[0]


def fixed_values(dataset: xr.Dataset, axes: Sequence[str], chosen_at: Sequence[str]) -> dict:
    """Return the value of each other axis: the first, or as chosen by `key=value`."""
    fixed = {axis: dataset[axis].values[0] for axis in axes}
    for text in chosen_at:
        name, _, word = text.partition("=")
        axis = axis_of(dataset, axes, name)
        values = dataset[axis].values
        known = [value for value in values if word in (str(value), shown_value(value))]
        if not known:
            listed = ", ".join(map(shown_value, values))
            raise PlotError(f"--at {text}: the axis has {listed}")
        fixed[axis] = known[0]
    return fixed


def map_axis(dataset: xr.Dataset, axes: Sequence[str], choice: PlotChoice, study: str) -> str:
    """Return the second axis of the period map."""
    if not axes:
        raise PlotError(f"{study} follows one parameter: a period map needs another, swept")
    if not choice.over:
        return axes[0]
    found = axis_of(dataset, [dataset.attrs["over"], *axes], choice.over)
    return axes[0] if found == dataset.attrs["over"] else found


def at(dataset: xr.Dataset, fixed: dict) -> xr.Dataset:
    """Return the chains at some values of other axes."""
    over = dataset.attrs["over"]
    place = {axis: int(np.argmax(dataset[axis].values == value)) for axis, value in fixed.items()}
    return dataset.isel(place).transpose("direction", over, ...)


def describe_fixed_axes(fixed: dict, leave: str = "") -> str:
    """Describe the values of the other axes that a figure is of."""
    words = [f"{axis} {shown_value(value)}" for axis, value in fixed.items() if axis != leave]
    return f" Here {', '.join(words)}." if words else ""


def check_any(part: xr.Dataset, study: str) -> None:
    """Raise PlotError, with reasons and remedies, where no value has a result."""
    status = part["status"].values
    if ((status == "ok") & (part["regime"].values != "")).any():
        return
    failed = Counter(map(str, part["reason"].values[status == "failed"]))
    if not failed:
        raise PlotError(f"no value of {study} was run yet: run its case file")
    why = "; ".join(f"{reason} ({count}): {remedy(reason)}" for reason, count in failed.items())
    raise PlotError(f"no value of {study} can be drawn: all that were run failed: {why}")


def chosen_values(pair: xr.Dataset) -> list[int]:
    """Return up to `MAX_SECTIONS` values with Poincaré points, evenly among the regimes."""
    over = pair.attrs["over"]
    others = [dim for dim in pair["section"].dims if dim not in (over, "direction")]
    known = pair["section"].notnull().any(others) & (pair["status"] == "ok")
    way = int(known.any(over).values.argmax())  # the first that has points
    chain, has_points = pair.isel(direction=way), known.isel(direction=way).values
    by_regime: dict[tuple[str, float], list[int]] = {}
    for i in np.flatnonzero(has_points):
        word, period = str(chain["regime"].values[i]), float(chain["period"].values[i])
        label = (word, period if word == "periodic" else 0.0)
        by_regime.setdefault(label, []).append(int(i))
    groups = [*by_regime.values()]
    if len(groups) > MAX_SECTIONS:
        groups = [groups[i] for i in spread_places(len(groups), MAX_SECTIONS)]
    quota = [0] * len(groups)
    while sum(quota) < min(MAX_SECTIONS, sum(map(len, groups))):
        free = [i for i, group in enumerate(groups) if quota[i] < len(group)]
        quota[min(free, key=lambda i: quota[i])] += 1
    return sorted(
        group[i]
        for group, count in zip(groups, quota, strict=True)
        for i in spread_places(len(group), count)
    )


def spread_places(size: int, count: int) -> list[int]:
    """Return some of so many places, evenly: the middles of equal parts."""
    return [(2 * i + 1) * size // (2 * count) for i in range(count)]

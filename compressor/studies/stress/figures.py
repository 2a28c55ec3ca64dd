"""How extreme scenes ended: a map of outcomes over the planes of their parameters."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from compressor.reasons import Reason
from compressor.report import (
    BLACK,
    BLUE,
    GOLD,
    GREY,
    RED,
    Drawing,
    LineStyle,
    Panel,
    box,
    entry,
    make_grid,
    mark,
)

PLANES = (
    ("clearance", "stiffness"),
    ("friction", "stiction_velocity"),
    ("speed", "rod_mass"),
    ("rod_mass", "reciprocating_mass"),
    ("rtol", "damping"),
    ("exponent", "pin_radius"),
)
# reasons that are not named here are drawn as others
LOOKS = {
    "ok": mark(BLUE, "o", 2.2, 2.0, edge_width=0.0),
    "budget": mark(GOLD, "s", 2.8, 2.2, edge_width=0.0),
    Reason.PENETRATION_IMPLAUSIBLE: mark(GREY, "v", 3.2, 2.1, edge_width=0.0),
    Reason.ENERGY_AUDIT_FAILED: mark("#8c5fa8", "D", 3.0, 2.3, edge_width=0.0),
    "other failure": mark(BLACK, "^", 3.2, 2.4, edge_width=0.0),
    "unjudged": mark(RED, "x", 4.0, 2.5, edge_width=0.8),
    "silent_wrong": mark(RED, "*", 9.0, 2.6, edge_width=0.0),
}
UNDAMPED = 5e-3  # where scenes without damping are drawn


def draw_outcomes(study: xr.Dataset) -> Drawing:
    """Return a panel a plane of parameters, a mark a scene; the supported range is framed."""
    ends = np.array([*outcomes(study)], object)
    present = [name for name in LOOKS if (ends == name).any()]
    figure, _ = make_grid(2, 3, 6.6)
    for panel, names in zip(figure.panels, PLANES, strict=True):
        x, y = (coordinate(study, name) for name in names)
        for name in present:
            some = ends == name
            panel.plot(x[some], y[some], LOOKS[name], name.replace("_", " "))
        for scale, parameter in zip((panel.x, panel.y), names, strict=True):
            draw = describe_draw(study, parameter)
            unit = "times the paper's" if parameter == "damping" else draw["units"]
            scale.log = bool(draw["logarithmic"])
            scale.title = parameter.replace("_", " ") + ("" if unit == "1" else f" ({unit})")
            scale.margin = 0.03
        frame(panel, *(describe_draw(study, name) for name in names))
    for name in present:
        size = max(LOOKS[name].markersize, 4.0)
        look = replace(LOOKS[name], markersize=size, edge_width=1.0)
        text = f"{name.replace('_', ' ')} ({int((ends == name).sum())})"
        figure.legend.append(entry(text, look))
    return figure


def outcomes(study: xr.Dataset) -> Iterator[str]:
    """Yield the name in `LOOKS` of each scene's end."""
    for verdict, reason in zip(study["verdict"].values, study["reason"].values, strict=True):
        name = str(reason) if verdict == "failed" else str(verdict)
        if name.startswith("budget_"):
            name = "budget"
        yield name if name in LOOKS else "other failure"


def coordinate(study: xr.Dataset, name: str) -> np.ndarray:
    """Return a parameter of the scenes; of two clearances the smaller one."""
    if name == "clearance":
        return np.fmin(study["clearance_big_end"].values, study["clearance_small_end"].values)
    values = study[name].values
    return np.where(values > 0, values, UNDAMPED) if name == "damping" else values


def describe_draw(study: xr.Dataset, name: str) -> Mapping[str, Any]:
    """Return the draw of a parameter: the attributes of its variable in a campaign."""
    return study["clearance_big_end" if name == "clearance" else name].attrs


def frame(panel: Panel, first: Mapping[str, Any], second: Mapping[str, Any]) -> None:
    """Draw a rectangle around the supported range, where a plane has one."""
    if all(list(one["range"]) == list(one["supported_range"]) for one in (first, second)):
        return
    ends = first["supported_range"], second["supported_range"]
    panel.traces.append(box(*ends, LineStyle(BLACK, linewidth=1.0, zorder=3), "line"))

"""How extreme scenes ended: a map of outcomes over the planes of their parameters."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from compressor.reasons import Reason
from compressor.report import (
    BLACK,
    BLUE,
    GOLD,
    GREY,
    RED,
    in_style,
    legend_above,
    sheet,
)

PLANES = (
    ("clearance", "stiffness"),
    ("friction", "stiction_velocity"),
    ("speed", "rod_mass"),
    ("rod_mass", "reciprocating_mass"),
    ("rtol", "damping"),
    ("exponent", "pin_radius"),
)
# outcome: colour, marker, size, height; reasons that are not named here are drawn as others
LOOKS = {
    "ok": (BLUE, "o", 2.2, 2.0),
    "budget": (GOLD, "s", 2.8, 2.2),
    Reason.PENETRATION_IMPLAUSIBLE: (GREY, "v", 3.2, 2.1),
    Reason.ENERGY_AUDIT_FAILED: ("#8c5fa8", "D", 3.0, 2.3),
    "other failure": (BLACK, "^", 3.2, 2.4),
    "unjudged": (RED, "x", 4.0, 2.5),
    "silent_wrong": (RED, "*", 9.0, 2.6),
}
UNDAMPED = 5e-3  # where scenes without damping are drawn


@in_style
def draw_outcomes(study: xr.Dataset) -> Figure:
    """Return a panel a plane of parameters, a mark a scene; the supported range is framed."""
    ends = np.array([*outcomes(study)], object)
    figure, grid = sheet(2, 3, 6.6)
    for panel, (first, second) in zip(grid.flat, PLANES, strict=True):
        x, y = coordinate(study, first), coordinate(study, second)
        for name, (color, marker, size, height) in LOOKS.items():
            some = ends == name
            panel.plot(x[some], y[some], marker, color=color, markersize=size, zorder=height,
                       markeredgewidth=0.8 if marker == "x" else 0.0)  # fmt: skip
        for scale, parameter in ((panel.set_xscale, first), (panel.set_yscale, second)):
            scale("log" if describe_draw(study, parameter)["logarithmic"] else "linear")
        panel.set_xlabel(axis_label(study, first))
        panel.set_ylabel(axis_label(study, second))
        panel.margins(0.03)
        frame(panel, describe_draw(study, first), describe_draw(study, second))
    present = [name for name in LOOKS if (ends == name).any()]
    legend_above(figure, [handle(name, int((ends == name).sum())) for name in present])
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
    """Return how a parameter was drawn: the attributes of its variable in a campaign."""
    return study["clearance_big_end" if name == "clearance" else name].attrs


def axis_label(study: xr.Dataset, name: str) -> str:
    """Return a parameter's name and unit on an axis."""
    unit = {"damping": "times the paper's"}.get(name, describe_draw(study, name)["units"])
    return name.replace("_", " ") + ("" if unit == "1" else f" ({unit})")


def frame(panel: Axes, first: Mapping[str, Any], second: Mapping[str, Any]) -> None:
    """Draw a rectangle around the supported range, where a plane has one."""
    if all(list(one["range"]) == list(one["supported_range"]) for one in (first, second)):
        return
    (left, right), (low, high) = first["supported_range"], second["supported_range"]
    panel.add_patch(Rectangle((left, low), right - left, high - low, fill=False, zorder=3,
                              edgecolor=BLACK, linewidth=1.0))  # fmt: skip


def handle(name: str, count: int) -> Line2D:
    """Return what a mark means, and how many there are."""
    color, marker, size, _ = LOOKS[name]
    label = f"{name.replace('_', ' ')} ({count})"
    return Line2D([], [], color=color, marker=marker, linestyle="none", label=label,
                  markersize=max(size, 4.0))  # fmt: skip

"""The period of a machine's motion over two parameters: the one that was followed, and another."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from compressor.report import (
    BLACK,
    BLUE,
    GOLD,
    GREY,
    RED,
    legend_above,
    positions,
    sheet,
    styled,
)
from compressor.studies.regimes.figures import HATCH, axis_words, edges_of, scale_along

MOST_TICKS = 12
MOST_SINGLE = 4  # periods of a map that have a colour of their own
CLASSES = {
    "period 1": "#e3e9f3", "period 2": "#a5bfe3", "period 3": "#5c87c9", "period 4": BLUE,
    "period 5 to 16": GOLD, "chaotic": RED, "undecided": GREY, "failed": BLACK,
}  # fmt: skip


@styled
def draw_periods(plane: xr.Dataset, other: str) -> Figure:
    """Return the regime over the followed parameter and another one, a panel a direction.

    plane: dims direction, the followed one, `other`, and the variables' own.
    """
    over = plane.attrs["over"]
    directions = [str(one) for one in plane["direction"].values]
    figure, grid = sheet(1, len(directions), 4.8, sharey=True)
    for direction, panel in zip(directions, grid.flat, strict=True):
        chain = plane.sel(direction=direction).transpose(other, over, ...)
        x, y = positions(chain, over), positions(chain, other)
        plot_classes(panel, chain, x, y)
        panel.set_title(direction)
        panel.set_xlabel(axis_words(plane, over))
    if plane[other].dtype.kind not in "fiu":
        words = [str(word) for word in dict.fromkeys(plane[other].values)]
        grid[0, 0].set_yticks(range(len(words)), words)
    grid[0, 0].set_ylabel(axis_words(plane, other))
    found = np.unique(period_classes(plane))
    handles = [
        Patch(facecolor=color, edgecolor=BLACK, linewidth=0.4, label=name)
        for number, (name, color) in enumerate(CLASSES.items())
        if number in found
    ]
    if (found < 0).any():
        handles.append(Patch(label="not run", **HATCH))
    legend_above(figure, handles)
    return figure


def plot_classes(panel: Axes, chain: xr.Dataset, x: np.ndarray, y: np.ndarray) -> None:
    """The classes of one direction in their colours, dims (other, over)."""
    across, along = np.argsort(x, kind="stable"), np.argsort(y, kind="stable")
    classes = period_classes(chain)[np.ix_(along, across)]
    panel.patch.set(**HATCH)
    panel.pcolormesh(
        edges_of(x[across], chain.attrs["log"]), edges_of(y[along], False),
        np.ma.masked_less(classes, 0), cmap=ListedColormap([*CLASSES.values()]), vmin=-0.5,
        vmax=len(CLASSES) - 0.5, rasterized=True, edgecolors="white", linewidth=0.3,
    )  # fmt: skip
    scale_along(panel, x, chain.attrs["log"])
    if y.size <= MOST_TICKS:
        panel.set_yticks(y)
    panel.grid(visible=False)


def period_classes(data: xr.Dataset) -> np.ndarray:
    """Return the place in `CLASSES` of each value's regime; -1 where it was not run."""
    names, status = [*CLASSES], data["status"].values
    words, period = data["regime"].values, data["period"].values
    known = (words == "periodic") & np.isfinite(period)
    number = np.where(known, period, 1.0).astype(int)
    found = np.where(number <= MOST_SINGLE, number - 1, names.index("period 5 to 16"))
    found = np.where(known, found, names.index("undecided"))
    found = np.where(words == "chaotic", names.index("chaotic"), found)
    found = np.where(words == "", -1, found)
    return np.where(status == "failed", names.index("failed"), np.where(status == "ok", found, -1))

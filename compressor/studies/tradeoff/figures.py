"""Work and precision: error of acceleration over wall time, a panel a scene, a line a method."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from compressor.cases import ACCURACY
from compressor.report import (
    BLACK,
    BLUE,
    GOLD,
    RED,
    LineStyle,
    in_style,
    legend_above,
    sheet,
)

COLUMNS = 3
WORDS_ROOM = 4.0  # times left of the fastest point, for the words
MID, LIGHT = "#7d7d7d", "#ababab"
# compiled methods are solid and coloured, SciPy's grey and dashed
LOOKS: dict[str, tuple[LineStyle, str, str]] = {
    "auto": (LineStyle(BLUE, "-", 1.7, 3.2), "o", "auto (TSIT5)"),
    "DOPRI5": (LineStyle(RED, "-", 1.3, 3.1), "s", "DOPRI5"),
    "RODAS": (LineStyle(GOLD, "-", 1.6, 3.0), "D", "RODAS"),
    "DOP853": (LineStyle(BLACK, (0, (1, 1.2)), 1.2, 2.5), "^", "SciPy DOP853"),
    "RK45": (LineStyle(MID, (0, (4, 1.5)), 1.1, 2.4), "v", "SciPy RK45"),
    "LSODA": (LineStyle(BLACK, (0, (6, 1.5)), 1.0, 2.3), "<", "SciPy LSODA"),
    "Radau": (LineStyle(LIGHT, (0, (6, 1.2, 1.2, 1.2)), 1.3, 2.2), ">", "SciPy Radau"),
    "BDF": (LineStyle(MID, (0, (1, 1.2)), 1.2, 2.1), "p", "SciPy BDF"),
}
OTHER = (LineStyle(MID, "-", 1.0, 2.0), ".", "")
PAPER: dict[str, Any] = {"marker": "*", "color": BLACK, "markersize": 12, "linestyle": "none",
                         "markeredgecolor": "white", "zorder": 6}  # fmt: skip
TIER: dict[str, Any] = {"marker": "o", "markersize": 9.5, "markerfacecolor": "none",
                        "markeredgecolor": BLUE, "linestyle": "none", "zorder": 4}  # fmt: skip
UNKNOWN: dict[str, Any] = {"facecolor": "#f0f0f0", "edgecolor": "#c9c9c9", "hatch": "////",
                           "linewidth": 0.0, "zorder": 0}  # fmt: skip


@in_style
def draw_work_precision(study: xr.Dataset) -> Figure:
    """Return a panel a scene of a study of work and precision; the paper's own point is a star.

    Rings mark the tolerances behind the words of `accuracy`; in the hatched band the references
    themselves disagree.
    """
    count = study.sizes["scene"]
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    figure, grid = sheet(rows, columns, 4.1 * rows + 0.7, sharex=True, sharey=True)
    panels = list(grid.flat)
    for panel in panels[count:]:
        panel.remove()
    for panel in panels[:count]:  # shared limits follow the data of all
        panel.set_xscale("log")
        panel.set_yscale("log")
    for number, panel in enumerate(panels[:count]):
        one = study.isel(scene=number)
        plot_scene(panel, one)
        panel.set_title(str(one["scene"].item()).replace("_", " "))
        panel.tick_params(labelleft=number % columns == 0, labelbottom=number + columns >= count)
    ends = limits(study)
    for number, panel in enumerate(panels[:count]):
        panel.set_ylim(*ends)
        panel.set_xlim(study["seconds"].min().item() / WORDS_ROOM, panel.get_xlim()[1])
        apart = uncertainty(study.isel(scene=number))
        if apart > ends[0]:
            panel.axhspan(ends[0], apart, **UNKNOWN)
    figure.supxlabel("wall time of the solution (s)", fontsize="medium")
    figure.supylabel("relative L2 error of acceleration", fontsize="medium")
    legend_above(figure, handles([str(method) for method in study["method"].values]))
    return figure


def plot_scene(panel: Axes, one: xr.Dataset) -> None:
    """Draw a line a method, the rings of the tiers, and the paper's star."""
    for name in one["method"].values:
        line, marker, _ = LOOKS.get(str(name), OTHER)
        row = one.sel({"method": name})
        order = np.argsort(-row["tolerance"].values)
        panel.plot(
            row["seconds"].where(row["error_acceleration"].notnull()).values[order],
            row["error_acceleration"].values[order],
            marker=marker, markersize=3.8, **line.properties(),
        )  # fmt: skip
    if "auto" in one["method"].values:
        mark_tiers(panel, one.sel({"method": "auto"}))
    panel.plot(one["paper_seconds"].item(), one["paper_error_acceleration"].item(), **PAPER)
    panel.margins(0.06)


def mark_tiers(panel: Axes, row: xr.Dataset) -> None:
    """Draw a ring and the word where a tolerance has one."""
    for word, tier in ACCURACY.items():
        if tier.rtol in row["tolerance"].values:
            point = row.sel({"tolerance": tier.rtol})
            x, y = point["seconds"].item(), point["error_acceleration"].item()
            panel.plot(x, y, **TIER)
            panel.annotate(word, (x, y), (-11, -2), textcoords="offset points", ha="right",
                           va="top", fontsize=8.5, color=BLUE)  # fmt: skip


def uncertainty(one: xr.Dataset) -> float:
    """Return how far a scene's references lie apart in acceleration."""
    return float(one["reference_uncertainty"].sel(quantity="acceleration"))


def limits(study: xr.Dataset) -> tuple[float, float]:
    """Return the errors to be shown, with room for the band below which none is known."""
    names = ("error_acceleration", "paper_error_acceleration")
    found = np.concatenate([study[name].values.ravel() for name in names])
    found = found[np.isfinite(found) & (found > 0)]
    if not found.size:
        return 1e-10, 1.0
    return float(found.min()) / 5, float(found.max()) * 3


def handles(methods: list[str]) -> list[Any]:
    """Return what lines and marks mean."""
    lines = []
    for method in methods:
        line, marker, name = LOOKS.get(method, OTHER)
        lines.append(
            Line2D([], [], label=name or method, marker=marker, markersize=4.5, **line.properties())
        )
    return [
        *lines,
        Line2D([], [], label="the paper's numerics: BDF, 1e-5", **PAPER),
        Line2D([], [], label="a word of solve.accuracy", **TIER),
        Patch(label="the references disagree", **UNKNOWN),
    ]

"""Figures of campaigns: errors against tolerance and clearance, and what accuracy costs."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from compressor.report.figures.style import (
    BLACK,
    CYCLE,
    GREY,
    LineStyle,
    in_style,
    legend_above,
    sheet,
)

MARKERS = ("o", "s", "D")
GUIDE = LineStyle(GREY, (0, (1, 1.2)), 1.3, 1.5)
KNOWN = LineStyle(BLACK, (0, (4, 1.5)), 0.9, 1.4)
RUNGS = {
    "error_acceleration": "error of acceleration (L2)",
    "error_peak_acceleration": "error of its peak",
    "energy_residual": "energy residual",
}


@in_style
def draw_tolerance_ladder(ladder: xr.Dataset) -> Figure:
    """Return the relative errors and the energy residual against rtol, a line a scene.

    Dims (scene, tolerance); `RUNGS` are its variables, with `reference_uncertainty` (scene): the
    error of acceleration below which the references themselves disagree. Dotted: as the tolerance;
    for the residual its bound, `residual_bound` (tolerance).
    """
    figure, grid = sheet(1, len(RUNGS), 4.6, sharex=True)
    rtol = ladder["tolerance"].values
    for panel, (name, title) in zip(grid.flat, RUNGS.items(), strict=True):
        loglog(panel, title, "rtol")
        for number, one in enumerate(ladder["scene"].values):
            plot_line(panel, number, rtol, ladder[name].sel(scene=one).values)
        guide = ladder["residual_bound"].values if name == "energy_residual" else rtol
        panel.plot(rtol, guide, **GUIDE.properties())
        panel.invert_xaxis()
    worst = float(ladder["reference_uncertainty"].max())
    grid.flat[0].axhline(worst, **KNOWN.properties())
    meanings = {
        "as rtol; residual: its bound": GUIDE,
        "how far references lie apart, worst scene": KNOWN,
    }
    legend_above(figure, scene_handles(ladder) + line_handles(meanings))
    return figure


@in_style
def draw_scaled_limit(limit: xr.Dataset) -> Figure:
    """Return greatest |x - x_ideal| against clearance, the contact scaled along; a line a scene.

    Dims (scene, clearance), m; variable `deviation`, m. Right: the same over the clearance.
    """
    figure, grid = sheet(1, 2, 4.6)
    clearance = limit["clearance"].values
    left, right = grid.flat
    loglog(left, "greatest |x − x_ideal| (m)", "clearance (m)")
    loglog(right, "the same over the clearance", "clearance (m)")
    for number, one in enumerate(limit["scene"].values):
        deviation = limit["deviation"].sel(scene=one).values
        plot_line(left, number, clearance, deviation)
        plot_line(right, number, clearance, deviation / clearance)
    left.plot(clearance, clearance, **GUIDE.properties())
    right.set_ylim(0.5, 10 ** np.ceil(np.log10(right.get_ylim()[1])))
    legend_above(figure, scene_handles(limit) + line_handles({"slope 1": GUIDE}))
    return figure


def loglog(panel: Axes, title: str, along: str) -> None:
    """Logarithmic axes with room around the points."""
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.margins(0.06)
    panel.set_title(title)
    panel.set_xlabel(along)


def plot_line(panel: Axes, number: int, x: np.ndarray, y: np.ndarray) -> None:
    """The line of a scene, by its number."""
    look = CYCLE[number % len(CYCLE)].properties()
    panel.plot(x, y, marker=MARKERS[number % len(MARKERS)], markersize=4.2, **look)


def scene_handles(data: xr.Dataset) -> list[Line2D]:
    """Return what the lines of the scenes mean."""
    return [
        Line2D([], [], label=str(name).replace("_", " "), marker=MARKERS[i % len(MARKERS)],
               markersize=4.5, **CYCLE[i % len(CYCLE)].properties())
        for i, name in enumerate(data["scene"].values)
    ]  # fmt: skip


def line_handles(meanings: dict[str, LineStyle]) -> list[Line2D]:
    """Return what guiding lines mean."""
    return [Line2D([], [], label=text, **line.properties()) for text, line in meanings.items()]


PROMISED = LineStyle(GREY, "--", 1.2, 1.0)
SHOWN = {
    "markersize": 2.2,
    "linestyle": "none",
    "marker": "o",
    "rasterized": True,
    "markeredgewidth": 0.0,
}


@in_style
def draw_kept_error(cases: xr.Dataset) -> Figure:
    """Return the error of acceleration against the time that its run took with its check, a colour
    a word.

    Dims (word, case): `seconds`, and `error`, relative L2 after settling, nan where a run did not
    say `kept`; `promise` (word). Large: both medians. Dashed: the promise.
    """
    figure, grid = sheet(1, 1, 6.0)
    (panel,) = grid.flat
    loglog(panel, "error of acceleration, relative L2", "time of a run with its check (ms)")
    for number, word in enumerate(cases["word"].values):
        one = cases.sel(word=word)
        kept = one["error"].notnull() & (one["error"] > 0)
        milliseconds, error = 1e3 * one["seconds"][kept].values, one["error"][kept].values
        colour = CYCLE[number % len(CYCLE)].color
        panel.plot(milliseconds, error, color=colour, **SHOWN)
        middle = np.median(milliseconds), np.median(error)
        panel.plot(*middle, "D", color=colour, markeredgecolor="white", markersize=10, label=word)
        panel.axhline(float(one["promise"]), color=colour, linestyle="--", linewidth=1.2)
    handles, _ = panel.get_legend_handles_labels()
    figure.legend(
        handles=handles + line_handles({"its promise": PROMISED}), loc="outside upper center",
        ncols=len(handles) + 1,
    )  # fmt: skip
    return figure

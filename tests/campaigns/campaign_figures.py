"""Figures of campaigns: errors against tolerance and clearance, and what accuracy costs."""

from dataclasses import replace

import numpy as np
import xarray as xr

from compressor.report.figures.drawing import Drawing, Note, Panel, entry, make_grid
from compressor.report.figures.style import BLACK, CYCLE, GREY, LineStyle, mark

MARKERS = ("o", "s", "D")
GUIDE = LineStyle(GREY, (0, (1, 1.2)), 1.3, 1.5)
KNOWN = LineStyle(BLACK, (0, (4, 1.5)), 0.9, 1.4)
RUNGS = {
    "error_acceleration": "error of acceleration (L2)",
    "error_peak_acceleration": "error of its peak",
    "energy_residual": "energy residual",
}


def draw_tolerance_ladder(ladder: xr.Dataset) -> Drawing:
    """Return the relative errors and the energy residual against rtol, a line a scene.

    Dims (scene, tolerance); `RUNGS` are its variables, with `reference_uncertainty` (scene): the
    error of acceleration below which the references themselves disagree. Dotted: as the tolerance;
    for the residual its bound, `residual_bound` (tolerance).
    """
    figure, _ = make_grid(1, len(RUNGS), 4.6)
    rtol = ladder["tolerance"].values
    for panel, (name, title) in zip(figure.panels, RUNGS.items(), strict=True):
        scale_logs(panel, title, "rtol")
        for number, one in enumerate(ladder["scene"].values):
            plot_scene(panel, number, one, rtol, ladder[name].sel(scene=one).values)
        guide = ladder["residual_bound"].values if name == "energy_residual" else rtol
        panel.plot(rtol, guide, GUIDE, "as rtol; residual: its bound")
        panel.x.span(*panel.limits("x")[::-1])
    worst = float(ladder["reference_uncertainty"].max())
    figure.panels[0].notes.append(Note(y=worst, style=KNOWN))
    known = entry("how far references lie apart, worst scene", KNOWN)
    figure.legend = [*figure.panels[0].traces, known]
    return figure


def draw_scaled_limit(limit: xr.Dataset) -> Drawing:
    """Return greatest |x - x_ideal| against clearance, the contact scaled along; a line a scene.

    Dims (scene, clearance), m; variable `deviation`, m. Right: the same over the clearance.
    """
    figure, _ = make_grid(1, 2, 4.6)
    clearance = limit["clearance"].values
    left, right = figure.panels
    scale_logs(left, "greatest |x − x_ideal| (m)", "clearance (m)")
    scale_logs(right, "the same over the clearance", "clearance (m)")
    for number, one in enumerate(limit["scene"].values):
        deviation = limit["deviation"].sel(scene=one).values
        plot_scene(left, number, one, clearance, deviation)
        plot_scene(right, number, one, clearance, deviation / clearance)
    left.plot(clearance, clearance, GUIDE, "slope 1")
    right.y.span(0.5, 10 ** np.ceil(np.log10(right.limits("y")[1])))
    figure.legend = left.traces
    return figure


def scale_logs(panel: Panel, title: str, along: str) -> None:
    """Logarithmic axes with room around the points."""
    for scale in (panel.x, panel.y):
        scale.log, scale.margin = True, 0.06
    panel.title, panel.x.title = title, along


def plot_scene(panel: Panel, number: int, name: str, x: np.ndarray, y: np.ndarray) -> None:
    """Draw the line of a scene, styled by its number."""
    marker = MARKERS[number % len(MARKERS)]
    style = replace(CYCLE[number % len(CYCLE)], marker=marker, markersize=4.2)
    panel.plot(x, y, style, name.replace("_", " "))


PROMISED = LineStyle(GREY, (0, (3.7, 1.6)), 1.2, 1.0)


def draw_kept_error(cases: xr.Dataset) -> Drawing:
    """Return the error of acceleration against the time that its run took with its check, a colour
    a word.

    Dims (word, case): `seconds`, and `error`, relative L2 after settling, nan where a run did not
    say `kept`; `promise` (word). Large: both medians. Dashed: the promise.
    """
    figure, grid = make_grid(1, 1, 6.0)
    panel = grid[0, 0]
    scale_logs(panel, "error of acceleration, relative L2", "time of a run with its check (ms)")
    for number, word in enumerate(cases["word"].values):
        one = cases.sel(word=word)
        kept = one["error"].notnull() & (one["error"] > 0)
        milliseconds, error = 1e3 * one["seconds"][kept].values, one["error"][kept].values
        color = CYCLE[number % len(CYCLE)].color
        dots = mark(color, "o", 2.2, edge_width=0.0)
        panel.plot(milliseconds, error, dots)
        middle = mark(color, "D", 10, edge="#ffffff")
        panel.plot(np.median(milliseconds), np.median(error), middle, word)
        promise = replace(PROMISED, color=color, zorder=2)
        panel.notes.append(Note(y=float(one["promise"]), style=promise))
    figure.legend = [one for one in panel.traces if one.name]
    figure.legend.append(entry("its promise", PROMISED))
    return figure

"""What accuracy costs and keeps: the trade that its words offer, over many cases."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from compressor.report.figures.ladders import line_handles, loglog
from compressor.report.figures.style import CYCLE, GREY, LineStyle, in_style, sheet

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

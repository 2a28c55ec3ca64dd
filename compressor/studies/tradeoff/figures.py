"""Work and precision: error of acceleration over wall time, a panel a scene, a line a method."""

from pathlib import Path

import numpy as np
import xarray as xr

from compressor.cases import ACCURACY
from compressor.report import (
    BLACK,
    BLUE,
    GOLD,
    Drawing,
    LineStyle,
    Note,
    Panel,
    box,
    entry,
    fill,
    make_grid,
    mark,
    render,
    share_scales,
)
from compressor.store import publish, write_dataset

COLUMNS = 3
WORDS_ROOM = 4.0  # times left of the fastest point, for the words
MID, LIGHT = "#7d7d7d", "#ababab"
# compiled methods are solid and coloured, SciPy's grey and dashed
LOOKS = {
    "auto": (LineStyle(BLUE, "-", 1.7, 3.2, "o", 3.8), "auto (TSIT5)"),
    "RODAS": (LineStyle(GOLD, "-", 1.6, 3.0, "D", 3.8), "RODAS"),
    "DOP853": (LineStyle(BLACK, (0, (1, 1.2)), 1.2, 2.5, "^", 3.8), "SciPy DOP853"),
    "RK45": (LineStyle(MID, (0, (4, 1.5)), 1.1, 2.4, "v", 3.8), "SciPy RK45"),
    "LSODA": (LineStyle(BLACK, (0, (6, 1.5)), 1.0, 2.3, "<", 3.8), "SciPy LSODA"),
    "Radau": (LineStyle(LIGHT, (0, (6, 1.2, 1.2, 1.2)), 1.3, 2.2, ">", 3.8), "SciPy Radau"),
    "BDF": (LineStyle(MID, (0, (1, 1.2)), 1.2, 2.1, "p", 3.8), "SciPy BDF"),
}
OTHER = (LineStyle(MID, "-", 1.0, 2.0, ".", 3.8), "")
PAPER = mark(BLACK, "*", 12, 6, edge="#ffffff")
TIER = mark(BLUE, "o", 9.5, 4, is_hollow=True)
DISAGREE = fill("#f0f0f0", zorder=0, edge="#c9c9c9", edge_width=0.0, is_hatched=True)


def draw_work_precision(study: xr.Dataset) -> Drawing:
    """Return a panel a scene of a study of work and precision; the paper's own point is a star.

    Rings mark the tolerances behind the words of `accuracy`; in the hatched band the references
    themselves disagree.
    """
    count = study.sizes["scene"]
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    figure, _ = make_grid(rows, columns, 4.1 * rows + 0.7, count)
    for number, panel in enumerate(figure.panels):
        one = study.isel(scene=number)
        plot_scene(panel, one)
        panel.title = str(one["scene"].item()).replace("_", " ")
        panel.x.log = panel.y.log = True
        panel.x.margin = 0.06
    first, ends = figure.panels[0], limits(study)
    first.y.span(*ends)
    first.x.span(study["seconds"].min().item() / WORDS_ROOM)
    share_scales(figure.panels, "x", "y")
    for number, panel in enumerate(figure.panels):
        apart = uncertainty(study.isel(scene=number))
        if apart > ends[0]:
            panel.traces.append(box(panel.limits("x"), (ends[0], apart), DISAGREE, "band"))
    figure.x_title = "wall time of the solution (s)"
    figure.y_title = "relative L2 error of acceleration"
    figure.legend = [
        *(trace for trace in first.traces if trace.name),
        entry("a word of solve.accuracy", TIER),
        entry("the references disagree", DISAGREE, "band"),
    ]
    return figure


def plot_scene(panel: Panel, one: xr.Dataset) -> None:
    """Draw a line a method, the rings of the tiers, and the paper's star."""
    for name in one["method"].values:
        line, label = LOOKS.get(str(name), OTHER)
        row = one.sel({"method": name})
        order = np.argsort(-row["tolerance"].values)
        seconds = row["seconds"].where(row["error_acceleration"].notnull()).values[order]
        panel.plot(seconds, row["error_acceleration"].values[order], line, label or str(name))
    if "auto" in one["method"].values:
        mark_tiers(panel, one.sel({"method": "auto"}))
    star = one["paper_seconds"], one["paper_error_acceleration"]
    panel.plot(*star, PAPER, "the paper's numerics: BDF, 1e-5")


def mark_tiers(panel: Panel, row: xr.Dataset) -> None:
    """Draw a ring and the word where a tolerance has one."""
    for word, tier in ACCURACY.items():
        if tier.rtol in row["tolerance"].values:
            point = row.sel({"tolerance": tier.rtol})
            x, y = point["seconds"].item(), point["error_acceleration"].item()
            panel.plot(x, y, TIER)
            panel.notes.append(
                Note(word, x, y, LineStyle(BLUE), shift=(-11, -2), side="right", level="top",
                     size=8.5)
            )  # fmt: skip


def uncertainty(one: xr.Dataset) -> float:
    """Return the relative distance of a scene's references in acceleration."""
    return float(one["reference_uncertainty"].sel(quantity="acceleration"))


def limits(study: xr.Dataset) -> tuple[float, float]:
    """Return the errors to be shown, with room for the band below which none is known."""
    names = ("error_acceleration", "paper_error_acceleration")
    found = np.concatenate([study[name].values.ravel() for name in names])
    found = found[np.isfinite(found) & (found > 0)]
    if not found.size:
        return 1e-10, 1.0
    return float(found.min()) / 5, float(found.max()) * 3


def write_methods(folder: Path, study: xr.Dataset) -> None:
    """Store a study of methods and draw it."""
    write_dataset(folder / "tradeoff.nc", study)
    drawing = draw_work_precision(study)
    for kind in ("png", "svg"):
        publish(folder / f"tradeoff.{kind}", render(drawing, kind))

"""Pictures of drawings by matplotlib, by two processes where there are cores for them.

Figures are made on the Agg canvas without pyplot, and inside a style context, so that neither a
user's matplotlibrc nor a user's own figures are touched.
"""

import contextlib
import io
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any

import numpy as np
from matplotlib import style
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, MultipleLocator, NullFormatter

from compressor.report.figures.drawing import WAYS, Drawing, Note, Panel, Trace, Way
from compressor.report.figures.style import LineStyle

DPI = 150
SVG_DPI = 200  # of what is pixels in an SVG: 1920 across a page, twice those of a usual screen
LEGEND_WIDTH = 130  # characters, in a row of a legend
PLAIN_DECADES = 2.5  # of a log axis with plain numbers, up to which it has ticks at 2 and 5 as well

STYLE: dict[str, Any] = {
    "font.size": 9.5,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # found again for each drawing it takes a tenth of the time
    "axes.labelsize": 9.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 9.5,
    "legend.frameon": False,
    "legend.handlelength": 3.2,
    "lines.dash_capstyle": "butt",
    "agg.path.chunksize": 20000,
    "svg.fonttype": "path",
    "svg.hashsalt": "compsim",
}


@style.context(STYLE, after_reset=True)
def render(drawing: Drawing, kind: str = "png") -> bytes:
    """Return a drawing as the bytes of a `png` or `svg` file, without a time stamp.

    Its layout is found once: `savefig` would find it twice.
    """
    figure = paint(drawing)
    layout = figure.get_layout_engine()
    assert layout
    layout.execute(figure)
    figure.set_layout_engine("none")
    stream = io.BytesIO()
    if kind == "png":
        FigureCanvasAgg(figure).print_png(stream)
    else:
        figure.savefig(stream, format=kind, dpi=SVG_DPI, metadata={"Date": None})
    return stream.getvalue()


def render_reported(heading: str, drawing: Drawing) -> bytes:
    """Return the PNG of a drawing; say what is drawn in one write, since two share stderr."""
    with contextlib.suppress(OSError):
        sys.stderr.write(f"drawing {heading}\n")
        sys.stderr.flush()
    return render(drawing)


def render_all(drawings: Sequence[tuple[str, Drawing]]) -> list[bytes]:
    """Return the PNG of drawings, each with what it is called on stderr.

    They are drawn two at a time, by copies of this process; one after the other where the system
    makes no copies, or threads run, whose locks a copy would take along.
    """
    affinity = getattr(os, "sched_getaffinity", None)
    cores = len(affinity(0)) if affinity else os.cpu_count() or 1
    can_fork = cores > 1 and "fork" in multiprocessing.get_all_start_methods()
    if can_fork and threading.active_count() == 1 and len(drawings) > 1:
        context, ignored = multiprocessing.get_context("fork"), (signal.SIGINT, signal.SIG_DFL)
        # a copy has died, such as for want of memory: all is drawn here
        with (
            contextlib.suppress(BrokenProcessPool),
            ProcessPoolExecutor(2, context, signal.signal, ignored) as pool,
        ):
            return [*pool.map(render_reported, *zip(*drawings, strict=True))]
    return [render_reported(*one) for one in drawings]


def paint(drawing: Drawing) -> Figure:
    """Return a drawing as a figure of matplotlib."""
    layout = ConstrainedLayoutEngine(w_pad=0.07, h_pad=0.06, wspace=0.03)
    figure = Figure(figsize=(drawing.width, drawing.height), dpi=DPI, layout=layout)
    FigureCanvasAgg(figure)
    heights, widths = drawing.heights, drawing.widths
    grid = figure.add_gridspec(
        len(heights), len(widths), height_ratios=heights, width_ratios=widths
    )
    places = [figure.add_subplot(grid[slice(*p.row), slice(*p.column)]) for p in drawing.panels]
    columns: dict[tuple[int, int], list[Axes]] = {}
    for panel, axes in zip(drawing.panels, places, strict=True):
        columns.setdefault(panel.column, []).append(axes)
    for panel, axes in zip(drawing.panels, places, strict=True):
        paint_panel(axes, panel, columns[panel.column])
    if drawing.x_title:
        figure.supxlabel(drawing.x_title, fontsize="medium")
    if drawing.y_title:
        figure.supylabel(drawing.y_title, fontsize="medium")
    if drawing.title:
        figure.suptitle(drawing.title, x=0.02, ha="left", fontsize="medium")
    if drawing.legend:
        longest = max(len(one.name) for one in drawing.legend)
        across = min(len(drawing.legend), max(1, LEGEND_WIDTH // (longest + 9)))
        handles = [*map(legend_handle, drawing.legend)]
        figure.legend(
            handles=handles, ncols=across,
            loc="outside lower center" if drawing.title else "outside upper center",
        )  # fmt: skip
    return figure


def paint_panel(axes: Axes, panel: Panel, column: Sequence[Axes]) -> None:
    """Draw a panel on axes. column: the axes of its column, for a scale of colours beside all."""
    axes.set_title(panel.title, fontsize=panel.title_size)
    if panel.ground:
        ground = patch_properties(panel.ground)
        axes.patch.set(**{name: ground[name] for name in ("facecolor", "edgecolor", "hatch")})
    if panel.is_square:
        axes.set_aspect("equal", adjustable="datalim" if panel.fills_box else "box")
    for trace in panel.traces:
        if trace.kind == "map":
            paint_map(axes, trace, column)
        elif trace.kind == "band":
            axes.add_patch(PathPatch(outline(trace), **patch_properties(trace.style)))
        elif trace.kind in ("bars", "columns"):
            paint_bars(axes, trace)
        else:
            look = line_properties(trace.style)
            if trace.errors is None:
                axes.plot(trace.x, trace.y, **look)
            else:
                axes.errorbar(trace.x, trace.y, **error_properties(trace), elinewidth=1.0, **look)
    for note in panel.notes:
        paint_note(axes, note, panel.limits("y"))
    for way in WAYS:
        paint_scale(axes, way, panel)
        if way not in panel.grid:
            axes.grid(visible=False, axis=way)
    if panel.legend:
        handles = [*map(legend_handle, panel.legend)]
        axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2)


def paint_scale(axes: Axes, way: Way, panel: Panel) -> None:
    """Draw the title, the ends and the ticks of the axis `x` or `y`."""
    axis, scale = (axes.xaxis, panel.x) if way == "x" else (axes.yaxis, panel.y)
    low, high = panel.limits(way)
    axis.set_label_text(scale.title)
    if not scale.title:
        axis.set_label_coords(0.5, 0.5)  # else its place is found from all ticks, at each drawing
    if scale.log:
        (axes.set_xscale if way == "x" else axes.set_yscale)("log")
    if scale.words:
        axis.set_ticks([*scale.words], [*scale.words.values()])
    elif scale.ticks is not None:
        axis.set_ticks(scale.ticks)
    elif scale.step:
        axis.set_major_locator(MultipleLocator(scale.step))
    elif scale.max_ticks:
        axis.set_major_locator(MaxNLocator(scale.max_ticks))
    if scale.plain:
        is_fine = np.log10(high / low) <= PLAIN_DECADES
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if is_fine else (1.0,)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    (axes.set_xlim if way == "x" else axes.set_ylim)(low, high, auto=panel.fills_box)
    if scale.bare:
        axis.set_tick_params(which="both", labelbottom=False, labelleft=False)


def line_properties(look: LineStyle) -> dict[str, Any]:
    """Return the keywords of a line of matplotlib."""
    return {
        "color": look.color, "linestyle": look.linestyle, "linewidth": look.linewidth,
        "zorder": look.zorder, "marker": look.marker, "markersize": look.markersize,
        "markeredgecolor": look.edge or look.color, "markeredgewidth": look.edge_width,
        "markerfacecolor": "none" if look.is_hollow else look.color, "alpha": look.alpha,
        "drawstyle": "steps-post" if look.is_step else "default",
    }  # fmt: skip


def error_properties(trace: Trace) -> dict[str, Any]:
    """Return the keywords of matplotlib's error bars."""
    return {"xerr" if trace.across else "yerr": trace.errors, "capsize": trace.caps}


def patch_properties(look: LineStyle) -> dict[str, Any]:
    """Return the keywords of an area of matplotlib."""
    return {
        "facecolor": look.color, "edgecolor": look.edge or "none", "zorder": look.zorder,
        "linewidth": look.edge_width if look.edge else 0.0, "alpha": look.alpha,
        "hatch": "////" if look.is_hatched else None,
    }  # fmt: skip


def legend_handle(trace: Trace) -> Artist:
    """Return an entry of a legend."""
    if trace.kind == "line":
        return Line2D([], [], label=trace.name, **line_properties(trace.style))
    return Patch(label=trace.name, **patch_properties(trace.style))


def outline(trace: Trace) -> Path:
    """Return the outlines of a band; those inside another one are holes."""
    ends = np.flatnonzero(np.isnan(trace.x))
    rings = np.split(np.column_stack([trace.x, trace.y]), ends)
    rings = [ring[np.isfinite(ring).all(axis=1)] for ring in rings]
    return Path.make_compound_path(*(Path(ring, closed=True) for ring in rings if ring.size))


def paint_bars(axes: Axes, trace: Trace) -> None:
    """Draw bars, lying or standing."""
    look = patch_properties(trace.style) | {"linewidth": 0.0}
    foot = 0.0 if trace.foot is None else trace.foot
    if trace.errors is not None:
        look |= error_properties(trace) | {"ecolor": "#303030"}
    if trace.kind == "bars":
        axes.barh(trace.y, trace.x - foot, trace.thick, foot, **look)
    else:
        axes.bar(trace.x, trace.y - foot, trace.thick, foot, **look)


def paint_map(axes: Axes, trace: Trace, column: Sequence[Axes]) -> None:
    """Draw the cells of a map, and the bar of its colours."""
    scale, look = trace.scale, trace.style
    assert scale is not None
    assert trace.z is not None
    norm = (LogNorm if scale.log else Normalize)(scale.low, scale.high)
    colors = ListedColormap(scale.colors)
    edges: dict[str, Any] = {"edgecolors": look.edge, "linewidth": look.edge_width}
    axes.pcolormesh(trace.x, trace.y, np.ma.masked_invalid(trace.z), norm=norm, cmap=colors,
                    rasterized=True, **(edges if look.edge else {}))  # fmt: skip
    if not scale.side:
        return
    figure, places = axes.figure, [*column] if scale.beside_column else axes
    bar = figure.colorbar(
        ScalarMappable(norm, colors), ax=places, pad=0.02, location=scale.side, aspect=scale.aspect,
        label=scale.bar_title or scale.title, extend="both" if scale.pointed else "neither",
        ticks=scale.ticks,
    )  # fmt: skip
    if scale.levels:
        bar.add_lines([*scale.levels], ["white"] * len(scale.levels), [0.9] * len(scale.levels))


def paint_note(axes: Axes, note: Note, limits: tuple[float, float]) -> None:
    """Draw a text, an arrow or a straight line; limits: of the y axis."""
    look = note.style
    if note.tail is not None:
        arrow = {"arrowstyle": "-|>", "color": look.color, "mutation_scale": 22, "shrinkB": 0}
        axes.annotate("", (note.x, note.y), note.tail, arrowprops=arrow)
    elif note.text:
        x_frame, y_frame = ("axes fraction" if way in note.inside else "data" for way in WAYS)
        axes.annotate(
            note.text, (note.x, note.y), note.shift, xycoords=(x_frame, y_frame),
            textcoords="offset points", ha=note.side, va=note.level, fontsize=note.size,
            color=look.color, alpha=look.alpha,
        )  # fmt: skip
    elif np.isnan(note.x):
        low, high = limits
        axes.axhline(note.y, clip_on=not low <= note.y <= high, **line_properties(look))
    else:
        axes.axvline(note.x, **line_properties(look))

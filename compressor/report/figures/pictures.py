"""Pictures of figures by matplotlib, by two processes where there are cores for them.

Figures are made on the Agg canvas without pyplot, and with all settings given, so that neither a
user's matplotlibrc nor a user's own figures are touched.
"""

import contextlib
import io
import itertools
import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
import plotly.graph_objects as go
from matplotlib import rc_context, rcParamsDefault
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator
from matplotlib.transforms import Bbox

from compressor.digits import MIN_DECIMAL, plural
from compressor.program import work_beside
from compressor.report.figures.drawing import (
    INCH,
    ROOM,
    WAYS,
    WIDTH,
    Panel,
    Trace,
    Way,
    midway,
    panels_of,
)
from compressor.report.figures.style import PIXEL

DPI = 150
EDGE = 0.1  # inches, around what is drawn
MAX_SHARED = 256  # figures that two processes share: their numbers are a byte each
LEGEND_WIDTH = 130  # characters, in a row of a legend
MARKERS = {
    "circle": "o", "square": "s", "diamond": "D", "triangle-up": "^", "triangle-down": "v",
    "triangle-left": "<", "triangle-right": ">", "pentagon": "p", "x-thin": "x",
}  # fmt: skip

STYLE: Any = {
    **{name: one for name, one in rcParamsDefault.items() if name != "backend"},  # not given back
    "font.size": 9.5,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # found again for each drawing it takes a tenth of the time
    "axes.titlesize": 10.0,
    "axes.labelsize": 9.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,  # it would stand over the title; so would a power of ten
    "axes.formatter.limits": (-99, 99),
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 9.5,
    "legend.frameon": False,
    "legend.handlelength": 3.2,
    "lines.dash_capstyle": "butt",
    "agg.path.chunksize": 20000,
}


@rc_context(STYLE)  # matplotlib.style would first parse its library
def render(figure: go.Figure) -> bytes:
    """Return a figure as the bytes of a PNG file, without a time stamp."""
    stream, painted = io.BytesIO(), paint(figure)
    box = whole_box(painted, figure).padded(EDGE)
    painted.savefig(stream, format="png", bbox_inches=box)
    return stream.getvalue()


def whole_box(painted: Figure, figure: go.Figure) -> Bbox:
    """Return the box (inches) of a picture: its size, and what stands beyond it.

    That may be a title, a legend, and the numbers or words of the outermost axes; to measure all
    takes a fifth of the time of a picture.
    """
    outer = [axis for axes, panel in zip(painted.axes, panels_of(figure), strict=False)
             for axis, at, is_named in ((axes.yaxis, panel.x.domain[0], True),
                                        (axes.xaxis, panel.y.domain[0], panel.x.ticktext))
             if is_named and at < 1e-6]  # fmt: skip
    renderer = FigureCanvasAgg(painted).get_renderer()  # else each would make its own
    found = [one.get_tightbbox(renderer) for one in (*painted.legends, *painted.texts, *outer)]
    return Bbox.union([painted.bbox, *filter(None, found)]).transformed(
        painted.dpi_scale_trans.inverted()
    )


Made = TypeVar("Made")


def draw_all(work: Sequence[Callable[[], Made]]) -> list[Made]:
    """Return what is drawn, two at a time where that can be; say on stderr how much that is."""
    with contextlib.suppress(OSError):
        sys.stderr.write(f"drawing {plural(len(work), 'figure')}\n" * bool(work))
        sys.stderr.flush()
    here, there = os.pipe()  # of numbers, of which each process takes one at a time
    os.write(there, bytes(range(len(work))[:MAX_SHARED])[::-1])
    os.close(there)

    def draw_some() -> dict[int, Made]:
        return {number: work[number]() for (number,) in iter(lambda: os.read(here, 1), b"")}

    try:
        with work_beside(draw_some) as others:
            drawn = draw_some() | others()
    finally:
        os.close(here)
    # a copy that died has drawn none
    return [drawn[number] if number in drawn else draw() for number, draw in enumerate(work)]


def paint(figure: go.Figure) -> Figure:
    """Return a figure of plotly as one of matplotlib, its axes where plotly's layout has them."""
    layout, axes = figure.layout, dict[str, Axes]()
    painted = Figure((layout.width / INCH, layout.height / INCH), dpi=DPI)
    panels = panels_of(figure)
    for panel in panels:
        axes[panel.suffix] = one = painted.add_axes(place(layout, panel))
        if panel.x.matches:
            one.sharex(axes[panel.x.matches[1:]])
        if panel.y.matches:
            one.sharey(axes[panel.y.matches[1:]])
    for panel in panels:  # after all are there: a log scale is for those that share it by then
        paint_panel(axes[panel.suffix], panel)
    for panel, way in itertools.product(panels, WAYS):
        limit_axis(axes[panel.suffix], way, panel.axis(way))
    if layout.title.text:
        painted.text(0.02, 1.0, words(layout.title.text), va="bottom")
    listed = [one for one in figure.data if one.showlegend]
    is_needed = any(isinstance(one, go.Scatter) and "lines" not in one.mode for one in listed)
    if is_needed or len(listed) > 1:
        longest = max(len(one.name) for one in listed)
        across = min(len(listed), max(1, LEGEND_WIDTH // (longest + 9)))
        loc: Any
        loc, at = ("upper center", 0.0) if layout.title.text else ("lower center", 1.0)
        painted.legend(handles=[*map(legend_handle, listed)], loc=loc, ncols=across,
                       bbox_to_anchor=(0.5, at))  # fmt: skip
    return painted


def place(layout: go.Layout, panel: Panel) -> tuple[float, float, float, float]:
    """Return left, bottom, width and height of a panel in the picture."""
    margin, (left, right), (low, high) = layout.margin, panel.x.domain, panel.y.domain
    across = (layout.width - margin.l - margin.r) / layout.width
    down = (layout.height - margin.t - margin.b) / layout.height
    return (margin.l / layout.width + across * left, margin.b / layout.height + down * low,
            across * (right - left), down * (high - low))  # fmt: skip


def words(text: str) -> str:
    """Return a text of plotly as matplotlib writes it."""
    text = text.replace("$", r"\$").replace("<br>", "\n")
    return re.sub(r"(\w)<sub>(\w+)</sub>", r"$\1_{\2}$", text)


def paint_panel(axes: Axes, panel: Panel) -> None:
    """Draw a panel on axes."""
    axes.set_title(words(panel.title))
    kinds = {"map" if isinstance(one, go.Heatmap) else getattr(one, "mode", None) or "bar"
             for one in panel.traces}  # fmt: skip
    is_marked = any("markers" in kind for kind in kinds)
    axes.margins(x=ROOM if is_marked or "bar" in kinds else 0.0, y=0.0 if "map" in kinds else ROOM)
    for way in WAYS:
        paint_axis(axes, way, panel.axis(way))
    for height, trace in enumerate(panel.traces):
        paint_trace(axes, trace, 2.0 + 0.01 * height)
    for rule in panel.rules:
        way = "x" if "domain" in rule.yref else "y"
        line = axes.axvline if way == "x" else axes.axhline
        look = {"zorder": 1.9 if rule.layer == "below" else 2.9} | line_look(rule.line)
        line(rule[f"{way}0"], **look)
    for note in panel.notes:
        x, y = (10.0**end if scale.type == "log" else end
                for end, scale in ((note.x, panel.x), (note.y, panel.y)))  # fmt: skip
        axes.annotate(
            words(note.text), (x, y), (note.xshift / PIXEL, note.yshift / PIXEL),
            textcoords="offset points", ha=note.xanchor, va=note.yanchor,
            fontsize=note.font.size / PIXEL, color=note.font.color,
        )  # fmt: skip
    if panel.y.scaleanchor:
        axes.set_aspect("equal", adjustable="box")


def paint_axis(axes: Axes, way: Way, scale: Any) -> None:
    """Draw the title, the ends and the ticks of the axis `x` or `y`; what is shared is there."""
    axis, title = axes.xaxis if way == "x" else axes.yaxis, words(scale.title.text or "")
    axis.set_label_text(title)
    has_numbers = scale.showticklabels is not False
    axis.set_tick_params(which="both", labelbottom=has_numbers, labelleft=has_numbers)
    if scale.showgrid is False:
        axes.grid(visible=False, axis=way)
    if scale.matches:
        return
    if scale.type == "log":
        (axes.set_xscale if way == "x" else axes.set_yscale)("log")
    if scale.ticktext:
        axis.set_ticks(scale.tickvals, [words(text) for text in scale.ticktext])
    elif scale.tickvals is not None:
        axis.set_ticks(scale.tickvals)
    elif scale.dtick:
        axis.set_major_locator(MultipleLocator(scale.dtick))


def limit_axis(axes: Axes, way: Way, scale: Any) -> None:
    """Show what an axis says, after all is drawn; the rest follows from that."""
    if scale.range and not scale.matches:
        ends = [10.0**end if end is not None and scale.type == "log" else end
                for end in scale.range]  # fmt: skip
        (axes.set_xlim if way == "x" else axes.set_ylim)(*ends)


def line_look(line: Any) -> dict[str, Any]:
    """Return the keywords of a line of matplotlib."""
    width = line.width / PIXEL
    parts = [float(part[:-2]) / line.width for part in (line.dash or "").split(",") if "px" in part]
    return {"color": line.color, "linewidth": width, "linestyle": (0, parts) if parts else "-"}


def curve_look(trace: go.Scatter) -> dict[str, Any]:
    """Return the keywords of a curve of matplotlib: its line, its marks or both."""
    marks, symbol = trace.marker, trace.marker.symbol or ""
    look = line_look(trace.line) | ({} if "lines" in trace.mode else {"linestyle": "none"})
    look["alpha"] = trace.opacity
    if "markers" in trace.mode:
        is_open = symbol.endswith("-open")
        look |= {
            "marker": MARKERS[symbol.removesuffix("-open")], "markersize": marks.size / PIXEL,
            "markerfacecolor": "none" if is_open else marks.color,
            "markeredgecolor": marks.line.color, "markeredgewidth": marks.line.width / PIXEL,
        }  # fmt: skip
    return look


def area_look(trace: Trace) -> dict[str, Any]:
    """Return the keywords of an area of matplotlib."""
    if isinstance(trace, go.Bar):
        return {"facecolor": trace.marker.color, "linewidth": 0.0}
    return {"facecolor": trace.fillcolor, "linewidth": 0.0, "alpha": trace.opacity}


def legend_handle(trace: Trace) -> Artist:
    """Return an entry of a legend."""
    if isinstance(trace, go.Scatter) and trace.fill is None:
        return Line2D([], [], label=trace.name, **curve_look(trace))
    return Patch(label=trace.name, **area_look(trace))


def paint_trace(axes: Axes, trace: Trace, height: float) -> None:
    """Draw a curve, an area, bars or a map."""
    if isinstance(trace, go.Heatmap):
        paint_map(axes, trace)
    elif isinstance(trace, go.Bar):
        look = area_look(trace) | {"zorder": height}
        if trace.error_x.array is not None:
            ends = [trace.error_x.arrayminus, trace.error_x.array]
            look |= {"xerr": ends, "capsize": 2.0, "ecolor": "#303030"}
        axes.barh(trace.y, trace.x, trace.width, **look)
    elif trace.fill:
        axes.fill(trace.x, trace.y, zorder=height - 1.0, **area_look(trace))
    elif trace.error_y.array is not None:
        ends = [trace.error_y.arrayminus, trace.error_y.array]
        axes.errorbar(trace.x, trace.y, ends, capsize=2.0, elinewidth=1.0, zorder=height,
                      **curve_look(trace))  # fmt: skip
    else:
        axes.plot(trace.x, trace.y, zorder=height, **curve_look(trace))


def paint_map(axes: Axes, trace: go.Heatmap) -> None:
    """Draw the cells of a map, and the bar of its colours."""
    norm = Normalize(trace.zmin, trace.zmax)
    stops = [(float(at), color) for at, color in trace.colorscale]
    colors = LinearSegmentedColormap.from_list("", stops)
    x, y = (midway(np.asarray(at), scale == "log") for at, scale
            in ((trace.x, axes.get_xscale()), (trace.y, axes.get_yscale())))  # fmt: skip
    axes.pcolormesh(x, y, np.ma.masked_invalid(trace.z), norm=norm, cmap=colors, zorder=1.5)
    if trace.showscale is not False:
        scale = trace.colorbar
        box = axes.get_position()
        beside = axes.figure.add_axes((box.x1 + 6 / WIDTH, box.y0, 10 / WIDTH, box.height))
        is_tiny = max(map(abs, (trace.zmin, trace.zmax))) < MIN_DECIMAL  # zeros would be too long
        bar = axes.figure.colorbar(
            ScalarMappable(norm, colors), cax=beside, format="%g" if is_tiny else None
        )
        bar.set_label(words(scale.title.text or ""))
        if scale.tickvals is not None:
            bar.set_ticks(scale.tickvals, labels=scale.ticktext)

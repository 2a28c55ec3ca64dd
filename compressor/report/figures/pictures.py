"""Pictures of drawings by matplotlib, by two processes where there are cores for them.

Figures are made on the Agg canvas without pyplot, and inside a style context, so that neither a
user's matplotlibrc nor a user's own figures are touched.
"""

import contextlib
import gc
import hashlib
import io
import multiprocessing
import os
import pathlib
import pickle
import signal
import sys
import threading
from collections import deque
from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from functools import cache
from typing import Any, Self

import matplotlib
import numpy as np
from matplotlib import style
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, MultipleLocator, NullFormatter

from compressor.report.figures import drawing as drawing_module
from compressor.report.figures import style as style_module
from compressor.report.figures.drawing import WAYS, Drawing, Note, Panel, Trace, Way
from compressor.report.figures.style import LineStyle

DPI = 150
SVG_DPI = 200  # of what is pixels in an SVG: 1920 across a page, twice those of a usual screen
MAX_VECTOR_MARKS = 1000  # of a cloud of points: more are pixels in an SVG
LEGEND_WIDTH = 130  # characters, in a row of a legend
PLAIN_DECADES = 2.5  # of a log axis with plain numbers, up to which it has ticks at 2 and 5 as well
ENDS = {"png": b"IEND\xaeB`\x82", "svg": b"</svg>\n"}  # of whole files
KINDS = tuple(ENDS)
HEAD = 2000  # bytes of a picture, in which its identifier is

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


def render(drawing: Drawing, kind: str) -> bytes:
    """Return a drawing as the bytes of a `png` or `svg` file, without a time stamp."""
    (picture,) = render_kinds(drawing, [kind])
    return picture


@style.context(STYLE, after_reset=True)
def render_kinds(drawing: Drawing, kinds: Iterable[str]) -> list[bytes]:
    """Return a drawing as the bytes of a file of each kind.

    Its layout is found once, and each picture is drawn once: `savefig` draws all once more before.
    """
    figure = paint(drawing)
    layout = figure.get_layout_engine()
    assert layout
    layout.execute(figure)
    figure.set_layout_engine("none")
    mark = digest_drawing(drawing)
    encode = {"png": encode_png, "svg": encode_svg}
    return [encode[kind](figure, mark) for kind in kinds]


def digest_drawing(drawing: Drawing) -> str:
    """Return a digest of all that the pictures of a drawing follow from: its data and the code.

    It stands in the pictures themselves, which thus show whether they are still those of a drawing.
    """
    return hashlib.sha256(code_digest() + pickle.dumps(drawing)).hexdigest()


@cache
def code_digest() -> bytes:
    """Return a digest of the code that draws: these modules and matplotlib."""
    found = hashlib.sha256(f"{matplotlib.__version__} {np.__version__}".encode())
    for file in (__file__, drawing_module.__file__, style_module.__file__):
        found.update(pathlib.Path(file).read_bytes())
    return found.digest()


def is_drawn(drawing: Drawing, folder: pathlib.Path, name: str) -> bool:
    """Return whether the pictures of a drawing lie in a folder, whole, as this code draws them."""
    mark = digest_drawing(drawing).encode()
    for kind, end in ENDS.items():
        try:
            picture = (folder / f"{name}.{kind}").read_bytes()
        except OSError:
            return False
        if mark not in picture[:HEAD] or not picture.endswith(end):
            return False
    return True


def encode_svg(figure: Figure, mark: str) -> bytes:
    """Return a figure as the bytes of an SVG file. mark: its identifier."""
    stream = io.BytesIO()
    figure.dpi, dpi = SVG_DPI, figure.dpi
    FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None, "Identifier": mark})
    figure.dpi = dpi
    return stream.getvalue()


def encode_png(figure: Figure, mark: str) -> bytes:
    """Return a figure as the bytes of a PNG file. mark: its identifier."""
    stream = io.BytesIO()
    FigureCanvasAgg(figure).print_png(stream, metadata={"Identifier": mark})
    return stream.getvalue()


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
            look["rasterized"] = trace.is_points and trace.x.size > MAX_VECTOR_MARKS
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


class Painter:
    """Draws PNG and SVG of drawings, in a copy of this process while this one does other work.

    A copy takes drawings from the first on as soon as they are added; `finish` takes them from the
    last on until both meet. Where threads run, whose locks a fork may copy, or the system has no
    fork, all is done here. What is drawn is reported on stderr.
    """

    def __init__(self, folder: pathlib.Path):
        """Set the folder, whose pictures are not drawn again where they are those of a drawing."""
        self.folder = folder
        self.added: dict[str, tuple[Drawing, str]] = {}
        self.waiting: deque[str] = deque()
        self.futures: dict[str, Future[list[bytes]]] = {}
        self.pool: ProcessPoolExecutor | None = None
        self.sent: Future[list[bytes]] | None = None  # last of all

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.pool:
            self.pool.shutdown(cancel_futures=True)
        gc.unfreeze()

    def add(self, name: str, drawing: Drawing, heading: str) -> None:
        """Draw a drawing as files of a name; heading: what it is called on stderr."""
        if is_drawn(drawing, self.folder, name):
            return
        self.added[name] = drawing, heading
        self.waiting.append(name)
        if not self.pool and threading.active_count() == 1 and can_fork():
            gc.freeze()  # what is there no collection needs to look at again, nor the copy to write
            context = multiprocessing.get_context("fork")
            ignored = signal.SIGINT, signal.SIG_DFL
            self.pool = ProcessPoolExecutor(1, context, signal.signal, ignored)
        if self.sent is None or self.sent.done():
            self.send()

    def send(self, _: object = None) -> None:
        """Submit the next drawing to the copy, which has finished one or has none."""
        with contextlib.suppress(IndexError, RuntimeError):  # there is none; it has died
            if self.pool:
                # in the pool's own thread, but a deque gives each name to one side only
                name = self.waiting.popleft()
                self.sent = self.futures[name] = self.pool.submit(draw_reported, *self.added[name])
                self.sent.add_done_callback(self.send)

    def finish(self) -> dict[str, bytes]:
        """Return the pictures that were to be drawn by the names of their files."""
        gc.freeze()
        drawn = {}
        while self.waiting:
            with contextlib.suppress(IndexError):
                name = self.waiting.pop()
                drawn[name] = draw_reported(*self.added[name])
        for name in self.added.keys() - drawn.keys():
            try:
                drawn[name] = self.futures[name].result()
            except (KeyError, OSError, RuntimeError):  # the copy has died
                drawn[name] = draw_reported(*self.added[name])
        return {
            f"{name}.{kind}": picture
            for name in self.added
            for kind, picture in zip(KINDS, drawn[name], strict=True)
        }


def can_fork() -> bool:
    """Return whether the system can copy a process, and has a core for the copy."""
    affinity = getattr(os, "sched_getaffinity", None)
    cores = len(affinity(0)) if affinity else os.cpu_count() or 1
    return cores > 1 and "fork" in multiprocessing.get_all_start_methods()


def draw_reported(drawing: Drawing, heading: str) -> list[bytes]:
    """Return the pictures of a drawing; say what is drawn in one write, since two share stderr."""
    with contextlib.suppress(OSError):
        sys.stderr.write(f"drawing {heading}\n")
        sys.stderr.flush()
    return render_kinds(drawing, KINDS)

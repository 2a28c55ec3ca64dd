"""Reads off a finished matplotlib figure what it shows, as numbers.

What a finished figure shows, as numbers: its panels, curves, maps and bars. The interactive figure
and the CSV file behind each figure are made from it, so that a figure is drawn once.
"""

import csv
import io
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection, QuadMesh
from matplotlib.colors import LogNorm, to_hex
from matplotlib.container import BarContainer, ErrorbarContainer
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Annotation
from matplotlib.ticker import MultipleLocator
from matplotlib.transforms import Transform


@dataclass(frozen=True)
class Trace:
    """What one artist shows, in the units of its panel's axes.

    kind: `line`, `points`, `band` (a closed outline), `bars` (x from 0, at y), `map` (`z` over the
    edges x and y). A name of "" has no entry in the legend. errors: (below, above), shape (2, n),
    in y, or in x where `across`. jobs: the key of each point's job. color: `#rrggbb`; of a map the
    scale, from its least to its greatest value, which `limits` are, in powers of ten if `log`.
    """

    kind: str
    name: str
    x: np.ndarray
    y: np.ndarray
    z: np.ndarray | None = None
    color: str | tuple[str, ...] = "#000000"
    width: float = 1.2
    dash: tuple[float, ...] = ()
    marker: str = ""
    opacity: float = 1.0
    errors: np.ndarray | None = None
    across: bool = False
    jobs: tuple[str, ...] = ()
    limits: tuple[float, float] = (0.0, 1.0)
    log: bool = False
    scale_name: str = ""


@dataclass(frozen=True)
class PanelText:
    """A text in a panel, or a straight line across it (`text` "") at x or at y, else nan."""

    text: str = ""
    x: float = float("nan")
    y: float = float("nan")
    color: str = "#000000"
    dash: tuple[float, ...] = ()
    inside: bool = False  # x and y are shares of the panel


@dataclass(frozen=True)
class Scale:
    """An axis: title, what is shown of it, and the words that stand for numbers.

    step: between two ticks, 0 where that is left open; bare: without numbers, which stand beside.
    """

    title: str
    low: float
    high: float
    log: bool = False
    words: dict[float, str] = field(default_factory=dict)
    step: float = 0.0
    bare: bool = False


@dataclass(frozen=True)
class Panel:
    """One of a figure's axes. row, column: of the grid, first and behind the last."""

    title: str
    x: Scale
    y: Scale
    row: tuple[int, int]
    column: tuple[int, int]
    traces: tuple[Trace, ...]
    notes: tuple[PanelText, ...]
    is_square: bool = False  # the units of both axes are as long


@dataclass(frozen=True)
class FigureData:
    """A figure; heights and widths: of the grid's rows and columns, relative to the first."""

    panels: tuple[Panel, ...]
    heights: tuple[float, ...]
    widths: tuple[float, ...]
    size: tuple[float, float]  # inches


def as_csv(sheet: FigureData) -> str:
    """Return all numbers of a figure. Curves over the same x share a column of it, and stand once.

    A column is headed "panel: curve: title of the axis", with " below" and " above" for the ends
    of error bars, counted from the value. A map has a row a cell, x and y in its middle.
    """
    columns: list[tuple[str, Sequence[str]]] = []
    last, seen = b"", set()
    for number, panel in enumerate(sheet.panels, 1):
        for trace in (one for one in panel.traces if one.name or one.z is not None or one.jobs):
            where = f"{panel.title or number}: {trace.name}".removesuffix(": ")
            x, y, *more = points(trace)
            same = x.tobytes(), y.tobytes(), trace.name, *(values.tobytes() for _, values in more)
            if same in seen:
                continue  # an enlarged view of the same curve
            seen.add(same)
            if x.tobytes() != last:
                columns.append((f"{where}: {panel.x.title}", texts(x)))
                last = x.tobytes()
            columns.append((f"{where}: {panel.y.title}", texts(y)))
            columns += [(f"{where}: {name}", texts(values)) for name, values in more]
            if trace.jobs:
                columns.append((f"{where}: job", trace.jobs))
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([head for head, _ in columns])
    writer.writerows(itertools.zip_longest(*(values for _, values in columns), fillvalue=""))
    return stream.getvalue()


def points(trace: Trace) -> tuple[np.ndarray, np.ndarray, *tuple[tuple[str, np.ndarray], ...]]:
    """x and y of a trace's points, and what else is known of them by its name."""
    if trace.z is not None:
        x, y = (0.5 * (edges[1:] + edges[:-1]) for edges in (trace.x, trace.y))
        z = 10.0**trace.z if trace.log else trace.z
        return np.tile(x, y.size), np.repeat(y, x.size), (trace.scale_name or "value", z.ravel())
    if trace.errors is None:
        return trace.x, trace.y
    below, above = trace.errors
    return trace.x, trace.y, ("below", below), ("above", above)


def texts(values: np.ndarray) -> list[str]:
    """Return the numbers as text, nan as nothing."""
    return ["" if text == "nan" else text for text in np.char.mod("%.8g", values).tolist()]


Names = dict[tuple[str, str, str], str]  # what stands in legends, by how it looks
COLORS = 33  # of a continuous scale
JOBS = "job_keys"  # attribute of an artist whose points are jobs


def with_jobs(artist: Artist, keys: object) -> Artist:
    """Say of which job each point of an artist is: a click on it can then tell of the job.

    keys: in the order of the points, of a map in C order of its cells.
    """
    setattr(artist, JOBS, tuple(map(str, np.ravel(np.asarray(keys, object)))))
    return artist


def look(artist: Any) -> tuple[str, str, str]:
    """By what a legend's entry is like the curve that it names."""
    if isinstance(artist, Line2D):
        dash = artist.get_linestyle() if artist.get_linestyle() not in ("", " ") else "None"
        color = artist.get_color() if dash != "None" else artist.get_markeredgecolor()
        marker = str(artist.get_marker()) if dash == "None" else ""
        return to_hex(color), str(pattern(artist)) if dash != "None" else "None", marker
    return to_hex(artist.get_facecolor()), "patch", ""


def legend_names(figure: Figure) -> Names:
    """Return the names in all legends of a figure, by how their entries look."""
    legends = [*figure.legends, *(own for a in figure.axes if (own := a.get_legend()))]
    found: Names = {}
    for legend in legends:
        for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=False):
            if isinstance(handle, Line2D | Patch):
                found.setdefault(look(handle), text.get_text())
    return found


def every_trace(axes: Axes, named: Names) -> Iterator[Trace]:
    """Yield what the artists of a panel show, in the order in which they were drawn."""
    inside: set[Artist] = set()  # parts of a container, which tells of them
    for container in axes.containers:
        inside |= {*flat(container)}
        if isinstance(container, ErrorbarContainer):
            yield from errorbar(axes, container, named)
        elif isinstance(container, BarContainer):
            yield bars(container, named)
    for artist in sorted(axes.get_children(), key=lambda artist: artist.get_zorder()):
        if artist in inside or not artist.get_visible():
            continue
        for kind, read in READERS:
            if isinstance(artist, kind):
                trace = read(axes, artist, named)
                if trace is not None and trace.y.size:
                    yield trace
                break


def flat(container: Any) -> Iterator[Artist]:
    """Yield all artists of a container."""
    for item in container:
        if isinstance(item, Artist):
            yield item
        elif item is not None:
            yield from flat(item)


def name_of(artist: Any, named: Names) -> str:
    """Return what an artist is called: its label, or the legend's entry that looks alike."""
    return label_of(artist) or (
        named.get(look(artist), "") if isinstance(artist, Line2D | Patch) else ""
    )


def label_of(artist: Any) -> str:
    """Return an artist's own label; "" where matplotlib gave it one."""
    label = str(artist.get_label())
    return "" if label.startswith("_") else label


def jobs_of(artist: object) -> tuple[str, ...]:
    return getattr(artist, JOBS, ())


def pattern(line: Line2D) -> tuple[float, ...]:
    """Return a line's dashes in points: lengths of strokes and gaps; none if it is solid."""
    dashes = line._dash_pattern[1]  # type: ignore[attr-defined]
    return tuple(round(float(d), 2) for d in dashes) if dashes else ()


def in_data(axes: Axes, artist: Artist) -> bool:
    """Return whether an artist's coordinates are those of the axes."""
    return bool(artist.get_transform().contains_branch(axes.transData))


def curve(axes: Axes, line: Any, named: Names) -> Trace | None:
    """Return a line or its markers.

    None for a straight line across the panel, which `notes` has.
    """
    if line.get_transform().contains_branch_seperately(axes.transData) != (True, True):
        return None
    x = np.asarray(np.ma.filled(line.get_xdata(orig=False), np.nan), float)
    y = np.asarray(np.ma.filled(line.get_ydata(orig=False), np.nan), float)
    drawn = line.get_linestyle() not in ("None", "", " ")
    marker = line.get_marker()
    marker = "" if marker in (None, "None", "", " ") else str(marker)
    color = line.get_color() if drawn else line.get_markeredgecolor()
    return Trace(
        "line" if drawn else "points",
        name_of(line, named),
        x,
        y,
        color=to_hex(color),
        width=line.get_linewidth() if drawn else line.get_markersize(),
        dash=pattern(line) if drawn else (),
        marker=marker,
        opacity=1.0 if line.get_alpha() is None else float(line.get_alpha()),
        jobs=jobs_of(line),
    )


def errorbar(axes: Axes, container: ErrorbarContainer, named: Names) -> Iterator[Trace]:
    """Yield the points, or a line, with error bars in y or in x."""
    line, _, collections = container.lines
    label = str(container.get_label())
    if line is None:  # bars without points: lines, where something else has the points
        found = (segments(axes, one, named) for one in collections)
        yield from (trace for trace in found if trace is not None)
        return
    if not collections:
        return
    across = not container.has_yerr
    at = np.array([line.get_ydata(), line.get_xdata()] if across else line.get_data(), float)
    way = 0 if across else 1  # of a segment's ends that differ
    ends = np.full((2, at.shape[1]), np.nan)
    for segment in collections[0].get_segments():
        if len(segment) == 2:
            here = np.flatnonzero((at[0] == segment[0][1 - way]) & np.isfinite(at[1]))
            ends[0, here] = at[1, here] - segment[0][way]
            ends[1, here] = segment[1][way] - at[1, here]
    base = curve(axes, line, named)
    if base is not None:
        name = base.name if label.startswith("_") else label
        fields = vars(base) | {
            "name": name,
            "errors": ends,
            "across": across,
            "jobs": jobs_of(container) or base.jobs,
        }
        yield Trace(**fields)


def bars(container: BarContainer, named: Names) -> Trace:
    """Return the bars, lying (x: where they end, y: where they stand) or standing (x and y
    exchanged).
    """
    patches = container.patches
    lying = container.orientation == "horizontal"
    middles = [
        p.get_y() + p.get_height() / 2 if lying else p.get_x() + p.get_width() / 2 for p in patches
    ]
    ends = [p.get_x() + p.get_width() if lying else p.get_y() + p.get_height() for p in patches]
    label = str(container.get_label())
    name = label if not label.startswith("_") else name_of(patches[0], named) if patches else ""
    errors = None
    if container.errorbar is not None and container.errorbar.lines[2]:
        segments = container.errorbar.lines[2][0].get_segments()
        axis = 0 if lying else 1
        errors = np.array(
            [(end - s[0][axis], s[1][axis] - end) for end, s in zip(ends, segments, strict=False)]
        ).T
    x, y = (ends, middles) if lying else (middles, ends)
    color = to_hex(patches[0].get_facecolor()) if patches else "#000000"
    thick = float(patches[0].get_height() if lying else patches[0].get_width()) if patches else 1.0
    return Trace("bars" if lying else "columns", name, np.array(x, float), np.array(y, float),
                 color=color, errors=errors, across=lying, width=thick,
                 jobs=jobs_of(container))  # fmt: skip


def mesh(axes: Axes, artist: Any, named: Names) -> Trace:
    """Return a map of coloured cells."""
    corners = artist.get_coordinates()
    values = np.ma.filled(artist.get_array().astype(float), np.nan)
    values = values.reshape(corners.shape[0] - 1, corners.shape[1] - 1)
    low, high = artist.norm.vmin, artist.norm.vmax
    log = isinstance(artist.norm, LogNorm)
    if log:
        values, low, high = np.log10(values), np.log10(low), np.log10(high)
    count = artist.cmap.N if artist.cmap.N < COLORS else COLORS
    colors = tuple(to_hex(artist.cmap(share)) for share in np.linspace(0.0, 1.0, count))
    bar = artist.colorbar
    title = "" if bar is None else bar.ax.get_ylabel() or bar.ax.get_xlabel()
    return Trace(
        "map", label_of(artist), corners[0, :, 0], corners[:, 0, 1],
        z=values, color=colors, jobs=jobs_of(artist), limits=(float(low), float(high)), log=log,
        scale_name=title,
    )  # fmt: skip


def scatter(axes: Axes, artist: Any, named: Names) -> Trace | None:
    """Return the points of a scatter diagram."""
    points = np.ma.filled(artist.get_offsets().astype(float), np.nan)
    colors = artist.get_facecolor()
    width = float(np.sqrt(artist.get_sizes()[0])) if len(artist.get_sizes()) else 4.0
    return Trace("points", label_of(artist), points[:, 0], points[:, 1], marker="o",
                 color=first_color(colors), width=width, jobs=jobs_of(artist))  # fmt: skip


def outline(axes: Axes, artist: Any, named: Names) -> Trace | None:
    """Return a filled area between curves."""
    if not in_data(axes, artist) or not artist.get_paths():
        return None
    rings = [path.vertices for path in artist.get_paths() if len(path.vertices)]
    colors = artist.get_facecolor()
    joined = join_with_gaps(rings)
    return Trace("band", label_of(artist), joined[:, 0], joined[:, 1],
                 color=first_color(colors),
                 opacity=float(colors[0][3]) if len(colors) else 0.3)  # fmt: skip


def segments(axes: Axes, artist: Any, named: Names) -> Trace | None:
    """Return many straight lines, such as those of an impact's time and speed."""
    if artist.get_transform().contains_branch_seperately(axes.transData) != (True, True):
        return None
    joined = join_with_gaps([np.asarray(s, float) for s in artist.get_segments()])
    colors = artist.get_color()
    return Trace("line", label_of(artist), joined[:, 0], joined[:, 1],
                 color=first_color(colors), width=float(artist.get_linewidth()[0]))  # fmt: skip


def contour(axes: Axes, artist: Any, named: Names) -> Trace | None:
    """Return the lines of equal value, without a name: they follow from the map that they lie
    on.
    """
    parts = [part for path in artist.get_paths() for part in path.to_polygons(closed_only=False)]
    joined = join_with_gaps([np.asarray(part, float) for part in parts])
    colors = artist.get_edgecolor()
    return Trace("line", "", joined[:, 0], joined[:, 1], color=first_color(colors), width=0.8)


def shape(axes: Axes, artist: Any, named: Names) -> Trace | None:
    """Return the outline of a rectangle, a circle or another shape."""
    if artist is axes.patch or not in_data(axes, artist):
        return None
    transform = artist.get_transform() - axes.transData
    rings = artist.get_path().transformed(transform).to_polygons(closed_only=False)
    joined = join_with_gaps([np.asarray(ring, float) for ring in rings])
    filled = bool(artist.get_fill())
    color = artist.get_facecolor() if filled else artist.get_edgecolor()
    return Trace("band" if filled else "line", name_of(artist, named) if filled else "",
                 joined[:, 0], joined[:, 1], color=to_hex(color),
                 width=artist.get_linewidth(), opacity=float(color[3]))  # fmt: skip


def join_with_gaps(parts: list[np.ndarray]) -> np.ndarray:
    """Return the lines one after the other with a gap of nan between them, shape (n, 2)."""
    gap = np.full((1, 2), np.nan)
    joined = [array for part in parts for array in (part, gap)][:-1]
    return np.concatenate(joined) if joined else np.empty((0, 2))


def first_color(colors: Any) -> str:
    return to_hex(colors[0]) if len(colors) else "#000000"


Reader = Callable[[Axes, Any, Names], Trace | None]


READERS: tuple[tuple[type, Reader], ...] = (
    (Line2D, curve),
    (QuadMesh, mesh),
    (ContourSet, contour),
    (PathCollection, scatter),
    (PolyCollection, outline),
    (LineCollection, segments),
    (Patch, shape),
)


def extract(figure: Figure) -> FigureData:
    """Return the numbers that a figure shows."""
    named = legend_names(figure)
    scales = {bar.ax: bar for bar in colorbars(figure)}
    panels = [axes for axes in figure.axes if axes not in scales and axes.get_visible()]
    grid = next(
        (axes.get_gridspec() for axes in panels if axes.get_gridspec() is not None), None
    )  # fmt: skip
    shared = [getattr(figure, f"_sup{way}label", None) for way in "xy"]
    titles = [text.get_text() if text is not None else "" for text in shared]
    found = tuple(panel(axes, named, titles) for axes in panels)
    heights, widths = ((1.0,), (1.0,)) if grid is None else ratios(grid)
    width, height = figure.get_size_inches()
    return FigureData(found, heights, widths, (float(width), float(height)))


def ratios(grid: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the heights of a grid's rows and the widths of its columns."""
    rows, columns = grid.get_geometry()
    heights, widths = grid.get_height_ratios(), grid.get_width_ratios()
    return (
        tuple(map(float, heights if heights is not None else [1.0] * rows)),
        tuple(map(float, widths if widths is not None else [1.0] * columns)),
    )


def colorbars(figure: Figure) -> Iterator[Any]:
    """Yield the colour bars of a figure."""
    for axes in figure.axes:
        bar = getattr(axes, "_colorbar", None)
        if bar is not None:
            yield bar


def panel(axes: Axes, named: Names, shared: list[str]) -> Panel:
    """Return one of a figure's axes; shared: titles of the figure's x and y axes, "" without."""
    spec = axes.get_subplotspec()
    row, column = (spec.rowspan, spec.colspan) if spec else (range(1), range(1))
    traces = tuple(trace for trace in every_trace(axes, named))
    title = axes.get_title("left") or axes.get_title() or axes.get_title("right")
    return Panel(
        strip_mathtext(title),
        scale(axes.xaxis, axes.get_xlabel() or shared[0], axes.get_xlim(), axes.get_xscale()),
        scale(axes.yaxis, axes.get_ylabel() or shared[1], axes.get_ylim(), axes.get_yscale()),
        (row.start, row.stop),
        (column.start, column.stop),
        traces,
        tuple(notes(axes)),
        axes.get_aspect() == 1.0,
    )


def scale(axis: Any, title: str, limits: tuple[float, float], kind: str) -> Scale:
    """Return an axis; words at its ticks where these are no numbers."""
    words = {}
    if axis.get_major_formatter().__class__.__name__ in ("FixedFormatter", "FuncFormatter"):
        places = axis.get_majorticklocs()
        texts = axis.get_major_formatter().format_ticks(places)
        words = {
            float(place): strip_mathtext(text)
            for place, text in zip(places, texts, strict=False)
            if text
        }
        if all(is_number(text) for text in words.values()):
            words = {}
    low, high = map(float, limits)
    locator = axis.get_major_locator()
    step = 0.0
    if isinstance(locator, MultipleLocator):
        first, second, *_ = locator.tick_values(low, high)
        step = float(second - first)
    shown = axis.get_tick_params(which="major")
    bare = not shown.get("labelleft" if axis.axis_name == "y" else "labelbottom", True)
    return Scale(strip_mathtext(title), low, high, kind == "log", words, step, bare)


def strip_mathtext(title: str) -> str:
    """Return a title in one line, without the marks of mathematical letters."""
    return " ".join(title.replace("$", "").split())


def is_number(text: str) -> bool:
    try:
        float(text.replace("−", "-"))
    except ValueError:
        return False
    return True


def notes(axes: Axes) -> Iterator[PanelText]:
    """Yield the texts in a panel, and straight lines across it."""
    for text in axes.texts:
        words = " ".join(text.get_text().split())
        if words and text.get_visible():
            x, y = map(float, text.get_position())
            if isinstance(text, Annotation) and text.xycoords == "data":
                x, y = map(float, text.xy)
                yield PanelText(words, x, y, to_hex(text.get_color()))
            elif isinstance(text, Annotation) and isinstance(text.xycoords, Transform):
                place = text.xycoords.transform(text.xy)
                x, y = map(float, axes.transAxes.inverted().transform(place))
                yield PanelText(words, x, y, to_hex(text.get_color()), inside=True)
            else:
                inside = not in_data(axes, text)
                yield PanelText(words, x, y, to_hex(text.get_color()), inside=inside)
    for line in axes.lines:
        own = line.get_transform().contains_branch_seperately(axes.transData)
        if own == (True, False):
            yield PanelText("", first(line.get_xdata()), color=to_hex(line.get_color()),
                       dash=pattern(line))  # fmt: skip
        elif own == (False, True):
            yield PanelText("", y=first(line.get_ydata()), color=to_hex(line.get_color()),
                       dash=pattern(line))  # fmt: skip


def first(values: Any) -> float:
    return float(np.ravel(values)[0])

"""Figures as data: what is drawn, as numbers, words and styles, before any library draws it.

A figure function returns a `Drawing`. `picture` makes PNG and SVG of it, `as_csv` its table, and
`report/interactive` the script of the page.
"""

import csv
import io
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from compressor.report.figures.style import LineStyle

WIDTH = 9.6  # inches, of every figure
LINE_MARGIN = 0.05  # of a panel's height, above and below its curves
Way = Literal["x", "y"]  # an axis
WAYS: tuple[Way, Way] = ("x", "y")
UNKNOWN = math.nan  # a limit that follows from what is drawn


@dataclass(frozen=True)
class ColorScale:
    """The colours of a map's values, from `low` to `high`, and the bar that says what they mean.

    side: of the panel at which the bar is, "" without one; `beside_column`: it is that of all
    panels in the column; levels: values with a line on the bar; pointed: values lie beyond the
    ends; bar_title: where it is not `title`, the name of the values.
    """

    colors: tuple[str, ...]
    low: float
    high: float
    log: bool = False
    title: str = ""
    side: str = "right"
    aspect: float = 14.0
    beside_column: bool = False
    levels: tuple[float, ...] = ()
    ticks: tuple[float, ...] | None = None
    pointed: bool = False
    bar_title: str = ""


@dataclass(frozen=True, eq=False)
class Trace:
    """What is drawn at x and y, in the units of its panel's axes.

    kind: `line` (a line, its marks or both), `band` (filled outlines with nan between them),
    `bars` (x from 0, at y), `columns` (y from `foot`, at x), `map` (`z` over the edges x and y;
    nan: no cell). A name of "" stands in no table. errors: (below, above), shape (2, n), in y, or
    in x where `across`; caps: length of their ends in points. jobs: the key of each point's job.
    thick: of bars and columns.
    """

    x: np.ndarray
    y: np.ndarray
    style: LineStyle
    name: str = ""
    kind: str = "line"
    errors: np.ndarray | None = None
    across: bool = False
    caps: float = 2.0
    jobs: tuple[str, ...] = ()
    thick: float | np.ndarray = 1.0
    foot: np.ndarray | None = None
    z: np.ndarray | None = None
    scale: ColorScale | None = None

    @property
    def is_points(self) -> bool:
        """Return whether it is marks without a line."""
        return self.kind == "line" and self.style.linestyle == "none"

    def extent(self, way: Way) -> np.ndarray:
        """Return the values that a panel must show of it along the axis `x` or `y`."""
        at = self.x if way == "x" else self.y
        if self.kind in ("bars", "columns"):
            half = np.asarray(self.thick) / 2.0
            rises = (self.kind == "bars") == (way == "x")
            foot = np.zeros(1) if self.foot is None else self.foot
            ends = [at, foot] if rises else [at - half, at + half]
        else:
            whole = self.kind == "map" or np.isfinite(self.x) & np.isfinite(self.y)
            ends = [np.where(whole, at, np.nan)]
            if self.errors is not None and self.across == (way == "x"):
                ends += [ends[0] - self.errors[0], ends[0] + self.errors[1]]
        return np.concatenate(ends)


def entry(name: str, style: LineStyle, kind: str = "line") -> Trace:
    """Return a trace without points, which stands in a legend alone."""
    return Trace(np.empty(0), np.empty(0), style, name, kind)


def band(
    x: np.ndarray, low: np.ndarray, high: np.ndarray, style: LineStyle, name: str = ""
) -> Trace:
    """Return the area between two curves over x."""
    around = np.concatenate([x[:1], x, x[-1:], x[::-1], x[:1]])
    edge = np.concatenate([high[:1], low, high[-1:], high[::-1], high[:1]])
    return Trace(around, edge, style, name, "band")


def map_cells(
    x: np.ndarray, y: np.ndarray, z: np.ndarray, scale: ColorScale, name: str = "", **more: Any
) -> Trace:
    """Return a map of z, shape (rows, columns), over the edges of columns and rows."""
    return Trace(x, y, LineStyle("#000000", zorder=1.0), name, "map", z=z, scale=scale, **more)


def box(x: tuple[float, float], y: tuple[float, float], style: LineStyle, kind: str) -> Trace:
    """Return a rectangle, as a `line` or as a `band`."""
    (left, right), (low, high) = x, y
    across = np.array([left, right, right, left, left])
    return Trace(across, np.array([low, low, high, high, low]), style, kind=kind)


def circle(radius: float, style: LineStyle, kind: str) -> Trace:
    """Return a circle around the origin, as a `line` or as a `band`."""
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    return Trace(radius * np.cos(turn), radius * np.sin(turn), style, kind=kind)


def join_with_gaps(parts: Iterable[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of lines, shape (n, 2) each, one after the other with nan between them."""
    gap = np.full((1, 2), np.nan)
    joined = [array for part in parts for array in (part, gap)][:-1]
    x, y = np.concatenate(joined).T if joined else np.empty((2, 0))
    return x, y


def thin_places(size: int, most: int) -> np.ndarray:
    """Return at most `most` evenly chosen numbers below a size, with both ends."""
    return (
        np.arange(size) if size <= most else np.unique(np.linspace(0, size - 1, most).astype(int))
    )


def midway(centres: np.ndarray, is_log: bool = False) -> np.ndarray:
    """Return the edges between cells: halfway, on a log scale by ratio; outer cells are symmetric.

    centres: in rising order.
    """
    at = np.log(centres) if is_log else centres
    middle = 0.5 * (at[1:] + at[:-1])
    first, last = (2.0 * at[0] - middle[0], 2.0 * at[-1] - middle[-1]) if at.size > 1 else (
        at[0] - 0.5, at[0] + 0.5,
    )  # fmt: skip
    edges = np.concatenate([[first], middle, [last]])
    return np.exp(edges) if is_log else edges


def strokes(x: np.ndarray, low: np.ndarray | float, high: np.ndarray, style: LineStyle) -> Trace:
    """Return a vertical line from `low` to `high` at each x."""
    lows = np.broadcast_to(low, np.shape(x))
    lines = np.stack([np.stack([x, lows], axis=1), np.stack([x, high], axis=1)], axis=1)
    x, y = join_with_gaps(lines)
    return Trace(x, y, style)


@dataclass(frozen=True)
class Note:
    """A text at x and y, with `tail` an arrow to it, or a straight line across the panel.

    A line stands at x or at y; the other is nan. inside: the axes, of "xy", along which the place
    is a share of the panel; shift: in points; side and level: of the text at its place.
    """

    text: str = ""
    x: float = math.nan
    y: float = math.nan
    style: LineStyle = field(default_factory=lambda: LineStyle("#000000"))
    inside: str = ""
    shift: tuple[float, float] = (0.0, 0.0)
    side: str = "left"
    level: str = "baseline"
    size: float | None = None
    tail: tuple[float, float] | None = None

    @property
    def is_line(self) -> bool:
        """Return whether it is a straight line across the panel."""
        return not self.text and self.tail is None


@dataclass
class Scale:
    """An axis: its title, what is shown of it, and what stands at its ticks.

    low, high: `UNKNOWN` where they follow from what is drawn; margin: beyond that, a share; words:
    by the places where they stand; ticks: places of numbers; step: between two ticks; max_ticks:
    how many there may be; bare: without numbers, which stand beside; plain: a log scale's ticks
    are plain numbers.
    """

    title: str = ""
    low: float = UNKNOWN
    high: float = UNKNOWN
    log: bool = False
    words: Mapping[float, str] = field(default_factory=dict)
    ticks: Sequence[float] | None = None
    step: float = 0.0
    max_ticks: int = 0
    bare: bool = False
    plain: bool = False
    margin: float = 0.0

    def span(self, low: float = UNKNOWN, high: float = UNKNOWN) -> None:
        """Show what lies between two values; one that is not given stays as it is."""
        self.low = self.low if math.isnan(low) else float(low)
        self.high = self.high if math.isnan(high) else float(high)

    def name(self, words: Sequence[str]) -> None:
        """Set words as ticks at 0, 1, 2 and so on."""
        self.words = {float(place): word for place, word in enumerate(words)}


@dataclass(eq=False)
class Panel:
    """One of a figure's axes, and what is drawn in it.

    row, column: of the grid, first and behind the last. grid: the axes that have grid lines;
    ground: the panel's own filling; legend: traces named below it.
    """

    row: tuple[int, int]
    column: tuple[int, int]
    title: str = ""
    x: Scale = field(default_factory=Scale)
    y: Scale = field(default_factory=lambda: Scale(margin=LINE_MARGIN))
    traces: list[Trace] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    is_square: bool = False  # the units of both axes are as long
    fills_box: bool = False  # of a square one: it shows more rather than being smaller
    grid: str = "xy"
    ground: LineStyle | None = None
    legend: list[Trace] = field(default_factory=list)
    title_size: float = 10.0

    def plot(
        self, x: ArrayLike, y: ArrayLike, style: LineStyle, name: str = "", **more: Any
    ) -> None:
        """Draw a line or marks, or of a number a mark; `more` of `Trace`."""
        x, y = (np.atleast_1d(np.asarray(values, float)) for values in (x, y))
        self.traces.append(Trace(x, y, style, name, **more))

    @property
    def traces_in_order(self) -> list[Trace]:
        """Return the traces as the page and the table have them: bars first, then the lowest."""
        first = {"bars", "columns"}
        return sorted(
            self.traces, key=lambda t: (t.kind not in first and t.errors is None, t.style.zorder)
        )

    def limits(self, way: Way) -> tuple[float, float]:
        """Return the ends of the axis `x` or `y`."""
        return shared_limits([self], way)


def is_in_table(trace: Trace) -> bool:
    """Return whether a trace has columns of the table: it has points, and a name or jobs."""
    return trace.x.size > 0 and bool(trace.name or trace.z is not None or trace.jobs)


def shared_limits(panels: Sequence[Panel], way: Way) -> tuple[float, float]:
    """Return the ends of an axis that panels share: what the first says, or what all show."""
    scale: Scale = getattr(panels[0], way)
    if not math.isnan(scale.low + scale.high):
        return scale.low, scale.high
    traces = [trace for panel in panels for trace in panel.traces]
    lines = [getattr(note, way) for panel in panels for note in panel.notes if note.is_line]
    values = np.concatenate([lines, *(trace.extent(way) for trace in traces)])
    values = values[np.isfinite(values)]
    if scale.log:
        values = np.log(values[values > 0.0])
    low, high = (values.min(), values.max()) if values.size else (0.0, 1.0)
    if high - low <= 1e-15 * max(abs(low), abs(high)):
        room = math.log(10.0) if scale.log else 0.05 * abs(low) or 0.05
        low, high = low - room, high + room
    is_map = any(trace.kind == "map" for trace in traces)
    room = 0.0 if is_map else scale.margin * (high - low)
    low, high = low - room, high + room
    if scale.log:
        low, high = math.exp(low), math.exp(high)
    return (
        float(low) if math.isnan(scale.low) else scale.low,
        float(high) if math.isnan(scale.high) else scale.high,
    )


def share_scales(panels: Iterable[Panel], *ways: Way) -> None:
    """Set one scale along `x`, `y` or both for panels: that of the first.

    Only the outermost have numbers: of x these are the lowest of a column, of y the first of a row.
    """
    panels = list(panels)
    for way in ways:
        ends = shared_limits(panels, way)
        first = getattr(panels[0], way)
        for panel in panels:
            if way == "x":
                inner = any(o.column == panel.column and o.row > panel.row for o in panels)
            else:
                inner = any(o.row == panel.row and o.column < panel.column for o in panels)
            own = replace(first, title=getattr(panel, way).title, bare=inner)
            own.span(*ends)
            setattr(panel, way, own)


@dataclass(eq=False)
class Drawing:
    """A figure; heights and widths: of the grid's rows and columns, relative to each other.

    height: in inches; x_title, y_title: of all panels; legend: traces that are named above them.
    """

    panels: list[Panel]
    height: float
    heights: tuple[float, ...] = (1.0,)
    widths: tuple[float, ...] = (1.0,)
    width: float = WIDTH
    x_title: str = ""
    y_title: str = ""
    legend: list[Trace] = field(default_factory=list)
    title: str = ""  # above all, in lines


def make_grid(
    rows: int,
    columns: int,
    height: float,
    count: int = 0,
    heights: Sequence[float] = (),
    widths: Sequence[float] = (),
) -> tuple[Drawing, np.ndarray]:
    """Return a drawing of empty panels, and these, shape (rows, columns).

    height: of all, in inches; count: of the panels that are there, from the first.
    """
    grid = np.empty((rows, columns), object)
    for row, column in itertools.product(range(rows), range(columns)):
        grid[row, column] = Panel((row, row + 1), (column, column + 1))
    panels = [*grid.flat][: count or None]
    sizes = tuple(heights) or (1.0,) * rows, tuple(widths) or (1.0,) * columns
    return Drawing(panels, height, *sizes), grid


def one_line(title: str) -> str:
    """Return a title in one line, without the marks of mathematical letters."""
    return " ".join(title.replace("$", "").split())


def axis_title(drawing: Drawing, panel: Panel, way: Way) -> str:
    """Return the title of a panel's axis `x` or `y`: its own, or that of the figure."""
    own = getattr(panel, way).title
    return one_line(own or (drawing.x_title if way == "x" else drawing.y_title))


def shared_title(drawing: Drawing, panel: Panel, way: Way) -> str:
    """Return the title of a panel's axis, or of the one below or beside it that has its numbers."""
    if way == "x":
        alike = [p for p in drawing.panels if p.column == panel.column and p.row >= panel.row]
    else:
        alike = [p for p in drawing.panels if p is panel or (panel.y.bare and p.row == panel.row)]
    return next((title for one in alike if (title := axis_title(drawing, one, way))), "")


def as_csv(drawing: Drawing) -> str:
    """Return all numbers of a figure. Curves over the same x share a column of it, and stand once.

    Points of the same jobs share the column of the jobs' keys, across panels. A column is headed
    "panel: curve: title of the axis", with " below" and " above" for the ends of error bars,
    counted from the value. A map has a row a cell, x and y in its middle.
    """
    columns: list[tuple[str, Sequence[str]]] = []
    last, seen = ("", b""), set()
    last_jobs: tuple[str, ...] = ()
    for number, panel in enumerate(drawing.panels, 1):
        x_title, y_title = (shared_title(drawing, panel, way) for way in WAYS)
        for trace in filter(is_in_table, panel.traces_in_order):
            where = f"{one_line(panel.title) or number}: {trace.name}".removesuffix(": ")
            x, y, *more = points(trace)
            same = x.tobytes(), y.tobytes(), trace.name, *(values.tobytes() for _, values in more)
            if same in seen:
                continue  # an enlarged view of the same curve
            seen.add(same)
            if (x_title, x.tobytes()) != last:
                columns.append((f"{where}: {x_title}", texts(x)))
                last = x_title, x.tobytes()
            columns.append((f"{where}: {y_title}", texts(y)))
            columns += [(f"{where}: {name}", texts(values)) for name, values in more]
            if trace.jobs and trace.jobs != last_jobs:
                columns.append((f"{where}: job", trace.jobs))
                last_jobs = trace.jobs
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([head for head, _ in columns])
    writer.writerows(itertools.zip_longest(*(values for _, values in columns), fillvalue=""))
    return stream.getvalue()


def points(trace: Trace) -> tuple[np.ndarray, np.ndarray, *tuple[tuple[str, np.ndarray], ...]]:
    """Return x and y of a trace's points, and what else is known of them by its name."""
    if trace.z is not None:
        x, y = (0.5 * (edges[1:] + edges[:-1]) for edges in (trace.x, trace.y))
        title = trace.scale.title if trace.scale else ""
        return np.tile(x, y.size), np.repeat(y, x.size), (title or "value", trace.z.ravel())
    if trace.errors is None:
        return trace.x, trace.y
    below, above = trace.errors
    return trace.x, trace.y, ("below", below), ("above", above)


def texts(values: np.ndarray) -> list[str]:
    """Return the numbers as text, nan as nothing."""
    return ["" if text == "nan" else text for text in np.char.mod("%.8g", values).tolist()]

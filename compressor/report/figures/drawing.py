"""Figures as plotly's own `Figure`: a grid of panels to fill, and what is read of one again.

A figure function fills the panels of a `Drawing`, each axis in the unit that is wanted, and returns
`drawing.figure()`. `picture` makes the PNG of that, `as_csv` its table, and `report/interactive`
the script of the page.
"""

import csv
import io
import itertools
import math
from collections.abc import Iterable, Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from compressor.report.figures.style import BLACK, PIXEL, LineStyle
from compressor.units import Units, unit_in

WIDTH = 960  # pixels, of every figure
INCH = 100  # pixels
ROOM = 0.05  # of a panel, above and below its curves, and beside marks
GAP = 0.07  # between panels, of the figure
Way = Literal["x", "y"]  # an axis
WAYS: tuple[Way, Way] = ("x", "y")
PlotlyFigure: TypeAlias = go.Figure
Axis: TypeAlias = Any  # of plotly: go.layout.XAxis or YAxis
Trace: TypeAlias = Any  # of plotly: go.Scatter, go.Bar or go.Heatmap


class Panel:
    """One of a figure's axes, while it is filled; row, column: of the grid, first and behind.

    `x` and `y` are plotly's axes. What is drawn is in the units that `label` is given, and becomes
    multiples of those in which the axes are read.
    """

    def __init__(self, row: tuple[int, int], column: tuple[int, int], units: Units = "usual"):
        self.row, self.column, self.units = row, column, units
        self.title, self.is_square = "", False
        self.x, self.y = go.layout.XAxis(), go.layout.YAxis()
        self.ends = dict.fromkeys(WAYS, (math.nan, math.nan))  # of axes, where they are chosen
        self.factors, self.unit = dict.fromkeys(WAYS, 1.0), dict.fromkeys(WAYS, "")
        self.traces: list[tuple[float, Trace]] = []  # with the height at which each lies
        self.notes: list[go.layout.Annotation] = []
        self.rules: list[go.layout.Shape] = []

    def axis(self, way: Way) -> Axis:
        """Return the axis `x` or `y`."""
        return self.x if way == "x" else self.y

    def label(self, way: Way, title: str, unit: str = "") -> None:
        """Name an axis before anything is drawn; `{}` in the title stands for the unit."""
        assert not self.traces, "what is drawn already would stay in another unit"
        self.unit[way], self.factors[way] = unit_in(unit, self.units)
        self.axis(way).title = title.format(self.unit[way])

    def at(self, way: Way, values: ArrayLike) -> np.ndarray:
        """Return places along an axis as they are read there."""
        return self.factors[way] * np.atleast_1d(np.asarray(values, float))

    def add(self, made: Trace, height: float, jobs: Sequence[str]) -> None:
        """Add what is drawn at a height; jobs: the keys of its points."""
        if jobs:
            made.customdata = np.reshape(jobs, made.z.shape if made.type == "heatmap" else -1)
        made.legendrank = 1000 + len(self.traces)
        self.traces.append((height, made))

    def in_order(self) -> list[Trace]:
        """Return what is drawn from the lowest to the highest, bars first."""
        ordered = sorted(self.traces, key=lambda one: (one[1].type != "bar", one[0]))
        return [trace for _, trace in ordered]

    def plot(
        self, x: ArrayLike, y: ArrayLike, style: LineStyle, name: str = "",
        errors: np.ndarray | None = None, jobs: Sequence[str] = (), listed: bool = True,
    ) -> None:  # fmt: skip
        """Draw a line, its marks or both; errors: below and above in y, shape (2, n).

        jobs: the key of each point's job; listed: in the legend by its name, if it has one.
        """
        made = go.Scatter(
            x=self.at("x", x), y=self.at("y", y), name=name, opacity=style.alpha,
            showlegend=listed and bool(name), line=style.line,
            marker=style.marks if style.marker else None,
            mode="+".join(["lines"] * bool(style.linewidth) + ["markers"] * bool(style.marker)),
        )  # fmt: skip
        if errors is not None:
            made.error_y = error_bars(self.factors["y"] * errors)
        self.add(made, style.zorder, jobs)

    def fill(
        self, x: ArrayLike, y: ArrayLike, style: LineStyle, name: str = "", listed: bool = True
    ) -> None:
        """Draw an area by its outlines, with nan between two of them."""
        made = go.Scatter(
            x=self.at("x", x), y=self.at("y", y), name=name, opacity=style.alpha, mode="none",
            fill="toself", fillcolor=style.color, showlegend=listed and bool(name),
        )  # fmt: skip
        if style.is_hatched:
            made.fillpattern = {"shape": "/", "fgcolor": style.edge, "bgcolor": style.color}
        self.add(made, style.zorder, ())

    def box(self, x: tuple[float, float], y: tuple[float, float], style: LineStyle) -> None:
        """Draw a rectangle as a line."""
        (left, right), (low, high) = x, y
        self.plot([left, right, right, left, left], [low, low, high, high, low], style)

    def between(self, x: np.ndarray, low: np.ndarray, high: np.ndarray, style: LineStyle) -> None:
        """Draw the area between two curves over x."""
        self.fill(np.concatenate([x, x[::-1]]), np.concatenate([low, high[::-1]]), style)

    def strokes(self, x: np.ndarray, low: float, high: np.ndarray, style: LineStyle) -> None:
        """Draw a vertical line from `low` to `high` at each x."""
        lows = np.full(np.shape(x), low)
        lines = np.stack([np.stack([x, lows], axis=1), np.stack([x, high], axis=1)], axis=1)
        self.plot(*join_with_gaps(lines), style)

    def bars(
        self, x: ArrayLike, y: ArrayLike, style: LineStyle, name: str = "", thick: ArrayLike = 1.0,
        foot: ArrayLike = 0.0, is_upright: bool = False, errors: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        """Draw bars from `foot` to x, at y, or upright ones to y; errors: below and above."""
        along: Way = "y" if is_upright else "x"
        ends = {"x": self.at("x", x), "y": self.at("y", y)}
        thick = self.at("x" if is_upright else "y", thick)
        _, base, width = np.broadcast_arrays(ends[along], self.at(along, foot), thick)
        ends[along] = ends[along] - base
        made = go.Bar(
            **ends, name=name, orientation="v" if is_upright else "h", base=base.tolist(),
            width=width.copy(), marker={"color": style.color}, showlegend=bool(name),
        )  # fmt: skip
        if errors is not None:
            made[f"error_{along}"] = error_bars(self.factors[along] * errors)
        self.add(made, style.zorder, ())

    def map(
        self, x: np.ndarray, y: np.ndarray, z: np.ndarray, colors: Sequence[str],
        ends: tuple[float, float], title: str = "", unit: str = "", is_log: bool = False,
        name: str = "", jobs: Sequence[str] = (), has_scale: bool = True,
    ) -> None:  # fmt: skip
        """Draw a map of z, shape (rows, columns), over the edges of columns and rows.

        colors: from the first to the second of `ends`, with steps if there are a few; title, with
        `{}` for the unit: of their scale. On a log scale z becomes its logarithm.
        """
        unit, factor = unit_in(unit, self.units)
        values, (low, high) = factor * z, (factor * end for end in ends)
        scale: dict[str, Any] = {"title": {"text": title.format(unit), "side": "right"}}
        text = None
        if is_log:
            text = np.char.mod("%.4g", values)
            values, low, high = np.log10(values), math.log10(low), math.log10(high)
            at = log_ticks(low, high)
            scale |= {
                "tickvals": at,
                "ticktext": [f"{float(f'{10.0**tick:.3g}'):g}" for tick in at],
            }
        made = go.Heatmap(
            x=self.at("x", x), y=self.at("y", y), z=values, zmin=low, zmax=high, name=name,
            colorscale=color_stops(colors), colorbar=scale, showscale=has_scale, text=text,
        )  # fmt: skip
        self.add(made, 1.0, jobs)

    def write(
        self, text: str, x: float, y: float, color: str = BLACK, inside: str = "",
        shift: tuple[float, float] = (0.0, 0.0), side: str = "left", level: str = "bottom",
        size: float = 9.5,
    ) -> None:  # fmt: skip
        """Write a text at x and y, shares of the panel along the axes in `inside`, such as "xy".

        shift: in points; side, level: of the text at its place; size: of its letters, in points.
        """
        frames = {f"{way}ref": f"{way} domain" if way in inside else way for way in WAYS}
        at = (share if way in inside else float(self.at(way, share)[0])
              for way, share in zip(WAYS, (x, y), strict=True))  # fmt: skip
        place = dict(zip(WAYS, at, strict=True)) | frames
        self.notes.append(go.layout.Annotation(
            text=text.replace("\n", "<br>"), **place, showarrow=False, xanchor=side, yanchor=level,
            xshift=PIXEL * shift[0], yshift=PIXEL * shift[1], align="left",
            font={"color": color, "size": PIXEL * size},
        ))  # fmt: skip

    def point_to(self, x: float, y: float, tail: tuple[float, float], color: str) -> None:
        """Draw an arrow from its tail to x and y."""
        start = {f"a{way}": float(self.at(way, at)[0]) for way, at in zip(WAYS, tail, strict=True)}
        self.notes.append(go.layout.Annotation(
            text="", x=float(self.at("x", x)[0]), y=float(self.at("y", y)[0]), **start, xref="x",
            yref="y", axref="x", ayref="y", showarrow=True, arrowhead=2, arrowcolor=color,
        ))  # fmt: skip

    def rule(self, style: LineStyle, x: float = math.nan, y: float = math.nan) -> None:
        """Draw a straight line across the panel, at x or at y."""
        way: Way = "x" if math.isnan(y) else "y"
        other = WAYS[way == "x"]
        at = float(self.at(way, x if way == "x" else y)[0])
        self.rules.append(go.layout.Shape(
            {f"{way}0": at, f"{way}1": at, f"{way}ref": way, f"{other}0": 0.0, f"{other}1": 1.0,
             f"{other}ref": f"{other} domain"},
            type="line", line={**style.line, "width": max(1.0, style.line["width"])},
            layer="below" if style.zorder < 1.0 else "above",
        ))  # fmt: skip

    def span(self, way: Way, low: float = math.nan, high: float = math.nan) -> None:
        """Show what lies between two values; one that is not given follows from what is drawn."""
        given = (self.factors[way] * low, self.factors[way] * high)
        low, high = (old if math.isnan(new) else float(new)
                     for old, new in zip(self.ends[way], given, strict=True))  # fmt: skip
        self.ends[way] = low, high

    def name_ticks(self, way: Way, words: Sequence[str], places: ArrayLike = ()) -> None:
        """Set words as ticks at places, or at 0, 1, 2 and so on."""
        axis = self.axis(way)
        axis.tickvals = np.asarray(places, float).tolist() or [*range(len(words))]
        axis.ticktext = [word.replace("\n", "<br>") for word in words]

    def limits(self, way: Way) -> tuple[float, float]:
        """Return the ends of an axis, in the unit of the values that are drawn."""
        low, high = shared_limits([self], way)
        return low / self.factors[way], high / self.factors[way]


def error_bars(ends: np.ndarray) -> dict[str, Any]:
    """Return plotly's description of error bars: below and above, shape (2, n)."""
    below, above = ends
    return {"array": above, "arrayminus": below, "symmetric": False, "width": 3, "thickness": 1.2}


def color_stops(colors: Sequence[str]) -> list[tuple[float, str]]:
    """Return a scale of colours as plotly has it: a few as steps, many as a ramp."""
    count = len(colors)
    if count < 33:
        return [(n / count, c) for k, c in enumerate(colors) for n in (k, k + 1)]
    return [(n / (count - 1), color) for n, color in enumerate(colors)]


def log_ticks(low: float, high: float) -> list[float]:
    """Return logarithms between two at which a scale has ticks: of ones, and of threes if few."""
    ends = (0.0, math.log10(3.0)) if high - low < 3.0 else (0.0,)
    step = max(1, math.ceil((high - low) / 7.0))
    tens = range(math.floor(low), math.floor(high) + 1, step)
    found = [ten + end for ten in tens for end in ends if low <= ten + end <= high]
    return found if len(found) > 1 else [low, high]


def extent(trace: Trace, way: Way) -> np.ndarray:
    """Return the values that a panel must show of a trace along an axis."""
    if isinstance(trace, go.Bar):
        along = "x" if trace.orientation == "h" else "y"
        at = np.asarray(trace[way])
        if way == along:
            return np.concatenate([trace.base, np.add(trace.base, at)])
        return np.concatenate([at - trace.width / 2.0, at + trace.width / 2.0])
    if isinstance(trace, go.Heatmap):
        return trace[way]
    at = np.where(np.isfinite(trace.x) & np.isfinite(trace.y), trace[way], np.nan)
    if way == "y" and trace.error_y.array is not None:
        return np.concatenate([at - trace.error_y.arrayminus, at + trace.error_y.array])
    return at


def shared_limits(panels: Sequence[Panel], way: Way) -> tuple[float, float]:
    """Return the ends of an axis that panels share: what the first says, or what all show."""
    first, ends = panels[0], panels[0].ends[way]
    if not math.isnan(sum(ends)):
        return ends
    traces = [trace for panel in panels for _, trace in panel.traces]
    rules = [rule[f"{way}0"] for panel in panels for rule in panel.rules
             if rule[f"{way}ref"] == way]  # fmt: skip
    values = np.concatenate([rules, *(extent(trace, way) for trace in traces)])
    values = values[np.isfinite(values)]
    is_log = first.axis(way).type == "log"
    if is_log:
        values = np.log(values[values > 0.0])
    low, high = (values.min(), values.max()) if values.size else (0.0, 1.0)
    if high - low <= 1e-15 * max(abs(low), abs(high)):
        room = math.log(10.0) if is_log else ROOM * abs(low) or ROOM
        low, high = low - room, high + room
    is_map = any(isinstance(trace, go.Heatmap) for trace in traces)
    is_marked = any(isinstance(one, go.Scatter) and "markers" in one.mode for one in traces)
    room = 0.0 if is_map or (way == "x" and not is_marked) else ROOM * (high - low)
    low, high = low - room, high + room
    if is_log:
        low, high = math.exp(low), math.exp(high)
    low, high = (float(one) if math.isnan(end) else end
                 for one, end in zip((low, high), ends, strict=True))  # fmt: skip
    return low, high


def share_scales(panels: Iterable[Panel], *ways: Way) -> None:
    """Set one scale along `x`, `y` or both for panels: that of the first.

    Only the outermost have numbers and a title: of x the lowest of a column, of y the first of a
    row.
    """
    panels = list(panels)
    for way in ways:
        ends = shared_limits(panels, way)
        look = panels[0].axis(way).to_plotly_json()
        for panel in panels:
            if way == "x":
                inner = any(o.column == panel.column and o.row > panel.row for o in panels)
            else:
                inner = any(o.row == panel.row and o.column < panel.column for o in panels)
            axis = panel.axis(way)
            axis.update(look | {"title": {"text": "" if inner else axis.title.text}})
            axis.showticklabels = not inner
            panel.ends[way] = ends


class Drawing:
    """A grid of panels that becomes a figure; rows, columns: their sizes, relative to each other.

    height: of the figure, in inches; title: above all, in lines.
    """

    def __init__(
        self, height: float, rows: Sequence[float], columns: Sequence[float], panels: list[Panel]
    ) -> None:
        self.height, self.rows, self.columns, self.panels = height, rows, columns, panels
        self.title = ""

    def list_area(self, name: str, style: LineStyle) -> None:
        """Name an area in the legend, whether one is drawn or not."""
        self.panels[0].fill([math.nan], [math.nan], style, name)

    def list_line(self, name: str, style: LineStyle) -> None:
        """Name a line or marks in the legend, whether some are drawn or not."""
        self.panels[0].plot([math.nan], [math.nan], style, name)

    def label_outside(self, way: Way, title: str) -> None:
        """Name the axis `x` of the lowest panel of each column, or `y` of the first of each row."""
        for panel in self.panels:
            if way == "x":
                inner = any(o.column == panel.column and o.row > panel.row for o in self.panels)
            else:
                inner = any(o.row == panel.row and o.column < panel.column for o in self.panels)
            panel.axis(way).title = "" if inner else title

    def figure(self) -> go.Figure:
        """Return the figure: panels with their ranges, and each name once in a legend.

        The traces of a panel lie in it in their order, bars first. Axes that show the same span of
        the same quantity are zoomed together. `meta`: the grid, for a page that is narrower, and
        the units of x.
        """
        layout: dict[str, Any] = {}
        data: list[Trace] = []
        notes: list[go.layout.Annotation] = []
        links: dict[tuple, str] = {}
        for number, panel in enumerate(self.panels):
            suffix = f"{number + 1}" if number else ""
            for way, other in zip(WAYS, WAYS[::-1], strict=True):
                axis, ends = panel.axis(way), shared_limits([panel], way)
                is_log = axis.type == "log"
                axis.range = [math.log10(end) for end in ends] if is_log else ends
                axis.anchor, axis.domain = other + suffix, self.domain(panel, way)
                key = way, ends, is_log, axis.title.text if way == "y" else ""
                link = links.setdefault(key, way + suffix)
                axis.matches = link if link != way + suffix else None
                layout[f"{way}axis{suffix}"] = axis
            if panel.is_square:
                panel.y.scaleanchor = f"x{suffix}"
            if panel.title:
                panel.write(panel.title, 0.0, 1.0, inside="xy", shift=(0.0, 3.0), size=10.0)
                panel.notes[-1].name = "title"
            for note, way in itertools.product(panel.notes, WAYS):
                if panel.axis(way).type == "log" and "domain" not in note[f"{way}ref"]:
                    note[way] = math.log10(note[way])  # so plotly wants it
            for one in (*panel.notes, *panel.rules):
                refs = {name: ref.replace(name[-4], name[-4] + suffix)
                        for name, ref in one.to_plotly_json().items() if "ref" in name}  # fmt: skip
                one.update(refs)
            notes += panel.notes
            for trace in panel.in_order():
                trace.update({"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"})
                data.append(trace)
        name_once(data)
        is_unified = all(is_rising(trace) for trace in data if trace.name)
        for panel in self.panels:
            for _, trace in panel.traces:
                trace.update(hover_words(trace, panel, is_unified))
        rules = [rule for panel in self.panels for rule in panel.rules]
        places = [[*panel.row, *panel.column] for panel in self.panels]
        return go.Figure(data, layout | {
            "annotations": notes, "shapes": rules, "width": WIDTH, "height": INCH * self.height,
            "template": {}, "barmode": "overlay",
            "title": {"text": self.title.replace("\n", "<br>")},
            "hovermode": "x unified" if is_unified else "closest",
            "meta": {"rows": [*self.rows], "columns": [*self.columns], "places": places,
                     "units": [panel.unit["x"] for panel in self.panels]},
        })  # fmt: skip

    def domain(self, panel: Panel, way: Way) -> list[float]:
        """Return the part of the figure that a panel has along an axis."""
        sizes, part = (self.columns, panel.column) if way == "x" else (self.rows, panel.row)
        low, high = (sum(sizes[:end]) / sum(sizes) for end in part)
        low, high = (low, high) if way == "x" else (1.0 - high, 1.0 - low)
        gap = min(GAP, 0.4 * (high - low))
        return [low + gap / 2.0, high - gap / 2.0]


def name_once(data: Sequence[Trace]) -> None:
    """Keep each name once in the legend, in the order in which it was first drawn."""
    seen: set[str] = set()
    for trace in sorted(data, key=lambda one: one.legendrank):
        if trace.showlegend:
            trace.showlegend = trace.name not in seen
            seen.add(trace.name)
            trace.legendgroup = trace.name


def is_rising(trace: Trace) -> bool:
    """Return whether it is a curve from left to right, whose value at an x can be told."""
    return isinstance(trace, go.Scatter) and "lines" in trace.mode and not (
        np.diff(trace.x) < 0).any()  # fmt: skip


def hover_words(trace: Trace, panel: Panel, is_unified: bool) -> dict[str, str]:
    """Return what is told at a point of a trace."""
    if not trace.name and isinstance(trace, go.Scatter):
        return {"hoverinfo": "skip"}
    x, y = (f"%{{{way}:.6~g}} {panel.unit[way]}".rstrip() for way in WAYS)
    y = y.replace(".6~g", ".4~r")
    name = f"<extra>{trace.name or panel.title}</extra>"
    if isinstance(trace, go.Heatmap):
        value = "%{z:.4~r}" if trace.text is None else "%{text}"
        return {"hovertemplate": f"{x}, {y}<br>{value} {trace.colorbar.title.text}{name}"}
    return {"hovertemplate": f"{y}{name}" if is_unified else f"{x}, {y}{name}"}


def make_grid(
    rows: int, columns: int, height: float, count: int = 0, heights: Sequence[float] = (),
    widths: Sequence[float] = (), units: Units = "usual",
) -> tuple[Drawing, np.ndarray]:  # fmt: skip
    """Return a drawing of empty panels, and these, shape (rows, columns).

    height: of all, in inches; count: of the panels that are there, from the first; units: in which
    axes are read.
    """
    grid = np.empty((rows, columns), object)
    for row, column in itertools.product(range(rows), range(columns)):
        grid[row, column] = Panel((row, row + 1), (column, column + 1), units)
    sizes = tuple(heights) or (1.0,) * rows, tuple(widths) or (1.0,) * columns
    return Drawing(height, *sizes, [*grid.flat][: count or None]), grid


# ---- shapes of what is drawn --------------------------------------------------------------------


def circle(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of a circle around the origin."""
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    return radius * np.cos(turn), radius * np.sin(turn)


def rectangle(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of the outline around some places."""
    (left, right), (low, high) = (x.min(), x.max()), (y.min(), y.max())
    return np.array([left, right, right, left, left]), np.array([low, low, high, high, low])


def outline_cells(
    x: np.ndarray, y: np.ndarray, is_in: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return x and y of the outlines of a map's cells that are in, those beside each other as one.

    x, y: the cells' edges; is_in: shape (rows, columns).
    """
    found = []
    for row, cells in enumerate(is_in):
        steps = np.diff(np.concatenate([[0], cells, [0]]).astype(int))
        for ends in zip(np.flatnonzero(steps > 0), np.flatnonzero(steps < 0), strict=True):
            found.append(np.stack(rectangle(x[[*ends]], y[row : row + 2]), axis=1))
    return join_with_gaps(found)


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


# ---- what is read of a figure again -------------------------------------------------------------


class View:
    """One of a finished figure's axes: its number from 0, title, axes, and traces in order."""

    def __init__(self, figure: go.Figure, number: int):
        suffix = f"{number + 1}" if number else ""
        *row, first, last = figure.layout.meta["places"][number]
        self.number, self.suffix, self.row, self.column = number, suffix, row, [first, last]
        self.x, self.y = figure.layout[f"xaxis{suffix}"], figure.layout[f"yaxis{suffix}"]
        notes = [one for one in figure.layout.annotations
                 if one.xref.partition(" ")[0] == f"x{suffix}"]  # fmt: skip
        self.title = next((one.text for one in notes if one.name == "title"), "")
        self.notes = [one for one in notes if one.name != "title"]
        self.rules = [one for one in figure.layout.shapes
                      if one.xref.partition(" ")[0] == f"x{suffix}"]  # fmt: skip
        self.traces = [one for one in figure.data if one.xaxis == f"x{suffix}"]


def views_of(figure: go.Figure) -> list[View]:
    """Return a figure's panels in their order."""
    return [View(figure, number) for number in range(len(figure.layout.meta["places"]))]


def one_line(title: str) -> str:
    """Return a title in one line, without marks."""
    text = title.replace("<br>", " ").replace("<sub>", "_").replace("</sub>", "")
    return " ".join(text.split())


def shared_title(panels: Sequence[View], panel: View, way: Way) -> str:
    """Return the title of a panel's axis, or of the one below or beside it that has its numbers."""
    if way == "x":
        alike = [p for p in panels if p.column == panel.column and p.row >= panel.row]
    else:
        alike = [panel, *(p for p in panels if p.row == panel.row and p.column <= panel.column)]
    titles = (one_line(p.x.title.text or "" if way == "x" else p.y.title.text or "") for p in alike)
    return next(filter(None, titles), "")


def as_csv(figure: go.Figure) -> str:
    """Return all numbers of a figure. Curves over the same x share a column of it, and stand once.

    Points of the same jobs share the column of the jobs' keys, across panels. A column is headed
    "panel: curve: title of the axis", with " below" and " above" for the ends of error bars,
    counted from the value. A map has a row a cell, x and y in its middle.
    """
    columns: list[tuple[str, Sequence[str]]] = []
    last, seen = ("", b""), set()
    last_jobs: tuple[str, ...] = ()
    panels = views_of(figure)
    for panel in panels:
        x_title, y_title = (shared_title(panels, panel, way) for way in WAYS)
        for trace in panel.traces:
            x, y, *more = points(trace)
            jobs = () if trace.customdata is None else (*np.ravel(trace.customdata).tolist(),)
            is_drawn = np.isfinite(x).any() or bool(jobs)
            if not is_drawn or not (trace.name or jobs or isinstance(trace, go.Heatmap)):
                continue
            where = f"{one_line(panel.title) or panel.number + 1}: {trace.name or ''}"
            where = where.removesuffix(": ")
            same = x.tobytes(), y.tobytes(), trace.name, *(values.tobytes() for _, values in more)
            if same in seen:
                continue  # an enlarged view of the same curve
            seen.add(same)
            if (x_title, x.tobytes()) != last:
                columns.append((f"{where}: {x_title}", texts(x)))
                last = x_title, x.tobytes()
            columns.append((f"{where}: {y_title}", texts(y)))
            columns += [(f"{where}: {name}", texts(values)) for name, values in more]
            if jobs and jobs != last_jobs:
                columns.append((f"{where}: job", jobs))
                last_jobs = jobs
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([head for head, _ in columns])
    writer.writerows(itertools.zip_longest(*(values for _, values in columns), fillvalue=""))
    return stream.getvalue()


def points(trace: Trace) -> tuple[np.ndarray, np.ndarray, *tuple[tuple[str, np.ndarray], ...]]:
    """Return x and y of a trace's points, and what else is known of them by its name."""
    x, y = np.asarray(trace.x, float), np.asarray(trace.y, float)
    if isinstance(trace, go.Heatmap):
        x, y = (0.5 * (edges[1:] + edges[:-1]) for edges in (x, y))
        values = trace.z.ravel() if trace.text is None else 10.0 ** trace.z.ravel()
        title = one_line(trace.colorbar.title.text or "") or "value"
        return np.tile(x, y.size), np.repeat(y, x.size), (title, values)
    along = "x" if isinstance(trace, go.Bar) and trace.orientation == "h" else "y"
    if isinstance(trace, go.Bar):
        x, y = (np.add(x, trace.base), y) if along == "x" else (x, np.add(y, trace.base))
    error = trace[f"error_{along}"]
    if error.array is None:
        return x, y
    return x, y, ("below", error.arrayminus), ("above", error.array)


def texts(values: np.ndarray) -> list[str]:
    """Return the numbers as text, nan as nothing."""
    return ["" if text == "nan" else text for text in np.char.mod("%.8g", values).tolist()]


def describe_figure(figure: go.Figure) -> str:
    """Return a figure in words: its panels, their axes and curves."""
    found = []
    for panel in views_of(figure):
        curves = ", ".join(dict.fromkeys(one.name for one in panel.traces if one.name))
        titles = (one_line(axis.title.text or "") for axis in (panel.y, panel.x))
        axes = " over ".join(filter(None, titles))
        found.append(": ".join(filter(None, (one_line(panel.title) or axes, curves))))
    several = f"{len(found)} panels. " if len(found) > 1 else ""
    return several + "; ".join(dict.fromkeys(found))

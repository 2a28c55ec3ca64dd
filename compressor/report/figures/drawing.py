"""Figures as plotly's own `Figure`: a grid of panels to fill, and what is read of one again.

A figure function fills the panels of `make_grid`, each axis in the unit that is wanted, and returns
`drawing.figure()`. `pictures` makes the PNG of that, `as_csv` its table, and `report/interactive`
the script of the page. Ranges and ticks are plotly's and matplotlib's own, unless a figure says.
"""

import csv
import io
import itertools
import math
from collections.abc import Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike
from plotly.subplots import make_subplots

from compressor.report.figures.style import BLACK, PIXEL, LineStyle
from compressor.units import Units, unit_in

WIDTH = 960  # pixels, of every figure
INCH = 100  # pixels
MARGIN = {"l": 68, "r": 16, "t": 28, "b": 46}  # pixels around the panels
BETWEEN = {"x": 78, "y": 70}  # pixels between panels, with numbers and a title there
BARE = {"x": 24, "y": 34}  # without
ROOM = 0.05  # of a panel, above and below its curves, and beside marks
SCALE = 74  # pixels that a scale of colours takes
Way = Literal["x", "y"]  # an axis
WAYS: tuple[Way, Way] = ("x", "y")
PlotlyFigure: TypeAlias = go.Figure
Axis: TypeAlias = Any  # of plotly: go.layout.XAxis or YAxis
Trace: TypeAlias = Any  # of plotly: go.Scatter, go.Bar or go.Heatmap


class Panel:
    """One of a figure's axes, to fill and to read; suffix: of its axes in plotly, such as "2".

    What is drawn is in the units that `label` is given, and becomes multiples of those in which the
    axes are read. `traces`: as they were drawn; `notes`, `rules`: plotly's annotations and shapes.
    """

    def __init__(self, figure: go.Figure, suffix: str, units: Units = "usual"):
        self.figure, self.suffix, self.units = figure, suffix, units
        self.x, self.y = (figure.layout[f"{way}axis{suffix}"] for way in WAYS)
        self.factors = dict.fromkeys(WAYS, 1.0)
        self.title = ""
        self.traces: list[Trace] = []
        self.notes: list[Any] = []
        self.rules: list[Any] = []

    def axis(self, way: Way) -> Axis:
        """Return the axis `x` or `y`, of plotly."""
        return self.x if way == "x" else self.y

    @property
    def heading(self) -> dict[str, Any]:
        """Return plotly's description of the title."""
        return {
            "text": self.title, "name": "title", "x": 0.0, "xref": f"x{self.suffix} domain",
            "xanchor": "left", "y": 1.0, "yref": f"y{self.suffix} domain", "yanchor": "bottom",
            "yshift": 3.0 * PIXEL, "showarrow": False, "align": "left",
            "font": {"color": BLACK, "size": 10.0 * PIXEL},
        }  # fmt: skip

    def label(self, way: Way, title: str, unit: str = "") -> None:
        """Name an axis before anything is drawn; `{}` in the title stands for the unit."""
        unit, self.factors[way] = unit_in(unit, self.units)
        self.axis(way).title = title.format(unit)

    def at(self, way: Way, values: ArrayLike) -> np.ndarray:
        """Return places along an axis as they are read there."""
        return self.factors[way] * np.atleast_1d(np.asarray(values, float))

    def add(self, made: Trace, height: float, jobs: Sequence[str], name: str = "") -> None:
        """Add what is drawn at a height; jobs: the keys of its points; name: in the legend."""
        if jobs:
            made.customdata = np.reshape(jobs, made.z.shape if made.type == "heatmap" else -1)
        if name:
            made.showlegend = all(o.name != name or not o.showlegend for o in self.figure.data)
        elif made.type != "heatmap":
            made.update(showlegend=False, hoverinfo=None if made.name else "skip")
        made.update(xaxis=f"x{self.suffix}", yaxis=f"y{self.suffix}", zorder=round(10 * height),
                    legendgroup=made.name)  # fmt: skip
        self.figure.add_trace(made)
        self.traces.append(made)

    def plot(
        self, x: ArrayLike, y: ArrayLike, style: LineStyle, name: str = "",
        errors: np.ndarray | None = None, jobs: Sequence[str] = (), listed: bool = True,
    ) -> None:  # fmt: skip
        """Draw a line, its marks or both; errors: below and above in y, shape (2, n).

        jobs: the key of each point's job; listed: in the legend by its name, if it has one.
        """
        made = go.Scatter(
            x=self.at("x", x), y=self.at("y", y), name=name, opacity=style.alpha, line=style.line,
            marker=style.marks if style.marker else None,
            mode="+".join(["lines"] * bool(style.linewidth) + ["markers"] * bool(style.marker)),
        )  # fmt: skip
        if errors is not None:
            made.error_y = error_bars(self.factors["y"] * errors)
        self.add(made, style.zorder, jobs, name * listed)

    def fill(self, x: ArrayLike, y: ArrayLike, style: LineStyle, name: str = "") -> None:
        """Draw an area by its outline."""
        made = go.Scatter(
            x=self.at("x", x), y=self.at("y", y), name=name, opacity=style.alpha, mode="none",
            fill="toself", fillcolor=style.color,
        )  # fmt: skip
        self.add(made, style.zorder, (), name)

    def bars(
        self, x: ArrayLike, y: ArrayLike, style: LineStyle, name: str = "", thick: float = 1.0,
        errors: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        """Draw lying bars from 0 to x, at y; errors: below and above, shape (2, n)."""
        made = go.Bar(
            x=self.at("x", x), y=self.at("y", y), name=name, orientation="h", width=thick,
            marker={"color": style.color},
        )  # fmt: skip
        if errors is not None:
            made.error_x = error_bars(self.factors["x"] * errors)
        self.add(made, style.zorder, (), name)

    def map(
        self, x: np.ndarray, y: np.ndarray, z: np.ndarray, colors: Sequence[str],
        ends: tuple[float, float], title: str = "", unit: str = "", is_log: bool = False,
        name: str = "", jobs: Sequence[str] = (), has_scale: bool = True,
    ) -> None:  # fmt: skip
        """Draw a map of z, shape (rows, columns), over the middles of columns and rows.

        colors: from the first to the second of `ends`, with steps if there are a few; title, with
        `{}` for the unit: of their scale. On a log scale z becomes its logarithm.
        """
        unit, factor = unit_in(unit, self.units)
        values, (low, high) = factor * z, (factor * end for end in ends)
        left, right = self.x.domain
        right -= has_scale * SCALE / (WIDTH - MARGIN["l"] - MARGIN["r"])
        self.x.domain = left, right
        down, up = self.y.domain
        scale: dict[str, Any] = {
            "title": {"text": title.format(unit), "side": "right"}, "thickness": 10, "x": right,
            "xpad": 6, "y": 0.5 * (down + up), "len": up - down, "ypad": 0, "outlinewidth": 0,
        }  # fmt: skip
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
            hoverinfo="x+y+text" if is_log else "x+y+z", zhoverformat=".4~r",
        )  # fmt: skip
        self.add(made, 1.0, jobs)

    def write(
        self, text: str, x: float, y: float, color: str = BLACK,
        shift: tuple[float, float] = (0.0, 0.0), side: str = "left", level: str = "bottom",
    ) -> None:  # fmt: skip
        """Write a text at x and y; shift: in points; side, level: of the text at its place."""
        place: dict[str, Any] = {}
        for way, at in zip(WAYS, (x, y), strict=True):
            place[f"{way}ref"], at = f"{way}{self.suffix}", float(self.at(way, at)[0])
            place[way] = math.log10(at) if self.axis(way).type == "log" else at  # plotly's way
        self.notes.append(place | {
            "text": text, "showarrow": False, "xanchor": side, "yanchor": level, "align": "left",
            "xshift": PIXEL * shift[0], "yshift": PIXEL * shift[1],
            "font": {"color": color, "size": PIXEL * 8.5},
        })  # fmt: skip

    def rule(self, style: LineStyle, x: float = math.nan, y: float = math.nan) -> None:
        """Draw a straight line across the panel, at x or at y."""
        way, other = WAYS if math.isnan(y) else WAYS[::-1]
        at = float(self.at(way, x if way == "x" else y)[0])
        self.rules.append({
            f"{way}0": at, f"{way}1": at, f"{way}ref": f"{way}{self.suffix}",
            f"{other}0": 0.0, f"{other}1": 1.0, f"{other}ref": f"{other}{self.suffix} domain",
            "type": "line", "line": {**style.line, "width": max(1.0, style.line["width"])},
            "layer": "below" if style.zorder < 1.0 else "above",
        })  # fmt: skip

    def span(self, way: Way, low: float = math.nan, high: float = math.nan) -> None:
        """Show what lies between two values; one that is not given follows from what is drawn."""
        axis, ends = self.axis(way), self.at(way, [low, high]).tolist()
        if axis.type == "log":
            ends = [math.log10(end) for end in ends]
        axis.range = [None if math.isnan(end) else end for end in ends]

    def name_ticks(self, way: Way, words: Sequence[str], places: ArrayLike = ()) -> None:
        """Set words as ticks at places, or at 0, 1, 2 and so on."""
        axis = self.axis(way)
        axis.tickvals = np.asarray(places, float).tolist() or [*range(len(words))]
        axis.ticktext = [word.replace("\n", "<br>") for word in words]


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


SHARED = ("range", "type", "dtick", "tickvals", "ticktext", "nticks", "showgrid")  # of axes


class Drawing:
    """A grid of panels that becomes a figure."""

    def __init__(self, panels: list[Panel]) -> None:
        self.panels, self.drawn = panels, panels[0].figure

    def figure(self, title: str = "") -> go.Figure:
        """Return the figure, with a title if there is one.

        Axes that share a scale have the ticks of the first of them, and numbers and a title on the
        outside: of x in the lowest panel of a column, of y in the first of a row.
        """
        if title:
            self.drawn.layout.title = title
        is_unified = all(is_rising(one) for one in self.drawn.data if one.name)
        for panel, way in itertools.product(self.panels, WAYS):
            axis = panel.axis(way)
            if axis.matches:
                first = self.drawn.layout[axis.matches.replace(way, f"{way}axis")]
                axis.update({name: first[name] for name in SHARED if first[name] is not None})
            if axis.showticklabels is False:
                axis.title = ""
        titles = [panel.heading for panel in self.panels if panel.title]
        self.drawn.layout.annotations = titles + [
            one for panel in self.panels for one in panel.notes
        ]
        self.drawn.layout.shapes = [one for panel in self.panels for one in panel.rules]
        self.drawn.layout.hovermode = "x unified" if is_unified else "closest"
        return self.drawn


def is_rising(trace: Trace) -> bool:
    """Return whether it is a curve from left to right, whose value at an x can be told."""
    return isinstance(trace, go.Scatter) and "lines" in trace.mode and not (
        np.diff(trace.x) < 0).any()  # fmt: skip


def make_grid(
    rows: int, columns: int, height: float, count: int = 0, heights: Sequence[float] = (),
    widths: Sequence[float] = (), units: Units = "usual", share_x: str = "", share_y: str = "",
    tall: Sequence[slice] = (),
) -> tuple[Drawing, np.ndarray]:  # fmt: skip
    """Return a drawing of empty panels, and these, shape (rows, columns).

    height: of all, in inches; count: of the panels that are there, from the first; units: in which
    axes are read; share_x, share_y: which panels have one scale, in plotly's words: `all`, `rows`
    or `columns`; tall: rows in whose last column there is one panel.
    """
    specs: list[list[Any]] = [[{} for _ in range(columns)] for _ in range(rows)]
    for part in tall:
        specs[part.start][-1] = {"rowspan": part.stop - part.start}
        for row in range(part.start + 1, part.stop):
            specs[row][-1] = None
    for place in range(count or rows * columns, rows * columns):
        specs[place // columns][place % columns] = None
    across, down = WIDTH - MARGIN["l"] - MARGIN["r"], INCH * height - MARGIN["t"] - MARGIN["b"]
    figure = make_subplots(
        rows, columns, specs=specs, row_heights=[*heights] or None, column_widths=[*widths] or None,
        horizontal_spacing=min(0.6 / columns, (BARE if share_y else BETWEEN)["x"] / across),
        vertical_spacing=min(0.6 / rows, (BARE if share_x else BETWEEN)["y"] / down),
        figure=go.Figure(layout={"template": {}}),  # else its own one, in every script
    )  # fmt: skip
    figure.update_layout(
        width=WIDTH, height=INCH * height, margin=MARGIN, barmode="overlay", bargap=0
    )
    figure.update_xaxes(hoverformat=".6~g").update_yaxes(hoverformat=".4~r")
    grid = np.empty((rows, columns), object)
    for row, column in itertools.product(range(rows), range(columns)):
        if specs[row][column] is None:
            continue
        axis = figure.get_subplot(row + 1, column + 1).xaxis
        grid[row, column] = panel = Panel(figure, axis.plotly_name.removeprefix("xaxis"), units)
        has_below = any(below[column] is not None for below in specs[row + 1 :])
        inner = {"x": has_below, "y": column > 0}
        for way, share in zip(WAYS, (share_x, share_y), strict=True):
            if share:
                first = grid[row * (share == "rows"), column * (share == "columns")]
                axis = panel.axis(way)
                axis.matches = None if first is panel else f"{way}{first.suffix}"
                axis.showticklabels = not inner[way]
    for part in tall:
        grid[part, -1] = grid[part.start, -1]
    return Drawing([*dict.fromkeys(one for one in grid.flat if one)]), grid


# ---- shapes of what is drawn --------------------------------------------------------------------


def rectangle(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of the outline around some places."""
    (left, right), (low, high) = (x.min(), x.max()), (y.min(), y.max())
    return np.array([left, right, right, left, left]), np.array([low, low, high, high, low])


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


def panels_of(figure: go.Figure) -> list[Panel]:
    """Return a figure's panels from the top, those of a row from the left.

    Traces are in order from the lowest to the highest, bars first.
    """
    names = (name for name in figure.layout if name.startswith("xaxis"))
    panels = {f"x{suffix}": Panel(figure, suffix) for suffix in (name[5:] for name in names)}
    for trace in sorted(figure.data, key=lambda one: (one.type != "bar", one.zorder)):
        panels[trace.xaxis].traces.append(trace)
    for note in figure.layout.annotations:
        panel = panels[note.xref.partition(" ")[0]]
        if note.name == "title":
            panel.title = note.text
        else:
            panel.notes.append(note)
    for rule in figure.layout.shapes:
        panels[rule.xref.partition(" ")[0]].rules.append(rule)
    return sorted(panels.values(), key=lambda one: (-round(one.y.domain[0], 6), one.x.domain[0]))


def one_line(title: str) -> str:
    """Return a title in one line, without marks."""
    text = title.replace("<br>", " ").replace("<sub>", "_").replace("</sub>", "")
    return " ".join(text.split())


def shared_title(panels: Sequence[Panel], panel: Panel, way: Way) -> str:
    """Return the title of a panel's axis, or of the one below or beside it that has its numbers."""
    here = panels.index(panel)
    if way == "x":
        alike = [one for one in panels[here:] if one.x.domain[0] == panel.x.domain[0]]
    else:
        alike = [panel, *(one for one in panels[:here] if one.y.domain == panel.y.domain)]
    return next(filter(None, (one_line(one.axis(way).title.text or "") for one in alike)), "")


def as_csv(figure: go.Figure) -> str:
    """Return all numbers of a figure. Curves over the same x share a column of it, and stand once.

    Points of the same jobs share the column of the jobs' keys, across panels. A column is headed
    "panel: curve: title of the axis", with " below" and " above" for the ends of error bars,
    counted from the value. A map has a row a cell, x and y in its middle.
    """
    columns: list[tuple[str, Sequence[str]]] = []
    last, seen = ("", b""), set()
    last_jobs: tuple[str, ...] = ()
    panels = panels_of(figure)
    for number, panel in enumerate(panels, 1):
        x_title, y_title = (shared_title(panels, panel, way) for way in WAYS)
        for trace in panel.traces:
            x, y, *more = points(trace)
            jobs = () if trace.customdata is None else (*np.ravel(trace.customdata).tolist(),)
            is_drawn = np.isfinite(x).any() or bool(jobs)
            if not is_drawn or not (trace.name or jobs or isinstance(trace, go.Heatmap)):
                continue
            where = f"{one_line(panel.title) or number}: {trace.name or ''}"
            where = where.removesuffix(": ")
            same = (x.tobytes(), y.tobytes(), trace.name, jobs,
                    *(values.tobytes() for _, values in more))  # fmt: skip
            if same in seen:
                continue  # an enlarged view of the same curve
            seen.add(same)
            if (x_title, x.tobytes()) != last:
                columns.append((f"{where}: {x_title}", name_places(x, panel.x)))
                last = x_title, x.tobytes()
            head = f"{where}: {y_title}".removesuffix(": ")
            columns.append((head, name_places(y, panel.y, figure.layout.meta)))
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
    """Return x and y of a trace's points, and what else is known of them by its name.

    y of bars is that of their tick, which those of a row stand beside.
    """
    x, y = np.asarray(trace.x, float), np.asarray(trace.y, float)
    y = np.round(y) if isinstance(trace, go.Bar) else y
    if isinstance(trace, go.Heatmap):
        values = trace.z.ravel() if trace.text is None else 10.0 ** trace.z.ravel()
        title = one_line(trace.colorbar.title.text or "") or "value"
        return np.tile(x, y.size), np.repeat(y, x.size), (title, values)
    error = trace.error_x if isinstance(trace, go.Bar) else trace.error_y
    if error.array is None:
        return x, y
    return x, y, ("below", error.arrayminus), ("above", error.array)


def name_places(values: np.ndarray, axis: Axis, rows: Sequence[str] | None = None) -> list[str]:
    """Return places along an axis as text: the names of its rows, or words at its ticks."""
    named = dict(enumerate(rows or ()))
    if axis.ticktext and not named:
        named = dict(zip(axis.tickvals, map(one_line, axis.ticktext), strict=True))
    both = zip(values.tolist(), texts(values), strict=True)
    return [named.get(value, text) for value, text in both]


def texts(values: np.ndarray) -> list[str]:
    """Return the numbers as text, nan as nothing."""
    return ["" if text == "nan" else text for text in np.char.mod("%.8g", values).tolist()]

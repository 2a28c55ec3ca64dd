"""Reads off a finished matplotlib figure what it shows."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Annotation
from matplotlib.ticker import MultipleLocator
from matplotlib.transforms import Transform

from compressor.report.figures.artists import Names, every_trace, in_data, legend_names, pattern
from compressor.report.figures.shown import Note, Panel, Scale, Sheet


def extract(figure: Figure) -> Sheet:
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
    return Sheet(found, heights, widths, (float(width), float(height)))


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
        plain(title),
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
            float(place): plain(text) for place, text in zip(places, texts, strict=False) if text
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
    return Scale(plain(title), low, high, kind == "log", words, step, bare)


def plain(title: str) -> str:
    """Return a title in one line, without the marks of mathematical letters."""
    return " ".join(title.replace("$", "").split())


def is_number(text: str) -> bool:
    try:
        float(text.replace("−", "-"))
    except ValueError:
        return False
    return True


def notes(axes: Axes) -> Iterator[Note]:
    """Yield the texts in a panel, and straight lines across it."""
    for text in axes.texts:
        words = " ".join(text.get_text().split())
        if words and text.get_visible():
            x, y = map(float, text.get_position())
            if isinstance(text, Annotation) and text.xycoords == "data":
                x, y = map(float, text.xy)
                yield Note(words, x, y, to_hex(text.get_color()))
            elif isinstance(text, Annotation) and isinstance(text.xycoords, Transform):
                place = text.xycoords.transform(text.xy)
                x, y = map(float, axes.transAxes.inverted().transform(place))
                yield Note(words, x, y, to_hex(text.get_color()), inside=True)
            else:
                inside = not in_data(axes, text)
                yield Note(words, x, y, to_hex(text.get_color()), inside=inside)
    for line in axes.lines:
        own = line.get_transform().contains_branch_seperately(axes.transData)
        if own == (True, False):
            yield Note("", first(line.get_xdata()), color=to_hex(line.get_color()),
                       dash=pattern(line))  # fmt: skip
        elif own == (False, True):
            yield Note("", y=first(line.get_ydata()), color=to_hex(line.get_color()),
                       dash=pattern(line))  # fmt: skip


def first(values: Any) -> float:
    return float(np.ravel(values)[0])

"""What the figures of a sweep share: a panel a metric, marks of jobs without result, colours."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from compressor.report.figures.artists import with_jobs
from compressor.report.figures.style import BLUE, CYCLE, Line, sheet
from compressor.report.figures.sweep_data import Axis, spans_decades
from compressor.report.figures.sweep_metric import MARKS, NAMES, Measure

COLUMNS = 3
MOST_LINES = 12  # in a panel
MOST_KEYS = 2000  # jobs of a study of which a click tells
ROOM = 0.18  # of a panel's height, below and above its values
VISIBLE = 0.004  # of a panel's height: an error bar that is seen
MARKERS = "osD^v"
FEET = {"failed": 0.03, "missing": 0.08}  # of a panel's height
CHAOTIC = "chaotic: a greatest value holds for this run only"
RING: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 8,
                        "markerfacecolor": "none", "color": "#d633a8", "markeredgewidth": 1.1,
                        "zorder": 5}  # fmt: skip
Keys = np.ndarray | None


def metric_panels(measures: Sequence[Measure], height: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with a panel for each measure, titled; height of a row in inches."""
    rows = math.ceil(len(measures) / COLUMNS)
    columns = min(COLUMNS, len(measures))
    figure, grid = sheet(rows, columns, max(3.2, height * rows + 0.8))
    panels = list(grid.flat)
    for panel in panels[len(measures) :]:
        panel.remove()
    for panel, measure in zip(panels, measures, strict=False):
        panel.set_title(measure.title)
    return figure, panels[: len(measures)]


def plot_jobs(
    panel: Axes, points: tuple[np.ndarray, np.ndarray, np.ndarray], keys: Keys, name: str,
    line: dict[str, Any], span: float,
) -> None:  # fmt: skip
    """A line through jobs (x, y, bars), with error bars where any is seen beside the span."""
    x, y, bars = points
    finite = np.where(np.isfinite(bars), bars, 0.0)
    if (finite > VISIBLE * span).any():
        style = {"elinewidth": 1.0, "capsize": 2.0} | line
        drawn = panel.errorbar(x, y, yerr=finite, label=name, **style).lines[0]
    else:
        (drawn,) = panel.plot(x, y, label=name, **line)
    if keys is not None and keys.size == np.size(x) <= MOST_KEYS:
        with_jobs(drawn, keys)


def mark_points(
    panel: Axes, x: np.ndarray, y: np.ndarray, keys: Keys, mark: dict[str, Any], name: str = ""
) -> None:
    """Marks at points, which the legend names."""
    if x.size:
        (drawn,) = panel.plot(x, y, label=name, **mark)
        if keys is not None and keys.size <= MOST_KEYS:
            with_jobs(drawn, keys)


def mark_feet(panel: Axes, x: np.ndarray, status: np.ndarray, keys: Keys) -> None:
    """Marks at the foot of a panel where jobs failed or were not run; all of one shape."""
    low, high = panel.get_ylim()
    for word, mark in MARKS.items():
        here = status == word
        if panel.get_yscale() == "log":
            foot = low * (high / low) ** FEET[word]
        else:
            foot = low + FEET[word] * (high - low)
        mark_points(panel, x[here], np.full(here.sum(), foot),
                    None if keys is None else keys[here], mark, NAMES[word])  # fmt: skip


def marks_shown(status: np.ndarray, chaotic: np.ndarray) -> list[Line2D]:
    """Return the legend's entries of the marks that are there."""
    found = [Line2D([], [], label=NAMES[s], **mark) for s, mark in MARKS.items() if s in status]
    return found + ([Line2D([], [], label=CHAOTIC, **RING)] if chaotic.any() else [])


def scale_x(panel: Axes, axis: Axis) -> None:
    """Words as ticks, and a log scale where numbers span decades."""
    if axis.is_words:
        panel.set_xticks(range(len(axis.words)), in_lines(axis.words))
        panel.set_xlim(-0.3, len(axis.words) - 0.7)
        return
    low, high = np.nanmin(axis.places), np.nanmax(axis.places)
    if axis.is_log:
        panel.set_xscale("log")
        room = (high / low) ** 0.05
        panel.set_xlim(low / room, high * room)
    else:
        room = 0.05 * (high - low)
        panel.set_xlim(low - room, high + room)


def in_lines(words: Sequence[str]) -> list[str]:
    """Return the words as they stand below each other, so that neighbours do not overlap."""
    return [word.replace(" ", "\n") for word in words]


def scale_y(panel: Axes, values: np.ndarray) -> float:
    """Return room at the foot for marks, and a log scale over decades; gives the span of the panel.

    Values that are all the same stand in the middle.
    """
    values = values[np.isfinite(values)]
    low, high = (values.min(), values.max()) if values.size else (0.0, 1.0)
    if spans_decades(values):
        panel.set_yscale("log")
        room = (high / low) ** ROOM
        panel.set_ylim(low / room, high * room)
        return float(low)
    room = ROOM * (high - low) or 0.5 * abs(high) or 1.0
    panel.set_ylim(low - room, high + room)
    return float(high - low + 2.0 * room)


def lines_for(axis: Axis, chosen: Iterable[int]) -> list[Line]:
    """Return a line for each of an axis' values, from dark to light where they are numbers.

    chosen: the numbers of the values. Colours are those of viridis, which the colour-blind tell
    apart by lightness.
    """
    numbers = list(chosen)
    if len(numbers) <= len(CYCLE) and (axis.is_words or len(numbers) == 1):
        return list(CYCLE[: len(numbers)])
    shares = np.linspace(0.0, 0.88, len(numbers))
    return [Line(to_hex(colormaps["viridis"](share)), "-", 1.5) for share in shares]


def thinned(size: int, most: int) -> np.ndarray:
    """Evenly chosen numbers below a size, the ends among them."""
    return (
        np.arange(size) if size <= most else np.unique(np.linspace(0, size - 1, most).astype(int))
    )


PLAIN_LINE = Line(BLUE, "-", 1.4).properties() | {"marker": "o", "markersize": 3.8}

"""What a finished figure shows, as numbers: its panels, curves, maps and bars.

The interactive figure and the CSV file behind each figure are made from it, so that a figure is
drawn once.
"""

import csv
import io
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np


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
class Note:
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
    notes: tuple[Note, ...]
    is_square: bool = False  # the units of both axes are as long


@dataclass(frozen=True)
class Sheet:
    """A figure; heights and widths: of the grid's rows and columns, relative to the first."""

    panels: tuple[Panel, ...]
    heights: tuple[float, ...]
    widths: tuple[float, ...]
    size: tuple[float, float]  # inches


def as_csv(sheet: Sheet) -> str:
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

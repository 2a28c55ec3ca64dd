"""Figures of a study along an axis: a row a job, over orders or over the crank angle."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compressor import analysis
from compressor.report.figures import style
from compressor.report.figures.drawing import Drawing, Panel, make_grid
from compressor.report.figures.job import ORDERS_AXIS, G, loudest, show_turn
from compressor.report.figures.table import DrawnFigure, Number, figure, spell
from compressor.units import Units


@dataclass(frozen=True)
class SweptRow:
    """One job: its value on the axis in words, and what its series show.

    `shaking` is None, and `problem` says why, where the job has none. `cycle`: its last revolution.
    `chaotic`: single lines hold for this course of the motion only.
    """

    value: str
    shaking: analysis.Spectrum | None = None
    cycle: analysis.Cycle | None = None
    problem: str = ""
    chaotic: bool = False


MAX_TICKS = 12
MAX_MAP_ORDERS = 150
MAP_DECADES = 3  # below the greatest line above `ORDER`
CYCLE_DECADES = 2  # below the greatest vibration
ROW, LEAST = 0.24, 3.4  # inches: of a row, and of all


def draw_map(
    rows: Sequence[SweptRow], title: str, x: np.ndarray, table: np.ndarray,
    ends: tuple[float, float], name: str, unit: str, beside: np.ndarray, words: str, top: float,
    units: Units,
) -> tuple[Drawing, Panel]:  # fmt: skip
    """Return a drawing with a table in colour, a row a value, and the panel of that.

    title: of the rows; x: of the table's columns; ends: of the colours, which `name` titles,
    with `{}` for the unit; beside: a number a row, on an axis up to `top`, titled in words.
    """
    height = min(9.0, max(LEAST, ROW * len(rows))) + 0.9
    drawing, panels = make_grid(1, 2, height, widths=(3, 1), units=units, share_y="all")
    (image, numbers), at = panels[0], np.arange(len(rows), dtype=float)
    shown = np.clip(table, *ends)  # nan stays
    image.map(x, at, shown, style.palette("cividis"), ends, name, unit, is_log=True)
    label_rows(image, rows, title)
    numbers.label("x", words, unit)
    dots = style.LineStyle(style.BLUE, linewidth=1.5, marker="circle", markersize=3.5)
    numbers.plot(beside, at, dots)
    numbers.span("x", 0, top)
    return drawing, image


@figure("study", "cycles", "vibration over crank angle")
def draw_cycles(rows: Sequence[SweptRow], title: str, units: Units = "usual") -> DrawnFigure:
    """Return the vibration in each degree, a row a value, in colour; beside them its peaks.

    Marks: the rod load changes its side; valves open and close, or the cam's follower stops.
    """
    found = [row.cycle for row in rows]
    table = np.array([one.degree_peaks if one else np.full(360, np.nan) for one in found])
    top = np.nanmax(table)
    ends = top * 10.0**-CYCLE_DECADES, top
    loud, angles = np.array([loudest(one) if one else (np.nan, np.nan) for one in found]).T
    drawing, image = draw_map(rows, title, np.arange(360) + 0.5, table, ends, "|a| ({})", "m/s²",
                              loud, "peak ({})", 1.08 * top, units)  # fmt: skip
    corners = [[at for at, _ in one.events] if one else [] for one in found]
    reversals = [one.reversals if one else () for one in found]
    has_cam = any(event.startswith("cam") for one in found if one for _, event in one.events)
    corner = "corner of the load" if has_cam else "a valve opens or closes"
    for name, shape, color, marked in (
        (corner, "triangle-down", "#ffffff", corners),
        ("rod load changes its side", "square", style.RED, reversals),
    ):
        places = np.array([(at, n) for n, some in enumerate(marked) for at in some], float)
        if places.size:
            x, y = places.T
            image.plot(x, y, style.mark(color, shape, 4, edge=style.BLACK), name)
    show_turn(image, 90.0)
    sensed = any(one.is_sensed for one in found if one)
    kind = "sensor's record" if sensed else "acceleration of the crosshead"
    sentence = (
        f"The greatest magnitude of the {kind} in each degree of the last settled revolution, "
        f"{describe_rows(rows, title)}.{left_out(rows)}"
    )
    most = np.nanargmax(loud)
    counts = [len(one.reversals) for one in found if one]
    numbers = [
        *spell_ends("greatest magnitude", loud, rows, "m/s²", units),
        ("the greatest comes at", f"{angles[most]:.0f}°, {spell(G * loud[most], 'g')}"),
        ("changes of the rod load's side a revolution", ", ".join(map(str, sorted({*counts})))),
    ]
    return DrawnFigure(drawing.figure(), sentence, numbers)


@figure("study", "waterfall", "order spectra of the force on the frame along the cylinder")
def draw_waterfall(rows: Sequence[SweptRow], title: str, units: Units = "usual") -> DrawnFigure:
    """Return order spectra of X, a row a value, in colour; beside them the rms above `ORDER`."""
    found = [row.shaking for row in rows]
    size = min(MAX_MAP_ORDERS, *(one.amplitudes.size - 1 for one in found if one))
    table = np.full((len(rows), size), np.nan)
    for number, one in enumerate(found):
        if one:
            table[number] = one.amplitudes[1 : size + 1]
    top = np.nanmax(table[:, analysis.ORDER :])  # the first orders are beyond the scale
    if top < 1e-9 * np.nanmax(table):  # ideal joints: rounding
        top = np.nanmax(table)
    ends = top * 10.0**-MAP_DECADES, top
    above = np.array([one.above if one else np.nan for one in found])
    words = f"rms of X above<br>order {analysis.ORDER} ({{}})"
    drawing, image = draw_map(
        rows, title, np.arange(1, size + 1), table, ends, "amplitude of X ({})", "N", above, words,
        max(1.0, 1.08 * np.nanmax(above)), units,
    )  # fmt: skip
    image.rule(style.LineStyle(style.RED, (4, 1.5)), x=analysis.ORDER + 0.5)
    image.x.title = ORDERS_AXIS + f"; dashed: order {analysis.ORDER}"
    numbers = spell_ends(f"rms of X above order {analysis.ORDER}", above, rows, "N", units)
    sentence = f"Order spectra of X, {describe_rows(rows, title)}.{left_out(rows)}"
    return DrawnFigure(drawing.figure(), sentence, numbers)


def describe_rows(rows: Sequence[SweptRow], title: str) -> str:
    """Describe what a row of a map is: a value of the axis, or a job where values repeat."""
    values = [row.value for row in rows]
    if len({*values}) < len(values):
        return f"a row for each job, in the order of {title}"
    return f"a row for each value of {title}"


def spell_ends(
    what: str, values: np.ndarray, rows: Sequence[SweptRow], unit: str, units: Units
) -> list[Number]:
    """Return the least and the greatest of some rows' values, and where they are."""
    if np.nanmax(values) == np.nanmin(values):
        return [(what, spell(np.nanmax(values), unit, units))]
    ends = (("least", np.nanargmin(values)), ("greatest", np.nanargmax(values)))
    texts = [f"{word} {spell(values[n], unit, units)} at {rows[int(n)].value}" for word, n in ends]
    return [(what, ", ".join(texts))]


def left_out(rows: Sequence[SweptRow]) -> str:
    """Describe the rows that could not be drawn, and those of chaotic motion."""
    problems = [row.problem for row in rows if row.problem]
    wild = sum(row.chaotic for row in rows)
    text = f" Not drawn: {len(problems)} of {len(rows)} jobs ({', '.join(sorted({*problems}))})."
    return text * bool(problems) + f" Chaotic, so that lines change: {wild} jobs." * bool(wild)


def label_rows(panel: Panel, rows: Sequence[SweptRow], title: str) -> None:
    """Draw the swept values at some of the rows, with what became of those that have no series."""
    each = -(-len(rows) // MAX_TICKS)
    words = [f"{row.value} ({row.problem})" if row.problem else row.value for row in rows]
    panel.name_ticks("y", words[::each], range(0, len(rows), each))
    panel.figure.layout.meta = words  # of all rows, for the table
    panel.span("y", -0.5, len(rows) - 0.5)
    panel.y.title, panel.x.showgrid, panel.y.showgrid = title, False, False

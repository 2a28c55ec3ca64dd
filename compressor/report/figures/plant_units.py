"""A figure in the units that its reader has chosen: its numbers and the titles of its axes."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compressor.report.figures.drawing import (
    WAYS,
    ColorScale,
    Drawing,
    Note,
    Panel,
    Scale,
    Trace,
    Way,
    shared_title,
)
from compressor.units import Units, unit_in

UNIT = re.compile(r"\(([^(),]*)([^()]*)\)(?=[^()]*$)")  # what stands in a title's last brackets


def in_units(drawing: Drawing, units: Units) -> Drawing:
    """Return a figure in chosen units: an axis has the unit in the last brackets of its title."""
    if units == "usual":
        return drawing
    panels = [convert_panel(drawing, panel, units) for panel in drawing.panels]
    return replace(drawing, panels=panels)


def new_title(title: str, units: Units) -> tuple[str, float]:
    """Return an axis' title in chosen units, and the factor to them."""
    found = UNIT.search(title)
    if found is None:
        return title, 1.0
    unit, factor = unit_in(found[1], units)
    return f"{title[: found.start(1)]}{unit}{title[found.end(1) :]}", factor


def convert_panel(drawing: Drawing, panel: Panel, units: Units) -> Panel:
    """Return a panel in chosen units, and without a title of an axis by that of a neighbour."""
    scales, factors = {}, {}
    for way in WAYS:
        scale: Scale = getattr(panel, way)
        title, factor = new_title(scale.title, units)
        is_of_figure = drawing.x_title if way == "x" else drawing.y_title
        if not scale.title and not is_of_figure:
            _, factor = new_title(neighbour_title(drawing, panel, way), units)
        if scale.words:
            title, factor = scale.title, 1.0
        scales[way] = convert_scale(scale, title, factor)
        factors[way] = factor
    x, y = (factors[way] for way in WAYS)
    return replace(
        panel, x=scales["x"], y=scales["y"],
        traces=[convert_trace(trace, x, y, units) for trace in panel.traces],
        notes=[convert_note(note, x, y) for note in panel.notes],
    )  # fmt: skip


def neighbour_title(drawing: Drawing, panel: Panel, way: Way) -> str:
    """Return the title that stands for an axis without one: below, beside, or in its row."""
    if title := shared_title(drawing, panel, way):
        return title
    if way == "x":
        return ""
    rows = range(*panel.row)
    beside = (o for o in drawing.panels if o.y.title and {*rows} & {*range(*o.row)})
    return next((one.y.title for one in beside), "")


def convert_scale(scale: Scale, title: str, factor: float) -> Scale:
    """Return an axis whose numbers are multiplied by a factor."""
    ticks = None if scale.ticks is None else [factor * tick for tick in scale.ticks]
    return replace(
        scale, title=title, low=factor * scale.low, high=factor * scale.high, ticks=ticks,
        step=factor * scale.step,
    )  # fmt: skip


def convert_trace(trace: Trace, x: float, y: float, units: Units) -> Trace:
    """Return a trace whose numbers are multiplied by a factor each way; a map in chosen units."""
    along, across = (y, x) if trace.kind == "columns" else (x, y)
    errors = trace.errors
    if errors is not None:
        errors = (x if trace.across else y) * errors
    is_bar = trace.kind in ("bars", "columns")
    found = replace(
        trace, x=x * trace.x, y=y * trace.y, errors=errors,
        foot=None if trace.foot is None else along * trace.foot,
        thick=across * np.asarray(trace.thick) if is_bar else trace.thick,
    )  # fmt: skip
    if trace.scale is None or trace.z is None:
        return found
    scale, factor = convert_colors(trace.scale, units)
    return replace(found, z=factor * trace.z, scale=scale)


def convert_colors(scale: ColorScale, units: Units) -> tuple[ColorScale, float]:
    """Return the colours of a map in chosen units, and the factor to them."""
    title, factor = new_title(scale.title, units)
    bar, _ = new_title(scale.bar_title, units)

    def multiply(values: Sequence[float]) -> tuple[float, ...]:
        return tuple(factor * value for value in values)

    return replace(
        scale, title=title, bar_title=bar, low=factor * scale.low, high=factor * scale.high,
        levels=multiply(scale.levels),
        ticks=None if scale.ticks is None else multiply(scale.ticks),
    ), factor  # fmt: skip


def convert_note(note: Note, x: float, y: float) -> Note:
    """Return a text, arrow or line at its place in chosen units."""
    x, y = ((1.0 if way in note.inside else one) for way, one in zip(WAYS, (x, y), strict=True))
    tail = None if note.tail is None else (x * note.tail[0], y * note.tail[1])
    return replace(note, x=x * note.x, y=y * note.y, tail=tail)

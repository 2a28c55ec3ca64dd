"""The numbers of figures and of single jobs as scripts, from which the page draws.

The script calls `compsimFigure(name, {...})`, since a page from disk may load scripts, but no data.
Numbers are 32-bit floats in base64, or `[first, step, count]` where they are evenly spaced; curves
have as many points as a screen can show.
"""

import base64
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from compressor.analysis import SPOKEN, NoSeriesError, last_revolution
from compressor.metrics import JOINTS, SERIES
from compressor.report.figures.curves import ANGLE_AXIS
from compressor.report.figures.drawing import (
    WAYS,
    ColorScale,
    Drawing,
    Note,
    Panel,
    Scale,
    Trace,
    Way,
    axis_title,
    make_grid,
    one_line,
    shared_title,
    thin_places,
)
from compressor.report.figures.job import BY_JOINT
from compressor.report.figures.plant_units import in_units
from compressor.report.figures.style import BLACK, LineStyle
from compressor.store import DamagedFile, Stored, publish
from compressor.units import Units

LIBRARY = "plotly.min.js"
MAX_POINTS = 2400  # of a curve: some three for each pixel of a wide panel
FLOAT = np.dtype("f4").newbyteorder("little")
COLORS = 33  # of a continuous scale
EVEN = 1e-6  # of a step: how far evenly spaced numbers may be off


def library_path() -> Path:
    """Return where plotly.js is installed."""
    source = find_spec("plotly")
    (place,) = (source.submodule_search_locations or [""])[:1] if source else [""]
    return Path(place) / "package_data" / LIBRARY


def publish_library(folder: Path) -> None:
    """Write plotly.js beside the page, unless it is there. Raises StoreError."""
    path, library = folder / LIBRARY, library_path()
    if not path.exists() or path.stat().st_size != library.stat().st_size:
        publish(path, library.read_bytes())


def script(name: str, drawing: Drawing) -> str:
    """Return the script of a figure."""
    data = json.dumps(content(drawing), separators=(",", ":"), allow_nan=False)
    data = data.replace("<", "\\u003c")
    return f"compsimFigure({json.dumps(name)},{data});\n"


def content(drawing: Drawing) -> dict[str, Any]:
    """Return a figure as plain data. Panels with the same `link` are zoomed together.

    `jobs`: the keys of all jobs, among which a trace's points have places.

    `unified`: all curves go from left to right, so that the values at one x are shown together.
    """
    panels = drawing.panels
    links = {way: link_scales(drawing, way) for way in WAYS}
    keys = dict.fromkeys(key for panel in panels for trace in panel.traces for key in trace.jobs)
    places = {key: place for place, key in enumerate(keys)}
    return {
        "jobs": [*keys],
        "aspect": round(drawing.height / drawing.width, 4),
        "heights": drawing.heights,
        "widths": drawing.widths,
        "unified": all(
            trace.kind == "line" and not trace.is_points and not (np.diff(trace.x) < 0).any()
            for panel in panels
            for trace in panel.traces
            if trace.name
        ),
        "panels": [
            {
                "title": one_line(panel.title),
                "x": axis(drawing, panel, "x")
                | {"link": links["x"][number], "unit": unit(shared_title(drawing, panel, "x"))},
                "y": axis(drawing, panel, "y")
                | {"link": links["y"][number], "unit": unit(axis_title(drawing, panel, "y"))},
                "row": panel.row,
                "column": panel.column,
                "square": panel.is_square,
                "traces": [trace_data(trace, panel, places) for trace in panel.traces_in_order],
                "notes": [note_data(one, panel) for one in panel.notes if one.tail is None],
            }
            for number, panel in enumerate(panels)
        ],
    }


def unit(title: str) -> str:
    """Return the unit in an axis' title: what stands in the last brackets."""
    found = re.search(r"\(([^()]*)\)[^()]*$", title)
    return found[1] if found else ""


def link_scales(drawing: Drawing, way: Way) -> list[int]:
    """Return a number for each panel, the same where axes show the same span of the same quantity.

    In x a title that is left out is that of the panels below.
    """
    keys = []
    for panel in drawing.panels:
        scale = getattr(panel, way)
        title = "" if way == "x" or scale.bare else axis_title(drawing, panel, way)
        keys.append((*panel.limits(way), scale.log, title))
    return [keys.index(key) for key in keys]


def axis(drawing: Drawing, panel: Panel, way: Way) -> dict[str, Any]:
    """Return an axis as plain data."""
    scale: Scale = getattr(panel, way)
    words = [[place, one_line(text)] for place, text in scale.words.items()]
    more = {"words": words, "step": scale.step, "bare": scale.bare}
    found = {"title": axis_title(drawing, panel, way), "range": panel.limits(way)}
    return found | {"log": scale.log} | {name: value for name, value in more.items() if value}


def note_data(note: Note, panel: Panel) -> dict[str, Any]:
    """Return a text, or a straight line, as plain data; a text's place in data or in shares."""
    place: dict[str, float] = {}
    for way in WAYS:
        at, (low, high) = getattr(note, way), panel.limits(way)
        if note.inside and way not in note.inside:
            at = (at - low) / (high - low)
        if not math.isnan(at):
            place[way] = at
    more = {"color": note.style.color, "dash": dashes(note.style), "inside": bool(note.inside)}
    if note.text:
        more |= {"shift": note.shift, "side": note.side, "level": note.level}
    return {"text": " ".join(note.text.split()), **place, **more}


def dashes(style: LineStyle) -> list[float]:
    """Return a line's dashes in points: lengths of strokes and gaps; none if it is solid."""
    is_dashed = isinstance(style.linestyle, tuple)
    return [round(d * style.linewidth, 2) for d in style.linestyle[1]] if is_dashed else []


def trace_data(trace: Trace, panel: Panel, places: Mapping[str, int]) -> dict[str, Any]:
    """Return a trace as plain data, with the points that its panel can show.

    places: of the keys of jobs.
    """
    look, part = trace.style, visible(trace, panel)
    is_bar = trace.kind in ("bars", "columns")
    width = trace.thick if is_bar else look.markersize if trace.is_points else look.linewidth
    found: dict[str, Any] = {
        "kind": "points" if trace.is_points else trace.kind, "name": trace.name,
        "color": look.color, "width": round(float(np.max(width)), 3), "dash": dashes(look),
        "marker": look.marker, "opacity": look.alpha,
        "x": numbers(trace.x[part]), "y": numbers(trace.y[part]),
    }  # fmt: skip
    if trace.scale is not None and trace.z is not None:
        scale, z, ends = trace.scale, trace.z, (trace.scale.low, trace.scale.high)
        if scale.log:
            z, ends = np.log10(z), (math.log10(scale.low), math.log10(scale.high))
        found |= {"z": numbers(z.ravel()), "color": colors_of(scale), "limits": ends,
                  "log": scale.log, "scale": scale.title}  # fmt: skip
    if look.is_hollow:
        found["hollow"] = True
    if trace.errors is not None:
        found["errors"] = [numbers(ends[part]) for ends in trace.errors]
        found["across"] = trace.across
    if trace.jobs:
        found["jobs"] = numbers(np.array([places[key] for key in trace.jobs])[part])
    return found


def colors_of(scale: ColorScale) -> list[str]:
    """Return the colours of a map: all of a few, else some of them."""
    if len(scale.colors) <= COLORS:
        return [*scale.colors]
    return [*scale.colors[:: len(scale.colors) // (COLORS - 1)], scale.colors[-1]]


def visible(trace: Trace, panel: Panel) -> Any:
    """Return the places of the points to draw: all, or of many the extremes of each pixel.

    Of a curve in x from left to right only what lies in the panel, and a point on either side.
    """
    x, y = trace.x, trace.y
    if trace.kind != "line" or x.size < 3 or not np.isfinite(x).all():
        return slice(None)
    if trace.is_points or (np.diff(x) < 0).any():
        return thin_places(x.size, 2 * MAX_POINTS)
    low, high = sorted(panel.limits("x"))
    first = max(0, int(np.searchsorted(x, low, "left")) - 1)
    last = min(x.size, int(np.searchsorted(x, high, "right")) + 1)
    if last - first <= MAX_POINTS:
        return slice(first, last)
    return first + extremes(y[first:last], MAX_POINTS // 2)


def extremes(y: np.ndarray, count: int) -> np.ndarray:
    """Return the places of the least and greatest value of each of `count` parts.

    Also the two ends, and values that are not finite.
    """
    edges = np.linspace(0, y.size, count + 1).astype(int)[:-1]
    filled = np.where(np.isfinite(y), y, 0.0)
    least, greatest = np.minimum.reduceat(filled, edges), np.maximum.reduceat(filled, edges)
    part = np.repeat(np.arange(count), np.diff([*edges, y.size]))
    is_shown = (filled == least[part]) | (filled == greatest[part]) | ~np.isfinite(y)
    is_shown[[0, -1]] = True
    places = np.flatnonzero(is_shown)
    # where a part's values are equal, all of them are its extremes
    return places if places.size <= 4 * count else thin_places(y.size, 2 * count)


def numbers(values: np.ndarray) -> Any:
    """Return the numbers for the page: `[first, step, count]` where they are even, else base64."""
    values = np.asarray(values, float)
    if values.size > 8 and np.isfinite(values).all():
        step = (values[-1] - values[0]) / (values.size - 1)
        even = values[0] + step * np.arange(values.size)
        if step and np.abs(values - even).max() <= EVEN * abs(step):
            return [float(values[0]), float(step), values.size]
    return base64.b64encode(values.astype(FLOAT).tobytes()).decode()


def describe_figure(drawing: Drawing) -> str:
    """Return a figure in words: its panels, their axes and curves."""
    texts = []
    for panel in drawing.panels:
        names = [t.name or (t.scale.title if t.scale else "") for t in panel.traces_in_order]
        curves = ", ".join(name for name in dict.fromkeys(names) if name)
        titles = [axis_title(drawing, panel, way) for way in WAYS[::-1]]
        axes = " over ".join(title for title in titles if title)
        texts.append(": ".join(part for part in (one_line(panel.title) or axes, curves) if part))
    several = f"{len(texts)} panels. " if len(texts) > 1 else ""
    return several + "; ".join(dict.fromkeys(texts))


MAX_SERIES = 60  # jobs of a study whose time series lie beside the page
ACCELERATION, FORCE = "acceleration (m/s²)", "contact force (kN)"
SHOWN = ("time", "crank_angle", "acceleration", "contact_force")  # of a job's series


def job_scripts(
    stored: Stored, keys: Iterable[str], units: Units = "usual"
) -> Iterator[tuple[str, str]]:
    """Yield the key and script of the first jobs whose time series are kept."""
    found = 0
    for key in dict.fromkeys(keys):
        status = stored.status(key)
        if found == MAX_SERIES:
            return
        if status is None or status.status != "ok" or not status.samples:
            continue
        try:
            drawing = in_units(draw_job(read_shown(stored, key)), units)
        except (NoSeriesError, DamagedFile):
            continue  # shorter than a revolution, or its file is damaged: others report it
        found += 1
        yield key, script(series_name(key), drawing)


def read_shown(stored: Stored, key: str) -> xr.Dataset:
    """Return the series of a stored job that its figure shows. Raises DamagedFile.

    A tenth of the time that all of the job takes.
    """
    position = stored.find([key])[0]
    variables = {
        name: (("time", *SERIES.get(name, ((),))[0]), values)
        for name, values in stored.values(key, SHOWN).items()
    }
    try:
        settle = stored.attributes(position)["settle"]
        return xr.Dataset(variables, attrs={"settle": settle})
    except (KeyError, ValueError) as error:
        path = stored.batch_of(position)[0]
        problem = "holds time series of different lengths, or no end of settling"
        raise DamagedFile(path, problem, "run its study again") from error


def series_name(key: str) -> str:
    """Return the name of a job's script."""
    return f"job-{key}"


def draw_job(run: xr.Dataset) -> Drawing:
    """Return a job's acceleration and the size of its contact forces, over the last revolution."""
    angle, turn = last_revolution(run)
    drawing, grid = make_grid(2, 1, 5.0)
    drawing.width = 8.0
    above, below = grid[:, 0]
    for panel, title in ((above, ACCELERATION), (below, FORCE)):
        panel.title, panel.y.title = title.partition(" (")[0], title
        panel.x = Scale(ANGLE_AXIS, float(angle[0]), float(angle[-1]), step=90.0)
    black = LineStyle(BLACK)
    above.plot(angle, turn["acceleration"].values, black, "acceleration")
    sizes = 1e-3 * np.linalg.norm(turn["contact_force"].transpose("joint", "time", "axis"), axis=2)
    for joint, size in zip(JOINTS, sizes, strict=True):
        below.plot(angle, size, LineStyle(BY_JOINT[joint][0]), SPOKEN[joint])
    return drawing

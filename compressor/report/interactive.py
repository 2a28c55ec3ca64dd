"""The numbers of figures and of single jobs as scripts, from which the page draws.

The script calls `compsimFigure(name, {...})`, since a page from disk may load scripts, but no data.
Numbers are 32-bit floats in base64, or `[first, step, count]` where they are evenly spaced; curves
have as many points as a screen can show.
"""

import base64
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from compressor.analysis import SPOKEN, NoSeriesError, last_revolution
from compressor.metrics import JOINTS
from compressor.report.figures.extract import FigureData, Panel, PanelText, Scale, Trace
from compressor.store import DamagedJob, Stored, publish

LIBRARY = "plotly.min.js"
MAX_POINTS = 2400  # of a curve: some three for each pixel of a wide panel
FLOAT = np.dtype("f4").newbyteorder("little")
EVEN = 1e-6  # of a step: how far evenly spaced numbers may be off


def publish_library(folder: Path) -> None:
    """Put plotly.js beside the page, unless this version of it lies there. Raises StoreError."""
    path = folder / LIBRARY
    source = find_spec("plotly")
    (place,) = (source.submodule_search_locations or [""])[:1] if source else [""]
    library = Path(place) / "package_data" / LIBRARY
    if not path.exists() or path.stat().st_size != library.stat().st_size:
        publish(path, library.read_bytes())


def script(name: str, sheet: FigureData) -> str:
    """Return the script of a figure."""
    data = json.dumps(content(sheet), separators=(",", ":"), allow_nan=False)
    data = data.replace("<", "\\u003c")
    return f"compsimFigure({json.dumps(name)},{data});\n"


def content(sheet: FigureData) -> dict[str, Any]:
    """Return what a figure shows, as plain data. Panels with the same `link` are zoomed together.

    `unified`: all curves go from left to right, so that the values at one x are told together.
    """
    links = (
        link_scales([panel.x for panel in sheet.panels]),
        link_scales([p.y for p in sheet.panels], "y"),
    )
    words = [*(panel.y.words for panel in sheet.panels)]
    width, height = sheet.size
    return {
        "aspect": round(height / width, 4),
        "heights": sheet.heights,
        "widths": sheet.widths,
        "unified": all(
            trace.kind == "line" and not (np.diff(trace.x) < 0).any()
            for panel in sheet.panels
            for trace in panel.traces
            if trace.name
        ),
        "panels": [
            {
                "title": panel.title,
                "x": axis(panel.x) | {"link": x, "unit": unit(axis_title(sheet, panel))},
                "y": axis(panel.y, words[y]) | {"link": y, "unit": unit(panel.y.title)},
                "row": panel.row,
                "column": panel.column,
                "square": panel.is_square,
                "traces": [trace_data(trace, panel) for trace in panel.traces],
                "notes": [note(one) for one in panel.notes],
            }
            for panel, x, y in zip(sheet.panels, *links, strict=True)
        ],
    }


def axis_title(sheet: FigureData, panel: Panel) -> str:
    """Return the title of a panel's x axis, or of one below it in the same column."""
    below = [one for one in sheet.panels if one.column == panel.column and one.row >= panel.row]
    return next((one.x.title for one in below if one.x.title), "")


def unit(title: str) -> str:
    """Return the unit in an axis' title: what stands in the last brackets."""
    found = re.search(r"\(([^()]*)\)[^()]*$", title)
    return found[1] if found else ""


def link_scales(scales: Sequence[Scale], way: str = "x") -> list[int]:
    """Return a number for each scale, the same where scales show the same span of the same
    quantity.

    In x a title that is left out is that of the panels below.
    """
    keys = []
    for scale in scales:
        span = scale.low, scale.high, scale.log
        keys.append((*span, "" if way == "x" or scale.bare else scale.title))
    return [keys.index(key) for key in keys]


def axis(scale: Scale, others: Mapping[float, str] | None = None) -> dict[str, Any]:
    """Return an axis as plain data; others: words of the axis that it is like."""
    words = [[place, text] for place, text in (scale.words or others or {}).items()]
    found = {"title": scale.title, "range": [scale.low, scale.high], "log": scale.log}
    more = {"words": words, "step": scale.step, "bare": scale.bare}
    return found | {name: value for name, value in more.items() if value}


def note(one: PanelText) -> dict[str, Any]:
    """Return a text, or a straight line, as plain data."""
    place = {way: value for way in "xy" if not np.isnan(value := getattr(one, way))}
    return {"text": one.text, **place, "color": one.color, "dash": one.dash, "inside": one.inside}


def trace_data(trace: Trace, panel: Panel) -> dict[str, Any]:
    """Return a trace as plain data, with the points that its panel can show."""
    found: dict[str, Any] = {
        "kind": trace.kind, "name": trace.name, "color": trace.color,
        "width": round(float(trace.width), 3), "dash": trace.dash, "marker": trace.marker,
        "opacity": trace.opacity,
    }  # fmt: skip
    if trace.z is not None:
        more = {"z": numbers(trace.z.ravel()), "limits": trace.limits, "log": trace.log,
                "scale": trace.scale_name}  # fmt: skip
        found |= more
        part: Any = slice(None)
        found |= {"x": numbers(trace.x), "y": numbers(trace.y)}
    else:
        part = visible(trace, panel)
        found |= {"x": numbers(trace.x[part]), "y": numbers(trace.y[part])}
    if trace.errors is not None:
        found["errors"] = [numbers(ends[part]) for ends in trace.errors]
        found["across"] = trace.across
    if trace.jobs:
        found["jobs"] = [*np.array(trace.jobs, object)[part].tolist()]
    return found


def visible(trace: Trace, panel: Panel) -> Any:
    """Return the places of the points to draw: all, or where these are many the extremes of each
    pixel.

    Of a curve in x from left to right only what lies in the panel, and a point on either side.
    """
    x, y = trace.x, trace.y
    if trace.kind not in ("line", "points") or x.size < 3 or not np.isfinite(x).all():
        return slice(None)
    if trace.kind == "points" or (np.diff(x) < 0).any():
        return slice(None) if x.size <= 2 * MAX_POINTS else every(x.size, 2 * MAX_POINTS)
    low, high = sorted((panel.x.low, panel.x.high))
    first = max(0, int(np.searchsorted(x, low, "left")) - 1)
    last = min(x.size, int(np.searchsorted(x, high, "right")) + 1)
    if last - first <= MAX_POINTS:
        return slice(first, last)
    return first + extremes(y[first:last], MAX_POINTS // 2)


def every(size: int, count: int) -> np.ndarray:
    """Evenly chosen places."""
    return np.unique(np.linspace(0, size - 1, count).astype(int))


def extremes(y: np.ndarray, count: int) -> np.ndarray:
    """Return the places of the least and the greatest value of each of so many parts, and of the
    ends.
    """
    edges = np.linspace(0, y.size, count + 1).astype(int)[:-1]
    filled = np.where(np.isfinite(y), y, 0.0)
    least, greatest = np.minimum.reduceat(filled, edges), np.maximum.reduceat(filled, edges)
    part = np.repeat(np.arange(count), np.diff([*edges, y.size]))
    wanted = (filled == least[part]) | (filled == greatest[part]) | ~np.isfinite(y)
    wanted[[0, -1]] = True
    places = np.flatnonzero(wanted)
    return places if places.size <= 4 * count else every(y.size, 2 * count)


def numbers(values: np.ndarray) -> Any:
    """Return the numbers for the page: `[first, step, count]` where they are even, else base64."""
    values = np.asarray(values, float)
    if values.size > 8 and np.isfinite(values).all():
        step = (values[-1] - values[0]) / (values.size - 1)
        even = values[0] + step * np.arange(values.size)
        if step and np.abs(values - even).max() <= EVEN * abs(step):
            return [float(values[0]), float(step), values.size]
    return base64.b64encode(values.astype(FLOAT).tobytes()).decode()


def describe_figure(sheet: FigureData) -> str:
    """Return what is seen in a figure, in words: its panels, their axes and curves."""
    told = []
    for panel in sheet.panels:
        names = dict.fromkeys(trace.name or trace.scale_name for trace in panel.traces)
        curves = ", ".join(name for name in names if name)
        axes = " over ".join(title for title in (panel.y.title, panel.x.title) if title)
        told.append(": ".join(part for part in (panel.title or axes, curves) if part))
    several = f"{len(told)} panels. " if len(told) > 1 else ""
    return several + "; ".join(dict.fromkeys(told))


MAX_SERIES = 60  # jobs of a study whose time series lie beside the page
COLORS = {"big_end": "#1f4488", "small_end": "#d0583b"}
ANGLE = "crank angle (°), 0 = top dead centre"
ACCELERATION, FORCE = "acceleration (m/s²)", "contact force (kN)"


def job_scripts(stored: Stored, keys: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield the key and script of the first jobs whose time series are kept."""
    found = 0
    for key in dict.fromkeys(keys):
        status = stored.status(key)
        if found == MAX_SERIES:
            return
        if status is None or status.status != "ok" or not status.samples:
            continue
        try:
            sheet = job_sheet(stored.job(key))
        except (NoSeriesError, DamagedJob):
            continue  # shorter than a revolution, or its file is damaged, of which others tell
        found += 1
        yield key, script(series_name(key), sheet)


def series_name(key: str) -> str:
    """Return the name of a job's script."""
    return f"job-{key}"


def job_sheet(run: xr.Dataset) -> FigureData:
    """Return a job's acceleration and the size of its contact forces, over the last revolution."""
    angle, turn = last_revolution(run)
    moved = Trace("line", "acceleration", angle, turn["acceleration"].values, color="#000000")
    sizes = 1e-3 * np.linalg.norm(turn["contact_force"].transpose("joint", "time", "axis"), axis=2)
    forces = tuple(
        Trace("line", SPOKEN[joint], angle, size, color=COLORS[joint])
        for joint, size in zip(JOINTS, sizes, strict=True)
    )
    panels = tuple(
        Panel(title, Scale(ANGLE, float(angle[0]), float(angle[-1]), step=90.0),
              Scale(title, *limits(traces)), (row, row + 1), (0, 1), traces, ())
        for row, (title, traces) in enumerate(((ACCELERATION, (moved,)), (FORCE, forces)))
    )  # fmt: skip
    return FigureData(panels, (1.0, 1.0), (1.0,), (8.0, 5.0))


def limits(traces: Iterable[Trace]) -> tuple[float, float]:
    """Return the least and the greatest value of curves, with some room."""
    values = np.concatenate([trace.y for trace in traces])
    low, high = float(values.min()), float(values.max())
    room = 0.05 * (high - low) or 1.0
    return low - room, high + room

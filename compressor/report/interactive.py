"""The numbers of figures and of single jobs as scripts, from which the page draws.

The script calls `compsimFigure(name, {...})` with plotly's JSON, since a page from disk may load
scripts, but no data. Numbers are 32-bit floats in base64, or `x0` and `dx` where they are evenly
spaced; curves have as many points as a screen can show.
"""

import base64
import json
from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from compressor.analysis import SPOKEN, NoSeriesError, last_revolution
from compressor.metrics import JOINTS, SERIES
from compressor.report.figures.curves import ANGLE_AXIS
from compressor.report.figures.drawing import Trace, make_grid, thin_places
from compressor.report.figures.job import BY_JOINT
from compressor.report.figures.style import BLACK, LineStyle
from compressor.store import DamagedFile, Stored, publish
from compressor.units import Units

LIBRARY = "plotly.min.js"
MAX_POINTS = 2400  # of a curve: some three for each pixel of a wide panel
FLOAT = np.dtype("f4").newbyteorder("little")
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


def script(name: str, figure: go.Figure) -> str:
    """Return the script of a figure."""
    data = json.dumps(content(figure), separators=(",", ":"), allow_nan=False)
    data = data.replace("<", "\\u003c")
    return f"compsimFigure({json.dumps(name)},{data});\n"


def content(figure: go.Figure) -> dict[str, Any]:
    """Return a figure as plotly's JSON, with the points that a screen can show."""
    data = []
    for trace in figure.data:
        axis = figure.layout[f"xaxis{trace.xaxis[1:]}"]
        ends = [10.0**end for end in axis.range] if axis.type == "log" else axis.range
        data.append(trace_data(trace, ends))
    return {"data": data, "layout": encode_arrays(figure.layout.to_plotly_json())}


def trace_data(trace: Trace, ends: Sequence[float]) -> dict[str, Any]:
    """Return a trace as plotly's JSON; ends: of what its panel shows of x."""
    found = trace.to_plotly_json()
    if trace.type != "scatter" or trace.fill:
        return encode_arrays(found)
    part = visible(trace, ends)
    for of in (found, found.get("error_y", {})):
        for name in ("x", "y", "customdata", "array", "arrayminus"):
            if name in of:
                of[name] = of[name][part]
    x = found["x"]
    if x.size > 8 and np.isfinite(x).all():
        step = (x[-1] - x[0]) / (x.size - 1)
        if step and np.abs(x - (x[0] + step * np.arange(x.size))).max() <= EVEN * abs(step):
            del found["x"]
            found |= {"x0": float(x[0]), "dx": float(step)}
    return encode_arrays(found)


def encode_arrays(given: Any) -> Any:
    """Return what JSON holds of a value: arrays of numbers as plotly has them in base64."""
    if isinstance(given, dict):
        return {name: encode_arrays(one) for name, one in given.items()}
    if isinstance(given, list | tuple):
        return [encode_arrays(one) for one in given]
    if not isinstance(given, np.ndarray):
        return given.item() if isinstance(given, np.generic) else given
    if given.dtype.kind not in "fiu":
        return given.tolist()
    shape = {"shape": ", ".join(map(str, given.shape))} if given.ndim > 1 else {}
    data = base64.b64encode(given.astype(FLOAT).tobytes()).decode()
    return {"dtype": "f4", "bdata": data} | shape


def visible(trace: go.Scatter, ends: Sequence[float]) -> Any:
    """Return the places of the points to draw: all, or of many the extremes of each pixel.

    Of a curve in x from left to right only what lies in the panel, and a point on either side.
    """
    x, y = trace.x, trace.y
    if x.size < 3 or not np.isfinite(x).all():
        return slice(None)
    if "lines" not in trace.mode or (np.diff(x) < 0).any():
        return thin_places(x.size, 2 * MAX_POINTS)
    low, high = sorted(ends)
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


MAX_SERIES = 60  # jobs of a study whose time series lie beside the page
ACCELERATION, FORCE = ("acceleration", "m/s²"), ("contact force", "kN")
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
            figure = draw_job(read_shown(stored, key), units)
        except (NoSeriesError, DamagedFile):
            continue  # shorter than a revolution, or its file is damaged: others report it
        found += 1
        yield key, script(series_name(key), figure)


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


def draw_job(run: xr.Dataset, units: Units = "usual") -> go.Figure:
    """Return a job's acceleration and the size of its contact forces, over the last revolution."""
    angle, turn = last_revolution(run)
    drawing, grid = make_grid(2, 1, 4.0, units=units)
    sizes = 1e-3 * np.linalg.norm(turn["contact_force"].transpose("joint", "time", "axis"), axis=2)
    for panel, (title, unit) in zip(grid[:, 0], (ACCELERATION, FORCE), strict=True):
        panel.title = title
        panel.label("x", ANGLE_AXIS)
        panel.label("y", f"{title} ({{}})", unit)
        panel.span("x", angle[0], angle[-1])
        panel.x.dtick, panel.unit["x"] = 90.0, "°"
    above, below = grid[:, 0]
    above.plot(angle, turn["acceleration"].values, LineStyle(BLACK), "acceleration")
    for joint, size in zip(JOINTS, sizes, strict=True):
        below.plot(angle, size, LineStyle(BY_JOINT[joint][0]), SPOKEN[joint])
    return drawing.figure()

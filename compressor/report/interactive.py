"""The numbers of figures and of single jobs as scripts, from which the page draws.

The script calls `compsimFigure(name, {...})` with plotly's JSON, since a page from disk may load
scripts, but no data. Numbers are 32-bit floats in base64, or `x0` and `dx` where they are evenly
spaced; curves have as many points as a screen can show.
"""

import json
from base64 import b64encode
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.io.json import to_json_plotly

from compressor.analysis import SPOKEN, NoSeriesError, last_revolution
from compressor.metrics import JOINTS, SERIES
from compressor.report.figures.curves import ANGLE_AXIS
from compressor.report.figures.drawing import Trace, make_grid, thin_places
from compressor.report.figures.job import BY_JOINT
from compressor.report.figures.style import BLACK, LineStyle
from compressor.store import DamagedFile, Stored
from compressor.units import Units

MAX_POINTS = 2400  # of a curve: some three for each pixel of a wide panel
EVEN = 1e-3  # of a step: how far evenly spaced numbers may be off


def script(name: str, figure: go.Figure) -> str:
    """Return the script of a figure in plotly's JSON, with the points that a screen can show.

    Plotly checks again whatever it makes a figure of, so that this is none.
    """
    data = [thin_trace(trace, figure.layout[f"xaxis{trace.xaxis[1:]}"]) for trace in figure.data]
    found = {"data": data, "layout": figure.layout.to_plotly_json()}
    return f"compsimFigure({json.dumps(name)},{to_json_plotly(found)});\n"


def thin_trace(trace: Trace, axis: Any) -> dict[str, Any]:
    """Return a trace with fewer points and numbers of 32 bits; axis: of x."""
    found = trace.to_plotly_json()
    part = visible(trace, axis) if trace.type == "scatter" and not trace.fill else slice(None)
    x = found["x"][part].astype(np.float32)
    for of in (found, found.get("error_y", {}), found.get("error_x", {})):
        for name in (name for name, one in of.items() if isinstance(one, np.ndarray)):
            values = of[name][part]
            is_number = values.dtype.kind not in "OU" and values.size > 0
            of[name] = encode(values) if is_number else values
    if trace.type == "scatter" and x.size > 8 and np.isfinite(x).all():
        step = float(x[-1] - x[0]) / (x.size - 1)
        if step and np.ptp(x - x[0] - step * np.arange(x.size)) <= EVEN * abs(step):
            del found["x"]
            found |= {"x0": float(x[0]), "dx": step}
    return found


def encode(values: np.ndarray) -> dict[str, str]:
    """Return numbers as plotly's JSON has them: of 32 bits, in base64."""
    found = {"dtype": "f4", "bdata": b64encode(values.astype("<f4").tobytes()).decode()}
    return found | ({"shape": ", ".join(map(str, values.shape))} if values.ndim > 1 else {})


def visible(trace: go.Scatter, axis: Any) -> Any:
    """Return the places of the points to draw: all, or of many the extremes of each pixel.

    Of a curve in x from left to right only what the axis shows, and a point on either side.
    """
    x, y = trace.x, trace.y
    if x.size < 3 or not np.isfinite(x).all():
        return slice(None)
    if "lines" not in trace.mode or (np.diff(x) < 0).any():
        return thin_places(x.size, 2 * MAX_POINTS)
    first, last = 0, x.size
    if axis.range and None not in axis.range:
        low, high = (10.0**end if axis.type == "log" else end for end in axis.range)
        first = max(0, int(np.searchsorted(x, low, "left")) - 1)
        last = min(x.size, int(np.searchsorted(x, high, "right")) + 1)
    if last - first <= MAX_POINTS:
        return slice(first, last)
    return first + extremes(y[first:last], MAX_POINTS // 2)


def extremes(y: np.ndarray, count: int) -> np.ndarray:
    """Return the places of the least and greatest value of each of `count` parts, and both ends."""
    parts = np.array_split(np.where(np.isfinite(y), y, 0.0), count)
    starts = np.cumsum([0, *(part.size for part in parts[:-1])])
    found = [start + at for start, part in zip(starts, parts, strict=True)
             for at in (part.argmin(), part.argmax())]  # fmt: skip
    return np.unique([0, *found, y.size - 1])


MAX_SERIES = 60  # jobs of a study whose time series lie beside the page
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
        yield key, script(f"job-{key}", figure)


def read_shown(stored: Stored, key: str) -> xr.Dataset:
    """Return the series of a stored job that its figure shows. Raises DamagedFile.

    A tenth of the time that all of the job takes.
    """
    position = stored.find([key])[0]
    variables = {
        name: (("time", *SERIES.get(name, ((),))[0]), values)
        for name, values in stored.values(key, SHOWN).items()
    }
    return xr.Dataset(variables, attrs={"settle": stored.attributes(position)["settle"]})


def draw_job(run: xr.Dataset, units: Units = "usual") -> go.Figure:
    """Return a job's acceleration and the size of its contact forces, over the last revolution."""
    angle, turn = last_revolution(run)
    drawing, grid = make_grid(2, 1, 4.0, units=units, share_x="all")
    sizes = 1e-3 * np.linalg.norm(turn["contact_force"].transpose("joint", "time", "axis"), axis=2)
    shown = ("acceleration", "m/s²"), ("contact force", "kN")
    for panel, (title, unit) in zip(grid[:, 0], shown, strict=True):
        panel.title = title
        panel.label("x", ANGLE_AXIS, "°")
        panel.label("y", f"{title} ({{}})", unit)
        panel.span("x", angle[0], angle[-1])
        panel.x.dtick = 90.0
    above, below = grid[:, 0]
    above.plot(angle, turn["acceleration"].values, LineStyle(BLACK), "acceleration")
    for joint, size in zip(JOINTS, sizes, strict=True):
        below.plot(angle, size, LineStyle(BY_JOINT[joint][0]), SPOKEN[joint])
    return drawing.figure()

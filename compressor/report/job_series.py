"""The last revolution of single jobs, which the page draws where a job is asked for."""

from collections.abc import Iterable, Iterator

import numpy as np
import xarray as xr

from compressor.analysis import SPOKEN, NoSeriesError, last_revolution
from compressor.metrics import JOINTS
from compressor.report.figures.shown import Panel, Scale, Sheet, Trace
from compressor.report.interactive import script
from compressor.store import DamagedJob, Stored

MOST_SERIES = 60  # jobs of a study whose time series lie beside the page
COLORS = {"big_end": "#1f4488", "small_end": "#d0583b"}
ANGLE = "crank angle (°), 0 = top dead centre"
ACCELERATION, FORCE = "acceleration (m/s²)", "contact force (kN)"


def job_scripts(stored: Stored, keys: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield the key and script of the first jobs whose time series are kept."""
    found = 0
    for key in dict.fromkeys(keys):
        status = stored.status(key)
        if found == MOST_SERIES:
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


def job_sheet(run: xr.Dataset) -> Sheet:
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
    return Sheet(panels, (1.0, 1.0), (1.0,), (8.0, 5.0))


def limits(traces: Iterable[Trace]) -> tuple[float, float]:
    """Return the least and the greatest value of curves, with some room."""
    values = np.concatenate([trace.y for trace in traces])
    low, high = float(values.min()), float(values.max())
    room = 0.05 * (high - low) or 1.0
    return low - room, high + room

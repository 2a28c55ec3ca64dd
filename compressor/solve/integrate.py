"""Integrate one record over time: by the compiled march, or by one of SciPy's methods.

Both call the same right-hand side, restart at every load corner, observe each accepted step's
dense solution at Gauss-Lobatto nodes for the metrics, and sample it on the output grid.
"""

import math
import time

import numpy as np

from compressor.physics import (
    COLUMNS,
    FLOWS,
    new_tally,
    observe_all,
    sample_segments,
    segments,
    tally_energy,
)
from compressor.solve.march_driver import march_through
from compressor.solve.marching import COMPILED
from compressor.solve.request import Request, Stop, Trajectory
from compressor.solve.scipy_driver import step_through


def ready(request: Request) -> tuple[Trajectory, np.ndarray, np.ndarray, np.ndarray]:
    """Return what a request begins with: an empty trajectory, the load's edges and phases, the
    motion.
    """
    edges, phases = segments(request.p, float(request.times[-1]))
    owner = sample_segments(request.times, edges)
    states = np.full((request.times.size, request.start.size), math.nan)
    result = Trajectory(request.times, states, phases[owner], new_tally(request.p))
    z = np.zeros(request.start.size + FLOWS)
    z[:-FLOWS] = request.start
    rows = np.empty((1, COLUMNS))
    observe_all(np.zeros(1), request.start[np.newaxis], phases[:1], request.p, rows)
    tally_energy(rows[0], z[-FLOWS:], result.tally)
    return result, edges, phases, z


def integrate(request: Request) -> Trajectory:
    """Integrate a scene with clearance over its output grid; a run that fails is returned too."""
    result, edges, phases, z = ready(request)
    began = time.perf_counter()
    try:
        # a trial step may leave the finite numbers; the steps taken are checked
        with np.errstate(all="ignore"):
            if request.method in COMPILED:
                march_through(request, result, edges, phases, z)
            else:
                step_through(request, result, edges, phases, z)
    except Stop as stop:
        result.reason, result.detail = stop.reason, stop.detail
    result.seconds = time.perf_counter() - began
    return result

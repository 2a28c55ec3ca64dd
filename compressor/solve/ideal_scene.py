"""The ideal scene: nothing is integrated, metrics and energy flows by quadrature."""

import itertools
import math
import time

import numpy as np

from compressor.physics import (
    COLUMNS,
    FLOWS,
    add_flows,
    lobatto,
    new_tally,
    observe_all,
    sample_segments,
    segments,
    tally_energy,
    tally_step,
)
from compressor.reasons import Reason
from compressor.solve.request import Trajectory, overdue

NODES, WEIGHTS = lobatto(9)
PIECES_A_LOOK = 256  # of the quadrature between two looks at the clock


def closed_form(
    p: np.record, times: np.ndarray, settle: float, pieces: int, timeout: float = math.inf
) -> Trajectory:
    """Return the trajectory of ideal joints over an output grid, without integration.

    `pieces`: into which each stretch between load corners, or each revolution in it, is cut;
    `timeout`: wall time (s) that it may take.
    """
    deadline = time.monotonic() + timeout
    edges, phases = segments(p, float(times[-1]))
    result = Trajectory(
        times, np.zeros((times.size, 4)), phases[sample_segments(times, edges)], new_tally(p)
    )
    began = time.perf_counter()
    grid = fine_grid(edges, pieces, 2.0 * math.pi / p.omega)
    cuts = np.unique(np.concatenate((edges, [settle], grid)))
    owner = sample_segments((cuts[:-1] + cuts[1:]) / 2, edges)
    states = np.zeros((NODES.size, 4))
    rows = np.empty((NODES.size, COLUMNS))
    flows, apart = np.zeros(FLOWS), np.zeros(2)
    for number, (begin, end) in enumerate(itertools.pairwise(cuts)):
        phase = phases[owner[number]]
        if number % PIECES_A_LOOK == 0 and time.monotonic() > deadline:
            result.reason = Reason.BUDGET_SECONDS
            result.detail, result.stop_time = overdue(timeout), float(begin)
            result.states[times >= begin] = math.nan
            break
        nodes = begin + (end - begin) * NODES
        observe_all(nodes, states, np.full(NODES.size, phase), p, rows)
        tally_energy(rows[0], flows, result.tally)
        add_flows(rows, WEIGHTS, end - begin, flows)
        tally_energy(rows[-1], flows, result.tally)
        tally_step(end - begin, NODES, WEIGHTS, rows, 1, apart, begin >= settle, result.tally, p)
    result.seconds = time.perf_counter() - began
    return result


def fine_grid(edges: np.ndarray, pieces: int, turn: float) -> np.ndarray:
    """Return the points that cut every segment of the ideal motion into pieces a quadrature
    resolves.
    """
    grids = []
    for begin, end in itertools.pairwise(edges):
        count = pieces * math.ceil((end - begin) / turn - 1e-9)
        grids.append(np.linspace(begin, end, count + 1))
    return np.concatenate(grids)

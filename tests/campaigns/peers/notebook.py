"""A plain-Python right-hand side under SciPy's LSODA.

What a careful notebook has: scalar formulas without arrays, absolute tolerances scaled to the
clearance (a third faster here than the best single number), a fresh start at every load corner,
and the acceleration recomputed from the states on the output grid.
"""

import numpy as np
from peers.mechanism import ACCELERATIONS, DURATION, START, load_of, output_grid, pieces, tolerances
from scipy.integrate import solve_ivp


def plain_rates(scene, load):
    """(t, y) -> y' as a tuple of floats."""
    accelerate, n = ACCELERATIONS[scene], len(START[scene]) // 2

    def rates(t, y):
        y = y.tolist()
        return (*y[n:], *accelerate(t, *y, *load))

    return rates


def by_scipy(scene, load, times, y, rtol):
    """States at `times` (ascending, the first is the start) by SciPy's LSODA."""
    found = solve_ivp(
        plain_rates(scene, load), (times[0], times[-1]), y, "LSODA", times,
        rtol=rtol, atol=tolerances(scene, rtol),
    )  # fmt: skip
    if not found.success:
        raise RuntimeError(found.message)
    return found.y.T


def acceleration(scene, rtol, duration=DURATION):
    """Crosshead acceleration (m/s2) on the output grid."""
    accelerate = ACCELERATIONS[scene]
    a, y = np.empty(output_grid(duration).size), np.array(START[scene])
    for samples, times, wanted, phase in pieces(duration):
        load = load_of(phase, y[0])
        states = by_scipy(scene, load, times, y, rtol)
        y = states[-1].copy()
        a[samples] = [
            accelerate(t, *row, *load)[0]
            for t, row in zip(times[wanted].tolist(), states[wanted].tolist(), strict=True)
        ]
    return a

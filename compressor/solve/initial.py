"""The motion at the start of a case: top dead centre, ideal rates, and an elastic rod bent as it is
then, at rest in itself.

Without this deflection under what moves it, it would ring from the first moment on.
"""

import numpy as np

from compressor.cases import Case
from compressor.physics import (
    FLOWS,
    Coordinate,
    derivative_with_flows,
    is_featured,
    start,
    state_names,
)
from compressor.solve.si_record import offsets

ROUNDS = 4  # in which the rod's deflection is found: nearly linear
SHIFT = 1e-7  # m, by which its modes are moved to learn how they answer


def initial_state(case: Case, p: np.record, shift: np.ndarray | float = 0.0) -> np.ndarray:
    """Return the state at time 0, journals as offset by the case and by a shift (m), (joint,
    axis).
    """
    y = np.zeros(len(state_names(p)))
    start(offsets(case) + shift, y, p)
    if is_featured(p) and p["elastic"]:
        deflect(p, y)
    return y


def deflect(p: np.record, y: np.ndarray) -> None:
    """Deflect the rod, in y, so that its modes are not accelerated: Newton's method."""
    n, first = int(p["freedoms"]), int(p["at"][Coordinate.BEND_1])
    modes = slice(first, first + 4)
    z = np.append(y, np.zeros(FLOWS))
    rates = np.empty_like(z)
    answer = np.empty((4, 4))
    for _ in range(ROUNDS):
        derivative_with_flows(0.0, z, 0, p, rates)
        here = rates[n:][modes].copy()
        for mode in range(4):
            moved = z.copy()
            moved[first + mode] += SHIFT
            derivative_with_flows(0.0, moved, 0, p, rates)
            answer[:, mode] = (rates[n:][modes] - here) / SHIFT
        z[modes] -= np.linalg.solve(answer, here)
    y[modes] = z[modes]

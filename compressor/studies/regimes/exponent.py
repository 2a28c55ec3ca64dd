"""The largest Lyapunov exponent of a motion at a value."""

import math

import numpy as np

from compressor.cases import Case
from compressor.solve import largest_exponent

COUNTED = 16  # rev of a motion that repeats itself


def exponent(
    case: Case, state: np.ndarray, repeats: bool, most: int, timeout: float
) -> tuple[float, float]:
    """Return the largest Lyapunov exponent and its error (1/rev) from a state on; nan: not known.

    Over up to `most` revolutions, few of which tell where the motion repeats itself. The error is
    nan where the motion contracts so fast that the exponent is at most this. timeout: wall time (s)
    that it may take.
    """
    count = min(most, COUNTED) if repeats else most
    found = largest_exponent(case, state, count, timeout)
    return found.value, math.nan if found.at_most else found.error

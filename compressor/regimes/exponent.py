"""The largest Lyapunov exponent of a motion at a value."""

import math

import numpy as np

from compressor.cases import Case


def exponent(case: Case, state: np.ndarray, timeout: float) -> tuple[float, float]:
    """The largest Lyapunov exponent and its error (1/rev) from a state on; nan: not known.

    timeout: wall time (s) that it may take.
    """
    return math.nan, math.nan

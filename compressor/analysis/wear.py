"""When a clearance that grows over operating hours reaches a value."""

import math

import numpy as np


def interpolate_hours(hours: np.ndarray, opened: np.ndarray, clearance: float) -> float:
    """Return the hours at which a joint has a clearance, by straight lines between stages.

    hours: of the stages, (n,), from 0 on; opened: the joint's clearance at them, which never
    shrinks, in the unit of `clearance`, (n,). Returns inf where it is not reached.
    """
    beyond = np.flatnonzero(opened >= clearance)
    if not beyond.size:
        return math.inf
    pair = slice(max(beyond[0] - 1, 0), beyond[0] + 1)
    return float(np.interp(clearance, opened[pair], hours[pair]))

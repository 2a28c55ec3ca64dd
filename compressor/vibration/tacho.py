"""Pulse times of a tacho, freed from the steps of the samples that they were read from."""

import math

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from compressor.vibration.checks import SignalError

FEWEST_PULSES = 3  # with two, there is one revolution time and no change of it
# the least of the variances that are tried, in variances of a pulse: it smooths over some sixty
# revolutions, and the matrix of thousands of pulses stays well conditioned
STEADIEST, TRIED = 1e-6, 41


def smooth_pulses(pulses: np.ndarray, within: np.ndarray) -> np.ndarray:
    """Return the pulse times of the smoothest speed that explains the known ones: s, (k,).

    pulses: s, (k,), one a revolution; within: s, (k,), above 0, how far each may be wrong at most,
    such as half a sample for a level that jumps from one sample to the next. No pulse is moved
    farther than that.

    The change of the revolution time from one revolution to the next is taken as random, with one
    variance q: a discrete smoothing spline (Whittaker, Proc. Edinburgh Math. Soc. 41, 1923). q is
    the most likely one by the second differences of the pulses, whose errors are known (restricted
    likelihood: Wahba, Ann. Stat. 13, 1985). The pulses of a steady machine so come to lie on a
    line; where the speed changes by more than the errors, they stay.

    Raises SignalError for fewer than three pulses, or one that may not be wrong at all.
    """
    count = len(pulses)
    if count < FEWEST_PULSES or len(within) != count or not (np.asarray(within) > 0.0).all():
        problem = f"{count} pulses, {len(within)} bounds of their errors"
        raise SignalError(f"{problem}: pass at least {FEWEST_PULSES}, and a bound above 0 for each")
    variance = np.asarray(within, float) ** 2 / 3.0  # of any time within the bounds alike
    # the second differences D t have the covariance D diag(variance) D' + q I: three bands
    changes = np.diff(pulses, 2)
    bands = np.zeros((3, count - 2))
    bands[0] = variance[:-2] + 4.0 * variance[1:-1] + variance[2:]
    bands[1, :-1] = -2.0 * (variance[1:-2] + variance[2:-1])
    bands[2, :-2] = variance[2:-2]
    mean = float(variance.mean())
    found, least = changes, math.inf
    for q in np.geomspace(STEADIEST * mean, max(mean, float(np.mean(changes**2))), TRIED):
        factor = cholesky_banded(bands + np.array([[q], [0.0], [0.0]]), lower=True)
        weighed = cho_solve_banded((factor, True), changes)
        unlikely = 2.0 * np.log(factor[0]).sum() + changes @ weighed
        if unlikely < least:
            found, least = weighed, unlikely
    moved = variance * np.convolve(found, (1.0, -2.0, 1.0))  # D' of the weighed changes
    return pulses - np.clip(moved, -within, within)

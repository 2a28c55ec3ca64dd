"""Amplitude spectra over frequencies and orders, and the pulses that orders are counted by.

Amplitudes are single-sided. A line of a sine A sin(...) has the peak amplitude A, or the rms
amplitude A/sqrt(2), in the unit of the signal. The line at zero is the magnitude of the mean in
both. Evaluation standards use other measures of one signal: the rms of a whole band for the
vibration of housings (ISO 20816-1; ISO 20816-8 for reciprocating compressors), the peak-to-peak
displacement for shafts (ISO 7919). Peak-to-peak is 2 A for a single line only.

Orders: vibration against crank angle instead of time. An order is a number of cycles in a
revolution of the crank. Samples at equal angles (computed order tracking: Fyfe and Munck,
Mechanical Systems and Signal Processing 11, 1997) keep an order in one line where the speed varies.
Crank angles are in rad and increase without wrapping. Signals may have any unit, which their
amplitudes share.
"""

import math
import operator

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.signal import welch

from compressor.program import CompsimError


class SignalError(CompsimError):
    """A signal, or a choice, that cannot be analysed: what is wrong and what to do about it."""

    exit_code = 2


def checked_signal(values: np.ndarray, what: str = "the signal") -> np.ndarray:
    """Return the values as floats, (m,).

    Raises SignalError unless they are finite, real and in a row.
    """
    found = np.asarray(values)
    if found.ndim != 1 or found.size == 0:
        shape = f"{what} has shape {found.shape}"
        raise SignalError(f"{shape}: pass one component, with at least one sample")
    if np.iscomplexobj(found):
        raise SignalError(f"{what} is complex: pass its real part or its magnitude")
    found = found.astype(float)
    bad = np.flatnonzero(~np.isfinite(found))
    if bad.size:
        rest = f"not finite at {bad.size} of {found.size} samples, first at index {bad[0]}"
        raise SignalError(f"{what} is {rest}: cut these samples off, or fill them")
    return found


def checked_angle(angle: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the angles (rad) and values as floats, (m,) each; raises SignalError.

    The angles must increase from sample to sample.
    """
    at, found = checked_signal(angle, "the crank angle"), checked_signal(values)
    if at.size != found.size:
        raise SignalError(f"{at.size} angles and {found.size} values: pass one angle per sample")
    if at.size < 4:
        raise SignalError(f"{at.size} samples are too few for a cubic spline: pass at least 4")
    back = np.flatnonzero(np.diff(at) <= 0.0)
    if back.size:
        where = f"the crank angle does not increase after index {back[0]}"
        raise SignalError(f"{where}: unwrap it, and drop samples that repeat")
    return at, found


def checked_count(value: int, least: int, what: str) -> int:
    """Return a whole number of at least `least`; raises SignalError."""
    try:
        found = operator.index(value)
    except TypeError:
        raise SignalError(f"{what} is {value!r}: pass a whole number") from None
    if found < least:
        raise SignalError(f"{what} is {found}: pass at least {least}")
    return found


def checked_positive(value: float, what: str) -> float:
    """Return a finite number above zero; raises SignalError."""
    if not (math.isfinite(value) and value > 0.0):
        raise SignalError(f"{what} is {value}: pass a finite number above 0")
    return float(value)


def whole_revolutions(count: int, a_turn: int) -> int:
    """Return the number of revolutions that `count` samples are; raises SignalError."""
    a_turn = checked_count(a_turn, 2, "the number of samples a revolution")
    if count % a_turn:
        rest = f"{count} samples are no whole number of revolutions of {a_turn} samples"
        raise SignalError(f"{rest}: resample the signal at equal angles by `resample_angle`")
    return count // a_turn


def line_amplitudes(values: np.ndarray, block: int, rms: bool) -> np.ndarray:
    """Return the single-sided amplitudes of the lines 0, 1, ... block // 2 cycles a block.

    values: (m,), m >= block. Welch's method (IEEE Transactions on Audio and Electroacoustics 15,
    1967): the mean squares of blocks of `block` samples are averaged, so that a line is the rms
    over blocks. Blocks do not overlap, and their samples weigh alike, so that a sine of a whole
    number of cycles a block has its own amplitude; samples after the last whole block are left. No
    mean is taken off. Each amplitude is a peak value, or with `rms` a root mean square.
    """
    _, squares = welch(
        values, window="boxcar", nperseg=block, noverlap=0, detrend=False, scaling="spectrum"
    )
    found = np.sqrt(squares)
    if not rms:  # zero and, of an even block, the highest line have no partner that is folded in
        found[1 : (block + 1) // 2] *= np.sqrt(2.0)
    return found


TURN = 2.0 * math.pi
SAME_ANGLE = 1e-9  # share of an interval of angle, or of an order: nearer ones are the same


def resample_angle(angle: np.ndarray, values: np.ndarray, a_turn: int) -> np.ndarray:
    """Return the signal at equal crank angles, whole revolutions only: (revolutions * a_turn,).

    angle (rad) and values: (m,), at any increasing angles. Sample i is at angle[0] + 2 pi i /
    a_turn. By a cubic spline (not-a-knot), which passes through the samples. Of a sine with s
    samples a cycle it errs by about 5 / s^4 of its amplitude, near the two ends by up to ten times
    as much. Orders above a_turn / 2 are folded down, so that a_turn should not be less than the
    samples a revolution.

    Raises SignalError if angles do not increase, values are not finite, or the samples do not
    reach over a revolution.
    """
    at, found = checked_angle(angle, values)
    a_turn = checked_count(a_turn, 2, "the number of samples a revolution")
    step = TURN / a_turn
    count = math.floor((at[-1] - at[0]) / step + SAME_ANGLE) + 1  # points that samples surround
    if count < a_turn:
        reach = f"the samples reach over {math.degrees(at[-1] - at[0]):.6g} degrees"
        raise SignalError(f"{reach}: pass at least one revolution, {360 - 360 / a_turn:.6g}")
    points = np.arange(count - count % a_turn)
    return CubicSpline(at, found)(at[0] + TURN * (points / a_turn))


def rms_above(orders: np.ndarray, rms_amplitudes: np.ndarray, order: float) -> float:
    """Return the root mean square of what lies above an order (Parseval).

    The order itself is left out. orders and rms_amplitudes: (k,), of `line_amplitudes` with `rms`
    set. Exact but for lines that the order cuts. 0 if nothing lies above. Raises SignalError if the
    shapes differ or values are not finite.
    """
    at, found = checked_signal(orders, "the order"), checked_signal(rms_amplitudes, "the spectrum")
    if at.size != found.size:
        raise SignalError(f"{at.size} orders and {found.size} amplitudes: pass one for each")
    above = at > order + SAME_ANGLE * abs(order)
    return math.sqrt(float(np.sum(found[above] ** 2)))


MIN_PULSES = 3  # with two, there is one revolution time and no change of it
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
    if count < MIN_PULSES or len(within) != count or not (np.asarray(within) > 0.0).all():
        problem = f"{count} pulses, {len(within)} bounds of their errors"
        raise SignalError(f"{problem}: pass at least {MIN_PULSES}, and a bound above 0 for each")
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
    corrections = variance * np.convolve(found, (1.0, -2.0, 1.0))  # D' of the weighed changes
    return pulses - np.clip(corrections, -within, within)

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

import numpy as np
from scipy.interpolate import CubicSpline, make_smoothing_spline
from scipy.signal import welch

from compressor.program import CompsimError

TURN = 2.0 * math.pi
SAME_ANGLE = 1e-9  # share of an interval of angle, or of an order: nearer ones are the same
MIN_PULSES = 5  # of a smoothing spline


class SignalError(CompsimError):
    """A signal, or a choice, that cannot be analysed: what is wrong and what to do about it."""

    exit_code = 2


def check_signal(values: np.ndarray) -> np.ndarray:
    """Return a signal as floats, (m,). Raises SignalError unless it is real, finite, in a row."""
    found = np.asarray(values)
    if found.ndim != 1 or not found.size or np.iscomplexobj(found):
        what = f"the signal is {found.dtype} of shape {found.shape}"
        raise SignalError(f"{what}: pass one real component, with at least one sample")
    bad = np.flatnonzero(~np.isfinite(found))
    if bad.size:
        where = f"at {bad.size} of {found.size} samples, first at index {bad[0]}"
        raise SignalError(f"the signal is not finite {where}: cut these off, or fill them")
    return found.astype(float)


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


def resample_angle(angle: np.ndarray, values: np.ndarray, a_turn: int) -> np.ndarray:
    """Return the signal at equal crank angles, whole revolutions only: (revolutions * a_turn,).

    angle (rad) and values: (m,), at any increasing angles. Sample i is at angle[0] + 2 pi i /
    a_turn. By a cubic spline (not-a-knot), which passes through the samples. Of a sine with s
    samples a cycle it errs by about 5 / s^4 of its amplitude, near the two ends by up to ten times
    as much. Orders above a_turn / 2 are folded down, so that a_turn should not be less than the
    samples a revolution. Raises SignalError for samples that do not reach over a revolution.
    """
    step = TURN / a_turn
    count = math.floor((angle[-1] - angle[0]) / step + SAME_ANGLE) + 1  # that samples surround
    if count < a_turn:
        reach = f"the samples reach over {math.degrees(angle[-1] - angle[0]):.6g} degrees"
        raise SignalError(f"{reach}: pass at least one revolution, {360 - 360 / a_turn:.6g}")
    points = np.arange(count - count % a_turn)
    return CubicSpline(angle, check_signal(values))(angle[0] + TURN * (points / a_turn))


def rms_above(orders: np.ndarray, rms_amplitudes: np.ndarray, order: float) -> float:
    """Return the root mean square of what lies above an order (Parseval); 0 of nothing.

    The order itself is left out. orders and rms_amplitudes: (k,), of `line_amplitudes` with `rms`
    set. Exact but for lines that the order cuts.
    """
    above = orders > order + SAME_ANGLE * abs(order)
    return math.sqrt(float(np.sum(rms_amplitudes[above] ** 2)))


def smooth_pulses(pulses: np.ndarray, within: np.ndarray) -> np.ndarray:
    """Return the pulse times of a smooth speed that explains the known ones: s, (k,).

    pulses: s, (k,), one a revolution; within: s, (k,), above 0, how far each may be wrong at most,
    such as half a sample for a level that jumps from one sample to the next. A smoothing spline
    over the number of the revolution, as smooth as generalised cross-validation finds it: pulses of
    a steady machine come to lie on a line. Where it would move one farther than its bound the speed
    truly changes, and all stay; so do fewer than five.
    """
    if len(pulses) < MIN_PULSES:
        return pulses
    numbers, size = np.arange(len(pulses), dtype=float), within.mean()
    line = np.polyval(np.polyfit(numbers, pulses, 1), numbers)
    # in sizes of an error: cross-validation looks among smoothing parameters of the order of 1
    spline = make_smoothing_spline(numbers, (pulses - line) / size, w=(size / within) ** 2)
    smooth = line + size * spline(numbers)
    return smooth if (np.abs(smooth - pulses) <= within).all() else pulses

"""Orders: vibration against crank angle instead of time.

An order is a number of cycles in a revolution of the crank. Samples at equal angles (computed
order tracking: Fyfe and Munck, Mechanical Systems and Signal Processing 11, 1997) keep an order in
one line where the speed varies. Crank angles are in rad and increase without wrapping; windows are
in degrees. Signals may have any unit, which their amplitudes share.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from compressor.vibration.checks import (
    SignalError,
    checked_angle,
    checked_count,
    checked_signal,
)
from compressor.vibration.spectra import line_amplitudes, noise_bandwidth

TURN = 2.0 * math.pi
CLOSE = 1e-9  # share of an interval of angle, or of an order: nearer ones are the same


@dataclass(frozen=True)
class AngleWindow:
    """What falls into a window of crank angle, for each of the n windows that are whole.

    `rms` (n,): root mean square over crank angle; `peak` (n,): greatest magnitude of the samples;
    both in the unit of the signal. `inside` (m,): the window that a sample lies in, 0 to n - 1,
    or -1.
    """

    rms: np.ndarray
    peak: np.ndarray
    inside: np.ndarray


def samples_a_turn(angle: np.ndarray) -> int:
    """Return the samples a revolution at the median interval of angles (rad), (m,), rounded up
    to be even.
    """
    return 2 * math.ceil(round(TURN / float(np.median(np.diff(angle)))) / 2)


def resampled(angle: np.ndarray, values: np.ndarray, a_turn: int) -> np.ndarray:
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
    count = math.floor((at[-1] - at[0]) / step + CLOSE) + 1  # points that samples surround
    if count < a_turn:
        reach = f"the samples reach over {math.degrees(at[-1] - at[0]):.6g} degrees"
        raise SignalError(f"{reach}: pass at least one revolution, {360 - 360 / a_turn:.6g}")
    points = np.arange(count - count % a_turn)
    return CubicSpline(at, found)(at[0] + TURN * (points / a_turn))


def order_spectrum(
    angle: np.ndarray,
    values: np.ndarray,
    turns: int | None = None,
    window: str = "rectangular",
    a_turn: int | None = None,
    rms: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Single-sided amplitude spectrum over orders of the crank speed: (orders, amplitudes).

    angle (rad) and values: (m,). turns: revolutions a block, over which mean squares are averaged;
    all of them if None. Orders are 0, 1/turns, ... up to a_turn / 2; a_turn: samples a revolution
    of the resampling, by default `samples_a_turn`. Amplitudes are peak values, with `rms` root
    mean squares (`line_amplitudes`). window: rectangular (noise bandwidth 1 line), which suits
    what repeats after each block; hann (1.5) or flattop (3.77) for what does not.

    With a rectangular window and one block, the squares of rms amplitudes add up to the mean square
    of the resampled signal (Parseval). Raises SignalError as `resampled` does, or for a block of
    more revolutions than there are, or an unknown window.
    """
    at, found = checked_angle(angle, values)
    a_turn = samples_a_turn(at) if a_turn is None else a_turn
    even = resampled(at, found, a_turn)
    revolutions = even.size // a_turn
    turns = checked_count(revolutions if turns is None else turns, 1, "the block of revolutions")
    if turns > revolutions:
        problem = f"a block of {turns} revolutions, and the samples have {revolutions}"
        raise SignalError(f"{problem}: choose fewer turns")
    amplitudes = line_amplitudes(even, turns * a_turn, window, rms)
    return np.arange(amplitudes.size) / turns, amplitudes


def rms_above(
    orders: np.ndarray, rms_amplitudes: np.ndarray, order: float, window: str = "rectangular"
) -> float:
    """Return root mean square of what lies above an order, the order itself left out (Parseval).

    orders and rms_amplitudes: (k,), of a spectrum with `rms` set and this window, whose noise
    bandwidth the sum of squares is divided by. That is exact without leakage for the rectangular
    window, and for others where lines are not cut by the order. 0 if nothing lies above.
    Raises SignalError if the shapes differ or values are not finite.
    """
    at, found = checked_signal(orders, "the order"), checked_signal(rms_amplitudes, "the spectrum")
    if at.size != found.size:
        raise SignalError(f"{at.size} orders and {found.size} amplitudes: pass one for each")
    above = at > order + CLOSE * abs(order)
    return math.sqrt(float(np.sum(found[above] ** 2)) / noise_bandwidth(window))


def synchronous_average(
    angle: np.ndarray, values: np.ndarray, a_turn: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean revolution, (a_turn,), and what is left: (revolutions * a_turn,).

    angle (rad) and values: (m,). Both are at the points of `resampled`, so that sample 0 of the
    mean revolution is at angle[0]. What is left is the resampled signal less the mean revolution.
    Orders that are whole numbers are kept; white noise falls by sqrt(revolutions); half an order
    vanishes for an even number of revolutions (McFadden, Mechanical Systems and Signal Processing
    1, 1987). Raises SignalError as `resampled` does.
    """
    each = resampled(angle, values, a_turn).reshape(-1, a_turn)
    mean = each.mean(axis=0)
    return mean, (each - mean).ravel()


def angle_window(angle: np.ndarray, values: np.ndarray, begin: float, end: float) -> AngleWindow:
    """Return what falls into a window of crank angle in each revolution.

    angle (rad) and values: (m,). begin, end: degrees, begin included and end not; a window whose
    end is not above its begin goes across 360. Only windows that the samples wholly reach over
    count. Samples weigh by the angle they stand for, half of the way to each neighbour, so that a
    window is known to half an interval at either end.

    Raises SignalError if the window is empty or wider than a revolution, no whole one is sampled,
    or one has no samples.
    """
    at, found = checked_angle(angle, values)
    width = end - begin
    if not math.isfinite(width) or width == 0.0 or abs(width) > 360.0:
        text = f"a window from {begin} to {end} degrees"
        raise SignalError(f"{text} is none: choose two different angles within a revolution")
    if width < 0.0:
        width += 360.0
    weight = np.gradient(at)
    turn, place = np.divmod((at - math.radians(begin)) / TURN + CLOSE, 1.0)
    first = math.ceil((at[0] - math.radians(begin)) / TURN - CLOSE)
    # a window may end where the sample after the last one would be
    last = math.floor((at[-1] + weight[-1] - math.radians(begin + width)) / TURN + CLOSE)
    count = last - first + 1
    if count < 1:
        text = f"no window from {begin} to {end} degrees is wholly sampled"
        raise SignalError(f"{text}: pass more revolutions, or a narrower window")
    inside = np.where((place < width / 360.0) & (turn >= first) & (turn <= last), turn - first, -1)
    inside = inside.astype(int)
    kept = inside >= 0
    seen, squares, peak = inside[kept], found[kept] ** 2, np.zeros(count)
    if np.unique(seen).size < count:
        raise SignalError(f"{width:g} degrees hold no sample: choose a wider window")
    mean = np.bincount(seen, weight[kept] * squares) / np.bincount(seen, weight[kept])
    np.maximum.at(peak, seen, np.abs(found[kept]))
    return AngleWindow(np.sqrt(mean), peak, inside)

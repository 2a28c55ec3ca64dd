"""Single numbers that tell how large and how impulsive a vibration is.

A signal may have any unit. None of the functions takes its mean off, but for the kurtosis, which is
about the mean. Where a number is not defined, as of silence, it is nan.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, rfft

from compressor.vibration.checks import SignalError, checked_signal, whole_revolutions


class Shape(NamedTuple):
    """How large a vibration is, in its unit, and how impulsive, by the functions of these names."""

    rms: float
    crest_factor: float
    kurtosis: float
    gini: float


def shape(values: np.ndarray) -> Shape:
    """Return the `Shape` of samples at equal intervals, (m,). Raises SignalError as its
    functions do.
    """
    return Shape(rms(values), crest_factor(values), kurtosis(values), gini(values))


def rms(values: np.ndarray) -> float:
    """Return the root mean square of samples at equal intervals, (m,), in the unit of the signal.

    The measure of severity of ISO 20816-1 (and 10816-1) for the vibration of housings, of what a
    band-pass filter has left: for reciprocating compressors of displacement, velocity and
    acceleration (ISO 20816-8). Raises SignalError as all here: values must be finite, in one row.
    """
    found, size = _scaled(values)
    return size * math.sqrt(float(np.mean(found**2)))


def crest_factor(values: np.ndarray) -> float:
    """Return greatest magnitude over rms of samples (m,): sqrt(2) of a sine, 1 of a square wave."""
    found, size = _scaled(values)
    return 1.0 / math.sqrt(float(np.mean(found**2))) if size else math.nan


def kurtosis(values: np.ndarray) -> float:
    """Return Pearson's kurtosis of samples (m,): fourth central moment over the square of the
    second.

    3 of Gaussian noise, 1.5 of a sine, 1 of a square wave. Moments of the samples themselves,
    without correction of bias; nan of a constant.
    """
    found, _ = _scaled(values)
    if np.ptp(found) == 0.0:
        return math.nan
    square = (found - found.mean()) ** 2
    return float(np.mean(square**2) / np.mean(square) ** 2)


def gini(values: np.ndarray) -> float:
    """Return the Gini index of magnitudes (m,): 0 of a constant, 1 - 1/m of a single one that is
    not zero.

    1 - 2 sum_k (x_k / sum x) (m - k + 1/2) / m, x_1 <= ... <= x_m (Hurley and Rickard, IEEE
    Transactions on Information Theory 55, 2009, Eq. 1). For impulses pass the squared envelope
    (`compressor.vibration.envelope.band_envelope`).
    """
    found, size = _scaled(values)
    if not size:
        return math.nan
    ordered = np.sort(np.abs(found))
    share = (np.arange(found.size)[::-1] + 0.5) / found.size
    return float(1.0 - 2.0 * np.sum(ordered * share) / np.sum(ordered))


def energy_angle(values: np.ndarray, share: float = 0.9) -> float:
    """Return the smallest share of crank angle, 0 to 1, that holds a share of the energy.

    values: (m,) at equal crank angles over whole revolutions, mostly what `high_pass_orders` left.
    The energy is the sum of squares; the angles need not be neighbours, and the last sample counts
    in part. The value is `share` of a square wave, and near 0 of short impulses. Raises SignalError
    also if the share is not between 0 and 1.
    """
    if not 0.0 < share <= 1.0:
        raise SignalError(f"the share is {share}: choose one above 0, and 1 at most")
    found, size = _scaled(values)
    if not size:
        return math.nan
    energy = np.sort(found**2)[::-1]
    held = np.cumsum(energy)
    wanted = share * held[-1]
    whole = int(np.searchsorted(held, wanted))  # samples that hold less than is wanted
    before = held[whole - 1] if whole else 0.0
    return float((whole + (wanted - before) / energy[whole]) / found.size)


def high_pass_orders(values: np.ndarray, a_turn: int, order: float) -> np.ndarray:
    """Return the signal without the orders up to and with this one, (m,).

    values: (m,) at a_turn equal crank angles a revolution, whole revolutions. The lines of the
    spectrum of the whole signal are removed, exactly and without a shift of phase. Raises
    SignalError also if the revolutions are not whole, or the order is negative or not below
    a_turn / 2, where nothing would be left.
    """
    found = checked_signal(values)
    revolutions = whole_revolutions(found.size, a_turn)
    if not 0.0 <= order < a_turn / 2:
        limits = f"order {order} is not from 0 to below {a_turn / 2:g}, half the samples a turn"
        raise SignalError(f"{limits}: choose a lower order, or sample more finely")
    lines = rfft(found)
    lines[: math.floor(order * revolutions * (1.0 + 1e-12)) + 1] = 0.0
    return irfft(lines, found.size)


def _scaled(values: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the checked signal over its greatest magnitude, so that no power overflows, and
    that.
    """
    found = checked_signal(values)
    size = float(np.max(np.abs(found)))
    return (found / size if size else found), size

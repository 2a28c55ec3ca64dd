"""Spectra over frequencies and orders, envelopes, and single numbers of a vibration.

An order is a number of cycles in a revolution of the crank. Samples at equal angles (computed order
tracking: Fyfe and Munck, Mechanical Systems and Signal Processing 11, 1997) keep it in one line
where the speed varies. Amplitudes are single-sided: a sine A sin(...) has the peak amplitude A, or
the rms amplitude A/sqrt(2). An impact rings at a frequency of the structure and comes back at one
of the machine, which the spectrum of the envelope shows (Randall and Antoni, the same 25, 2011).

Signals have any unit, which their amplitudes share, and lie at equal times or angles; envelopes
take them as periodic. All raise RecordError for one that is not finite.
"""

import math

import numpy as np
from scipy.fft import irfft, rfft
from scipy.interpolate import CubicSpline

from compressor.program import CompsimError

SAME_ANGLE = 1e-9  # share of an interval of angle: nearer ones are the same


class RecordError(CompsimError):
    """A record or a signal that cannot be read or used: too short, without tacho, not finite."""


def check_signal(values: np.ndarray) -> np.ndarray:
    """Return a signal as floats, (m,). Raises RecordError unless it is real, finite, in a row."""
    found = np.asarray(values)
    if found.ndim != 1 or not found.size or np.iscomplexobj(found):
        what = f"the signal is {found.dtype} of shape {found.shape}"
        raise RecordError(f"{what}: pass one real component, with at least one sample")
    bad = np.flatnonzero(~np.isfinite(found))
    if bad.size:
        where = f"at {bad.size} of {found.size} samples, first at index {bad[0]}"
        raise RecordError(f"the signal is not finite {where}: cut these off, or fill them")
    return found.astype(float)


def line_amplitudes(values: np.ndarray, block: int, rms: bool) -> np.ndarray:
    """Return the single-sided amplitudes of the lines 0, 1, ... block // 2 cycles a block.

    values: (m,), m >= block. Welch's method (IEEE Transactions on Audio and Electroacoustics 15,
    1967): the mean squares of blocks of `block` samples are averaged. Blocks do not overlap, and
    their samples weigh alike, so that a sine of a whole number of cycles a block has its own
    amplitude; samples after the last whole block are left. No mean is taken off.
    """
    whole = values[: len(values) // block * block].reshape(-1, block)
    found = np.sqrt(np.mean(np.abs(rfft(whole)) ** 2, axis=0)) / block
    # zero and, of an even block, the highest line have no partner that is folded in
    found[1 : (block + 1) // 2] *= math.sqrt(2.0) if rms else 2.0
    return found


def resample_angle(angle: np.ndarray, values: np.ndarray, a_turn: int) -> np.ndarray:
    """Return the signal at equal crank angles, whole revolutions only: (revolutions * a_turn,).

    angle: rad, increasing, (m,). Sample i is at angle[0] + 2 pi i / a_turn. The cubic spline errs
    on a sine with s samples a cycle by about 5 / s^4 of its amplitude, near the ends by up to ten
    times as much. Orders above a_turn / 2 are folded down. Raises RecordError for samples that do
    not reach over a revolution.
    """
    step = 2.0 * math.pi / a_turn
    count = math.floor((angle[-1] - angle[0]) / step + SAME_ANGLE) + 1  # that samples surround
    if count < a_turn:
        reach = f"the samples reach over {math.degrees(angle[-1] - angle[0]):.6g} degrees"
        raise RecordError(f"{reach}: pass at least one revolution, {360 - 360 / a_turn:.6g}")
    points = np.arange(count - count % a_turn)
    return CubicSpline(angle, check_signal(values))(angle[0] + 2.0 * math.pi * (points / a_turn))


def high_pass_orders(values: np.ndarray, a_turn: int, order: float) -> np.ndarray:
    """Return the signal without the orders up to and with this one, (m,).

    values: (m,) at a_turn equal crank angles a revolution, whole revolutions. The lines of the
    spectrum are removed, exactly and without a shift of phase. Raises RecordError where the order
    is negative or not below a_turn / 2, where nothing would be left.
    """
    found = check_signal(values)
    if not 0.0 <= order < a_turn / 2:
        limits = f"order {order} is not from 0 to below {a_turn / 2:g}, half the samples a turn"
        raise RecordError(f"{limits}: choose a lower order, or sample more finely")
    lines = rfft(found)
    lines[: math.floor(order * (found.size / a_turn) * (1.0 + 1e-12)) + 1] = 0.0
    return irfft(lines, found.size)


def band_signal(values: np.ndarray, rate: float, low: float, high: float) -> np.ndarray:
    """Return the part of a signal between two frequencies (Hz), both included, (m,).

    values: (m,), at `rate` samples a second, as if they repeated themselves. The lines of the
    spectrum outside of the band are removed, exactly and without a shift of phase.
    """
    lines = rfft(check_signal(values))
    frequency = np.arange(lines.size) * (rate / len(values))
    inside = (frequency >= low * (1.0 - 1e-12)) & (frequency <= high * (1.0 + 1e-12))
    return irfft(np.where(inside, lines, 0.0), len(values))


def envelope_spectrum(
    values: np.ndarray, rate: float, band: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the amplitude spectrum of the envelope in a band: (frequencies, amplitudes).

    values: (m,) at a rate of samples a second, band and frequencies in Hz, with both edges; with
    a rate of samples a revolution, band and frequencies are in orders. Amplitudes are peak values;
    the line at zero is the mean envelope. A carrier A (1 + d cos(2 pi f t)) has lines A at 0 and
    A d at f. Raises RecordError where no line of the signal lies in the band.
    """
    (low, high), apart = band, rate / len(values)
    if math.floor(min(high, rate / 2) / apart) < math.ceil(low / apart):
        text = f"no line lies between {low} and {high}, which are {apart:g} apart"
        remedy = f"choose a wider band below {rate / 2:g}, half the rate, or pass a longer signal"
        raise RecordError(f"{text}: {remedy}")
    from scipy.signal import hilbert  # takes half a second, of envelopes alone

    envelope = np.abs(hilbert(band_signal(values, rate, low, high)))
    amplitudes = line_amplitudes(envelope, envelope.size, rms=False)
    return np.arange(amplitudes.size) * (rate / envelope.size), amplitudes


def shape(values: np.ndarray) -> tuple[float, float, float, float]:
    """Return how large samples, (m,), are and how impulsive: rms, crest factor, kurtosis and gini.

    rms: root mean square, the measure of severity of ISO 20816-1 and -8 for the vibration of
    housings, of what a band-pass filter has left. Crest factor: greatest magnitude over it, sqrt(2)
    of a sine. Kurtosis: Pearson's, of the fourth moment about the mean, without correction of bias:
    3 of Gaussian noise, 1.5 of a sine. Gini: index of the magnitudes, 0 of a constant and 1 - 1/m
    of a single value (Hurley and Rickard, IEEE Transactions on Information Theory 55, 2009, Eq. 1).
    nan where one is not defined.
    """
    found = check_signal(values)
    root = math.sqrt(float(np.mean(found**2)))
    if not root:
        return 0.0, math.nan, math.nan, math.nan
    from scipy import stats  # takes half a second

    kurtosis = float(stats.kurtosis(found, fisher=False)) if np.ptp(found) else math.nan
    ordered = np.sort(np.abs(found))
    beyond = (np.arange(found.size)[::-1] + 0.5) / found.size
    gini = float(1.0 - 2.0 * np.sum(ordered * beyond) / np.sum(ordered))
    return root, float(ordered[-1]) / root, kurtosis, gini


def energy_angle(values: np.ndarray, share: float = 0.9) -> float:
    """Return the smallest share of crank angle, 0 to 1, that holds a share of the energy.

    values: (m,) over whole revolutions, mostly what `high_pass_orders` left; share: above 0, 1 at
    most. The energy is the sum of squares; the angles need not be neighbours, and the last sample
    counts in part. It is `share` of a square wave, near 0 of short impulses, nan of silence.
    """
    energy = np.sort(check_signal(values) ** 2)[::-1]
    held = np.concatenate([[0.0], np.cumsum(energy)])  # by so many samples
    target = share * held[-1]
    if not target:
        return math.nan
    whole = int(np.searchsorted(held[1:], target))  # samples that hold less than is wanted
    return float((whole + (target - held[whole]) / energy[whole]) / energy.size)

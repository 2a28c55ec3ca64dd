"""Envelopes of a band of high frequencies, and single numbers of a vibration.

An impact rings at a frequency of the structure and comes back at one of the machine. The spectrum
of the envelope shows the latter (Randall and Antoni, Mechanical Systems and Signal Processing 25,
2011). Both functions take the signal as periodic: best are whole revolutions of a settled motion,
at equal times or equal crank angles.

Single numbers that measure how large and how impulsive a vibration is. A signal may have any unit.
None of the functions takes its mean off, but for the kurtosis, which is about the mean. Where a
number is not defined, as of silence, it is nan. All raise SignalError for a signal that is not
finite.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.fft import ifft, irfft, rfft
from scipy.signal import hilbert

from compressor.vibration.spectra import SignalError, check_signal, line_amplitudes

MIN_BAND = 64  # lines in the narrowest band, and so independent samples of its envelope
BAND_EDGE = 0.25  # of a band's width: how far its gain falls off on either side of its edge
ENDS = 4  # samples of an envelope left out at either end, where it feels a jump from end to start
SILENT_SHARE = 1e-10  # share of the signal's rms: a band below it holds rounding


@dataclass(frozen=True)
class Kurtogram:
    """Spectral kurtosis of n bands, widest first.

    `frequency`: centres, `bandwidth`: widths, in the unit of the rate; `kurtosis`: of the complex
    envelope, 0 of stationary Gaussian noise, -1 of a sine, positive of impulses, nan of a band
    200 dB below the signal; `scatter`: its standard deviation for stationary Gaussian noise; each
    (n,). `best`: lower and upper edge of the band with the greatest kurtosis.
    """

    frequency: np.ndarray
    bandwidth: np.ndarray
    kurtosis: np.ndarray
    scatter: np.ndarray
    best: tuple[float, float]


def band_envelope(values: np.ndarray, rate: float, band: tuple[float, float]) -> np.ndarray:
    """Return the magnitude of the analytic signal in a band, (m,), in the unit of the signal.

    values: (m,) at a rate of samples a second (or a revolution); band: lower and upper edge in Hz
    (or orders), both included. Lines outside are removed without a shift of phase; then Hilbert's
    transform. Raises SignalError where no line lies in the band.
    """
    found, (low, high) = check_signal(values), band
    lines = rfft(found)
    frequency = np.arange(lines.size) * rate / found.size
    inside = (frequency >= low) & (frequency <= high)
    if not inside.any():
        text = f"no line lies between {low} and {high}, which are {rate / found.size:g} apart"
        remedy = f"choose a wider band below {rate / 2:g}, half the rate, or pass a longer signal"
        raise SignalError(f"{text}: {remedy}")
    return np.abs(hilbert(irfft(np.where(inside, lines, 0.0), found.size)))


def envelope_spectrum(
    values: np.ndarray, rate: float, band: tuple[float, float], speed: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the amplitude spectrum of the envelope in a band: (frequencies, amplitudes).

    values: (m,) at a rate of samples a second, band in Hz (`band_envelope`). Frequencies are in Hz,
    or orders if a speed in revolutions a second is given; with a rate of samples a revolution, band
    and frequencies are in orders anyway. Amplitudes are single-sided peak values in the unit of the
    signal; the line at zero is the mean envelope.

    A carrier A (1 + d cos(2 pi f t)) has lines A at 0 and A d at f.
    """
    envelope = band_envelope(values, rate, band)
    amplitudes = line_amplitudes(envelope, envelope.size, rms=False)
    return np.arange(amplitudes.size) * (rate / envelope.size / speed), amplitudes


def kurtogram(values: np.ndarray, rate: float, levels: int) -> Kurtogram:
    """Return the spectral kurtosis over the bands of a 1/3-binary tree.

    values: (m,) at a rate of samples a second, or a revolution. The range from 0 to rate / 2 is
    divided by 1, 2, 3, 4, 6, 8, 12, ... 2^levels, as by Antoni's fast kurtogram (Mechanical Systems
    and Signal Processing 21, 2007). The kurtosis is <|c|^4> / <|c|^2>^2 - 2 of the complex envelope
    c of a band. Instead of a tree of filters, each envelope comes from its lines in the spectrum of
    the signal, with a gain that falls off as a cosine over a quarter of the width beyond and within
    each edge; neighbours share the power. The mean is taken off first.

    The scatter is 2 sqrt(sum r^4 / n) of n samples of c, whose autocorrelation r follows from the
    gain; 2 / sqrt(n) of independent ones. Noise alone has a greatest kurtosis of 2.5 to 4.5 times
    its scatter over the 220 bands of 6 levels, in 80 % of records.

    Large slow motion reaches into the lowest bands alone, but a jump from the end to the start
    of a signal that is not periodic is an impulse; the samples about it are left out. Raises
    SignalError if the narrowest band has less than `MIN_BAND` lines, or the signal is constant.
    """
    found = check_signal(values)
    half = found.size // 2
    if half < MIN_BAND * 2**levels:
        need = f"{levels} levels need {2 * MIN_BAND * 2**levels} samples, and there are"
        raise SignalError(f"{need} {found.size}: choose fewer levels, or pass a longer signal")
    if np.ptp(found) == 0.0:
        raise SignalError("the signal is constant, so that it has no kurtosis: pass another one")
    lines = rfft(found - found.mean())[: half + 1]
    parts = sorted(
        {2**level for level in range(levels + 1)} | {3 * 2**level for level in range(levels - 1)}
    )
    kurtosis, scatter = np.hstack([_kurtosis_of_parts(lines, n) for n in parts])
    width = np.repeat(rate / 2 / np.array(parts), parts)
    centre = (np.concatenate([np.arange(n) for n in parts]) + 0.5) * width
    one = int(np.nanargmax(kurtosis))
    best = (float(centre[one] - width[one] / 2), float(centre[one] + width[one] / 2))
    return Kurtogram(centre, width, kurtosis, scatter, best)


def _kurtosis_of_parts(lines: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the kurtosis and its scatter of as many equal bands, (parts,) each; lines: (k,)."""
    width = (lines.size - 1) / parts
    reach = math.ceil(width * (0.5 + BAND_EDGE)) + 1
    centre = ((np.arange(parts) + 0.5) * width)[:, None]
    index = np.floor(centre).astype(int) + np.arange(-reach, reach)
    past = np.clip((np.abs(index - centre) / width - 0.5) / BAND_EDGE, -1.0, 1.0)  # 0 at an edge
    gain = np.cos((past + 1.0) * (math.pi / 4))
    gain[(index < 0) | (index >= lines.size)] = 0.0
    envelope = ifft(np.pad(lines, reach)[index + reach] * gain, axis=1)[:, ENDS:-ENDS]
    power = np.abs(envelope) ** 2
    mean, fourth = np.mean(power, axis=1), np.mean(power**2, axis=1)
    silent = mean <= SILENT_SHARE**2 * np.sum(np.abs(lines) ** 2) / index.shape[1] ** 2
    alike = np.abs(ifft(gain**2, axis=1))
    scatter = 2.0 * np.sqrt(np.sum((alike / alike[:, :1]) ** 4, axis=1) / power.shape[1])
    return np.where(silent, np.nan, fourth / np.where(silent, 1.0, mean**2) - 2.0), scatter


class Shape(NamedTuple):
    """How large a vibration is, in its unit, and how impulsive, by the functions of these names."""

    rms: float
    crest_factor: float
    kurtosis: float
    gini: float


def shape(values: np.ndarray) -> Shape:
    """Return the `Shape` of samples at equal intervals, (m,)."""
    return Shape(rms(values), crest_factor(values), kurtosis(values), gini(values))


def rms(values: np.ndarray) -> float:
    """Return the root mean square of samples at equal intervals, (m,), in the unit of the signal.

    The measure of severity of ISO 20816-1 (and 10816-1) for the vibration of housings, of what a
    band-pass filter has left: for reciprocating compressors of displacement, velocity and
    acceleration (ISO 20816-8).
    """
    return math.sqrt(float(np.mean(check_signal(values) ** 2)))


def crest_factor(values: np.ndarray) -> float:
    """Return greatest magnitude over rms of samples (m,): sqrt(2) of a sine, 1 of a square wave."""
    size = rms(values)
    return float(np.max(np.abs(values))) / size if size else math.nan


def kurtosis(values: np.ndarray) -> float:
    """Return Pearson's kurtosis of samples (m,); nan of a constant.

    3 of Gaussian noise, 1.5 of a sine, 1 of a square wave. Without correction of bias.
    """
    found = check_signal(values)
    return float(stats.kurtosis(found, fisher=False)) if np.ptp(found) else math.nan


def gini(values: np.ndarray) -> float:
    """Return the Gini index of magnitudes (m,).

    It is 0 for a constant and 1 - 1/m for a single value that is not zero: 1 - 2 sum_k (x_k / sum
    x) (m - k + 1/2) / m, x_1 <= ... <= x_m (Hurley and Rickard, IEEE Transactions on Information
    Theory 55, 2009, Eq. 1). For impulses pass the squared envelope
    (`compressor.vibration.envelope.band_envelope`).
    """
    ordered = np.sort(np.abs(check_signal(values)))
    share = (np.arange(ordered.size)[::-1] + 0.5) / ordered.size
    total = np.sum(ordered)
    return float(1.0 - 2.0 * np.sum(ordered * share) / total) if total else math.nan


def energy_angle(values: np.ndarray, share: float = 0.9) -> float:
    """Return the smallest share of crank angle, 0 to 1, that holds a share of the energy.

    values: (m,) at equal crank angles over whole revolutions, mostly what `high_pass_orders` left.
    The energy is the sum of squares; the angles need not be neighbours, and the last sample counts
    in part. The value is `share` of a square wave, and near 0 of short impulses. share: above 0, 1
    at most.
    """
    energy = np.sort(check_signal(values) ** 2)[::-1]
    held = np.concatenate([[0.0], np.cumsum(energy)])  # by so many samples
    target = share * held[-1]
    if not target:
        return math.nan
    whole = int(np.searchsorted(held[1:], target))  # samples that hold less than is wanted
    return float((whole + (target - held[whole]) / energy[whole]) / energy.size)


def high_pass_orders(values: np.ndarray, a_turn: int, order: float) -> np.ndarray:
    """Return the signal without the orders up to and with this one, (m,).

    values: (m,) at a_turn equal crank angles a revolution, whole revolutions. The lines of the
    spectrum of the whole signal are removed, exactly and without a shift of phase. Raises
    SignalError where the order is negative or not below a_turn / 2, where nothing would be left.
    """
    found = check_signal(values)
    if not 0.0 <= order < a_turn / 2:
        limits = f"order {order} is not from 0 to below {a_turn / 2:g}, half the samples a turn"
        raise SignalError(f"{limits}: choose a lower order, or sample more finely")
    lines = rfft(found)
    lines[: math.floor(order * (found.size / a_turn) * (1.0 + 1e-12)) + 1] = 0.0
    return irfft(lines, found.size)

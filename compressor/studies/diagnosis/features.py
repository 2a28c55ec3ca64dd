"""What describes a record by numbers: the one table of features for data sets and diagnosis.

A record is an accelerometer's samples with the times at which the crank passes top dead centre. The
level is one feature; all others are shares and shapes, which say nothing of the machine's size.
Whole revolutions count alone, from the first tacho pulse to the last.
"""

import itertools
import math

import numpy as np

from compressor import analysis, vibration

SECTORS = 24  # of crank angle, 15 degrees each
BANDS = (0.0, 200.0, 400.0, 700.0, 1100.0, 1700.0, 2300.0, 4000.0, 7000.0)  # edges, Hz
ENVELOPE = (1700.0, 2300.0)  # Hz: the casing's mode; of another machine give its own
BEATS = (1, 2, 3, 4)  # orders of the envelope
SMALLEST = 1e-6  # share that the logarithm of a share is taken of at least


ABOVE = f"the energy above order {analysis.ORDER}"
FEATURES = {  # name -> phrase
    "level": "log10 of the rms in m/s2",
    "speed": "log10 of the speed in rev/s",
    "crest_factor": "greatest magnitude over rms",
    "kurtosis": "fourth central moment over the square of the second",
    "gini": "Gini index of magnitudes",
    "energy_angle": f"share of angle with 90 % of {ABOVE}",
    "above_swing": f"log10 of the share of {ABOVE}",
    "synchronous": f"of {ABOVE}, that every turn repeats",
    **{f"band_{low:g}": f"log10 of the share of the energy, {low:g} to {high:g} Hz"
       for low, high in itertools.pairwise((*BANDS, math.inf))},
    **{f"sector_{begin}": f"log10 of the share of {ABOVE}, from {begin} degrees on"
       for begin in range(0, 360, 360 // SECTORS)},
    **{f"envelope_{beat}": f"order {beat} of the envelope over its mean" for beat in BEATS},
}  # fmt: skip


def features(record: vibration.Record) -> dict[str, float]:
    """Return the `FEATURES` of a record by name.

    A crank angle is known to a sample. Raises RecordError for fewer than two revolutions, pulses
    that do not increase or lie beyond the samples, and values that are not all numbers, or all
    zero.
    """
    turned = vibration.by_revolutions(record, SECTORS)
    even, a_turn, speed = turned.values.ravel(), turned.values.shape[1], turned.speed
    ((_, whole),) = vibration.cut_windows(record, len(turned.values))
    if not np.any(whole.values):
        raise vibration.RecordError("the record's values are all zero: they hold no signal")
    size, *shapes = vibration.shape(even)
    found = {"level": math.log10(size), "speed": math.log10(speed)}
    found |= dict(zip(("crest_factor", "kurtosis", "gini"), shapes, strict=True))
    high = vibration.high_pass_orders(even, a_turn, analysis.ORDER)
    each = high.reshape(-1, a_turn)
    energy = float(np.mean(high**2))
    found["energy_angle"] = vibration.energy_angle(high) if energy else math.nan
    found["above_swing"] = log_share(energy, float(np.mean(even**2)))
    found["synchronous"] = float(np.mean(each.mean(axis=0) ** 2)) / energy if energy else math.nan
    found |= bands(whole.values, turned.rate)
    sectors = (each**2).mean(axis=0).reshape(SECTORS, -1).sum(axis=1)
    for k, part in enumerate(sectors):
        found[f"sector_{360 * k // SECTORS}"] = log_share(float(part), float(sectors.sum()))
    found |= envelope(even, a_turn, speed)
    return {name: float(found[name]) for name in FEATURES}


def bands(values: np.ndarray, rate: float) -> dict[str, float]:
    """Return the log10 of each band's share of the energy."""
    amplitudes = vibration.line_amplitudes(values - values.mean(), values.size, True)
    frequency = np.arange(amplitudes.size) * rate / values.size
    power = amplitudes**2
    power[frequency > rate / 2.0 * (1.0 - 1e-9)] = 0.0  # a line of even numbers of samples alone
    place = np.searchsorted(BANDS, frequency, side="right") - 1
    sums = np.bincount(place, power, len(BANDS))
    total = float(sums.sum())
    return {
        f"band_{low:g}": log_share(float(one), total) for low, one in zip(BANDS, sums, strict=True)
    }


def envelope(even: np.ndarray, a_turn: int, speed: float) -> dict[str, float]:
    """Return amplitudes of the envelope's first orders over its mean, in the `ENVELOPE` band."""
    top = a_turn / 2.0
    low, high = (min(edge / speed, top) for edge in ENVELOPE)
    if not low < high:
        return {f"envelope_{beat}": math.nan for beat in BEATS}
    _, lines = vibration.envelope_spectrum(even, float(a_turn), (low, high))
    revolutions = even.size // a_turn
    return {f"envelope_{beat}": lines[beat * revolutions] / lines[0] for beat in BEATS}


def log_share(part: float, whole: float) -> float:
    """Return the log10 of a share of an energy, at least of `SMALLEST`."""
    return math.log10(max(part / whole, SMALLEST)) if whole > 0.0 else math.nan

"""How alike two records are, over crank angle and over orders of the crank's speed.

Everything follows from the lines of each revolution: its Fourier coefficients at whole orders, up
to the highest order that both records hold. The mean is left out, since accelerometers lose it.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from compressor.vibration import segment_levels

SEGMENTS = 36
SWING = 12  # order up to which a machine without clearance shakes; the envelope is of what is above
FINE = 4  # points on a curve for each cycle of its highest order
SMALLEST = 1e-6  # share of the mean square that a band counts with at least: -60 dB
MIN_FOR_ERRORS = 3  # revolutions
# weights in `difference`, dB, of the mean revolution's orders, of one less both correlations and of
# the logarithm of the ratio of rms: calibrated, and judged by other records (docs/diagnosis.md)
MEAN_ORDERS, MEAN_SHAPE, BURSTS, LEVEL = 0.5, 3.0, 10.0, 3.0
NEAR_DEG = 5  # by which a tacho may be off: shapes and bursts count where they fit best so far off
MIN_LINES = 8  # of a third octave, by which noise is known
QUIET = 1e-4  # share of the loudest third octave below which none is compared
SAME_BAND = 0.5  # dB, to which a third octave of a job is taken as known


@dataclass(frozen=True)
class Curves:
    """What is drawn of a record.

    mean: m/s2 over `angle` (deg), its mean revolution, (m,); peak, rms: m/s2 of each segment,
    averaged over revolutions, (36,); spectrum: m/s2 rms of the orders 1, 2, ..., (orders,);
    envelopes: m/s2 above order `SWING` of each revolution, averaged over each degree, (n, 360).
    """

    angle: np.ndarray
    mean: np.ndarray
    peak: np.ndarray
    rms: np.ndarray
    spectrum: np.ndarray
    envelopes: np.ndarray

    @property
    def envelope(self) -> np.ndarray:
        """Return the envelope over crank angle, averaged over revolutions, (360,)."""
        return self.envelopes.mean(axis=0)

    def part(self, kept: np.ndarray) -> "Curves":
        """Return the same with the envelopes of some revolutions alone."""
        return replace(self, envelopes=self.envelopes[kept])


def curves(lines: np.ndarray) -> Curves:
    """Return the curves of a record from its lines, (n, orders)."""
    orders = lines.shape[1]
    size = 360 * math.ceil(FINE * orders / 360)
    whole = np.zeros((len(lines), size), complex)  # of the analytic signal
    whole[:, 1 : orders + 1] = lines * (math.sqrt(2.0) * size)
    each = np.fft.ifft(whole, axis=1).real
    whole[:, : SWING + 1] = 0.0
    envelopes = np.abs(np.fft.ifft(whole, axis=1)).reshape(len(lines), 360, -1).mean(axis=2)
    angle = np.arange(size) * (360.0 / size)
    levels = np.array([segment_levels(angle, turn, SEGMENTS) for turn in each])
    peak, rms = levels.mean(axis=0)
    spectrum = np.sqrt(np.mean(np.abs(lines) ** 2, axis=0))
    return Curves(angle, each.mean(axis=0), peak, rms, spectrum, envelopes)


@dataclass(frozen=True)
class Measured:
    """A number with its standard error by the record's revolutions; nan where there are too few."""

    value: float
    error: float


@dataclass(frozen=True)
class Likeness:
    """How alike a record and a job are.

    difference: dB, from 0: all of the numbers together, by which jobs are ordered (`_difference`).
    correlation: of the mean revolutions, -1 to 1: 1 is the same shape at the same angles, whatever
    the size. envelope: correlation of the envelopes over crank angle, -1 to 1: 1 is the same bursts
    at the same angles, whatever rings in them. rms_ratio: of the record over the job, from 0: 1 is
    as strong. spectral_distance: dB, from 0 to 60: rms difference of the shares of third octaves of
    orders in the mean square; 3 dB is a factor of 2, whatever the size.
    """

    difference: Measured
    correlation: Measured
    envelope: Measured
    rms_ratio: Measured
    spectral_distance: Measured


def compare_lines(record: np.ndarray, job: np.ndarray, mine: Curves, other: Curves) -> Likeness:
    """Return how alike a record and a job are by their lines, (n, orders) each, and curves.

    Errors are of the jackknife: each revolution of the record is left out in turn (Efron and Stein,
    Annals of Statistics 9, 1981), from three on.
    """
    found = np.array(_numbers(record, mine, job, other))
    errors = np.full(found.size, math.nan)
    if (count := len(record)) >= MIN_FOR_ERRORS:
        rests = (np.arange(count) != k for k in range(count))
        left = np.array([_numbers(record[rest], mine.part(rest), job, other) for rest in rests])
        errors = np.sqrt((count - 1) / count * ((left - left.mean(axis=0)) ** 2).sum(axis=0))
    return Likeness(*map(Measured, found.tolist(), errors.tolist()))


def _numbers(record: np.ndarray, mine: Curves, job: np.ndarray, other: Curves) -> tuple[float, ...]:
    """Return the numbers of a `Likeness` in their order, by lines, (n, orders) each."""
    one, two = record.mean(axis=0), job.mean(axis=0)
    size = math.sqrt(float((np.abs(one) ** 2).sum() * (np.abs(two) ** 2).sum()))
    correlation = float((one * two.conj()).real.sum()) / size if size else math.nan
    power, others = (np.mean(np.abs(lines) ** 2, axis=0) for lines in (record, job))
    ratio = math.sqrt(float(power.sum() / others.sum())) if others.sum() else math.nan
    bursts = [one - one.mean() for one in (mine.envelope, other.envelope)]
    sizes = math.sqrt(float((bursts[0] ** 2).sum() * (bursts[1] ** 2).sum()))
    envelope = float((bursts[0] * bursts[1]).sum()) / sizes if sizes else math.nan
    apart = _difference(record, job, *bursts)
    return apart, correlation, envelope, ratio, spectral_distance(power, others)


def _difference(
    record: np.ndarray, job: np.ndarray, bursts: np.ndarray, others: np.ndarray
) -> float:
    """Return how far a record is from a job by all numbers together, dB; nan of a silent one.

    record, job: lines, (n, orders); bursts, others: their envelopes less the mean, (360,). It is
    the distance of the third octaves of orders with their level, of all revolutions and of the mean
    one; one less the correlation of the mean revolutions and one less that of the envelopes, where
    they are greatest within `NEAR_DEG`; and the ratio of the mean revolutions' rms. White noise is
    taken out of all powers.
    """
    sides = [_band_powers(lines) for lines in (record, job)]
    means = [lines.mean(axis=0) for lines in (record, job)]
    shape = math.sqrt(math.prod(float((np.abs(one) ** 2).sum()) for one in means))
    size = math.sqrt(float((bursts**2).sum() * (others**2).sum()))
    if not shape or not size:
        return math.nan
    alike = float((_near_turns(record.shape[1]) @ (means[0] * means[1].conj())).real.max()) / shape
    near = range(-NEAR_DEG, NEAR_DEG + 1)
    same = max(float(bursts @ np.roll(others, degree)) for degree in near) / size
    whole, mean = (_bands_apart(*(side[k] for side in sides)) for k in (0, 1))
    powers = [float(np.maximum(side[1][0], 0.0).sum()) for side in sides]
    level = 0.5 * abs(math.log(powers[0] / powers[1])) if min(powers) > 0.0 else 0.0
    return (whole + MEAN_ORDERS * mean + MEAN_SHAPE * (1.0 - alike) + BURSTS * (1.0 - same)
            + LEVEL * level)  # fmt: skip


@lru_cache(maxsize=4)
def _near_turns(orders: int) -> np.ndarray:
    """Return what turns lines by each tenth of a degree within `NEAR_DEG`, (angles, orders)."""
    shifts = np.radians(np.linspace(-NEAR_DEG, NEAR_DEG, 20 * NEAR_DEG + 1))
    return np.exp(1j * np.outer(shifts, np.arange(1, orders + 1)))


Powers = tuple[np.ndarray, np.ndarray]  # of third octaves, and their standard deviations by noise


def _band_powers(lines: np.ndarray) -> tuple[Powers, Powers]:
    """Return the mean squares of third octaves without noise: of all revolutions, of the mean one.

    lines: (n, orders). White noise makes all lines alike: it is the mean of the third octaves that
    are as quiet as the quietest one, within their scatter.
    """
    count, orders = lines.shape
    band = third_octaves(orders)
    wide = np.bincount(band)
    whole = np.bincount(band, np.mean(np.abs(lines) ** 2, axis=0))
    mean = np.bincount(band, np.abs(lines.mean(axis=0)) ** 2)
    scatter = 1.0 / np.sqrt(count * wide)
    a_line = whole / wide
    known = wide >= min(MIN_LINES, wide.max())
    least = int(np.argmin(np.where(known, a_line * (1.0 + 2.0 * scatter), math.inf)))
    alike = known & (a_line <= a_line[least] * (1.0 + 3.0 * (scatter + scatter[least])))
    noise = float(whole[alike].sum() / wide[alike].sum())
    one = whole - noise * wide, noise * np.sqrt(wide / count)
    return one, (mean - noise / count * wide, noise / count * np.sqrt(wide))


def _bands_apart(record: Powers, job: Powers) -> float:
    """Return the rms difference of third octaves in dB, each weighted by how well it is known."""
    (one, noise), (other, others) = record, job
    low = 2.0 * (noise + others) + QUIET * max(one.max(), other.max())
    heard = (one > low) | (other > low)
    if not heard.any():
        return 0.0
    first, second = np.maximum(one, low)[heard], np.maximum(other, low)[heard]
    scale = 10.0 / math.log(10.0)
    unsure = (scale * noise[heard] / first) ** 2 + (scale * others[heard] / second) ** 2
    weight = 1.0 / (unsure + SAME_BAND**2)
    return math.sqrt(float(weight @ (scale * np.log(first / second)) ** 2 / weight.sum()))


def third_octaves(orders: int) -> np.ndarray:
    """Return the third octave of each of the orders 1, 2, ..., from 0, (orders,).

    Middle orders are 2^(k/3), edges a sixth of an octave beside them; those without an order are
    left out.
    """
    place = np.round(3.0 * np.log2(np.arange(1, orders + 1))).astype(int)
    return np.unique(place, return_inverse=True)[1]


def spectral_distance(record: np.ndarray, job: np.ndarray) -> float:
    """Return the rms difference (dB) of the shares of third octaves in the mean square.

    record, job: mean squares of the orders 1, 2, ..., (orders,). Shares below `SMALLEST` count as
    that, so that the distance is at most 60 dB; third octaves below it in both are left out. It is
    the log spectral distance (Gray and Markel, IEEE Transactions on Acoustics, Speech and Signal
    Processing 24, 1976) of spectra that are scaled to the same level.
    """
    band = third_octaves(record.size)
    shares = []
    for squares in (record, job):
        powers = np.bincount(band, squares)
        if not powers.sum():
            return math.nan
        shares.append(powers / powers.sum())
    heard = np.maximum(*shares) > SMALLEST
    one, two = (np.maximum(share[heard], SMALLEST) for share in shares)
    return float(np.sqrt(np.mean((10.0 * np.log10(one / two)) ** 2)))


def share_inside(record: np.ndarray, jobs: np.ndarray) -> float:
    """Return the share of crank angle at which a record's envelope lies in the jobs' range.

    record: (360,); jobs: (jobs, 360).
    """
    return float(np.mean((record >= jobs.min(axis=0)) & (record <= jobs.max(axis=0))))

"""Limits from sound windows, and how often an alarm trips: what sets a limit never judges it.

Windows of one draw (a load, a speed, a machine, whatever a study varies beside joint and clearance)
are alike, so that draws count, and not windows. Draws with sound windows are shared out among
folds. The limit by which the windows of a fold are judged comes from the sound windows of the other
folds alone, and so does what is usual of a sound machine. Draws without sound windows set no limit:
they are judged by the one that all sound windows set, which is the one to use.

A limit for a rate of false alarms is that of conformal risk control (Angelopoulos et al. 2022,
arXiv:2208.02814): with n draws and the share f_i of windows of draw i above it, the least limit for
which (sum f_i + 1) / (n + 1) is at most the rate. A new draw then trips at most so often in the
mean over all such n draws, whatever their distribution is. Below 1 / (n + 1) no limit says so: it
then is the greatest score, and the rate 1 / (n + 1). What is usual comes from the same draws, so
that this holds nearly: how often sound machines trip is counted on the folds.
"""

import math
from collections.abc import Sequence
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

SURE = 0.95  # coverage of intervals
Z = NormalDist().inv_cdf(0.5 + SURE / 2.0)
FOLDS = 5


class Rate(NamedTuple):
    """A share of windows, its interval, and the draws that it is of."""

    share: float
    low: float
    high: float
    draws: int


def share_out(draws: np.ndarray, is_sound: np.ndarray, folds: int, seed: int) -> np.ndarray:
    """Return the fold of each window, (n,): the same for all windows of a draw.

    draws: names, (n,). Those with sound windows are shared out evenly among folds from 0 on; the
    others are in one more fold, number `folds`.
    """
    sound = sorted({*draws[is_sound].tolist()})
    order = np.random.default_rng(seed).permutation(len(sound))
    fold_of = {sound[i]: place % folds for place, i in enumerate(order)}
    return np.array([fold_of.get(name, folds) for name in draws.tolist()], int)


def find_limit(scores: np.ndarray, draws: np.ndarray, rate: float) -> float:
    """Return the least limit for a rate of false alarms, by the scores of sound windows, (n,)."""
    _, place, sizes = np.unique(draws, return_inverse=True, return_counts=True)
    weights = 1.0 / sizes[place]
    spare = max(rate * (sizes.size + 1) - 1.0, 0.0)
    levels, at = np.unique(scores, return_inverse=True)
    of_level = np.bincount(at, weights, levels.size)
    above = of_level[::-1].cumsum()[::-1] - of_level
    return float(levels[np.flatnonzero(above <= spare + 1e-9)[0]])


def compute_interval(share: float, count: int) -> tuple[float, float]:
    """Return Wilson's interval of a share of independent draws (JASA 22, 1927); nan of none.

    A draw may trip in part of its windows: it then scatters less than one that trips or does not,
    and the interval is too wide rather than too narrow.
    """
    if not count:
        return math.nan, math.nan
    spread = Z**2 / count
    middle = (share + spread / 2.0) / (1.0 + spread)
    half = Z * math.sqrt(share * (1.0 - share) / count + spread / (4.0 * count)) / (1.0 + spread)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def draws_to_be_sure(share: float) -> float:
    """Return how many draws, all detected, have an interval from a share or above on.

    inf of a share of 1.
    """
    return math.ceil(Z**2 * share / (1.0 - share)) if share < 1.0 else math.inf


def compute_rate(trips: np.ndarray, draws: np.ndarray) -> Rate:
    """Return how often windows trip, (n,), as the mean over draws of each one's share."""
    _, place, sizes = np.unique(draws, return_inverse=True, return_counts=True)
    if not sizes.size:
        return Rate(math.nan, math.nan, math.nan, 0)
    shares = np.bincount(place, trips, sizes.size) / sizes
    share = min(max(float(shares.mean()), 0.0), 1.0)
    return Rate(share, *compute_interval(share, sizes.size), sizes.size)


class First(NamedTuple):
    """The least clearance from which on an alarm detects, and its interval; inf: at none."""

    clearance: float
    low: float
    high: float


def first_clearance(clearances: Sequence[float], rates: Sequence[Rate], least: float) -> First:
    """Return the least of some rising clearances from which on the rate is `least` or more.

    Its interval goes from where the rates' upper ends are so on, to where their lower ends are.
    """
    found = [
        find_onset(clearances, [getattr(one, name) >= least for one in rates])
        for name in ("share", "high", "low")
    ]
    return First(*found)


def find_onset(clearances: Sequence[float], holds: Sequence[bool]) -> float:
    """Return the least of rising clearances at which, and beyond which, something holds, or inf."""
    missed = [place for place, one in enumerate(holds) if not one]
    begin = missed[-1] + 1 if missed else 0
    return clearances[begin] if begin < len(clearances) else math.inf

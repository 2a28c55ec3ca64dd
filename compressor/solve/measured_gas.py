"""Measured gas: an end's pressure over the crank's angle, and what its card says of itself.

A card's pressures are absolute here, and smoothed where a case asks for it: by Savitzky and Golay's
cubic least squares (SciPy's), in a window that goes round the revolution.
"""

import math
from collections.abc import Sequence

import numpy as np

from compressor.cases import Case, open_card, to_si
from compressor.physics import CARD_NODES, exact_motion

SMOOTHING_ORDER = 3  # of the polynomials in a window
NOISE_WINDOW = 6.0  # degrees, in which noise is told from the card
DIGITS = 12  # of a pressure in MPa: what differs beyond them is rounding of binary numbers
OFF_STEP = 0.05  # of a step, by which a multiple of it may be off
POLYTROPIC = (0.2, 0.8)  # shares of the pressure's logarithmic range between which lines are fitted
MIN_FITTED = 5  # samples on each of the two lines
CLEARANCES = np.geomspace(0.005, 3.0, 400)  # of the swept volume, that are tried


def gas_nodes(case: Case, end: str) -> np.ndarray:
    """Return pressure (Pa, absolute) and its slope a node of an end's card, (CARD_NODES, 2)."""
    gas = case.gas
    card = open_card(gas.cards[end], end)
    nodes = to_si(1.0, "MPa") * card_nodes(card.angles, card.pressures)
    if card.is_gauge:
        nodes[:, 0] += to_si(gas.ambient, "MPa")
    return smooth_nodes(nodes, gas.smooth_deg or 0.0)


def card_nodes(angles: Sequence[float], values: Sequence[float]) -> np.ndarray:
    """Return values, and slopes a node, of a card's curve at angles (degrees): (CARD_NODES, 2)."""
    from scipy.interpolate import Akima1DInterpolator  # of cases with a card alone

    around = np.add.outer([-360.0, 0.0, 360.0], angles).ravel()
    curve = Akima1DInterpolator(around, np.tile(values, 3))
    width = 360.0 / CARD_NODES
    at = np.arange(CARD_NODES) * width
    return np.stack([curve(at), width * curve(at, 1)], axis=1)


def smooth_nodes(nodes: np.ndarray, degrees: float) -> np.ndarray:
    """Return values and slopes a node, (m, 2), smoothed in a window; 0 degrees: as they are."""
    width = 2 * round(degrees * len(nodes) / 720.0) + 1
    if width <= SMOOTHING_ORDER + 1:
        return nodes
    from scipy.signal import savgol_filter

    both = [
        savgol_filter(nodes[:, 0], width, SMOOTHING_ORDER, deriv=derivative, mode="wrap")
        for derivative in (0, 1)
    ]
    return np.stack(both, axis=1)


def card_noise(case: Case, end: str) -> float:
    """Return the standard deviation (MPa) of what differs from sample to sample in a card.

    By the median of fourth differences; at least that of rounding to multiples of a step.
    """
    card = open_card(case.gas.cards[end], end)
    values = np.array(card.pressures)
    bends = np.diff(np.concatenate([values[-2:], values, values[:2]]), 4)
    noise = float(np.median(np.abs(bends)) / (0.6745 * math.sqrt(70.0)))
    step = np.diff(np.unique(values.round(DIGITS))).min(initial=math.inf)
    multiples = values / step
    if math.isinf(step) or np.abs(multiples - np.round(multiples)).max() > OFF_STEP:
        return noise
    return max(noise, float(step) / math.sqrt(12.0))


def fit_polytrope(case: Case, end: str) -> tuple[float, float, float] | None:
    """Return misfit, clearance and exponent that fit both lines of a card; None without lines.

    Misfit: rms of the pressure's logarithm; clearance: of the swept volume; p (c + s)^n is
    constant.
    """
    machine, pressure = case.machine, gas_nodes(case, end)[:, 0]
    angles = np.arange(pressure.size) * 2.0 * math.pi / pressure.size
    x, *_ = exact_motion(angles, machine.crank_radius_mm, machine.rod_length_mm, 1.0)
    swept = (x.max() - x) / (2.0 * machine.crank_radius_mm)
    grows = angles < math.pi
    if end == "crank":
        swept, grows = 1.0 - swept, ~grows
    level = np.log(pressure)
    low, high = level.min() + np.array(POLYTROPIC) * (level.max() - level.min())
    between = (level > low) & (level < high)
    lines = [between & side for side in (grows, ~grows)]
    if high <= low or min(line.sum() for line in lines) < MIN_FITTED:
        return None
    found = []
    for clearance in CLEARANCES:
        volume = np.log(clearance + swept)
        apart = [(volume[line] - volume[line].mean(), level[line] - level[line].mean())
                 for line in lines]  # fmt: skip
        v, p = (np.concatenate(each) for each in zip(*apart, strict=True))
        exponent = -float(v @ p) / float(v @ v)
        misfit = float(np.sqrt(np.mean((p + exponent * v) ** 2)))
        found.append((misfit, float(clearance), exponent))
    return min(found)

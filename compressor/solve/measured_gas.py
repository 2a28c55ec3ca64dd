"""Measured gas: an end's pressure over the crank's angle, and what its card says of itself.

A card's pressures are absolute here, and smoothed where a case asks for it: by Savitzky and Golay's
cubic least squares (SciPy's), in a window that goes round the revolution.
"""

import math
from typing import NamedTuple

import numpy as np

from compressor.cases import Case, open_card, to_si
from compressor.physics import card_nodes, exact_motion

SMOOTHING_ORDER = 3  # of the polynomials in a window
POLYTROPIC = (0.2, 0.8)  # shares of the pressure's logarithmic range between which lines are fitted
MIN_FITTED = 5  # samples on each of the two lines
CLEARANCES = np.geomspace(0.005, 3.0, 400)  # of the swept volume, that are tried


def gas_nodes(case: Case, end: str) -> np.ndarray:
    """Return pressure (Pa, absolute) and its slope a node of an end's card, (m, 2).

    end: head or crank. Raises CardError where the file is no longer so.
    """
    gas = case.gas
    card = open_card(gas.cards[end], end)
    nodes = to_si(1.0, "MPa") * card_nodes(card.angles, card.pressures)
    if card.is_gauge:
        nodes[:, 0] += to_si(gas.ambient, "MPa")
    width = 2 * round((gas.smooth_deg or 0.0) * len(nodes) / 720.0) + 1
    if width > SMOOTHING_ORDER + 1:
        from scipy.signal import savgol_filter

        values = nodes[:, 0].copy()
        for derivative in (0, 1):
            nodes[:, derivative] = savgol_filter(
                values, width, SMOOTHING_ORDER, deriv=derivative, mode="wrap"
            )
    return nodes


def card_noise(case: Case, end: str) -> float:
    """Return the standard deviation (MPa) of what differs from sample to sample in a card.

    By the median of its fourth differences, which hold little of a pressure that valves and piston
    make.
    """
    card = open_card(case.gas.cards[end], end)
    values = np.array(card.pressures)
    bends = np.diff(np.concatenate([values[-2:], values, values[:2]]), 4)
    return float(np.median(np.abs(bends)) / (0.6745 * math.sqrt(70.0)))


class Polytrope(NamedTuple):
    """What an end's compression and expansion lines say together."""

    clearance: float  # of the swept volume
    exponent: float
    misfit: float  # rms of the pressure's logarithm


def fit_polytrope(case: Case, end: str) -> Polytrope | None:
    """Return the clearance and the exponent that fit both lines of an end's card; None without two.

    Of the lines p (c + s)^n = const, one each way, with the swept share s of the machine without
    clearance in its joints.
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
    best = None
    for clearance in CLEARANCES:
        volume = np.log(clearance + swept)
        apart = [(volume[line] - volume[line].mean(), level[line] - level[line].mean())
                 for line in lines]  # fmt: skip
        v, p = (np.concatenate(each) for each in zip(*apart, strict=True))
        exponent = -float(v @ p) / float(v @ v)
        misfit = float(np.sqrt(np.mean((p + exponent * v) ** 2)))
        if best is None or misfit < best.misfit:
            best = Polytrope(float(clearance), exponent, misfit)
    return best

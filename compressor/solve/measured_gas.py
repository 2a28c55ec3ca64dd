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
    """Return pressure (Pa, absolute) and its slope a node of an end's card, (m, 2).

    end: head or crank. Raises CardError where the file is no longer so.
    """
    gas = case.gas
    card = open_card(gas.cards[end], end)
    nodes = to_si(1.0, "MPa") * card_nodes(card.angles, card.pressures)
    if card.is_gauge:
        nodes[:, 0] += to_si(gas.ambient, "MPa")
    return smooth_nodes(nodes, gas.smooth_deg or 0.0)


def card_nodes(angles: Sequence[float], values: Sequence[float]) -> np.ndarray:
    """Return values, and slopes a node, of a card's curve at the table's angles: (CARD_NODES, 2).

    angles: degrees in [0, 360), rising; values: at them.
    """
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

    By the median of its fourth differences, which hold little of a pressure that valves and piston
    make; at least that of rounding, where all pressures are multiples of a step.
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


def sensed_noise(case: Case, end: str) -> float:
    """Return the acceleration (m/s2, rms) that a sensor has of the noise of an end's card.

    Noise is here what a window smooths off the card as the case has it, smoothed already or not. It
    moves the casing at the sensor, before its filter, of the machine with ideal joints; the frame
    as a whole, and the guide along x, have no force of the gas, and 0.
    """
    machine, gas, body, sensor = case.machine, case.gas, case.body, case.sensor
    if body is None or sensor is None or not body.casing or sensor.place == "body":
        return 0.0
    if (sensor.place, sensor.direction) == ("guide", "x"):
        return 0.0
    from compressor.vibration import casing_motion

    nodes = gas_nodes(case, end)
    rough = (nodes - smooth_nodes(nodes, NOISE_WINDOW))[:, 0]
    rod = (gas.rod_diameter_mm or 0.0) / 2 if end == "crank" else 0.0
    area = math.pi * (to_si(gas.piston_radius_mm, "mm") ** 2 - to_si(rod, "mm") ** 2)
    force = area * np.append(rough, rough[0])
    if sensor.direction == "y":  # by the slope of the rod
        sines = np.sin(np.linspace(0.0, 2.0 * math.pi, force.size))
        sines *= machine.crank_radius_mm / machine.rod_length_mm
        force *= sines / np.sqrt(1.0 - sines**2)
    moved = casing_motion(body, force, case.turn / rough.size, steady=True)
    return float(np.sqrt(np.mean(moved.acceleration[:-1] ** 2)))


def fit_polytrope(case: Case, end: str) -> tuple[float, float, float] | None:
    """Return what fits both lines of an end's card: misfit, clearance and exponent; None without.

    Misfit: rms of the pressure's logarithm; clearance: of the swept volume. Of the lines
    p (c + s)^n = const, one each way, with the swept share s of the machine without clearance in
    its joints.
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

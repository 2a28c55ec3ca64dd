"""What a cylinder's ideal cycle takes and delivers, by closed form, end by end.

Of perfect gas with the exponent n on both polytropics, at the pressures p1 and p2 inside while the
valves are open (those of suction and discharge, lowered and raised by the valves' losses), with
r = p2 / p1, and with a clearance of c times the swept volume V:

    filled part of V   e = 1 + c - c r^(1/n)
    indicated work     n / (n - 1) p1 e V (r^((n-1)/n) - 1)      p1 e V ln r where n = 1
    capacity           e V p1 / p_s, at the suction pressure p_s before the valve

The second and third are a revolution's. A valve throttles perfect gas without a change of
temperature, so that the capacity falls with the pressure behind it.
"""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from compressor.analysis.runs import case_of, record_of
from compressor.cases import Case, open_card, to_si
from compressor.physics import exact_motion, sample_segments, segments
from compressor.solve import gas_nodes

if TYPE_CHECKING:
    import xarray as xr


class IdealCycle(NamedTuple):
    """The ideal cycle of one end of a cylinder."""

    swept_volume: float  # m3
    clearance_volume: float  # m3
    indicated_work: float  # that the gas takes in a revolution, J
    capacity: float  # at suction conditions, m3 a revolution


def ideal_cycles(case: Case) -> dict[str, IdealCycle]:
    """Return the ideal cycle of each end, head or crank, in which the gas of a case has one.

    An end that does not press or is unloaded has none. case: of the gas load.
    """
    return {end: _ideal_cycle(case, end) for end in case.gas.compressing_ends}


def _face(case: Case, end: str) -> float:
    """Return the area (m2) of the piston's face in an end."""
    area = math.pi * to_si(case.gas.piston_radius_mm, "mm") ** 2
    rod = math.pi * to_si((case.gas.rod_diameter_mm or 0.0) / 2, "mm") ** 2
    return area - rod if end == "crank" else area


def _ideal_cycle(case: Case, end: str) -> IdealCycle:
    gas, stroke, area = case.gas, 2 * case.machine.crank_radius_mm, _face(case, end)
    swept = area * to_si(stroke, "mm")
    clearance = area * to_si(gas.clearance(end, stroke), "mm")
    inlet, outlet = (to_si(pressure, "MPa") for pressure in gas.open_pressures)
    ratio, n = outlet / inlet, gas.exponent
    filled = 1.0 + clearance / swept * (1.0 - ratio ** (1.0 / n))
    part = (n - 1.0) / n
    rise = math.expm1(part * math.log(ratio)) / part if part else math.log(ratio)
    return IdealCycle(
        swept, clearance, inlet * filled * swept * rise,
        filled * swept * inlet / to_si(gas.suction_MPa, "MPa"),
    )  # fmt: skip


def card_works(case: Case) -> dict[str, float]:
    """Return the work (J) that the gas takes in a revolution in each end that has a card.

    Of the machine without clearance, by the trapezoidal rule in the volume over the card's table.
    """
    machine, works = case.machine, {}
    radius, length = to_si(machine.crank_radius_mm, "mm"), to_si(machine.rod_length_mm, "mm")
    for end in case.gas.cards:
        pressure = gas_nodes(case, end)[:, 0]
        angles = np.linspace(0.0, 2.0 * math.pi, pressure.size + 1)
        x, *_ = exact_motion(angles, radius, length, 1.0)
        mean = (pressure + np.roll(pressure, -1)) / 2.0
        sign = 1.0 if end == "head" else -1.0
        works[end] = sign * _face(case, end) * float(mean @ np.diff(x))
    return works


class EndState(NamedTuple):
    """The gas in one end of a cylinder over the samples of a run."""

    volume: np.ndarray  # litres; of a measured card less the clearance, which nobody has given
    pressure: np.ndarray  # MPa, absolute

    @property
    def work(self) -> float:
        """Return the work (J) that the gas takes: the area of the card of its samples."""
        mean = (self.pressure[1:] + self.pressure[:-1]) / 2.0
        return -1e3 * float(mean @ np.diff(self.volume))


def end_states(run: "xr.Dataset") -> dict[str, EndState]:
    """Return the gas in each end, head or crank, that presses; run: of the gas load, or a part."""
    case, p = case_of(run), record_of(run)
    gas, machine = case.gas, case.machine
    angles, x = run["crank_angle"].values, 1e3 * run["displacement"].values
    edges, phases = segments(p, angles[-1] / p.omega)
    now = phases[sample_segments(angles / p.omega, edges)]
    beyond = _stroke_begins(case, angles, x)
    radius, states = machine.crank_radius_mm, {}
    for end in filter(gas.presses, ("head", "crank")):
        clearance = 0.0 if gas.is_measured else gas.clearance(end, 2 * radius)
        top, bottom = machine.rod_length_mm + radius, machine.rod_length_mm - radius
        space = clearance + (top - x if end == "head" else x - bottom)
        if gas.is_measured:
            pressure = _card_pressures(case, end, angles)
        else:
            phase = now % 4 if end == "head" else now // 4
            begun = clearance - beyond if end == "head" else clearance + beyond
            pressure = _cycle_pressures(case, end, phase, space, begun)
        states[end] = EndState(1e3 * _face(case, end) * space / 1e3, pressure)
    return states


def _card_pressures(case: Case, end: str, angles: np.ndarray) -> np.ndarray:
    """Return the pressures (MPa) of an end's card at crank angles (rad)."""
    nodes = gas_nodes(case, end)[:, 0] / to_si(1.0, "MPa")
    at = np.linspace(0.0, 2.0 * math.pi, nodes.size + 1)
    return np.interp(angles % (2.0 * math.pi), at, np.append(nodes, nodes[0]))


def _stroke_begins(case: Case, angles: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return how far (mm) the crosshead was beyond its ideal place at the last dead centre.

    angles: rad, x: mm, both of samples, (m,); straight between those beside a dead centre. What
    begins within a stroke has that of its first sample until the next one.
    """
    lengths = case.machine.crank_radius_mm, case.machine.rod_length_mm
    ideal, *_ = exact_motion(angles, *lengths, 1.0)
    centres = math.pi * np.floor(angles / math.pi + 1e-9)
    return np.interp(centres, angles, x - ideal)


def _cycle_pressures(
    case: Case, end: str, phase: np.ndarray, space: np.ndarray, clearance: np.ndarray
) -> np.ndarray:
    """Return the pressures (MPa) of an end's cycle by its phase and its space (mm).

    clearance: by which its gas was shut in (mm).
    """
    gas, stroke = case.gas, 2 * case.machine.crank_radius_mm
    if not gas.has_cycle(end):
        return np.full(space.size, gas.suction_MPa)
    inlet, outlet = gas.open_pressures
    expanded = outlet * (clearance / space) ** gas.exponent
    compressed = inlet * ((clearance + stroke) / space) ** gas.exponent
    if gas.switching == "exact":
        return np.clip(np.where(phase < 2, expanded, compressed), inlet, outlet)
    return np.choose(phase, [expanded, inlet, compressed, outlet])


DIGITS = 12  # of a pressure in MPa: what differs beyond them is rounding of binary numbers
OFF_STEP = 0.05  # of a step, by which a multiple of it may be off
POLYTROPIC = (0.2, 0.8)  # shares of the pressure's logarithmic range between which lines are fitted
MIN_FITTED = 5  # samples on each of the two lines
CLEARANCES = np.geomspace(0.005, 3.0, 400)  # of the swept volume, that are tried


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

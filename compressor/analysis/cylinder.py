"""What a cylinder's ideal cycle takes and delivers, by closed form, end by end.

Of perfect gas with the exponent n on both polytropics, at the pressures p1 and p2 inside while the
valves are open (those of suction and discharge, lowered and raised by the valves' losses), with
r = p2 / p1, and with a clearance of c times the swept volume V:

    volumetric efficiency   e = 1 + c - c r^(1/n)
    indicated work          n / (n - 1) p1 e V (r^((n-1)/n) - 1)      p1 e V ln r where n = 1
    capacity                e V p1 / p_s, at the suction pressure p_s before the valve

The second and third are a revolution's. A valve throttles perfect gas without a change of
temperature, so that the capacity falls with the pressure behind it.
"""

import math
from typing import NamedTuple

from compressor.cases import ENDS, Case, to_si


class IdealCycle(NamedTuple):
    """The ideal cycle of one end of a cylinder."""

    swept_volume: float  # m3
    clearance_volume: float  # m3
    volumetric_efficiency: float  # of the swept volume: what is filled at the pressure inside
    indicated_work: float  # that the gas takes in a revolution, J
    capacity: float  # at suction conditions, m3 a revolution


def ideal_cycles(case: Case) -> dict[str, IdealCycle]:
    """Return the ideal cycle of each end, head or crank, in which the gas of a case has one.

    An end that does not press or is unloaded has none. case: of the gas load.
    """
    return {end: _ideal_cycle(case, end) for end in ENDS if case.gas.has_cycle(end)}


def _ideal_cycle(case: Case, end: str) -> IdealCycle:
    gas, stroke = case.gas, 2 * case.machine.crank_radius_mm
    area = math.pi * to_si(gas.piston_radius_mm, "mm") ** 2
    if end == "crank":
        area -= math.pi * to_si((gas.rod_diameter_mm or 0.0) / 2, "mm") ** 2
    swept = area * to_si(stroke, "mm")
    clearance = area * to_si(gas.clearance(end, stroke), "mm")
    inlet, outlet = (to_si(pressure, "MPa") for pressure in gas.open_pressures)
    ratio, n = outlet / inlet, gas.exponent
    efficiency = 1.0 + clearance / swept * (1.0 - ratio ** (1.0 / n))
    part = (n - 1.0) / n
    rise = math.expm1(part * math.log(ratio)) / part if part else math.log(ratio)
    return IdealCycle(
        swept, clearance, efficiency, inlet * efficiency * swept * rise,
        efficiency * swept * inlet / to_si(gas.suction_MPa, "MPa"),
    )  # fmt: skip


def cylinder_words(case: Case) -> str:
    """Return indicated power, flow and volumetric efficiency of a case's cylinder in words."""
    cycles, rate = ideal_cycles(case), 1.0 / case.turn
    if not cycles:
        return "no gas is compressed"
    power = sum(cycle.indicated_work for cycle in cycles.values()) * rate
    flow = sum(cycle.capacity for cycle in cycles.values()) * rate
    each = ", ".join(
        f"{end} end {cycle.indicated_work * rate / 1e3:.4g} kW at a volumetric efficiency of "
        f"{cycle.volumetric_efficiency:.3g}"
        for end, cycle in cycles.items()
    )
    return (
        f"{power / 1e3:.4g} kW indicated ({each}); {3600 * flow:.4g} m³/h at suction conditions, "
        "by the ideal cycle"
    )

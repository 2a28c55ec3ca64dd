"""What a case file says of its machine, before any job runs: power, loads, ratios, pressures.

Numbers of the machine without clearance at its steady speed, from closed forms and its equations of
motion. An engineer knows them of a machine, and sees by them that a bore was read as a radius, or a
gauge pressure as an absolute one. Where a number lies beyond what machines have, a remark names the
key that would explain it; what a plausible machine could have, too, has none.
"""

import itertools
import math
import random
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from compressor.analysis.cylinder import card_works, ideal_cycles
from compressor.cases import (
    Case,
    Study,
    joint_stiffness,
    row_of,
    stands_for,
    value_of,
    with_ideal_joints,
)
from compressor.metrics import JOINTS
from compressor.physics import ideal_forces, segments
from compressor.solve import record

MAX_CASES = 50  # of a study that are looked at, beside the first and the last
PIECES = 200  # samples of each phase of the load: peaks between its corners to some 1e-5


class Usual(NamedTuple):
    """What machines have of a number, and what explains one beyond it: a key and a hint each.

    `keys`: at least one of them differs from the paper's machine where there is a remark.
    """

    low: float
    high: float
    keys: tuple[str, ...]
    below: tuple[str, str] = ("", "")
    above: tuple[str, str] = ("", "")


STROKE = "stroke_mm is the whole stroke, crank_radius_mm half of it"
MEAN_SPEED = ("machine.stroke_mm", f"{STROKE}, in mm; speed_rpm is in rpm")
BORE = "bore_mm is the whole bore, piston_radius_mm half of it"
IN_MPA = "pressures are in MPa: 1 bar is 0.1 MPa"
OF_CARD = "its pressures are in the unit that the column's title says, gauge or absolute"
ABSOLUTE = "pressures are absolute: gauge pressure plus the atmosphere's 0.101 MPa"
SMALL = "bearing length and pin are too small"
PIN = "pin_radius_mm is half of the pin's diameter"
# Wider than usual practice, so that no real machine is remarked on; what is narrower in books
# stands beside each. No limit of power and flow: every size is built.
USUAL = {
    # 0.15 to 0.3; above 0.35 `cautions` has a remark
    "rod, crank ratio": Usual(
        0.12, 1.0, ("machine.crank_radius_mm", "machine.rod_length_mm"),
        below=("machine.stroke_mm", f"{STROKE}; or rod_length_mm is too long"),
    ),
    # 0.3 to 0.4; a uniform bar has 0.5
    "rod, mass centre over length": Usual(
        0.15, 0.55, ("machine.rod_centre_mm",),
        below=("machine.rod_centre_mm", "it is measured from the big end, in mm"),
        above=("machine.rod_centre_mm", "it is measured from the big end, the heavier one"),
    ),
    # pins of large frames: 0.4 to 0.5
    "rod, both pins over length": Usual(
        0.0, 0.6, ("machine.pin_radius_mm",), above=("machine.pin_radius_mm", PIN)
    ),
    # 3 to 5 m/s of process compressors, from 1 to 6 of others (Bloch and Hoefner, 1996)
    "piston, mean speed": Usual(
        0.5, 7.0, ("machine.crank_radius_mm",), below=MEAN_SPEED, above=MEAN_SPEED
    ),
    # 1.1 to 5 a stage, by the temperature that API 618 allows; workshop compressors reach 10
    "cylinder, pressure ratio": Usual(
        1.05, 11.0, ("gas.suction_MPa", "gas.discharge_MPa"),
        below=("gas.discharge_MPa", "it is hardly more than suction_MPa"),
        above=("gas.suction_MPa", f"{ABSOLUTE}; {IN_MPA}"),
    ),
    # less is a vacuum pump
    "suction, absolute": Usual(
        0.07, math.inf, ("gas.suction_MPa",), below=("gas.suction_MPa", ABSOLUTE)
    ),
    # 5 to 20 %; below 2 % no valve and no piston's end gap has room
    **dict.fromkeys(
        ("cylinder, clearance at the head", "cylinder, clearance at the crank"),
        Usual(
            1.0, math.inf, ("gas.clearance_percent",),
            below=("gas.clearance_percent", "it is in per cent of the swept volume: 17, not 0.17"),
        ),
    ),
    # 0.3 to 3; plungers of the highest pressures have less
    "cylinder, bore over stroke": Usual(
        0.1, 3.0, ("gas.piston_radius_mm",), above=("gas.piston_radius_mm", BORE)
    ),
    # 0.3 to 3: a frame is sized by its gas load
    "piston, inertia over gas load": Usual(
        0.0, 6.0, ("gas.piston_radius_mm", "gas.suction_MPa", "gas.discharge_MPa"),
        above=("gas.bore_mm", f"{BORE}; or reciprocating_mass_kg and speed_rpm are too high"),
    ),
    # all that turns and half of what reciprocates: 40 to 80 %
    "counterweight, of rotating and reciprocating inertia": Usual(
        0.0, 100.0, ("machine.counterweight_kg_mm",),
        above=("machine.counterweight_kg_mm", "it is mass times its centre's distance from the "
               "axis, in kg mm"),
    ),
    # rods are sized for 30 to 70 MPa
    "piston rod, stress": Usual(
        0.0, 120.0, ("gas.suction_MPa", "gas.discharge_MPa", "gas.rod_diameter_mm"),
        above=("gas.discharge_MPa", "{pressures}; rod_diameter_mm is the whole diameter"),
    ),
    # 0.15 to 0.5
    "piston rod, diameter over bore": Usual(
        0.07, 0.8, ("gas.piston_radius_mm",),
        below=("gas.rod_diameter_mm", "it is the whole diameter, in mm"),
        above=("gas.bore_mm", BORE),
    ),
    # oils at the 50 to 80 degrees of bearings: docs/my-machine.md has the table
    "oil, viscosity": Usual(
        2.0, 80.0, ("lubricant.viscosity_mPa_s",),
        below=("lubricant.viscosity_mPa_s", "it is in mPa s at the bearings' temperature"),
        above=("lubricant.viscosity_mPa_s", "it is in mPa s at the bearings' temperature, and no "
               "ISO VG class: VG 150 has 48 mPa s at 60 °C"),
    ),
}  # fmt: skip
# of either pin
USUAL |= {
    f"{joint.replace('_', ' ')}, {name}": usual
    for joint in JOINTS
    for name, usual in {
        # new bushes: 0.5 to 1.5; a bush is scrapped at two to three times that
        "clearance over pin": Usual(
            0.0, 5.0, ("machine.pin_radius_mm",),
            above=("clearance_mm", "it is radial, half of the diametral clearance: far worn, or "
                   "the diametral one is given"),
        ),
        # 3 to 15, of a crosshead pin up to 25
        "pressure": Usual(
            0.0, 30.0, ("machine.pin_radius_mm", "lubricant.bearing_length_mm"),
            above=("gas.discharge_MPa", f"{{pressures}}; or {SMALL}"),
        ),
        "length over pin": Usual(
            0.3, math.inf, ("machine.pin_radius_mm",), below=("machine.pin_radius_mm", PIN)
        ),
    }.items()
}  # fmt: skip
BEARING = {f"{joint.replace('_', ' ')}, pressure" for joint in JOINTS}


@dataclass(frozen=True)
class MachineNumber:
    """A number of a machine over the cases looked at: equal `low` and `high` where none differs.

    `name`: thing and quantity, such as "rod load, tension". `usual_low`, `usual_high`: what
    machines have; nan where every value is usual. `remark`: why a number that lies beyond it in all
    cases may be a mistake, with the `key` that would explain it; "" without.
    """

    name: str
    low: float
    high: float
    unit: str
    usual_low: float = math.nan
    usual_high: float = math.nan
    key: str = ""
    remark: str = ""

    def value(self) -> str:
        """Return the number with its unit as text: `62.2 kN`, or `40 to 62.2 kN`."""
        ends = (self.low, self.high)
        both = dict.fromkeys(f"{x:.0f}" if 1e3 <= abs(x) < 1e6 else f"{x:.4g}" for x in ends)
        return f"{' to '.join(both)} {self.unit}".rstrip()


@dataclass(frozen=True)
class MachineDescription:
    """The `numbers` of a machine, of `looked_at` of its `jobs`, and what is to be said of them."""

    numbers: tuple[MachineNumber, ...]
    looked_at: int
    jobs: int

    def lines(self) -> list[tuple[str, str]]:
        """Return a line for each thing: its name, and its numbers in words."""
        found: dict[str, list[str]] = {}
        for number in self.numbers:
            thing, _, quantity = number.name.partition(", ")
            found.setdefault(thing, []).append(f"{quantity} {number.value()}")
        return [(thing, ", ".join(words)) for thing, words in found.items()]

    def remarks(self, warned: Collection[str] = ()) -> dict[str, str]:
        """Return the remarks by the key that would explain them, of each the first.

        warned: keys that there is a caution about already; what that explains has no remark.
        """
        found: dict[str, str] = {}
        for number in self.numbers:
            explained = {key for one in (*warned, *found) for key in EXPLAINED.get(one, ())}
            if number.remark and number.key not in explained:
                found.setdefault(number.key, number.remark)
        return found

    @property
    def part(self) -> str:
        """Return of how many jobs it speaks, in words; "" of all."""
        is_part = self.looked_at < self.jobs
        return f" (by {self.looked_at} of {self.jobs} jobs)" if is_part else ""


LOADS = ("gas.discharge_MPa", "gas.indicator.head", "gas.indicator.crank")
# key that a caution or a remark is about -> keys of others that it explains, too
EXPLAINED = {
    "machine.speed_rpm": ("machine.stroke_mm", "gas.bore_mm"),
    "machine.pin_radius_mm": ("clearance_mm",),
    "machine.rod_length_mm": ("machine.rod_centre_mm", "gas.piston_radius_mm"),
    "machine.rod_mass_kg": LOADS, "machine.rod_inertia_kg_m2": LOADS,
    "machine.reciprocating_mass_kg": ("gas.bore_mm", *LOADS),
    "gas.suction_MPa": ("gas.bore_mm",),
    "gas.piston_radius_mm": LOADS,
    "gas.rod_diameter_mm": LOADS,
    "machine.crank_radius_mm": ("machine.stroke_mm", "gas.bore_mm", *LOADS),
    "machine.stroke_mm": ("gas.piston_radius_mm", "gas.bore_mm", *LOADS),
}  # fmt: skip


def draw_jobs(numbers: Sequence[int], most: int = MAX_CASES) -> list[int]:
    """Return numbers of jobs, all or of more than `most` both ends of the axes and a fixed draw."""
    count = len(numbers)
    drawn = random.Random(0).sample(range(count), most) if count > most else range(count)
    return [numbers[place] for place in sorted({0, *drawn, count - 1} if count else ())]


def sample_cases(study: Study, most: int) -> list[Case]:
    """Return the selected cases of a study, or some of them, as `draw_jobs`."""
    return [study.cases[number] for number in draw_jobs(study.selected, most)]


def describe_machine(study: Study) -> MachineDescription:
    """Return what the selected jobs of a study say of their machine, of many of them a fair draw.

    Takes some milliseconds a machine; a sweep of clearances has one.
    """
    cases = sample_cases(study, MAX_CASES)
    return MachineDescription(machine_numbers(cases), len(cases), len(study.selected))


def machine_numbers(cases: Sequence[Case]) -> tuple[MachineNumber, ...]:
    """Return the numbers of the machine of cases, in the order in which they are read."""
    found: dict[str, list[float]] = {}
    units: dict[str, str] = {}
    known: dict[str, dict[str, tuple[float, str]]] = {}
    for case in cases:
        sound = with_ideal_joints(case, features=False)
        if sound.physics_key not in known:  # a sweep of clearances has one machine
            known[sound.physics_key] = dict(_numbers_of_sound(sound))
        of_pins = _numbers_of_pins(case, known[sound.physics_key])
        for name, (value, unit) in itertools.chain(known[sound.physics_key].items(), of_pins):
            found.setdefault(name, []).append(value)
            units[name] = unit
    order = sorted(found, key=_is_of_pin)
    return tuple(_over_cases(name, found[name], units[name], cases) for name in order)


def _is_of_pin(name: str) -> bool:
    return name.startswith(tuple(joint.replace("_", " ") for joint in JOINTS))


class RevolutionLoads(NamedTuple):
    """Loads of the sound machine over a revolution, (m,) each; N along x, positive in tension.

    `angle`: rad. `gas`: of the load on the piston; `inertia`: of what reciprocates; `rod`: their
    sum, on the crosshead pin. `sizes`: forces at big and small end, (m, 2).
    """

    angle: np.ndarray
    gas: np.ndarray
    inertia: np.ndarray
    rod: np.ndarray
    sizes: np.ndarray


def revolution_loads(sound: Case) -> RevolutionLoads:
    """Return a sound machine's loads by its run's equations, at both sides of each corner."""
    p = record(sound)
    edges, phases = segments(p, sound.turn)
    times = np.concatenate([np.linspace(*ends, PIECES + 1) for ends in itertools.pairwise(edges)])
    load, *forces = ideal_forces(times, np.repeat(phases, PIECES + 1), p).T
    sizes = np.stack([np.hypot(*forces[:2]), np.hypot(*forces[2:])], axis=1)
    return RevolutionLoads(times * sound.omega, -load, forces[2] + load, forces[2], sizes)


def tension_fraction(angle: np.ndarray, load: np.ndarray) -> float:
    """Return the fraction of a revolution in which a load is above 0, straight between samples."""
    before, after, width = load[:-1], load[1:], np.diff(angle)
    above = np.maximum(before, 0.0) + np.maximum(after, 0.0)
    size = np.abs(before) + np.abs(after)
    return float((width * np.divide(above, size, out=np.zeros_like(size), where=size > 0)).sum()
                 / math.tau)  # fmt: skip


Named = Iterator[tuple[str, tuple[float, str]]]  # of names, each with a value and its unit


def _numbers_of_sound(sound: Case) -> Named:
    """Yield what no clearance changes."""
    machine, loads = sound.machine, revolution_loads(sound)
    ratio = machine.crank_radius_mm / machine.rod_length_mm
    if sound.load == "gas":
        yield from _numbers_of_gas(sound)
    yield "piston, mean speed", (4e-3 * machine.crank_radius_mm / sound.turn, "m/s")
    yield "rod, crank ratio", (ratio, "")
    if sound.load == "gas":  # behind what tells of a stroke that explains it
        yield "cylinder, bore", (2.0 * sound.gas.piston_radius_mm, "mm")
        bore_ratio = sound.gas.piston_radius_mm / machine.crank_radius_mm
        yield "cylinder, bore over stroke", (bore_ratio, "")
    centre = (machine.rod_centre_mm or 0.0) / machine.rod_length_mm
    yield "rod, mass centre over length", (centre, "")
    has_pins = is_own(sound, ["machine.pin_radius_mm"])  # else the paper's, of joints with play
    if has_pins:
        pins = sum(machine.pin_radius_mm.at(joint) for joint in JOINTS)
        yield "rod, both pins over length", (pins / machine.rod_length_mm, "")
    if sound.load != "none":
        yield from _both_sides(f"{sound.load} load", loads.gas)
    inertia = machine.reciprocating_mass_kg * machine.crank_radius_mm * sound.omega**2 * 1e-6
    yield "piston, inertia", (inertia * (1.0 + ratio), "kN")
    if sound.counterweight:
        whole = (machine.rod_mass_kg + machine.reciprocating_mass_kg) * machine.crank_radius_mm
        share = 100.0 * sound.counterweight / whole
        yield "counterweight, of rotating and reciprocating inertia", (share, "%")
    gas_peak = 1e-3 * float(np.abs(loads.gas).max())
    if sound.load == "gas" and (sound.gas.is_measured or sound.gas.compressing_ends):
        yield "piston, inertia over gas load", (inertia * (1.0 + ratio) / gas_peak, "")
    yield from _both_sides("rod load", loads.rod)
    share = tension_fraction(loads.angle, loads.rod)
    yield "rod load, reversal", (360.0 * min(share, 1.0 - share), "degrees")
    rod = sound.gas.rod_diameter_mm
    if sound.load == "gas" and rod is not None:
        peak = float(np.abs(loads.rod).max())
        yield "piston rod, diameter over bore", (rod / (2.0 * sound.gas.piston_radius_mm), "")
        yield "piston rod, stress", (peak / (math.pi / 4.0 * rod**2), "MPa")
    for joint, peak in zip(JOINTS, loads.sizes.max(axis=0), strict=True):
        name = joint.replace("_", " ")
        if has_pins:
            yield f"{name}, pin diameter", (2.0 * machine.pin_radius_mm.at(joint), "mm")
        yield f"{name}, peak load", (1e-3 * float(peak), "kN")


def _numbers_of_gas(sound: Case) -> Named:
    """Yield power, flow, volumetric efficiencies, pressures and clearance volumes."""
    gas, rate = sound.gas, 1.0 / sound.turn
    if gas.is_measured:
        yield "cylinder, indicated power", (1e-3 * rate * sum(card_works(sound).values()), "kW")
        return
    cycles = ideal_cycles(sound)
    if cycles:
        work = sum(cycle.indicated_work for cycle in cycles.values())
        flow = sum(cycle.capacity for cycle in cycles.values())
        yield "cylinder, indicated power", (1e-3 * rate * work, "kW")
        yield "cylinder, flow at suction", (3600.0 * rate * flow, "m³/h")
    for end, cycle in cycles.items():
        filled = cycle.capacity / cycle.swept_volume  # of gas at suction conditions
        yield f"cylinder, volumetric efficiency at the {end}", (filled, "")
    yield "cylinder, pressure ratio", (gas.discharge_MPa / gas.suction_MPa, "")
    for end, cycle in cycles.items():
        percent = 100.0 * cycle.clearance_volume / cycle.swept_volume
        yield f"cylinder, clearance at the {end}", (percent, "%")
    yield "suction, absolute", (gas.suction_MPa, "MPa")
    yield "suction, a gauge reads", (10.0 * (gas.suction_MPa - gas.ambient), "bar")
    yield "discharge, absolute", (gas.discharge_MPa, "MPa")
    yield "discharge, a gauge reads", (10.0 * (gas.discharge_MPa - gas.ambient), "bar")


def _both_sides(name: str, load: np.ndarray) -> Named:
    """Yield the greatest tension and compression of a load (N); 0 rather than -0."""
    yield f"{name}, tension", (1e-3 * max(0.0, float(load.max())), "kN")
    yield f"{name}, compression", (1e-3 * max(0.0, float(-load.min())), "kN")


def _numbers_of_pins(case: Case, sound: dict[str, tuple[float, str]]) -> Named:
    """Yield the numbers of the joints with clearance; sound: those of the machine without."""
    if case.lubricant and case.joint != "none":
        yield "oil, viscosity", (case.lubricant.viscosity_mPa_s, "mPa s")
    for joint in JOINTS:
        clearance, name = getattr(case.clearance_mm, joint), joint.replace("_", " ")
        if not clearance:
            continue
        pin = 2.0 * case.machine.pin_radius_mm.at(joint)
        if f"{name}, pin diameter" not in sound:
            yield f"{name}, pin diameter", (pin, "mm")
        yield f"{name}, diametral clearance", (2.0 * clearance, "mm")
        yield f"{name}, clearance over pin", (2e3 * clearance / pin, "‰")
        length = case.contact.length_mm.at(joint) if case.contact.length_mm else 0.0
        if case.lubricant:
            length = case.lubricant.bearing_length_mm.at(joint)
        if length:
            peak = 1e3 * sound[f"{name}, peak load"][0]
            yield f"{name}, length over pin", (length / pin, "")
            yield f"{name}, pressure", (peak / (pin * length), "MPa")
        if case.contact.law not in ("johnson", "liu"):
            exponent = case.contact.exponent
            stiffness = joint_stiffness(case.contact, joint, pin / 2.0, clearance)
            stiffness /= 1000.0**exponent
            yield f"{name}, K", (float(f"{stiffness:.3g}"), f"N/mm^{exponent:g}")


def _over_cases(
    name: str, values: Sequence[float], unit: str, cases: Sequence[Case]
) -> MachineNumber:
    """Return a number over cases, with a remark where all of them are beyond what is usual."""
    plain = MachineNumber(name, min(values), max(values), unit)
    usual = USUAL.get(name)
    if usual is None:
        return plain
    plain = replace(plain, usual_low=usual.low, usual_high=usual.high)
    key, hint = usual.below if plain.high < usual.low else usual.above
    is_usual = plain.high >= usual.low and plain.low <= usual.high
    if is_usual or not hint or not any(is_own(case, usual.keys) for case in cases):
        return plain
    gas = cases[0].gas if cases[0].load == "gas" else None
    pressures = IN_MPA
    if name in BEARING and not (gas and (gas.is_measured or is_own(cases[0], GAS_KEYS))):
        key = "lubricant.bearing_length_mm" if cases[0].lubricant else "contact.length_mm"
        hint = SMALL
    if gas and gas.is_measured and key == "gas.discharge_MPa":
        key, pressures = f"gas.indicator.{next(iter(gas.cards))}", OF_CARD
    if name == "rod, crank ratio" and plain.high < LONG_ROD:
        key, hint = "machine.rod_length_mm", f"it is in mm; or the stroke is too short: {STROKE}"
    range_ = f"at least {usual.low:g}" if plain.high < usual.low else f"at most {usual.high:g}"
    thing, _, quantity = name.partition(", ")
    hint = hint.format(pressures=pressures)
    remark = f"{thing}: {quantity} {plain.value()}, where {range_} is usual; {hint}"
    return replace(plain, key=key, remark=remark)


LONG_ROD = 0.05  # crank radius over length: below it the rod is more likely wrong than the stroke
GAS_KEYS = ("gas.suction_MPa", "gas.discharge_MPa")


def is_own(case: Case, keys: Sequence[str]) -> bool:
    """Return whether any of some keys differs from the paper's machine."""
    parts = [part for key in keys for part in stands_for(key) or (key,)]
    rows = [row for part in parts if (row := row_of(part))]
    return any(value_of(case, row.key) not in (None, row.default) for row in rows)

"""Numbers that look as if they were given in another unit than their key's.

The rule: a key is told of where every value that it has in a study lies outside its usual range,
and another unit of the same quantity would bring all of them inside. A sweep that reaches into the
usual range is meant as it stands, however odd its ends are.
"""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from compressor.cases import Case, reads, row_of
from compressor.metrics import JOINTS

METRES, MICROMETRES = {"m": 1e3}, {"µm": 1e-3}
GRAMS, MILLI = {"g": 1e-3}, 1e-3


class Usual(NamedTuple):
    """What is usual for a key, in its unit, and the units it may be mistaken for, as factors."""

    low: float
    high: float
    units: dict[str, float]

    def holds(self, value: float) -> bool:
        """Return whether a value is usual; limits may come from a conversion, and count."""
        return self.low * (1 - 1e-9) <= value <= self.high * (1 + 1e-9)


# Ours: reciprocating compressors from model engines to large process machines, with a margin. A
# contact is from plastic bushings to steel in a conforming bore (Hertz, K = 4/3 sqrt(R) E').
USUAL = {
    "clearance_mm": Usual(1e-3, 2.0, METRES | MICROMETRES),
    "machine.crank_radius_mm": Usual(5.0, 1e3, METRES),
    "machine.rod_length_mm": Usual(20.0, 1e4, METRES),
    "machine.speed_rpm": Usual(120.0, 6e3, {"rad/s": 30 / math.pi, "Hz": 60.0}),
    "machine.rod_mass_kg": Usual(0.02, 500.0, GRAMS),
    "machine.reciprocating_mass_kg": Usual(0.05, 5e3, GRAMS),
    "machine.pin_radius_mm": Usual(1.0, 500.0, METRES),
    "gas.piston_radius_mm": Usual(5.0, 1e3, METRES),
    "gas.head_clearance_mm": Usual(0.1, 200.0, METRES),
    "gas.suction_MPa": Usual(1e-3, 50.0, {"bar": 0.1, "kPa": 1e-3, "Pa": 1e-6}),
    "gas.discharge_MPa": Usual(0.05, 200.0, {"bar": 0.1, "kPa": 1e-3, "Pa": 1e-6}),
    "spring.stiffness_N_per_mm": Usual(0.1, 5e3, {"N/m": MILLI, "kN/mm": 1e3}),
    "spring.damping_N_s_per_mm": Usual(1e-4, 10.0, {"N s/m": MILLI}),
    "spring.preload_N": Usual(5.0, 1e6, {"kN": 1e3}),
    "spring.stroke_mm": Usual(2.0, 2e3, METRES),
    "contact.stiffness_N_per_mm15": Usual(
        1e4, 1e7, {"kN/mm^1.5": 1e3, "mN/mm^1.5": MILLI, "N/m^1.5": 1000.0**-1.5}
    ),
    "contact.damping_N_s_per_mm": Usual(0.1, 1e5, {"N s/m": MILLI}),
    "contact.full_damping_mm": Usual(1e-3, 5.0, METRES),
    "friction.stiction_velocity_mm_per_s": Usual(0.1, 1e4, {"m/s": 1e3}),
    "friction.friction_velocity_mm_per_s": Usual(1.0, 1e5, {"m/s": 1e3}),
}


class Slip(NamedTuple):
    """A key whose values look like another unit's, and what is said of it."""

    key: str
    message: str
    jobs: int  # that read the key


def slips(cases: Sequence[Case]) -> list[Slip]:
    """Return the keys of a study's cases of which all values look like another unit's."""
    found = []
    for key, usual in USUAL.items():
        read = [values for case in cases if (values := values_of(case, key))]
        values = sorted({value for several in read for value in several})
        unit = other_unit(key, usual, values)
        if unit:
            found.append(Slip(key, said(key, usual, values, unit), len(read)))
    return found


def values_of(case: Case, key: str) -> list[float]:
    """Return the values of a key that a case's simulation reads; of clearances, those of worn
    joints.
    """
    group, _, name = key.partition(".")
    if not reads(case, key):
        return []
    if not name:  # what both joints share
        worn = (getattr(getattr(case, group), joint) for joint in JOINTS)
        return [value for value in worn if value]
    if name == "stiffness_N_per_mm15" and case.contact.exponent != 1.5:
        return []  # its unit depends on the exponent
    owner = getattr(case, group)
    value = getattr(owner, name) if owner is not None else None
    return [] if value is None else [float(value)]


def other_unit(key: str, usual: Usual, values: Iterable[float]) -> str:
    """Return the unit in which unusual values would all be usual, "" where there is none.

    Of several, the one that brings them nearest to the key's default.
    """
    values = [*values]
    if not values or any(usual.holds(value) or value <= 0 for value in values):
        return ""
    fitting = [
        name for name, factor in usual.units.items() if all(usual.holds(v * factor) for v in values)
    ]
    row = row_of(key)
    default = float(row.default) if row and row.default else math.sqrt(usual.low * usual.high)
    middle = sum(map(math.log, values)) / len(values)
    return min(
        fitting,
        key=lambda name: abs(middle + math.log(usual.units[name] / default)),
        default="",
    )


def said(key: str, usual: Usual, values: Sequence[float], other: str) -> str:
    """Return what is said of values that look like another unit's."""
    row, factor = row_of(key), usual.units[other]
    unit = (row.unit if row else "").replace("^p", "^1.5")
    low, high = values[0], values[-1]
    if low == high:
        given, verb, them = f"{low:g} {unit}", "is", f"it is {low * factor:.4g} {unit}"
    else:
        given, verb = f"{low:g} to {high:g} {unit}", "are"
        them = f"they are {low * factor:.4g} to {high * factor:.4g} {unit}"
    range_ = f"{usual.low:g} to {usual.high:g}"
    return f"{given} {verb} unusual ({range_} is usual); read as {other}, {them}"

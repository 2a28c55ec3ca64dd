"""Words of the trade: keys that are twice one of ours, and other units that are answered.

A synonym is written out as its key when values are read, so that nothing else knows it; so is a
value that a key has for each joint, such as `pin_radius_mm: {big_end: 60, small_end: 35}`.
"""

import math
import re
from collections.abc import Mapping
from typing import Any

from compressor.cases.parameter import Problem
from compressor.cases.table import table

# key -> the key whose double it is; a file gives one of the two
DOUBLES = {
    "machine.stroke_mm": "machine.crank_radius_mm",
    "gas.bore_mm": "gas.piston_radius_mm",
}
# key that may have a value for each joint -> the keys that these are of
PER_JOINT = {
    "machine.pin_radius_mm": {
        "big_end": "machine.pin_radius_mm", "small_end": "machine.small_end_pin_radius_mm",
    },
}  # fmt: skip
# unit at the end of an unknown key -> the unit of ours, and what one of it is there
OTHER_UNITS = {
    "bar": ("MPa", 0.1), "kPa": ("MPa", 1e-3), "Pa": ("MPa", 1e-6), "um": ("mm", 1e-3),
    "cm": ("mm", 10.0), "m": ("mm", 1e3), "kN": ("N", 1e3),
}  # fmt: skip
PERCENT = re.compile(r"(\w*_)?clearance(_\w*)?_(percent|pct)")
TWICE = "stands in place of {}: give one of the two"


def halved(value: Any) -> Any:
    """Return half of a number, and any other value as it is."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return value / 2 if is_number else value


def by_joint(key: str, value: Any) -> Mapping[str, str]:
    """Return the keys that a value for each joint is of, by joint; none of any other value."""
    keys = PER_JOINT.get(key, {})
    return keys if isinstance(value, Mapping) and {*value} & {*keys} else {}


def lacking_joint(key: str, value: Mapping[str, Any]) -> str:
    """Return what is wrong with the joints of a value for each; "" if nothing is."""
    joints = [*PER_JOINT[key]]
    if {*value} == {*joints}:
        return ""
    given = ", ".join(map(str, value))
    return f"needs both, {' and '.join(joints)}, not {given}; or one number for both joints"


def written_out(values: Mapping[str, Any], problems: list[Problem]) -> dict[str, Any]:
    """Return nested values with each synonym as its key; both at once are a problem."""
    found = dict(values)
    for synonym, key in DOUBLES.items():
        group, _, name = synonym.partition(".")
        within, own = found.get(group), key.rpartition(".")[2]
        if not isinstance(within, Mapping) or name not in within:
            continue
        if own in within:
            problems.append(Problem(synonym, TWICE.format(key)))
        rest = {inner: value for inner, value in within.items() if inner != name}
        found[group] = {own: halved(within[name])} | rest
    for key in PER_JOINT:
        group, _, name = key.partition(".")
        within = found.get(group)
        value: Any = within.get(name) if isinstance(within, Mapping) else None
        keys = by_joint(key, value)
        if not keys or not isinstance(within, Mapping):
            continue
        if message := lacking_joint(key, value):
            problems.append(Problem(key, message))
        rest = {inner: one for inner, one in within.items() if inner != name}
        each = {keys[joint].rpartition(".")[2]: value[joint] for joint in keys if joint in value}
        found[group] = each | rest
    return found


def synonyms_of(group: str) -> list[str]:
    """Return the synonyms that a group may hold, without its name."""
    return [key.rpartition(".")[2] for key in DOUBLES if key.partition(".")[0] == group]


def in_our_unit(name: str, value: Any, allowed: list[str]) -> str:
    """Return the hint at a key in another unit, such as "; write suction_MPa: 0.2"; or ""."""
    stem, _, unit = name.rpartition("_")
    ours, factor = OTHER_UNITS.get(unit, ("", 1.0))
    key = f"{stem}_{ours}"
    if not stem or key not in allowed:
        return ""
    values = value if isinstance(value, list | tuple) else [value]
    if not all(isinstance(one, int | float) and not isinstance(one, bool) for one in values):
        return f"; write {key}: 1 {unit} is {factor:g} {ours}"
    told = ", ".join(f"{one * factor:.12g}" for one in values)
    return f"; write {key}: " + (f"[{told}]" if isinstance(value, list | tuple) else told)


def of_percent(name: str, group: str, value: Any, stroke: float) -> str:
    """Return the hint at the key that stands for a clearance in per cent; "" for another name.

    stroke: of the piston (mm), of which a cylinder's clearance is a share; nan where it is swept.
    """
    if not PERCENT.fullmatch(name) or group not in ("", "gas", "machine"):
        return ""
    told = f", {name.rpartition('_')[2]} of the stroke, in mm"
    if isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(stroke):
        told = f": {value / 100 * stroke:.4g}, of a stroke of {stroke:g} mm"
    if group == "gas":
        return f"; write head_clearance_mm{told}"
    return f"; of the cylinder, write gas.head_clearance_mm{told}; of joints, clearance_mm in mm"


def stroke_in(values: Any) -> float:
    """Return the stroke of a case's nested values (mm), nan where it is no number.

    It is the default's where they give none.
    """
    machine = values.get("machine") if isinstance(values, Mapping) else None
    given = machine if isinstance(machine, Mapping) else {}
    radius = given.get("crank_radius_mm", table()["machine.crank_radius_mm"].default)
    found = given.get("stroke_mm", 2 * radius if isinstance(radius, int | float) else None)
    is_number = isinstance(found, int | float) and not isinstance(found, bool)
    return float(found) if is_number and found is not None else math.nan

"""The inputs of a study: what they mean for the machine; what was given, swept and assumed."""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from compressor.analysis import MachineDescription, draw_jobs, machine_numbers
from compressor.cases import DOUBLES, Case, keys_of, reads, row_of, stands_for, value_of
from compressor.digits import setting
from compressor.report.figures.sweep_data import name_in_words
from compressor.store import Stored, StoredStudy

MAX_VALUES = 10  # of a swept key that are listed
NOT_ASSUMED = ("name", "output", "solve", "initial_offset_mm", "healthy_clearance_mm")

HALVES = {half: whole for whole, half in DOUBLES.items()}  # stroke and bore are told as such

Lines = Sequence[tuple[str, str]]


def find_inputs(stored: Stored, study: StoredStudy) -> list[tuple[str, Lines]]:
    """Return the inputs of a study under titles, a line a thing or a group of keys.

    Nothing where this version knows no case of it.
    """
    places = [place for place in stored.find([*study.keys]).tolist() if place >= 0]
    cases = [case for place in draw_jobs(places) if (case := stored.case_at(place))]
    if not cases:
        return []
    machine = MachineDescription(machine_numbers(cases), len(cases), study.jobs)
    swept = {part for axis in study.axes for part in (axis.key, *stands_for(axis.key))}
    fixed = {
        key: value
        for key in keys_of(partial(value_of, study.fixed))
        if key not in swept and (value := value_of(study.fixed, key)) is not None
    }
    named = {part for key in study.given for part in (key, *stands_for(key))}
    named |= {key.rpartition(".")[0] for key in named}
    given = {key: value for key, value in fixed.items() if key in named}
    assumed = {
        key: spell_over_jobs(key, value, cases)
        for key, value in fixed.items()
        if key not in given
        and key.partition(".")[0] not in NOT_ASSUMED
        and any(reads(case, key) for case in cases)
    }
    axes = {axis.key: [*dict.fromkeys(axis.values)] for axis in study.axes}
    return [
        ("The machine without clearance, by what was given" + machine.part, machine.lines()),
        ("Implausible", [*machine.remarks().items()]),
        ("Given", by_group(given)),
        ("Swept", by_group(axes)),
        ("Not given: values of the program", by_group(assumed)),
    ]


def by_group(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return a line for each group of keys: its name, and its keys with values and units."""
    found: dict[str, list[str]] = {}
    for key, value in values.items():
        group, _, name = key.partition(".") if "." in key else ("", "", key)
        name, _, part = name.partition(".")  # such as pin_radius_mm.small_end
        unit = unit_of(key)
        if key in HALVES and isinstance(value, int | float):
            name, value = HALVES[key].rpartition(".")[2], 2.0 * value
        words = name_in_words(re.sub("_(N_per_mm15|percent)$", "", name), unit)
        words = f"{words} {part.replace('_', ' ')}".rstrip()
        text = f"{words} {spell_values(value, unit)}"
        found.setdefault(name_in_words(group, "mm") or "scene", []).append(text)
    return [(group, "; ".join(words)) for group, words in found.items()]


def spell_over_jobs(key: str, value: Any, cases: Sequence[Case]) -> Any:
    """Return a value; where it follows from a swept one, the least and the greatest as text."""
    if not isinstance(value, int | float):
        return value
    others = (value_of(case, key) for case in cases if reads(case, key))
    ends = [value, *(one for one in others if one is not None)]  # of a group that some have
    low, high = min(ends), max(ends)
    return value if low == high else f"{spelt(low, '')} to {spelt(high, unit_of(key))}"


def unit_of(key: str) -> str:
    """Return a key's unit; "" without one."""
    row = row_of(key)
    return (row.unit or "") if row else ""


def spell_values(value: Any, unit: str) -> str:
    """Return a value, or those of a swept key, with the unit."""
    if not isinstance(value, list) or len(value) == 1:
        return spelt(value[0] if isinstance(value, list) else value, unit)
    values = [one for one in value if one is not None]
    if len(values) <= MAX_VALUES or not all(isinstance(one, int | float) for one in values):
        shown = ", ".join(spelt(one, "") for one in values[:MAX_VALUES])
        more = f" and {len(values) - MAX_VALUES} more" if len(values) > MAX_VALUES else ""
        return f"{shown}{more} {unit}".rstrip()
    return f"{len(values)} values from {spelt(min(values), '')} to {spelt(max(values), unit)}"


def spelt(value: Any, unit: str) -> str:
    """Return a value as a case file has it, with its unit."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {spelt(item, '')}" for name, item in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value))
    if isinstance(value, int | float):
        return setting(value) + (f" {unit}" if unit else "")
    return str(value).replace("_", " ")

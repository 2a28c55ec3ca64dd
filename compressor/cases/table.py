"""The table of parameters: what a case has, and the rows of all its keys."""

import dataclasses
from functools import cache
from typing import Any

from compressor.cases.groups import Contact, Friction, Gas, Machine, Offset, Output, Solve, Spring
from compressor.cases.laws import CLEARANCE, by_law
from compressor.cases.optional_groups import Body, Drive, Guide, Lubricant, Rod, Sensor, Wear
from compressor.cases.parameter import (
    PART_WORDS,
    Parameter,
    PerJoint,
    by_part,
    choice,
    number,
    rows_of,
)
from compressor.metrics import JOINTS

# what a case has beside its groups
TOP: dict[str, Any] = {
    "name": choice(
        "case", (), "name of the study; default: the file's", kind="text", identity=False
    ),
    "load": choice(
        "spring", ("spring", "gas", "none"), "load on the piston", "§2.2-2.4",
        aliases=(("design", "spring"), ("typical", "gas")),
    ),
    "joint": choice(
        "none", ("none", "big_end", "small_end", "both"), "joints with clearance", "§3.2"
    ),
    "clearance_mm": by_part(
        PerJoint,
        number(0.0, "[0, 1000]", "radial clearance", "§3.2", judged=(1e-3, 1.0)),
        {joint: ("joint != none", f"joint == {joint} or joint == both") for joint in JOINTS},
        fill=0.0,
    ),
    "healthy_clearance_mm": by_part(
        PerJoint,
        number(
            0.0, "[0, 1000]",
            "clearance up to which a joint counts as sound; it moves nothing, and 0 calls any worn",
            identity=False,
        ),
        fill=0.0,
    ),
}  # fmt: skip
GROUPS: dict[str, Any] = {
    "initial_offset_mm": Offset, "machine": Machine, "gas": Gas, "spring": Spring,
    "contact": Contact, "friction": Friction, "lubricant": Lubricant, "guide": Guide,
    "drive": Drive, "rod": Rod, "wear": Wear, "body": Body, "sensor": Sensor, "solve": Solve,
    "output": Output,
}  # fmt: skip
# groups that a word may stand for: `false` leaves one out, `true` is one with its defaults
WORDS = {"friction": False} | dict.fromkeys(
    ("lubricant", "guide", "drive", "rod", "wear", "body", "sensor"), True
)
# conditions under which a case reads any of a group
READ: dict[str, tuple[str, ...]] = {
    "gas": ("load == gas",), "spring": ("load == spring",),
    "contact": (f"{CLEARANCE} or guide.clearance_mm > 0",),
    "friction": (f"{CLEARANCE} or friction.ideal_joints == true",),
    "lubricant": (CLEARANCE,), "wear": (CLEARANCE,), "sensor": ("body",),
    "guide": ("guide.friction > 0 or guide.clearance_mm > 0",),
}  # fmt: skip


@cache
def table() -> dict[str, Parameter]:
    """Return the table of parameters by dotted key, such as `machine.rod_mass_kg`.

    It is in the order of the case file; a key by part has several rows.
    """
    rows = [row for name, item in TOP.items() for row in rows_of(name, item)]
    for group, of in GROUPS.items():
        for item in dataclasses.fields(of):
            of_law = by_law(group, item.name)
            rows += rows_of(f"{group}.{item.name}", item, (*READ.get(group, ()), *of_law))
    return {row.key: row for row in rows}


@cache
def parts_by_key() -> dict[str, tuple[str, ...]]:
    """Return the parts of each key that may have a value for each, such as big_end, small_end."""
    found: dict[str, tuple[str, ...]] = {}
    for whole, _, part in (key.rpartition(".") for key in table()):
        if part in PART_WORDS:
            found[whole] = (*found.get(whole, ()), part)
    return found


@cache
def outside_identity() -> frozenset[str]:
    """Return the keys that no result depends on, so that no study can sweep them."""
    keys = {row.key for row in table().values() if not row.identity}
    inside = {row.key.rpartition(".")[0] for row in table().values() if row.identity}
    return frozenset(keys | {key.rpartition(".")[0] for key in keys} - inside - {""})

"""The table of parameters: all values of a case by group (`groups`, `vibration`), and their rows.

The reader, the compiled record, the dataset's attributes and the README's table are all made from
the fields of the groups.
"""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import field
from functools import cache, partial
from typing import Any

from compressor.cases.groups import (
    Contact,
    Friction,
    Gas,
    Machine,
    Offset,
    Output,
    Solve,
    Spring,
)
from compressor.cases.laws import CLEARANCE
from compressor.cases.optional_groups import Body, Drive, Guide, Lubricant, Rod, Sensor, Wear
from compressor.cases.parameter import (
    PART_WORDS,
    Parameter,
    PerJoint,
    by_part,
    choice,
    make_group,
    number,
    rows_of,
)
from compressor.metrics import JOINTS

MAX_REV = 50.0  # with `duration_rev: auto`

# groups that no joint reads with `joint: none`
OF_JOINTS = ("clearance_mm",)


def open_group(of: type, word: bool | None, value: Any) -> Any:
    """Return what a group is checked by: that of its word, a mapping as a dict, else the value."""
    if word is not None and value is word:
        return of() if word else None
    return dict(value) if isinstance(value, Mapping) else value


def group(of: type, *read: str, word: bool | None = None) -> Any:
    """Return the field of a group of keys.

    read: conditions under which a case reads any of it. word: that may stand for it (`WORDS`).
    """
    metadata = {"read": read, "open": partial(open_group, of, word), "of": of, "word": word}
    return field(default=None if word else of(), metadata=metadata)


@make_group
class Settings:
    """The values of one simulation in the case file's units, and the times that follow from them.

    `compressor.cases.case.Case` is made of these.
    """

    name: str = choice(
        "case", (), "name of the study; default: the file's", kind="text", identity=False
    )
    load: str = choice(
        "spring", ("spring", "gas", "none"), "load on the piston", "§2.2-2.4",
        aliases=(("design", "spring"), ("typical", "gas")),
    )  # fmt: skip
    joint: str = choice(
        "none", ("none", "big_end", "small_end", "both"), "joints with clearance", "§3.2"
    )
    clearance_mm: PerJoint[float] = by_part(
        PerJoint, 0.0,
        number(0.0, "[0, 1000]", "radial clearance", "§3.2", judged=(1e-3, 1.0)),
        {joint: ("joint != none", f"joint == {joint} or joint == both") for joint in JOINTS},
        fill=0.0,
    )  # fmt: skip
    healthy_clearance_mm: PerJoint[float] = by_part(
        PerJoint, 0.0,
        number(
            0.0, "[0, 1000]",
            "clearance up to which a joint counts as sound; it moves nothing, and 0 calls any worn",
            identity=False,
        ),
        fill=0.0,
    )  # fmt: skip
    initial_offset_mm: Offset = group(Offset)
    machine: Machine = group(Machine)
    gas: Gas = group(Gas, "load == gas")
    spring: Spring = group(Spring, "load == spring")
    contact: Contact = group(Contact, f"{CLEARANCE} or guide.clearance_mm > 0")
    friction: Friction | None = group(
        Friction, f"{CLEARANCE} or friction.ideal_joints == true", word=False
    )
    lubricant: Lubricant | None = group(Lubricant, CLEARANCE, word=True)
    guide: Guide | None = group(Guide, "guide.friction > 0 or guide.clearance_mm > 0", word=True)
    drive: Drive | None = group(Drive, word=True)
    rod: Rod | None = group(Rod, word=True)
    wear: Wear | None = group(Wear, CLEARANCE, word=True)
    body: Body | None = group(Body, word=True)
    sensor: Sensor | None = group(Sensor, "body", word=True)
    solve: Solve = group(Solve)
    output: Output = group(Output)

    @property
    def omega(self) -> float:
        """Return the crank speed, rad/s."""
        return self.machine.speed_rpm * math.pi / 30

    @property
    def turn(self) -> float:
        """Return the time of one revolution, s."""
        return 60.0 / self.machine.speed_rpm

    @property
    def worn_joint(self) -> str:
        """Return which joints count as worn: none, big_end, small_end or both.

        Those that `joint` names, but for a clearance that is healthy.
        """
        return name_worn_joint(self.joint, self.clearance_mm, self.healthy_clearance_mm)

    @property
    def unbalance(self) -> float:
        """Return what is out of balance on the crank, towards its pin, kg mm.

        A drive's own unbalance less the counterweight, and so below 0 where that is the greater.
        """
        return self._own_unbalance - self.counterweight

    @property
    def counterweight(self) -> float:
        """Return the crank's counterweight, kg mm: as given, or by what it balances; 0 for none.

        What turns with the crank pin is the rod's share there, m (1 - a / L), and the crank's own
        unbalance, if a drive names one; the rest of the rod reciprocates.
        """
        machine = self.machine
        if machine.balance is None:
            return machine.counterweight_kg_mm or 0.0
        rotating, reciprocating = machine.balance.rotating, machine.balance.reciprocating
        at_crosshead = machine.rod_mass_kg * (machine.rod_centre_mm or 0.0) / machine.rod_length_mm
        at_pin = machine.rod_mass_kg - at_crosshead
        turning = at_pin * machine.crank_radius_mm + self._own_unbalance
        back_and_forth = (machine.reciprocating_mass_kg + at_crosshead) * machine.crank_radius_mm
        return rotating * turning + reciprocating * back_and_forth

    @property
    def _own_unbalance(self) -> float:
        """Return the crank's unbalance without its counterweight, kg mm, as a drive names it."""
        return self.drive.unbalance_kg_mm if self.drive else 0.0

    @property
    def duration(self) -> float:
        """Return the duration, s; with `duration_rev: auto` the longest that it may come to."""
        if self.solve.duration_s is not None:
            return self.solve.duration_s
        given = self.solve.duration_rev
        return (MAX_REV if isinstance(given, str) else given or 0.0) * self.turn

    @property
    def settle(self) -> float:
        """Return the time from which metrics count, s; 0 with `auto`, until that is known."""
        given = self.solve.settle_rev
        return 0.0 if isinstance(given, str) else given * self.turn

    @property
    def steps(self) -> float:
        """Return the output steps in the duration, a whole number in a valid case."""
        if self.solve.output_step_s is not None:
            return self.duration / self.solve.output_step_s
        return self.duration * self.machine.speed_rpm * 6.0 / (self.solve.output_step_deg or 1.0)


_META = {item.name: item.metadata for item in dataclasses.fields(Settings)}
GROUPS: dict[str, type] = {name: meta["of"] for name, meta in _META.items() if "open" in meta}
# groups that a word may stand for: `false` leaves one out, `true` is one with its defaults
WORDS = {name: meta["word"] for name, meta in _META.items() if meta.get("word") is not None}


def name_worn_joint(joint: str, clearance_mm: PerJoint[float], healthy_mm: PerJoint[float]) -> str:
    """Return which of the joints that `joint` names are worn: beyond a healthy clearance."""
    named = JOINTS if joint == "both" else (joint,)
    healthy = [
        one for one in JOINTS if 0.0 < getattr(healthy_mm, one) >= getattr(clearance_mm, one)
    ]
    worn = [one for one in named if one not in healthy]
    return "both" if len(worn) > 1 else worn[0] if worn else "none"


@cache
def table() -> dict[str, Parameter]:
    """Return the table of parameters by dotted key, such as `machine.rod_mass_kg`.

    It is in the order of the case file; a key by part has several rows.
    """
    rows: list[Parameter] = []
    for item in dataclasses.fields(Settings):
        rows += rows_of(item.name, item)
        for inner in dataclasses.fields(GROUPS[item.name]) if item.name in GROUPS else ():
            rows += rows_of(f"{item.name}.{inner.name}", inner, group_readers(item.name))
    return {row.key: row for row in rows}


@cache
def parts_by_key() -> dict[str, tuple[str, ...]]:
    """Return the parts of each key that may have a value for each, such as big_end, small_end."""
    found: dict[str, tuple[str, ...]] = {}
    for whole, _, part in (key.rpartition(".") for key in table()):
        if part in PART_WORDS:
            found[whole] = (*found.get(whole, ()), part)
    return found


def group_readers(name: str) -> tuple[str, ...]:
    """Return the conditions that all hold where a case reads any key of a group."""
    return tuple(_META[name]["read"])


@cache
def outside_identity() -> frozenset[str]:
    """Return the keys that no result depends on, so that no study can sweep them."""
    keys = {row.key for row in table().values() if not row.identity}
    inside = {row.key.rpartition(".")[0] for row in table().values() if row.identity}
    return frozenset(keys | {key.rpartition(".")[0] for key in keys} - inside - {""})

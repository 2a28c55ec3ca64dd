"""Where a case leaves the domain of its laws or the judged range, or looks like a slip of units.

Nothing here is refused: a case is spoken of once, before it runs, and grouped over a sweep. What
cannot be simulated at all is refused by `compressor.cases.conflicts`.
"""

import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from compressor.cases import (
    CYLINDRICAL,
    Case,
    Contact,
    Machine,
    Study,
    joint_stiffness,
    outside_judged,
    with_ideal_joints,
)
from compressor.solve.ideal_scene import closed_form
from compressor.solve.request import greatest_depth
from compressor.solve.scales import (
    JointScales,
    contact_scales,
    expected_cost,
    greatest_force,
)
from compressor.solve.si_record import record
from compressor.solve.unit_slips import slips

SHALLOW = 2.0  # clearances: forces are bounds, and the paper's 0.1 mm is not meant
LONGEST_CRANK = 0.35  # of the rod's length; 0.15 to 0.3 is usual
LEAST_STICTION = 0.1  # mm/s: below it, friction all but sticks
MOST_JOBS = 500  # of a study that are looked at
SHORT = 4.0  # a budget this many times below what is expected; so far is that to be trusted
NEAR_BUCKLING = 0.5  # of Euler's load, beyond which a rod bends by more than its own inertia asks
TURN_PIECES = 8  # of the quadrature over a revolution of the ideal machine
DENSITIES = 1000.0, 20_000.0  # kg/m3, of what rods are made of


class Remark(NamedTuple):
    """What is odd about a case: the key it is about, and why."""

    key: str
    message: str
    kind: str  # the same for all cases with the same oddity


@dataclass(frozen=True)
class Caution:
    """One oddity of a study, with the words for the first job that has it."""

    key: str
    message: str
    jobs: int  # that have it
    of: int  # jobs looked at


def remarks(case: Case) -> Iterator[Remark]:
    """Yield what is odd about a case by itself; nothing about the defaults."""
    joints = list(contact_scales(case))
    yield from _inertias(case)
    yield from _proportions(case)
    yield from _beyond_judged(case)
    for joint in joints:
        yield from _default_stiffness(case, joint.joint)
        yield from _depths(case, joint)
    yield from _rod(case)
    yield from _drive(case)
    friction = case.friction
    if friction and friction.law in (None, "lugre") and friction.static < friction.dynamic:
        text = f"{friction.static:g} is below the dynamic one, {friction.dynamic:g}"
        yield Remark("friction.static", f"{text}: friction grows as bodies slide", "coefficients")
    if joints and friction and 0 < friction.stiction_velocity_mm_per_s < LEAST_STICTION:
        key = "friction.stiction_velocity_mm_per_s"
        slow = f"{friction.stiction_velocity_mm_per_s:g} mm/s, below {LEAST_STICTION:g} mm/s"
        yield Remark(key, f"{slow}: friction all but sticks, and steps get short", "stiction")
    yield from _budgets(case, joints)


def _inertias(case: Case) -> Iterator[Remark]:
    """Yield an inertia that no distribution of the rod's mass between its ends has."""
    machine = case.machine
    most = machine.rod_mass_kg * (machine.rod_length_mm / 1000) ** 2
    if (machine.rod_inertia_kg_m2 or 0.0) > most:
        text = f"{machine.rod_inertia_kg_m2:g} kg m2 is more than all mass a rod apart, {most:.3g}"
        yield Remark("machine.rod_inertia_kg_m2", text, "unit")


def _proportions(case: Case) -> Iterator[Remark]:
    """Yield a crank that is long for its rod, as where the stroke is given as the crank radius."""
    radius, length = case.machine.crank_radius_mm, case.machine.rod_length_mm
    if radius > LONGEST_CRANK * length:
        text = (
            f"{radius:g} mm is {radius / length:.2g} of the rod's length, more than the usual "
            f"{LONGEST_CRANK:g}: the crank radius is half the stroke"
        )
        yield Remark("machine.crank_radius_mm", text, "proportion")


def _beyond_judged(case: Case) -> Iterator[Remark]:
    """Yield the values outside the range that the program was judged on."""
    for key, text in outside_judged(case.values()).items():
        yield Remark(key, text, "judged")


def _depths(case: Case, joint: JointScales) -> Iterator[Remark]:
    """Yield the penetrations for which the contact law is not meant."""
    depth, clearance = 1000 * joint.penetration, 1000 * joint.clearance
    most, limit = greatest_depth(record(case))
    if joint.penetration > most:
        text = (
            f"forces of about {joint.force:.3g} N press {depth:.3g} mm deep, more than {limit}, at "
            "which a run stops: check stiffness, masses, speed and their units"
        )
        cylinder = case.contact.length_mm is not None
        key = "contact.length_mm" if cylinder else "contact.stiffness_N_per_mm15"
        yield Remark(key, text, "deep")
        return
    if depth > SHALLOW * clearance:
        text = f"{clearance:g} mm is less than the contact gives way, about {depth:.2g} mm"
        yield Remark(
            "clearance_mm",
            f"{text}: the joint acts as a spring more than as a gap; check the "
            "stiffness (contact.materials), or raise the clearance",
            "shallow",
        )


def _default_stiffness(case: Case, joint: str) -> Iterator[Remark]:
    """Yield the paper's stiffness at a pin that is not the paper's."""
    contact, usual = case.contact, Contact()
    pin, clearance = case.machine.pin_radius(joint), getattr(case.clearance_mm, joint)
    if pin == Machine().pin_radius_mm or contact.law in CYLINDRICAL:
        return
    if contact.stiffness_N_per_mm15 != usual.stiffness_N_per_mm15:
        return
    found = []
    for geometry in ("external", "internal"):
        steel = replace(contact, materials=("steel", "steel"), geometry=geometry, exponent=1.5)
        found.append(joint_stiffness(steel, pin, clearance) / 1000.0**1.5)
    yield Remark(
        "contact.stiffness_N_per_mm15",
        f"{usual.stiffness_N_per_mm15:g} N/mm^1.5 is the paper's, of a pin of 10 mm radius; of "
        f"steel on steel Eq. 15 gives {found[1]:.3g} for one of {pin:g} mm in its bore "
        f"({found[0]:.3g} as of two discs): give contact.materials, such as [steel, copper], or "
        "the stiffness",
        "default stiffness",
    )


def _rod(case: Case) -> Iterator[Remark]:
    """Yield an elastic rod that would buckle, or whose mass is not that of its section."""
    rod, machine = case.rod, case.machine
    if rod is None:
        return
    p = record(case)
    euler = math.pi**2 * float(p["bending_stiffness"]) * float(p["rod_length"])
    force = greatest_force(p, "small_end")
    if force > NEAR_BUCKLING * euler:
        text = f"forces of up to about {force:.3g} N come near Euler's load, {euler:.3g} N"
        yield Remark("rod.depth_mm", f"{text}: this rod is linear and does not buckle", "buckling")
    volume = machine.rod_length_mm * rod.depth_mm * rod.width_mm / 1e9
    density = machine.rod_mass_kg / volume
    if not DENSITIES[0] <= density <= DENSITIES[1]:
        text = f"{machine.rod_mass_kg:g} kg in {rod.width_mm:g} x {rod.depth_mm:g} x "
        text += f"{machine.rod_length_mm:g} mm are {density:.3g} kg/m3: check mass and section"
        yield Remark("machine.rod_mass_kg", text, "density")


def _drive(case: Case) -> Iterator[Remark]:
    """Yield a motor that cannot bear the load, by the mean torque of the ideal machine."""
    drive = case.drive
    if drive is None or case.load == "none":
        return
    plain = replace(
        with_ideal_joints(case), friction=None, guide=None, drive=None, rod=None,
        body=None, sensor=None,
    )  # fmt: skip
    p, turn = record(plain), plain.turn
    tally = closed_form(p, np.array([0.0, turn]), 0.0, TURN_PIECES).tally
    needed, slope = float(tally["crank_torque"]) / turn, drive.slope_N_m_s
    most = drive.torque_N_m + slope * case.omega
    if needed > 0.0 and needed > most:
        text = f"the load takes {needed:.3g} N m on average, more than the motor ever gives, "
        yield Remark("drive.torque_N_m", f"{text}{most:.3g} N m: the crank will stall", "load")


def _budgets(case: Case, joints: list[JointScales]) -> Iterator[Remark]:
    """Yield the budgets that are likely to run out."""
    solve, (steps, seconds) = case.solve, expected_cost(case, joints)
    if steps > SHORT * solve.max_steps:
        text = f"{solve.max_steps} steps, but about {steps:.1g} are expected"
        yield Remark("solve.max_steps", text, "steps")
    if seconds > SHORT * solve.timeout_s:
        text = f"{solve.timeout_s:g} s, but about {seconds:.1g} s are expected"
        yield Remark("solve.timeout_s", text, "seconds")


def cautions(study: Study, most: int = MOST_JOBS) -> list[Caution]:
    """Return what is odd about the selected jobs of a study, an entry for each oddity.

    A key whose values look like another unit's is told of as that alone. Of more than `most` jobs
    as many are looked at, drawn evenly and always the same, so that a large sweep takes no longer.
    """
    numbers: Sequence[int] = study.selected
    if len(numbers) > most:
        numbers = sorted(random.Random(0).sample(numbers, most))
    cases = [study.cases[number] for number in numbers]
    units = {one.key: Caution(one.key, one.message, one.jobs, len(cases)) for one in slips(cases)}
    found: dict[tuple[str, str], list[str]] = {}
    for case in cases:
        once = {(one.key, one.kind): one.message for one in remarks(case) if one.key not in units}
        for what, message in once.items():
            found.setdefault(what, []).append(message)
    others = [
        Caution(key, texts[0], len(texts), len(cases))
        for (key, _), texts in sorted(found.items(), key=lambda item: -len(item[1]))
    ]
    return [*units.values(), *others]

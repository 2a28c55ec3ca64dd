"""Where a case leaves the domain of its laws, or looks like a slip of units (`unit_slips`).

Nothing here is refused: a case is spoken of once, before it runs, and grouped over a sweep. What
cannot be simulated at all is refused by `compressor.cases.conflicts`.
"""

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from compressor.cases import Case, Study
from compressor.solve.request import greatest_depth
from compressor.solve.scales import JointScales, contact_scales, expected_cost
from compressor.solve.si_record import record
from compressor.solve.unit_slips import slips

SHALLOW = 2.0  # clearances: forces are bounds, and the paper's 0.1 mm is not meant
LEAST_STICTION = 0.1  # mm/s: below it, friction all but sticks
MOST_JOBS = 500  # of a study that are looked at
SHORT = 4.0  # a budget this many times below what is expected; so far is that to be trusted


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
    """What is odd about a case by itself; nothing about the defaults."""
    joints = list(contact_scales(case))
    yield from _inertias(case)
    for joint in joints:
        yield from _depths(case, joint)
    friction = case.friction
    if joints and friction and 0 < friction.stiction_velocity_mm_per_s < LEAST_STICTION:
        key = "friction.stiction_velocity_mm_per_s"
        slow = f"{friction.stiction_velocity_mm_per_s:g} mm/s, below {LEAST_STICTION:g} mm/s"
        yield Remark(key, f"{slow}: friction all but sticks, and steps get short", "stiction")
    yield from _budgets(case, joints)


def _inertias(case: Case) -> Iterator[Remark]:
    """An inertia that no distribution of the rod's mass between its ends has."""
    machine = case.machine
    most = machine.rod_mass_kg * (machine.rod_length_mm / 1000) ** 2
    if (machine.rod_inertia_kg_m2 or 0.0) > most:
        text = f"{machine.rod_inertia_kg_m2:g} kg m2 is more than all mass a rod apart, {most:.3g}"
        yield Remark("machine.rod_inertia_kg_m2", text, "unit")


def _depths(case: Case, joint: JointScales) -> Iterator[Remark]:
    """Penetrations for which the contact law is not meant."""
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
            "clearance_mm", f"{text}: the joint acts as a spring more than as a gap", "shallow"
        )


def _budgets(case: Case, joints: list[JointScales]) -> Iterator[Remark]:
    """Budgets that are likely to run out."""
    solve, (steps, seconds) = case.solve, expected_cost(case, joints)
    if steps > SHORT * solve.max_steps:
        text = f"{solve.max_steps} steps, but about {steps:.1g} are expected"
        yield Remark("solve.max_steps", text, "steps")
    if seconds > SHORT * solve.timeout_s:
        text = f"{solve.timeout_s:g} s, but about {seconds:.1g} s are expected"
        yield Remark("solve.timeout_s", text, "seconds")


def cautions(study: Study, most: int = MOST_JOBS) -> list[Caution]:
    """What is odd about the selected jobs of a study, an entry for each oddity.

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

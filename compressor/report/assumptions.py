"""What a reader of a report must keep in mind, as far as the stored studies give reason to."""

from collections.abc import Sequence
from dataclasses import dataclass

from compressor.cases import Case, CaseError
from compressor.report.page import Section
from compressor.store import Stored, StoredStudy

MASSES = {
    "rod_mass_kg": "rod {:g} kg (a steel bar of 600 × 40 × 25 mm)",
    "reciprocating_mass_kg": "crosshead with piston rod and piston {:g} kg",
}


@dataclass(frozen=True)
class Assumptions:
    """Which of the assumptions enter what the page shows."""

    masses: Sequence[str]  # that a study leaves to the defaults, in words
    worn: bool
    spring: bool
    claims: bool


def assumptions_section(stored: Stored, studies: Sequence[StoredStudy], claims: bool) -> Section:
    """Return what to keep in mind of the studies of a store, and of the claims if they are told."""
    default = Case.from_values({}).machine
    cases = [(study, case) for study in studies if (case := last_case(stored, study))]
    ours = [
        words.format(getattr(default, mass))
        for mass, words in MASSES.items()
        if any(
            getattr(case.machine, mass) == getattr(default, mass)
            and f"machine.{mass}" not in {axis.key for axis in study.axes}
            for study, case in cases
        )
    ]
    content = Assumptions(
        ours,
        any(case.joint != "none" for _, case in cases),
        any(case.load == "spring" for _, case in cases),
        claims,
    )
    return Section("assumptions", "What to keep in mind", "assumptions.html", content)


def last_case(stored: Stored, study: StoredStudy) -> Case | None:
    """Return the case of a study's last stored job; None where there is none that this version
    knows.
    """
    for position in stored.rows.find([*study.keys])[::-1]:
        if position >= 0:
            try:
                return Case.from_attribute(stored.rows.attributes(int(position))["case"])
            except CaseError:
                return None
    return None

"""What does not fit together in the laws of contact and friction of a case."""

from collections.abc import Iterator

from compressor.cases.laws import CYLINDRICAL, READ_BY, RESTITUTING, law_of
from compressor.cases.parameter import Problem
from compressor.cases.table import Settings


def law_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    """Find what a law of contact cannot do without."""
    law, restitution = case.contact.law, case.contact.restitution
    if law in CYLINDRICAL:
        yield from cylinder_conflicts(case)
    if law in RESTITUTING and restitution is None:
        needed = f"is needed with contact.law: {law}; give it, such as 0.9"
        yield Problem("contact.restitution", needed)


def contact_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    contact = case.contact
    if contact.materials is not None and contact.exponent != 1.5:
        yield Problem(
            "contact.exponent",
            f"is {contact.exponent:g}, but Eq. 15's stiffness from materials needs exponent 1.5: "
            "leave it out, or give stiffness_N_per_mm15 in place of materials",
        )


def friction_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    friction = case.friction
    if friction and friction.law == "lugre" and bool(friction.static) != bool(friction.dynamic):
        zero = "dynamic" if friction.static else "static"
        yield Problem(
            f"friction.{zero}",
            "is 0 and the other coefficient is not: LuGre's bristles divide by it; give more than "
            "0, or 0 for both",
        )
    if not friction or law_of(friction) not in READ_BY["friction"]["friction_velocity_mm_per_s"]:
        return
    if friction.friction_velocity_mm_per_s <= friction.stiction_velocity_mm_per_s:
        yield Problem(
            "friction.friction_velocity_mm_per_s",
            f"{friction.friction_velocity_mm_per_s:g} mm/s must exceed the "
            f"stiction_velocity_mm_per_s, {friction.stiction_velocity_mm_per_s:g} mm/s",
        )


def cylinder_conflicts(case: Settings) -> Iterator[Problem]:
    """Yield a pin in a bore is known by its length and by what both are made of."""
    contact = case.contact
    needed = f"is needed with contact.law: {contact.law}; give it, such as"
    if contact.length_mm is None:
        yield Problem("contact.length_mm", f"{needed} 20")
    if contact.materials is None and contact.modulus_GPa is None:
        yield Problem("contact.materials", f"{needed} [steel, copper], or give modulus_GPa")

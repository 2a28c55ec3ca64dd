"""The laws of contact and friction that a case chooses from, and the keys that each reads."""

from dataclasses import fields, replace
from typing import Any

RESTITUTING = ("hunt_crossley", "lankarani_nikravesh", "flores", "gonthier", "hu_guo")
CYLINDRICAL = ("johnson", "liu")  # of a pin in its bore; with a restitution if one is given
CONTACT_LAWS = ("impact", "hertz", *RESTITUTING, *CYLINDRICAL)
FRICTION_LAWS = ("adams", "coulomb_tanh", "threlfall", "ambrosio", "lugre")
# keys that some laws alone read, and those laws
READ_BY = {
    "contact": {
        "damping_N_s_per_mm": ("impact",),
        "full_damping_mm": ("impact",),
        "restitution": RESTITUTING + CYLINDRICAL,
        "least_approach_mm_per_s": RESTITUTING + CYLINDRICAL,
        "exponent": tuple(law for law in CONTACT_LAWS if law not in CYLINDRICAL),
        "geometry": tuple(law for law in CONTACT_LAWS if law not in CYLINDRICAL),
        "length_mm": CYLINDRICAL,
        "modulus_GPa": CYLINDRICAL,
    },
    "friction": {
        "static": ("adams", "lugre"),
        "friction_velocity_mm_per_s": ("adams", "ambrosio"),
        "bristle_stiffness_per_mm": ("lugre",),
        "bristle_damping_s_per_mm": ("lugre",),
        "viscous_s_per_mm": ("lugre",),
    },
}
# what these are where a law that reads them is chosen and they are not given
USUAL = {
    "least_approach_mm_per_s": 10.0,
    "bristle_stiffness_per_mm": 100.0,
    "bristle_damping_s_per_mm": 0.03,
    "viscous_s_per_mm": 0.0,
}


def law_of(group: Any) -> str:
    """Return the law of a case's contact or friction by name."""
    return str(group.law or FRICTION_LAWS[0])


def with_law(name: str, group: Any) -> Any:
    """Return contact or friction with what its law reads filled in, and the rest at its default."""
    law, changes = law_of(group), {}
    for field in fields(group):
        readers = READ_BY[name].get(field.name)
        value = getattr(group, field.name)
        if readers and law not in readers:
            if value is not field.default:
                changes[field.name] = field.default
        elif readers and value is None and field.name in USUAL:
            changes[field.name] = USUAL[field.name]
    if name == "friction" and group.law == FRICTION_LAWS[0]:  # as without the key
        changes["law"] = None
    return replace(group, **changes) if changes else group

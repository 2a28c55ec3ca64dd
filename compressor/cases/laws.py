"""The laws of contact and friction that a case chooses from, and the keys that each reads.

Who reads a key: conditions on a case, in the language of `--only` (`compressor.cases.comparison`).
The fields of the groups name theirs (`read=`), and so do the groups in `compressor.cases.table`,
which adds those of `READ_BY`. A key without one is read by every job. `compressor.cases.conflicts`
refuses what no job reads.
"""

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


def fill_by_law(name: str, group: Any) -> None:
    """Fill in what the law of contact or friction reads; the rest has its default."""
    values = vars(group)
    for key, readers in READ_BY[name].items():
        if group.law not in readers:
            values[key] = type(group).__dataclass_fields__[key].default
        elif values[key] is None and key in USUAL:
            values[key] = USUAL[key]


CLEARANCE = "clearance_mm.big_end > 0 or clearance_mm.small_end > 0"


def or_own(key: str) -> str:
    """Return who reads a key of `contact` that a guide's corner may have of its own."""
    return f"{CLEARANCE} or not guide.{key} >= 0"


def by_law(group: str, key: str) -> tuple[str, ...]:
    """Return who reads a key that some laws of contact or friction alone read; () for another."""
    readers = READ_BY.get(group, {}).get(key)
    if not readers:
        return ()
    every = CONTACT_LAWS if group == "contact" else FRICTION_LAWS
    others = [law for law in every if law not in readers]
    if "adams" in readers or len(others) < len(readers):  # which a file need not name
        return group, " and ".join(f"{group}.law != {law}" for law in others)
    return (" or ".join(f"{group}.law == {law}" for law in readers),)

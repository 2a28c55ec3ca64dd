"""Materials of the paper, the contact stiffness that follows from them, and its pin's numbers."""

import math
from typing import TYPE_CHECKING

from compressor.cases.checks import value_of
from compressor.cases.laws import CYLINDRICAL
from compressor.cases.parameter import to_si
from compressor.cases.table import table
from compressor.metrics import JOINTS

if TYPE_CHECKING:
    from compressor.cases.case import Case
    from compressor.cases.groups import Contact

# Table 2 of the paper: density (kg/m^3), Young's modulus (Pa), Poisson's ratio
MATERIALS = {"steel": (7801.0, 2.07e11, 0.29), "copper": (8906.0, 1.19e11, 0.326)}

# lengths whose defaults are of the paper's pin -> why they matter
LENGTHS = {
    "lubricant.bearing_length_mm": "a film bears about as the cube of it",
    "wear.bore_length_mm": "the same wear is half as deep in a bore of twice the length",
}


def composite_modulus(first, second):
    """Return the composite modulus E* (Pa) of two materials by name.

    1 / E* is the sum of (1 - nu^2) / E (Hertz). Raises KeyError for one that is not in Table 2.
    """
    pair = (MATERIALS[first], MATERIALS[second])
    return 1.0 / sum((1.0 - poisson**2) / modulus for _, modulus, poisson in pair)


def contact_stiffness(first, second, journal_radius, bearing_radius, internal=False):
    """Return Eq. 15's stiffness K (N/m^1.5) of two materials by name and two radii (m).

    The paper adds the radii's curvatures, as of two discs side by side; internal: it takes them
    from each other, as of a pin in a bore (Flores and Lankarani, Contact force models for multibody
    dynamics, 2016, ch. 3), which is stiffer. Raises KeyError for a material that is not in Table 2,
    ZeroDivisionError for internal radii that are alike. Steel on steel with radii 10 and 9.9 mm
    gives Table 3's 3.36e5 N/mm^1.5.
    """
    compliance = 0.0
    for name in (first, second):
        _, modulus, poisson = MATERIALS[name]
        compliance += (1.0 - poisson**2) / (math.pi * modulus)
    sign = -1.0 if internal else 1.0
    radius = journal_radius * bearing_radius / (bearing_radius + sign * journal_radius)
    return 4.0 / (3.0 * math.pi * compliance) * math.sqrt(radius)


def joint_stiffness(
    contact: "Contact", joint: str, pin_radius_mm: float, clearance_mm: float
) -> float:
    """Return the stiffness that scales a joint's law: K (N/m^p), or pi E* L (N/m) with johnson.

    K is the case's, or Eq. 15's of the materials (`contact_stiffness`). With liu it is K (N/m^1.5)
    at small penetrations, which depends on the clearance; 0 without any.
    """
    pin, clearance = to_si(pin_radius_mm, "mm"), to_si(clearance_mm, "mm")
    if contact.law in CYLINDRICAL:
        modulus = to_si(contact.modulus_GPa or 0.0, "GPa")
        if contact.materials:
            modulus = composite_modulus(*contact.materials.at(joint))
        length = contact.length_mm.at(joint) if contact.length_mm else 0.0
        line = math.pi * modulus * to_si(length, "mm")
        if contact.law == "johnson":
            return line
        return line / (2.0 * math.sqrt(2.0 * clearance)) if clearance > 0.0 else 0.0
    if contact.materials:
        internal = contact.geometry == "internal" and clearance > 0.0  # an ideal joint has none
        return contact_stiffness(*contact.materials.at(joint), pin, pin + clearance, internal)
    return (contact.stiffness_N_per_mm15 or 0.0) * 1000.0**contact.exponent


def paper_notes(case: "Case") -> dict[str, str]:
    """Return what to know of the numbers of the paper's pin that a case has at other pins, by key.

    They are defaults: the contact stiffness, the length of an oiled bearing, that of a bore that
    wears.
    """
    contact, found = case.contact, {}
    pins = {
        joint: case.machine.pin_radius_mm.at(joint)
        for joint in JOINTS
        if getattr(case.clearance_mm, joint) > 0
    }
    radius = table()["machine.pin_radius_mm.big_end"].default
    others = {joint: pin for joint, pin in pins.items() if pin != radius}
    key = "contact.stiffness_N_per_mm15"
    is_papers = contact.stiffness_N_per_mm15 == table()[key].default
    if others and is_papers and contact.law not in CYLINDRICAL:
        found[key] = (
            f"{contact.stiffness_N_per_mm15:g} N/mm^1.5 is the paper's, of a pin of {radius:g} mm "
            "radius: give contact.materials, such as [steel, steel], or the stiffness"
        )
    for key, why in LENGTHS.items():
        rows = {joint: table().get(key) or table()[f"{key}.{joint}"] for joint in JOINTS}
        usual = rows["big_end"].default
        own = {pin for one, pin in others.items() if value_of(case, rows[one].key) == usual}
        given = " and ".join(f"{pin:g}" for pin in sorted(own, reverse=True))
        found[key] = given and (
            f"{usual:g} mm is the default, for the paper's pin of {radius:g} mm radius, and yours "
            f"has {given} mm: {why}; give the length that bears, without grooves and holes"
        )
    return {key: note for key, note in found.items() if note}

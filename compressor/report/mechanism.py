"""A picture of a case's mechanism, to scale, with the worn joints marked and their clearance."""

import math
from dataclasses import dataclass

from markupsafe import Markup

from compressor.analysis import SPOKEN
from compressor.cases import Case
from compressor.metrics import JOINTS
from compressor.report.page import templates

WIDTH = 1000.0  # units of the drawing
ANGLE = 60.0  # degrees after top dead centre
INSET = 74.0  # radius of a worn joint's enlarged bearing
GAP = 14.0  # radial gap that the greatest clearance has in its inset


@dataclass(frozen=True)
class Inset:
    """A worn joint enlarged: where its bearing stands, the journal's radius, and its clearance."""

    name: str
    x: float
    y: float
    journal: float
    gap: float
    clearance: str


@dataclass(frozen=True)
class Mechanism:
    """What the template draws; lengths in units of the drawing, y downwards.

    `crank`, `rod` and so on are lengths; `big` and `small` are where the joints are.
    """

    title: str
    said: str
    height: float
    origin: tuple[float, float]
    big: tuple[float, float]
    small: tuple[float, float]
    crank: float
    thick: float
    worn: tuple[str, ...]
    insets: tuple[Inset, ...]


def mechanism(case: Case, angle: float = ANGLE) -> Mechanism:
    """Return the mechanism of a case at a crank angle (degrees after top dead centre).

    The slider-crank's closed form: the crosshead is at r cos θ + sqrt(l² - (r sin θ)²) from the
    crank's centre.
    """
    crank, rod = case.machine.crank_radius_mm, case.machine.rod_length_mm
    turn = math.radians(angle)
    pin = crank * math.cos(turn), crank * math.sin(turn)
    crosshead = pin[0] + math.sqrt(rod**2 - pin[1] ** 2)
    scale = (WIDTH - 260.0) / (2.0 * crank + rod)
    height = max(260.0, 2.0 * crank * scale + 110.0)
    worn = {joint: getattr(case.clearance_mm, joint) for joint in JOINTS}
    worn = {joint: size for joint, size in worn.items() if size > 0.0}
    rows = 2.0 * INSET + 66.0 if worn else 0.0
    x, y = 60.0 + crank * scale, height / 2.0
    most = max(worn.values(), default=1.0)
    insets = tuple(
        Inset(
            SPOKEN[joint], 140.0 + 430.0 * number, height + INSET + 16.0,
            INSET - GAP * size / most, GAP * size / most, f"{size:.3g}",
        )
        for number, (joint, size) in enumerate(worn.items())
    )  # fmt: skip
    where = " and ".join(f"{SPOKEN[joint]} ({size:g} mm)" for joint, size in worn.items())
    title = f"Slider-crank mechanism, {angle:g}° after top dead centre"
    said = f"{title}: crank {crank:g} mm, rod {rod:g} mm, drawn to scale. " + (
        f"Clearance at the {where}, enlarged below." if worn else "No joint has clearance."
    )
    return Mechanism(
        title, said, height + rows, (x, y), (x + pin[0] * scale, y - pin[1] * scale),
        (x + crosshead * scale, y), crank * scale, max(5.0, min(18.0, 0.12 * crank * scale)),
        tuple(worn), insets,
    )  # fmt: skip


def mechanism_svg(case: Case, angle: float = ANGLE) -> Markup:
    """Return the picture as SVG that stands in a page; its colours are those of the page."""
    text = templates().get_template("mechanism.svg").render(it=mechanism(case, angle))
    return Markup(text)


def mechanism_words(case: Case) -> str:
    """Return what the picture does not show: speed, masses and the pin."""
    machine = case.machine
    pins = " and ".join(dict.fromkeys(f"{machine.pin_radius(joint):g}" for joint in JOINTS))
    return (
        f"{machine.speed_rpm:g} rpm; rod {machine.rod_mass_kg:g} kg, crosshead with piston "
        f"{machine.reciprocating_mass_kg:g} kg; pins of {pins} mm radius."
    )

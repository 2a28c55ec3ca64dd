"""The paper's figures: a registry, whose drawing functions stand in the modules beside it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import xarray as xr
from matplotlib.figure import Figure as Drawing

from compressor.analysis import CLEARANCES, label
from compressor.report.figures.forces import draw_contact_force, draw_piston_force
from compressor.report.figures.machine import draw_cam, draw_pressure_volume
from compressor.report.figures.relation import draw_relation
from compressor.report.figures.response import draw_fault_response, draw_load_response


@dataclass(frozen=True)
class Figure:
    """One figure of the paper; `needs` are labels of `compressor.analysis.claims.paper_cases`."""

    number: int
    title: str
    caption: str
    needs: tuple[str, ...]
    draw: Callable[[Mapping[str, xr.Dataset]], Drawing]


def sizes(fault: str) -> tuple[str, ...]:
    """The labels of a fault's three clearances."""
    return tuple(label(fault, clearance) for clearance in CLEARANCES)


RESPONSE = (
    "Left, all of it; right, the part in the black rectangle, where the curves differ most. "
    "Displacement and velocity leave the machine without clearance by about a line's width. "
)
FORCE = (
    "Force on the rod: (a) along the cylinder, positive away from the crank, and (b) vertical, on "
    "a scale of its own. Right, the part in the black rectangle, where the horizontal forces "
    "differ most. "
)
RELATION = (
    "A dot for each stored sample. The line is the least-squares fit of force on acceleration; its "
    "slope is a mass. The dots enclose a loop because the spring's force comes and goes within "
    "each revolution; {why} "
)

FIGURES = (
    Figure(
        3,
        "The ideal p–V diagram",
        "Cylinder pressure over gas volume in the typical model, made from the stored piston force "
        "and displacement; arrows point in the direction of time. Suction and discharge keep their "
        "pressures, compression and expansion are isentropic. The phases change at the crank "
        "angles printed in Eq. 13, which miss the exact ones by up to 0.2°: too little to see.",
        ("typical",),
        draw_pressure_volume,
    ),
    Figure(
        4,
        "The cam of the design load",
        "(a) The path of the roller's centre around the base circle, at rest while the gas would "
        "expand or be compressed, moving with the piston in between. (b) The follower's "
        "displacement. As printed, with the ideal gas's corner angles, Eq. 10 rises by 208.7 mm "
        "and falls by 81.3 mm, so that the cam does not close. The closed cam, our reconstruction, "
        "rises and falls by the 120 mm of Table 1. From 294° on the two are the same.",
        ("design",),
        draw_cam,
    ),
    Figure(
        6,
        "Response of the design and the typical model",
        "Without clearance, both models. The curves coincide by construction: ideal joints and a "
        "crank of prescribed speed leave the load no say in the motion. Right, the part in the "
        "black rectangle, at a peak.",
        ("design", "typical"),
        draw_load_response,
    ),
    Figure(
        7,
        "Piston force of the design and the typical model",
        "The spring's force rises and falls like the gas's, but peaks higher and turns at other "
        "angles: 84.26° and 275.74° instead of 38.95° and 294.2°. The steps at these two corners "
        "are the spring's damping, which acts only while the follower rests.",
        ("design", "typical"),
        draw_piston_force,
    ),
    Figure(
        8,
        "Response with clearance at the big end",
        RESPONSE + "Acceleration does not: twice a revolution, near 80° and 320°, the force in the "
        "joint reverses, the crankpin crosses its clearance and lands. The larger the clearance, "
        "the later and the harder the landing, and the longer the joint rings after it.",
        ("design", *sizes("big_end")),
        partial(draw_fault_response, fault="big_end"),
    ),
    Figure(
        9,
        "Contact force at the big end",
        FORCE + "The spikes are the landings of Figure 8; between them the force carries the load "
        "and the inertia of the moving parts.",
        sizes("big_end"),
        partial(draw_contact_force, fault="big_end", joint="big_end"),
    ),
    Figure(
        10,
        "Acceleration against horizontal contact force, big end",
        RELATION.format(
            why="beside the spring, the joint moves piston, crosshead and rod."
        ).strip(),
        sizes("big_end"),
        partial(draw_relation, joint="big_end"),
    ),
    Figure(
        11,
        "Response with clearance at the small end",
        RESPONSE + "Acceleration has the landings of Figure 8, and long ringing around both dead "
        "centres, where the rod shakes on the crosshead's pin; the smallest clearance, drawn on "
        "top, rings as strongly as the others.",
        ("design", *sizes("small_end")),
        partial(draw_fault_response, fault="small_end"),
    ),
    Figure(
        12,
        "Contact force at the small end",
        FORCE + "The signs are opposite to the big end's: here the crosshead holds the rod back. "
        "The smallest clearance is drawn on top.",
        sizes("small_end"),
        partial(draw_contact_force, fault="small_end", joint="small_end"),
    ),
    Figure(
        13,
        "Acceleration against horizontal contact force, small end",
        RELATION.format(
            why="this joint moves piston and crosshead alone. The slope is negative since "
            "the crosshead's inertia pushes the rod back."
        ).strip(),
        sizes("small_end"),
        partial(draw_relation, joint="small_end"),
    ),
    Figure(
        14,
        "Response with clearance at both joints",
        RESPONSE
        + "Acceleration has the landings near 80° and 320°, at 0.3 mm harder than with one "
        "joint's clearance, and rings around both dead centres; the smallest clearance is drawn "
        "on top.",
        ("design", *sizes("both")),
        partial(draw_fault_response, fault="both"),
    ),
    Figure(
        15,
        "Contact force at the big end, clearance at both joints",
        FORCE + "To be compared with Figure 9. The smallest clearance is drawn on top.",
        sizes("both"),
        partial(draw_contact_force, fault="both", joint="big_end"),
    ),
    Figure(
        16,
        "Contact force at the small end, clearance at both joints",
        FORCE + "To be compared with Figure 12. The smallest clearance is drawn on top.",
        sizes("both"),
        partial(draw_contact_force, fault="both", joint="small_end"),
    ),
)

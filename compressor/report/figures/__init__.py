"""The paper's figures: a registry, whose drawing functions stand in the modules beside it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from compressor.analysis import CLEARANCES, label
from compressor.report.figures.curves import Runs
from compressor.report.figures.drawing import Drawing
from compressor.report.figures.paper import (
    draw_cam,
    draw_contact_force,
    draw_fault_response,
    draw_load_response,
    draw_piston_force,
    draw_pressure_volume,
    draw_relation,
)


@dataclass(frozen=True)
class Figure:
    """One figure of the paper; `needs` are labels of `compressor.analysis.claims.paper_cases`.

    `draw` takes the runs that these name.
    """

    number: int
    title: str
    needs: tuple[str, ...]
    draw: Callable[[Runs], Drawing]


def sizes(fault: str) -> tuple[str, ...]:
    """Return the labels of a fault's three clearances."""
    return tuple(label(fault, clearance) for clearance in CLEARANCES)


FIGURES = (
    Figure(3, "The ideal p–V diagram", ("typical",), draw_pressure_volume),
    Figure(4, "The cam of the spring load", ("design",), draw_cam),
    Figure(
        6,
        "Response of the design and the typical model",
        ("design", "typical"),
        draw_load_response,
    ),
    Figure(
        7,
        "Piston force of the design and the typical model",
        ("design", "typical"),
        draw_piston_force,
    ),
    Figure(
        8,
        "Response with clearance at the big end",
        ("design", *sizes("big_end")),
        partial(draw_fault_response, fault="big_end"),
    ),
    Figure(
        9,
        "Contact force at the big end",
        sizes("big_end"),
        partial(draw_contact_force, fault="big_end", joint="big_end"),
    ),
    Figure(
        10,
        "Acceleration against horizontal contact force, big end",
        sizes("big_end"),
        partial(draw_relation, joint="big_end"),
    ),
    Figure(
        11,
        "Response with clearance at the small end",
        ("design", *sizes("small_end")),
        partial(draw_fault_response, fault="small_end"),
    ),
    Figure(
        12,
        "Contact force at the small end",
        sizes("small_end"),
        partial(draw_contact_force, fault="small_end", joint="small_end"),
    ),
    Figure(
        13,
        "Acceleration against horizontal contact force, small end",
        sizes("small_end"),
        partial(draw_relation, joint="small_end"),
    ),
    Figure(
        14,
        "Response with clearance at both joints",
        ("design", *sizes("both")),
        partial(draw_fault_response, fault="both"),
    ),
    Figure(
        15,
        "Contact force at the big end, clearance at both joints",
        sizes("both"),
        partial(draw_contact_force, fault="both", joint="big_end"),
    ),
    Figure(
        16,
        "Contact force at the small end, clearance at both joints",
        sizes("both"),
        partial(draw_contact_force, fault="both", joint="small_end"),
    ),
)

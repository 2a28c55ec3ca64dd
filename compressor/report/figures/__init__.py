"""The paper's figures: a registry, whose drawing functions stand in the modules beside it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from compressor.analysis import CLEARANCES, SPOKEN, label
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


def response(number: int, place: str, fault: str) -> Figure:
    """Return the figure of the motion with a fault's three clearances."""
    draw = partial(draw_fault_response, fault=fault)
    return Figure(number, f"Response with clearance at {place}", ("design", *sizes(fault)), draw)


def force(number: int, joint: str, fault: str, more: str = "") -> Figure:
    """Return the figure of the contact force at a joint with a fault's three clearances."""
    draw = partial(draw_contact_force, fault=fault, joint=joint)
    return Figure(number, f"Contact force at the {SPOKEN[joint]}{more}", sizes(fault), draw)


def relation(number: int, joint: str) -> Figure:
    """Return the figure of acceleration against force with three clearances of a joint."""
    title = f"Acceleration against horizontal contact force, {SPOKEN[joint]}"
    return Figure(number, title, sizes(joint), partial(draw_relation, joint=joint))


BOTH = ", clearance at both joints"
LOADS = ("design", "typical")
FIGURES = (
    Figure(3, "The ideal p–V diagram", ("typical",), draw_pressure_volume),
    Figure(4, "The cam of the spring load", ("design",), draw_cam),
    Figure(6, "Response of the design and the typical model", LOADS, draw_load_response),
    Figure(7, "Piston force of the design and the typical model", LOADS, draw_piston_force),
    response(8, "the big end", "big_end"),
    force(9, "big_end", "big_end"),
    relation(10, "big_end"),
    response(11, "the small end", "small_end"),
    force(12, "small_end", "small_end"),
    relation(13, "small_end"),
    response(14, "both joints", "both"),
    force(15, "big_end", "both", BOTH),
    force(16, "small_end", "both", BOTH),
)

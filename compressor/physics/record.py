"""The record of parameters that every compiled function reads, and the names of its choices.

All numbers are SI. One scalar numpy record instead of closures or arguments: numba keeps the
machine code of functions that take it in its disk cache.
"""

from enum import IntEnum
from functools import cache
from typing import Any

import numpy as np

BIG_END = 0
SMALL_END = 1


class Scene(IntEnum):
    """Which joints have clearance: physics/README.md, Clearance configurations."""

    IDEAL = 0
    BIG_END = 1
    SMALL_END = 2
    BOTH = 3


class Load(IntEnum):
    """What presses on the piston (physics/README.md, Loads)."""

    NONE = 0
    GAS = 1
    SPRING = 2
    CYLINDER = 3
    CARD = 4


# unknowns integrated in each scene: eccentricities
FREEDOMS = {Scene.IDEAL: 0, Scene.BIG_END: 2, Scene.SMALL_END: 2, Scene.BOTH: 4}
# what contacts carry with them behind coordinates and rates, where a record's laws are chosen ones
CARRIED = (
    "approach speed at the big end, m/s", "approach speed at the small end, m/s",
    "bristles at the big end, m", "bristles at the small end, m",
)  # fmt: skip


class Coordinate(IntEnum):
    """Coordinates; a feature that a case does not name leaves out its own.

    Scenes have the joints' alone. An ideal joint has no eccentricity, an ideal guide neither height
    nor tilt, a rigid rod no deflection, a steady crank no angle of its own.
    """

    CRANK = 0
    BIG_X = 1  # eccentricities: journal centre less bore centre, m
    BIG_Y = 2
    SMALL_X = 3
    SMALL_Y = 4
    GUIDE = 5  # height of the crosshead's pin, m
    TILT = 6  # of the crosshead, counter-clockwise, rad
    BEND_1 = 7  # the rod's bending modes: half a wave, a whole one, m
    BEND_2 = 8
    STRETCH_MIDDLE = 9  # along the rod, of its middle and of its small end, m
    STRETCH = 10


COORDINATE_NAMES = {
    Coordinate.BIG_X: ("big end eccentricity x", "m"),
    Coordinate.BIG_Y: ("big end eccentricity y", "m"),
    Coordinate.SMALL_X: ("small end eccentricity x", "m"),
    Coordinate.SMALL_Y: ("small end eccentricity y", "m"),
    Coordinate.GUIDE: ("height in the guide", "m"),
    Coordinate.TILT: ("tilt in the guide", "rad"),
    Coordinate.BEND_1: ("rod's first bending mode", "m"),
    Coordinate.BEND_2: ("rod's second bending mode", "m"),
    Coordinate.STRETCH_MIDDLE: ("rod's stretch to its middle", "m"),
    Coordinate.STRETCH: ("rod's stretch", "m"),
}
# of a crank whose speed gives way: behind a steady one's time, and speed over the steady one's
CRANK = ("crank's lag, s", "crank's slip")
ROD_LOSS = ("energy lost in the rod, J",)

FIELDS: list[tuple] = [
    ("scene", "i8"),
    ("load", "i8"),
    ("law", "i8"),  # of contact_laws
    ("friction", "i8"),
    ("freedoms", "i8"),  # positions in a state; two in the ideal scene, zeros
    # mechanism
    ("omega", "f8"),  # crank speed, rad/s
    ("crank_radius", "f8"),  # R, m
    ("rod_length", "f8"),  # L, m
    ("rod_mass", "f8"),  # kg
    ("rod_centre", "f8"),  # a: from the big end to the mass centre, m
    ("rod_inertia", "f8"),  # about the mass centre, kg m^2
    ("reciprocating_mass", "f8"),  # crosshead, piston rod and piston, kg
    ("gravity", "f8"),  # along -y, m/s^2
    # of the crank, less its counterweight: mass times its centre's distance towards the pin, kg m
    ("unbalance", "f8"),
    # contact, per joint: big end, small end
    ("pin_radius", "f8", (2,)),  # journal radius R_j, m
    ("clearance", "f8", (2,)),  # radial, m; 0 for an ideal joint
    ("stiffness", "f8", (2,)),  # K, N/m^p
    ("exponent", "f8"),  # p
    ("damping", "f8"),  # C_max, N s/m
    ("full_damping", "f8"),  # d_max, m
    # friction: ADAMS's four numbers
    ("static", "f8"),
    ("dynamic", "f8"),
    ("stiction_velocity", "f8"),  # m/s
    ("friction_velocity", "f8"),  # m/s
    # load
    ("corners", "f8", (3,)),  # crank angles at which phases 1, 2, 3 begin, rad
    ("suction_force", "f8"),  # p_s A, N
    ("discharge_force", "f8"),  # p_d A, N
    ("back_force", "f8"),  # on the piston's other face, N
    ("head_clearance", "f8"),  # s0, m
    ("gas_exponent", "f8"),
    ("spring_stiffness", "f8"),  # N/m
    ("spring_damping", "f8"),  # N s/m
    ("preload", "f8"),  # N
    ("spring_stroke", "f8"),  # piston travel of each dwell of the follower, m
    # what `derive` makes of these: a division takes as long as ten products
    ("crank_ratio", "f8"),  # R / L
    ("per_rod_length", "f8"),  # 1/m
    ("per_rod_mass", "f8"),  # 1/kg
    ("per_rod_inertia", "f8"),  # 1/(kg m^2)
    ("per_reciprocating_mass", "f8"),  # 1/kg
    ("per_full_damping", "f8"),  # 1 / d_max, 1/m
    ("per_stiction", "f8"),  # of friction's first rise, from -v_s to v_s, s/m
    ("per_transition", "f8"),  # of its fall, from v_s to v_d, s/m
    # laws other than the default ones
    ("carries", "i8"),  # whether contacts carry numbers of their own: `CARRIED`
    ("hysteresis", "f8"),  # chi: damping force over elastic force at the approach speed
    ("least_approach", "f8"),  # approach speed below which chi is no longer divided by it, m/s
    ("bristle_stiffness", "f8"),  # LuGre's sigma_0 over the normal force, 1/m
    ("bristle_damping", "f8"),  # sigma_1, s/m
    ("viscous", "f8"),  # sigma_2, s/m
    # the crank end of a cylinder; an end without a cycle has one force, at suction as at discharge
    ("crank_suction_force", "f8"),  # N
    ("crank_discharge_force", "f8"),  # N
    ("crank_clearance", "f8"),  # m
    ("crank_corners", "f8", (2,)),  # angles at which its discharge and its suction begin, rad
]
FILM_TERMS = 10  # of each polynomial of a film
# of joints that are lubricated
FILM: list[tuple] = [
    ("viscosity", "f8"),  # of the oil, Pa s; 0 of dry joints
    ("film_length", "f8", (2,)),  # of each joint's bearing, m
    ("film_share", "f8"),  # of the clearance: the film's last, in which it gets no thinner
    ("film_constants", "f8", (2, FILM_TERMS, 4)),  # of each joint, `film.short_bearing_shares`
    ("film_stiffest", "f8", (2,)),  # of each joint: the squeeze's number at the wall
]
CARD_NODES = 1440  # a revolution
# of gas that was measured
CARD: list[tuple] = [
    ("card", "f8", (CARD_NODES, 2))  # force (N) over the crank's angle, and its slope a node
]
# of a mechanism with more freedom than ideal guides, a steady crank and a rigid rod leave it
FEATURES: list[tuple] = [
    ("rubbing", "i8"),  # whether ideal joints have friction
    ("driven", "i8"),  # whether the crank's speed gives way
    ("tilting", "i8"),  # whether the crosshead has clearance in its guide
    ("elastic", "i8"),  # whether the rod is
    ("at", "i8", (len(Coordinate),)),  # place of each coordinate in a state; -1 of none
    ("degrees", "i8"),  # of freedom: how many coordinates move
    ("coordinates", "i8", (len(Coordinate),)),  # these
    ("crank_inertia", "f8"),  # about the crank's axis, with the flywheel, kg m^2
    ("torque", "f8"),  # of the motor at the speed omega, N m
    ("torque_slope", "f8"),  # by which it grows as the speed falls, N m s
    ("guide_clearance", "f8"),  # of each side, m
    ("guide_length", "f8"),  # half the crosshead's, m
    ("guide_height", "f8"),  # half the crosshead's, m
    ("guide_stiffness", "f8"),  # of a corner on the guide, N/m^p
    ("guide_exponent", "f8"),  # p
    ("guide_damping", "f8"),  # C_max of ADAMS's IMPACT, N s/m
    ("per_guide_full_damping", "f8"),  # 1 / d_max, 1/m
    ("guide_friction", "f8"),  # coefficient
    ("guide_stiction", "f8"),  # m/s
    ("crosshead_inertia", "f8"),  # about the pin, kg m^2
    ("axial_stiffness", "f8"),  # of the rod: E A / L, N/m
    ("bending_stiffness", "f8"),  # E I / L^3, N/m
    ("rod_damping", "f8"),  # of the rod's material, over its stiffness, s
    ("rod_loss", "i8"),  # place in a state of what that has taken; -1 of a rigid rod
]
_EACH = (len(Coordinate),)  # the bodies have as many rows
# What `mechanism.solve` writes, so that no evaluation asks for memory. Two threads must not
# share such a record, and what was found at one instant goes as the next is solved.
SCRATCH: list[tuple] = [
    ("w", "f8", _EACH),  # coordinates
    ("rates", "f8", _EACH),
    ("accelerations", "f8", _EACH),  # of the coordinates
    ("velocity", "f8", _EACH),  # of the bodies: rows of `mechanism.BodyRow`
    ("bias", "f8", _EACH),  # accelerations of the bodies where the coordinates' own are zero
    ("body", "f8", _EACH),  # accelerations of the bodies
    ("mass", "f8", (8, 8)),  # the rod's, in its rows and columns of the bodies
    ("own", "f8", _EACH),  # forces of the rod's motion and weight
    ("steady", "f8", _EACH),  # forces on the bodies but friction of what is ideal
    ("force", "f8", _EACH),  # with it
    *((name, "f8", _EACH) for name in ("unit", "column", "momentum", "pushed", "solution")),
    ("matrix", "f8", 2 * _EACH),  # mass, of the coordinates that move
]
# Three kinds of records, told by fields that only some have: compiled functions for the default one
# hold nothing of the others (`_jit.dispatch_on_record`). What a kind adds stands before the rest:
# to numba, a record with fields behind another's is one of those.
CHOSEN_FORCES, MECHANISM = "viscosity", "driven"
RECORD = np.dtype(FIELDS, align=True)
CHOSEN = np.dtype([*FILM, *CARD, *FIELDS], align=True)
FEATURED = np.dtype([*FEATURES, *SCRATCH, *FILM, *CARD, *FIELDS], align=True)


def zero(kind: np.dtype) -> np.record:
    """Return a record of a kind, of zeros, that compiled functions may write."""
    return np.zeros(1, record_type(kind))[0]


@cache
def record_type(kind: np.dtype) -> np.dtype:
    """Return a kind's type, one object: numba compares a type that is new to it field by field."""
    return np.dtype((np.record, kind))


def new_record(
    chosen: bool = False, featured: bool = False, values: dict[str, Any] | None = None
) -> np.record:
    """Return a record of these values: for any forces (chosen), or for a mechanism (featured)."""
    kind = FEATURED if featured else CHOSEN if chosen else RECORD
    if values is None:
        return zero(kind)
    # all fields at once: to set them one by one takes four times as long
    fields = dict.fromkeys(kind.names or (), 0.0) | values
    return np.array([tuple(fields.values())], record_type(kind))[0]


def read_fields(p: np.record) -> dict[str, Any]:
    """Return the fields of a record by name; to read them one by one takes ten times as long."""
    return dict(zip(p.dtype.names or (), p.item(), strict=True))


Fields = np.record | dict[str, Any]  # a record, or its `read_fields`


def is_featured(p: Fields) -> bool:
    """Return whether a record is that of a mechanism with features."""
    return has_field(p, MECHANISM)


def has_chosen_forces(p: Fields) -> bool:
    """Return whether a record is one for forces but the default ones: other laws, oil, a card."""
    return has_field(p, CHOSEN_FORCES)


def has_feature(p: Fields, name: str) -> bool:
    """Return whether a record is that of a mechanism with a feature, by its field."""
    return is_featured(p) and bool(p[name])


def has_field(p: Fields, name: str) -> bool:
    """Return whether a record has a field."""
    return name in (p if isinstance(p, dict) else p.dtype.names or ())


def find_coordinates(p: Fields) -> list[Coordinate]:
    """Return the coordinates, but the crank's, of a record's clearances and features."""
    coordinates = []
    if p["clearance"][BIG_END] > 0.0:
        coordinates += [Coordinate.BIG_X, Coordinate.BIG_Y]
    if p["clearance"][SMALL_END] > 0.0:
        coordinates += [Coordinate.SMALL_X, Coordinate.SMALL_Y]
    if has_feature(p, "tilting"):
        coordinates += [Coordinate.GUIDE, Coordinate.TILT]
    if has_feature(p, "elastic"):
        coordinates += [Coordinate.BEND_1, Coordinate.BEND_2, Coordinate.STRETCH_MIDDLE]
        coordinates += [Coordinate.STRETCH]
    return coordinates


def place_coordinates(p: np.record) -> None:
    """Give each coordinate of a mechanism its place in a state; the crank's is its speed's."""
    positions = find_coordinates(p)
    at = [positions.index(c) if c in positions else -1 for c in Coordinate]
    if p["driven"]:
        at[Coordinate.CRANK] = 2 * len(positions) + len(carried_names(p)) + 1
    p["at"], p["freedoms"] = at, len(positions)
    behind = 2 * len(positions) + len(carried_names(p)) + (len(CRANK) if p["driven"] else 0)
    p["rod_loss"] = behind if p["elastic"] else -1
    moving = [c for c in Coordinate if at[c] >= 0]
    p["degrees"], p["coordinates"] = len(moving), moving + [-1] * (len(at) - len(moving))


def state_names(p: Fields) -> tuple[str, ...]:
    """Return the names of the numbers of a record's state, each with its unit."""
    positions = find_coordinates(p)
    coordinates = [COORDINATE_NAMES[c] for c in positions]
    names = tuple(f"{name}, {unit}" for name, unit in coordinates)
    names += tuple(f"rate of {name}, {unit}/s" for name, unit in coordinates)
    names += carried_names(p)
    driven = has_feature(p, "driven")
    names += (CRANK if driven else ()) + (ROD_LOSS if has_feature(p, "elastic") else ())
    return names if positions or driven else ()


def carried_names(p: Fields) -> tuple[str, ...]:
    """Return the names of what contacts carry, by laws that remember an impact or bend bristles."""
    return CARRIED if p["carries"] else ()


def derive(p: np.record) -> None:
    """Fill the fields of a record that follow from its others."""
    p["freedoms"] = FREEDOMS[Scene(int(p["scene"]))] or 2
    if is_featured(p):
        place_coordinates(p)
    p["crank_ratio"] = p["crank_radius"] / p["rod_length"]
    for name in ("rod_length", "rod_mass", "rod_inertia", "reciprocating_mass", "full_damping"):
        p[f"per_{name}"] = 1.0 / p[name]
    if p["friction"]:
        p["per_stiction"] = 1.0 / (2.0 * p["stiction_velocity"])
        if p["friction_velocity"] > p["stiction_velocity"]:  # else no law reads it
            p["per_transition"] = 1.0 / (p["friction_velocity"] - p["stiction_velocity"])

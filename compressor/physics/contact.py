"""Contact at a clearance joint: normal force, friction laws, and the point where bodies meet.

physics/README.md, Contact and Friction (Eq. 14-16).

Friction laws: the friction coefficient by the slip, and what a contact's bristles do. A law is a
member of `FrictionLaw`, named by `friction.law` in small letters, and a branch of
`chosen_coefficient` (physics/README.md, Friction). ADAMS's is the default, for which nothing is
compared; the others are no part of its machine code, or it would take half as long again to make.
"""

import math
from enum import IntEnum
from typing import NamedTuple

from compressor.physics._jit import dispatch_on_record, inline_llvm, inline_once, square_root
from compressor.physics.contact_laws import (
    HYSTERESIS,
    Law,
    elastic_force,
    has_chosen_laws,
    in_contact,
    normal_force,
    rise,
)
from compressor.physics.record import CHOSEN_FORCES

SATURATED = 1.0 - math.exp(-3.0)  # Threlfall's curve at its knee


class FrictionLaw(IntEnum):
    """The friction laws; NONE where a case has no friction."""

    NONE = 0
    ADAMS = 1  # a smoothed Coulomb law that falls from a static to a dynamic coefficient
    COULOMB_TANH = 2
    THRELFALL = 3
    AMBROSIO = 4
    LUGRE = 5


COULOMB_TANH, THRELFALL = int(FrictionLaw.COULOMB_TANH), int(FrictionLaw.THRELFALL)
AMBROSIO, LUGRE = int(FrictionLaw.AMBROSIO), int(FrictionLaw.LUGRE)


@inline_llvm
def adams(slip, p):
    """Return ADAMS's law: a rise to `static` at the stiction velocity, then a fall to `dynamic`."""
    fall = rise((abs(slip) - p.stiction_velocity) * p.per_transition)
    size = (p.dynamic - p.static) * fall + p.static
    return (2.0 * rise((slip + p.stiction_velocity) * p.per_stiction) - 1.0) * size


@inline_llvm
def threlfall(slip, p):
    """Return Threlfall's law: an exponential rise (Mech. Mach. Theory 13, 1978)."""
    speed = min(1.0, abs(slip) / p.stiction_velocity)
    return math.copysign(p.dynamic * (1.0 - math.exp(-3.0 * speed)) / SATURATED, slip)


@inline_llvm
def ambrosio(slip, p):
    """Return Ambrosio's law: 0 up to the stiction velocity, then a line to the friction one."""
    share = (abs(slip) - p.stiction_velocity) * p.per_transition
    return math.copysign(p.dynamic * min(1.0, max(0.0, share)), slip)


@inline_llvm
def stribeck(slip, p):
    """Return LuGre's coefficient in steady sliding without its viscous part."""
    ratio = slip / p.stiction_velocity
    return (p.static - p.dynamic) * math.exp(-ratio * ratio) + p.dynamic


@inline_llvm
def bristle_rate(slip, bristle, p):
    """Return how fast LuGre's bristles bend (m/s), of a mean deflection (m).

    There are none at mu 0.
    """
    if p.static == 0.0 and p.dynamic == 0.0:
        return 0.0
    relaxation = p.bristle_stiffness * abs(slip) * bristle / stribeck(slip, p)
    return slip - relaxation


@inline_llvm
def lugre(slip, bristle, p):
    """Return LuGre's law (Canudas de Wit et al., IEEE Trans. Autom. Control 40, 1995)."""
    bending = p.bristle_damping * bristle_rate(slip, bristle, p)
    return p.bristle_stiffness * bristle + (p.viscous * slip + bending)


@inline_llvm
def chosen_coefficient(slip, bristle, p):
    """Return the coefficient by the law that a record has chosen."""
    if p.friction == COULOMB_TANH:
        return p.dynamic * math.tanh(slip / p.stiction_velocity)
    if p.friction == THRELFALL:
        return threlfall(slip, p)
    if p.friction == AMBROSIO:
        return ambrosio(slip, p)
    if p.friction == LUGRE:
        return lugre(slip, bristle, p)
    return adams(slip, p)


@inline_llvm
def default_coefficient(slip, bristle, p):
    """Return `chosen_coefficient` where no law has been chosen: by ADAMS's."""
    return adams(slip, p)


# signed, at a slip (m/s) and a mean deflection of bristles (m)
friction_coefficient = dispatch_on_record(CHOSEN_FORCES, chosen_coefficient, default_coefficient)


def steepest(p) -> float:
    """Return the greatest change of a record's friction coefficient with the slip (s/m).

    It holds explicit steps back: times the normal force over the mass, it is friction's rate (1/s).
    """
    law, rise_over = p["friction"], p["stiction_velocity"].item()
    if law == FrictionLaw.ADAMS:
        return 1.5 * p["static"].item() / rise_over
    if law == FrictionLaw.THRELFALL:
        return 3.0 / SATURATED * p["dynamic"].item() / rise_over
    if law == FrictionLaw.AMBROSIO:
        return p["dynamic"].item() * p["per_transition"].item()
    if law == FrictionLaw.LUGRE:
        return (p["bristle_damping"] + p["viscous"]).item()
    return p["dynamic"].item() / rise_over


def choose_laws(p, contact: str, restitution: float, friction: str) -> None:
    """Set a record's contact and friction laws by their names, and chi by the restitution.

    p: a record, or a dict that one is filled from; contact, friction: names of `Law` and of
    `FrictionLaw` in small letters. Raises KeyError where there is no law of a name.
    """
    law = Law[contact.upper()]
    p["law"], p["friction"] = law, FrictionLaw[friction.upper()]
    p["hysteresis"] = hysteresis(contact, restitution) if law in HYSTERESIS else 0.0
    p["carries"] = int(p["hysteresis"] != 0.0 or p["friction"] == FrictionLaw.LUGRE)


def hysteresis(contact: str, restitution: float) -> float:
    """Return chi, the damping force over the elastic one at the approach speed, by a law's name.

    restitution: e; the formulas and their papers stand in `contact_laws.HYSTERESIS`. Raises
    KeyError for a law that has none.
    """
    return HYSTERESIS[Law[contact.upper()]](restitution)


@inline_once
def carried_numbers(joint, y, p):
    """Return a joint's numbers among what contacts carry in the state: 1 and 0 where nothing does.

    The speed (m/s) at which the bodies met, and the mean deflection (m) of the bristles.
    """
    if has_chosen_laws(p) and p.carries:
        return y[2 * p.freedoms + joint], y[2 * p.freedoms + 2 + joint]
    return 1.0, 0.0


class ContactState(NamedTuple):
    """One joint's contact: SI, forces on the rod."""

    fx: float
    fy: float
    moment: float  # on the rod about the bore's centre
    normal: float  # F_N
    friction: float  # F_t
    penetration: float  # delta; negative: a gap
    rate: float  # of the penetration
    slip: float  # v_t
    elastic: float  # part of it without damping
    unclamped: float  # normal force before the clamp at zero
    # of an oil film, whose force and moment on the rod are in those above
    film_moment: float  # on the journal, N m
    film_loss: float  # power that it takes, W


NO_CONTACT = ContactState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inline_llvm
def joint_contact(eccentricity, spins, bearing, carried, p):
    """Return the contact between a joint's journal and the rod's bore.

    eccentricity: journal centre minus bore centre, x and y (m), and its rate (m/s); spins of
    journal and rod (rad/s, counter-clockwise); bearing: the joint's journal radius (m), clearance
    (m) and stiffness (N/m^p); carried: as by `carried_numbers`. Returns a `ContactState`; one
    contact point serves both bodies, so that angular momentum balances. Concentric circles exert
    no force.
    """
    ex, ey, ex_rate, ey_rate = eccentricity
    pin, clearance, stiffness = bearing
    distance = square_root(ex * ex + ey * ey)
    penetration = distance - clearance
    if distance == 0.0:
        slip = 0.0
        if has_chosen_laws(p):  # bristles, which bend by the slip, must not start with a jump
            slip = spins[0] * (pin - penetration) - spins[1] * (pin + clearance)
        return ContactState(0.0, 0.0, 0.0, 0.0, 0.0, penetration, 0.0, slip, 0.0, 0.0, 0.0, 0.0)
    per_distance = 1.0 / distance
    nx = ex * per_distance
    ny = ey * per_distance
    rate = ex_rate * nx + ey_rate * ny
    bore = pin + clearance
    arm = pin - penetration
    journal_spin, rod_spin = spins
    turning = journal_spin * arm - rod_spin * bore
    slip = ey_rate * nx + (turning - ex_rate * ny)
    approach, bristle = carried
    normal, elastic, unclamped = normal_force(penetration, rate, approach, stiffness, clearance, p)
    friction = 0.0
    if p.friction and in_contact(normal):
        friction = -friction_coefficient(slip, bristle, p) * normal
    fx = normal * nx + friction * ny
    fy = normal * ny - friction * nx
    moment = -bore * friction
    return ContactState(
        fx, fy, moment, normal, friction, penetration, rate, slip, elastic, unclamped, 0.0, 0.0
    )


@inline_llvm
def nearness(contact, stiffness, clearance, p):
    """Return how near a joint is to contact (m): positive in contact, else minus its distance.

    The distance is the gap, or the clamped force as a length: divided by the contact's stiffness at
    the penetration of full damping, so that both parts are small where contact is near.
    """
    if contact.penetration <= 0.0:
        return contact.penetration
    full = p.full_damping
    return contact.unclamped * full / elastic_force(full, stiffness, clearance, p)

"""Contact at a clearance joint: friction laws, the point where bodies meet, and the oil film.

physics/README.md, Contact and Friction (Eq. 14-16). A friction law is a member of `FrictionLaw`,
named by `friction.law` in small letters, and a branch of `friction_coefficient`. ADAMS's is the
default, for which nothing is compared, and no other is in the machine code.
"""

import math
from enum import IntEnum
from typing import NamedTuple

from compressor.physics._jit import dispatch_on_record, inline_llvm, square_root
from compressor.physics.contact_laws import (
    HYSTERESIS,
    Law,
    elastic_force,
    has_chosen_laws,
    in_contact,
    normal_force,
    rise,
)
from compressor.physics.film import film
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
    """Return how fast LuGre's bristles bend (m/s) at a mean deflection (m); 0 without friction."""
    if p.static == 0.0 and p.dynamic == 0.0:
        return 0.0
    return slip - p.bristle_stiffness * abs(slip) * bristle / stribeck(slip, p)


@inline_llvm
def lugre(slip, bristle, p):
    """Return LuGre's law (Canudas de Wit et al., IEEE Trans. Autom. Control 40, 1995)."""
    bending = p.bristle_damping * bristle_rate(slip, bristle, p)
    return p.bristle_stiffness * bristle + (p.viscous * slip + bending)


@inline_llvm
def friction_coefficient(slip, bristle, p):
    """Return the signed coefficient at a slip (m/s) and a mean deflection of bristles (m)."""
    if has_chosen_laws(p):
        if p.friction == COULOMB_TANH:
            return p.dynamic * math.tanh(slip / p.stiction_velocity)
        if p.friction == THRELFALL:
            return threlfall(slip, p)
        if p.friction == AMBROSIO:
            return ambrosio(slip, p)
        if p.friction == LUGRE:
            return lugre(slip, bristle, p)
    return adams(slip, p)


def choose_laws(p, contact: str, restitution: float, friction: str) -> None:
    """Set the laws of a record, or of a dict for one, by their names in small letters; chi by e."""
    law = Law[contact.upper()]
    p["law"], p["friction"] = law, FrictionLaw[friction.upper()]
    p["hysteresis"] = HYSTERESIS[law](restitution) if law in HYSTERESIS else 0.0
    p["carries"] = int(p["hysteresis"] != 0.0 or p["friction"] == FrictionLaw.LUGRE)


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
    unclamped: float  # normal force before the clamp at zero
    # of an oil film, whose force and moment on the rod are in those above
    film_moment: float  # on the journal, N m
    film_loss: float  # power that it takes, W


NO_CONTACT = ContactState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inline_llvm
def with_film(joint, contact, eccentricity, spins, p):
    """Return a joint's `ContactState` with the force, the moments and the loss of its film."""
    if p.viscosity == 0.0:
        return contact
    fx, fy, journal, bore, lost = film(joint, eccentricity, spins, p)
    return ContactState(
        contact.fx - fx, contact.fy - fy, contact.moment + bore, contact.normal, contact.friction,
        contact.penetration, contact.rate, contact.slip, contact.unclamped, journal, lost,
    )  # fmt: skip


@inline_llvm
def without_film(joint, contact, eccentricity, spins, p):
    """Return the contact: records of the default forces have no oil."""
    return contact


add_film = dispatch_on_record(CHOSEN_FORCES, with_film, without_film)


@inline_llvm
def joint_contact(joint, eccentricity, spins, y, p):
    """Return the `ContactState` between a joint's journal and the rod's bore, with its film.

    eccentricity: journal centre minus bore centre, x and y (m), and its rate (m/s); spins: of
    journal and rod (rad/s, counter-clockwise); y: the state, which holds what contacts carry. One
    contact point serves both bodies, so that angular momentum balances. Concentric circles exert
    no force.
    """
    ex, ey, ex_rate, ey_rate = eccentricity
    pin, clearance, stiffness = p.pin_radius[joint], p.clearance[joint], p.stiffness[joint]
    approach, bristle = 1.0, 0.0  # at which the bodies met (m/s), mean deflection (m)
    if has_chosen_laws(p) and p.carries:
        approach, bristle = y[2 * p.freedoms + joint], y[2 * p.freedoms + 2 + joint]
    distance = square_root(ex * ex + ey * ey)
    penetration, bore = distance - clearance, pin + clearance
    turning = spins[0] * (pin - penetration) - spins[1] * bore
    fx, fy, moment, normal, friction, rate, unclamped = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    # bristles, which bend by the slip, must not start with a jump
    slip = turning if has_chosen_laws(p) else 0.0
    if distance != 0.0:
        per_distance = 1.0 / distance
        nx, ny = ex * per_distance, ey * per_distance
        rate = ex_rate * nx + ey_rate * ny
        slip = ey_rate * nx + (turning - ex_rate * ny)
        normal, unclamped = normal_force(penetration, rate, approach, stiffness, clearance, p)
        if p.friction and in_contact(normal):
            friction = -friction_coefficient(slip, bristle, p) * normal
        fx = normal * nx + friction * ny
        fy = normal * ny - friction * nx
        moment = -bore * friction
    contact = ContactState(
        fx, fy, moment, normal, friction, penetration, rate, slip, unclamped, 0.0, 0.0
    )
    return add_film(joint, contact, eccentricity, spins, p)


@inline_llvm
def nearness(contact, stiffness, clearance, p):
    """Return how near a joint is to contact (m): positive in contact, else minus its distance.

    That is the gap, or the clamped force over the stiffness at the penetration of full damping.
    """
    if contact.penetration <= 0.0:
        return contact.penetration
    full = p.full_damping
    return contact.unclamped * full / elastic_force(full, stiffness, clearance, p)


@inline_llvm
def write_carried_rates(big, small, pace, y, p, out):
    """Write the rates of what contacts carry: an approach speed stays until the bodies meet again.

    Bristles bend while the bodies slide, also where they do not touch. pace: of the time.
    """
    place = 2 * p.freedoms
    out[place], out[place + 1], out[place + 2], out[place + 3] = 0.0, 0.0, 0.0, 0.0
    if p.friction == LUGRE and p.clearance[0] > 0.0:
        out[place + 2] = bristle_rate(big.slip, y[place + 2], p) * pace
    if p.friction == LUGRE and p.clearance[1] > 0.0:
        out[place + 3] = bristle_rate(small.slip, y[place + 3], p) * pace

"""Contact at a clearance joint: normal force, friction and the point at which both bodies meet.

physics/README.md, Contact and Friction (Eq. 14-16).
"""

from typing import NamedTuple

from compressor.physics._jit import fused, inlined, merged, square_root
from compressor.physics.contact_laws import (
    HYSTERESIS,
    Law,
    elastic_force,
    has_chosen_laws,
    in_contact,
    normal_force,
)
from compressor.physics.friction_laws import FrictionLaw, friction_coefficient


def choose_laws(p, contact: str, restitution: float, friction: str) -> None:
    """Set a record's laws by their names, and what the coefficient of restitution makes.

    Raises KeyError where there is no law of a name.
    """
    law = Law[contact.upper()]
    p["law"], p["friction"] = law, FrictionLaw[friction.upper()]
    if law in HYSTERESIS:
        p["hysteresis"] = hysteresis(contact, restitution)


def hysteresis(contact: str, restitution: float) -> float:
    """Return chi, the damping force over the elastic one at the approach speed, by a law's name.

    Raises KeyError for a law that has none.
    """
    return HYSTERESIS[Law[contact.upper()]](restitution)


@merged
def carried_by(joint, y, p):
    """Return what a joint's contact carries in the state: the speed (m/s) at which the bodies met,
    and the mean deflection (m) of the bristles. Nothing with the default laws.
    """
    if has_chosen_laws(p):
        return y[2 * p.freedoms + joint], y[2 * p.freedoms + 2 + joint]
    return 0.0, 0.0


class Contact(NamedTuple):
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


NO_CONTACT = Contact(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined
def joint_contact(eccentricity, spins, bearing, carried, p):
    """Return the contact between a joint's journal and the rod's bore.

    eccentricity: journal centre minus bore centre, x and y (m), and its rate (m/s); spins of
    journal and rod (rad/s, counter-clockwise); bearing: the joint's journal radius (m), clearance
    (m) and stiffness (N/m^p); carried: as by `carried_by`. Returns a `Contact`; one contact point
    serves both bodies, so that angular momentum balances. Concentric circles exert no force.
    """
    ex, ey, ex_rate, ey_rate = eccentricity
    pin, clearance, stiffness = bearing
    distance = square_root(fused(ex, ex, ey * ey))
    penetration = distance - clearance
    if distance == 0.0:
        return Contact(0.0, 0.0, 0.0, 0.0, 0.0, penetration, 0.0, 0.0, 0.0, 0.0)
    per_distance = 1.0 / distance
    nx = ex * per_distance
    ny = ey * per_distance
    rate = fused(ex_rate, nx, ey_rate * ny)
    bore = pin + clearance
    arm = pin - penetration
    journal_spin, rod_spin = spins
    turning = fused(journal_spin, arm, -(rod_spin * bore))
    slip = fused(ey_rate, nx, fused(-ex_rate, ny, turning))
    approach, bristle = carried
    normal, elastic, unclamped = normal_force(penetration, rate, approach, stiffness, clearance, p)
    friction = 0.0
    if p.friction and in_contact(normal):
        friction = -friction_coefficient(slip, bristle, p) * normal
    fx = fused(normal, nx, friction * ny)
    fy = fused(normal, ny, -(friction * nx))
    moment = -bore * friction
    return Contact(fx, fy, moment, normal, friction, penetration, rate, slip, elastic, unclamped)


@merged
def nearness(contact, stiffness, clearance, p):
    """Return the positive in contact; otherwise how far from it: the gap (m), or the clamped force
    as one.

    A clamped force is turned into a length by the contact's stiffness at the penetration of full
    damping, so that both parts are small where contact is near.
    """
    if contact.penetration <= 0.0:
        return contact.penetration
    full = p.full_damping
    return contact.unclamped * full / elastic_force(full, stiffness, clearance, p)

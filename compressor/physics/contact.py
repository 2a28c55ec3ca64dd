"""Contact at a clearance joint: ADAMS's IMPACT, STEP and friction (Eq. 14-16, DESIGN 2.3)."""

import math
from typing import NamedTuple

from compressor.physics._jit import inlined, jit


@jit
def rise(s):
    """ADAMS's STEP from 0 at s = 0 to 1 at s = 1: a cubic, constant outside."""
    if s <= 0.0:
        return 0.0
    if s >= 1.0:
        return 1.0
    return s * s * (3.0 - 2.0 * s)


@jit
def friction_coefficient(slip, p):
    """Signed friction coefficient mu(v_t), odd in the slip (m/s): ADAMS's smoothed Coulomb law.

    Rises from 0 to `static` over the stiction velocity, falls to `dynamic` at the friction one.
    """
    fall = rise((abs(slip) - p.stiction_velocity) * p.per_transition)
    size = p.static + (p.dynamic - p.static) * fall
    return (2.0 * rise((slip + p.stiction_velocity) * p.per_stiction) - 1.0) * size


@jit
def power(base, exponent):
    """base ** exponent for base >= 0; a square root does for Hertz's 1.5."""
    if exponent == 1.5:
        return base * math.sqrt(base)
    return base**exponent


@jit
def impact(penetration, rate, stiffness, p):
    """ADAMS's IMPACT at a penetration (m) and its rate (m/s): F_N, elastic part, unclamped (N).

    Elastic: K delta^p; unclamped: with STEP(delta; 0, 0; d_max, C_max) delta' added; F_N is that,
    but never pulling. All are 0 unless the penetration is positive.
    """
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    elastic = stiffness * power(penetration, p.exponent)
    unclamped = elastic + p.damping * rise(penetration * p.per_full_damping) * rate
    return max(0.0, unclamped), elastic, unclamped


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
    elastic: float  # K delta^p
    unclamped: float  # normal force before the clamp at zero


@inlined
def joint_contact(joint, ex, ey, ex_rate, ey_rate, journal_spin, rod_spin, p):
    """Contact between a joint's journal and the rod's bore.

    Takes the eccentricity (journal centre minus bore centre, m), its rate (m/s) and both spins
    (rad/s, counter-clockwise). Returns a `Contact`; one contact point serves both bodies, so that
    angular momentum balances (DESIGN 2.3). Concentric circles exert no force.
    """
    clearance = p.clearance[joint]
    distance = math.sqrt(ex * ex + ey * ey)
    penetration = distance - clearance
    if distance == 0.0:
        return Contact(0.0, 0.0, 0.0, 0.0, 0.0, penetration, 0.0, 0.0, 0.0, 0.0)
    per_distance = 1.0 / distance
    nx = ex * per_distance
    ny = ey * per_distance
    rate = ex_rate * nx + ey_rate * ny
    bore = p.pin_radius + clearance
    arm = p.pin_radius - penetration
    slip = ey_rate * nx - ex_rate * ny + journal_spin * arm - rod_spin * bore
    normal, elastic, unclamped = impact(penetration, rate, p.stiffness[joint], p)
    friction = 0.0
    if p.friction and normal > 0.0:
        friction = -friction_coefficient(slip, p) * normal
    fx = normal * nx + friction * ny
    fy = normal * ny - friction * nx
    moment = -bore * friction
    return Contact(fx, fy, moment, normal, friction, penetration, rate, slip, elastic, unclamped)


@jit
def nearness(contact, stiffness, p):
    """Positive in contact; otherwise how far from it: the gap (m), or the clamped force as one.

    A clamped force is turned into a length by the contact's stiffness at the penetration of full
    damping, so that both parts are small where contact is near.
    """
    if contact.penetration <= 0.0:
        return contact.penetration
    full = p.full_damping
    return contact.unclamped * full / (stiffness * power(full, p.exponent))

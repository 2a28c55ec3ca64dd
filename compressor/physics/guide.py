"""The crosshead's guide: friction of an ideal one, contact of the four corners in one with play.

The crosshead is a block about its pin, `guide_length` to either side along x and `guide_height`
along y. Each corner meets the plane of its side by ADAMS's IMPACT or, where the joints' law damps
by a coefficient of restitution, by chi times the elastic force over the speed at which they met. A
corner carries no such speed in the state: it follows from depth and rate (`approach_speed`).
"""

import math
from typing import NamedTuple

from compressor.physics._jit import fused, jit
from compressor.physics.contact_laws import power, rise

ROUNDS, AGREED = 30, 1e-14  # of Newton's method for the approach speed
ELASTIC = 1e-3  # chi below which damping is too weak to change the approach speed


class Guided(NamedTuple):
    """What the guide does to the crosshead: forces (N), moment about the pin (N m), and energy."""

    fx: float
    fy: float
    moment: float
    stored: float  # J
    damped: float  # W, lost in the normal direction
    rubbed: float  # W, lost to friction
    deepest: float  # greatest penetration of a corner (m), negative: the least gap


UNGUIDED = Guided(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@jit
def guide_coefficient(slip, p):
    """Return the friction coefficient of the guide at a slip (m/s): mu tanh(v / v_s)."""
    return p.guide_friction * math.tanh(slip / p.guide_stiction) if p.guide_friction else 0.0


@jit
def spent(u, chi):
    """Return the integral of u / (1 + chi u) from 0 to u: what damping has taken of a strike's
    motion.
    """
    return (u - math.log(1.0 + chi * u) / chi) / chi


@jit
def approach_speed(rate, stored, mass, chi):
    """Return the speed (m/s) at which a mass (kg) that strikes freely has met, by depth's rate and
    energy (J).

    From m delta'' = -F_e (1 + chi delta' / v) with the elastic energy E: u du / (1 + chi u) from
    delta' / v to 1 is E / (m v^2). So a free strike has the restitution of the joints' law, and no
    state holds its beginning.
    """
    speed = math.sqrt(rate * rate + 2.0 * stored / mass)
    if chi < ELASTIC:
        return speed
    whole, least = spent(1.0, chi), max(rate, -chi * rate)  # where the strike has its end
    speed = max(speed, 2.0 * least)
    for _ in range(ROUNDS):
        u = rate / speed
        left = whole - spent(u, chi)
        change = speed * speed * left - stored / mass
        change /= speed * (2.0 * left + u * u / (1.0 + chi * u))
        if abs(change) <= AGREED * speed:
            break
        lower = speed - change
        speed = lower if lower > least else 0.5 * (speed + least)
    return speed


@jit
def corner_force(penetration, rate, lever, p):
    """Return the normal force (N) of a corner and its elastic part, at a penetration (m) and its
    rate (m/s).

    lever: of the force about the pin (m), by which the crosshead weighs less there than as a whole.
    """
    if penetration <= 0.0:
        return 0.0, 0.0
    elastic = p.guide_stiffness * power(penetration, p.guide_exponent)
    if p.guide_restituting:
        mass = 1.0 / (1.0 / p.reciprocating_mass + lever * lever / p.crosshead_inertia)
        stored = elastic * penetration / (p.guide_exponent + 1.0)
        speed = max(approach_speed(rate, stored, mass, p.guide_hysteresis), p.least_approach)
        damping = elastic * p.guide_hysteresis / speed
    else:
        damping = p.guide_damping * rise(penetration * p.per_guide_full_damping)
    return max(0.0, fused(damping, rate, elastic)), elastic


@jit
def corner_depth(height, tilt, end, side, p):
    """Return the penetration (m) of a corner: end and side, -1 or 1, along and across the guide."""
    half = math.sin(0.5 * tilt)
    depth = side * (height + end * p.guide_length * math.sin(tilt))
    return depth - (p.guide_clearance + p.guide_height * 2.0 * half * half)


@jit
def corners(height, tilt, rates, p):
    """Return `Guided` of a crosshead with play: height of its pin (m), tilt (rad), rates of x,
    y, tilt.
    """
    v, rise, spin = rates
    fx, fy, moment, stored, damped, rubbed = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    deepest = -math.inf
    sine, half = math.sin(tilt), math.sin(0.5 * tilt)
    drop = 2.0 * half * half  # 1 - cos(tilt)
    for end in (-1.0, 1.0):
        for side in (-1.0, 1.0):
            x = end * p.guide_length * (1.0 - drop) - side * p.guide_height * sine
            y = end * p.guide_length * sine + side * p.guide_height * (1.0 - drop)
            penetration = corner_depth(height, tilt, end, side, p)
            deepest = max(deepest, penetration)
            rate = side * (rise + spin * x)
            normal, elastic = corner_force(penetration, rate, x, p)
            if normal > 0.0:
                slip = v - spin * y
                friction = -guide_coefficient(slip, p) * normal
                fx += friction
                fy -= side * normal
                moment -= x * side * normal + y * friction
                rubbed -= friction * slip
            stored += elastic * penetration / (p.guide_exponent + 1.0)
            damped += (normal - elastic) * rate
    return Guided(fx, fy, moment, stored, damped, rubbed, deepest)

"""The crosshead's guide: friction of an ideal one, contact of the four corners in one with play.

The crosshead is a block about its pin, `guide_length` to either side along x and `guide_height`
along y. Each corner meets the plane of its side by ADAMS's IMPACT with the guide's stiffness and
the joints' damping, whatever the law of the joints: corners carry no speed of approach.
"""

import math
from typing import NamedTuple

from compressor.physics._jit import jit
from compressor.physics.contact_laws import impact


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
    """Friction coefficient of the guide at a slip (m/s): mu tanh(v / v_s)."""
    return p.guide_friction * math.tanh(slip / p.guide_stiction) if p.guide_friction else 0.0


@jit
def corners(height, tilt, rates, p):
    """`Guided` of a crosshead with play: height of its pin (m), tilt (rad), rates of x, y, tilt."""
    v, rise, spin = rates
    fx, fy, moment, stored, damped, rubbed = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    deepest = -math.inf
    sine, half = math.sin(tilt), math.sin(0.5 * tilt)
    drop = 2.0 * half * half  # 1 - cos(tilt)
    for end in (-1.0, 1.0):
        for side in (-1.0, 1.0):
            x = end * p.guide_length * (1.0 - drop) - side * p.guide_height * sine
            y = end * p.guide_length * sine + side * p.guide_height * (1.0 - drop)
            penetration = side * (height + end * p.guide_length * sine)
            penetration -= p.guide_clearance + p.guide_height * drop
            deepest = max(deepest, penetration)
            rate = side * (rise + spin * x)
            normal, elastic, _ = impact(penetration, rate, p.guide_stiffness, p)
            if normal > 0.0:
                slip = v - spin * y
                friction = -guide_coefficient(slip, p) * normal
                fx += friction
                fy -= side * normal
                moment -= x * side * normal + y * friction
                rubbed -= friction * slip
            stored += elastic * penetration / (p.exponent + 1.0)
            damped += (normal - elastic) * rate
    return Guided(fx, fy, moment, stored, damped, rubbed, deepest)

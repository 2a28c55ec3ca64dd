"""Friction laws: the friction coefficient by the slip, and what a contact's bristles do.

A law is a member of `FrictionLaw`, named by `friction.law` in small letters, and a branch of
`chosen_coefficient` (physics/README.md, Friction). ADAMS's is the default, for which nothing is
compared; the others are no part of its machine code, or it would take half as long again to make.
"""

import math
from enum import IntEnum

from compressor.physics._jit import fused, jit, merged
from compressor.physics.contact_laws import has_chosen_laws, rise

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


@merged
def adams(slip, p):
    """Return ADAMS's law: rises from 0 to `static` over the stiction velocity, falls to
    `dynamic`.
    """
    fall = rise((abs(slip) - p.stiction_velocity) * p.per_transition)
    size = fused(p.dynamic - p.static, fall, p.static)
    return (2.0 * rise((slip + p.stiction_velocity) * p.per_stiction) - 1.0) * size


@jit
def threlfall(slip, p):
    """Return Threlfall's law: an exponential rise (Mech. Mach. Theory 13, 1978)."""
    speed = min(1.0, abs(slip) / p.stiction_velocity)
    return math.copysign(p.dynamic * (1.0 - math.exp(-3.0 * speed)) / SATURATED, slip)


@jit
def ambrosio(slip, p):
    """Return Ambrosio's law: nothing below the stiction velocity, then a line up to the friction
    one.
    """
    share = (abs(slip) - p.stiction_velocity) * p.per_transition
    return math.copysign(p.dynamic * min(1.0, max(0.0, share)), slip)


@jit
def stribeck(slip, p):
    """Return LuGre's coefficient in steady sliding without its viscous part."""
    ratio = slip / p.stiction_velocity
    return fused(p.static - p.dynamic, math.exp(-ratio * ratio), p.dynamic)


@jit
def bristle_rate(slip, bristle, p):
    """Return how fast LuGre's bristles bend (m/s), of a mean deflection (m); there are none at
    mu 0.
    """
    if p.static == 0.0 and p.dynamic == 0.0:
        return 0.0
    held = p.bristle_stiffness * abs(slip) * bristle / stribeck(slip, p)
    return slip - held


@jit
def lugre(slip, bristle, p):
    """Return LuGre's law (Canudas de Wit et al., IEEE Trans. Autom. Control 40, 1995)."""
    bending = p.bristle_damping * bristle_rate(slip, bristle, p)
    return fused(p.bristle_stiffness, bristle, fused(p.viscous, slip, bending))


@jit
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


@merged
def friction_coefficient(slip, bristle, p):
    """Return signed friction coefficient of a slip (m/s) and of the bristles' deflection (m)."""
    if has_chosen_laws(p):
        return chosen_coefficient(slip, bristle, p)
    return adams(slip, p)


def steepest(p) -> float:
    """Return the greatest change of a record's coefficient with the slip (s/m), which holds
    steps back.
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

"""Contact laws: the force, damping and elastic energy of each, its depths, and the choice of one.

A law is a member of `Law`, named by `contact.law` in small letters; functions like `impact_elastic`
and `impact`; and a branch in each of `normal_force`, `elastic_force`, `elastic_energy` and
`elastic_form`. Nothing else knows of it but the choices of `contact.law` in the table of parameters
(physics/README.md, Contact).

In compiled functions the last law stands without a condition: comparing takes 3 to 10 % off the
speed of the march, and a record with another number cannot be built (`Law[...]`).
"""

import math
from dataclasses import dataclass
from enum import IntEnum

from compressor.physics._jit import fused, inlined, merged, plain


class Law(IntEnum):
    """The normal contact laws."""

    IMPACT = 0  # ADAMS's: K delta^p, and damping that rises with the penetration (Eq. 14)


@merged
def rise(s):
    """ADAMS's STEP from 0 at s = 0 to 1 at s = 1: a cubic, constant outside."""
    if s <= 0.0:
        return 0.0
    if s >= 1.0:
        return 1.0
    return s * s * (3.0 - 2.0 * s)


@merged
def power(base, exponent):
    """base ** exponent for base >= 0; a square root does for Hertz's 1.5."""
    if exponent == 1.5:
        return base * math.sqrt(base)
    return base**exponent


@merged
def impact_elastic(penetration, stiffness, p):
    """Elastic force (N) of ADAMS's IMPACT: K delta^p."""
    return stiffness * power(penetration, p.exponent)


@merged
def impact(penetration, rate, stiffness, p):
    """`normal_force` by ADAMS's IMPACT, damped by C_max STEP(delta / d_max) (N s/m)."""
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    elastic = impact_elastic(penetration, stiffness, p)
    unclamped = fused(p.damping * rise(penetration * p.per_full_damping), rate, elastic)
    return max(0.0, unclamped), elastic, unclamped


@merged
def elastic_force(penetration, stiffness, p):
    """Elastic force (N) of the record's law at a positive penetration (m)."""
    return impact_elastic(penetration, stiffness, p)


@merged
def elastic_energy(elastic, penetration, p):
    """Energy (J) that is stored where the elastic force (N) has reached a penetration (m)."""
    return elastic * penetration / (p.exponent + 1.0)


@merged
def normal_force(penetration, rate, stiffness, p):
    """F_N, its elastic part, and F_N before its lower bound (N), by the record's law.

    At a penetration (m) and its rate (m/s): the elastic force with damping times rate added, but
    never pulling. All are 0 unless the penetration is positive.
    """
    return impact(penetration, rate, stiffness, p)


@inlined
def in_contact(normal):
    """Whether a joint is in contact: F_N > 0, everywhere in the program."""
    return normal > 0.0


@dataclass(frozen=True)
class Power:
    """An elastic force K delta^p in closed form, and the damping beside it; SI."""

    stiffness: float
    exponent: float
    full_damping: float = 0.0  # N s/m
    per_full_damping: float = 0.0  # 1/m: over the penetration at which damping is full

    def static_depth(self, force: float) -> float:
        """Penetration (m) at rest under a force (N): (F / K)^(1/p)."""
        return (force / self.stiffness) ** (1 / self.exponent)

    def tangent(self, depth: float) -> float:
        """Stiffness (N/m) of small motion about a penetration (m)."""
        return self.exponent * self.stiffness * depth ** (self.exponent - 1)

    def damping(self, depth: float) -> float:
        """Damping coefficient (N s/m) at a penetration (m)."""
        return self.full_damping * plain(rise)(depth * self.per_full_damping)

    def impact_depth(self, mass: float, speed: float) -> float:
        """Greatest penetration (m) of an impact: m v^2 / 2 = K delta^(p+1) / (p+1)."""
        above = self.exponent + 1.0
        return (above * mass * speed**2 / (2.0 * self.stiffness)) ** (1.0 / above)

    def impact_time(self, depth: float, speed: float) -> float:
        """Contact time (s) of an impact that goes to a depth (m): 2 (delta / v) times the integral
        of 1 / sqrt(1 - x^(p+1)) from 0 to 1; 2.9432 delta / v with Hertz's 1.5 (Johnson 1985).
        """
        share = 1.0 / (self.exponent + 1.0)
        beta = math.sqrt(math.pi) * math.gamma(1.0 + share) / math.gamma(0.5 + share)
        return 2.0 * beta * depth / speed if speed > 0 else math.inf


def elastic_form(stiffness: float, p) -> Power:
    """The record's law in closed form with a joint's stiffness, for scales before a run."""
    if p["law"] == Law.IMPACT:
        return Power(stiffness, p["exponent"], p["damping"], p["per_full_damping"])
    raise ValueError(f"no contact law has the number {p['law']}")

"""Elastic forces of a pin that lies in its bore along a line, by Johnson and by Liu.

physics/README.md, Pins in bores. Both need the length of the joint and the composite modulus E*,
1 / E* = sum of (1 - nu^2) / E; their force is no power of the penetration, and depends on the
clearance c as well.

Johnson, Contact Mechanics (1985), Eq. 5.57 with the radial clearance as the difference of radii:
delta = F / S (ln(4 S c / F) - 1), S = pi E* L (N/m). Liu, Zhang and Yang, Mech. Mach. Theory 42
(2007): F = S delta / 2 sqrt(delta / (2 (c + delta))), which is K delta^1.5 / sqrt(1 + delta / c).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compressor.physics._jit import jit, square_root

FLATTEST = 1.25  # of ln(4 S c / F) - 1: from there on Johnson's force goes on along its tangent
JOHNSON_DEEPEST = 0.5  # of the clearance: up to which the law is meant, before that
NEWTON = 6  # steps that give Johnson's force to rounding
FEW = 0.02  # of the clearance: depths up to which the energy of Liu's law is summed as a series
SERIES = (
    1 / 5, -1 / 14, 1 / 24, -5 / 176, 35 / 1664, -63 / 3840, 231 / 17408, -429 / 38912,
)  # fmt: skip


@jit
def johnson_share(depth):
    """w = ln(4 S c / F) - 1 where a depth, over 4 c, is w exp(-1 - w): the larger solution.

    By Newton's method; depth: of (0, exp(-2)).
    """
    level = -1.0 - math.log(depth)
    above = max(level - 1.0, 0.0)
    share = 1.0 + math.sqrt(2.0 * above) + above + math.log(1.0 + above) / 3.0
    for _ in range(NEWTON):
        share -= (share - math.log(share) - level) * share / (share - 1.0)
    return share


@jit
def johnson(penetration, stiffness, clearance):
    """Return Johnson's elastic force (N) at a positive penetration (m); stiffness: S (N/m)."""
    depth = 0.25 * penetration / clearance
    steepest = FLATTEST * math.exp(-1.0 - FLATTEST)
    if depth < steepest:
        return stiffness * penetration / johnson_share(depth)
    along = steepest / FLATTEST + (depth - steepest) / (FLATTEST - 1.0)
    return 4.0 * stiffness * clearance * along


@jit
def johnson_energy(elastic, penetration, stiffness, clearance):
    """Return energy (J) that is stored where Johnson's force (N) has reached a penetration (m)."""
    force = 4.0 * stiffness * clearance * math.exp(-1.0 - FLATTEST)
    depth = FLATTEST * force / stiffness
    if penetration <= depth:
        return 0.5 * elastic * (penetration - 0.5 * elastic / stiffness)
    along = 0.5 * (force + elastic) * (penetration - depth)
    return 0.5 * force * (depth - 0.5 * force / stiffness) + along


@jit
def liu(penetration, stiffness, clearance):
    """Return Liu's elastic force (N) at a positive penetration (m); stiffness: K (N/m^1.5)."""
    return stiffness * penetration * square_root(penetration / (1.0 + penetration / clearance))


@jit
def liu_energy(penetration, stiffness, clearance):
    """Return the energy (J) that is stored at a penetration (m): the integral of Liu's force."""
    x = penetration / clearance
    if x < FEW:
        whole = 0.0
        for i in range(len(SERIES) - 1, -1, -1):
            whole = whole * x + SERIES[i]
        whole *= x * x * math.sqrt(x)
    else:
        root = math.sqrt(x)
        whole = 0.125 * (2.0 * x - 3.0) * root * math.sqrt(1.0 + x) + 0.375 * math.asinh(root)
    return 2.0 * stiffness * clearance**2.5 * whole


@dataclass(frozen=True)
class Conformal:
    """An elastic force that is no power of the penetration, for scales before a run; SI.

    `force` (N) and `energy` (J) rise with the penetration (m); `slope` (N/m) is the force's;
    `deepest` (m): beyond which the law has no force.
    """

    force: Callable[[float], float]
    slope: Callable[[float], float]
    energy: Callable[[float], float]
    deepest: float = math.inf

    def static_depth(self, force: float) -> float:
        """Return the penetration (m) at rest under a force (N)."""
        return solved(self.force, force)

    def tangent(self, depth: float) -> float:
        """Return the stiffness (N/m) of small motion about a penetration (m)."""
        return self.slope(depth)

    def damping(self, depth: float) -> float:
        """Return the damping coefficient (N s/m): unknown before bodies meet."""
        return 0.0

    def impact_depth(self, mass: float, speed: float) -> float:
        """Return the greatest penetration (m) of an impact: m v^2 / 2 is the energy there."""
        return solved(self.energy, 0.5 * mass * speed**2)

    def impact_time(self, depth: float, speed: float) -> float:
        """Return the contact time (s) of an impact that goes to a depth (m): 2 / v times the
        integral of 1 / sqrt(1 - U / U_max) over the penetration.
        """
        if not speed > 0.0:
            return math.inf
        nodes, weights = np.polynomial.legendre.leggauss(64)
        left = (nodes + 1.0) / 2.0  # the root of what is left of the depth
        most = self.energy(depth)
        spent = np.array([self.energy(depth * (1.0 - one * one)) / most for one in left])
        return float(2.0 * depth / speed * np.sum(weights * left / np.sqrt(1.0 - spent)))


def solved(rising: Callable[[float], float], value: float) -> float:
    """Return where a function that rises with a length (m) from 0 has a value, by bisection."""
    low, high = 1e-30, 1e3
    if not value > rising(low):
        return 0.0
    while high / low > 1.0 + 1e-15 and (middle := math.sqrt(low * high)) not in (low, high):
        low, high = (middle, high) if rising(middle) < value else (low, middle)
    return high


def johnson_form(stiffness: float, clearance: float) -> Conformal:
    """Return Johnson's law in a joint of a clearance (m)."""

    def slope(depth: float) -> float:
        share = depth * stiffness / johnson(depth, stiffness, clearance)
        return stiffness / (max(share, FLATTEST) - 1.0)

    return Conformal(
        lambda depth: float(johnson(depth, stiffness, clearance)), slope,
        lambda depth: float(
            johnson_energy(johnson(depth, stiffness, clearance), depth, stiffness, clearance)
        ),
        JOHNSON_DEEPEST * clearance,
    )  # fmt: skip


def liu_form(stiffness: float, clearance: float) -> Conformal:
    """Return Liu's law in a joint of a clearance (m)."""

    def slope(depth: float) -> float:
        return liu(depth, stiffness, clearance) * (1.5 / depth - 0.5 / (clearance + depth))

    return Conformal(
        lambda depth: float(liu(depth, stiffness, clearance)), slope,
        lambda depth: float(liu_energy(depth, stiffness, clearance)),
    )  # fmt: skip

"""Contact laws: the force and the elastic energy of each, its depths, and the choice of one.

A law is a member of `Law`, named by `contact.law` in small letters (physics/README.md, Contact). If
it damps by chi times the elastic force over the approach speed, it is a line in `HYSTERESIS`; if
its elastic force is not K delta^p, that has a branch in `elastic_force` and in `elastic_form`.

For the default law nothing is compared: that took 3 to 10 % off the speed of the march. Whether a
record's laws are chosen ones is its type (`record.CHOSEN`).

Johnson's and Liu's laws are of a pin that lies in its bore along a line (physics/README.md, Pins in
bores): their force is no power of the penetration, and depends on the clearance c as well.
Johnson, Contact Mechanics (1985), Eq. 5.57: delta = F / S (ln(4 S c / F) - 1), S = pi E* L (N/m).
Liu, Zhang and Yang, Mech. Mach. Theory 42 (2007): K delta^1.5 / sqrt(1 + delta / c).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum, unique

import numpy as np

from compressor.physics._jit import dispatch_on_record, inline_llvm, inline_once, square_root
from compressor.physics.record import CHOSEN_FORCES

FLATTEST = 1.25  # of ln(4 S c / F) - 1: from there on Johnson's force goes on along its tangent
JOHNSON_DEEPEST = 0.5  # of the clearance: up to which the law is meant, before that
NEWTON_STEPS = 6  # steps that give Johnson's force to rounding
MAX_SERIES_DEPTH = 0.02  # of the clearance: up to it the energy of Liu's law is a sum of `SERIES`
SERIES = (
    1 / 5, -1 / 14, 1 / 24, -5 / 176, 35 / 1664, -63 / 3840, 231 / 17408, -429 / 38912,
)  # fmt: skip


@inline_once
def johnson_share(depth):
    """Return w = ln(4 S c / F) - 1, the larger solution of depth = w exp(-1 - w), by Newton."""
    level = -1.0 - math.log(depth)
    above = max(level - 1.0, 0.0)
    share = 1.0 + math.sqrt(2.0 * above) + above + math.log(1.0 + above) / 3.0
    for _ in range(NEWTON_STEPS):
        share -= (share - math.log(share) - level) * share / (share - 1.0)
    return share


@inline_once
def johnson(penetration, stiffness, clearance):
    """Return Johnson's elastic force (N) at a positive penetration (m); stiffness: S (N/m)."""
    depth = 0.25 * penetration / clearance
    steepest = FLATTEST * math.exp(-1.0 - FLATTEST)
    if depth < steepest:
        return stiffness * penetration / johnson_share(depth)
    along = steepest / FLATTEST + (depth - steepest) / (FLATTEST - 1.0)
    return 4.0 * stiffness * clearance * along


@inline_once
def johnson_energy(elastic, penetration, stiffness, clearance):
    """Return the energy (J) stored where Johnson's force (N) has reached a penetration (m)."""
    force = 4.0 * stiffness * clearance * math.exp(-1.0 - FLATTEST)
    depth = FLATTEST * force / stiffness
    if penetration <= depth:
        return 0.5 * elastic * (penetration - 0.5 * elastic / stiffness)
    along = 0.5 * (force + elastic) * (penetration - depth)
    return 0.5 * force * (depth - 0.5 * force / stiffness) + along


@inline_once
def liu(penetration, stiffness, clearance):
    """Return Liu's elastic force (N) at a positive penetration (m); stiffness: K (N/m^1.5)."""
    return stiffness * penetration * square_root(penetration / (1.0 + penetration / clearance))


@inline_once
def liu_energy(penetration, stiffness, clearance):
    """Return the energy (J) that is stored at a penetration (m): the integral of Liu's force."""
    x = penetration / clearance
    if x < MAX_SERIES_DEPTH:
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
    """An elastic force that is no power of the penetration, for scales before a run; SI."""

    force: Callable[[float], float]
    tangent: Callable[[float], float]  # N/m: stiffness of small motion
    energy: Callable[[float], float]
    deepest: float = math.inf

    def static_depth(self, force: float) -> float:
        """Return the penetration (m) at rest under a force (N)."""
        return solve_rising(self.force, force)

    def damping(self, depth: float) -> float:
        """Return the damping coefficient (N s/m): unknown before bodies meet."""
        return 0.0

    def impact_depth(self, mass: float, speed: float) -> float:
        """Return the greatest penetration (m) of an impact: m v^2 / 2 is the energy there."""
        return solve_rising(self.energy, 0.5 * mass * speed**2)

    def impact_time(self, depth: float, speed: float) -> float:
        """Return the contact time (s) of an impact: the integral of 2 / v / sqrt(1 - U / U_max)."""
        if not speed > 0.0:
            return math.inf
        nodes, weights = np.polynomial.legendre.leggauss(64)
        roots = (nodes + 1.0) / 2.0  # the root of what is left of the depth
        max_energy = self.energy(depth)
        shares = np.array([self.energy(depth * (1.0 - x * x)) / max_energy for x in roots])
        return float(2.0 * depth / speed * np.sum(weights * roots / np.sqrt(1.0 - shares)))


def solve_rising(rising: Callable[[float], float], value: float) -> float:
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


@unique
class Law(IntEnum):
    """The normal contact laws."""

    IMPACT = 0  # ADAMS's: K delta^p, and damping that rises with the penetration (Eq. 14)
    HERTZ = 1  # K delta^p alone
    HUNT_CROSSLEY = 2
    LANKARANI_NIKRAVESH = 3
    FLORES = 4
    GONTHIER = 5
    HU_GUO = 6
    JOHNSON = 7  # of a pin in its bore, as the next
    LIU = 8


# chi by the coefficient of restitution e, where F = F_e (1 + chi delta' / delta'_0): the elastic
# force F_e, and the speed delta'_0 at which the bodies met
HYSTERESIS: dict[Law, Callable[[float], float]] = {
    Law.HERTZ: lambda e: 0.0,
    Law.HUNT_CROSSLEY: lambda e: 1.5 * (1.0 - e),  # J. Appl. Mech. 42 (1975)
    Law.LANKARANI_NIKRAVESH: lambda e: 0.75 * (1.0 - e**2),  # J. Mech. Des. 112 (1990)
    Law.FLORES: lambda e: 1.6 * (1.0 - e) / e,  # Multibody Syst. Dyn. 25 (2011)
    Law.GONTHIER: lambda e: (1.0 - e**2) / e,  # Multibody Syst. Dyn. 11 (2004)
    Law.HU_GUO: lambda e: 1.5 * (1.0 - e) / e,  # J. Sound Vib. 340 (2015)
    Law.JOHNSON: lambda e: 0.75 * (1.0 - e**2),  # by Lankarani and Nikravesh
    Law.LIU: lambda e: 0.75 * (1.0 - e**2),
}
# numba wants plain integers
IMPACT, JOHNSON, LIU = int(Law.IMPACT), int(Law.JOHNSON), int(Law.LIU)


@inline_llvm
def may_choose_laws(p):
    """Return True."""
    return True


@inline_llvm
def has_default_laws(p):
    """Return False."""
    return False


# whether laws other than the default ones may be a record's: a constant of its type
has_chosen_laws = dispatch_on_record(CHOSEN_FORCES, may_choose_laws, has_default_laws)


@inline_llvm
def rise(s):
    """Return ADAMS's STEP from 0 at s = 0 to 1 at s = 1: a cubic, constant outside."""
    if s <= 0.0:
        return 0.0
    if s >= 1.0:
        return 1.0
    return s * s * (3.0 - 2.0 * s)


@inline_llvm
def power(base, exponent):
    """Return base ** exponent for base >= 0; a square root does for Hertz's 1.5."""
    if exponent == 1.5:
        return base * square_root(base)
    return base**exponent


@inline_llvm
def elastic_force(penetration, stiffness, clearance, p):
    """Return the elastic force (N) of the record's law at a positive penetration (m)."""
    if has_chosen_laws(p) and p.law == JOHNSON:
        return johnson(penetration, stiffness, clearance)
    if has_chosen_laws(p) and p.law == LIU:
        return liu(penetration, stiffness, clearance)
    return stiffness * power(penetration, p.exponent)


@inline_llvm
def normal_force(penetration, rate, approach, stiffness, clearance, p):
    """Return F_N, and F_N before its lower bound (N), by the record's law.

    At a penetration (m), its rate and the speed at which the bodies met (m/s): the elastic force
    with damping times rate added, but never pulling. Both are 0 unless the penetration is positive.
    """
    if penetration <= 0.0:
        return 0.0, 0.0
    elastic = elastic_force(penetration, stiffness, clearance, p)
    if has_chosen_laws(p) and p.law != IMPACT:
        unclamped = elastic * p.hysteresis / approach * rate + elastic
    else:  # damped by C_max STEP(delta / d_max) (N s/m)
        unclamped = p.damping * rise(penetration * p.per_full_damping) * rate + elastic
    return max(0.0, unclamped), unclamped


@inline_llvm
def in_contact(normal):
    """Return whether a joint is in contact: F_N > 0, everywhere in the program."""
    return normal > 0.0


@dataclass(frozen=True)
class Power:
    """An elastic force K delta^p in closed form, for scales before a run; SI."""

    stiffness: float
    exponent: float
    full_damping: float = 0.0  # N s/m
    per_full_damping: float = 0.0  # 1/m: over the penetration at which damping is full
    deepest: float = math.inf  # m: beyond which the law has no force

    def static_depth(self, force: float) -> float:
        """Return the penetration (m) at rest under a force (N): (F / K)^(1/p)."""
        return (force / self.stiffness) ** (1 / self.exponent)

    def tangent(self, depth: float) -> float:
        """Return the stiffness (N/m) of small motion about a penetration (m)."""
        return self.exponent * self.stiffness * depth ** (self.exponent - 1)

    def damping(self, depth: float) -> float:
        """Return the damping coefficient (N s/m) at a penetration (m)."""
        return self.full_damping * rise(depth * self.per_full_damping)

    def energy(self, depth: float) -> float:
        """Return the energy (J) that is stored at a penetration (m)."""
        return self.stiffness * depth ** (self.exponent + 1.0) / (self.exponent + 1.0)

    def impact_depth(self, mass: float, speed: float) -> float:
        """Return the greatest penetration (m) of an impact: m v^2 / 2 = K delta^(p+1) / (p+1)."""
        above = self.exponent + 1.0
        return (above * mass * speed**2 / (2.0 * self.stiffness)) ** (1.0 / above)

    def impact_time(self, depth: float, speed: float) -> float:
        """Return the contact time (s) of an impact that goes to a depth (m).

        2 (delta / v) times the integral of 1 / sqrt(1 - x^(p+1)) from 0 to 1; 2.9432 delta / v with
        Hertz's 1.5 (Johnson 1985).
        """
        share = 1.0 / (self.exponent + 1.0)
        beta = math.sqrt(math.pi) * math.gamma(1.0 + share) / math.gamma(0.5 + share)
        return 2.0 * beta * depth / speed if speed > 0 else math.inf


def elastic_form(stiffness: float, clearance: float, p) -> Power | Conformal:
    """Return the record's law at a joint's stiffness and clearance (m), for scales before a run."""
    if p["law"] == Law.IMPACT:
        return Power(stiffness, p["exponent"], p["damping"], p["per_full_damping"])
    if p["law"] == Law.JOHNSON:
        return johnson_form(stiffness, clearance)
    if p["law"] == Law.LIU:
        return liu_form(stiffness, clearance)
    if p["law"] in HYSTERESIS:  # whose damping depends on how fast the bodies will meet
        return Power(stiffness, p["exponent"])
    raise ValueError(f"no contact law has the number {p['law']}")

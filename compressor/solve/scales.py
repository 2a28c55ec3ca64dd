"""Natural scales of a case before it runs: depths, times and steps, from its parameters alone.

Closed formulas on plain numbers, a few microseconds a case. Forces are the sum of the greatest
load and inertia, hence bounds; the deepest contact of the random cases (tests/random_cases.py) is
0.6 to 1.6 times as deep as they tell in nine of ten (tests/test_scales.py).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from compressor.cases import contact_stiffness, to_si
from compressor.metrics import JOINTS

if TYPE_CHECKING:
    from compressor.cases import Case

STABILITY = 3.25  # of an explicit step times the fastest rate (physics.control.BOUNDARY)
# Attempts of a step for each radian of the contact's ringing at rtol 1; measured on random cases.
PER_RADIAN = {"big_end": 0.3, "small_end": 0.5, "both": 0.7}
HELD = 0.5  # of the steps that stability asks for: joints are not in contact, or deep, always
ORDER = 5
STEP_SECONDS = {"big_end": 3.5e-6, "small_end": 3.5e-6, "both": 4.5e-6}  # of compiled methods
SCIPY_SECONDS = 2.5e-4  # of a step of SciPy's methods, with its tally


@dataclass(frozen=True)
class JointScales:
    """Natural scales of a joint's contact under a force (SI)."""

    joint: str
    clearance: float  # m
    force: float  # N
    penetration: float  # m, at rest under the force
    impact_speed: float  # m/s, after falling through the clearance under the force
    impact_penetration: float  # m, undamped
    contact_time: float  # s, of that impact
    frequency: float  # Hz, of the lighter body on the contact's stiffness at rest
    friction_rate: float  # 1/s: 1.5 mu_s F / (m v_s)
    explicit_step: float  # s, the stability limit by the fastest of stiffness, damping, friction
    limited_by: str
    implicit_step: float  # s: the contact's own time scale, which no method can do without


def static_depth(force: float, stiffness: float, exponent: float) -> float:
    """Penetration (m) under a force at rest: (F / K)^(1/p), Eq. 14 without damping."""
    return (force / stiffness) ** (1.0 / exponent)


def impact_depth(mass: float, speed: float, stiffness: float, exponent: float) -> float:
    """Greatest penetration (m) of an undamped impact: m v^2 / 2 = K delta^(p+1) / (p+1)."""
    return ((exponent + 1.0) * mass * speed**2 / (2.0 * stiffness)) ** (1.0 / (exponent + 1.0))


def impact_time(depth: float, speed: float, exponent: float) -> float:
    """Contact time (s) of an undamped impact: 2 (delta / v) times the integral of
    1 / sqrt(1 - x^(p+1)) from 0 to 1; 2.9432 delta / v with Hertz's exponent 1.5 (Johnson 1985).
    """
    share = 1.0 / (exponent + 1.0)
    beta = math.sqrt(math.pi) * math.gamma(1.0 + share) / math.gamma(0.5 + share)
    return 2.0 * beta * depth / speed if speed > 0 else math.inf


def greatest_force(case: "Case", joint: str) -> float:
    """A bound of the force at a joint of the ideal machine (N): inertia and load.

    m R omega^2 (1 + R / L) of what reciprocates, at the big end m R omega^2 (1 + a R / L^2) of the
    rod as well, and the load's greatest value; in the machine they partly cancel.
    """
    machine = case.machine
    radius, length = machine.crank_radius_mm / 1000, machine.rod_length_mm / 1000
    centripetal = radius * case.omega**2
    inertia = machine.reciprocating_mass_kg * centripetal * (1 + radius / length)
    if joint == "big_end":
        share = (machine.rod_centre_mm or 0.0) / machine.rod_length_mm
        inertia += machine.rod_mass_kg * centripetal * (1 + share * radius / length)
    return inertia + machine.rod_mass_kg * machine.gravity_m_per_s2 + greatest_load(case)


def greatest_load(case: "Case") -> float:
    """The load's greatest value in the ideal machine (N), at most."""
    if case.load == "typical":
        gas = case.gas
        area = math.pi * to_si(gas.piston_radius_mm, "mm") ** 2
        return to_si(max(gas.discharge_MPa, gas.back_pressure_MPa), "MPa") * area
    if case.load == "design":
        spring, speed = case.spring, case.omega * case.machine.crank_radius_mm
        return (
            spring.preload_N
            + spring.stiffness_N_per_mm * spring.stroke_mm
            + spring.damping_N_s_per_mm * speed
        )
    return 0.0


def stiffness_of(case: "Case", joint: str) -> float:
    """The contact stiffness of a joint, N/m^p."""
    contact, pin = case.contact, to_si(case.machine.pin_radius_mm, "mm")
    if contact.materials:
        clearance = to_si(getattr(case.clearance_mm, joint), "mm")
        return contact_stiffness(*contact.materials, pin, pin + clearance)
    return (contact.stiffness_N_per_mm15 or 0.0) * 1000.0**contact.exponent


def joint_scales(case: "Case", joint: str, force: float) -> JointScales:
    """The scales of a joint with clearance under a force (N)."""
    contact, exponent = case.contact, case.contact.exponent
    clearance = getattr(case.clearance_mm, joint) / 1000
    mass = min(case.machine.rod_mass_kg, case.machine.reciprocating_mass_kg)
    stiffness = stiffness_of(case, joint)
    depth = static_depth(force, stiffness, exponent)
    natural = math.sqrt(exponent * stiffness * depth ** (exponent - 1.0) / mass)
    share = min(1.0, 1000 * depth / contact.full_damping_mm)
    damping = 1000 * contact.damping_N_s_per_mm * share * share * (3.0 - 2.0 * share)  # STEP
    friction = 0.0
    if case.friction:  # the smoothed law is steepest where nothing slides
        slip = case.friction.stiction_velocity_mm_per_s / 1000
        friction = 1.5 * case.friction.static * force / (slip * mass)
    rates = {"contact stiffness": natural, "contact damping": damping / mass, "friction": friction}
    fastest = max(rates, key=rates.__getitem__)
    speed = math.sqrt(2.0 * force / mass * clearance)
    impact = impact_depth(mass, speed, stiffness, exponent)
    return JointScales(
        joint, clearance, force, depth, speed, impact, impact_time(impact, speed, exponent),
        natural / (2 * math.pi), friction, STABILITY / rates[fastest], fastest, 1.0 / natural,
    )  # fmt: skip


def scales(case: "Case") -> Iterator[JointScales]:
    """The scales of each joint with clearance under its greatest force."""
    for joint in JOINTS:
        if getattr(case.clearance_mm, joint) > 0:
            yield joint_scales(case, joint, greatest_force(case, joint))


def expected_steps(case: "Case", found: Sequence[JointScales]) -> float:
    """About how many steps a run of a case attempts; good to a factor of four in random cases.

    As many as accuracy asks for while the contact rings, or as stability does where that is not
    more than the stiff partner's: a few a radian. 0 where nothing is integrated. Far from the
    defaults it is told in order of magnitude only.
    """
    if not found:
        return 0.0
    joint = found[0].joint if len(found) == 1 else "both"
    radians = case.duration / min(one.implicit_step for one in found)
    accurate = PER_RADIAN[joint] * case.rtol ** (-1.0 / ORDER)
    stable = HELD * case.duration / min(one.explicit_step for one in found)
    return max(radians * accurate, min(stable, radians * max(accurate, 2.0)))


def expected_seconds(case: "Case", steps: float) -> float:
    """About how long so many steps take (s), without error bars, on a machine of 2024."""
    if steps == 0:
        return 0.0
    compiled = case.solve.method in ("auto", "DOPRI5", "TSIT5", "RODAS")
    joint = case.joint if case.joint in STEP_SECONDS else "both"
    return steps * (STEP_SECONDS[joint] if compiled else SCIPY_SECONDS)

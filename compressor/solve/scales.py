"""Natural scales of a case before it runs: depths, times and steps, from its parameters alone.

Closed formulas, tens of microseconds a case. Forces are the sum of the greatest load and inertia,
hence bounds; the deepest contact of the random cases (tests/random_cases.py) is 0.6 to 1.6 times as
deep as they say in nine of ten (tests/test_scales.py).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from compressor.cases import Case
from compressor.metrics import JOINTS
from compressor.physics import STABILITY_LIMIT, Scene, elastic_form, greatest_load, steepest
from compressor.solve.marching import COMPILED
from compressor.solve.si_record import record, scene

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
    damping_ratio: float  # of the lighter body on the contact at rest; above 1 it does not ring
    swing_frequency: float  # Hz, of the journal swinging about the line of the force in its bore
    friction_rate: float  # 1/s: dmu/dv F / m where it is greatest; 1.5 mu_s F / (m v_s) of ADAMS's
    explicit_step: float  # s, the stability limit by the fastest of stiffness, damping, friction
    limited_by: str
    implicit_step: float  # s: the contact's own time scale, which no method can do without


def greatest_force(p: np.record, joint: str) -> float:
    """Return a bound of the force at a joint of the ideal machine (N): inertia and load.

    m R omega^2 (1 + R / L) of what reciprocates, at the big end m R omega^2 (1 + a R / L^2) of the
    rod as well, and the load's greatest value; in the machine they partly cancel.
    """
    ratio, centripetal = p["crank_ratio"], p["crank_radius"] * p["omega"] ** 2
    inertia = p["reciprocating_mass"] * centripetal * (1 + ratio)
    if joint == "big_end":
        share = p["rod_centre"] / p["rod_length"]
        inertia += p["rod_mass"] * centripetal * (1 + share * ratio)
    return float(inertia + p["rod_mass"] * p["gravity"] + greatest_load(p))


def joint_scales(p: np.record, joint: str, force: float) -> JointScales:
    """Return the scales of a joint with clearance under a force (N).

    A journal that the force holds against its bore can roll to and fro on the wall, on a circle of
    radius e, clearance and penetration. It swings like a pendulum, at sqrt(F / (m e)); m is what
    the rod's end weighs across the force, the other end being held: (J + m_r l^2) / L^2, l from
    the mass centre to the other end.
    """
    number = JOINTS.index(joint)
    clearance, stiffness = p["clearance"][number].item(), p["stiffness"][number].item()
    contact = elastic_form(stiffness, clearance, p)
    mass = min(p["rod_mass"], p["reciprocating_mass"]).item()
    depth = float(contact.static_depth(force))
    natural = math.sqrt(contact.tangent(depth) / mass)
    friction = 0.0
    if p["friction"]:
        friction = steepest(p) * force / mass
    rates = {
        "contact stiffness": natural,
        "contact damping": contact.damping(depth) / mass,
        "friction": friction,
    }
    fastest = max(rates, key=rates.__getitem__)
    swing = math.sqrt(force / (across(p, joint) * (clearance + depth)))
    return JointScales(
        joint, clearance, force, depth, contact.damping(depth) / (2.0 * mass * natural),
        swing / (2.0 * math.pi), friction, STABILITY_LIMIT / rates[fastest], fastest,
        1.0 / natural,
    )  # fmt: skip


def across(p: np.record, joint: str) -> float:
    """Return the mass (kg) that moves with an end of the rod across the rod, the other end being
    held.
    """
    centre, length = p["rod_centre"].item(), p["rod_length"].item()
    lever = length - centre if joint == "big_end" else centre
    return (p["rod_inertia"].item() + p["rod_mass"].item() * lever**2) / length**2


def contact_scales(case: Case) -> Iterator[JointScales]:
    """Yield the scales of each joint with clearance under its greatest force."""
    if scene(case) == Scene.IDEAL:
        return
    p = record(case)
    for joint, clearance in zip(JOINTS, p["clearance"], strict=True):
        if clearance > 0:
            yield joint_scales(p, joint, greatest_force(p, joint))


def expected_cost(case: Case, joints: Sequence[JointScales]) -> tuple[float, float]:
    """About how many steps a run of a case attempts, and how long they take (s)."""
    steps = expected_steps(case, joints)
    return steps, expected_seconds(case, steps)


def expected_steps(case: Case, joints: Sequence[JointScales]) -> float:
    """About how many steps a run of a case attempts; good to a factor of four in random cases.

    As many as accuracy asks for while the contact rings, or as stability does where that is not
    more than the stiff partner's: a few a radian. 0 where nothing is integrated. Far from the
    defaults only its order of magnitude holds.
    """
    if not joints:
        return 0.0
    joint = joints[0].joint if len(joints) == 1 else "both"
    radians = case.duration / min(one.implicit_step for one in joints)
    accurate = PER_RADIAN[joint] * case.rtol ** (-1.0 / ORDER)
    stable = HELD * case.duration / min(one.explicit_step for one in joints)
    return max(radians * accurate, min(stable, radians * max(accurate, 2.0)))


def expected_seconds(case: Case, steps: float) -> float:
    """About how long so many steps take (s), without error bars, on a machine of 2024."""
    if steps == 0:
        return 0.0
    joint = case.joint if case.joint in STEP_SECONDS else "both"
    return steps * (STEP_SECONDS[joint] if case.solve.method in COMPILED else SCIPY_SECONDS)

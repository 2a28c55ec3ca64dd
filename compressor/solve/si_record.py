"""Case -> the SI record of parameters that compiled functions read.

Gathered in a dict, for which the record is filled once: to read a field back would take ten times
as long, for every job.
"""

import math
from typing import Any

import numpy as np

from compressor.cases import Case, Guide, joint_stiffness, to_si
from compressor.metrics import JOINTS
from compressor.physics import (
    MOST_SECTORS,
    Load,
    Scene,
    bore_fields,
    choose_laws,
    complete,
    hysteresis,
    new_record,
)

NO_APPROACH = 1000.0  # mm/s: of laws that damp by none, and divide nothing by it


def scene(case: Case) -> Scene:
    """Return the scene of a case: a joint whose clearance is 0 is ideal, whatever `joint` names."""
    big, small = case.clearance_mm.big_end > 0, case.clearance_mm.small_end > 0
    return Scene(int(big) * Scene.BIG_END + int(small) * Scene.SMALL_END)


def is_ideal(case: Case) -> bool:
    """Return whether nothing is integrated: ideal joints, and nothing else that may move."""
    play = case.guide is not None and case.guide.clearance_mm > 0
    return scene(case) == Scene.IDEAL and not (play or case.drive or case.rod)


def record(case: Case, worn: np.ndarray | None = None) -> np.record:
    """Return the record of a case, every number in SI.

    worn: what was worn off both bores (m), (joint, sector); None: they are round.
    """
    p: dict[str, Any] = {}  # what is not set stays zero
    p["scene"] = scene(case)
    p["load"] = Load[case.load.upper()]
    _machine(case, p)
    _contact(case, p)
    _gas(case, p)
    _spring(case, p)
    ratio = case.gas.discharge_MPa / case.gas.suction_MPa
    _film(case, p)
    featured = case.has_features or worn is not None
    if featured:
        _features(case, p)
    if worn is not None:
        p |= bore_fields(worn.shape[1])
        p["worn"] = np.pad(worn, ((0, 0), (0, MOST_SECTORS - worn.shape[1])))
    complete(p, ratio, printed=case.gas.switching == "paper")
    filled = new_record(case.chooses_laws, featured)
    for name, value in p.items():
        filled[name] = value
    return filled


def offsets(case: Case) -> np.ndarray:
    """Return the initial offsets of the journals (m), shape (joint, axis)."""
    shift = case.initial_offset_mm
    rows = [[shift.big_end_x, shift.big_end_y], [shift.small_end_x, shift.small_end_y]]
    return np.array(rows) / 1000


def stiffness_of(case: Case, joint: str) -> float:
    """Return the contact stiffness of a joint, as of `joint_stiffness`."""
    clearance = getattr(case.clearance_mm, joint)
    return joint_stiffness(case.contact, case.machine.pin_radius(joint), clearance)


def _machine(case: Case, p: dict[str, Any]) -> None:
    machine = case.machine
    p["omega"] = case.omega
    p["crank_radius"] = to_si(machine.crank_radius_mm, "mm")
    p["rod_length"] = to_si(machine.rod_length_mm, "mm")
    p["rod_mass"] = machine.rod_mass_kg
    p["rod_centre"] = to_si(machine.rod_centre_mm or 0.0, "mm")
    p["rod_inertia"] = machine.rod_inertia_kg_m2 or 0.0
    p["reciprocating_mass"] = machine.reciprocating_mass_kg
    p["gravity"] = machine.gravity_m_per_s2
    p["pin_radius"] = [to_si(machine.pin_radius(joint), "mm") for joint in JOINTS]


def _contact(case: Case, p: dict[str, Any]) -> None:
    contact, friction = case.contact, case.friction
    p["exponent"] = contact.exponent
    p["damping"] = to_si(contact.damping_N_s_per_mm, "N s/mm")
    p["full_damping"] = to_si(contact.full_damping_mm, "mm")
    p["least_approach"] = to_si(contact.least_approach_mm_per_s or NO_APPROACH, "mm/s")
    law = (friction.law or "adams") if friction else "none"
    choose_laws(p, contact.law, contact.restitution or 1.0, law)
    p["clearance"] = [to_si(getattr(case.clearance_mm, joint), "mm") for joint in JOINTS]
    p["stiffness"] = [stiffness_of(case, joint) for joint in JOINTS]
    if friction:
        p["static"], p["dynamic"] = friction.static, friction.dynamic
        p["stiction_velocity"] = to_si(friction.stiction_velocity_mm_per_s, "mm/s")
        p["friction_velocity"] = to_si(friction.friction_velocity_mm_per_s, "mm/s")
        p["bristle_stiffness"] = to_si(friction.bristle_stiffness_per_mm or 0.0, "1/mm")
        p["bristle_damping"] = to_si(friction.bristle_damping_s_per_mm or 0.0, "s/mm")
        p["viscous"] = to_si(friction.viscous_s_per_mm or 0.0, "s/mm")


def _gas(case: Case, p: dict[str, Any]) -> None:
    gas = case.gas
    area = math.pi * to_si(gas.piston_radius_mm, "mm") ** 2
    p["suction_force"] = to_si(gas.suction_MPa, "MPa") * area
    p["discharge_force"] = to_si(gas.discharge_MPa, "MPa") * area
    p["back_force"] = to_si(gas.back_pressure_MPa, "MPa") * area
    p["head_clearance"] = to_si(gas.head_clearance_mm, "mm")
    p["gas_exponent"] = gas.exponent


def _spring(case: Case, p: dict[str, Any]) -> None:
    spring = case.spring
    p["spring_stiffness"] = to_si(spring.stiffness_N_per_mm, "N/mm")
    p["spring_damping"] = to_si(spring.damping_N_s_per_mm, "N s/mm")
    p["preload"] = spring.preload_N
    p["spring_stroke"] = to_si(spring.stroke_mm, "mm")


def _film(case: Case, p: dict[str, Any]) -> None:
    """The oil film of the joints with clearance."""
    lubricant = case.lubricant
    if lubricant is None:
        return
    from compressor.solve.bearing import film_numbers

    length = to_si(lubricant.bearing_length_mm, "mm")
    p["viscosity"] = to_si(lubricant.viscosity_mPa_s, "mPa s")
    p["film_length"], p["film_share"] = length, lubricant.last_share
    p["film_constants"] = [
        film_numbers(0.5 * length / pin, lubricant.last_share) for pin in p["pin_radius"]
    ]


def _guide_contact(case: Case, guide: Guide, p: dict[str, Any]) -> None:
    """How a corner of the crosshead meets its guide: as the joints do, where it has no keys of its
    own; without their restitution by ADAMS's IMPACT.
    """
    contact = case.contact
    exponent = guide.exponent or contact.exponent
    damping = guide.damping_N_s_per_mm
    damping = contact.damping_N_s_per_mm if damping is None else damping
    p["guide_stiffness"] = guide.stiffness_N_per_mm15 * 1000.0**exponent
    p["guide_exponent"] = exponent
    p["guide_damping"] = to_si(damping, "N s/mm")
    p["per_guide_full_damping"] = 1.0 / to_si(
        guide.full_damping_mm or contact.full_damping_mm, "mm"
    )
    restitution = guide.restitution or contact.restitution
    if restitution is not None:
        p["guide_restituting"], p["guide_hysteresis"] = 1, hysteresis(contact.law, restitution)


def _features(case: Case, p: dict[str, Any]) -> None:
    """What frees more than the joints: guide, drive, rod, friction of ideal joints."""
    p["rubbing"] = int(bool(case.friction and case.friction.ideal_joints))
    p["driven"], p["elastic"] = int(case.drive is not None), int(case.rod is not None)
    p["tilting"] = int(case.guide is not None and case.guide.clearance_mm > 0)
    guide, drive, rod = case.guide, case.drive, case.rod
    p["guide_stiction"] = p["crosshead_inertia"] = 1.0  # where nothing reads them
    if guide:
        p["guide_clearance"] = to_si(guide.clearance_mm, "mm")
        p["guide_length"] = to_si(guide.crosshead_length_mm, "mm") / 2
        p["guide_height"] = to_si(guide.crosshead_height_mm, "mm") / 2
        _guide_contact(case, guide, p)
        p["guide_friction"] = guide.friction
        p["guide_stiction"] = to_si(guide.stiction_velocity_mm_per_s, "mm/s")
        p["crosshead_inertia"] = guide.crosshead_inertia_kg_m2 or 0.0
    if drive:
        p["crank_inertia"] = drive.flywheel_kg_m2
        p["unbalance"] = to_si(drive.unbalance_kg_mm, "kg mm")
        p["torque"] = drive.torque_N_m
        p["torque_slope"] = drive.slope_N_m_s
    if rod:
        modulus, length = to_si(rod.youngs_modulus_GPa, "GPa"), p["rod_length"]
        depth, width = to_si(rod.depth_mm, "mm"), to_si(rod.width_mm, "mm")
        p["axial_stiffness"] = modulus * depth * width / length
        p["bending_stiffness"] = modulus * width * depth**3 / 12 / length**3
        slowest = math.pi**2 * math.sqrt(p["bending_stiffness"] / p["rod_mass"])  # rad/s
        p["rod_damping"] = 2.0 * rod.damping_ratio / slowest

"""The SI record of a case, the sizes that tolerances are relative to, and its initial state.

Gathered in a dict, for which the record is filled once: to read a field back would take ten times
as long. What reads many fields may be given `physics.read_fields` in its place.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from compressor.cases import Case, joint_stiffness, open_card, to_si
from compressor.metrics import JOINTS
from compressor.physics import (
    CARD_NODES,
    FLOWS,
    Coordinate,
    Fields,
    Load,
    Scene,
    choose_laws,
    complete,
    derivative_with_flows,
    elastic_form,
    enter_segment,
    has_chosen_forces,
    is_featured,
    new_record,
    start,
    state_names,
    static_load,
)

NO_APPROACH = 1000.0  # mm/s: of laws that damp by none, and divide nothing by it
SMOOTHING_ORDER = 3  # of the polynomials in a window that smooths a card


def scene(case: Case) -> Scene:
    """Return the scene of a case: a joint whose clearance is 0 is ideal, whatever `joint` names."""
    big, small = case.clearance_mm.big_end > 0, case.clearance_mm.small_end > 0
    return Scene(int(big) * Scene.BIG_END + int(small) * Scene.SMALL_END)


def is_ideal(case: Case) -> bool:
    """Return whether nothing is integrated: ideal joints, and nothing else that may move."""
    play = case.guide is not None and case.guide.clearance_mm > 0
    return scene(case) == Scene.IDEAL and not (play or case.drive or case.rod)


def record(case: Case) -> np.record:
    """Return the record of a case, every number in SI. Raises ValueError as `complete`."""
    p: dict[str, Any] = {}  # what is not set stays zero
    p["scene"] = scene(case)
    exact = case.load == "gas" and case.gas.switching == "exact"
    p["load"] = Load.CYLINDER if exact else Load[case.load.upper()]
    if case.load == "gas" and case.gas.is_measured:
        p["load"] = Load.CARD
    _machine(case, p)
    _contact(case, p)
    _gas(case, p)
    spring = case.spring
    p["spring_stiffness"] = to_si(spring.stiffness_N_per_mm, "N/mm")
    p["spring_damping"] = to_si(spring.damping_N_s_per_mm, "N s/mm")
    p["preload"], p["spring_stroke"] = spring.preload_N, to_si(spring.stroke_mm, "mm")
    _film(case, p)
    if case.needs_mechanism:
        _features(case, p)
    complete(p)
    return new_record(case.chooses_forces, case.needs_mechanism, p)


def offsets(case: Case) -> np.ndarray:
    """Return the initial offsets of the journals (m), shape (joint, axis)."""
    shift = case.initial_offset_mm
    rows = [[shift.big_end_x, shift.big_end_y], [shift.small_end_x, shift.small_end_y]]
    return np.array(rows) / 1000


def stiffness_of(case: Case, joint: str) -> float:
    """Return the contact stiffness (N/m^p) of a joint, as of `joint_stiffness`."""
    clearance = getattr(case.clearance_mm, joint)
    return joint_stiffness(case.contact, joint, case.machine.pin_radius_mm.at(joint), clearance)


def _machine(case: Case, p: dict[str, Any]) -> None:
    """Set the numbers of crank, rod, masses and pins."""
    machine = case.machine
    p["omega"] = case.omega
    p["crank_radius"] = to_si(machine.crank_radius_mm, "mm")
    p["rod_length"] = to_si(machine.rod_length_mm, "mm")
    p["rod_mass"] = machine.rod_mass_kg
    p["rod_centre"] = to_si(machine.rod_centre_mm or 0.0, "mm")
    p["rod_inertia"] = machine.rod_inertia_kg_m2 or 0.0
    p["reciprocating_mass"] = machine.reciprocating_mass_kg
    p["gravity"] = machine.gravity_m_per_s2
    p["unbalance"] = to_si(case.unbalance, "kg mm")
    p["pin_radius"] = [to_si(machine.pin_radius_mm.at(joint), "mm") for joint in JOINTS]


def _contact(case: Case, p: dict[str, Any]) -> None:
    """Set the contact and friction laws and their numbers."""
    contact, friction = case.contact, case.friction
    p["exponent"] = contact.exponent
    p["damping"] = to_si(contact.damping_N_s_per_mm, "N s/mm")
    p["full_damping"] = to_si(contact.full_damping_mm, "mm")
    p["least_approach"] = to_si(contact.least_approach_mm_per_s or NO_APPROACH, "mm/s")
    law = friction.law if friction else "none"
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
    """Set the forces of the gas on the piston, and its cycle."""
    gas, stroke = case.gas, 2 * case.machine.crank_radius_mm
    area = math.pi * to_si(gas.piston_radius_mm, "mm") ** 2
    rod = math.pi * to_si((gas.rod_diameter_mm or 0.0) / 2, "mm") ** 2
    suction, discharge = (to_si(pressure, "MPa") for pressure in gas.open_pressures)
    p["suction_force"], p["discharge_force"] = suction * area, discharge * area
    back = to_si(gas.back_pressure_MPa or 0.0, "MPa")
    p["back_force"] = back * area
    p["head_clearance"] = to_si(gas.clearance("head", stroke), "mm")
    p["gas_exponent"] = gas.exponent
    if gas.is_measured and case.load == "gas":
        faces = {"head": area, "crank": rod - area}
        table = sum((faces[end] * gas_nodes(case, end) for end in gas.cards), np.zeros(()))
        table[:, 0] -= back * sum(faces[end] for end in gas.cards)
        p["card"], p["discharge_force"] = table, np.abs(table[:, 0]).max()
    elif gas.switching == "exact":
        areas = {"head": area * gas.presses("head"), "crank": (area - rod) * gas.presses("crank")}
        for end, prefix in (("head", ""), ("crank", "crank_")):
            idle = to_si(gas.suction_MPa, "MPa")
            open_at = (suction, discharge) if gas.has_cycle(end) else (idle, idle)
            p[f"{prefix}suction_force"] = open_at[0] * areas[end]
            p[f"{prefix}discharge_force"] = open_at[1] * areas[end]
        p["crank_clearance"] = to_si(gas.clearance("crank", stroke), "mm")
        p["back_force"] = back * (areas["head"] - areas["crank"])


def gas_nodes(case: Case, end: str) -> np.ndarray:
    """Return pressure (Pa, absolute) and its slope a node of an end's card, (CARD_NODES, 2)."""
    gas = case.gas
    card = open_card(gas.cards[end], end)
    nodes = to_si(1.0, "MPa") * card_nodes(card.angles, card.pressures)
    if card.is_gauge:
        nodes[:, 0] += to_si(gas.ambient, "MPa")
    return smooth_nodes(nodes, gas.smooth_deg or 0.0)


def card_nodes(angles: Sequence[float], values: Sequence[float]) -> np.ndarray:
    """Return values, and slopes a node, of a card's curve at angles (degrees): (CARD_NODES, 2)."""
    from scipy.interpolate import Akima1DInterpolator  # of cases with a card alone

    around = np.add.outer([-360.0, 0.0, 360.0], angles).ravel()
    curve = Akima1DInterpolator(around, np.tile(values, 3))
    width = 360.0 / CARD_NODES
    at = np.arange(CARD_NODES) * width
    return np.stack([curve(at), width * curve(at, 1)], axis=1)


def smooth_nodes(nodes: np.ndarray, degrees: float) -> np.ndarray:
    """Return values and slopes a node, (m, 2), smoothed in a window; 0 degrees: as they are.

    By Savitzky and Golay's cubic least squares (SciPy's); the window goes round the revolution.
    """
    width = 2 * round(degrees * len(nodes) / 720.0) + 1
    if width <= SMOOTHING_ORDER + 1:
        return nodes
    from scipy.signal import savgol_filter

    both = [
        savgol_filter(nodes[:, 0], width, SMOOTHING_ORDER, deriv=derivative, mode="wrap")
        for derivative in (0, 1)
    ]
    return np.stack(both, axis=1)


def _film(case: Case, p: dict[str, Any]) -> None:
    """Set the numbers of the oil film in the joints with clearance."""
    lubricant = case.lubricant
    if lubricant is None:
        return
    from compressor.solve.bearing import film_constants

    lengths = [to_si(lubricant.bearing_length_mm.at(joint), "mm") for joint in JOINTS]
    p["viscosity"] = to_si(lubricant.viscosity_mPa_s, "mPa s")
    p["film_length"], p["film_share"] = lengths, lubricant.last_share
    p["film_constants"], p["film_stiffest"] = zip(
        *(
            film_constants(0.5 * length / pin, lubricant.last_share)
            for length, pin in zip(lengths, p["pin_radius"], strict=True)
        ),
        strict=True,
    )


def _features(case: Case, p: dict[str, Any]) -> None:
    """Set what frees more than the joints: guide, drive, rod, friction of ideal joints."""
    p["rubbing"] = int(bool(case.friction and case.friction.ideal_joints))
    p["driven"], p["elastic"] = int(case.drive is not None), int(case.rod is not None)
    p["tilting"] = int(case.guide is not None and case.guide.clearance_mm > 0)
    guide, drive, rod, contact = case.guide, case.drive, case.rod, case.contact
    p["guide_stiction"] = p["crosshead_inertia"] = 1.0  # where nothing reads them
    if guide:
        p["guide_clearance"] = to_si(guide.clearance_mm, "mm")
        p["guide_length"] = to_si(guide.crosshead_length_mm, "mm") / 2
        p["guide_height"] = to_si(guide.crosshead_height_mm, "mm") / 2
        # a corner of the crosshead meets its guide by the joints' numbers, or its own
        damping, full = guide.damping_N_s_per_mm, guide.full_damping_mm or contact.full_damping_mm
        p["guide_exponent"] = guide.exponent or contact.exponent
        p["guide_stiffness"] = guide.stiffness_N_per_mm15 * 1000.0 ** p["guide_exponent"]
        p["guide_damping"] = to_si(
            contact.damping_N_s_per_mm if damping is None else damping, "N s/mm"
        )
        p["per_guide_full_damping"] = 1.0 / to_si(full, "mm")
        p["guide_friction"] = guide.friction
        p["guide_stiction"] = to_si(guide.stiction_velocity_mm_per_s, "mm/s")
        p["crosshead_inertia"] = guide.crosshead_inertia_kg_m2 or 0.0
    if drive:
        p["crank_inertia"] = drive.flywheel_kg_m2
        p["torque"] = drive.torque_N_m
        p["torque_slope"] = drive.slope_N_m_s
    if rod:
        modulus, length = to_si(rod.youngs_modulus_GPa, "GPa"), p["rod_length"]
        depth, width = to_si(rod.depth_mm, "mm"), to_si(rod.width_mm, "mm")
        p["axial_stiffness"] = modulus * depth * width / length
        p["bending_stiffness"] = modulus * width * depth**3 / 12 / length**3
        slowest = math.pi**2 * math.sqrt(p["bending_stiffness"] / p["rod_mass"])  # rad/s
        p["rod_damping"] = 2.0 * rod.damping_ratio / slowest


MODES = {  # of the rod: stiffness over E I / L^3 or E A / L, share of its mass that moves
    Coordinate.BEND_1: (math.pi**4 / 2, 0.5),
    Coordinate.BEND_2: (8 * math.pi**4, 0.5),
    Coordinate.STRETCH_MIDDLE: (16 / 3, 8 / 15),
    Coordinate.STRETCH: (7 / 3, 2 / 15),
}

# J: of an energy that is integrated beside the motion and moves nothing, so that it neither holds
# steps back nor distinguishes two motions
UNCONTROLLED = 1e12


def natural_sizes(p: Fields) -> np.ndarray:
    """Return the size of each number of the state, (n,), SI.

    Of deflections under the forces at hand; of what contacts carry as they slide.
    """
    sizes, n = np.ones(len(state_names(p))), int(p["freedoms"])
    length, speed = length_and_speed(p) if p["clearance"].any() else (1.0, 1.0)
    sizes[:n], sizes[n : 2 * n] = length, speed
    if p["carries"]:
        stiffness, dynamic = float(p["bristle_stiffness"]), float(p["dynamic"])
        bristle = dynamic / stiffness if stiffness and dynamic else length
        sizes[2 * n : 2 * n + 4] = speed, speed, bristle, bristle
    if is_featured(p):
        _set_feature_sizes(p, sizes)
    return sizes


def _set_feature_sizes(p: Fields, sizes: np.ndarray) -> None:
    """Set the sizes of what a mechanism frees beside its joints."""
    n, sizes_of = int(p["freedoms"]), {}
    force = p["reciprocating_mass"] * p["crank_radius"] * p["omega"] ** 2 + static_load(p)
    if p["tilting"]:
        height = _guide_sizes(p, force)
        sizes_of[Coordinate.GUIDE] = height
        sizes_of[Coordinate.TILT] = height[0] / p["guide_length"], height[1] / p["guide_length"]
    for mode, (stiffness, share) in MODES.items() if p["elastic"] else ():
        bending = mode < Coordinate.STRETCH_MIDDLE
        stiffness *= p["bending_stiffness" if bending else "axial_stiffness"]
        load = force
        if bending:  # by the rod's own inertia
            load = p["rod_mass"] * p["crank_radius"] * p["omega"] ** 2
        size = load / stiffness
        sizes_of[mode] = size, size * math.sqrt(stiffness / (share * p["rod_mass"]))
    for coordinate, (size, rate) in sizes_of.items():
        place = p["at"][coordinate]
        sizes[place], sizes[n + place] = size, rate
    if p["driven"]:
        place = p["at"][Coordinate.CRANK]
        moving = p["reciprocating_mass"] + p["rod_mass"]
        inertia = p["crank_inertia"] + moving * p["crank_radius"] ** 2
        # a steep line holds the speed nearer than inertia does
        restoring = inertia * p["omega"] ** 2 + p["torque_slope"] * p["omega"]
        sizes[place] = min(1.0, force * p["crank_radius"] / restoring)
        sizes[place - 1] = sizes[place] / p["omega"]
    if p["elastic"]:
        sizes[p["rod_loss"]] = UNCONTROLLED


def _guide_sizes(p: Fields, force: float) -> tuple[float, float]:
    """Return the length (m) and speed (m/s) of the crosshead in its guide, as of a journal."""
    across = force * p["crank_ratio"] + p["reciprocating_mass"] * p["gravity"]
    stiffness, exponent = p["guide_stiffness"], p["guide_exponent"]
    depth = (across / stiffness) ** (1.0 / exponent)
    length = max(min(p["guide_clearance"], depth), 1e-3 * depth)
    tangent = exponent * stiffness * depth ** (exponent - 1.0)
    return length, length * math.sqrt(tangent / p["reciprocating_mass"])


def length_and_speed(p: Fields) -> tuple[float, float]:
    """Return the length (m) and speed (m/s) that absolute tolerances are relative to.

    The smaller of clearance and penetration under the forces at hand; the speed is that length at
    the contact's frequency, or that at which a film at the wall gives way, if that is less.
    """
    moving = p["reciprocating_mass"]
    force = moving * p["crank_radius"] * p["omega"] ** 2 + static_load(p)
    both = zip(p["clearance"].tolist(), p["stiffness"].tolist(), strict=True)
    joints = [joint for joint in both if joint[0] > 0.0]
    clearance = min(clearance for clearance, _ in joints)
    contact = elastic_form(max(stiffness for _, stiffness in joints), clearance, p)
    depth = contact.static_depth(force)
    length = max(min(clearance, depth), 1e-3 * depth)
    mass = min(p["rod_mass"], moving)
    speed = length * math.sqrt(contact.tangent(depth) / mass)
    if (damping := film_damping(p)) > 0.0:
        speed = min(speed, force / damping)
    return length, speed


def is_oiled(p: Fields) -> bool:
    """Return whether joints of a record have an oil film."""
    return has_chosen_forces(p) and bool(p["viscosity"] > 0.0)


def film_damping(p: Fields) -> float:
    """Return the damping (N s/m) of the stiffer film pressed against the wall; 0 of dry joints."""
    if not is_oiled(p):
        return 0.0
    clearance, joint = min((one, j) for j, one in enumerate(p["clearance"].tolist()) if one > 0.0)
    length, pin = p["film_length"][joint], p["pin_radius"][joint]
    size = 2.0 * length * p["viscosity"] * pin**3 / clearance**2
    return float(size * p["film_stiffest"][joint] / clearance)


def contact_sizes(p: Fields) -> tuple[float, float]:
    """Return the length (m) and speed (m/s) of the journals; of ideal joints no limit to steps."""
    return length_and_speed(p) if p["clearance"].any() else (math.inf, 1.0)


def absolute_tolerances(p: np.record, rtol: float) -> np.ndarray:
    """Return SciPy's atol, for the numbers of the state, and energy flows."""
    energy = (p.reciprocating_mass + p.rod_mass) * (p.crank_radius * p.omega) ** 2 / 2
    return rtol * np.concatenate((natural_sizes(p), np.full(FLOWS, energy)))


DEFLECTION_ROUNDS = 4  # in which the rod's deflection is found: nearly linear
MODE_SHIFT = 1e-7  # m, by which its modes are moved to learn how they answer


def initial_state(case: Case, p: np.record, shift: np.ndarray | float = 0.0) -> np.ndarray:
    """Return the state at time 0, (n,): shift (m) of the journals beside the case's own offsets.

    An elastic rod is bent as it is then, at rest in itself.
    """
    journals = offsets(case) + shift
    y = np.zeros(len(state_names(p)))
    start(journals, y, p)
    if is_featured(p) and p["elastic"]:
        deflect(p, y)
    return y


def deflect(p: np.record, y: np.ndarray) -> None:
    """Deflect the rod, in y, so that its modes are not accelerated: Newton's method."""
    n, first = int(p["freedoms"]), int(p["at"][Coordinate.BEND_1])
    modes = slice(first, first + 4)
    z = np.append(y, np.zeros(FLOWS))
    phases = np.zeros(1, dtype=np.int64)
    response = np.empty((4, 4))

    def accelerations(z: np.ndarray) -> np.ndarray:
        """Return the modes' accelerations, (4,), as a motion begins with z."""
        rates = np.empty_like(z)
        enter_segment(0.0, z, 0, phases, p)
        derivative_with_flows(0.0, z, phases[0], p, rates)
        return rates[n:][modes]

    for _ in range(DEFLECTION_ROUNDS):
        unmoved = accelerations(z)
        for mode in range(4):
            moved = z.copy()
            moved[first + mode] += MODE_SHIFT
            response[:, mode] = (accelerations(moved) - unmoved) / MODE_SHIFT
        z[modes] -= np.linalg.solve(response, unmoved)
    y[modes] = z[modes]

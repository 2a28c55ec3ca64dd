"""Piston force: the ideal gas cycle of one end or of both, measured gas, and the spring on a cam.

physics/README.md, Loads. The force is positive towards the crank. A load has four phases a
revolution (expansion, suction, compression, discharge); the caller names the phase, so that both
sides of a corner are exact. A cylinder's phase is the head end's plus four times the crank end's.

Gas is shut in at a dead centre, with the space that is there: in a worn machine the piston stands
beyond its ideal place. An integrator notes where in the phase (`begin_stroke`), in the bits above
the lowest four, so that whoever observes the motion later has it, too.
"""

import math

import numpy as np

from compressor.physics._jit import dispatch_on_record, inline_llvm, inner
from compressor.physics.kinematics import angle_at
from compressor.physics.record import CARD_NODES, CHOSEN_FORCES, Load, derive

GAS = int(Load.GAS)
SPRING = int(Load.SPRING)
CYLINDER = int(Load.CYLINDER)
CARD = int(Load.CARD)
PER_NODE = 2.0 * math.pi / CARD_NODES  # rad
EXPANSION, SUCTION, COMPRESSION, DISCHARGE = range(4)
PLACE_BITS = 4  # of a phase, below the piston's place
PLACE_UNIT = 2.0**-52  # m


@inline_llvm
def piston_place(phase):
    """Return how far (m) the piston was beyond its ideal place at the last dead centre."""
    return (phase >> PLACE_BITS) * PLACE_UNIT


@inline_llvm
def shut_in_force(phase, space, clearance, suction_force, discharge_force, p):
    """Return the force (N) of gas in one end of a cylinder with its valves shut, polytropic: Eq. 6.

    space: between piston and cover (m); clearance: the same at the end's own dead centre.
    """
    if phase >= COMPRESSION:
        return suction_force * ((clearance + 2.0 * p.crank_radius) / space) ** p.gas_exponent
    return discharge_force * (clearance / space) ** p.gas_exponent


@inline_llvm
def head_space(phase, x, p):
    """Return the head end's space (m) and the clearance (m) by which its gas was shut in."""
    space = p.rod_length + p.crank_radius + p.head_clearance - x
    return space, p.head_clearance - piston_place(phase)


@inline_llvm
def paper_force(phase, x, p):
    """Return the force (N) of the gas in the head end whose valves open and shut at angles."""
    number = phase & 3
    if number == SUCTION:
        return p.suction_force
    if number == DISCHARGE:
        return p.discharge_force
    space, clearance = head_space(phase, x, p)
    return shut_in_force(number, space, clearance, p.suction_force, p.discharge_force, p)


@inline_llvm
def end_force(phase, space, clearance, suction_force, discharge_force, p):
    """Return the force (N) of the gas in one end whose valves open where the pressures meet."""
    if suction_force == discharge_force:  # without a cycle
        return suction_force
    force = shut_in_force(phase, space, clearance, suction_force, discharge_force, p)
    return min(max(force, suction_force), discharge_force)


@inline_llvm
def cylinder_force(phase, x, p):
    """Return the force (N) of the gas on both faces of a piston, less the back pressure's."""
    space, clearance = head_space(phase, x, p)
    head = end_force(phase & 3, space, clearance, p.suction_force, p.discharge_force, p)
    crank = end_force(
        (phase >> 2) & 3, x - (p.rod_length - p.crank_radius) + p.crank_clearance,
        p.crank_clearance + piston_place(phase), p.crank_suction_force, p.crank_discharge_force, p,
    )  # fmt: skip
    return head - crank - p.back_force


@inner
def begin_stroke(t, deviation, i, phases, p):
    """Write into the phase of a segment where the piston was (m) at its last dead centre."""
    half_turns = p.omega * t / math.pi
    if abs(half_turns - math.floor(half_turns + 0.5)) < 1e-6:
        place = math.floor(deviation / PLACE_UNIT + 0.5)
    else:
        place = phases[i - 1] >> PLACE_BITS
    phases[i] = (phases[i] & ((1 << PLACE_BITS) - 1)) + (place << PLACE_BITS)


@inline_llvm
def spring_force(phase, x, v, deviation, deviation_rate, p):
    """Return the spring force (N) between piston and cam follower: Eq. 8-10, the cam closed."""
    late = phase >= COMPRESSION  # compared by size: LLVM makes no vector code of a `switch`
    if phase & 1:  # the follower moves with the ideal piston; else it dwells
        shortening = deviation + (p.spring_stroke if late else 0.0)
        rate = deviation_rate
    else:
        reach = p.rod_length - p.crank_radius
        start = reach if late else p.rod_length + p.crank_radius - p.spring_stroke
        shortening = x - start
        rate = v
    return p.preload + p.spring_stiffness * shortening + p.spring_damping * rate


@inline_llvm
def card_force(cos_theta, sin_theta, p):
    """Return the force (N) of the gas, less the back pressure's, at a crank angle."""
    place = math.atan2(sin_theta, cos_theta) / PER_NODE
    if place < 0.0:
        place += CARD_NODES
    node = int(place)
    s = place - node
    node %= CARD_NODES
    after = (node + 1) % CARD_NODES
    rise = p.card[after, 0] - p.card[node, 0]
    here, there = p.card[node, 1], p.card[after, 1]
    bend = (1.0 - s) * (here - rise) + s * (rise - there)
    return p.card[node, 0] + s * (rise + (1.0 - s) * bend)


@inline_llvm
def no_card(cos_theta, sin_theta, p):
    """Return 0: records of the default forces have no card."""
    return 0.0


measured_force = dispatch_on_record(CHOSEN_FORCES, card_force, no_card)


@inline_llvm
def piston_force(phase, x, v, motion, deviation_rate, p):
    """Return the piston force (N), positive towards the crank; x (m), v (m/s): of the crosshead."""
    if p.load == SPRING:
        return spring_force(phase, x, v, x - motion.x, deviation_rate, p)
    if p.load == GAS:
        return paper_force(phase, x, p) - p.back_force
    if p.load == CYLINDER:
        return cylinder_force(phase, x, p)
    if p.load == CARD:
        return measured_force(motion.cos_theta, motion.sin_theta, p)
    return 0.0


def static_load(p):
    """Return the greatest force (N) of the load of a record or dict on a piston at rest."""
    if p["load"] == Load.SPRING:
        return p["preload"] + p["spring_stiffness"] * p["spring_stroke"]
    if p["load"] in (Load.GAS, Load.CARD):
        return p["discharge_force"]
    if p["load"] == Load.CYLINDER:
        towards_crank = p["discharge_force"] - p["crank_suction_force"] - p["back_force"]
        towards_head = p["crank_discharge_force"] - p["suction_force"] + p["back_force"]
        return max(towards_crank, towards_head)
    return 0.0


def greatest_load(p):
    """Return an upper bound (N) of the load in the ideal machine; p: a record, or a dict."""
    if p["load"] == Load.SPRING:
        return static_load(p) + p["spring_damping"] * p["omega"] * p["crank_radius"]
    if p["load"] == Load.GAS:
        return max(static_load(p), p["back_force"])
    return static_load(p)


def gas_corners(p):
    """Return the ends (rad) of expansion, suction and compression of the ideal gas cycle, (3,).

    Raises ValueError when the gas left never expands to the suction pressure within the stroke.
    """
    crank_radius, rod_length = p["crank_radius"], p["rod_length"]
    head_clearance, exponent = p["head_clearance"], float(p["gas_exponent"])
    head = rod_length + crank_radius + head_clearance
    expansion_ratio = (p["discharge_force"] / p["suction_force"]) ** (1.0 / exponent)
    expansion = angle_at(head - head_clearance * expansion_ratio, crank_radius, rod_length)
    compressed_length = (2.0 * crank_radius + head_clearance) / expansion_ratio
    compression = angle_at(head - compressed_length, crank_radius, rod_length)
    return expansion, math.pi, 2.0 * math.pi - compression


def has_cycle(p, end=""):
    """Return whether the gas in an end of a cylinder has a cycle; end: "" of the head, "crank_"."""
    return p[f"{end}discharge_force"] > p[f"{end}suction_force"]


def crank_corners(p):
    """Return the angles (rad) at which the crank end's discharge and suction begin, or zeros."""
    if not has_cycle(p, "crank_"):
        return 0.0, 0.0
    crank_radius, rod_length, clearance = p["crank_radius"], p["rod_length"], p["crank_clearance"]
    ratio = p["crank_discharge_force"] / p["crank_suction_force"]
    expansion_ratio = ratio ** (1.0 / float(p["gas_exponent"]))
    cover = rod_length - crank_radius - clearance
    compressed = cover + (2.0 * crank_radius + clearance) / expansion_ratio
    expanded = cover + clearance * expansion_ratio
    discharge = angle_at(compressed, crank_radius, rod_length)
    return discharge, 2.0 * math.pi - angle_at(expanded, crank_radius, rod_length)


def cam_corners(crank_radius, rod_length, stroke):
    """Return the corners (rad) of the closed cam. Raises ValueError unless 0 < stroke < 2R."""
    if not 0.0 < stroke < 2.0 * crank_radius:
        raise ValueError(f"the stroke, {stroke} m, must lie within (0, {2 * crank_radius}) m")
    rise = angle_at(rod_length + crank_radius - stroke, crank_radius, rod_length)
    fall = angle_at(rod_length - crank_radius + stroke, crank_radius, rod_length)
    return rise, math.pi, 2.0 * math.pi - fall


def load_corners(p):
    """Return the corners (rad) of the record's load in the ideal motion, (3,).

    Zeros of a cylinder whose head end has no cycle. Raises ValueError as `gas_corners`.
    """
    if p["load"] == Load.GAS:  # of Eq. 13: 38.95, 180 and 294.2 degrees
        return math.radians(38.95), math.pi, math.radians(294.2)
    if p["load"] == Load.SPRING:
        return cam_corners(p["crank_radius"], p["rod_length"], p["spring_stroke"])
    if p["load"] == Load.CYLINDER and has_cycle(p):
        return gas_corners(p)
    return 0.0, 0.0, 0.0


def complete(p):
    """Fill the fields that follow from others. Raises ValueError as `load_corners`."""
    p["corners"] = load_corners(p)
    if p["load"] == Load.CYLINDER:
        p["crank_corners"] = crank_corners(p)
    derive(p)


def segments(p, duration):
    """Return edges (s), (n + 1,), and phases, (n,), into which ideal corners cut [0, duration]."""
    if p["load"] in (Load.NONE, Load.CARD):
        return np.array([0.0, duration]), np.zeros(1, dtype=np.int64)
    angles, cycle = (0.0, *p["corners"]), (0, 1, 2, 3)
    if p["load"] == Load.CYLINDER:
        angles, cycle = cylinder_phases(p)
    turn = 2.0 * math.pi / p["omega"]
    revolutions = np.arange(math.ceil(duration / turn * (1 + 1e-9)))
    starts = (revolutions[:, None] * turn + np.array(angles) / p["omega"]).ravel()
    phases = np.array(cycle)[np.arange(starts.searchsorted(duration - 1e-9 * turn)) % len(cycle)]
    return np.append(starts[: phases.size], duration), phases


def cylinder_phases(p):
    """Return the angles (rad), from 0 on, at which phases of a cylinder begin, and these."""
    head = crank = [(0.0, SUCTION)]  # without a cycle: as where the suction valve stays open
    if has_cycle(p):
        head = [(angle, i) for i, angle in enumerate((0.0, *p["corners"]))]
    if has_cycle(p, "crank_"):
        full, empty = p["crank_corners"]
        crank = [(0.0, COMPRESSION), (full, DISCHARGE), (math.pi, EXPANSION), (empty, SUCTION)]
    angles = [0.0]
    for angle in sorted(angle for angle, _ in (*head, *crank)):
        if angle > angles[-1] + 2e-9 * math.pi:
            angles.append(angle)
    phases = [_phase_at(angle, head) + 4 * _phase_at(angle, crank) for angle in angles]
    return angles, tuple(phases)


def _phase_at(angle, corners):
    """Return the phase of an end that begins at an angle (rad), or a billionth of a turn later."""
    return [phase for begin, phase in corners if begin <= angle + 2e-9 * math.pi][-1]


def sample_segments(times, edges):
    """Return the number of the segment of each sample; on a corner the one that begins there.

    A sample within a billionth of a segment of an edge counts as on it.
    """
    slack = 1e-9 * (edges[1:] - edges[:-1]).min()
    numbers = np.searchsorted(edges[:-1], times + slack, side="right") - 1
    return np.maximum(np.minimum(numbers, edges.size - 2), 0)

"""Piston force: the ideal gas cycle of one end or of both, and the spring on a cam.

physics/README.md, Loads.

The force is positive towards the crank. A load has four phases a revolution (expansion, suction,
compression, discharge); the caller names the phase, so that both sides of a corner are exact. A
cylinder's two ends have phases of their own, and its phase is the head end's plus four times the
crank end's.
"""

import math
from functools import lru_cache

import numpy as np

from compressor.physics._jit import inline_llvm
from compressor.physics.kinematics import angle_at
from compressor.physics.record import Load, derive

GAS = int(Load.GAS)
SPRING = int(Load.SPRING)
CYLINDER = int(Load.CYLINDER)
EXPANSION, SUCTION, COMPRESSION, DISCHARGE = range(4)


@inline_llvm
def end_force(phase, space, clearance, suction_force, discharge_force, p):
    """Return the force (N) of the gas in one end of a cylinder: Eq. 6, polytropic.

    phase: the end's. space: between piston and cover (m); clearance: the least that it may be. The
    forces are those while its valves are open.
    """
    if phase == 1:
        return suction_force
    if phase == 3:
        return discharge_force
    if phase == 0:
        full = clearance
        force = discharge_force
    else:
        full = clearance + 2.0 * p.crank_radius
        force = suction_force
    return force * (full / space) ** p.gas_exponent


@inline_llvm
def head_force(phase, x, p):
    """Return the force (N) of the gas in the head end; x: of the crosshead (m)."""
    space = p.rod_length + p.crank_radius + p.head_clearance - x
    return end_force(phase, space, p.head_clearance, p.suction_force, p.discharge_force, p)


@inline_llvm
def cylinder_force(phase, x, p):
    """Return the force (N) of the gas on both faces of a piston, less the back pressure's.

    phase: the head end's plus four times the crank end's; x: of the crosshead (m).
    """
    crank = end_force(
        phase >> 2, x - (p.rod_length - p.crank_radius) + p.crank_clearance, p.crank_clearance,
        p.crank_suction_force, p.crank_discharge_force, p,
    )  # fmt: skip
    return head_force(phase & 3, x, p) - crank - p.back_force


@inline_llvm
def spring_force(phase, x, v, deviation, deviation_rate, p):
    """Return the spring force (N) between piston and cam follower: Eq. 8-10, with the cam closed.

    x (m), v (m/s) of the crosshead and their deviations from the ideal motion. While the follower
    moves with the ideal piston the spring sees the deviation alone.
    """
    late = phase >= COMPRESSION  # compared by size: LLVM makes no vector code of a `switch`
    if phase & 1:  # the follower dwells
        shortening = deviation + (p.spring_stroke if late else 0.0)
        rate = deviation_rate
    else:
        reach = p.rod_length - p.crank_radius
        start = reach if late else p.rod_length + p.crank_radius - p.spring_stroke
        shortening = x - start
        rate = v
    return p.preload + p.spring_stiffness * shortening + p.spring_damping * rate


@inline_llvm
def piston_force(phase, x, v, deviation, deviation_rate, p):
    """Return the piston force (N), positive towards the crank, of the record's load."""
    if p.load == SPRING:
        return spring_force(phase, x, v, deviation, deviation_rate, p)
    if p.load == GAS:
        return head_force(phase, x, p) - p.back_force
    if p.load == CYLINDER:
        return cylinder_force(phase, x, p)
    return 0.0


def static_load(p):
    """Return the greatest force (N) of the record's load on a piston that stands still.

    p: a record, or a dict with its fields; the spring's at its full stroke (Eq. 8-10), or that of
    the discharge pressure, of a cylinder at the end where it presses harder, or a card's greatest.
    """
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
    """Return an upper bound (N) of the load in the ideal machine.

    p: a record, or a dict with its fields.
    """
    if p["load"] == Load.SPRING:
        return static_load(p) + p["spring_damping"] * p["omega"] * p["crank_radius"]
    if p["load"] == Load.GAS:
        return max(static_load(p), p["back_force"])
    return static_load(p)


def printed_corners():
    """Return Eq. 13's corners (rad): 38.95, 180 and 294.2 degrees."""
    return math.radians(38.95), math.pi, math.radians(294.2)


def gas_corners(p, pressure_ratio):
    """Return the exact corners of the ideal gas cycle (rad), (3,).

    The ends of expansion, suction and compression. `pressure_ratio`: p_d / p_s. Raises ValueError
    when the gas left in the head clearance never expands to the suction pressure within the stroke.
    """
    crank_radius, rod_length = p["crank_radius"], p["rod_length"]
    head_clearance, exponent = p["head_clearance"], float(p["gas_exponent"])
    head = rod_length + crank_radius + head_clearance
    expansion_ratio = pressure_ratio ** (1.0 / exponent)
    expansion = angle_at(head - head_clearance * expansion_ratio, crank_radius, rod_length)
    compressed_length = (2.0 * crank_radius + head_clearance) / expansion_ratio
    compression = angle_at(head - compressed_length, crank_radius, rod_length)
    return expansion, math.pi, 2.0 * math.pi - compression


def has_cycle(p, end=""):
    """Return whether the gas in an end of a cylinder has a cycle; end: "" of the head, "crank_"."""
    return p[f"{end}discharge_force"] > p[f"{end}suction_force"]


def head_corners(p):
    """Return the corners (rad) of the head end of a cylinder, (3,); zeros where it has no cycle.

    Raises ValueError as `gas_corners`.
    """
    if not has_cycle(p):
        return 0.0, 0.0, 0.0
    return gas_corners(p, p["discharge_force"] / p["suction_force"])


def crank_corners(p):
    """Return the corners (rad) of the crank end of a cylinder, (2,); zeros where it has no cycle.

    Its discharge and its suction begin there; its compression does at 0, its expansion at pi.
    Raises ValueError as `gas_corners`.
    """
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
    """Return the corners (rad) of the closed cam, whose follower dwells for `stroke` (m) each way.

    84.2608, 180 and 275.7392 degrees in the paper. Raises ValueError unless 0 < stroke < 2R.
    """
    if not 0.0 < stroke < 2.0 * crank_radius:
        raise ValueError(f"the stroke, {stroke} m, must lie within (0, {2 * crank_radius}) m")
    rise = angle_at(rod_length + crank_radius - stroke, crank_radius, rod_length)
    fall = angle_at(rod_length - crank_radius + stroke, crank_radius, rod_length)
    return rise, math.pi, 2.0 * math.pi - fall


def load_corners(p, pressure_ratio, printed):
    """Return the corners (rad) of the record's load, (3,).

    printed: of a gas those of Eq. 13, not the exact ones.
    """
    if p["load"] in (Load.NONE, Load.CARD):
        return 0.0, 0.0, 0.0
    if p["load"] == Load.SPRING:
        return cam_corners(p["crank_radius"], p["rod_length"], p["spring_stroke"])
    if p["load"] == Load.CYLINDER:
        return head_corners(p)
    return printed_corners() if printed else gas_corners(p, pressure_ratio)


def complete(p, pressure_ratio, printed):
    """Fill the fields of a record that follow from its others, its corners as by `load_corners`.

    p: a record, or a dict with its fields. Raises ValueError as `gas_corners` and `cam_corners`.
    """
    p["corners"] = load_corners(p, pressure_ratio, printed)
    if p["load"] == Load.CYLINDER:
        p["crank_corners"] = crank_corners(p)
    derive(p)


def segments(p, duration):
    """Return the segments into which the load's corners cut [0, duration] (s).

    Returns edges, shape (n + 1,) in s, and phases, shape (n,), which are not to be written: other
    runs have the same. A corner closer than a billionth of a turn to the end opens no segment of
    its own.
    """
    if p["load"] in (Load.NONE, Load.CARD):
        return np.array([0.0, duration]), np.zeros(1, dtype=np.int64)
    corners, phases = p["corners"].tobytes(), (0, 1, 2, 3)
    if p["load"] == Load.CYLINDER:
        angles, phases = cylinder_phases(p)
        corners = np.array(angles[1:]).tobytes()
    return _segments_between(corners, phases, float(p["omega"]), duration)


def cylinder_phases(p):
    """Return the angles (rad), from 0 on, at which phases of a cylinder begin, and these.

    Corners of its ends that are closer than a billionth of a turn are one.
    """
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


@lru_cache(maxsize=64)
def _segments_between(corners, cycle, omega, duration):
    """Return `segments` of a load's corners (rad, as bytes) at a speed (rad/s).

    cycle: the phases of a revolution; the first begins at 0 and the others at corners.
    """
    turn = 2.0 * math.pi / omega
    starts = np.zeros(len(cycle))
    starts[1:] = np.frombuffer(corners) / omega
    revolutions = np.arange(math.ceil(duration / turn * (1 + 1e-9)))
    starts = (revolutions[:, None] * turn + starts).ravel()
    phases = np.array(cycle)[np.arange(starts.searchsorted(duration - 1e-9 * turn)) % len(cycle)]
    edges = np.full(phases.size + 1, duration)
    edges[:-1] = starts[: phases.size]
    return edges, phases


def sample_segments(times, edges):
    """Return the number of the segment of each sample, shape of times.

    times, edges: s. On a corner it is the segment that begins there, at the end the last one. A
    sample within a billionth of a segment of an edge counts as on it.
    """
    slack = 1e-9 * (edges[1:] - edges[:-1]).min()
    numbers = np.searchsorted(edges[:-1], times + slack, side="right") - 1
    return np.maximum(np.minimum(numbers, edges.size - 2), 0)

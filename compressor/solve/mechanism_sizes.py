"""Natural sizes of the general mechanism's coordinates, which tolerances are relative to."""

import math

import numpy as np

from compressor.physics import Coordinate, state_names, static_load

MODES = {  # of the rod: stiffness over E I / L^3 or E A / L, share of its mass that moves
    Coordinate.BEND_1: (math.pi**4 / 2, 0.5),
    Coordinate.BEND_2: (8 * math.pi**4, 0.5),
    Coordinate.STRETCH_MIDDLE: (16 / 3, 8 / 15),
    Coordinate.STRETCH: (7 / 3, 2 / 15),
}

# J: of an energy that is integrated beside the motion and moves nothing, so that it neither holds
# steps back nor tells two motions apart
UNCONTROLLED = 1e12


def mechanism_sizes(p: np.record, joints: tuple[float, float], bristle: float) -> np.ndarray:
    """Return the size of each number of a mechanism's state, (n,): deflections under the forces at
    hand.

    joints: length (m) and speed (m/s) of the journals in their bores; bristle: of bristles (m).
    """
    sizes = np.ones(len(state_names(p)))
    n = int(p["freedoms"])
    force = p["reciprocating_mass"] * p["crank_radius"] * p["omega"] ** 2 + static_load(p)
    each = {Coordinate(one): joints for one in range(Coordinate.BIG_X, Coordinate.GUIDE)}
    if p["tilting"]:
        height = _guide_sizes(p, force)
        each[Coordinate.GUIDE] = height
        each[Coordinate.TILT] = height[0] / p["guide_length"], height[1] / p["guide_length"]
    for mode, (stiffness, share) in MODES.items() if p["elastic"] else ():
        bending = mode < Coordinate.STRETCH_MIDDLE
        stiffness *= p["bending_stiffness" if bending else "axial_stiffness"]
        pressed = force
        if bending:  # by the rod's own inertia
            pressed = p["rod_mass"] * p["crank_radius"] * p["omega"] ** 2
        size = pressed / stiffness
        each[mode] = size, size * math.sqrt(stiffness / (share * p["rod_mass"]))
    for coordinate, (size, rate) in each.items():
        place = p["at"][coordinate]
        if place >= 0:
            sizes[place], sizes[n + place] = size, rate
    sizes[2 * n : 2 * n + 4] = joints[1], joints[1], bristle, bristle
    if p["driven"]:
        place = p["at"][Coordinate.CRANK]
        moving = p["reciprocating_mass"] + p["rod_mass"]
        inertia = p["crank_inertia"] + moving * p["crank_radius"] ** 2
        # a steep line holds the speed nearer than inertia does
        held = inertia * p["omega"] ** 2 + p["torque_slope"] * p["omega"]
        sizes[place] = min(1.0, force * p["crank_radius"] / held)
        sizes[place - 1] = sizes[place] / p["omega"]
    if p["elastic"]:
        sizes[p["rod_loss"]] = UNCONTROLLED
    return sizes


def _guide_sizes(p: np.record, force: float) -> tuple[float, float]:
    """Return the length (m) and speed (m/s) of the crosshead in its guide, as of a journal."""
    across = force * p["crank_ratio"] + p["reciprocating_mass"] * p["gravity"]
    stiffness, exponent = p["guide_stiffness"], p["guide_exponent"]
    depth = (across / stiffness) ** (1.0 / exponent)
    length = max(min(p["guide_clearance"], depth), 1e-3 * depth)
    tangent = exponent * stiffness * depth ** (exponent - 1.0)
    return length, length * math.sqrt(tangent / p["reciprocating_mass"])

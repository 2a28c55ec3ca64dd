"""The sizes that tolerances are relative to, from a record alone."""

import math

import numpy as np

from compressor.physics import (
    FLOWS,
    elastic_form,
    is_featured,
    state_names,
    static_load,
)
from compressor.solve.mechanism_sizes import mechanism_sizes


def length_and_speed(p: np.record) -> tuple[float, float]:
    """Return the length (m) and speed (m/s) that absolute tolerances are relative to.

    The length is the smaller of the clearance and the penetration under the forces at hand, but
    not below a thousandth of the latter; the speed is that length at the contact's frequency, or
    that at which a film against the wall gives way to the forces, if that is less.
    """
    moving = p["reciprocating_mass"]
    force = moving * p["crank_radius"] * p["omega"] ** 2 + static_load(p)
    joints = [j for j in zip(p["clearance"].tolist(), p["stiffness"], strict=True) if j[0] > 0.0]
    clearance = min(clearance for clearance, _ in joints)
    contact = elastic_form(max(stiffness for _, stiffness in joints), clearance, p)
    depth = contact.static_depth(force)
    length = max(min(clearance, depth), 1e-3 * depth)
    mass = min(p["rod_mass"], moving)
    speed = length * math.sqrt(contact.tangent(depth) / mass)
    if (damping := film_damping(p)) > 0.0:
        speed = min(speed, force / damping)
    return length, speed


def film_damping(p: np.record) -> float:
    """Return the damping (N s/m) of a film that is pressed against the wall; 0 of dry joints.

    Of the joint with the smaller clearance, whose film is the stiffer one.
    """
    if not is_featured(p) or p["viscosity"] == 0.0:
        return 0.0
    clearance, joint = min((one, j) for j, one in enumerate(p["clearance"].tolist()) if one > 0.0)
    size = 2.0 * p["film_length"] * p["viscosity"] * p["pin_radius"][joint] ** 3 / clearance**2
    return float(size * p["film_constants"][joint, -1] / clearance)


def natural_sizes(p: np.record) -> np.ndarray:
    """Return the size of each number of the state: deviations (m, rad), their rates (per s), shape
    (2 n,).

    With chosen laws also of what contacts carry (`state_names`): speeds, bristles as they slide.
    """
    if is_featured(p):
        joints = length_and_speed(p) if p["clearance"].any() else (1.0, 1.0)
        return mechanism_sizes(p, joints, bristle_size(p, joints[0]))
    length, speed = length_and_speed(p)
    n = int(p["freedoms"])
    sizes = np.full(2 * n, length)
    sizes[n:] = speed
    sizes[n - 1 :: n] *= 1.0 / p["rod_length"]  # the last freedom is an angle
    more = len(state_names(p)) - sizes.size
    if not more:
        return sizes
    bent = bristle_size(p, length)
    return np.concatenate((sizes, np.full(2, speed), np.full(2, bent)))


def bristle_size(p: np.record, length: float) -> float:
    """Return the deflection (m) of bristles that slide; a length where there are none."""
    stiffness = float(p["bristle_stiffness"])
    return float(p["dynamic"]) / stiffness if stiffness and p["dynamic"] else length


def contact_sizes(p: np.record, sizes: np.ndarray) -> tuple[float, float]:
    """Return the length (m) and speed (m/s) of the journals in their bores, of sizes by
    `natural_sizes`.

    Of a mechanism with ideal joints no step need be as short as theirs.
    """
    if not is_featured(p):
        return sizes[0], sizes[sizes.size // 2]
    return length_and_speed(p) if p["clearance"].any() else (math.inf, 1.0)


def absolute_tolerances(p: np.record, rtol: float) -> np.ndarray:
    """Return SciPy's atol, for the numbers of the state, and energy flows."""
    energy = (p.reciprocating_mass + p.rod_mass) * (p.crank_radius * p.omega) ** 2 / 2
    return rtol * np.concatenate((natural_sizes(p), np.full(FLOWS, energy)))

"""The sizes that tolerances are relative to, from a record alone."""

import math

import numpy as np

from compressor.physics import FLOWS, FREEDOMS, Scene, elastic_form, static_load


def length_and_speed(p: np.record) -> tuple[float, float]:
    """Length (m) and speed (m/s) that absolute tolerances are relative to.

    The length is the smaller of the clearance and the penetration under the forces at hand, but
    not below a thousandth of the latter; the speed is that length at the contact's frequency.
    """
    force = p["reciprocating_mass"] * p["crank_radius"] * p["omega"] ** 2 + static_load(p)
    faulty = p["clearance"] > 0
    contact = elastic_form(p["stiffness"][faulty].max(), p)
    depth = contact.static_depth(force)
    length = max(min(p["clearance"][faulty].min(), depth), 1e-3 * depth)
    mass = min(p["rod_mass"], p["reciprocating_mass"])
    return length, length * math.sqrt(contact.tangent(depth) / mass)


def natural_sizes(p: np.record) -> np.ndarray:
    """Size of each number of the motion, shape (2 n,): deviations (m, rad), their rates (per s)."""
    length, speed = length_and_speed(p)
    per_unit = np.ones(FREEDOMS[Scene(int(p["scene"]))])
    per_unit[-1] = 1.0 / p["rod_length"]  # the last freedom is an angle
    return np.concatenate((length * per_unit, speed * per_unit))


def absolute_tolerances(p: np.record, rtol: float) -> np.ndarray:
    """SciPy's atol, shape (2 n + 4,), for the scene's deviations, their rates, energy flows."""
    energy = (p.reciprocating_mass + p.rod_mass) * (p.crank_radius * p.omega) ** 2 / 2
    return rtol * np.concatenate((natural_sizes(p), np.full(FLOWS, energy)))

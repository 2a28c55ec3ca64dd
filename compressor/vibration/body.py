"""A compressor's body on its foundation: a rigid body that the machine's forces drive one way.

It moves along x, along y, and by rocking about its mass centre C, three oscillators without
coupling: the foundation's centre of stiffness lies at C. The casing above it has a mode at the
crosshead guide and one at the main bearing, each driven by the force there along y and along x.
"""

from dataclasses import dataclass

import numpy as np

from compressor.cases import Body
from compressor.vibration.linear import Motion, oscillate


@dataclass(frozen=True)
class Forces:
    """What acts on the body at n equal steps: `step` s, forces N as (n, 2), moment N m as (n,).

    `shaking`: of the machine on its frame; `moment`: of the same about the crank's centre,
    counter-clockwise; `guide`, `bearing`: the parts of it at the guide and the main bearing.
    """

    step: float
    shaking: np.ndarray
    moment: np.ndarray
    guide: np.ndarray
    bearing: np.ndarray


@dataclass(frozen=True)
class BodyMotion:
    """The mass centre along x and y, and rocking (rad), each a `Motion`; nothing where held."""

    x: Motion
    y: Motion
    rocking: Motion

    def acceleration(self, axis: str, point: tuple[float, float]) -> np.ndarray:
        """Return the acceleration (m/s2, (n,)) along an axis of a point, in m from the mass centre.

        Small angles: what rocking adds by its rate squared is left out, as in the equations.
        """
        if axis == "x":
            return self.x.acceleration - point[1] * self.rocking.acceleration
        return self.y.acceleration + point[0] * self.rocking.acceleration


def centre(body: Body) -> tuple[float, float]:
    """Return the mass centre from the crank's, m."""
    return body.centre_x_mm / 1e3, body.centre_y_mm / 1e3


def body_motion(body: Body, forces: Forces, steady: bool) -> BodyMotion:
    """Return the rigid body's motion under forces, from rest or `steady` (`oscillate`)."""
    x, y = centre(body)
    shaking = forces.shaking
    moment = forces.moment - x * shaking[:, 1] + y * shaking[:, 0]
    driven = {
        "x": (shaking[:, 0] / body.mass_kg, body.frequency_x_Hz),
        "y": (shaking[:, 1] / body.mass_kg, body.frequency_y_Hz),
        "rocking": (moment / body.inertia_kg_m2, body.frequency_rocking_Hz),
    }
    free = [*body.freedoms.partition("_")[0]] + ["rocking"] * body.freedoms.endswith("rocking")
    still = Motion(*(np.zeros(len(shaking)),) * 3)
    motions = {
        name: oscillate(force, forces.step, frequency, body.damping_ratio, steady)
        if name in free
        else still
        for name, (force, frequency) in driven.items()
    }
    return BodyMotion(**motions)


def casing_acceleration(body: Body, force: np.ndarray, step: float) -> np.ndarray:
    """Return the acceleration (m/s2, (n,)) of a casing mode against the body, by the force (N) at
    its place.

    A mode of some hundred Hz and more forgets its start within a revolution; it starts at rest.
    """
    how = body.casing_frequency_Hz, body.casing_damping_ratio
    assert body.casing_mass_kg is not None  # as of a Case, which fills it in
    return oscillate(force / body.casing_mass_kg, step, *how).acceleration

"""A compressor's body on its foundation: a rigid body that the machine's forces drive one way.

It moves along x, along y, and by rocking about its mass centre C, three oscillators without
coupling: the foundation's centre of stiffness lies at C. The casing above it has a mode at the
crosshead guide and one at the main bearing, each driven by the force there along y and along x.

Between samples a force is a cubic (a spline through them), for which each step of an oscillator is
exact: no integrator's error and no limit on the step, however stiff it is.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import CubicSpline
from scipy.linalg import expm
from scipy.ndimage import spline_filter1d

from compressor.cases import Body


class OscillatorMotion(NamedTuple):
    """Displacement, velocity and acceleration at the samples of the force, each (n,)."""

    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


BodyMotion = dict[str, OscillatorMotion]  # of the mass centre along x and y, of `rocking` (rad)


def oscillate(
    force: np.ndarray, step: float, frequency: float, damping_ratio: float, steady: bool = False,
    start: tuple[float, float] = (0.0, 0.0),
) -> OscillatorMotion:  # fmt: skip
    """Return the motion q'' + 2 zeta w q' + w^2 q = f of an oscillator.

    force: f, per unit of modal mass, at n >= 4 equal steps, (n,); step: s; frequency: w / 2 pi, Hz;
    damping_ratio: zeta, between 0 and 1; start: q and q' at the first sample, by default at rest;
    steady: instead the motion that repeats itself with the samples; the last one stands for the
    first of the next period. Raises ValueError for other damping.

    One complex unknown, z = q' - conj(s) q with z' = s z + f and s = w (-zeta + i sqrt(1-zeta^2)),
    carries both q = Im z / Im s and q'. Over a step, z' = s z + cubic has a closed form.
    """
    from scipy.signal import lfilter  # takes half a second, of machines with a body alone

    if not 0.0 < damping_ratio < 1.0:
        raise ValueError(f"a damping ratio lies between 0 and 1, not at {damping_ratio:g}")
    omega = 2.0 * np.pi * frequency
    root = omega * complex(-damping_ratio, np.sqrt(1.0 - damping_ratio**2))
    cubics = periodic_cubics(force, step) if steady else CubicSpline(
        step * np.arange(len(force)), force
    ).c[::-1]  # fmt: skip
    whole, shares = one_step(root, step)
    # products of real matrices: the cubics, of rising powers, have no imaginary part
    driven = shares.real @ cubics + 1j * (shares.imag @ cubics)
    first = start[1] - root.conjugate() * start[0]
    if steady:  # z0 = what the force leaves of rest + exp(s T) z0: a period ends as it began
        left = lfilter([1.0], [1.0, -whole], driven)[-1]
        first = left / (1.0 - np.exp(root * step * (len(force) - 1)))
    z = np.empty(len(force), complex)
    z[0] = first
    z[1:], _ = lfilter([1.0], [1.0, -whole], driven, zi=np.array([whole * first]))
    displacement = z.imag / root.imag
    velocity = z.real + root.real * displacement
    acceleration = force + 2.0 * root.real * velocity - omega**2 * displacement
    return OscillatorMotion(displacement, velocity, acceleration)


# of a cubic B-spline: rising powers of the way through a piece by its four coefficients
B_SPLINE = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6.0


def periodic_cubics(force: np.ndarray, step: float) -> np.ndarray:
    """Return the pieces of the cubic spline through samples that repeat themselves, (4, n - 1).

    By rising powers of the time (s) since a piece's begin. The last sample stands for the first.
    """
    weights = spline_filter1d(force[:-1], order=3, mode="grid-wrap")
    around = np.concatenate((weights[-1:], weights, weights[:2]))
    pieces = B_SPLINE @ sliding_window_view(around, 4).T
    return pieces / step ** np.arange(4.0)[:, None]


def one_step(root: complex, step: float) -> tuple[complex, np.ndarray]:
    """Return exp(s h), and the integrals of exp(s (h - t)) t^j over a step, (4,).

    From the exponential of the matrix that generates them (Van Loan 1978).
    """
    matrix = np.diag([root * step, 0.0, 0.0, 0.0, 0.0])
    matrix += np.diag([step, 1.0, 2.0, 3.0], 1)  # d(t^j)/dt = j t^(j-1), over a step of length 1
    result = expm(matrix)
    return result[0, 0], result[0, 1:] * step ** np.arange(4)


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


def point_acceleration(motion: BodyMotion, axis: str, point: tuple[float, float]) -> np.ndarray:
    """Return the acceleration (m/s2, (n,)) along an axis of a point, in m from the mass centre.

    Small angles: what rocking adds by its rate squared is left out, as in the equations.
    """
    lever = -point[1] if axis == "x" else point[0]
    return motion[axis].acceleration + lever * motion["rocking"].acceleration


def centre(body: Body) -> tuple[float, float]:
    """Return the mass centre from the crank's, m."""
    return body.centre_x_mm / 1e3, body.centre_y_mm / 1e3


def body_motion(body: Body, forces: Forces, steady: bool) -> BodyMotion:
    """Return the rigid body's motion under forces, from rest or `steady`, as by `oscillate`."""
    x, y = centre(body)
    shaking = forces.shaking
    moment = forces.moment - x * shaking[:, 1] + y * shaking[:, 0]
    driven = {
        "x": (shaking[:, 0] / body.mass_kg, body.frequency_x_Hz),
        "y": (shaking[:, 1] / body.mass_kg, body.frequency_y_Hz),
        "rocking": (moment / body.inertia_kg_m2, body.frequency_rocking_Hz),
    }
    free = [*body.freedoms.partition("_")[0]] + ["rocking"] * body.freedoms.endswith("rocking")
    motions = dict.fromkeys(driven, OscillatorMotion(*np.zeros((3, len(shaking)))))
    for name in free:
        force, frequency = driven[name]
        motions[name] = oscillate(force, forces.step, frequency, body.damping_ratio, steady)
    return motions


def casing_motion(
    body: Body, force: np.ndarray, step: float, steady: bool = False,
    start: tuple[float, float] = (0.0, 0.0),
) -> OscillatorMotion:  # fmt: skip
    """Return a casing mode's motion against the body under a force (N, (n,)): see `oscillate`."""
    mode = body.casing_frequency_Hz, body.casing_damping_ratio
    assert body.casing_mass_kg is not None  # as of a Case, which fills it in
    return oscillate(force / body.casing_mass_kg, step, *mode, steady, start)

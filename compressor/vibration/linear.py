"""Exact motion of linear oscillators under sampled forces.

Between samples the force is a cubic (a spline through them), for which each step is exact: no
integrator's error and no limit on the step, however stiff the oscillator is.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm
from scipy.signal import lfilter

DEGREE = 3


class Motion(NamedTuple):
    """Displacement, velocity and acceleration at the samples of the force, each (n,)."""

    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def oscillate(
    force: np.ndarray, step: float, frequency: float, damping_ratio: float, steady: bool = False
) -> Motion:
    """Return the motion q'' + 2 zeta w q' + w^2 q = f of an oscillator.

    force: f, per unit of modal mass, at n >= 4 equal steps, (n,); step: s; frequency: w / 2 pi, Hz;
    damping_ratio: zeta, between 0 and 1. From rest at the first sample; `steady`: instead the
    motion that repeats itself with the samples, the last of which stands for the first of the next
    period. Raises ValueError for other damping, or fewer samples.

    One complex unknown, z = q' - conj(s) q with z' = s z + f and s = w (-zeta + i sqrt(1-zeta^2)),
    carries both q = Im z / Im s and q'. Over a step, z' = s z + cubic has a closed form, taken from
    the exponential of the matrix that generates it (Van Loan 1978).
    """
    if not 0.0 < damping_ratio < 1.0:
        raise ValueError(f"a damping ratio lies between 0 and 1, not at {damping_ratio:g}")
    if len(force) <= DEGREE:
        raise ValueError(f"{len(force)} samples of a force are too few: at least {DEGREE + 1}")
    omega = 2.0 * np.pi * frequency
    root = omega * complex(-damping_ratio, np.sqrt(1.0 - damping_ratio**2))
    held = pieces(force, step, steady)
    whole, shares = one_step(root, step)
    driven = shares.real @ held + 1j * (shares.imag @ held)
    start = 0.0j
    if steady:
        start = final(whole, driven) / (1.0 - np.exp(root * step * (len(force) - 1)))
    z = np.empty(len(force), complex)
    z[0] = start
    z[1:], _ = lfilter([1.0], [1.0, -whole], driven, zi=np.array([whole * start]))
    displacement = z.imag / root.imag
    velocity = z.real + root.real * displacement
    acceleration = force + 2.0 * root.real * velocity - omega**2 * displacement
    return Motion(displacement, velocity, acceleration)


def pieces(force: np.ndarray, step: float, periodic: bool) -> np.ndarray:
    """Return the cubic between each two samples: its coefficients of 1, s, s^2, s^3, (4, n - 1)."""
    if periodic:
        force = np.append(force[:-1], force[0])
    times = step * np.arange(len(force))
    spline = CubicSpline(times, force, bc_type="periodic" if periodic else "not-a-knot")
    return spline.c[::-1]


def one_step(root: complex, step: float) -> tuple[complex, np.ndarray]:
    """Return the exp(s h), and the integrals of exp(s (h - t)) t^j over a step, (4,)."""
    matrix = np.zeros((DEGREE + 2, DEGREE + 2), complex)
    matrix[0, 0], matrix[0, 1] = root * step, step
    for power in range(1, DEGREE + 1):
        matrix[power, power + 1] = power  # d(t^j)/dt = j t^(j-1), over a step of length 1
    result = expm(matrix)
    return result[0, 0], result[0, 1:] * step ** np.arange(DEGREE + 1)


def final(whole: complex, driven: np.ndarray) -> complex:
    """Return where an oscillator is after all steps, from rest."""
    return lfilter([1.0], [1.0, -whole], driven)[-1]

"""Ideal motion of the slider-crank.

Frame and signs: crank centre at the origin, x along the cylinder, theta = 0 at top dead centre, rod
direction from big end to small end (cos phi, -sin phi) (physics/README.md, Frame).
"""

import math
from typing import NamedTuple

import numpy as np

from compressor.physics._jit import inline_llvm, jit, square_root

MAX_SERIES_ANGLE = 0.1  # rad: the widest angle at which the series of `small_angle` lack nothing
# their coefficients: faster than to divide
S3, S5, S7, S9 = -1 / 6, 1 / 120, -1 / 5040, 1 / 362880
C4, C6, C8 = 1 / 24, -1 / 720, 1 / 40320


class IdealMotion(NamedTuple):
    """The ideal motion at one time: rad, m and s; x counts from the crank centre."""

    cos_theta: float
    sin_theta: float
    sin_phi: float
    cos_phi: float
    rate: float  # of phi
    spin_up: float  # second derivative of phi
    x: float
    v: float
    a: float


@jit
def ideal(t, p):
    """Return the `IdealMotion` at time t (s): Eq. 1 exactly, with its derivatives."""
    theta = p.omega * t
    return ideal_at(math.cos(theta), math.sin(theta), p)


@inline_llvm
def ideal_at(cos_theta, sin_theta, p):
    """Return the `IdealMotion` at a crank angle given by its cosine and sine."""
    ratio = p.crank_ratio
    sin_phi = ratio * sin_theta
    cos_phi = square_root((1.0 - sin_phi) * (1.0 + sin_phi))
    per_cos = 1.0 / cos_phi
    rate = ratio * p.omega * cos_theta * per_cos
    spin_up = sin_phi * (rate * rate - p.omega * p.omega) * per_cos
    reach = p.rod_length * cos_phi
    crank = p.crank_radius * p.omega
    x = p.crank_radius * cos_theta + reach
    v = -crank * sin_theta - p.rod_length * sin_phi * rate
    a = -crank * p.omega * cos_theta - reach * rate * rate - p.rod_length * sin_phi * spin_up
    return IdealMotion(cos_theta, sin_theta, sin_phi, cos_phi, rate, spin_up, x, v, a)


@inline_llvm
def small_angle(angle):
    """Return sine and cosine of an angle (rad), up to MAX_SERIES_ANGLE by series that are exact."""
    if abs(angle) > MAX_SERIES_ANGLE:
        return math.sin(angle), math.cos(angle)
    s = angle * angle
    q = s * s
    sine = angle * s * (q * (s * S9 + S7) + (s * S5 + S3)) + angle
    cosine = 1.0 - (0.5 * s - q * (q * C8 + (s * C6 + C4)))
    return sine, cosine


@inline_llvm
def crank_direction(t, p):
    """Return the cosine and sine of the crank angle at time t (s)."""
    return math.cos(p.omega * t), math.sin(p.omega * t)


@inline_llvm
def ideal_after(base, span, p):
    """Return the `IdealMotion` a time (s) after a crank angle, given by its (cosine, sine)."""
    sine, cosine = small_angle(p.omega * span)
    cos_theta = base[0] * cosine - base[1] * sine
    return ideal_at(cos_theta, base[1] * cosine + base[0] * sine, p)


def exact_motion(theta, crank_radius, rod_length, omega):
    """Return the ideal crosshead's place from the crank (m), speed (m/s) and acceleration."""
    theta = np.asarray(theta, dtype=float)
    sin_phi = crank_radius / rod_length * np.sin(theta)
    cos_phi = np.sqrt(1.0 - sin_phi**2)
    rate = crank_radius / rod_length * omega * np.cos(theta) / cos_phi
    spin_up = sin_phi * (rate**2 - omega**2) / cos_phi
    x = crank_radius * np.cos(theta) + rod_length * cos_phi
    v = -crank_radius * omega * np.sin(theta) - rod_length * sin_phi * rate
    a = -crank_radius * omega**2 * np.cos(theta)
    a -= rod_length * (cos_phi * rate**2 + sin_phi * spin_up)
    return x, v, a


def angle_at(x, crank_radius, rod_length):
    """Return the crank angle in [0, pi] (rad) at which the ideal crosshead stands at x (m)."""
    cosine = (x * x + crank_radius**2 - rod_length**2) / (2 * crank_radius * x)
    if abs(cosine) > 1 + 1e-12:
        low, high = rod_length - crank_radius, rod_length + crank_radius
        raise ValueError(f"x = {x} m lies outside the stroke, {low} to {high} m")
    return math.acos(min(1.0, max(-1.0, cosine)))

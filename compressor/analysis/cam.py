"""The cam and spring of the spring load (Eq. 8-12, Figure 4): what is printed, and what follows.

As printed, with the ideal gas's corner angles, the cam does not close: it rises by 208.7 mm and
falls by 81.3 mm. Here the follower dwells for the spring's stroke of piston travel each way.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from compressor.analysis.runs import record_of
from compressor.cases import Case
from compressor.physics import exact_motion, gas_corners
from compressor.solve import record

if TYPE_CHECKING:
    import xarray as xr

# Table 1 of the paper
BASE_RADIUS = 0.200
FOLLOWER_STROKE = 0.120
ALLOWED_PRESSURE_ANGLE = math.radians(30)  # the usual limit of a translating follower; not printed


def cam_profile(p, angles):
    """Return the displacement s (m) of the closed cam's follower (Eq. 10).

    angles: of the cam (rad), any shape.
    """
    turned = np.mod(angles, 2 * math.pi)
    x, _, _ = exact_motion(turned, p.crank_radius, p.rod_length, p.omega)
    rise, bottom, fall = p.corners
    top = p.rod_length + p.crank_radius
    lift = 2 * p.crank_radius - p.spring_stroke
    follower = np.where(turned < rise, 0.0, top - p.spring_stroke - x)
    follower = np.where(turned < bottom, follower, lift)
    return np.where(turned < fall, follower, top - x)


def cam_slope(p, angles):
    """Return ds/dphi (m/rad) of `cam_profile` at cam angles (rad).

    It is the ideal piston's speed while the follower moves, and 0 elsewhere.
    """
    turned = np.mod(angles, 2 * math.pi)
    _, v, _ = exact_motion(turned, p.crank_radius, p.rod_length, p.omega)
    rise, bottom, fall = p.corners
    moving = ((turned >= rise) & (turned < bottom)) | (turned >= fall)
    return np.where(moving, -v / p.omega, 0.0)


def printed_corners_of_gas(p):
    """Return the ideal gas's corners (rad), with which Eq. 10 as printed is evaluated."""
    return gas_corners(p)


def printed_profile(p, angles):
    """Return the follower displacement (m) of Eq. 10 taken literally; it jumps instead of closing.

    Rise from the end of the gas's expansion, dwell at the height reached, fall from the end of its
    compression, low dwell at zero.
    """
    turned = np.mod(angles, 2 * math.pi)
    x, _, _ = exact_motion(turned, p.crank_radius, p.rod_length, p.omega)
    expansion, bottom, compression = printed_corners_of_gas(p)
    x_expansion, _, _ = exact_motion(expansion, p.crank_radius, p.rod_length, p.omega)
    follower = np.where(turned < expansion, 0.0, x_expansion - x)
    height = x_expansion - (p.rod_length - p.crank_radius)
    follower = np.where(turned < bottom, follower, height)
    return np.where(turned < compression, follower, p.rod_length + p.crank_radius - x)


def contour(p, angles, base_radius):
    """Return the pitch curve (x, y) of the cam, in m.

    The radius is `base_radius` plus the displacement: the roller is aligned (e = 0).
    """
    radius = base_radius + cam_profile(p, angles)
    return radius * np.cos(angles), radius * np.sin(angles)


@dataclass(frozen=True)
class Cam:
    """The cam of a run's spring load, in m over cam angles (rad, any shape)."""

    run: "xr.Dataset"
    base_radius: float = BASE_RADIUS

    @property
    def printed_fall(self) -> float:
        """Return the cam angle (rad) at which the follower begins to fall as printed."""
        return float(printed_corners_of_gas(record_of(self.run))[2])

    @property
    def gas_corners(self) -> np.ndarray:
        """Return the crank angles (rad) at which the ideal gas's phases change, (3,)."""
        return np.array(printed_corners_of_gas(record_of(self.run)))

    @property
    def printed_heights(self) -> tuple[float, float]:
        """Return how far (m) the follower rises and falls by Eq. 10 taken literally."""
        p = record_of(self.run)
        expansion, _, compression = self.gas_corners
        at = np.array([expansion, compression])
        before, after = exact_motion(at, p.crank_radius, p.rod_length, p.omega)[0]
        return float(before - p.rod_length + p.crank_radius), float(
            p.rod_length + p.crank_radius - after
        )

    @property
    def height(self) -> float:
        """Return how far (m) the closed cam's follower rises and falls."""
        p = record_of(self.run)
        return float(2.0 * p.crank_radius - p.spring_stroke)

    def contour(self, angles, base_radius):
        """Return `contour` of the closed cam around a base circle (m)."""
        return contour(record_of(self.run), angles, base_radius)

    def follower(self, angles):
        """Return the displacement of the closed cam's follower."""
        return cam_profile(record_of(self.run), angles)

    def printed_follower(self, angles):
        """Return the displacement of the follower by Eq. 10 taken literally."""
        return printed_profile(record_of(self.run), angles)


def pressure_angle(p, angles, base_radius):
    """Return the pressure angle (rad) of the aligned roller follower.

    Its tangent is (ds/dphi) / (r0 + s).
    """
    return np.arctan(cam_slope(p, angles) / (base_radius + cam_profile(p, angles)))


def least_base_radius(p, allowed, with_displacement=True):
    """Return the least base radius (m) for an allowed pressure angle (rad).

    By Eq. 11 with e = 0, or by Eq. 12 without the displacement: Eq. 12 as printed drops the
    displacement s_c, which Eq. 11 subtracts.
    """
    angles = np.linspace(0, 2 * math.pi, 20001)
    need = np.abs(cam_slope(p, angles)) / math.tan(allowed)
    if with_displacement:
        need = need - cam_profile(p, angles)
    return float(need.max())


@dataclass(frozen=True)
class CamComparison:
    """One number of the paper beside the one that follows from its equations."""

    quantity: str
    unit: str
    printed: float | None  # None: the paper gives no number
    follows: float
    source: str


def comparisons(p=None):
    """Return the paper's numbers of spring and cam beside those that follow (Eq. 8-12, Table 1).

    `p` is a record of the spring load with the paper's pressures, by default the paper's; returns a
    list of CamComparison.
    """
    p = record(Case()) if p is None else p
    stroke = p.spring_stroke
    stiffness = (p.discharge_force - p.suction_force) / stroke
    expansion, _, compression = printed_corners_of_gas(p)
    bottom, top = p.rod_length - p.crank_radius, p.rod_length + p.crank_radius
    x_rise, x_fall = (
        exact_motion(a, p.crank_radius, p.rod_length, p.omega)[0] for a in (expansion, compression)
    )
    steepest = np.abs(pressure_angle(p, np.linspace(0, 2 * math.pi, 20001), BASE_RADIUS)).max()
    rows = (
        ("spring force in suction P_min", "N", p.preload, p.suction_force, "Eq. 8"),
        ("spring force in discharge P_max", "N", p.preload + p.spring_stiffness * stroke,
         p.discharge_force, "Eq. 8"),
        ("spring stroke h", "mm", stroke * 1e3, (x_fall - bottom) * 1e3, "Eq. 9"),
        ("spring stiffness k over the printed stroke", "N/mm", p.spring_stiffness / 1e3,
         stiffness / 1e3, "Eq. 8"),
        ("follower's rise, gas corners", "mm", FOLLOWER_STROKE * 1e3, (x_rise - bottom) * 1e3,
         "Eq. 10"),
        ("follower's fall, gas corners", "mm", FOLLOWER_STROKE * 1e3, (top - x_fall) * 1e3,
         "Eq. 10"),
        ("follower's stroke, closed cam", "mm", FOLLOWER_STROKE * 1e3,
         (2 * p.crank_radius - stroke) * 1e3, "physics/README.md, Loads"),
        ("base radius for a pressure angle of 30 degrees", "mm", BASE_RADIUS * 1e3,
         least_base_radius(p, ALLOWED_PRESSURE_ANGLE) * 1e3, "Eq. 11"),
        ("base radius for a pressure angle of 30 degrees", "mm", BASE_RADIUS * 1e3,
         least_base_radius(p, ALLOWED_PRESSURE_ANGLE, with_displacement=False) * 1e3, "Eq. 12"),
        ("greatest pressure angle on the printed base circle", "deg", None,
         math.degrees(steepest), "Eq. 11"),
    )  # fmt: skip
    return [CamComparison(q, unit, a, float(b), source) for q, unit, a, b, source in rows]

"""The cam and spring of the spring load (Eq. 8-12, Figure 4): what is printed, and what follows.

As printed, with the ideal gas's corner angles, the cam does not close: it rises by 208.7 mm and
falls by 81.3 mm. Here the follower dwells for the spring's stroke of piston travel each way.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

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


@dataclass(frozen=True)
class Cam:
    """The closed cam of a spring load, in m over cam angles (rad, any shape).

    p: the record (SI) of a case of that load.
    """

    p: np.record
    base_radius: float = BASE_RADIUS

    @classmethod
    def of(cls, run: "xr.Dataset") -> "Cam":
        """Return the cam of a run's case."""
        return cls(record_of(run))

    def ideal(self, angles):
        """Return place (m) and speed (m/s) of the ideal piston."""
        p = self.p
        return exact_motion(angles, p.crank_radius, p.rod_length, p.omega)[:2]

    @cached_property
    def gas_corners(self) -> np.ndarray:
        """Return the ideal gas's corners (rad), (3,), with which Eq. 10 as printed is evaluated."""
        return np.array(gas_corners(self.p))

    @property
    def height(self) -> float:
        """Return how far (m) the follower rises and falls."""
        return float(2.0 * self.p.crank_radius - self.p.spring_stroke)

    @property
    def printed_heights(self) -> tuple[float, float]:
        """Return how far (m) the follower rises and falls by Eq. 10 taken literally."""
        p, (before, after) = self.p, self.ideal(self.gas_corners[[0, 2]])[0]
        return float(before - p.rod_length + p.crank_radius), float(
            p.rod_length + p.crank_radius - after
        )

    def follower(self, angles):
        """Return the displacement s (m) of the follower (Eq. 10)."""
        p, turned = self.p, np.mod(angles, 2 * math.pi)
        x, _ = self.ideal(turned)
        rise, bottom, fall = p.corners
        top = p.rod_length + p.crank_radius
        found = np.where(turned < rise, 0.0, top - p.spring_stroke - x)
        found = np.where(turned < bottom, found, self.height)
        return np.where(turned < fall, found, top - x)

    def slope(self, angles):
        """Return ds/dphi (m/rad): the ideal piston's speed while the follower moves, else 0."""
        turned = np.mod(angles, 2 * math.pi)
        rise, bottom, fall = self.p.corners
        moving = ((turned >= rise) & (turned < bottom)) | (turned >= fall)
        return np.where(moving, -self.ideal(turned)[1] / self.p.omega, 0.0)

    def printed_follower(self, angles):
        """Return the displacement (m) of Eq. 10 taken literally; it jumps instead of closing.

        Rise from the end of the gas's expansion, dwell at the height reached, fall from the end of
        its compression, low dwell at zero.
        """
        p, turned = self.p, np.mod(angles, 2 * math.pi)
        x, _ = self.ideal(turned)
        expansion, bottom, compression = self.gas_corners
        x_expansion, _ = self.ideal(expansion)
        found = np.where(turned < expansion, 0.0, x_expansion - x)
        height = x_expansion - (p.rod_length - p.crank_radius)
        found = np.where(turned < bottom, found, height)
        return np.where(turned < compression, found, p.rod_length + p.crank_radius - x)

    def contour(self, angles, base_radius):
        """Return the pitch curve (x, y), m, around a base circle (m); the roller is aligned."""
        radius = base_radius + self.follower(angles)
        return radius * np.cos(angles), radius * np.sin(angles)

    def pressure_angle(self, angles):
        """Return the pressure angle (rad), whose tangent is (ds/dphi) / (r0 + s)."""
        return np.arctan(self.slope(angles) / (self.base_radius + self.follower(angles)))

    def least_base_radius(self, allowed, with_displacement=True):
        """Return the least base radius (m) for an allowed pressure angle (rad).

        By Eq. 11 with e = 0, or by Eq. 12 without the displacement: Eq. 12 as printed drops the
        displacement s_c, which Eq. 11 subtracts.
        """
        angles = np.linspace(0, 2 * math.pi, 20001)
        need = np.abs(self.slope(angles)) / math.tan(allowed)
        return float((need - with_displacement * self.follower(angles)).max())


class CamComparison(NamedTuple):
    """One number of the paper beside the one that follows from its equations."""

    quantity: str
    unit: str
    printed: float | None  # None: the paper gives no number
    follows: float
    source: str


def comparisons() -> list[CamComparison]:
    """Return the paper's numbers of spring and cam beside those that follow (Eq. 8-12, Table 1)."""
    p = record(Case())
    cam, stroke = Cam(p), p.spring_stroke
    stiffness = (p.discharge_force - p.suction_force) / stroke
    rise, fall = cam.printed_heights
    steepest = np.abs(cam.pressure_angle(np.linspace(0, 2 * math.pi, 20001))).max()
    rows = (
        ("spring force in suction P_min", "N", p.preload, p.suction_force, "Eq. 8"),
        ("spring force in discharge P_max", "N", p.preload + p.spring_stiffness * stroke,
         p.discharge_force, "Eq. 8"),
        ("spring stroke h", "mm", stroke * 1e3, (2 * p.crank_radius - fall) * 1e3, "Eq. 9"),
        ("spring stiffness k over the printed stroke", "N/mm", p.spring_stiffness / 1e3,
         stiffness / 1e3, "Eq. 8"),
        ("follower's rise, gas corners", "mm", FOLLOWER_STROKE * 1e3, rise * 1e3, "Eq. 10"),
        ("follower's fall, gas corners", "mm", FOLLOWER_STROKE * 1e3, fall * 1e3, "Eq. 10"),
        ("follower's stroke, closed cam", "mm", FOLLOWER_STROKE * 1e3, cam.height * 1e3,
         "physics/README.md, Loads"),
        ("base radius for a pressure angle of 30 degrees", "mm", BASE_RADIUS * 1e3,
         cam.least_base_radius(ALLOWED_PRESSURE_ANGLE) * 1e3, "Eq. 11"),
        ("base radius for a pressure angle of 30 degrees", "mm", BASE_RADIUS * 1e3,
         cam.least_base_radius(ALLOWED_PRESSURE_ANGLE, with_displacement=False) * 1e3, "Eq. 12"),
        ("greatest pressure angle on the printed base circle", "deg", None,
         math.degrees(steepest), "Eq. 11"),
    )  # fmt: skip
    return [CamComparison(q, unit, a, float(b), source) for q, unit, a, b, source in rows]

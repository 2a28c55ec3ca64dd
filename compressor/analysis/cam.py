"""The cam of the spring load (Eq. 8-12, Figure 4): what is printed, and what follows.

As printed, with the ideal gas's corner angles, the cam does not close: it rises by 208.7 mm and
falls by 81.3 mm. Here the follower dwells for the spring's stroke of piston travel each way.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from compressor.analysis.runs import record_of
from compressor.physics import exact_motion, gas_corners

if TYPE_CHECKING:
    import xarray as xr

BASE_RADIUS = 0.200  # m, Table 1 of the paper


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
        """Return the place (m) of the ideal piston."""
        return exact_motion(angles, self.p.crank_radius, self.p.rod_length, self.p.omega)[0]

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
        p, (before, after) = self.p, self.ideal(self.gas_corners[[0, 2]])
        return float(before - p.rod_length + p.crank_radius), float(
            p.rod_length + p.crank_radius - after
        )

    def follower(self, angles):
        """Return the displacement s (m) of the follower (Eq. 10)."""
        p, turned = self.p, np.mod(angles, 2 * math.pi)
        x = self.ideal(turned)
        rise, bottom, fall = p.corners
        top = p.rod_length + p.crank_radius
        found = np.where(turned < rise, 0.0, top - p.spring_stroke - x)
        found = np.where(turned < bottom, found, self.height)
        return np.where(turned < fall, found, top - x)

    def printed_follower(self, angles):
        """Return the displacement (m) of Eq. 10 taken literally; it jumps instead of closing.

        Rise from the end of the gas's expansion, dwell at the height reached, fall from the end of
        its compression, low dwell at zero.
        """
        p, turned = self.p, np.mod(angles, 2 * math.pi)
        x = self.ideal(turned)
        expansion, bottom, compression = self.gas_corners
        x_expansion = self.ideal(expansion)
        found = np.where(turned < expansion, 0.0, x_expansion - x)
        height = x_expansion - (p.rod_length - p.crank_radius)
        found = np.where(turned < bottom, found, height)
        return np.where(turned < compression, found, p.rod_length + p.crank_radius - x)

    def contour(self, angles, base_radius):
        """Return the pitch curve (x, y), m, around a base circle (m); the roller is aligned."""
        radius = base_radius + self.follower(angles)
        return radius * np.cos(angles), radius * np.sin(angles)

"""The cam of the spring load (Eq. 8-12, Figure 4): what is printed, and what follows.

As printed, with the ideal gas's corner angles, the cam does not close: it rises by 208.7 mm and
falls by 81.3 mm. Here the follower dwells for the spring's stroke of piston travel each way.
"""

import math
from dataclasses import dataclass

import numpy as np

from compressor.physics import exact_motion, gas_corners

BASE_RADIUS = 0.200  # m, Table 1 of the paper


@dataclass(frozen=True)
class Cam:
    """The closed cam of a spring load, in m over cam angles (rad, any shape).

    p: the record (SI) of a case of that load.
    """

    p: np.record

    @property
    def gas_corners(self) -> np.ndarray:
        """Return the ideal gas's corners (rad), (3,), with which Eq. 10 as printed is evaluated."""
        return np.array(gas_corners(self.p))

    def ideal(self, angles):
        """Return the place (m) of the ideal piston."""
        return exact_motion(angles, self.p.crank_radius, self.p.rod_length, self.p.omega)[0]

    def follower(self, angles):
        """Return the displacement s (m) of the follower (Eq. 10)."""
        top = self.p.rod_length + self.p.crank_radius
        return self.displace(angles, self.p.corners, top - self.p.spring_stroke)

    def printed_follower(self, angles):
        """Return the displacement (m) of Eq. 10 taken literally; it jumps instead of closing.

        Rise from the end of the gas's expansion, fall from the end of its compression.
        """
        return self.displace(angles, self.gas_corners, self.ideal(self.gas_corners[0]))

    def displace(self, angles, corners, place):
        """Return a displacement (m) over angles (rad), by three corners (rad).

        It rises from the first as the piston leaves a place (m), dwells between the others, then
        falls as the piston does.
        """
        p, turned, (rise, bottom, fall) = self.p, np.mod(angles, 2 * math.pi), corners
        x = self.ideal(turned)
        found = np.where(turned < rise, 0.0, place - x)
        found = np.where(turned < bottom, found, place - p.rod_length + p.crank_radius)
        return np.where(turned < fall, found, p.rod_length + p.crank_radius - x)

    def contour(self, angles):
        """Return the pitch curve (x, y), m, around the base circle; the roller is aligned."""
        radius = BASE_RADIUS + self.follower(angles)
        return radius * np.cos(angles), radius * np.sin(angles)

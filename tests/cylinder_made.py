"""A double-acting cylinder and the pressures of its ideal cycle, without phases."""

import numpy as np

from compressor.physics import exact_motion

MACHINE = {"stroke_mm": 180, "rod_length_mm": 450, "speed_rpm": 740}
DOUBLE = {
    "action": "double", "bore_mm": 220, "rod_diameter_mm": 60, "suction_MPa": 0.2,
    "discharge_MPa": 0.7, "exponent": 1.3, "clearance_percent": {"head": 12, "crank": 14},
    "valve_loss_percent": {"suction": 4, "discharge": 5}, "back_pressure_MPa": 0.1,
}  # fmt: skip


def pressures(degrees, inlet=0.2 * 0.96, outlet=0.7 * 1.05):
    """Return pressures (MPa) of `DOUBLE` in the head and the crank end.

    While a space grows the gas expands down to the suction pressure, and while it shrinks it is
    compressed up to the discharge pressure, each behind its valve.
    """
    x, *_ = exact_motion(np.radians(degrees), 0.09, 0.45, 1.0)
    found = []
    for gap, share, down in ((0.54 - x, 0.12, True), (x - 0.36, 0.14, False)):
        space, clearance = gap + share * 0.18, share * 0.18
        expanded = np.maximum(inlet, outlet * (clearance / space) ** 1.3)
        compressed = np.minimum(outlet, inlet * ((clearance + 0.18) / space) ** 1.3)
        found.append(np.where((degrees < 180) == down, expanded, compressed))
    return found

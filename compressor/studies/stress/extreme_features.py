"""Features of the mechanism in extreme scenes: oil, play in the guide, drive, rod, ideal joints.

Each number is drawn evenly in its logarithm, from the whole range or the supported one.
"""

import random
from typing import Any

from compressor.cases import judged_range

SHARE = 0.3  # of the scenes that have each feature
# group -> key -> (whole range, supported range), in the case file's units
RANGES = {
    "lubricant": {
        "viscosity_mPa_s": ((0.1, 1e4), judged_range("lubricant.viscosity_mPa_s")),
        "last_share": ((0.002, 0.3), judged_range("lubricant.last_share")),
    },
    "guide": {
        "clearance_mm": ((1e-3, 1.0), judged_range("guide.clearance_mm")),
        "friction": ((1e-3, 0.5), judged_range("guide.friction")),
        "crosshead_length_mm": ((20.0, 500.0), judged_range("guide.crosshead_length_mm")),
        "crosshead_height_mm": ((20.0, 500.0), judged_range("guide.crosshead_height_mm")),
        "stiffness_N_per_mm15": ((1e3, 1e7), judged_range("guide.stiffness_N_per_mm15")),
    },
    "drive": {
        "flywheel_kg_m2": ((0.1, 1e3), judged_range("drive.flywheel_kg_m2")),
        "slope_N_m_s": ((0.1, 1e5), judged_range("drive.slope_N_m_s")),
    },
    "rod": {
        "youngs_modulus_GPa": ((10.0, 1e3), judged_range("rod.youngs_modulus_GPa")),
        "depth_mm": ((5.0, 200.0), judged_range("rod.depth_mm")),
        "width_mm": ((5.0, 200.0), judged_range("rod.width_mm")),
        "damping_ratio": ((1e-4, 0.3), judged_range("rod.damping_ratio")),
    },
}
LENGTHS = ((0.15, 0.99), (0.4, 0.99))  # of a bearing over its diameter
LUGRE = "lugre"


def features(made: dict[str, Any], draw: random.Random, inside: bool) -> dict[str, Any]:
    """Return the groups that a scene has besides, as far as they are drawn; made: the scene so
    far.
    """
    found: dict[str, Any] = {}
    for group, keys in RANGES.items():
        if draw.random() < SHARE:
            found[group] = {key: _drawn(spans, draw, inside) for key, spans in keys.items()}
    if "guide" in found and draw.random() < 0.3:  # ideal, with friction
        found["guide"]["clearance_mm"] = 0.0
    if "lubricant" in found:
        length = _drawn(LENGTHS, draw, inside) * 2.0 * made["machine"]["pin_radius_mm"]
        found["lubricant"]["bearing_length_mm"] = length
    if draw.random() < SHARE and made["friction"]["law"] != LUGRE:
        found["friction"] = made["friction"] | {"ideal_joints": True}
    return found


def _drawn(
    spans: tuple[tuple[float, float], tuple[float, float]], draw: random.Random, inside: bool
) -> float:
    """Return a number, evenly in its logarithm."""
    low, high = spans[inside]
    return float(low * (high / low) ** draw.random())

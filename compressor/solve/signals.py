"""Forces that the machine puts on its frame, recomputed from observed rows.

With F_b and F_s the joint forces on the rod at the big and the small end, F_load the piston force,
positive towards the crank, and g gravity against y:

- the crank has no mass, so that what acts on the rod's big end acts on the main bearing: -F_b;
- the crosshead does not move along y: the guide bears -F_sy - m_p g;
- the gas, or the spring, pushes the cylinder as it pushes the piston: F_load along x;
- so the frame feels X = -F_bx + F_load and Y = -F_by - F_sy - m_p g. Both are the loss of momentum
  of all moving parts a second, less their weight;
- the crank is driven by the torque that the rod asks for: the power at its pin over its speed.
"""

import numpy as np

from compressor.physics import Column, Coordinate, is_featured
from compressor.solve.series import block

# over time and these dimensions: (dimensions, unit, long name)
SIGNALS = {
    "shaking_force": (("axis",), "N", "force of the machine on its foundation"),
    "bearing_force": (("axis",), "N", "force on the main bearing"),
    "guide_force": ((), "N", "force of the crosshead on its guide, upwards"),
    "guide_moment": ((), "N m", "moment of guide_force about the crank centre, counter-clockwise"),
    "crank_torque": ((), "N m", "torque that drives the crank, along its rotation"),
    "rod_load": ((), "N", "force of the crosshead pin on the rod along x, positive in tension"),
}

# of a mechanism that has the coordinate: the same, and how they come of it
FEATURES: dict[str, tuple[Coordinate, str, str]] = {
    "guide_height": (Coordinate.GUIDE, "m", "height of the crosshead's pin in its guide"),
    "guide_tilt": (Coordinate.TILT, "rad", "tilt of the crosshead, counter-clockwise"),
    "rod_bend": (Coordinate.BEND_1, "m", "deflection of the rod across it, of its first mode"),
    "rod_stretch": (Coordinate.STRETCH, "m", "by which the rod is longer"),
}


def features(
    p: np.record, states: np.ndarray, rows: np.ndarray
) -> dict[str, tuple[np.ndarray, str, str]]:
    """The series that a mechanism's features add, by name: values (m,), unit, long name.

    states: (m, n); rows: observed there, (m, WIDE).
    """
    found = {}
    for name, (coordinate, unit, phrase) in FEATURES.items():
        if p["at"][coordinate] >= 0:
            found[name] = states[:, p["at"][coordinate]].copy(), unit, phrase
    if p["tilting"]:
        gap = rows[:, Column.GUIDE_GAP].copy()
        found["guide_gap"] = gap, "m", "least gap of the crosshead's corners, negative in contact"
    if p["driven"]:
        found["crank_speed"] = rows[:, Column.CRANK_SPEED].copy(), "rad/s", "speed of the crank"
    return found


def passed(p: np.record, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Time (s) that has passed when the crank is where a steady one were at these times."""
    driven = is_featured(p) and p["driven"]
    return times + states[:, p["at"][Coordinate.CRANK] - 1] if driven else times


def signals(p: np.record, rows: np.ndarray) -> dict[str, np.ndarray]:
    """The `SIGNALS` by name from observed rows, (m, COLUMNS); SI."""
    series = (block(name, rows) for name in ("contact_force", "piston_force", "displacement"))
    found = forces_on_frame(p, *series)
    found["crank_torque"] = rows[:, Column.CRANK_POWER] / p["omega"]
    if is_featured(p):
        guide = rows[:, Column.GUIDE_FORCE]
        found["shaking_force"][:, 0] += rows[:, Column.GUIDE_FRICTION]
        found["shaking_force"][:, 1] += guide - found["guide_force"]
        found["guide_force"], found["guide_moment"] = guide, rows[:, Column.GUIDE_MOMENT]
        found["crank_torque"] = rows[:, Column.CRANK_POWER] / rows[:, Column.CRANK_SPEED]
    return {name: found[name] for name in SIGNALS}


def forces_on_frame(
    p: np.record, contact_force: np.ndarray, piston_force: np.ndarray, displacement: np.ndarray
) -> dict[str, np.ndarray]:
    """The `SIGNALS` that follow from time series, all but the crank's torque; SI.

    contact_force: on the rod, (m, joint, axis); piston_force and displacement: (m,).
    """
    big, small = np.moveaxis(contact_force, 1, 0)
    bearing = -big
    guide = -small[:, 1] - p["reciprocating_mass"] * p["gravity"]
    shaking = bearing.copy()
    shaking[:, 0] += piston_force
    shaking[:, 1] += guide
    return {
        "shaking_force": shaking,
        "bearing_force": bearing,
        "guide_force": guide,
        "guide_moment": guide * displacement,
        "rod_load": small[:, 0].copy(),
    }

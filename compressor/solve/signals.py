"""Forces that the machine puts on its frame, recomputed from observed rows or time series.

With F_b and F_s the joint forces on the rod at the big and the small end, F_load the piston force,
positive towards the crank, and g gravity against y:

- what acts on the rod's big end acts on the main bearing: -F_b; beside it the force of a crank that
  is out of balance, U (omega^2 e_r - alpha e_t) with e_r along the crank and e_t a quarter turn on.
  The crank's weight is not known and left out;
- the crosshead does not move along y: the guide bears -F_sy - m_p g, and the couple that friction
  puts on the crosshead's pin, (R_j - delta) F_t;
- the gas, or the spring, pushes the cylinder as it pushes the piston: F_load along x;
- so the frame feels X = -F_bx + F_load and Y = -F_by - F_sy - m_p g. Both are the loss of momentum
  of all moving parts a second, less their weight;
- the crank is driven by the torque that the rod asks for, R (cos theta F_by - sin theta F_bx) -
  (R_j - delta) F_t. A drive's motor gives another: what is between them turns the flywheel.

Contacts last less than a crank angle of 0.3 degrees, and so do the couples of their friction:
values of a stored series are exact, means over one are not. `mean_crank_torque` and
`mean_guide_moment` are of the dense solution.
"""

import numpy as np
import xarray as xr

from compressor.metrics import JOINTS
from compressor.physics import Column, Coordinate, is_featured
from compressor.solve.series import block

# over time and these dimensions: (dimensions, unit, long name)
SIGNALS = {
    "shaking_force": (("axis",), "N", "force of the machine on its foundation"),
    "bearing_force": (("axis",), "N", "force on the main bearing"),
    "guide_force": ((), "N", "force of the crosshead on its guide, upwards"),
    "guide_moment": (
        (), "N m", "moment of the crosshead on its guide about the crank centre, counter-clockwise"
    ),
    "crank_torque": ((), "N m", "torque that drives the crank against the rod, along its rotation"),
    "rod_load": ((), "N", "force of the crosshead pin on the rod along x, positive in tension"),
}  # fmt: skip

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
    """Return the series that a mechanism's features add, by name: values (m,), unit, long name.

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
        found["motor_torque"] = rows[:, Column.MOTOR_TORQUE].copy(), "N m", "torque of the motor"
    return found


def passed(p: np.record, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return time (s) that has passed when the crank is where a steady one were at these times."""
    driven = is_featured(p) and p["driven"]
    return times + states[:, p["at"][Coordinate.CRANK] - 1] if driven else times


def signals(p: np.record, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Return the `SIGNALS` by name from observed rows, (m, WIDE) of a mechanism with features."""
    force = block("contact_force", rows)
    load, torque = block("piston_force", rows), rows[:, Column.CRANK_TORQUE]
    guide = -force[:, 1, 1] - p["reciprocating_mass"] * p["gravity"]
    moment, bearing = rows[:, Column.GUIDE_MOMENT], -force[:, 0]
    shaking = bearing + np.stack((load, guide), axis=1)
    if is_featured(p):
        unbalance = rows[:, Column.UNBALANCE : Column.UNBALANCE + 2]
        guide, bearing = rows[:, Column.GUIDE_FORCE], bearing + unbalance
        shaking = bearing + np.stack((load + rows[:, Column.GUIDE_FRICTION], guide), axis=1)
    return {
        "shaking_force": shaking, "bearing_force": bearing, "guide_force": guide.copy(),
        "guide_moment": moment.copy(), "crank_torque": torque.copy(),
        "rod_load": force[:, 1, 0].copy(),
    }  # fmt: skip


def signals_of_scene(p: np.record, run: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the `SIGNALS` by name from the time series of a run without features; SI.

    The force on the rod is F_N n - F_t t with n along the eccentricity, and t a quarter turn from
    it, counter-clockwise.
    """
    force = run["contact_force"].transpose("time", "joint", "axis").values
    place = run["eccentricity"].transpose("time", "joint", "axis").values
    size = np.linalg.norm(place, axis=2)
    across = place[..., 0] * force[..., 1] - place[..., 1] * force[..., 0]
    friction = -np.divide(across, size, out=np.zeros_like(size), where=size > 0)
    friction[:, p["clearance"] == 0.0] = 0.0
    couple = (p["pin_radius"] - run["penetration"].transpose("time", "joint").values) * friction
    angle, x = run["crank_angle"].values, run["displacement"].values
    (bx, by), (sx, sy) = force[:, 0].T, force[:, 1].T
    load, guide = run["piston_force"].values, -sy - p["reciprocating_mass"] * p["gravity"]
    return {
        "shaking_force": np.stack((load - bx, guide - by), axis=1),
        "bearing_force": -force[:, 0],
        "guide_force": guide,
        "guide_moment": guide * x + couple[:, JOINTS.index("small_end")],
        "crank_torque": p["crank_radius"] * (np.cos(angle) * by - np.sin(angle) * bx)
        - couple[:, JOINTS.index("big_end")],
        "rod_load": sx.copy(),
    }

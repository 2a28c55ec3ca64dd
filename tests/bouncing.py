"""Time series of journals whose contacts are known in closed form, as a run would give them."""

import json

import numpy as np
import xarray as xr

from compressor.cases.case import Case

CLEARANCE = 3e-4  # m
SPEED, CONTACT, FLIGHT = 0.3, 1.037e-3, 3.011e-3  # m/s, s, s: of each bounce
PEAK, DAMPED = 4000.0, 700.0  # N: of the normal force's first and second sine
DEPTH = SPEED * CONTACT / np.pi  # m
TURN = 40.0  # rad/s, of the contact's direction


def times(step_deg, revolutions=2):
    """Times (s) of samples a step of crank angle apart at 500 rpm."""
    return np.arange(round(360 * revolutions / step_deg) + 1) * step_deg / 3000.0


def bounce(time):
    """Penetration (m) and normal force (N): bounces one after another, contact first."""
    since = np.mod(time, CONTACT + FLIGHT)
    phase = np.pi * since / CONTACT
    flown = since - CONTACT
    away = SPEED * flown * (1.0 - flown / FLIGHT)
    touching = since < CONTACT
    depth = np.where(touching, DEPTH * np.sin(phase), -away)
    return depth, np.where(touching, (PEAK * np.sin(phase) + DAMPED * np.sin(2.0 * phase)), 0.0)


def pressed(time):
    """Penetration (m) and normal force (N) of a journal that never leaves its bore."""
    return np.full(time.size, 2e-5), np.full(time.size, 900.0)


def run_of(time, joints, settle=0.0):
    """A run of the given penetrations and normal forces by joint; a fifth as much friction."""
    joint = "both" if len(joints) == 2 else next(iter(joints))
    case = Case.from_values({"joint": joint, "clearance_mm": 1e3 * CLEARANCE})
    place, force = np.zeros((2, time.size, 2, 2))
    penetration = np.full((time.size, 2), -CLEARANCE)
    normal = np.stack([np.cos(1.0 + TURN * time), np.sin(1.0 + TURN * time)], axis=1)
    across = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    for name, (depth, size) in joints.items():
        number = ("big_end", "small_end").index(name)
        place[:, number] = (CLEARANCE + depth)[:, None] * normal
        force[:, number] = size[:, None] * (normal + 0.2 * across)
        penetration[:, number] = depth
    return xr.Dataset(
        {
            "eccentricity": (("time", "joint", "axis"), place),
            "contact_force": (("time", "joint", "axis"), force),
            "penetration": (("time", "joint"), penetration),
            "crank_angle": ("time", case.omega * time),
        },
        {"time": time, "joint": ["big_end", "small_end"], "axis": ["x", "y"]},
        {"case": json.dumps(case.values()), "settle": settle},
    )

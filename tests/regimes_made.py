"""A made regimes study with known regimes: the logistic map in place of a machine."""

import math

import numpy as np
import xarray as xr

from compressor.metrics import JOINTS
from compressor.physics.record import FREEDOMS

MODES = ("flight", "impact", "following")
LOW, HIGH = 0.01, 1.0  # mm, over which the map's parameter goes from 2.8 to 3.9
REVOLUTIONS = 64


def orbit(r, start):
    """Points of the map after a transient, their period (nan: none up to 16), the exponent."""
    x = start
    for _ in range(2000):
        x = r * x * (1 - x)
    points = np.empty(REVOLUTIONS)
    for i in range(REVOLUTIONS):
        points[i] = x = r * x * (1 - x)
    rates = np.log(np.abs(r * (1 - 2 * points)))
    period = next((p for p in range(1, 17) if abs(points[p] - points[0]) < 1e-6), math.nan)
    return points, period, rates.mean(), 2 * rates.std() / math.sqrt(points.size)


def parameter(clearance):
    """The map's parameter at a clearance (mm)."""
    return 2.8 + 1.1 * math.log(clearance / LOW) / math.log(HIGH / LOW)


def chain(values, joints, late=0.0):
    """Arrays of one direction; late: by how much the map's parameter lags behind."""
    n, points = len(values), np.full((len(values), REVOLUTIONS, 2, 4), np.nan)
    found = {name: np.full(n, np.nan) for name in ("period", "exponent", "error")}
    regime = np.full(n, "undecided", dtype=object)
    for i, clearance in enumerate(values):
        x, period, exponent, error = orbit(parameter(clearance) - late, 0.3)
        count = REVOLUTIONS if math.isnan(period) else 3 * period
        for joint in joints:
            k, size = JOINTS.index(joint), 1e-3 * clearance
            points[i, :count, k, 0] = size * (1.6 * x[:count] - 0.9)
            points[i, :count, k, 1] = 0.3 * size * x[:count]
            points[i, :count, k, 2] = 20 * size * (np.roll(x, 1) - x)[:count]
            points[i, :count, k, 3] = 0.0
        found["period"][i], found["exponent"][i], found["error"][i] = period, exponent, error
        if not math.isnan(period):
            regime[i] = "periodic"
        elif exponent - error > 0.0:
            regime[i] = "chaotic"
    return points, found, regime


def made(values=None, joints=("big_end",), directions=("up", "down"), late=0.12):
    """A study without other axes, over the clearance (mm) of these joints."""
    values = np.geomspace(LOW, HIGH, 40) if values is None else np.asarray(values)
    chains = [chain(values, joints, late * (d == "down")) for d in directions]
    shape, over = (len(directions), len(values)), "clearance_mm_big_end"
    dims, joint_dims = ("direction", over), ("direction", over, "joint")

    def each(name, unit):
        return dims, np.array([found[name] for _, found, _ in chains]), {"units": unit}

    worn = np.isin(JOINTS, joints)
    flight = np.linspace(0.0, 0.4, len(values))
    shares = np.stack([flight, flight / 4, 1 - 1.25 * flight], axis=1)[None, :, None, :]
    shares = np.where(worn[None, None, :, None], np.broadcast_to(shares, (*shape, 2, 3)), np.nan)
    impacts = np.where(worn, np.broadcast_to(20 * flight[None, :, None], (*shape, 2)), np.nan)
    regime = np.array([words for *_, words in chains])
    data = xr.Dataset(
        {
            "section": (
                (*dims, "revolution", "joint", "coordinate"),
                np.array([points for points, *_ in chains]), {"units": "m, m/s"},
            ),
            "period": each("period", "1"),
            "lyapunov_exponent": each("exponent", "1"),
            "lyapunov_exponent_error": each("error", "1"),
            "regime": (dims, regime.astype(str)),
            "settled_rev": (dims, np.full(shape, 5.0)),
            "revolutions": (dims, np.full(shape, REVOLUTIONS)),
            "mode_share": ((*joint_dims, "mode"), shares),
            "impacts_per_revolution": (joint_dims, impacts),
            "status": (dims, np.full(shape, "ok").astype("<U9")),
            "reason": (dims, np.full(shape, "").astype("<U24")),
            "end_state": ((*dims, "state"), np.zeros((*shape, 2 * max(FREEDOMS.values())))),
        },
        {
            "direction": list(directions), "joint": [*JOINTS], "mode": [*MODES],
            "coordinate": ["x", "y", "x_rate", "y_rate"],
            over: (
                over, values,
                {"units": "mm", "long_name": "radial clearance of the big end",
                 "case_key": "clearance_mm.big_end"},
            ),
        },
        {"over": over, "log": 1, "section_deg": 90.0},
    )  # fmt: skip
    if len(directions) > 1:
        both = [[*zip(w, f["period"], strict=True)] for _, f, w in chains]
        apart = [str(one) != str(other) for one, other in zip(*both, strict=True)]
        data["differs"] = over, np.array(apart)
        data["confirmed"] = over, np.array(apart) & (np.arange(len(values)) % 2 == 0)
    return data


def plane(speeds=(400.0, 500.0, 600.0), **how):
    """A study with another axis: at a higher speed the map's parameter lags behind more."""
    parts = [made(late=0.12 * (1 + i), **how) for i in range(len(speeds))]
    whole = xr.concat(parts, "speed_rpm")
    whole["speed_rpm"] = "speed_rpm", list(speeds), {
        "units": "rpm", "long_name": "crank speed", "case_key": "machine.speed_rpm",
    }  # fmt: skip
    return whole


def failed(data, direction, places, reason="step_underflow"):
    """The same study with failed values."""
    gone = data.copy(deep=True)
    at = {"direction": [*data["direction"].values].index(direction), data.attrs["over"]: places}
    for name in ("section", "period", "lyapunov_exponent", "lyapunov_exponent_error", "mode_share"):
        gone[name][at] = np.nan
    gone["status"][at], gone["reason"][at], gone["regime"][at] = "failed", reason, ""
    return gone

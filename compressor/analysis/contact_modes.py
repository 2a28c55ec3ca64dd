"""The contact modes of the joints over the crank angle: flight, impact, following.

The three modes are those of Miedema and Mansour, Mechanical joints with clearance: a three-mode
model, Journal of Engineering for Industry 98 (1976) 1319-1323; Flores and Lankarani, Contact force
models for multibody dynamics (2016), use them as well. Two joints have nine combinations. Ours is
how the modes are told apart in samples:

- flight: no contact (F_N = 0) from one contact to the next, with the journal off its bore in
  between;
- impact: the first contact after flight, for one compression and one restitution: until the force
  vanishes, or the penetration has passed a maximum and then a minimum, and no longer than an
  undamped impact of rod and reciprocating mass together would last at the same approach speed;
- following: the rest. The force may vanish within it, as long as the journal stays pressed in.
"""

import numpy as np
import xarray as xr

from compressor.analysis.contacts import contact_series, flights, joints_with_clearance
from compressor.analysis.impacts import impacts_of
from compressor.analysis.runs import settled

MODES = ("flight", "impact", "following")
FLIGHT, IMPACT, FOLLOWING = range(len(MODES))
UNKNOWN = -1  # of a bin without samples


def contact_modes(run: xr.Dataset) -> xr.Dataset:
    """Return the mode of each joint with clearance after settling: `mode` over (time, joint).

    Integers with their meanings in `flag_values` and `flag_meanings`; `time` has the crank angle
    (rad) as a coordinate. Raises ValueError for a run without time series or clearance.
    """
    joints = [*joints_with_clearance(run)]
    columns = [modes_of(run, joint) for joint in joints]
    one = contact_series(run, joints[0])
    attrs = {
        "units": "1",
        "long_name": "contact mode",
        "flag_values": np.arange(len(MODES), dtype=np.int8),
        "flag_meanings": " ".join(MODES),
    }
    angle = {"units": "rad", "long_name": "crank angle from top dead centre"}
    whole = xr.Dataset(
        {"mode": (("time", "joint"), np.stack(columns, axis=1), attrs)},
        {
            "time": ("time", one.time, {"units": "s", "long_name": "time"}),
            "crank_angle": ("time", one.angle, angle),
            "joint": ("joint", list(joints)),
        },
        {"settle": run.attrs["settle"]},
    )
    return settled(whole)


def modes_of(run: xr.Dataset, joint: str) -> np.ndarray:
    """Return the mode of a joint at each sample of the whole run, (m,) integers."""
    series = contact_series(run, joint)
    modes = np.where(flights(series), FLIGHT, FOLLOWING).astype(np.int8)
    for one in impacts_of(run, joint):
        modes[one.span.first : one.follows] = IMPACT
    return modes


def mode_shares(modes: xr.Dataset) -> xr.Dataset:
    """Return the shares of time of what `contact_modes` gives.

    `share` over (joint, mode), and with two joints `combination_share` over (big_end_mode,
    small_end_mode), nine numbers. Samples stand for the step that they begin.
    """
    mode = modes["mode"].isel(time=slice(None, -1)).values
    each = mode[:, :, None] == np.arange(len(MODES))
    attrs = {"units": "1", "long_name": "share of time in a contact mode"}
    found = xr.Dataset(
        {"share": (("joint", "mode"), each.mean(axis=0), attrs)},
        {"joint": modes["joint"].values, "mode": list(MODES)},
    )
    if mode.shape[1] == 2:
        both = (each[:, 0, :, None] & each[:, 1, None, :]).mean(axis=0)
        attrs = {"units": "1", "long_name": "share of time in a combination of contact modes"}
        dims = [f"{joint}_mode" for joint in modes["joint"].values]
        found = found.assign_coords({dim: list(MODES) for dim in dims})
        found["combination_share"] = (dims, both, attrs)
    return found


def angle_modes(run: xr.Dataset) -> xr.Dataset:
    """Return `mode_map` of a run's `contact_modes`, in bins of 1 degree; raises ValueError as
    they do.
    """
    return mode_map(contact_modes(run))


def mode_map(modes: xr.Dataset, width_deg: float = 1.0) -> xr.Dataset:
    """Return what `contact_modes` gives over the crank angle, all revolutions together.

    Over bins of `width_deg`, with `angle` (deg, 0 to 360) the middle of each: `share` over (angle,
    joint, mode), and `majority` over (angle, joint), the mode with the greatest share, the first
    of equals. A bin without samples has shares of nan and the majority -1. Raises ValueError where
    the width is no whole part of a revolution.
    """
    count = round(360.0 / width_deg) if width_deg > 0 else 0
    if count < 1 or abs(count * width_deg - 360.0) > 1e-6:
        raise ValueError(f"width_deg = {width_deg:g} is no whole part of 360")
    kept = modes.isel(time=slice(None, -1))
    # a sample on an edge belongs to the bin that begins there, whatever its rounding
    place = np.floor(np.degrees(kept["crank_angle"].values) / width_deg + 1e-6).astype(int) % count
    samples = np.bincount(place, minlength=count)
    mode = kept["mode"].values
    shares = np.full((count, mode.shape[1], len(MODES)), np.nan)
    for joint, number in np.ndindex(shares.shape[1:]):
        found = np.bincount(place, mode[:, joint] == number, minlength=count)
        np.divide(found, samples, out=shares[:, joint, number], where=samples > 0)
    majority = np.where(np.isnan(shares[:, :, 0]), UNKNOWN, np.argmax(shares, axis=2))
    flags = modes["mode"].attrs | {"long_name": "contact mode that is most frequent"}
    share = {"units": "1", "long_name": "share of time in a contact mode"}
    angle = {"units": "deg", "long_name": "crank angle from top dead centre, middle of the bin"}
    return xr.Dataset(
        {
            "share": (("angle", "joint", "mode"), shares, share),
            "majority": (("angle", "joint"), majority.astype(np.int8), flags),
        },
        {
            "angle": ("angle", (np.arange(count) + 0.5) * width_deg, angle),
            "joint": modes["joint"].values,
            "mode": list(MODES),
        },
    )

"""Studies with made-up metrics, as `open_study` gives them."""

import numpy as np
import xarray as xr

UNITS = {"clearance_mm": "mm", "speed_rpm": "rpm", "rod_mass_kg": "kg"}


def coordinate(dim, name, values):
    key = "joint" if name == "fault" else name
    attrs = {"case_key": key} | ({"units": UNITS[name]} if name in UNITS else {})
    return xr.Variable(dim, np.array(values), attrs)


def metrics(dims, peak, status=None, regime=None):
    """A dataset of jobs with peak and rms accelerations, and their bars."""
    ok = np.full(peak.shape, "ok") if status is None else np.array(status)
    done = np.where(ok == "ok", peak, np.nan)
    keys = np.array([f"k{n}" for n in range(peak.size)]).reshape(peak.shape)
    chaotic = np.full(peak.shape, "predictable") if regime is None else np.array(regime)
    return xr.Dataset(
        {
            "status": (dims, ok),
            "reason": (dims, np.where(ok == "failed", "non_finite", "")),
            "regime": (dims, chaotic),
            "peak_acceleration": (dims, done),
            "peak_acceleration_error": (dims, np.where(chaotic == "chaotic", np.inf, 0.01 * done)),
            "rms_acceleration": (dims, 0.5 * done),
            "rms_acceleration_error": (dims, 1e-4 * done),
            "key": (dims, keys),
        }
    ).set_coords("key")


def grid(axes, function, **more):
    """A study over axes, a mapping of names to values; function: of arrays of their places."""
    places = [
        np.arange(len(values)) if isinstance(values[0], str) else np.array(values, float)
        for values in axes.values()
    ]
    peak = function(*np.meshgrid(*places, indexing="ij"))
    data = metrics((*axes,), np.asarray(peak, float), **more)
    return data.assign_coords({n: coordinate(n, n, values) for n, values in axes.items()})


def listed(columns, peak, **more):
    """A study that is a list of jobs, with a column for each swept key."""
    data = metrics(("job",), np.asarray(peak, float), **more)
    return data.assign_coords({n: coordinate("job", n, v) for n, v in columns.items()})

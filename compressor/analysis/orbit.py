"""The journal's orbit in its clearance circle, and where its force turns."""

import itertools
from typing import TYPE_CHECKING

import numpy as np

from compressor.analysis.contacts import (
    ContactSeries,
    contact_series,
    flights,
    joints_with_clearance,
)
from compressor.analysis.runs import settled_part

if TYPE_CHECKING:
    import xarray as xr

SAME_TURN_DEGREES = 20.0  # degrees: changes of sign nearer to each other are one turn


def turning_points(angle: np.ndarray, force: np.ndarray) -> tuple[float, ...]:
    """Return the crank angles (degrees, 0 to 360) at which a force changes its sign.

    angle: of the samples, (m,) degrees; changes of several revolutions, and of a force that
    trembles about zero, are put together where they are nearer than `SAME_TURN_DEGREES`.
    """
    at = np.sort(angle[1:][np.diff(np.sign(force)) != 0] % 360.0)
    if not at.size:
        return ()
    groups: list[list[float]] = [[at[0]]]
    for one, other in itertools.pairwise(at):
        if other - one > SAME_TURN_DEGREES:
            groups.append([])
        groups[-1].append(float(other))
    if len(groups) > 1 and groups[0][0] + 360.0 - groups[-1][-1] <= SAME_TURN_DEGREES:
        groups[0] = [one - 360.0 for one in groups.pop()] + groups[0]
    return tuple(sorted(float(np.mean(group)) % 360.0 for group in groups))


SERIES = {  # over time and joint: unit, long name
    "eccentricity_ratio": ("1", "eccentricity over radial clearance; above 1: pressed in"),
    "contact_angle": ("rad", "direction of the eccentricity from x, counter-clockwise, unwrapped"),
    "off_wall": ("1", "whether the journal is off its bore (penetration < 0)"),
    "in_flight": ("1", "whether the journal flies: no contact, and off its bore in between"),
}
NUMBERS = {  # over joint
    "least_ratio": ("1", "least eccentricity ratio"),
    "greatest_ratio": ("1", "greatest eccentricity ratio"),
    "laps": ("1", "turns of the contact angle in a revolution, counter-clockwise"),
    "off_wall_share": ("1", "share of samples with the journal off its bore"),
    "leaves_wall": ("1", "whether the journal is ever off its bore"),
}


def orbit(run: "xr.Dataset") -> "xr.Dataset":
    """Return the orbit of each journal with clearance after settling.

    Over (time, joint): `SERIES`; over joint: `NUMBERS`; `time` has the crank angle (rad) as a
    coordinate. The contact angle is that of the bearing's wall next to the journal. Where the
    journal passes near the centre between two samples its turn is known to a whole turn only, so
    that `laps` is sure where `least_ratio` is not small. Raises ValueError for a run without time
    series or clearance.
    """
    import xarray as xr

    joints = [*joints_with_clearance(run)]
    settled = settled_part(run)
    found = [orbit_of(contact_series(settled, joint)) for joint in joints]
    one = contact_series(settled, joints[0])
    angle = {"units": "rad", "long_name": "crank angle from top dead centre"}
    coordinates = {
        "time": ("time", one.time, {"units": "s", "long_name": "time"}),
        "crank_angle": ("time", one.angle, angle),
        "joint": ("joint", list(joints)),
    }
    variables = {}
    for dims, table in ((("time", "joint"), SERIES), (("joint",), NUMBERS)):
        for name, (unit, phrase) in table.items():
            values = np.stack([each[name] for each in found], axis=-1)
            variables[name] = (dims, values, {"units": unit, "long_name": phrase})
    return xr.Dataset(variables, coordinates)


def orbit_of(series: ContactSeries) -> dict[str, np.ndarray]:
    """Return `SERIES` and `NUMBERS` of one joint: arrays (m,) and scalars."""
    ratio = np.linalg.norm(series.place, axis=1) / series.clearance
    angle = np.unwrap(np.arctan2(series.place[:, 1], series.place[:, 0]))
    off = series.depth < 0
    return {
        "eccentricity_ratio": ratio,
        "contact_angle": angle,
        "off_wall": off,
        "in_flight": flights(series),
        "least_ratio": ratio.min(),
        "greatest_ratio": ratio.max(),
        "laps": (angle[-1] - angle[0]) / (series.angle[-1] - series.angle[0]),
        "off_wall_share": off.mean(),
        "leaves_wall": off.any(),
    }

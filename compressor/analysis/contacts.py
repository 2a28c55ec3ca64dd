"""Contacts of a joint in a run: where they begin and end, impacts, and contact modes.

In contact means F_N > 0, as everywhere in the program (physics/README.md, Contact). The force on
the rod is F_N n - F_t t with n along the eccentricity, so that F_N is its part along n. Contact is
dry contact: the force of a film across a gap is none.

The three contact modes, flight, impact and following, are those of Miedema and Mansour, Mechanical
joints with clearance: a three-mode model, Journal of Engineering for Industry 98 (1976) 1319-1323;
Flores and Lankarani, Contact force models for multibody dynamics (2016), use them as well. Ours is
how they are told apart in samples:

- flight: no contact (F_N = 0) from one contact to the next, with the journal off its bore in
  between;
- impact: the first contact after flight, for one compression and one restitution: until the force
  vanishes, or the penetration has passed a maximum and then a minimum, and no longer than an
  undamped impact of rod and reciprocating mass together would last at the same approach speed;
- following: the rest. The force may vanish within it, as long as the journal stays pressed in.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from compressor.analysis.runs import record_of
from compressor.metrics import JOINTS
from compressor.physics import elastic_form

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class ContactSeries:
    """One joint's motion and force at the m samples of a run; SI.

    `time`, `angle` (crank angle, rad), `depth` (penetration) and `normal` (F_N) have the shape
    (m,), `place` (eccentricity) has (m, 2).
    """

    joint: str
    time: np.ndarray
    angle: np.ndarray
    place: np.ndarray
    depth: np.ndarray
    normal: np.ndarray


def joints_with_clearance(run: "xr.Dataset") -> dict[str, float]:
    """Return the joints that have clearance, with it (m). Raises ValueError without series."""
    if "penetration" not in run or "time" not in run.dims:
        raise ValueError("the run has no time series (output.keep: series)")
    clearances = record_of(run)["clearance"]
    return {joint: float(c) for joint, c in zip(JOINTS, clearances, strict=True) if c > 0}


def contact_series(run: "xr.Dataset", joint: str) -> ContactSeries:
    """Return a joint's samples, up to where the run stopped."""
    # arrays one by one: cutting the whole Dataset takes ten times as long
    depth = run["penetration"].sel(joint=joint).values.astype(float)
    valid = np.isfinite(depth)
    place, force = (
        run[name].sel(joint=joint).transpose("time", "axis").values[valid]
        for name in ("eccentricity", "contact_force")
    )
    place = place.astype(float)
    distance = np.linalg.norm(place, axis=1)
    along = (force * place).sum(axis=1)
    normal = np.divide(along, distance, out=np.zeros_like(distance), where=distance > 0)
    normal[depth[valid] < 0] = 0.0  # what acts across a gap is a film of oil
    return ContactSeries(
        joint,
        run["time"].values[valid],
        run["crank_angle"].values[valid],
        place,
        depth[valid],
        normal,
    )


def flights(series: ContactSeries) -> list[tuple[int, int]]:
    """Return the first sample of each flight, and the one behind its last.

    A flight has no contact and is off the bore at some time. A contact that is lost and found again
    within the penetration leaves no flight; one between two samples is not seen.
    """
    edges = np.flatnonzero(np.diff(series.normal <= 0, prepend=False, append=False)).reshape(-1, 2)
    return [(a, b) for a, b in edges.tolist() if (series.depth[a:b] < 0).any()]


@dataclass(frozen=True)
class Impact:
    """One impact; its first sample, and the first that is following contact."""

    joint: str
    time: float  # of first touch, s
    crank_angle: float  # of first touch, degrees from top dead centre, 0 to 360
    revolution: int  # of first touch, the run's first being 1
    first: int
    follows: int


def impacts(run: "xr.Dataset") -> list[Impact]:
    """Return the impacts after settling, by time.

    An impact is a contact (F_N > 0) that begins after the journal was off its bore, as in
    `impact_count`; one that lies between two samples is not seen. Raises ValueError for a run
    without time series.
    """
    joints, begin = joints_with_clearance(run), run.attrs["settle"] * (1 - 1e-12)
    found = [one for joint in joints for one in impacts_of(run, contact_series(run, joint))]
    return sorted((one for one in found if one.time >= begin), key=lambda one: one.time)


def impacts_of(run: "xr.Dataset", series: ContactSeries) -> list[Impact]:
    """Return the impacts at one joint over the whole run, start-up included."""
    p, number = record_of(run), JOINTS.index(series.joint)
    contact = elastic_form(float(p["stiffness"][number]), float(p["clearance"][number]), p)
    mass = float(p["rod_mass"] + p["reciprocating_mass"])
    found = []
    for begin, first in flights(series):
        if first == series.time.size:  # no contact follows
            continue
        last = begin + int(np.flatnonzero(series.depth[begin:first] < 0)[-1])  # off its bore
        depth, times = (one[max(0, last - 1) : last + 2] for one in (series.depth, series.time))
        rates = np.diff(depth) / np.diff(times)
        time = float(np.interp(0.0, depth[-2:], times[-2:]))
        speed = max(0.0, float(rates.max()))
        longest = contact.impact_time(contact.impact_depth(mass, speed), speed)
        turns = np.interp(time, series.time, series.angle) / (2 * np.pi)
        follows = following_from(series, first, time + longest)
        found.append(
            Impact(series.joint, time, float(360 * (turns % 1)), int(turns) + 1, first, follows)
        )
    return found


def following_from(series: ContactSeries, first: int, until: float) -> int:
    """Return the first sample of a contact, by its first one, that is no longer impact.

    An impact is one compression and one restitution. It ends where the penetration has passed a
    maximum and then a minimum, and at the latest at `until`, s.
    """
    released = np.flatnonzero(series.normal[first:] <= 0)
    beyond = first + int(released[0]) if released.size else series.time.size
    late = int(np.searchsorted(series.time[:beyond], until, side="right"))
    depth = series.depth[first:beyond]
    falling = np.flatnonzero(np.diff(depth) < 0)
    if falling.size:
        rising = np.flatnonzero(np.diff(depth[falling[0] :]) > 0)
        if rising.size:
            beyond = first + int(falling[0] + rising[0])
    return max(first + 1, min(beyond, late))


FLIGHT, IMPACT, FOLLOWING = range(3)  # contact modes


def modes_of(series: ContactSeries, struck: Sequence[Impact]) -> np.ndarray:
    """Return the mode of a joint at each sample, (m,) numbers; struck: its impacts."""
    modes = np.full(series.time.size, FOLLOWING, np.int8)
    for begin, beyond in flights(series):
        modes[begin:beyond] = FLIGHT
    for one in struck:
        modes[one.first : one.follows] = IMPACT
    return modes

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

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import Polynomial

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
    clearance: float
    time: np.ndarray
    angle: np.ndarray
    place: np.ndarray
    depth: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class ContactSpan:
    """A contact: the samples `first` to `last`, and `gap` of them without contact before it.

    `after_flight`: the journal was off its bore within that gap, as `impact_count` has it.
    """

    first: int
    last: int
    gap: int
    after_flight: bool


def joints_with_clearance(run: "xr.Dataset") -> dict[str, float]:
    """Return the joints of a run that have clearance, with it, m.

    Raises ValueError where the run has no time series or no joint has clearance.
    """
    if "penetration" not in run or "time" not in run.dims:
        raise ValueError("the run has no time series (output.keep: series)")
    clearances = record_of(run)["clearance"]
    found = {joint: float(c) for joint, c in zip(JOINTS, clearances, strict=True) if c > 0}
    if not found:
        raise ValueError("no joint of the run has clearance")
    return found


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
        float(record_of(run)["clearance"][JOINTS.index(joint)]),
        run["time"].values[valid],
        run["crank_angle"].values[valid],
        place,
        depth[valid],
        normal,
    )


def contact_spans(series: ContactSeries) -> list[ContactSpan]:
    """Return the contacts of a joint in order of time; one between two samples is not seen."""
    touching = series.normal > 0
    edges = np.flatnonzero(np.diff(touching, prepend=False, append=False)).reshape(-1, 2)
    found, before = [], 0
    for first, beyond in edges.tolist():
        flown = bool((series.depth[before:first] < 0).any())
        found.append(ContactSpan(first, beyond - 1, first - before, flown))
        before = beyond
    return found


STENCIL = 4  # samples that the journal's path before first touch is a polynomial through


@dataclass(frozen=True)
class Impact:
    """One impact with its contact; SI but for the angle.

    `follows`: the first sample that is following contact; after `span.last` where there is none.
    """

    joint: str
    time: float  # of first touch
    crank_angle: float  # of first touch, degrees from top dead centre, 0 to 360
    revolution: int  # of first touch, the run's first being 1
    approach_speed: float  # relative normal speed at first touch
    span: ContactSpan
    follows: int


def impacts(run: "xr.Dataset") -> list[Impact]:
    """Return the impacts after settling, by time.

    An impact is a contact (F_N > 0) that begins after the journal was off its bore, as in
    `impact_count`; one that lies between two samples is not seen. Raises ValueError for a run
    without time series or clearance.
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
    for span in contact_spans(series):
        if not span.after_flight:
            continue
        begin, speed = touch(series, span)
        longest = contact.impact_time(contact.impact_depth(mass, speed), speed)
        turns = np.interp(begin, series.time, series.angle) / (2 * np.pi)
        found.append(
            Impact(
                series.joint, begin, float(360.0 * (turns % 1.0)), int(turns) + 1, speed, span,
                following_from(series, span, begin + longest),
            )
        )  # fmt: skip
    return found


def touch(series: ContactSeries, span: ContactSpan) -> tuple[float, float]:
    """Return the time (s) and approach speed (m/s) of a contact's first touch.

    Without contact the eccentricity is smooth, so that it is taken as the polynomial through the
    last `STENCIL` samples without contact; of shorter flights through those and the first one in
    contact. First touch is where its length reaches the clearance. The error of the speed falls
    with the cube of the sample step.
    """
    from scipy.optimize import brentq  # takes 0.2 s, of commands that need no impacts too

    first = span.first
    chosen = np.arange(first - min(STENCIL, span.gap), first + (span.gap < STENCIL))
    step = series.time[first] - series.time[first - 1]
    s = (series.time[chosen] - series.time[first]) / step
    x, y = (Polynomial.fit(s, values, s.size - 1) for values in series.place[chosen].T)

    def gap(at: float) -> float:
        return math.hypot(x(at), y(at)) - series.clearance

    at = -1.0 if gap(-1.0) >= 0 else 0.0
    if gap(-1.0) < 0 < gap(0.0):
        at = float(brentq(gap, -1.0, 0.0))
    rate = x(at) * x.deriv()(at) + y(at) * y.deriv()(at)
    speed = float(rate / math.hypot(x(at), y(at)) / step)
    return float(series.time[first] + at * step), max(0.0, speed)


def following_from(series: ContactSeries, span: ContactSpan, until: float) -> int:
    """Return the first sample of a contact that is no longer impact.

    An impact is one compression and one restitution. It ends where the penetration has passed a
    maximum and then a minimum, and at the latest at `until`, s.
    """
    depth = series.depth[span.first : span.last + 1]
    falling = np.flatnonzero(np.diff(depth) < 0)
    beyond = span.last + 1
    late = int(np.searchsorted(series.time[:beyond], until, side="right"))
    if falling.size:
        rising = np.flatnonzero(np.diff(depth[falling[0] :]) > 0)
        if rising.size:
            beyond = span.first + int(falling[0] + rising[0])
    return max(span.first + 1, min(beyond, late))


FLIGHT, IMPACT, FOLLOWING = range(3)  # contact modes


def modes_of(series: ContactSeries, struck: Sequence[Impact]) -> np.ndarray:
    """Return the mode of a joint at each sample, (m,) numbers; struck: its impacts.

    A flight has no contact and is off the bore at some time. A contact that is lost and found again
    within the penetration leaves no flight.
    """
    modes = np.full(series.time.size, FOLLOWING, np.int8)
    edges = np.flatnonzero(np.diff(series.normal <= 0, prepend=False, append=False)).reshape(-1, 2)
    for begin, beyond in edges.tolist():
        if (series.depth[begin:beyond] < 0).any():
            modes[begin:beyond] = FLIGHT
    for one in struck:
        modes[one.span.first : one.follows] = IMPACT
    return modes

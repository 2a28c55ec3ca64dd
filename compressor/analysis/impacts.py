"""The impacts of a run: contacts that began after flight, and what each of them did."""

import math
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.polynomial import Polynomial

from compressor.analysis.contacts import (
    ContactSeries,
    Span,
    contact_series,
    contact_spans,
    joints_with_clearance,
)
from compressor.analysis.runs import record_of
from compressor.metrics import JOINTS
from compressor.physics import elastic_form

STENCIL = 4  # samples that the journal's path before first touch is a polynomial through
FINER = 16  # points a sample step in which force times rate is summed
COLUMNS = {  # over impact: unit, long name
    "joint": ("", "joint of the impact"),
    "time": ("s", "time of first touch"),
    "crank_angle": ("deg", "crank angle of first touch, from top dead centre, 0 to 360"),
    "revolution": ("1", "revolution of first touch, the run's first being 1"),
    "approach_speed": ("m/s", "relative normal speed at first touch"),
    "duration": ("s", "from first touch until the normal force vanishes"),
    "impact_duration": ("s", "part of it that is impact and not following"),
    "impulse": ("N s", "integral of the normal force over the contact"),
    "lost_energy": ("J", "integral of normal force times penetration rate, less what is stored"),
    "released": ("1", "whether the contact ended before the run did"),
}


@dataclass(frozen=True)
class Impact:
    """One impact by the names of `COLUMNS`, with its contact.

    `follows`: the first sample that is following contact; after `span.last` where there is none.
    """

    joint: str
    time: float
    crank_angle: float
    revolution: int
    approach_speed: float
    duration: float
    impact_duration: float
    impulse: float
    lost_energy: float
    released: bool
    span: Span
    follows: int


def impacts(run: xr.Dataset) -> xr.Dataset:
    """Return the table of impacts after settling, in order of time: `COLUMNS` over the dim
    `impact`.

    An impact is a contact (F_N > 0) that begins after the journal was off its bore, as in
    `impact_count`; one that lies between two samples is not seen. `lost_energy` is what the contact
    damping took, the clamp of the force at zero included, since the elastic energy is zero at both
    ends (physics/README.md, Energy); what a contact still stores where the run's end cuts it off is
    taken from it. Integrals run over the whole contact, which may go on as following contact.
    Raises ValueError for a run without time series or clearance.
    """
    found = [one for joint in joints_with_clearance(run) for one in impacts_of(run, joint)]
    found = [one for one in found if one.time >= run.attrs["settle"] * (1 - 1e-12)]
    found.sort(key=lambda one: one.time)
    kinds: dict[str, type | str] = {
        "joint": f"U{max(map(len, JOINTS))}",
        "revolution": int,
        "released": bool,
    }
    variables = {}
    for name, (unit, phrase) in COLUMNS.items():
        values = np.array([getattr(one, name) for one in found], dtype=kinds.get(name, float))
        attrs = {"units": unit, "long_name": phrase} if unit else {"long_name": phrase}
        variables[name] = ("impact", values, attrs)
    return xr.Dataset(variables)


def impacts_of(run: xr.Dataset, joint: str) -> list[Impact]:
    """Return the impacts at one joint over the whole run, start-up included."""
    series = contact_series(run, joint)
    p = record_of(run)
    number = JOINTS.index(joint)
    contact = elastic_form(float(p["stiffness"][number]), float(p["clearance"][number]), p)
    mass = float(p["rod_mass"] + p["reciprocating_mass"])
    found = []
    for span in contact_spans(series):
        if not span.after_flight:
            continue
        begin, speed = touch(series, span)
        longest = contact.impact_time(contact.impact_depth(mass, speed), speed)
        one = impact(series, span, (begin, speed), longest)
        if not one.released:  # what is stored elastically is not lost
            stored = contact.energy(float(series.depth[-1]))
            one = replace(one, lost_energy=one.lost_energy - stored)
        found.append(one)
    return found


def touch(series: ContactSeries, span: Span) -> tuple[float, float]:
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


def release(series: ContactSeries, span: Span) -> float:
    """Return the time (s) at which the normal force of a contact vanishes: by its last slope.

    Known to a part of a sample step. Of a contact of one sample it is half a step later; of one
    that the run's end cuts off, the run's end.
    """
    last, time, normal = span.last, series.time, series.normal
    if last + 1 == time.size:
        return float(time[last])
    step = time[last + 1] - time[last]
    fall = normal[last - 1] - normal[last]
    if last == span.first:
        return float(time[last] + 0.5 * step)
    share = normal[last] / fall if fall > 0 else 1.0
    return float(time[last] + step * min(1.0, share))


def impact(
    series: ContactSeries, span: Span, touched: tuple[float, float], longest: float
) -> Impact:
    """Return the impact of a contact, from its first touch (s, m/s); `longest`: it may last, s."""
    begin, speed = touched
    end = release(series, span)
    follows = following_from(series, span, begin + longest)
    time = series.time
    impulse, lost = impulse_and_loss(series, span, begin, end)
    turns = np.interp(begin, time, series.angle) / (2 * np.pi)
    return Impact(
        series.joint,
        begin,
        float(360.0 * (turns % 1.0)),
        int(turns) + 1,
        speed,
        end - begin,
        (end if follows > span.last else min(end, float(time[follows]))) - begin,
        impulse,
        lost,
        span.last + 1 < time.size,
        span,
        follows,
    )  # fmt: skip


def following_from(series: ContactSeries, span: Span, until: float) -> int:
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


def impulse_and_loss(
    series: ContactSeries, span: Span, begin: float, end: float
) -> tuple[float, float]:
    """Return the impulse (N s) and lost energy (J) of a contact from `begin` to `end`, s.

    The force is a monotone cubic (Fritsch and Carlson) through the samples in contact and zero at
    both ends; the journal's path is a cubic spline through them and two samples on either side.
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator

    inside = slice(span.first, span.last + 1)
    time, normal = series.time[inside], series.normal[inside]
    # an end nearer to a sample would have a slope of rounding alone
    least = 1e-3 * (series.time[1] - series.time[0])
    if time[0] - begin > least:
        time, normal = np.append(begin, time), np.append(0.0, normal)
    if end - time[-1] > least:
        time, normal = np.append(time, end), np.append(normal, 0.0)
    if time.size < 2:
        return 0.0, 0.0
    force = PchipInterpolator(time, normal)
    around = slice(max(0, span.first - 2), span.last + 3)
    path = CubicSpline(series.time[around], series.place[around])
    fine = np.linspace(time[0], time[-1], FINER * (time.size - 1) + 1)
    place = path(fine)
    rate = (place * path(fine, 1)).sum(axis=1) / np.linalg.norm(place, axis=1)
    return float(force.integrate(time[0], time[-1])), float(np.trapezoid(force(fine) * rate, fine))

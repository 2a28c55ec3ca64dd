"""Where the contacts of a joint begin and end, in a run with time series.

In contact means F_N > 0, as everywhere in the program (physics/README.md, Contact). The force on
the rod is F_N n - F_t t with n along the eccentricity, so that F_N is its part along n. Contact is
dry contact: the force of a film across a gap is none.
"""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor.analysis.runs import record_of
from compressor.metrics import JOINTS


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
class Span:
    """A contact: the samples `first` to `last`, and `gap` of them without contact before it.

    `after_flight`: the journal was off its bore within that gap, as `impact_count` has it.
    """

    first: int
    last: int
    gap: int
    after_flight: bool


def joints_with_clearance(run: xr.Dataset) -> dict[str, float]:
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


def clearance_of(run: xr.Dataset, joint: str) -> float:
    """Return the radial clearance (m) of a joint of a run."""
    return float(record_of(run)["clearance"][JOINTS.index(joint)])


def contact_series(run: xr.Dataset, joint: str) -> ContactSeries:
    """Return a joint's samples, up to where the run stopped."""
    # arrays one by one: cutting the whole Dataset takes ten times as long
    depth = run["penetration"].sel(joint=joint).values.astype(float)
    there = np.isfinite(depth)
    place, force = (
        run[name].sel(joint=joint).transpose("time", "axis").values[there]
        for name in ("eccentricity", "contact_force")
    )
    place = place.astype(float)
    distance = np.linalg.norm(place, axis=1)
    along = (force * place).sum(axis=1)
    normal = np.divide(along, distance, out=np.zeros_like(distance), where=distance > 0)
    normal[depth[there] < 0] = 0.0  # what acts across a gap is a film of oil
    return ContactSeries(
        joint,
        clearance_of(run, joint),
        run["time"].values[there],
        run["crank_angle"].values[there],
        place,
        depth[there],
        normal,
    )


def contact_spans(series: ContactSeries) -> list[Span]:
    """Return the contacts of a joint in order of time; one between two samples is not seen."""
    touching = series.normal > 0
    edges = np.flatnonzero(np.diff(touching, prepend=False, append=False)).reshape(-1, 2)
    found, before = [], 0
    for first, beyond in edges.tolist():
        flown = bool((series.depth[before:first] < 0).any())
        found.append(Span(first, beyond - 1, first - before, flown))
        before = beyond
    return found


def flights(series: ContactSeries) -> np.ndarray:
    """Return which samples are in flight, (m,) booleans: no contact until the next, and once off
    the bore.

    A contact that is lost and found again within the penetration leaves no flight.
    """
    flying = series.normal <= 0
    edges = np.flatnonzero(np.diff(flying, prepend=False, append=False)).reshape(-1, 2)
    for begin, beyond in edges.tolist():
        flying[begin:beyond] = (series.depth[begin:beyond] < 0).any()
    return flying

"""How a journal moves in its bearing, measured on a stored run."""

import itertools
from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor.analysis.runs import case_of, ideal_motion, settled

APART = 20.0  # degrees: changes of sign nearer to each other are one turn
AFTER, SPAN = 5.0, 90.0  # degrees after a turn, and how long its ringing is looked at
PADDED = 16  # times longer with zeros, so that the lines of its spectrum lie close
DRIFT = 5  # degree of the polynomial that is taken off what rings
LEAST_RING = 12.0  # of the crank's frequency: below it a motion is the machine's


@dataclass(frozen=True)
class Course:
    """A journal's motion in its bearing after settling.

    `apart`: share of time without contact; `least`: least penetration (m) of the samples,
    negative where there is a gap; `laps`: how often the journal goes round its bearing in a
    revolution, counter-clockwise positive; `turns`: crank angles (degrees) at which the horizontal
    force changes its sign; `rings` (Hz): the strongest frequency of the acceleration's deviation
    from the ideal motion after the first of them, nan where nothing turns.
    """

    joint: str
    apart: float
    least: float
    laps: float
    turns: tuple[float, ...]
    rings: float


def course(run: xr.Dataset, joint: str) -> Course:
    """Return the course of a joint with clearance, from a run with time series."""
    kept = settled(run)
    angle = np.degrees(kept["crank_angle"].values)
    place = kept["eccentricity"].sel(joint=joint).values
    contact = np.unwrap(np.arctan2(place[:, 1], place[:, 0]))
    depth = kept["penetration"].sel(joint=joint).values
    force = kept["contact_force"].sel(joint=joint, axis="x").values
    turns = turning_points(angle, force)
    return Course(
        joint,
        float(run["contact_loss_fraction"].sel(joint=joint)),
        float(depth.min()),
        float((contact[-1] - contact[0]) / np.radians(angle[-1] - angle[0])),
        turns,
        ringing(kept, turns[0]) if turns else float("nan"),
    )


def turning_points(angle: np.ndarray, force: np.ndarray) -> tuple[float, ...]:
    """Return the crank angles (degrees, 0 to 360) at which a force changes its sign.

    angle: of the samples, (m,) degrees; changes of several revolutions, and of a force that
    trembles about zero, are put together where they are nearer than `APART`.
    """
    at = np.sort(angle[1:][np.diff(np.sign(force)) != 0] % 360.0)
    if not at.size:
        return ()
    groups: list[list[float]] = [[at[0]]]
    for one, other in itertools.pairwise(at):
        if other - one > APART:
            groups.append([])
        groups[-1].append(float(other))
    if len(groups) > 1 and groups[0][0] + 360.0 - groups[-1][-1] <= APART:
        groups[0] = [one - 360.0 for one in groups.pop()] + groups[0]
    return tuple(sorted(float(np.mean(group)) % 360.0 for group in groups))


def ringing(kept: xr.Dataset, turn: float) -> float:
    """Return the strongest frequency (Hz) of the acceleration's deviation after a turn
    (degrees).
    """
    from scipy.signal import find_peaks, periodogram

    angle = np.degrees(kept["crank_angle"].values)
    begin = angle[0] + (turn + AFTER - angle[0]) % 360.0
    seen = (angle >= begin) & (angle < begin + SPAN)
    rest = (kept["acceleration"].values - ideal_motion(kept)[2])[seen]
    if rest.size < 2 * DRIFT:
        return float("nan")
    count = np.linspace(-1.0, 1.0, rest.size)
    rest = rest - np.polyval(np.polyfit(count, rest, DRIFT), count)
    time = kept["time"].values
    rate = 1.0 / (time[1] - time[0])
    how = {"nfft": PADDED * rest.size, "detrend": False}
    frequency, power = periodogram(rest, rate, np.hanning(rest.size), **how)
    lines, _ = find_peaks(power)  # an end of the spectrum is no line, but a slower motion's foot
    lines = lines[frequency[lines] >= LEAST_RING * case_of(kept).omega / (2.0 * np.pi)]
    return float(frequency[lines[np.argmax(power[lines])]]) if lines.size else float("nan")

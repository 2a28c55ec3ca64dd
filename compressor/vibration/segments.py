"""Levels in segments of crank angle, as protection systems of reciprocating machines watch them."""

import numpy as np


def segment_levels(
    angle_deg: np.ndarray, values: np.ndarray, count: int = 36
) -> tuple[np.ndarray, np.ndarray]:
    """Return the peak and the rms in equal segments of crank angle, (count,) each.

    angle_deg: of the samples, at any revolution, (m,); values: (m,), in any unit. Segment k goes
    from 360 k / count degrees, included, to the next, not included. The peak is the greatest
    magnitude of its samples, the rms their root mean square; both nan where a segment has none.
    """
    # an angle that rounding has put just before a segment's begin lies in it
    place = np.floor(np.asarray(angle_deg) * (count / 360.0) + 1e-9).astype(int) % count
    values = np.asarray(values, float)
    peak = np.full(count, np.nan)
    np.fmax.at(peak, place, np.abs(values))
    number = np.bincount(place, minlength=count)
    square = np.bincount(place, values**2, count)
    return peak, np.sqrt(np.divide(square, number, out=np.full(count, np.nan), where=number > 0))

"""The last steps of a march that has stopped, taken once more and looked at one by one.

A march is resumable to the bit, so that nothing needs to be kept of a run that ends well but how
it stood before its last chunk.
"""

import math

import numpy as np

from compressor.physics import FLOWS, Pair, derivative_with_flows, step_error
from compressor.solve.marching import March, Standing
from compressor.solve.request import LAST, History


def retrace(before: Standing, after: Standing, march: March) -> History:
    """Return the history of a march that stood like `before` and stopped like `after`.

    `before` is written.
    """
    made = after.attempts - before.attempts
    if made > LAST:
        march.advance(before, made - LAST)
    found = History()
    for _ in range(min(made, LAST)):
        now = before.copy()
        w = now.walker
        if w.fresh:
            phase = int(march.phases[w.segment])
            derivative_with_flows(w.t, now.z, phase, march.request.p, now.work.k[0])
        march.advance(before, 1)
        step = attempted(now.walker, before.walker, float(march.edges[w.segment + 1]))
        scaled = scaled_error(now, before, step, march.request.rtol, march.size)
        error = math.sqrt(float(np.mean(scaled**2)))
        found.add(float(w.t), step, error, described(now.walker, before.walker))
        found.dominant = dominant(scaled, before.work.new[: march.size.size])
    return found


def attempted(now: np.record, then: np.record, end: float) -> float:
    """Return the length (s) of the step that was attempted, by the rules of `march`."""
    if then.steps > now.steps:
        return float(then.t - now.t)
    if now.landing > 0.0 or now.h == 0.0:
        return float(now.landing) or math.nan
    h = min(now.h, end - now.t)
    return float(end - now.t if now.t + 1.01 * h >= end else h)


def scaled_error(
    now: Standing, then: Standing, step: float, rtol: float, size: np.ndarray
) -> np.ndarray:
    """Return the estimated error of each number of the motion over its tolerance, (n,)."""
    n = now.z.size - FLOWS
    error = step_error(now.walker, now.work.k, then.work.k, step)[:n]
    largest = np.maximum(np.abs(now.z[:n]), np.abs(then.work.new[:n]))
    return error / (rtol * (size + largest))


def dominant(scaled: np.ndarray, new: np.ndarray) -> int:
    """Return the number of the state that went bad first, or has the largest error."""
    bad = np.flatnonzero(~np.isfinite(new) | ~np.isfinite(scaled))
    return int(bad[0]) if bad.size else int(np.abs(scaled).argmax())


def described(now: np.record, then: np.record) -> str:
    """Return the method of an attempt, and what became of it."""
    method = "RODAS" if now.stiff else Pair(int(now.pair)).name
    if then.steps > now.steps:
        return f"{method} to an onset" if now.landing > 0.0 else f"{method} taken"
    return f"{method} refused" if then.rejected > now.rejected else f"{method} cut at an onset"

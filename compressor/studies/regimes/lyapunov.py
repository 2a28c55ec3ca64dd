"""The largest Lyapunov exponent of a motion: how fast close motions part, or come together.

Benettin, Galgani, Giorgilli and Strelcyn, Meccanica 15 (1980): a twin starts a small distance away;
after each short interval the growth ln(d / d0) is taken, and the difference is pulled back to d0
along itself. It turns into the direction that grows fastest. Twins go in step
(`compressor.physics.march`), by the stiff method alone: explicit steps that stability holds part
twins of motions that draw them together. A small end with a hundred times the paper's damping was
measured at -1.0 by stiff steps and at +17 by explicit ones of the same tolerance. On periodic
motions the exponent is the logarithm of the largest Floquet multiplier
(tests/studies/regimes/test_lyapunov.py).
"""

import math
import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from compressor.cases import Case
from compressor.reasons import Reason
from compressor.solve import (
    Cuts,
    Request,
    Stop,
    Twins,
    is_ideal,
    parts,
    record,
    standard_error,
    sure,
)

METHOD = "RODAS"  # of the twins, whatever the case has
RTOLS = (1e-8, 1e-7, 1e-6)  # the next one where steps shrink to nothing, on a contact's edge
TWIN_DISTANCE = 1e-7  # natural sizes: how far from the motion its twin starts
LOST_DISTANCE = 1e-12  # natural sizes: a distance that rounding alone makes, and below
INTERVALS = 36  # in a revolution: a joint's differences grow or shrink by some 20 times in one
# revolutions at least, and a quarter of those counted, in which the difference turns
MIN_TURNING_REV = 4
MAX_BATCHES, MIN_BATCH = 16, 4  # batches, and revolutions in one: whole periods of 1, 2 and 4
# 1/revolution: what steps of RTOLS change; the paper's joints were measured at half of the first
# two, the third goes on in their course
OF_STEPS = 0.01, 0.03, 0.1
NO_LIMIT = 2**62  # attempts of a step


class Exponent(NamedTuple):
    """A largest Lyapunov exponent, in 1/revolution.

    `value` and `error`: half the length of the interval that holds in 95 % of cases, what steps
    change included; both nan where the twins' run stopped before its end. `at_most`: the twins
    came as near to each other as rounding, so that the exponent is `value` or less.
    """

    value: float
    error: float
    at_most: bool = False


def largest_exponent(case: Case, state: np.ndarray, revolutions: int, timeout: float) -> Exponent:
    """Return the largest Lyapunov exponent of a case's motion from a state on.

    state: the motion, (2 n,) in m, rad and their rates, at a whole revolution (crank angle 0), as
    `Request.start` takes it; revolutions: how many are counted, after `MIN_TURNING_REV` or a
    quarter as many in which the difference turns, fewer than 8 give no error (inf); timeout: wall
    time (s). The case's own method, tolerance and max_steps do not count. The same call gives the
    same numbers to the bit, unless the time is up. Raises ValueError where all joints are ideal:
    there is no motion of theirs.
    """
    if is_ideal(case):
        raise ValueError("all joints are ideal: the crank alone moves the machine")
    if revolutions < 1:
        raise ValueError(f"{revolutions} revolutions: an exponent needs one at least")
    turning = max(MIN_TURNING_REV, math.ceil(revolutions / 4))
    times = case.turn * np.arange(1, INTERVALS * (turning + revolutions) + 1) / INTERVALS
    # positions and rates alone: what else a state holds, such as a crank's lag, need not fade
    moving = 2 * int(record(case)["freedoms"])
    push = np.zeros(state.size)
    push[:moving] = TWIN_DISTANCE / math.sqrt(moving)
    deadline = time.monotonic() + timeout
    p, ends = record(case), np.array([0.0, times[-1]])
    for rtol, of_steps in zip(RTOLS, OF_STEPS, strict=True):
        left = deadline - time.monotonic()
        request = Request(p, state, ends, 0.0, rtol, METHOD, NO_LIMIT, left, Cuts(times))
        twins = Twins(request, state)
        try:
            found, lost = growths(partial(follow, twins), push, times.size, LOST_DISTANCE)
        except Stop as stop:
            if stop.reason == Reason.BUDGET_SECONDS:
                break
            continue
        each, lost = (row.reshape(-1, INTERVALS)[turning:] for row in (found, lost))
        value, error = mean_with_error(each.sum(axis=1))
        return Exponent(value, error + of_steps, bool(lost.any()))
    return Exponent(math.nan, math.nan)


def follow(twins: Twins, difference: np.ndarray) -> np.ndarray:
    """Return a difference at the end of the next interval, in natural sizes. Raises Stop."""
    n = twins.size.size
    twins.twin[:n] = twins.z[:n] + difference * twins.size
    twins.advance(twins.ends.pop(0), math.inf)
    twins.check()
    return (twins.twin[:n] - twins.z[:n]) / twins.size


def growths(
    follow: Callable[[np.ndarray], np.ndarray], push: np.ndarray, count: int, least: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return growth ln(d / d0) of a difference in each of `count` intervals, and where it was lost.

    follow: takes the difference at the begin of an interval, gives it at the end, and goes on to
    the next one; push: the first difference, whose length d0 all others get; least: a length that
    rounding makes. A shorter one is lost: the growth is then ln(least / d0), a bound from above.
    """
    close = float(np.linalg.norm(push))
    found, lost = np.empty(count), np.zeros(count, dtype=bool)
    difference = push
    for i in range(count):
        after = follow(difference)
        length = float(np.linalg.norm(after))
        lost[i] = length < least
        found[i] = math.log(max(length, least) / close)
        if length > 0.0:
            difference = after * (close / length)
    return found, lost


def mean_with_error(values: np.ndarray) -> tuple[float, float]:
    """Return the mean of successive values, (n,), and its 95 % half-length by batch means.

    Of values that too few batches hold, the first are left out; inf where there is one batch.
    """
    means = np.array([part.mean() for part in parts(values, MAX_BATCHES, MIN_BATCH)])
    return float(means.mean()), float(sure(standard_error(means), len(means)))

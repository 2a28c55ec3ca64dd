"""The largest Lyapunov exponent of a motion: how fast close motions part, or come together.

Benettin, Galgani, Giorgilli and Strelcyn, Meccanica 15 (1980): a second run starts a small distance
away; after each revolution the growth ln(d / d0) is taken, and the difference is pulled back to d0
along itself. It turns into the direction that grows fastest. Each run has steps of its own, at a
tolerance far below d0. A difference that grows too large within a revolution to be a small one is
followed up to there alone. On periodic motions the exponent is the logarithm of the largest Floquet
multiplier (tests/studies/follow/test_lyapunov.py).
"""

import math
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from compressor import solve
from compressor.cases import Case

RTOL = 1e-12  # of both runs, whatever the case has
SHIFT = 1e-6  # natural sizes: how far from the motion the other one starts
LOST_DISTANCE = 1e-11  # natural sizes: a distance that steps and rounding make, and below
FAR_DISTANCE = 1e-2  # natural sizes: a distance that is not small any more
INTERVALS = 36  # in a revolution: a joint's differences grow or shrink by some 20 times in one
# revolutions at least, and a quarter of those counted, in which the difference turns
MIN_TURNING_REV = 4
MAX_BATCHES, MIN_BATCH = 16, 4  # batches, and revolutions in one: whole periods of 1, 2 and 4
OF_STEPS = 0.01  # 1/revolution: what the runs' own errors change
MAX_STEPS = 10_000_000  # of one revolution


class Exponent(NamedTuple):
    """A largest Lyapunov exponent, in 1/revolution.

    `value` and `error`: half the length of the interval that holds in 95 % of cases, what steps
    change included; both nan where a run stopped before its end. `at_most`: the runs
    came as near to each other as their errors, so that the exponent is `value` or less.
    """

    value: float
    error: float
    at_most: bool = False


class Growth(NamedTuple):
    """How a difference grew within a span: ln(d / d0), and the span's revolutions.

    `lost`: it shrank to what errors make; `growth` is then a bound from above.
    """

    growth: float
    span: float
    lost: bool


def largest_exponent(case: Case, state: np.ndarray, revolutions: int, timeout: float) -> Exponent:
    """Return the largest Lyapunov exponent of a case's motion from a state on.

    state: the motion, (2 n,) in m, rad and their rates, at a whole revolution (crank angle 0), as
    `Request.start` takes it; revolutions: how many are counted, after `MIN_TURNING_REV` or a
    quarter as many in which the difference turns, fewer than 8 give no error (inf); timeout: wall
    time (s). The case's own method, tolerance and max_steps do not count. The same call gives the
    same numbers to the bit, unless the time is up.
    """
    p, deadline = solve.record(case), time.monotonic() + timeout
    size, times = solve.natural_sizes(p), case.turn * np.arange(INTERVALS + 1) / INTERVALS
    # positions and rates alone: what else a state holds, such as a crank's lag, need not fade
    moving = 2 * int(p["freedoms"])
    push = np.zeros(state.size)
    push[:moving] = SHIFT / math.sqrt(moving)

    def run(start: np.ndarray) -> np.ndarray:
        """Return a motion at all `times`, nan from where it stopped."""
        left = deadline - time.monotonic()
        return solve.integrate(
            solve.Request(p, start, times, 0.0, RTOL, "auto", MAX_STEPS, left)
        ).states

    def follow(difference: np.ndarray) -> np.ndarray:
        """Return a difference over the next revolution, (INTERVALS, n), in natural sizes."""
        nonlocal state
        states, others = run(state), run(state + difference * size)
        state = states[-1]
        return (others - states)[1:] / size

    turning = max(MIN_TURNING_REV, math.ceil(revolutions / 4))
    found = growths(follow, push, turning + revolutions)[turning:]
    if len(found) < revolutions:
        return Exponent(math.nan, math.nan)
    spans = np.array([one.span for one in found])
    value, error = mean_with_error(np.array([one.growth for one in found]) / spans.mean())
    return Exponent(value, error + OF_STEPS, any(one.lost for one in found))


def growths(
    follow: Callable[[np.ndarray], np.ndarray], push: np.ndarray, count: int
) -> list[Growth]:
    """Return the growth of a difference in each of `count` spans, fewer where a run stopped.

    follow: takes the difference at the begin of a span, gives it at all looks until its end,
    (looks, n), and goes on to the next one; push: the first difference, whose length d0 all others
    get. It is looked at until it is `FAR_DISTANCE` long.
    """
    close, found = float(np.linalg.norm(push)), []
    difference = push
    for _ in range(count):
        differences = follow(difference)
        lengths = np.linalg.norm(differences, axis=1)
        far = np.flatnonzero(lengths > FAR_DISTANCE)
        last = int(far[0]) if far.size else len(lengths) - 1
        if not np.isfinite(lengths).all():
            break
        lost = bool(lengths[last] < LOST_DISTANCE)
        growth = math.log(max(lengths[last], LOST_DISTANCE) / close)
        if lengths[-1] > 0.0:
            difference = differences[-1] * (close / lengths[-1])
        found.append(Growth(growth, (last + 1) / len(lengths), lost))
    return found


def mean_with_error(values: np.ndarray) -> tuple[float, float]:
    """Return the mean of successive values, (n,), and its 95 % half-length by batch means.

    Of values that too few batches hold, the first are left out; inf where there is one batch.
    """
    means = np.array([part.mean() for part in solve.parts(values, MAX_BATCHES, MIN_BATCH)])
    return float(means.mean()), float(solve.sure(solve.standard_error(means), len(means)))

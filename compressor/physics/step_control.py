"""How long the next step is, and which method takes it; `march` decides whether one is taken.

PI control of the error, a first step from the rates, and the measured test for stiffness by which
a stepper turns to the stiff partner and back.
"""

import math
from enum import IntEnum

from compressor.physics._jit import inline_llvm, inline_once, jit, square_root
from compressor.physics.rosenbrock import STIFF_STAGES, spectral_radius
from compressor.physics.runge_kutta import FLOWS, STAGES, A
from compressor.physics.systems import derivative_with_flows

SAFETY, SHRINK, GROW = 0.9, 0.2, 5.0
PROPORTIONAL, INTEGRAL = 0.7, 0.4  # of PI control, over the order (Hairer & Wanner II, IV.2)
MIN_ERROR = math.log(1e-4)  # that the control remembers
LAST_STRETCH = 1.01  # steps: a segment that is shorter is taken as one step
MIN_STEP = 1e-13  # of the time reached plus a turn: below it steps make no way
NON_FINITE_SHRINK = 0.1  # of a step without a finite error: the next attempt's length
EXPLICIT_ORDER, STIFF_ORDER = 5, 4
# stiffness: an explicit step is held by stability where h |lambda| exceeds the limit
STABILITY_LIMIT = 3.25  # of the pair on the negative real axis, about
LIMITED_REACH = 0.6  # of the limit: under PI control, steps held by stability swing around it
TEST_INTERVAL = 4  # explicit steps from one test to the next
STEPS_BEFORE_STIFF, STEPS_BEFORE_EXPLICIT = 15, 10  # in a row, before a change of method
MIN_TEST_PAUSE, MAX_TEST_PAUSE = 50, 2000  # steps without a test after a change back


class Mode(IntEnum):
    """Which methods a stepper may use."""

    AUTO = 0  # explicit, and the stiff partner where stability holds the explicit steps
    EXPLICIT = 1
    STIFF = 2


# numba wants plain integers
AUTO = int(Mode.AUTO)


@jit
def first_step(w, z, work, atol, phase, p, end):
    """Return a length (s) for the first step of an order-5 method (Hairer & Wanner I, II.4)."""
    n = z.size - FLOWS
    rates, trial = work.k[0], work.column
    size, rate = 0.0, 0.0
    for i in range(n):
        scale = atol[i] + w.rtol * abs(z[i])
        size += (z[i] / scale) ** 2
        rate += (rates[i] / scale) ** 2
    size, rate = square_root(size / n), square_root(rate / n)
    guess = 1e-6 if size < 1e-5 or rate < 1e-5 else 0.01 * size / rate
    guess = min(guess, end - w.t)
    for i in range(z.size):
        work.new[i] = z[i] + guess * rates[i]
    derivative_with_flows(w.t + guess, work.new, phase, p, trial)
    w.evaluations += 1
    change = 0.0
    for i in range(n):
        scale = atol[i] + w.rtol * abs(z[i])
        change += ((trial[i] - rates[i]) / scale) ** 2
    change = square_root(change / n) / guess
    steepest = max(rate, change)
    by_slope = max(1e-6, guess * 1e-3) if steepest <= 1e-15 else (0.01 / steepest) ** 0.2
    return min(100.0 * guess, by_slope, end - w.t)


@inline_once
def next_step_length(w, h, error):
    """Return the next step's length after an accepted step, and remember its error: PI control."""
    now = math.log(max(error, 1e-10))
    order = STIFF_ORDER if w.stiff else EXPLICIT_ORDER
    # the last error damps steps that stability holds, which I control lets swing about the limit
    factor = SAFETY * math.exp((INTEGRAL * w.error - PROPORTIONAL * now) / order)
    w.error = max(now, MIN_ERROR)
    return h * min(GROW, max(SHRINK, factor))


@inline_once
def refuse(w, h, error):
    """Shorten the step after a refused attempt."""
    w.rejected += 1
    factor = NON_FINITE_SHRINK
    if error < math.inf:
        order = STIFF_ORDER if w.stiff else EXPLICIT_ORDER
        factor = max(SHRINK, SAFETY * math.exp(-math.log(max(error, 1e-10)) / order))
    w.h = h * factor


@inline_once
def stiff_rate(w, h, z, work, size):
    """Return an estimate of the largest eigenvalue's size (1/s) from the step just taken.

    By the last two explicit stages, which stand at one time (Hairer & Wanner II, IV.2), or the
    Jacobian.
    """
    n = size.size
    if w.stiff:
        for i in range(n):
            work.y[i] = work.k[STIFF_STAGES, i] + 1e-3 * size[i]
        return spectral_radius(work.jacobian, size, work.y, work.column[:n])
    above, below = 0.0, 0.0
    for i in range(n):
        change = work.new[i] - z[i]
        for j in range(STAGES - 2):
            change -= h * A[STAGES - 2, j] * work.k[j, i]
        above += ((work.k[STAGES - 1, i] - work.k[STAGES - 2, i]) / size[i]) ** 2
        below += (change / size[i]) ** 2
    return square_root(above / below) if below > 0.0 else 0.0


@inline_llvm
def choose_method(w, h, z, work, size):
    """Change to the stiff partner where stability holds the explicit steps, and back.

    A stiff step costs as much as `price` explicit ones; where it is not longer than that many
    stable explicit steps for a while, the explicit pair comes back and rests from the test: the
    longer, the more such stays in a row have cost more than they saved.
    """
    if w.mode != AUTO:
        return
    if w.steps_to_test > 0:
        w.steps_to_test -= 1
        return
    if not w.stiff and w.steps % TEST_INTERVAL:
        return  # an estimate costs a tenth of an explicit step
    reach = h * stiff_rate(w, h, z, work, size) / STABILITY_LIMIT
    if w.stiff:
        price = (size.size + STIFF_STAGES + 0.2 * size.size**2) / (STAGES - 1)
        w.explicit_ok = w.explicit_ok + 1 if reach < price else 0
        w.steps_saved += reach - price
        if w.explicit_ok >= STEPS_BEFORE_EXPLICIT:
            w.stiff, w.explicit_ok, w.stability_limited = 0, 0, 0
            # a machine that changes at every contact would pay for each change: rest longer
            longer = min(2 * w.test_pause, MAX_TEST_PAUSE)
            w.test_pause = MIN_TEST_PAUSE if w.steps_saved > 0.0 else longer
            w.steps_to_test = w.test_pause
            w.h = min(w.h, h / max(reach, 1.0))
    else:
        # one test alone decides nothing: under PI control such steps swing around the limit
        more = TEST_INTERVAL if reach > LIMITED_REACH else -TEST_INTERVAL
        w.stability_limited = max(0, w.stability_limited + more)
        if w.stability_limited >= STEPS_BEFORE_STIFF:
            w.stiff, w.stability_limited, w.explicit_ok, w.steps_saved = 1, 0, 0, 0.0

"""How long the next steps of lanes are, and how lanes go on: the rules of `step_control`.

A lane whose next step is no plain one calls for `march` itself.
"""

import math

from compressor.physics._jit import borrowed, inlined, jit, square_root
from compressor.physics.elementary import direction, exponential, logarithm
from compressor.physics.kinematics import SMALL
from compressor.physics.lane_rows import (
    ALIVE,
    BUDGET,
    CALL,
    COS,
    DEEPEST,
    END,
    ERROR,
    FIRST_FIELD,
    HELD,
    LANES,
    NEW,
    PLAIN,
    REFUSED,
    REMEMBERED,
    REST,
    SIN,
    SIZE,
    STATE,
    STEPS,
    TOO_DEEP,
    H,
    K,
    T,
    Z,
)  # fmt: skip
from compressor.physics.lane_steps import R0, R4, STEP_WEIGHTS
from compressor.physics.step_control import (
    EVERY,
    EXPLICIT_ORDER,
    GROW,
    INTEGRAL,
    LEAST_ERROR,
    LEAST_STEP,
    PROPORTIONAL,
    SAFETY,
    SHRINK,
    STABILITY_LIMIT,
    STIFF_STEPS,
    SUSPECT,
)  # fmt: skip


@inlined
def added_late(W, i, j, total):
    """Return the number i of what the state at the step's end is more than at its fifth stage,
    squared.
    """
    u = LANES * i + j
    h, w = W[H + j], STEP_WEIGHTS[5]
    change = W[NEW + u] - W[Z + u]
    change -= h * w[0] * W[K + u]
    change -= h * w[1] * W[K + STATE * LANES + u]
    change -= h * w[2] * W[K + 2 * STATE * LANES + u]
    change -= h * w[3] * W[K + 3 * STATE * LANES + u]
    change -= h * w[4] * W[K + 4 * STATE * LANES + u]
    return total + (change / W[SIZE + u]) ** 2


@inlined
def added_rate(W, i, j, total):
    """Return the same of dz/dt."""
    u = LANES * i + j
    change = W[K + 6 * STATE * LANES + u] - W[K + 5 * STATE * LANES + u]
    return total + (change / W[SIZE + u]) ** 2


@inlined
def stiffness(scene, W, j):
    """Return the step's length over what stability allows, as `step_control.stiff_rate` has it."""
    above = added_rate(W, 1, j, added_rate(W, 0, j, 0.0))
    above = added_rate(W, 3, j, added_rate(W, 2, j, above))
    below = added_late(W, 1, j, added_late(W, 0, j, 0.0))
    below = added_late(W, 3, j, added_late(W, 2, j, below))
    if len(scene) == 3:
        above = added_rate(W, 5, j, added_rate(W, 4, j, above))
        above = added_rate(W, 7, j, added_rate(W, 6, j, above))
        below = added_late(W, 5, j, added_late(W, 4, j, below))
        below = added_late(W, 7, j, added_late(W, 6, j, below))
    rate = square_root(above / below) if below > 0.0 else 0.0
    return W[H + j] * rate / STABILITY_LIMIT


@jit
def control(scene, W, k):
    """Watch for stiffness, choose the next steps' lengths, and move plain lanes on.

    A lane CALLs for `march` where the next step is not a plain one.
    """
    W = borrowed(W)
    for j in range(k):
        plain = W[PLAIN + j] > 0.0
        rests = W[REST + j] > 0.0
        steps = W[STEPS + j]
        asked = plain & (not rests) & (steps - EVERY * math.floor(steps / EVERY) == 0.0)
        held = W[HELD + j]
        longer = held + EVERY if stiffness(scene, W, j) > SUSPECT else max(0.0, held - EVERY)
        W[HELD + j] = longer if asked else held
        W[REST + j] = W[REST + j] - 1.0 if plain & rests else W[REST + j]
        W[STEPS + j] = steps + 1.0 if plain else steps
    for j in range(k):
        plain, alive = W[PLAIN + j] > 0.0, W[ALIVE + j] > 0.0
        error, h, t = W[ERROR + j], W[H + j], W[T + j]
        refused = alive & (error > 1.0) & (error < math.inf)
        now = logarithm(max(error, 1e-10))
        remembered = W[REMEMBERED + j]
        factor = SAFETY * exponential(
            (INTEGRAL * remembered - PROPORTIONAL * now) / EXPLICIT_ORDER if plain else 0.0
        )
        shorter = SAFETY * exponential(-now / EXPLICIT_ORDER if refused else 0.0)
        longer = h * min(GROW, max(SHRINK, factor)) if plain else h
        longer = h * max(SHRINK, shorter) if refused else longer
        reached = t + h if plain else t
        W[REMEMBERED + j] = max(now, LEAST_ERROR) if plain else remembered
        W[REFUSED + j] += 1.0 if refused else 0.0
        W[H + j] = longer
        W[T + j] = reached
        turning = W[FIRST_FIELD + j] * longer
        call = (reached + 1.01 * longer >= W[END + j]) | (turning > SMALL)
        call = call | (W[HELD + j] >= STIFF_STEPS) | (W[DEEPEST + j] > W[TOO_DEEP + j])
        call = call | (not (plain | refused)) | (W[STEPS + j] + W[REFUSED + j] >= W[BUDGET + j])
        call = call | (longer < LEAST_STEP * (reached + 1.0 / W[FIRST_FIELD + j]))
        W[CALL + j] = 1.0 if call & alive else 0.0


@inlined
def pass_on(W, j, plain, target, source):
    """Four rows from source to target in a plain lane; both are read, or no vector code comes."""
    t, s = target + j, source + j
    a, b = W[s], W[s + LANES]
    c, d = W[s + 2 * LANES], W[s + 3 * LANES]
    e, f = W[t], W[t + LANES]
    g, h = W[t + 2 * LANES], W[t + 3 * LANES]
    W[t], W[t + LANES] = a if plain else e, b if plain else f
    W[t + 2 * LANES], W[t + 3 * LANES] = c if plain else g, d if plain else h


@jit
def move_on(scene, W, k):
    """The end of a plain lane's step is the begin of its next: state, rates, what is seen."""
    W = borrowed(W)
    for j in range(k):
        plain = W[PLAIN + j] > 0.0
        pass_on(W, j, plain, Z, NEW)
        pass_on(W, j, plain, Z + 4 * LANES, NEW + 4 * LANES)
        pass_on(W, j, plain, K, K + 6 * STATE * LANES)
        pass_on(W, j, plain, K + 4 * LANES, K + (6 * STATE + 4) * LANES)
        if len(scene) == 3:
            pass_on(W, j, plain, Z + 8 * LANES, NEW + 8 * LANES)
            pass_on(W, j, plain, K + 8 * LANES, K + (6 * STATE + 8) * LANES)
    for j in range(k):
        plain = W[PLAIN + j] > 0.0
        pass_on(W, j, plain, R0, R4)
        pass_on(W, j, plain, R0 + 4 * LANES, R4 + 4 * LANES)
        pass_on(W, j, plain, R0 + 8 * LANES, R4 + 8 * LANES)
        pass_on(W, j, plain, R0 + 12 * LANES, R4 + 12 * LANES)
        W[COS + j], W[SIN + j] = direction(W[FIRST_FIELD + j] * W[T + j])

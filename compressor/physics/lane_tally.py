"""Whether steps of lanes are taken, what is tallied of them, and how long the next ones are.

The rules of `march` and `tally` for a step in which nothing begins or ends. A lane in which
something may is left as it was before the step.

How long the next steps of lanes are, and how lanes go on: the rules of `step_control`. A lane whose
next step is no plain one calls for `march` itself.
"""

import math

import numpy as np

from compressor.physics._jit import inline_numba, jit, square_root, without_refcount
from compressor.physics.contact_laws import in_contact
from compressor.physics.elementary import direction, exponential, logarithm
from compressor.physics.kinematics import SMALL
from compressor.physics.lane_steps import (
    ALIVE,
    BUDGET,
    CALL,
    COS,
    DEEPEST,
    END,
    ENERGY,
    ERROR,
    FIRST_FIELD,
    FLOWN,
    HELD,
    IMBALANCE,
    IMPACTS,
    LANES,
    LOSS_SECONDS,
    MAX_PENETRATION,
    MEASURED,
    MOMENT_SUM,
    NEAR,
    NEW,
    PEAK,
    PEAK_KINETIC,
    PEAKED,
    PLAIN,
    R0,
    R1,
    R2,
    R3,
    R4,
    REFUSED,
    RELEASES,
    REMEMBERED,
    REST,
    SECONDS,
    SETTLE,
    SIN,
    SIZE,
    SQUARE_ACCELERATION,
    SQUARE_DEVIATION,
    STATE,
    STEP_WEIGHTS,
    STEPS,
    TOO_DEEP,
    TORQUE_SUM,
    TOUCHING,
    H,
    K,
    T,
    Z,
)  # fmt: skip  # fmt: skip
from compressor.physics.march import COARSE_WEIGHTS, NODES, WEIGHTS
from compressor.physics.step_control import (
    EVERY,
    EXPLICIT_ORDER,
    GROW,
    INTEGRAL,
    MIN_ERROR,
    MIN_STEP,
    PROPORTIONAL,
    SAFETY,
    SHRINK,
    STABILITY_LIMIT,
    STIFF_STEPS,
    SUSPECT,
)  # fmt: skip
from compressor.physics.tally import PEAK_NEARNESS as NEAR_SHARE
from compressor.physics.tally import vertex


@inline_numba
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


@inline_numba
def added_rate(W, i, j, total):
    """Return the same of dz/dt."""
    u = LANES * i + j
    change = W[K + 6 * STATE * LANES + u] - W[K + 5 * STATE * LANES + u]
    return total + (change / W[SIZE + u]) ** 2


@inline_numba
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
    W = without_refcount(W)
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
        W[REMEMBERED + j] = max(now, MIN_ERROR) if plain else remembered
        W[REFUSED + j] += 1.0 if refused else 0.0
        W[H + j] = longer
        W[T + j] = reached
        turning = W[FIRST_FIELD + j] * longer
        call = (reached + 1.01 * longer >= W[END + j]) | (turning > SMALL)
        call = call | (W[HELD + j] >= STIFF_STEPS) | (W[DEEPEST + j] > W[TOO_DEEP + j])
        call = call | (not (plain | refused)) | (W[STEPS + j] + W[REFUSED + j] >= W[BUDGET + j])
        call = call | (longer < MIN_STEP * (reached + 1.0 / W[FIRST_FIELD + j]))
        W[CALL + j] = 1.0 if call & alive else 0.0


@inline_numba
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
    W = without_refcount(W)
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


N1, N2, N3 = (float(node) for node in NODES[1:4])
F0, F1, F2, F3, F4 = (float(weight) for weight in WEIGHTS)
G0, _, G2, _, G4 = (float(weight) for weight in COARSE_WEIGHTS)
# widths of the step's parts, added as `march.measure_apart` does
FINE_WHOLE = sum(float(width) for width in np.diff(NODES))
COARSE_WHOLE = sum(float(width) for width in np.diff(NODES[::2]))
DEVIATION, PENETRATION, NORMAL, NEARNESS = 7 * LANES, 8 * LANES, 10 * LANES, 12 * LANES
TORQUE, MOMENT = 14 * LANES, 15 * LANES
KINETIC, POTENTIAL = 16 * LANES, 17 * LANES


@inline_numba
def touches(scene, joint):
    """Return whether a joint of the scene has clearance."""
    return len(scene) == 3 or len(scene) == joint + 1


@inline_numba
def nears(W, j, column):
    """Return whether the greatest size of a column may be beaten within the step."""
    c = column * LANES + j
    top = max(abs(W[R0 + c]), abs(W[R2 + c]), abs(W[R4 + c]))
    return (top >= NEAR_SHARE * W[PEAK + c]) & (top > 0.0)


@inline_numba
def deepens(W, j, joint):
    """Return whether the greatest penetration of a joint may be beaten within the step."""
    c = joint * LANES + j
    top = max(W[R0 + PENETRATION + c], W[R2 + PENETRATION + c], W[R4 + PENETRATION + c])
    return (top > 0.0) & (top >= NEAR_SHARE * W[MAX_PENETRATION + c])


@inline_numba
def changes(W, j, joint):
    """Return whether contact may begin or end at a joint within the step, as `march.may_change`."""
    c = NEARNESS + joint * LANES + j
    low = min(W[R0 + c], W[R2 + c], W[R4 + c])
    high = max(W[R0 + c], W[R2 + c], W[R4 + c])
    beyond = 2.0 * (high - low)
    return (low - beyond <= 0.0) & (high + beyond > 0.0)


@jit
def judge(scene, W, k):
    """Return which lanes take their step (PLAIN), and which of these are to be looked at closer
    (NEAR).

    Returns whether any is.
    """
    W = without_refcount(W)
    for j in range(k):
        near = nears(W, j, 0) | nears(W, j, 1) | nears(W, j, 2) | nears(W, j, 3)
        near = near | nears(W, j, 4) | nears(W, j, 5) | nears(W, j, 6)
        near = near | deepens(W, j, 0) | deepens(W, j, 1)
        change = False
        if touches(scene, 0):
            change = changes(W, j, 0)
        if touches(scene, 1):
            change = change | changes(W, j, 1)
        measured = W[T + j] >= W[SETTLE + j]
        plain = (W[ERROR + j] <= 1.0) & (not change) & (W[ALIVE + j] > 0.0)
        W[MEASURED + j] = 1.0 if measured else 0.0
        W[PLAIN + j] = 1.0 if plain else 0.0
        W[NEAR + j] = 1.0 if near & measured & plain else 0.0
    total = 0.0
    for j in range(k):
        total += W[NEAR + j]
    return total > 0.0


@inline_numba
def may_touch(W, j, joint):
    """Return `march.may_touch` at a joint, by all nodes."""
    c = NEARNESS + joint * LANES + j
    low = min(min(min(W[R0 + c], W[R1 + c]), min(W[R2 + c], W[R3 + c])), W[R4 + c])
    high = max(max(max(W[R0 + c], W[R1 + c]), max(W[R2 + c], W[R3 + c])), W[R4 + c])
    return (low <= 0.0) & (high + (high - low) > 0.0)


@jit
def judge_closer(scene, W, k):
    """After a closer look at the lanes that are NEAR: they are left alone if contact may begin."""
    W = without_refcount(W)
    for j in range(k):
        near = W[NEAR + j] > 0.0
        touch = False
        if touches(scene, 0):
            touch = may_touch(W, j, 0)
        if touches(scene, 1):
            touch = touch | may_touch(W, j, 1)
        plain = W[PLAIN + j]
        W[PLAIN + j] = 0.0 if near & touch else plain
        W[NEAR + j] = 1.0 if near & (not touch) else 0.0


@inline_numba
def rises(a, b, c, d, e, fine):
    """As `tally.peak_of`: the top of the nodes' values and of the parabola through the best."""
    top = max(max(a, e), c)
    top = max(top, max(b, d)) if fine else top
    # the best is the first one of the greatest; the parabola stands on an inner node
    early = (a == top) | (b == top)
    middle = (not early) & (c == top)
    if fine:
        before = a if early else (b if middle else c)
        here = b if early else (c if middle else d)
        after = c if early else (d if middle else e)
        left = -N1 if early else (N1 - N2 if middle else N2 - N3)
        right = N2 - N1 if early else (N3 - N2 if middle else 1.0 - N3)
    else:
        before, here, after, left, right = a, c, e, -0.5, 0.5
    return top, vertex(left, right, before, here, after)


@inline_numba
def count_events(touching, flown, impacts, releases, normal, depth, counts, measured):
    """Return the touching, flown, impacts and releases after a node, if it counts."""
    now = in_contact(normal)
    off = flown | (depth < 0.0)
    begins = counts & measured & now & (not touching)
    impacts += 1.0 if begins & off else 0.0
    releases += 1.0 if begins & (not off) else 0.0
    touching = now if counts else touching
    flown = (off & (not now)) if counts else flown
    return touching, flown, impacts, releases


@inline_numba
def tally_joint(W, j, joint, plain, fine, measured):
    """Contact loss, impacts, releases and penetration of a step at one joint."""
    c = joint * LANES + j
    d, n, x = PENETRATION + c, NORMAL + c, NEARNESS + c
    touching, flown = W[TOUCHING + c] > 0.0, W[FLOWN + c] > 0.0
    hits, leaves = W[IMPACTS + c], W[RELEASES + c]
    touching, flown, hits, leaves = count_events(
        touching, flown, hits, leaves, W[R0 + n], W[R0 + d], True, measured
    )
    touching, flown, hits, leaves = count_events(
        touching, flown, hits, leaves, W[R1 + n], W[R1 + d], fine, measured
    )
    touching, flown, hits, leaves = count_events(
        touching, flown, hits, leaves, W[R2 + n], W[R2 + d], True, measured
    )
    touching, flown, hits, leaves = count_events(
        touching, flown, hits, leaves, W[R3 + n], W[R3 + d], fine, measured
    )
    touching, flown, hits, leaves = count_events(
        touching, flown, hits, leaves, W[R4 + n], W[R4 + d], True, measured
    )
    W[TOUCHING + c] = (1.0 if touching else 0.0) if plain else W[TOUCHING + c]
    W[FLOWN + c] = (1.0 if flown else 0.0) if plain else W[FLOWN + c]
    W[IMPACTS + c] = hits if plain else W[IMPACTS + c]
    W[RELEASES + c] = leaves if plain else W[RELEASES + c]
    top, rise = rises(W[R0 + d], W[R1 + d], W[R2 + d], W[R3 + d], W[R4 + d], fine)
    known = W[MAX_PENETRATION + c]
    best = max(top, known)
    best = best if 2.0 * top < known else max(best, rise)
    W[MAX_PENETRATION + c] = best if plain & measured else known
    W[DEEPEST + j] = max(W[DEEPEST + j], top) if plain else W[DEEPEST + j]
    # contact does not change within the step
    whole = FINE_WHOLE if fine else COARSE_WHOLE
    more = whole * W[H + j] if W[R2 + x] <= 0.0 else 0.0
    W[LOSS_SECONDS + c] += more if plain & measured else 0.0


@inline_numba
def add_squares(W, c, total, h, fine):
    """Return the square of a column added to a total at the nodes, by their weights."""
    b, d = (W[R1 + c] if fine else 0.0), (W[R3 + c] if fine else 0.0)
    total += h * (F0 if fine else G0) * W[R0 + c] ** 2
    total += h * F1 * b**2
    total += h * (F2 if fine else G2) * W[R2 + c] ** 2
    total += h * F3 * d**2
    return total + h * (F4 if fine else G4) * W[R4 + c] ** 2


@inline_numba
def add_integral(W, c, total, h, fine):
    """Return a column added to a total at the nodes, by their weights."""
    b, d = (W[R1 + c] if fine else 0.0), (W[R3 + c] if fine else 0.0)
    total += h * (F0 if fine else G0) * W[R0 + c]
    total += h * F1 * b
    total += h * (F2 if fine else G2) * W[R2 + c]
    total += h * F3 * d
    return total + h * (F4 if fine else G4) * W[R4 + c]


@jit
def tally_lanes(scene, W, k):
    """Tally the steps of plain lanes: as `tally_energy` and `tally_step`."""
    W = without_refcount(W)
    f = (8 if len(scene) == 3 else 4) * LANES
    for j in range(k):
        plain = W[PLAIN + j] > 0.0
        kinetic = W[R4 + KINETIC + j]
        put_in = kinetic + W[R4 + POTENTIAL + j] - W[ENERGY + j]
        put_in = put_in - W[NEW + f + j] - W[NEW + f + LANES + j]
        imbalance = abs(put_in + W[NEW + f + 2 * LANES + j] + W[NEW + f + 3 * LANES + j])
        worst = W[IMBALANCE + j]
        W[IMBALANCE + j] = imbalance if plain & (not (imbalance <= worst)) else worst
        most = W[PEAK_KINETIC + j]
        W[PEAK_KINETIC + j] = max(most, kinetic) if plain else most
    for j in range(k):
        plain, measured = W[PLAIN + j] > 0.0, W[MEASURED + j] > 0.0
        fine = W[NEAR + j] > 0.0
        if touches(scene, 0):
            tally_joint(W, j, 0, plain, fine, measured)
        if touches(scene, 1):
            tally_joint(W, j, 1, plain, fine, measured)
    for j in range(k):
        counts = (W[PLAIN + j] > 0.0) & (W[MEASURED + j] > 0.0)
        fine = W[NEAR + j] > 0.0
        h = W[H + j] if counts else 0.0
        W[SECONDS + j] += h
        W[SQUARE_ACCELERATION + j] = add_squares(W, j, W[SQUARE_ACCELERATION + j], h, fine)
        W[SQUARE_DEVIATION + j] = add_squares(W, DEVIATION + j, W[SQUARE_DEVIATION + j], h, fine)
        W[TORQUE_SUM + j] = add_integral(W, TORQUE + j, W[TORQUE_SUM + j], h, fine)
        W[MOMENT_SUM + j] = add_integral(W, MOMENT + j, W[MOMENT_SUM + j], h, fine)
    for column in range(PEAKED):
        o = column * LANES
        for j in range(k):
            counts = (W[PLAIN + j] > 0.0) & (W[MEASURED + j] > 0.0)
            fine = W[NEAR + j] > 0.0
            c = o + j
            top, rise = rises(
                abs(W[R0 + c]), abs(W[R1 + c]), abs(W[R2 + c]), abs(W[R3 + c]), abs(W[R4 + c]),
                fine,
            )  # fmt: skip
            known = W[PEAK + c]
            best = max(known, max(top, rise)) if 2.0 * top >= known else known
            W[PEAK + c] = best if counts else known

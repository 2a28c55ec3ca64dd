"""Whether steps of lanes are taken, what is tallied of them, and how long the next ones are.

The rules are functions of numbers in `step_control`, `onset` and `tally`, which `march` calls, too.
They are applied here to a step in which nothing begins or ends. A lane in which something may is
left as it was before the step, and one whose next step is no plain one calls for `march` itself.
"""

import math

import numpy as np

from compressor.physics._jit import inline_numba, jit, square_root, without_refcount
from compressor.physics.elementary import direction
from compressor.physics.kinematics import MAX_SERIES_ANGLE
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
    IMBALANCE,
    IMPACTS,
    LANES,
    LAST_ERROR,
    LOSS_SECONDS,
    MAX_DEPTH,
    MAX_PENETRATION,
    MEASURED,
    MOMENT_SUM,
    NEAR_PEAK,
    NEW,
    PEAK,
    PEAK_KINETIC,
    PLAIN,
    R0,
    R1,
    R2,
    R3,
    R4,
    REJECTED,
    RELEASES,
    SECONDS,
    SETTLE,
    SIN,
    SIZE,
    SQUARE_ACCELERATION,
    SQUARE_DEVIATION,
    STABILITY_LIMITED,
    STATE,
    STEP_WEIGHTS,
    STEPS,
    STEPS_TO_TEST,
    TORQUE_SUM,
    TOUCHING,
    H,
    K,
    T,
    Z,
    read_four,
)
from compressor.physics.march import COARSE_WEIGHTS, NODES, WEIGHTS
from compressor.physics.onset import may_change_in, may_touch_in
from compressor.physics.step_control import (
    EXPLICIT_ORDER,
    MIN_ERROR,
    STABILITY_LIMIT,
    STEPS_BEFORE_STIFF,
    TEST_INTERVAL,
    count_limited,
    growth,
    is_accepted,
    is_last_step,
    log_error,
    shortest_step,
    shrinkage,
)
from compressor.physics.tally import (
    PEAKED,
    count_contacts,
    larger_imbalance,
    may_beat,
    may_exceed,
    vertex,
)


@inline_numba
def add_late_change(W, i, j, total):
    """Return a total and the square of number i's change from the fifth stage to the step's end."""
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
def add_rate_change(W, i, j, total):
    """Return a total and the square of the same change of the rate of number i."""
    u = LANES * i + j
    change = W[K + 6 * STATE * LANES + u] - W[K + 5 * STATE * LANES + u]
    return total + (change / W[SIZE + u]) ** 2


@inline_numba
def stiffness(scene, W, j):
    """Return the step's length over what stability allows, as `step_control.stiff_rate` has it."""
    above = add_rate_change(W, 1, j, add_rate_change(W, 0, j, 0.0))
    above = add_rate_change(W, 3, j, add_rate_change(W, 2, j, above))
    below = add_late_change(W, 1, j, add_late_change(W, 0, j, 0.0))
    below = add_late_change(W, 3, j, add_late_change(W, 2, j, below))
    if len(scene) == 3:
        above = add_rate_change(W, 5, j, add_rate_change(W, 4, j, above))
        above = add_rate_change(W, 7, j, add_rate_change(W, 6, j, above))
        below = add_late_change(W, 5, j, add_late_change(W, 4, j, below))
        below = add_late_change(W, 7, j, add_late_change(W, 6, j, below))
    rate = square_root(above / below) if below > 0.0 else 0.0
    return W[H + j] * rate / STABILITY_LIMIT


@jit
def choose_next_steps(scene, W, k):
    """Test plain lanes for stiffness, and write the length of every lane's next step.

    A lane CALLs for `march` where the next step is not a plain one.
    """
    W = without_refcount(W)
    for j in range(k):
        plain = W[PLAIN + j] > 0.0
        pause = W[STEPS_TO_TEST + j]
        pauses = pause > 0.0
        steps = W[STEPS + j]
        due = steps - TEST_INTERVAL * math.floor(steps / TEST_INTERVAL) == 0.0
        limited = W[STABILITY_LIMITED + j]
        counted = count_limited(limited, stiffness(scene, W, j))
        W[STABILITY_LIMITED + j] = counted if plain & due & (not pauses) else limited
        W[STEPS_TO_TEST + j] = pause - 1.0 if plain & pauses else pause
        W[STEPS + j] = steps + 1.0 if plain else steps
    for j in range(k):
        plain, alive = W[PLAIN + j] > 0.0, W[ALIVE + j] > 0.0
        error, h, t = W[ERROR + j], W[H + j], W[T + j]
        refused = alive & (not is_accepted(error)) & (error < math.inf)
        now, last = log_error(error), W[LAST_ERROR + j]
        now = now if plain | refused else 0.0  # any other lane's error may be no number
        longer, shorter = growth(now, last, EXPLICIT_ORDER), shrinkage(now, EXPLICIT_ORDER)
        next_h = h * longer if plain else h
        next_h = h * shorter if refused else next_h
        reached = t + h if plain else t
        W[LAST_ERROR + j] = max(now, MIN_ERROR) if plain else last
        W[REJECTED + j] += 1.0 if refused else 0.0
        W[H + j] = next_h
        W[T + j] = reached
        turning = W[FIRST_FIELD + j] * next_h
        call = is_last_step(reached, next_h, W[END + j]) | (turning > MAX_SERIES_ANGLE)
        call = call | (W[STABILITY_LIMITED + j] >= STEPS_BEFORE_STIFF)
        call = call | (W[DEEPEST + j] > W[MAX_DEPTH + j])
        call = call | (not (plain | refused)) | (W[STEPS + j] + W[REJECTED + j] >= W[BUDGET + j])
        call = call | (next_h < shortest_step(reached, W[FIRST_FIELD + j]))
        W[CALL + j] = 1.0 if call & alive else 0.0


@inline_numba
def copy_if_plain(W, j, plain, target, source):
    """Copy four rows to others in a plain lane; both are read, or no vector code comes."""
    t, s = target + j, source + j
    a, b = W[s], W[s + LANES]
    c, d = W[s + 2 * LANES], W[s + 3 * LANES]
    e, f = W[t], W[t + LANES]
    g, h = W[t + 2 * LANES], W[t + 3 * LANES]
    W[t], W[t + LANES] = a if plain else e, b if plain else f
    W[t + 2 * LANES], W[t + 3 * LANES] = c if plain else g, d if plain else h


@jit
def advance_lanes(scene, W, k):
    """Make the end of a plain lane's step the begin of its next: state, rates and observations."""
    W = without_refcount(W)
    for j in range(k):
        plain = W[PLAIN + j] > 0.0
        copy_if_plain(W, j, plain, Z, NEW)
        copy_if_plain(W, j, plain, Z + 4 * LANES, NEW + 4 * LANES)
        copy_if_plain(W, j, plain, K, K + 6 * STATE * LANES)
        copy_if_plain(W, j, plain, K + 4 * LANES, K + (6 * STATE + 4) * LANES)
        if len(scene) == 3:
            copy_if_plain(W, j, plain, Z + 8 * LANES, NEW + 8 * LANES)
            copy_if_plain(W, j, plain, K + 8 * LANES, K + (6 * STATE + 8) * LANES)
    for j in range(k):
        plain = W[PLAIN + j] > 0.0
        copy_if_plain(W, j, plain, R0, R4)
        copy_if_plain(W, j, plain, R0 + 4 * LANES, R4 + 4 * LANES)
        copy_if_plain(W, j, plain, R0 + 8 * LANES, R4 + 8 * LANES)
        copy_if_plain(W, j, plain, R0 + 12 * LANES, R4 + 12 * LANES)
        copy_if_plain(W, j, plain, R0 + 16 * LANES, R4 + 16 * LANES)
        W[COS + j], W[SIN + j] = direction(W[FIRST_FIELD + j] * W[T + j])


N1, N2, N3 = (float(node) for node in NODES[1:4])
F0, F1, F2, F3, F4 = (float(weight) for weight in WEIGHTS)
G0, _, G2, _, G4 = (float(weight) for weight in COARSE_WEIGHTS)
# widths of the step's parts, added as `march.measure_gap_fractions` does
FINE_WHOLE = sum(float(width) for width in np.diff(NODES))
COARSE_WHOLE = sum(float(width) for width in np.diff(NODES[::2]))
DEVIATION, PENETRATION, NORMAL, NEARNESS = 9 * LANES, 10 * LANES, 12 * LANES, 14 * LANES
TORQUE, MOMENT = 16 * LANES, 17 * LANES
KINETIC, POTENTIAL = 18 * LANES, 19 * LANES


@inline_numba
def has_clearance(scene, joint):
    """Return whether a joint of the scene has clearance."""
    return len(scene) == 3 or len(scene) == joint + 1


@inline_numba
def at_nodes(W, column):
    """Return an observed column of a lane at the five nodes of its step."""
    return W[R0 + column], W[R1 + column], W[R2 + column], W[R3 + column], W[R4 + column]


@inline_numba
def may_beat_peak(W, j, column):
    """Return whether the greatest size of a column may be beaten within the step."""
    a, _, c, _, e = at_nodes(W, column * LANES + j)
    return may_beat(max(abs(a), abs(c), abs(e)), W[PEAK + column * LANES + j])


@inline_numba
def may_beat_depth(W, j, joint):
    """Return whether the greatest penetration of a joint may be beaten within the step."""
    a, _, c, _, e = at_nodes(W, PENETRATION + joint * LANES + j)
    return may_beat(max(a, c, e), W[MAX_PENETRATION + joint * LANES + j])


@inline_numba
def may_change_at(W, j, joint):
    """Return whether contact may begin or end at a joint within the step, as `onset.may_change`."""
    a, _, c, _, e = at_nodes(W, NEARNESS + joint * LANES + j)
    return may_change_in(min(a, c, e), max(a, c, e))


@jit
def select_plain_steps(scene, W, k):
    """Write which lanes take their step (PLAIN), and which of these need all nodes (NEAR_PEAK).

    Returns whether any does.
    """
    W = without_refcount(W)
    for j in range(k):
        near = may_beat_peak(W, j, 0) | may_beat_peak(W, j, 1) | may_beat_peak(W, j, 2)
        near = near | may_beat_peak(W, j, 3) | may_beat_peak(W, j, 4) | may_beat_peak(W, j, 5)
        near = near | may_beat_peak(W, j, 6) | may_beat_peak(W, j, 7) | may_beat_peak(W, j, 8)
        near = near | may_beat_depth(W, j, 0) | may_beat_depth(W, j, 1)
        change = False
        if has_clearance(scene, 0):
            change = may_change_at(W, j, 0)
        if has_clearance(scene, 1):
            change = change | may_change_at(W, j, 1)
        measured = W[T + j] >= W[SETTLE + j]
        plain = is_accepted(W[ERROR + j]) & (not change) & (W[ALIVE + j] > 0.0)
        W[MEASURED + j] = 1.0 if measured else 0.0
        W[PLAIN + j] = 1.0 if plain else 0.0
        W[NEAR_PEAK + j] = 1.0 if near & measured & plain else 0.0
    found = 0
    for j in range(k):
        found |= 1 if W[NEAR_PEAK + j] > 0.0 else 0
    return found > 0


@inline_numba
def may_touch_at(W, j, joint):
    """Return `onset.may_touch` at a joint, by all nodes."""
    a, b, c, d, e = at_nodes(W, NEARNESS + joint * LANES + j)
    return may_touch_in(min(a, b, c, d, e), max(a, b, c, d, e))


@jit
def exclude_onsets(scene, W, k):
    """Take lanes that are NEAR_PEAK out of the plain ones if contact may begin, by all nodes."""
    W = without_refcount(W)
    for j in range(k):
        near = W[NEAR_PEAK + j] > 0.0
        touch = False
        if has_clearance(scene, 0):
            touch = may_touch_at(W, j, 0)
        if has_clearance(scene, 1):
            touch = touch | may_touch_at(W, j, 1)
        plain = W[PLAIN + j]
        W[PLAIN + j] = 0.0 if near & touch else plain
        W[NEAR_PEAK + j] = 1.0 if near & (not touch) else 0.0


@inline_numba
def top_and_vertex(values, fine):
    """Return the greatest of a step's values at its nodes, and of the parabola through the best.

    fine: whether all nodes count, or every second one. `tally.peak_of` is the same by indices,
    which lanes cannot have.
    """
    a, b, c, d, e = values
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
def range_at_nodes(values, fine):
    """Return the greatest and the least of a step's values at its nodes; fine: as above."""
    a, b, c, d, e = values
    top, low = max(max(a, e), c), min(min(a, e), c)
    return max(top, max(b, d)) if fine else top, min(low, min(b, d)) if fine else low


@inline_numba
def sizes_at_nodes(W, column):
    """Return the sizes of an observed column of a lane at the five nodes of its step."""
    a, b, c, d, e = at_nodes(W, column)
    return abs(a), abs(b), abs(c), abs(d), abs(e)


@inline_numba
def may_rise(values, fine, known, counts):
    """Return 1 where a parabola through a step's nodes may rise above a known peak, else 0.

    Through three neighbours of the nodes it rises above them by less than a third of their range;
    half of it is allowed for here. Where no lane's does, as in seven of eight steps, no lane needs
    the divisions of `top_and_vertex`.
    """
    top, low = range_at_nodes(values, fine)
    return 1 if counts & (top + 0.5 * (top - low) > known) else 0


@inline_numba
def raise_peak(values, fine, known, counts):
    """Return a known peak, or a larger one of a step that counts, by nodes and parabola."""
    top, top_of_parabola = top_and_vertex(values, fine)
    best = max(known, top, top_of_parabola if may_exceed(top, known) else top)
    return best if counts else known


@inline_numba
def raise_peak_at_nodes(values, fine, known, counts):
    """Return `raise_peak` of a step whose parabola does not rise above the known peak."""
    top, _ = range_at_nodes(values, fine)
    return max(known, top) if counts else known


@jit
def raise_peaks(W, k):
    """Raise the greatest sizes of the observed columns by the steps of plain, measured lanes."""
    W = without_refcount(W)
    for column in range(PEAKED):
        o, p = column * LANES, PEAK + column * LANES
        rises = 0
        for j in range(k):
            counts, fine = (W[PLAIN + j] > 0.0) & (W[MEASURED + j] > 0.0), W[NEAR_PEAK + j] > 0.0
            rises |= may_rise(sizes_at_nodes(W, o + j), fine, W[p + j], counts)
        if rises > 0:
            for j in range(k):
                counts = (W[PLAIN + j] > 0.0) & (W[MEASURED + j] > 0.0)
                values, fine = sizes_at_nodes(W, o + j), W[NEAR_PEAK + j] > 0.0
                W[p + j] = raise_peak(values, fine, W[p + j], counts)
        else:
            for j in range(k):
                counts = (W[PLAIN + j] > 0.0) & (W[MEASURED + j] > 0.0)
                values, fine = sizes_at_nodes(W, o + j), W[NEAR_PEAK + j] > 0.0
                W[p + j] = raise_peak_at_nodes(values, fine, W[p + j], counts)


@jit
def raise_depths(scene, W, k):
    """Raise the greatest penetrations by the steps of plain, measured lanes."""
    W = without_refcount(W)
    for joint in range(2):
        if has_clearance(scene, joint):
            o, p = PENETRATION + joint * LANES, MAX_PENETRATION + joint * LANES
            rises = 0
            for j in range(k):
                counts = (W[PLAIN + j] > 0.0) & (W[MEASURED + j] > 0.0)
                values, fine = at_nodes(W, o + j), W[NEAR_PEAK + j] > 0.0
                rises |= may_rise(values, fine, W[p + j], counts)
            if rises > 0:
                for j in range(k):
                    counts = (W[PLAIN + j] > 0.0) & (W[MEASURED + j] > 0.0)
                    values, fine = at_nodes(W, o + j), W[NEAR_PEAK + j] > 0.0
                    W[p + j] = raise_peak(values, fine, W[p + j], counts)
            else:
                for j in range(k):
                    counts = (W[PLAIN + j] > 0.0) & (W[MEASURED + j] > 0.0)
                    values, fine = at_nodes(W, o + j), W[NEAR_PEAK + j] > 0.0
                    W[p + j] = raise_peak_at_nodes(values, fine, W[p + j], counts)


@inline_numba
def count_contacts_at(W, row, c, events, use, counts):
    """Return `tally.count_contacts` after a node whose rows begin at `row`, if it is one to use."""
    a, b, m, n = events
    normal, depth = W[row + NORMAL + c], W[row + PENETRATION + c]
    e, f, g, h = count_contacts(a, b, m, n, normal, depth, counts)
    return e if use else a, f if use else b, g if use else m, h if use else n


@inline_numba
def tally_joint(W, j, joint, plain, fine, measured):
    """Add a step's contact loss, impacts, releases and penetration at one joint."""
    c = joint * LANES + j
    events = W[TOUCHING + c] > 0.0, W[FLOWN + c] > 0.0, W[IMPACTS + c], W[RELEASES + c]
    events = count_contacts_at(W, R0, c, events, True, measured)
    events = count_contacts_at(W, R1, c, events, fine, measured)
    events = count_contacts_at(W, R2, c, events, True, measured)
    events = count_contacts_at(W, R3, c, events, fine, measured)
    touching, flown, hits, leaves = count_contacts_at(W, R4, c, events, True, measured)
    W[TOUCHING + c] = (1.0 if touching else 0.0) if plain else W[TOUCHING + c]
    W[FLOWN + c] = (1.0 if flown else 0.0) if plain else W[FLOWN + c]
    W[IMPACTS + c] = hits if plain else W[IMPACTS + c]
    W[RELEASES + c] = leaves if plain else W[RELEASES + c]
    top, _ = range_at_nodes(at_nodes(W, PENETRATION + c), fine)
    W[DEEPEST + j] = max(W[DEEPEST + j], top) if plain else W[DEEPEST + j]
    # contact does not change within the step
    gap_fraction = FINE_WHOLE if fine else COARSE_WHOLE
    gap_seconds = gap_fraction * W[H + j] if W[R2 + NEARNESS + c] <= 0.0 else 0.0
    W[LOSS_SECONDS + c] += gap_seconds if plain & measured else 0.0


@inline_numba
def add_integral(total, values, h, fine):
    """Return a total and the quadrature of a step's values at its nodes; fine: as above."""
    a, b, c, d, e = values
    total += h * (F0 if fine else G0) * a
    total += h * F1 * (b if fine else 0.0)
    total += h * (F2 if fine else G2) * c
    total += h * F3 * (d if fine else 0.0)
    return total + h * (F4 if fine else G4) * e


@jit
def tally_lanes(scene, W, k):
    """Tally the steps of plain lanes, as `tally_energy` and `tally_step` do."""
    W = without_refcount(W)
    f = (8 if len(scene) == 3 else 4) * LANES
    for j in range(k):
        plain = W[PLAIN + j] > 0.0
        kinetic = W[R4 + KINETIC + j]
        gain = kinetic + W[R4 + POTENTIAL + j] - W[ENERGY + j]
        crank, load, damping, friction = read_four(W, NEW + f + j)
        worst = W[IMBALANCE + j]
        larger = larger_imbalance(worst, gain, crank, load, damping, friction)
        W[IMBALANCE + j] = larger if plain else worst
        most = W[PEAK_KINETIC + j]
        W[PEAK_KINETIC + j] = max(most, kinetic) if plain else most
    for j in range(k):
        plain, measured = W[PLAIN + j] > 0.0, W[MEASURED + j] > 0.0
        fine = W[NEAR_PEAK + j] > 0.0
        if has_clearance(scene, 0):
            tally_joint(W, j, 0, plain, fine, measured)
        if has_clearance(scene, 1):
            tally_joint(W, j, 1, plain, fine, measured)
    for j in range(k):
        counts = (W[PLAIN + j] > 0.0) & (W[MEASURED + j] > 0.0)
        fine = W[NEAR_PEAK + j] > 0.0
        h = W[H + j] if counts else 0.0
        W[SECONDS + j] += h
        a, b, c, d, e = at_nodes(W, j)
        squares = a**2, b**2, c**2, d**2, e**2
        W[SQUARE_ACCELERATION + j] = add_integral(W[SQUARE_ACCELERATION + j], squares, h, fine)
        a, b, c, d, e = at_nodes(W, DEVIATION + j)
        squares = a**2, b**2, c**2, d**2, e**2
        W[SQUARE_DEVIATION + j] = add_integral(W[SQUARE_DEVIATION + j], squares, h, fine)
        W[TORQUE_SUM + j] = add_integral(W[TORQUE_SUM + j], at_nodes(W, TORQUE + j), h, fine)
        W[MOMENT_SUM + j] = add_integral(W[MOMENT_SUM + j], at_nodes(W, MOMENT + j), h, fine)
    raise_peaks(W, k)
    raise_depths(scene, W, k)

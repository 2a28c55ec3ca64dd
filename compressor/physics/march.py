"""The whole step loop, compiled: from the first step to the last without Python in between.

`march` advances a `Stepper` by at most a number of steps and returns, so that Python can look at
the clock; called again it goes on, to the bit. Steps land on load corners and on onsets of
contact; the dense solution feeds the output grid and the tally.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from compressor.physics import rosenbrock
from compressor.physics._jit import (
    dispatch_on_record,
    inline_llvm,
    inline_once,
    inner,
    jit,
    without_refcount,
)
from compressor.physics.contact_laws import has_chosen_laws
from compressor.physics.kinematics import crank_direction, ideal, ideal_after
from compressor.physics.observe import ACCELERATION, COLUMNS, NEARNESS
from compressor.physics.onset import (
    LANDING_FRACTION,
    first_onset,
    locate_change,
    may_change,
    may_touch,
    shift_of_change,
    store_approach_velocity,
)
from compressor.physics.record import CHOSEN_FORCES, zero
from compressor.physics.runge_kutta import (
    FLOWS,
    STAGES,
    A,
    P,
    add_stages,
    error_norm,
    extend,
    interpolate,
    take_step,
    weights_at,
)
from compressor.physics.step_control import (
    LAST_STRETCH,
    MIN_ERROR,
    MIN_STEP,
    MIN_TEST_PAUSE,
    Mode,
    choose_method,
    first_step,
    next_step_length,
    refuse,
)
from compressor.physics.systems import (
    beyond_model,
    derivative_with_flows,
    enter_segment,
    evaluate,
    observe_contact,
    write_row,
)
from compressor.physics.tally import (
    PEAKED,
    ROD_LOAD,
    extreme_of,
    gap_fraction_between,
    lobatto,
    may_beat_peaks,
    may_exceed,
    tally_energy,
    tally_step,
)

NODES, WEIGHTS = lobatto(5)  # at which a step is observed
COARSE_WEIGHTS = np.zeros(NODES.size)  # at its ends and in its middle alone
COARSE_WEIGHTS[::2] = lobatto(3)[1]
TOP_LOOKS = 12  # at most, at a peak within a step
PEAK_TOLERANCE = 1e-10  # of a peak: a parabola that rises above it by less is not looked at
CROSSING_TOLERANCE = 1e-8  # of a step: as well as a change of the rod load's side is placed
# of the stages of an explicit step, at these nodes: (node, stage)
NODE_WEIGHTS = np.array([P @ s ** np.arange(1, 5) for s in NODES])
NODE_WEIGHTS[-1] = A[-1]


class Status(IntEnum):
    """How a stepper stands."""

    RUNNING = 0
    DONE = 1
    NON_FINITE = 2
    STEP_UNDERFLOW = 3
    PENETRATION_IMPLAUSIBLE = 4
    BEYOND_MODEL = 5  # as of `mechanism_rows.beyond_model`


# numba wants plain integers
RUNNING, DONE, NON_FINITE, STEP_UNDERFLOW, PENETRATION_IMPLAUSIBLE, BEYOND_MODEL = map(int, Status)


STEPPER = np.dtype(
    [
        ("status", "i8"),
        ("t", "f8"),
        ("h", "f8"),  # the next step's length; 0: to be chosen
        ("error", "f8"),  # of the last accepted step: logarithm of its norm
        ("fresh", "i8"),  # whether dz/dt at t is still to be evaluated
        ("observed", "i8"),  # whether work.row holds what is observed at t, in this phase
        ("has_dense", "i8"),  # whether work.dense holds the step's interpolant
        ("landing", "f8"),  # length of the step that ends on the onset ahead, or 0
        ("touches", "i8"),  # the joint whose onset is ahead, or was
        ("landed", "i8"),  # whether the last step ended on an onset
        ("segment", "i8"),
        ("sample", "i8"),  # next output sample
        ("steps", "i8"),
        ("evaluations", "i8"),
        ("rejected", "i8"),
        ("onsets", "i8"),  # that steps have ended on
        ("mode", "i8"),  # Mode
        ("stiff", "i8"),  # whether the present step is the stiff partner's
        ("stability_limited", "i8"),  # explicit steps in a row that stability has held
        ("explicit_ok", "i8"),  # stiff steps in a row that an explicit method could have h
        ("steps_to_test", "i8"),  # steps until stiffness is tested again
        ("test_pause", "i8"),  # the rest after the last change back
        ("steps_saved", "f8"),  # stable explicit steps that stiff ones have saved since the change
        ("rtol", "f8"),
        ("settle", "f8"),
        ("contact_step", "f8"),  # s: a step that resolves the contact's own frequency
        ("deepest", "f8", (2,)),  # m: penetration of each joint beyond which the run stops
    ],
    align=True,
)


class WorkArrays(NamedTuple):
    """Arrays that a march works in; between calls the first row of `k` and `row` carry over."""

    k: np.ndarray  # (7, n + 4): stages of the explicit pair, or increments of the stiff partner
    new: np.ndarray  # (n + 4,)
    column: np.ndarray  # (n + 4,)
    jacobian: np.ndarray  # (n + 4, n)
    dense: np.ndarray  # (5, n): the step's interpolant
    weights: np.ndarray  # (7,): of the stages, at a fraction of the step
    y: np.ndarray  # (n,)
    rows: np.ndarray  # (5, COLUMNS): observed at a step's nodes
    gap_fraction: np.ndarray  # (2,): share of the step without contact, by joint
    # (4,): share of the step with the rod load above and below zero, its tension and compression
    sides: np.ndarray
    row: np.ndarray


def new_stepper(mode):
    """Return a stepper at the start of its first segment."""
    stepper = zero(STEPPER)
    stepper["fresh"] = 1
    stepper["error"] = MIN_ERROR
    stepper["mode"] = mode
    stepper["test_pause"] = MIN_TEST_PAUSE // 2
    stepper["stiff"] = mode == Mode.STIFF
    return stepper


def new_work(n):
    """Return the arrays for a motion of n numbers (positions and rates)."""
    size = n + FLOWS
    return WorkArrays(
        np.zeros((STAGES, size)), np.zeros(size), np.zeros(size), np.zeros((size, n)),
        np.zeros((5, n)), np.zeros(STAGES), np.zeros(n), np.zeros((NODES.size, COLUMNS)),
        np.zeros(2), np.zeros(4), np.zeros(COLUMNS),
    )  # fmt: skip


MIDDLE = NODES.size // 2
TO_OBSERVE = np.array([0, 2, 1, 3])  # nodes but the last: a step's begin, its middle, the others

rosenbrock_step, rosenbrock_error = rosenbrock.take_step, rosenbrock.error_norm
rosenbrock_extend = rosenbrock.extend


@inline_once
def try_step(w, base, h, z, work, atol, size, phase, p):
    """Take a step of length h by the stepper's present method, and return its error norm."""
    if w.stiff:
        u = work.k[1:]
        w.evaluations += size.size + 1 + rosenbrock.STIFF_STAGES
        if not rosenbrock_step(
            w.t, h, z, work.k[0], size, phase, p, work.column, work.new, u, work.jacobian
        ):
            return math.inf
        return rosenbrock_error(z, work.new, u, w.rtol, atol)
    take_step(base, h, z, work.k, phase, p, work.new, work.rows[NODES.size - 1])
    w.evaluations += STAGES - 1
    return error_norm(h, z, work.new, work.k, w.rtol, atol)


@inline_once
def observe_step(w, base, h, z, work, phase, p, tally):
    """Observe the step's interpolant at its nodes and return their stride: 1 for all, 2 for three.

    Its last stage has observed an explicit step's end already; nodes between are looked at if a
    peak may be beaten, or if contact may change.
    """
    last = NODES.size - 1
    n = work.y.size
    if w.stiff:
        rosenbrock_extend(z, work.new, work.k[1:], work.dense)
        now = evaluate(ideal(w.t + h, p), work.new[:n], phase, p)
        write_row(now, work.new[:n], p, work.rows[last])
    w.has_dense = w.stiff
    stride = 1 if w.stiff else MIDDLE
    for i in TO_OBSERVE:
        if i == 0 and w.observed:  # the last step's end is this step's begin
            for j in range(ACCELERATION, COLUMNS):
                work.rows[0, j] = work.row[j]
            continue
        if i == 0:
            for j in range(n):
                work.y[j] = z[j]
        elif w.stiff:
            interpolate(NODES[i], work.dense, work.y)
        elif i == MIDDLE or stride == 1:
            add_stages(NODE_WEIGHTS[i], STAGES, h, z, work.k, work.y)
        else:
            break
        observe_contact(ideal_after(base, NODES[i] * h, p), work.y, phase, p, work.rows[i])
        if i == MIDDLE and not w.stiff:
            if may_change(work.rows, p):
                stride = 1
                extend(h, z, work.k, work.dense)
                w.has_dense = 1
            elif w.t >= w.settle and may_beat_peaks(work.rows, MIDDLE, tally):
                stride = 1
    if stride == 1 and not w.has_dense and may_touch(work.rows, p):
        extend(h, z, work.k, work.dense)
        w.has_dense = 1
    return stride


@inline_once
def onset_ahead(w, h, work, phase, p):
    """Return whether contact begins within the step just tried, which must then end there.

    The step after the landing is kept within the pulse, or to the contact's own time scale.
    """
    must_land = False
    if w.has_dense and may_touch(work.rows, p):
        begin, end, w.touches = first_onset(w.t, h, work.dense, phase, p, work.y)
        # a step that begins on an onset finds it again at its start: to land there would never end
        if begin < 1.0 and not (w.landed and begin < LANDING_FRACTION):
            must_land = True
            w.landing = begin * h
            # the error control knows nothing of a pulse that the last step did not see
            pulse = (end - begin) * h if end < 1.0 else math.inf
            w.h = min(w.h, w.contact_step, 0.5 * pulse)
    w.landed = 0
    return must_land


@inline_once
def sample_grid(w, t_end, h, z, work, times, states):
    """Fill the output samples up to t_end; for one of a step without its whole interpolant."""
    while w.sample < times.size and times[w.sample] <= t_end:
        s = min(1.0, max(0.0, (times[w.sample] - w.t) / h))
        if w.has_dense:
            interpolate(s, work.dense, states[w.sample])
        else:
            weights_at(s, work.weights)
            add_stages(work.weights, STAGES, h, z, work.k, states[w.sample])
        w.sample += 1


@inline_llvm
def measure_gap_fractions(w, h, stride, work, size, phase, p, tally):
    """Write the share of a step that each joint is without contact, and how far that may move."""
    for joint in range(2):
        gap_fraction = 0.0
        if p.clearance[joint] > 0.0:
            # F_N has a corner where contact changes, so that no quadrature over nodes is exact
            for i in range(stride, NODES.size, stride):
                low, high = NODES[i - stride], NODES[i]
                before = work.rows[i - stride, NEARNESS + joint]
                after = work.rows[i, NEARNESS + joint]
                share = gap_fraction_between(before, after)
                if 0.0 < share < 1.0 and w.has_dense:
                    s = locate_change(
                        joint, low, high, before, after, w.t, h, work.dense, phase, p, work.y
                    )
                    share = (s - low if after > 0.0 else high - s) / (high - low)
                    rate = (after - before) / (high - low)
                    tally.switch_shift[joint] += h * shift_of_change(
                        joint, s, rate, w.t, h, work.dense, size, phase, p, work.y
                    )
                gap_fraction += share * (high - low)
        work.gap_fraction[joint] = gap_fraction


@inner
def look_within(s, column, w, base, h, z, work, phase, p):
    """Return an observed column at the fraction s of the step just taken; writes work.y, .row."""
    if w.has_dense:
        interpolate(s, work.dense, work.y)
    else:
        weights_at(s, work.weights)
        add_stages(work.weights, STAGES, h, z, work.k, work.y)
    observe_contact(ideal_after(base, s * h, p), work.y, phase, p, work.row)
    return work.row[column]


@inline_llvm
def signed(value, sign):
    """Return the value times a sign, or its size where the sign is 0."""
    return abs(value) if sign == 0.0 else sign * value


@inner
def find_top(column, sign, known, w, base, h, stride, z, work, phase, p):
    """Return the greater of `known` and the greatest value of a column over the step just taken.

    By looks at the tops of parabolas. sign: 1 or -1, or 0 for |value|.
    """
    best, last = 0, NODES.size - 1
    for i in range(0, NODES.size, stride):
        if signed(work.rows[i, column], sign) > signed(work.rows[best, column], sign):
            best = i
    known = max(known, signed(work.rows[best, column], sign))
    i = min(max(best, stride), last - stride)
    left, middle, right = NODES[i - stride], NODES[i], NODES[i + stride]
    before, here = work.rows[i - stride, column], signed(work.rows[i, column], sign)
    before, after = signed(before, sign), signed(work.rows[i + stride, column], sign)
    for _ in range(TOP_LOOKS):
        at, top = extreme_of(left - middle, right - middle, before, here, after)
        at += middle
        if not (top - known > PEAK_TOLERANCE * known and left < at < right):
            break
        value = signed(look_within(at, column, w, base, h, z, work, phase, p), sign)
        known = max(known, value)
        end, side = (middle, here) if value > here else (at, value)  # what lies beyond is no top
        if (value > here) == (at > middle):
            left, before = end, side
        else:
            right, after = end, side
        if value > here:
            middle, here = at, value
    return known


@inner
def raise_tops(w, base, h, stride, z, work, phase, p, tally):
    """Raise the tally's peaks by `find_top` of the step just tallied."""
    for k in range(PEAKED):
        if may_exceed(tally.top[k], tally.peak[k]):
            tally.peak[k] = find_top(
                ACCELERATION + k, 0.0, tally.peak[k], w, base, h, stride, z, work, phase, p
            )


@inner
def add_sides(low, high, before, after, w, base, h, z, work, phase, p):
    """Add to work.sides how much of a step, from low to high, the rod load is on each side.

    before, after: the load (N) there; between two sides it may be zero for a while.
    """
    if before * after > 0.0:
        work.sides[0 if after > 0.0 else 1] += high - low
        return
    for side in range(2):
        end, away, load = (low, high, before) if side == 0 else (high, low, after)
        if load == 0.0:
            continue
        inside, outside = end, away
        while abs(outside - inside) > CROSSING_TOLERANCE:
            middle = 0.5 * (inside + outside)
            if look_within(middle, ROD_LOAD, w, base, h, z, work, phase, p) * load > 0.0:
                inside = middle
            else:
                outside = middle
        work.sides[0 if load > 0.0 else 1] += abs(0.5 * (inside + outside) - end)


@inner
def measure_sides(w, base, h, stride, z, work, phase, p, tally):
    """Write the step's shares and peaks of both sides of the rod load into work.sides."""
    work.sides[0], work.sides[1] = 0.0, 0.0
    for side in range(2):
        sign, known = 1.0 - 2.0 * side, tally.side_peak[side]
        work.sides[2 + side] = find_top(
            ROD_LOAD, sign, known, w, base, h, stride, z, work, phase, p
        )
    for i in range(stride, NODES.size, stride):
        low, high = NODES[i - stride], NODES[i]
        before, after = work.rows[i - stride, ROD_LOAD], work.rows[i, ROD_LOAD]
        middle = i if i + stride < NODES.size else i - stride
        here = work.rows[middle, ROD_LOAD]
        at, extreme = extreme_of(
            NODES[middle - stride] - NODES[middle], NODES[middle + stride] - NODES[middle],
            work.rows[middle - stride, ROD_LOAD], here, work.rows[middle + stride, ROD_LOAD],
        )  # fmt: skip
        at += NODES[middle]
        if before * after > 0.0 and low < at < high and extreme * here <= 0.0:
            load = look_within(at, ROD_LOAD, w, base, h, z, work, phase, p)
            add_sides(low, at, before, load, w, base, h, z, work, phase, p)
            add_sides(at, high, load, after, w, base, h, z, work, phase, p)
        else:
            add_sides(low, high, before, after, w, base, h, z, work, phase, p)


@inline_once
def accumulate_metrics(w, base, h, stride, z, work, size, phase, p, tally):
    """Tally an accepted step that has been observed, and audit its energy."""
    measured = w.t >= w.settle
    if measured and tally.has_rod_load:
        measure_sides(w, base, h, stride, z, work, phase, p, tally)
    if measured:
        measure_gap_fractions(w, h, stride, work, size, phase, p, tally)
    weights = WEIGHTS if stride == 1 else COARSE_WEIGHTS
    tally_step(
        h, NODES, weights, work.rows, stride, work.gap_fraction, work.sides, measured, tally, p
    )
    if measured and has_chosen_laws(p):
        raise_tops(w, base, h, stride, z, work, phase, p, tally)
    last = NODES.size - 1
    for j in range(ACCELERATION, COLUMNS):
        work.row[j] = work.rows[last, j]
    w.observed = 1
    tally_energy(work.row, work.new[work.y.size :], tally)


@inline_llvm
def keep_velocities(w, t, work, phase, p, tally):
    """Return False: with the default laws contacts carry no speed."""
    return False


store_velocities = dispatch_on_record(CHOSEN_FORCES, store_approach_velocity, keep_velocities)


@inner
def is_finite(new):
    """Return whether every number of a state is finite."""
    total = 0.0
    for i in range(new.size):
        total += new[i]
    return math.isfinite(total)


@inline_once
def accept_step(w, z, work, reached, fresh, at_edge, segments):
    """Move the stepper on; fresh: the last stage of its step is not the next one's first."""
    for i in range(z.size):
        z[i] = work.new[i]
        work.k[0, i] = work.k[STAGES - 1, i]  # of an explicit pair: the next step's first stage
    w.t = reached
    w.steps += 1
    w.fresh = 1 if fresh or at_edge else 0
    if at_edge:
        w.observed = 0
        w.segment += 1
        if w.segment == segments:
            w.status = DONE


@inline_once
def stop_beyond(w, z, tally, p):
    """Stop a stepper whose motion has left what the model describes."""
    if tally.deepest[0] > w.deepest[0] or tally.deepest[1] > w.deepest[1]:
        w.status = PENETRATION_IMPLAUSIBLE
    elif not is_finite(z):
        w.status = NON_FINITE
    elif beyond_model(z, p):
        w.status = BEYOND_MODEL


@jit
def march(w, p, z, work, atol, size, edges, phases, times, states, tally, limit):
    """Advance by at most `limit` step attempts; w.status then holds the stepper's state.

    w: stepper; p: record; z: motion and flows, (n + 4,); work: scratch, carried between calls;
    atol, size: absolute tolerance and natural size of each number of the motion, (n,); edges,
    phases: the load's segments; times, states: output grid (m,) and (m, n); tally: gathers
    metrics. z, w, work, phases, states and tally are written.
    """
    work = WorkArrays(
        without_refcount(work.k), without_refcount(work.new), without_refcount(work.column),
        without_refcount(work.jacobian), without_refcount(work.dense),
        without_refcount(work.weights), without_refcount(work.y), without_refcount(work.rows),
        without_refcount(work.gap_fraction), without_refcount(work.sides),
        without_refcount(work.row),
    )  # fmt: skip
    z, atol, size = without_refcount(z), without_refcount(atol), without_refcount(size)
    times, states = without_refcount(times), without_refcount(states)
    for _ in range(limit):
        if w.status != RUNNING:
            return
        if w.fresh and w.t == edges[w.segment]:
            enter_segment(w.t, z, w.segment, phases, p)
        end, phase = edges[w.segment + 1], phases[w.segment]
        if w.fresh:
            derivative_with_flows(w.t, z, phase, p, work.k[0])
            w.evaluations += 1
            w.fresh = 0
        if w.h == 0.0:
            w.h = first_step(w, z, work, atol, phase, p, end)
        h = min(w.h, end - w.t)
        if w.t + LAST_STRETCH * h >= end:
            h = end - w.t
        landing = w.landing > 0.0
        if landing:  # a part of a step that was within its tolerance: it is not judged again
            h = w.landing
        base = crank_direction(w.t, p)
        error = try_step(w, base, h, z, work, atol, size, phase, p)
        if not landing:
            if not error <= 1.0:  # nan is refused
                refuse(w, h, error)
                if w.h < MIN_STEP * (w.t + 1.0 / p.omega):
                    w.status = STEP_UNDERFLOW if is_finite(work.k[0]) else NON_FINITE
                continue
            next_h = next_step_length(w, h, error)
            # a step that the segment's end cut short says nothing against longer ones
            w.h = max(w.h, next_h) if h < w.h else next_h
        stride = observe_step(w, base, h, z, work, phase, p, tally)
        met = False  # whether joints carry new speeds
        if landing:
            w.landing, w.landed, w.onsets = 0.0, 1, w.onsets + 1
            met = store_velocities(w, w.t + h, work, phase, p, tally)
        elif onset_ahead(w, h, work, phase, p):
            continue
        at_edge = not landing and h == end - w.t
        reached = end if at_edge else w.t + h
        accumulate_metrics(w, base, h, stride, z, work, size, phase, p, tally)
        sample_grid(w, reached, h, z, work, times, states)
        was_stiff = w.stiff
        choose_method(w, h, z, work, size)
        accept_step(w, z, work, reached, was_stiff or met, at_edge, phases.size)
        if met:  # what is seen at t is not what the step saw at its end
            w.observed = 0
        stop_beyond(w, z, tally, p)


@jit
def rehearse(w, h, z, work, size, phase, p, tally, times):
    """Do, so many times, a part of what a march does with a step, without going on.

    A copy of a process compiles it for no times, while that one compiles the march, which loads
    these parts. In this order the two seldom compile one at once.
    """
    for _ in range(times):
        choose_method(w, h, z, work, size)
        tally_step(
            h, NODES, WEIGHTS, work.rows, times, work.gap_fraction, work.sides, times > 0, tally, p
        )
        onset_ahead(w, h, work, phase, p)
        accumulate_metrics(w, crank_direction(w.t, p), h, times, z, work, size, phase, p, tally)

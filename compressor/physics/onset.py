"""When contact begins or ends within a step: no pulse is stepped over, whatever the tolerance.

A journal that flies touches when its gap closes; one that is released, but not yet out of its
bearing, is held off by the clamp and touches again when the unclamped force turns positive. Both
are watched on the step's interpolant while F_N = 0. Where contact ends, the step goes on; the
metrics take the share of it that was without contact.
"""

import math

from compressor.physics._jit import inline_llvm, inline_once, inner, jit
from compressor.physics.contact import nearness
from compressor.physics.contact_laws import has_chosen_laws
from compressor.physics.observe import NEARNESS, PENETRATION
from compressor.physics.runge_kutta import interpolate
from compressor.physics.systems import contact_at, derivative

INTERVALS = 12  # of a step, at whose ends the nearness is sampled
STEP_EDGE = 1e-4  # of a step: samples beside both ends show a maximum in the first or last interval
MAX_SAMPLE = INTERVALS + 2  # number of the last sample; the first is 0
MAX_HALVINGS = 40
CHANGE_TOLERANCE = 1e-8  # of a step: as well as a change of contact is placed for the metrics
SMALL_CHANGE = 1e-6  # of the natural size of a state: by which a change of contact is moved
LANDING_FRACTION = 1e-3  # of a step: an onset nearer to its start is the one it started from
NEVER = 2.0  # a fraction of the step beyond its end


@inline_once
def may_change(rows, p):
    """Return whether contact may begin or end within a step, by three rows and their range."""
    middle, last = rows.shape[0] // 2, rows.shape[0] - 1
    for joint in range(2):
        if p.clearance[joint] > 0.0:
            column = NEARNESS + joint
            a, b, c = rows[0, column], rows[middle, column], rows[last, column]
            low, high = min(a, b, c), max(a, b, c)
            beyond = 2.0 * (high - low)
            if low - beyond <= 0.0 < high + beyond:
                return True
    return False


@inline_llvm
def range_of(rows, column):
    """Return the least and the greatest value of a column."""
    low, high = math.inf, -math.inf
    for i in range(rows.shape[0]):
        low = min(low, rows[i, column])
        high = max(high, rows[i, column])
    return low, high


@inner
def may_touch(rows, p):
    """Return whether contact may begin within a step, by the rows at all its nodes.

    A quartic rises above five Lobatto nodes by less than a third of their range. With chosen laws
    also where a journal may have flown: the speed at which it comes back counts.
    """
    for joint in range(2):
        if p.clearance[joint] > 0.0:
            low, high = range_of(rows, NEARNESS + joint)
            if low <= 0.0 < high + (high - low):
                return True
            if has_chosen_laws(p):
                low, high = range_of(rows, PENETRATION + joint)
                if p.hysteresis != 0.0 and low - (high - low) <= 0.0 < high:
                    return True
    return False


@jit
def nearness_at(joint, s, t, h, dense, phase, p, y):
    """Return `nearness` of a joint at the fraction s of a step with interpolant `dense`."""
    interpolate(s, dense, y)
    contact = contact_at(joint, t + s * h, y, phase, p)
    return nearness(contact, p.stiffness[joint], p.clearance[joint], p)


@inline_once
def locate_onset(joint, low, high, t, h, dense, phase, p, y):
    """Return the fraction at which contact begins, between `low` (apart) and `high` (touching)."""
    for _ in range(MAX_HALVINGS):
        middle = 0.5 * (low + high)
        if nearness_at(joint, middle, t, h, dense, phase, p, y) > 0.0:
            high = middle
        else:
            low = middle
    return high


@inline_once
def locate_contact_between(joint, low, high, t, h, dense, phase, p, y):
    """Return a fraction with contact around the top of a nearness, by golden section, or NEVER."""
    golden = 0.6180339887498949
    left = high - golden * (high - low)
    right = low + golden * (high - low)
    at_left = nearness_at(joint, left, t, h, dense, phase, p, y)
    at_right = nearness_at(joint, right, t, h, dense, phase, p, y)
    for _ in range(MAX_HALVINGS):
        if at_left > 0.0:
            return left
        if at_right > 0.0:
            return right
        if at_left > at_right:
            high, right, at_right = right, left, at_left
            left = high - golden * (high - low)
            at_left = nearness_at(joint, left, t, h, dense, phase, p, y)
        else:
            low, left, at_left = left, right, at_right
            right = low + golden * (high - low)
            at_right = nearness_at(joint, right, t, h, dense, phase, p, y)
    return NEVER


@jit
def sample_fraction(i):
    """Return the fraction of a step at which sample i is taken, 0 to MAX_SAMPLE."""
    if i <= 1:
        return i * STEP_EDGE
    if i >= MAX_SAMPLE - 1:
        return 1.0 - (MAX_SAMPLE - i) * STEP_EDGE
    return (i - 1) / INTERVALS


@inline_once
def joint_onset(joint, t, h, dense, phase, p, y):
    """Return from where to where in a step a joint touches: to 1 where it lasts, NEVER without."""
    earlier = nearness_at(joint, 0.0, t, h, dense, phase, p, y)
    before = earlier
    begin = NEVER
    for i in range(1, MAX_SAMPLE + 1):
        s = sample_fraction(i)
        now = nearness_at(joint, s, t, h, dense, phase, p, y)
        if begin < NEVER:
            if now <= 0.0:
                return begin, s
        elif now > 0.0:
            if before <= 0.0:
                begin = locate_onset(joint, sample_fraction(i - 1), s, t, h, dense, phase, p, y)
        # a pulse shorter than the distance of two looks shows as a maximum between them
        elif i > 1 and before >= earlier and before >= now and before <= 0.0:
            low, middle = sample_fraction(i - 2), sample_fraction(i - 1)
            # where the nearness is concave, its top lies below the two chords prolonged
            rise = (before - earlier) * (s - middle) / (middle - low)
            fall = (before - now) * (middle - low) / (s - middle)
            if before + rise + fall > 0.0:
                touching = locate_contact_between(joint, low, s, t, h, dense, phase, p, y)
                if touching < NEVER:
                    return locate_onset(joint, low, touching, t, h, dense, phase, p, y), s
        earlier, before = before, now
    if begin < NEVER:
        return begin, 1.0
    return NEVER, NEVER


@jit
def first_onset(t, h, dense, phase, p, y):
    """Return `joint_onset` of whichever joint with clearance touches first, and which it is."""
    begin, end, touches = NEVER, NEVER, -1
    for joint in range(2):
        if p.clearance[joint] > 0.0:
            first, last = joint_onset(joint, t, h, dense, phase, p, y)
            if first < begin:
                begin, end, touches = first, last, joint
    return begin, end, touches


@inline_once
def locate_change(joint, low, high, at_low, at_high, t, h, dense, phase, p, y):
    """Return the fraction at which contact begins or ends between two others, to CHANGE_TOLERANCE.

    By two looks on a line through both ends, then one halfway: the nearness may have a corner.
    """
    looks = 0
    # the secant alone stalls at the corner: one end of the bracket would never move
    while high - low > CHANGE_TOLERANCE:
        looks += 1
        s = 0.5 * (low + high)
        if looks % 3 > 0:
            s = (low * at_high - high * at_low) / (at_high - at_low)
            s = min(max(s, low + 0.5 * CHANGE_TOLERANCE), high - 0.5 * CHANGE_TOLERANCE)
        now = nearness_at(joint, s, t, h, dense, phase, p, y)
        if (now > 0.0) == (at_high > 0.0):
            high, at_high = s, now
        else:
            low, at_low = s, now
    return 0.5 * (low + high)


@jit
def shift_of_change(joint, s, rate, t, h, dense, size, phase, p, y):
    """Return by how much of a step a change of contact moves for a state off by its natural size.

    The motion's numbers count one by one, as a root of squares. A journal that loses contact slowly
    does so at a moment that a speed wrong by some tolerances moves far.
    """
    at, total = nearness_at(joint, s, t, h, dense, phase, p, y), 0.0
    for i in range(size.size):
        interpolate(s, dense, y)
        y[i] += SMALL_CHANGE * size[i]
        contact = contact_at(joint, t + s * h, y, phase, p)
        change = nearness(contact, p.stiffness[joint], p.clearance[joint], p) - at
        total += (change / SMALL_CHANGE) ** 2
    return math.sqrt(total) / abs(rate)


@inline_once
def approach_at(joint, t, y, phase, p, rates, before):
    """Return a joint's penetration (m), and the speed (m/s) at which its gap closes.

    At that very moment: two motions that are a little apart meet a little apart in time.
    """
    now = contact_at(joint, t, y, phase, p)
    # the landing lies near the onset, not on it: go back, or on, by the difference
    since = now.penetration / now.rate if now.rate > 0.0 else 0.0
    derivative(t, y, phase, p, rates)
    for i in range(y.size):
        before[i] = y[i] - since * rates[i]
    return now.penetration, contact_at(joint, t - since, before, phase, p).rate


@inline_llvm
def store_approach_velocity(w, t, work, phase, p, tally):
    """Store the speed at which joints meet again after a flight; return whether one does.

    The joint that is landed on meets if its gap closes: a clamped force comes back while bodies
    part. The other one meets too where it was seen apart and its gap closes within
    `LANDING_FRACTION` of the next step.
    """
    met = False
    n = work.y.size
    for joint in range(2 if p.carries else 0):
        begin, middle = work.rows[0], work.rows[work.rows.shape[0] // 2]
        least_depth = min(begin[PENETRATION + joint], middle[PENETRATION + joint])
        flown = tally.flown[joint] > 0 or least_depth < 0.0
        lands, apart = joint == w.touches, flown and not tally.touching[joint]
        if p.clearance[joint] > 0.0 and (lands or apart):
            depth, speed = approach_at(joint, t, work.new[:n], phase, p, work.y, work.column[:n])
            closes = depth + LANDING_FRACTION * w.h * speed > 0.0
            if (lands and speed > 0.0) or (apart and closes):
                work.new[2 * p.freedoms + joint] = max(speed, p.least_approach)
                met = True
    return met

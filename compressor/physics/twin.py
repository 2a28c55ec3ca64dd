"""A second motion in step with the first: how fast neighbours part, without noise of step control.

Two runs that choose their steps for themselves differ by their errors. Here the twin takes every
step that the first motion took, by the same method and of the same length to the bit: twins that
start alike stay alike to the bit, and what parts others are the steps' own laws. These are those
of the motion only at a tight tolerance: at a loose one the explicit pair's steps cross the edge of
stability now and then, where a difference grows by as much as rtol exceeds rounding.
"""

import numpy as np

from compressor.physics._jit import jit, merged, square_root
from compressor.physics.contact_laws import has_chosen_laws
from compressor.physics.kinematics import crank_direction
from compressor.physics.march import attempt, march
from compressor.physics.observe import ECCENTRICITY
from compressor.physics.onset import meeting
from compressor.physics.runge_kutta import STAGES
from compressor.physics.systems import derivative_with_flows, write_eccentricities
from compressor.physics.walker import DONE, RUNNING


@jit
def separation(t, y, other, p, rows):
    """Return the greatest distance of two states' eccentricities, over the joint's clearance."""
    write_eccentricities(t, y, p, rows[0])
    write_eccentricities(t, other, p, rows[1])
    worst = 0.0
    for joint in range(2):
        if p.clearance[joint] > 0.0:
            i = ECCENTRICITY + 2 * joint
            x, y_apart = rows[1, i] - rows[0, i], rows[1, i + 1] - rows[0, i + 1]
            apart = square_root(x * x + y_apart * y_apart) / p.clearance[joint]
            if not apart <= worst:  # keeps a nan
                worst = apart
    return worst


@merged
def follow(w, fellow, twin, work, atol, size, phase, p):
    """Take the step that a walker took, from fellow.t on, in the twin's motion."""
    if fellow.fresh:
        derivative_with_flows(fellow.t, twin, phase, p, work.k[0])
    base = crank_direction(fellow.t, p)
    attempt(fellow, base, w.taken, twin, work, atol, size, phase, p)
    for i in range(twin.size):
        twin[i] = work.new[i]
        work.k[0, i] = work.k[STAGES - 1, i]
    fellow.fresh = w.fresh


@merged
def meet(w, z, twin, work, phase, p):
    """Have the twin's contacts carry the speeds at which they meet where the first motion's do."""
    n = work.y.size
    for joint in range(2):
        if p.clearance[joint] > 0.0:
            place = 2 * p.freedoms + joint
            _, speed = meeting(joint, w.t, z[:n], phase, p, work.y, work.column[:n])
            if z[place] == max(speed, p.least_approach):  # it has met just now
                _, speed = meeting(joint, w.t, twin[:n], phase, p, work.y, work.column[:n])
                twin[place] = max(speed, p.least_approach)


@jit
def march_twins(
    w, fellow, p, z, twin, work, twin_work, atol, size, edges, phases, times, states, tally,
    rows, far, limit,
):  # fmt: skip
    """`march` with a twin in step, until they are `far` apart; fellow.status is then DONE.

    fellow: the twin's walker, of the same pair; twin: its motion and flows, (n + 4,); far: as
    share of the clearance; rows: scratch, (2, COLUMNS). The rest as for `march`.
    """
    n = size.size
    for _ in range(limit):
        if w.status != RUNNING:
            return
        steps, phase = w.steps, phases[w.segment]
        fellow.t, fellow.stiff = w.t, w.stiff
        # a plain 1 would be a type of its own, for which numba compiles all of march again
        march(w, p, z, work, atol, size, edges, phases, times, states, tally, np.int64(1))
        if w.steps > steps:
            follow(w, fellow, twin, twin_work, atol, size, phase, p)
            if has_chosen_laws(p) and w.landed:
                meet(w, z, twin, twin_work, phase, p)
            if not separation(w.t, z[:n], twin[:n], p, rows) <= far:
                fellow.status = DONE
                return

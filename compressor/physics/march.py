"""The whole step loop, compiled: from the first step to the last without Python in between.

`march` advances a `Walker` by at most a number of steps and returns, so that Python can look at
the clock; called again it goes on, to the bit. Steps land on load corners and on onsets of
contact; the dense solution feeds the output grid and the tally.
"""

import math
from enum import IntEnum

import numpy as np

from compressor.physics._jit import jit
from compressor.physics.observe import (
    COLUMNS,
    NORMAL,
    derivative_with_flows,
    lobatto,
    observe,
    tally_energy,
    tally_step,
)
from compressor.physics.onset import NEVER, first_onset
from compressor.physics.runge_kutta import FLOWS, STAGES, error_norm, interpolate, take_step

ORDER = 5
SAFETY, SHRINK, GROW = 0.9, 0.2, 5.0
PROPORTIONAL, INTEGRAL = 0.7 / ORDER, 0.4 / ORDER  # PI control, Hairer & Wanner II.IV.2
LEAST_STEP = 1e-13  # of the time reached plus a turn: below it steps make no way
LANDED = 1e-3  # of a step: an onset nearer to its start is the one it started from
NODES, WEIGHTS = lobatto(5)


class Status(IntEnum):
    """How a walker stands."""

    RUNNING = 0
    DONE = 1
    NON_FINITE = 2
    STEP_UNDERFLOW = 3
    PENETRATION_IMPLAUSIBLE = 4


# numba wants plain integers
RUNNING, DONE, NON_FINITE, STEP_UNDERFLOW, PENETRATION_IMPLAUSIBLE = map(int, Status)

WALKER = np.dtype(
    [
        ("pair", "i8"),
        ("status", "i8"),
        ("t", "f8"),
        ("h", "f8"),  # the next step's length; 0: to be chosen
        ("error", "f8"),  # of the last accepted step
        ("fresh", "i8"),  # whether dz/dt at t is still to be evaluated
        ("landed", "i8"),  # whether the last step ended on an onset
        ("segment", "i8"),
        ("sample", "i8"),  # next output sample
        ("steps", "i8"),
        ("evaluations", "i8"),
        ("rejected", "i8"),
        ("onsets", "i8"),
        ("watch", "i8"),  # whether onsets of contact are watched
        ("rtol", "f8"),
        ("settle", "f8"),
        ("contact_step", "f8"),  # s: a step that resolves the contact's own frequency
        ("deepest", "f8"),  # m: penetration beyond which the run stops
    ],
    align=True,
)


def new_walker():
    """A walker at the start of its first segment."""
    walker = np.zeros(1, dtype=WALKER).view(np.recarray)[0]
    walker.fresh = 1
    walker.error = 1e-4
    return walker


@jit
def first_step(w, z, k, atol, scratch, phase, p, end):
    """Length (s) of a first step that an order-5 method can take (Hairer, Norsett, Wanner II.4)."""
    n = z.size - FLOWS
    size = 0.0
    rate = 0.0
    for i in range(n):
        scale = atol[i] + w.rtol * abs(z[i])
        size += (z[i] / scale) ** 2
        rate += (k[0, i] / scale) ** 2
    size, rate = math.sqrt(size / n), math.sqrt(rate / n)
    guess = 1e-6 if size < 1e-5 or rate < 1e-5 else 0.01 * size / rate
    guess = min(guess, end - w.t)
    for i in range(z.size):
        scratch[i] = z[i] + guess * k[0, i]
    derivative_with_flows(w.t + guess, scratch, phase, p, k[1])
    w.evaluations += 1
    change = 0.0
    for i in range(n):
        scale = atol[i] + w.rtol * abs(z[i])
        change += ((k[1, i] - k[0, i]) / scale) ** 2
    change = math.sqrt(change / n) / guess
    steepest = max(rate, change)
    bold = max(1e-6, guess * 1e-3) if steepest <= 1e-15 else (0.01 / steepest) ** (1.0 / ORDER)
    return min(100.0 * guess, bold, end - w.t)


@jit
def sample_grid(w, t_end, h, z, k, times, states):
    """Fill the output samples up to t_end from the step's interpolant."""
    while w.sample < times.size and times[w.sample] <= t_end:
        s = (times[w.sample] - w.t) / h
        interpolate(w.pair, min(1.0, max(0.0, s)), h, z, k, states[w.sample])
        w.sample += 1


@jit
def observe_step(w, begin, end, h, z, k, phase, p, y, times, rows):
    """Rows at the Lobatto nodes of [begin, end], fractions of the step."""
    for i in range(NODES.size):
        s = begin + (end - begin) * NODES[i]
        interpolate(w.pair, s, h, z, k, y)
        times[i] = w.t + s * h
        observe(times[i], y, phase, p, rows[i])


@jit
def apart(rows, p):
    """Whether a joint with clearance is out of contact at one of a step's nodes."""
    for joint in range(2):
        if p.clearance[joint] > 0.0:
            for i in range(rows.shape[0]):
                if rows[i, NORMAL + joint] <= 0.0:
                    return True
    return False


@jit
def controlled(w, h, error):
    """The next step's length after an accepted step (PI control)."""
    error = max(error, 1e-10)
    factor = SAFETY * error**-PROPORTIONAL * w.error**INTEGRAL
    w.error = max(error, 1e-4)
    return h * min(GROW, max(SHRINK, factor))


@jit
def land_on_onset(w, h, z, k, phase, p, new, y, rows, node_times):
    """Shorten the step just taken so that it ends where contact begins; returns its length.

    Watched only when a node of the step shows a joint apart. The next step is kept within the
    pulse that begins, or to the contact's own time scale.
    """
    observe_step(w, 0.0, 1.0, h, z, k, phase, p, y, node_times, rows)
    landed = w.landed
    w.landed = 0
    if not w.watch or not apart(rows, p):
        return h
    begin, end = first_onset(w.pair, w.t, h, z, k, phase, p, y)
    if begin >= 1.0 or begin == NEVER or (landed and begin < LANDED):
        return h
    onset = begin * h
    pulse = (end - begin) * h
    take_step(w.pair, w.t, onset, z, k, phase, p, new)
    w.evaluations += STAGES - 1
    observe_step(w, 0.0, 1.0, onset, z, k, phase, p, y, node_times, rows)
    w.landed = 1
    w.onsets += 1
    w.h = min(w.h, w.contact_step, 0.5 * pulse if end < 1.0 else w.contact_step)
    return onset


@jit
def take_in(w, h, z, k, new, phase, p, y, rows, node_times, row, tally):
    """Tally an accepted step whose nodes stand in rows, and audit its energy."""
    if w.t < w.settle < w.t + h:
        cut = (w.settle - w.t) / h
        observe_step(w, 0.0, cut, h, z, k, phase, p, y, node_times, rows)
        tally_step(node_times, rows, WEIGHTS, False, tally, p)
        observe_step(w, cut, 1.0, h, z, k, phase, p, y, node_times, rows)
        tally_step(node_times, rows, WEIGHTS, True, tally, p)
    else:
        tally_step(node_times, rows, WEIGHTS, w.t >= w.settle, tally, p)
    n = z.size - FLOWS
    observe(w.t + h, new[:n], phase, p, row)
    tally_energy(row, new[n:], tally)


@jit
def finite(new):
    """Whether every number of a state is finite."""
    total = 0.0
    for i in range(new.size):
        total += new[i]
    return math.isfinite(total)


@jit
def march(w, p, z, k, atol, edges, phases, times, states, tally, limit):
    """Advance by at most `limit` step attempts; w.status tells how the walker stands then.

    w: walker; p: record; z: motion and flows, (n + 4,); k: stages, (7, n + 4), the first row
    being carried from step to step; atol: (n,); edges, phases: the load's segments; times,
    states: output grid (m,) and (m, n); tally: gathers metrics. All but p, atol, edges, phases
    and times are written.
    """
    n = z.size - FLOWS
    new = np.empty(z.size)
    y = np.empty(n)
    rows = np.empty((NODES.size, COLUMNS))
    node_times = np.empty(NODES.size)
    row = np.empty(COLUMNS)
    for _ in range(limit):
        if w.status != RUNNING:
            return
        end = edges[w.segment + 1]
        phase = phases[w.segment]
        if w.fresh:
            derivative_with_flows(w.t, z, phase, p, k[0])
            w.evaluations += 1
            w.fresh = 0
        if w.h == 0.0:
            w.h = first_step(w, z, k, atol, new, phase, p, end)
        h = w.h
        if w.t + 1.01 * h >= end:
            h = end - w.t
        take_step(w.pair, w.t, h, z, k, phase, p, new)
        w.evaluations += STAGES - 1
        error = error_norm(w.pair, h, z, new, k, w.rtol, atol)
        if not error <= 1.0:
            w.rejected += 1
            shrink = max(SHRINK, SAFETY * error ** (-1.0 / ORDER)) if error < math.inf else 0.1
            w.h = h * shrink
            if w.h < LEAST_STEP * (w.t + 1.0 / p.omega):
                w.status = STEP_UNDERFLOW if finite(k[0]) else NON_FINITE
            continue
        w.h = max(w.h, controlled(w, h, error)) if h < w.h else controlled(w, h, error)
        taken = land_on_onset(w, h, z, k, phase, p, new, y, rows, node_times)
        take_in(w, taken, z, k, new, phase, p, y, rows, node_times, row, tally)
        at_edge = taken == h and h == end - w.t
        sample_grid(w, end if at_edge else w.t + taken, taken, z, k, times, states)
        for i in range(z.size):
            z[i] = new[i]
            k[0, i] = k[STAGES - 1, i]
        w.steps += 1
        if at_edge:
            w.t = end
            w.segment += 1
            w.fresh = 1
            if w.segment == phases.size:
                w.status = DONE
        else:
            w.t += taken
        if tally.deepest > w.deepest:
            w.status = PENETRATION_IMPLAUSIBLE
        elif not finite(z):
            w.status = NON_FINITE

"""What is integrated and what is observed, of one of the scenes or of the mechanism.

Both have a handful of functions of the same names; which are called is settled by the record. A
scene is the mechanism with clearance at its joints and no other feature, written by hand for speed;
that both agree is a test.

The right-hand side records nothing: outputs are recomputed from (t, y). The energy flows (work of
crank and load, losses to damping and friction) are integrated beside the motion. Times are those of
a steady crank: what passes in time is `pace_of` times that.
"""

import functools
from types import SimpleNamespace

import numpy as np

from compressor.physics import mechanism, mechanism_rows, motion, observe
from compressor.physics._jit import dispatch_on_record, inline_llvm, jit, without_refcount
from compressor.physics.kinematics import crank_direction, ideal, ideal_at
from compressor.physics.loads import CYLINDER, GAS, begin_stroke
from compressor.physics.observe import CRANK_POWER, KINETIC, PACE, WIDE
from compressor.physics.record import MECHANISM, read_fields

# of two functions, the mechanism's and a scene's, that of the record among the arguments
choose = functools.partial(dispatch_on_record, MECHANISM)

evaluate = choose(mechanism.solve, motion.evaluate)
write_rates = choose(mechanism_rows.write_rates, motion.write_rates)
pace_of = choose(mechanism_rows.pace_of, motion.pace_of)
write_place = choose(mechanism_rows.write_place, observe.write_place)
write_contact_columns = choose(mechanism_rows.write_contact_columns, observe.write_contact_columns)
write_powers = choose(mechanism_rows.write_powers, observe.write_powers)
write_energies = choose(mechanism_rows.write_energies, observe.write_energies)
write_frame = choose(mechanism_rows.write_frame, observe.write_frame)
deviation = choose(mechanism_rows.deviation, motion.deviation)
beyond_model = choose(mechanism_rows.beyond_model, motion.is_within_model)


@jit
def start(offset, y, p):
    """Write the state at top dead centre into y, at rest, with journals shifted by `offset` (m)."""
    for i in range(y.size):
        y[i] = 0.0
    if p.carries:
        for joint in range(2):
            y[2 * p.freedoms + joint] = p.least_approach
    place = 0
    for joint in range(2):
        if p.clearance[joint] > 0.0:
            y[place], y[place + 1] = offset[joint, 0], offset[joint, 1]
            place += 2


@jit
def enter_segment(t, y, i, phases, p):
    """Write what a load's phase of the segment i holds of the state y in which it begins, at t."""
    if p.load == GAS or p.load == CYLINDER:
        begin_stroke(t, deviation(t, y, p), i, phases, p)


@jit
def derivative(t, y, phase, p, out):
    """Write dy/dt into `out`, (n,); phase: of the load."""
    write_rates(evaluate(ideal(t, p), y, phase, p), y, p, out)


@jit
def derivative_with_flows(t, z, phase, p, out):
    """Write dz/dt of the motion and of its four energy flows into out, (n + 4,)."""
    y = z[: z.size - 4]
    write_flowing_rates(evaluate(ideal(t, p), y, phase, p), y, p, out)


@inline_llvm
def write_flowing_rates(now, y, p, out):
    """Write the rates of the motion y and of its four energy flows, at an evaluated instant."""
    write_rates(now, y, p, out[: y.size])
    write_powers(now, y, p, out[y.size :])
    for i in range(y.size, out.size):
        out[i] *= pace_of(now, p)


@inline_llvm
def contact_at(joint, t, y, phase, p):
    """Return a joint's `ContactState`; who calls it computes only what it reads."""
    now = evaluate(ideal(t, p), y, phase, p)
    return now.big if joint == 0 else now.small


@inline_llvm
def write_row(now, y, p, row):
    """Write the columns from ACCELERATION to PACE, by which a step is judged and audited."""
    write_contact_columns(now, y, p, row)
    write_powers(now, y, p, row[CRANK_POWER:KINETIC])
    write_energies(now, y, p, row)
    row[PACE] = pace_of(now, p)


@inline_llvm
def observe_contact(motion, y, phase, p, row):
    """Write the columns from ACCELERATION to GUIDE_MOMENT, and PACE: by which a step is tallied."""
    now = evaluate(motion, y, phase, p)
    write_contact_columns(now, y, p, row)
    row[PACE] = pace_of(now, p)


@jit
def observe_at(t, y, phase, p, row):
    """Write all quantities of `Column` into row, (COLUMNS,) or (WIDE,)."""
    now = evaluate(ideal(t, p), y, phase, p)
    write_place(now, y, p, row)
    write_row(now, y, p, row)
    if row.size == WIDE:
        write_frame(now, p, row)


@jit
def observe_all(times, states, phases, p, rows):
    """Write the rows of `observe_at` at m times (s), by phases of the load."""
    states, rows = without_refcount(states), without_refcount(rows)
    for i in range(times.size):
        observe_at(times[i], states[i], phases[i], p, rows[i])


def ideal_forces(times, phases, p):
    """Return the piston force and the joints' forces on the rod (N) of ideal joints, (m, 5).

    By plain Python: for one revolution machine code takes ten times as long to load.
    """
    fields, still = SimpleNamespace(**read_fields(p)), np.zeros(4)
    found = []
    for t, phase in zip(times.tolist(), phases.tolist(), strict=True):
        cosine, sine = crank_direction(t, fields)
        now = evaluate(ideal_at(cosine, sine, fields), still, phase, fields)
        found.append((now.load, *now.forces))
    return np.array(found)

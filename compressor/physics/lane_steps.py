"""A step of several runs side by side: loops over lanes, which LLVM makes vector code of.

Where the numbers of runs that march side by side stand: rows of one flat array, a lane a run.
`W[row + j]` is a number of lane j; rows are LANES apart. LLVM makes vector code of a loop over
lanes where all its loads and stores are rows of one array at constant places, and where the record
of parameters is made of them in the loop, its choices being constants.
"""

from collections import namedtuple
from typing import Any

import numpy as np

from compressor.physics._jit import fma, inline_numba, jit, square_root, without_refcount
from compressor.physics.contact_laws import Law
from compressor.physics.kinematics import IdealMotion, ideal_after
from compressor.physics.march import NODE_WEIGHTS as ALL_NODE_WEIGHTS
from compressor.physics.march import NODES
from compressor.physics.motion import deviation_accelerations, evaluate
from compressor.physics.observe import energies, joint_forces, observed_columns, powers
from compressor.physics.record import RECORD, Load
from compressor.physics.runge_kutta import STAGES, A, C, E, RungeKuttaPair, error_share
from compressor.physics.tally import TALLY

LANES = 16
MAX_STATES = 8  # numbers of a motion
STATE = MAX_STATES + 4  # and energy flows
STAGE_COUNT = 7
OBSERVED_COUNT = 20  # columns from ACCELERATION to GUIDE_MOMENT, kinetic and potential energy
NODE_COUNT = 5

SPRING = int(Load.SPRING)

NAMES = RECORD.names or ()
# a record whose choices are constants; its fields are those of RECORD
LaneRecord: Any = namedtuple("LaneRecord", NAMES)  # type: ignore[misc]

_next = 0


def _rows(count=1):
    """Return where the next rows begin in the array of all lanes, and count them as used."""
    global _next
    first = _next * LANES
    _next += count
    return first


# what all cases of lanes have alike, or no equation of theirs reads
CHOICES = ("scene", "load", "law", "friction", "freedoms", "wide", "unbalance", "exponent",
           "corners", "hysteresis", "least_approach", "bristle_stiffness", "bristle_damping",
           "viscous", "crank_suction_force", "crank_discharge_force", "crank_clearance",
           "crank_corners", "laws")  # fmt: skip
# fields of the record that are rows, in its order; those of a joint are two
FIELDS = tuple(
    (name, joint)
    for name in NAMES
    if name not in CHOICES
    for joint in range(2 if RECORD[name].shape else 1)
)
FIRST_FIELD = _rows(len(FIELDS))
COS, SIN = _rows(), _rows()  # of the crank angle at t
T, H, PHASE, RTOL, SETTLE, END, NEXT_SAMPLE = (_rows() for _ in range(7))
ERROR, LAST_ERROR = _rows(), _rows()
STEPS, REJECTED, BUDGET, STEPS_TO_TEST, STABILITY_LIMITED, MAX_DEPTH = (_rows() for _ in range(6))
ALIVE, PLAIN, NEAR_PEAK, MEASURED, CALL = (_rows() for _ in range(5))
ATOL, SIZE = _rows(MAX_STATES), _rows(MAX_STATES)
Z = _rows(STATE)
NEW = _rows(STATE)
MOTION = _rows(len(IdealMotion._fields))  # the ideal motion at the stage or node at hand
Y = _rows(MAX_STATES)  # the motion there
OUT = _rows(STATE)  # dz/dt there
K = _rows(STAGE_COUNT * STATE)
OBSERVED = _rows(OBSERVED_COUNT)
NODE_ROWS = _rows(NODE_COUNT * OBSERVED_COUNT)
# the words of the tally, in its order
TALLY_ROWS = {name: _rows(TALLY[name].itemsize // 8) for name in TALLY.names or ()}
FIRST_TALLY_ROW, TALLY_WORDS = TALLY_ROWS["seconds"], TALLY.itemsize // 8
(
    SECONDS, SQUARE_ACCELERATION, SQUARE_DEVIATION, TORQUE_SUM, MOMENT_SUM, PEAK, _,
    MAX_PENETRATION, LOSS_SECONDS, IMPACTS, RELEASES, TOUCHING, FLOWN, DEEPEST, ENERGY, _, _, _, _,
    IMBALANCE, PEAK_KINETIC, _, _, _, _, _,
) = TALLY_ROWS.values()  # fmt: skip
IS_COUNT = np.concatenate(
    [np.full(TALLY[name].itemsize // 8, TALLY[name].base.kind == "i") for name in TALLY_ROWS]
)
TOTAL = _next


def new_lanes():
    """Return the numbers of all lanes, at a boundary of 64 bytes."""
    raw = np.zeros(TOTAL * LANES + 8)
    skip = (-raw.ctypes.data // 8) % 8
    return raw[skip : skip + TOTAL * LANES]


PAIR, IMPACT = int(RungeKuttaPair.TSIT5), int(Law.IMPACT)
NO_CORNERS = (0.0, 0.0, 0.0)  # of the load: a lane ends at each
STEP_WEIGHTS, FRACTIONS, ERROR_WEIGHTS = A[PAIR], C[PAIR], E[PAIR]
NODE_WEIGHTS = ALL_NODE_WEIGHTS[PAIR]
MIDDLE, BETWEEN = np.array([2]), np.array([1, 3])  # nodes: the one within, and those beside it
LAST_STAGE = K + (STAGES - 1) * STATE * LANES
ROW = OBSERVED_COUNT * LANES
R0, R1, R2, R3, R4 = (NODE_ROWS + i * ROW for i in range(5))


@inline_numba
def lane_record(scene, W, j):
    """Return the record of lane j, its scene being the length of the tuple.

    Choices that are constants leave of the equations of motion what the scene needs.
    """
    b = FIRST_FIELD + j
    number = len(scene)
    freedoms = 4 if number == 3 else 2
    pins = W[b + 8 * LANES], W[b + 9 * LANES]
    clearance = W[b + 10 * LANES], W[b + 11 * LANES]
    stiffness = W[b + 12 * LANES], W[b + 13 * LANES]
    return LaneRecord(  # type: ignore[call-arg]
        number, SPRING, IMPACT, 1, freedoms, 0,
        W[b], W[b + LANES], W[b + 2 * LANES], W[b + 3 * LANES], W[b + 4 * LANES], W[b + 5 * LANES],
        W[b + 6 * LANES], W[b + 7 * LANES], 0.0, pins, clearance, stiffness, 1.5,
        W[b + 14 * LANES], W[b + 15 * LANES], W[b + 16 * LANES], W[b + 17 * LANES],
        W[b + 18 * LANES], W[b + 19 * LANES], NO_CORNERS,
        W[b + 20 * LANES], W[b + 21 * LANES], W[b + 22 * LANES], W[b + 23 * LANES],
        W[b + 24 * LANES], W[b + 25 * LANES], W[b + 26 * LANES], W[b + 27 * LANES],
        W[b + 28 * LANES], W[b + 29 * LANES], W[b + 30 * LANES], W[b + 31 * LANES],
        W[b + 32 * LANES], W[b + 33 * LANES], W[b + 34 * LANES], W[b + 35 * LANES],
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NO_CORNERS[:2], (0.0,),
    )  # fmt: skip


@inline_numba
def combine_stages(W, i, j, w):
    """Return the number i of the state of lane j where the stages have the weights w, (7,)."""
    u = LANES * i + j
    total = fma(w[1], W[K + 12 * LANES + u], fma(w[0], W[K + u], 0.0))
    total = fma(w[3], W[K + 36 * LANES + u], fma(w[2], W[K + 24 * LANES + u], total))
    total = fma(w[5], W[K + 60 * LANES + u], fma(w[4], W[K + 48 * LANES + u], total))
    return fma(W[H + j], fma(w[6], W[K + 72 * LANES + u], total), W[Z + u])


@inline_numba
def read_four(W, row):
    """Return four numbers of a lane, of rows that follow each other."""
    return W[row], W[row + LANES], W[row + 2 * LANES], W[row + 3 * LANES]


@inline_numba
def write_four(W, row, x):
    """Write four numbers of a lane into rows that follow each other."""
    W[row], W[row + LANES], W[row + 2 * LANES], W[row + 3 * LANES] = x


@jit
def copy_rows(W, target, source, count):
    """Copy `count` rows of all lanes from the row `source` on to the row `target` on.

    A loop over lanes may write to constant rows alone: to any other LLVM writes one number at a
    time.
    """
    W = without_refcount(W)
    for i in range(count * LANES):  # unsigned, or each index is first compared with zero
        W[np.uint64(target + i)] = W[np.uint64(source + i)]


@jit
def move_cranks(W, k, fraction):
    """Write the ideal motion at a fraction of the steps into MOTION.

    In a loop of its own: while its roots and quotients of one vector of lanes are waited for, those
    of the next are begun.
    """
    W = without_refcount(W)
    for j in range(k):
        p = lane_record((), W, j)
        m = ideal_after((W[COS + j], W[SIN + j]), fraction * W[H + j], p)
        o = MOTION + j
        write_four(W, o, (m[0], m[1], m[2], m[3]))
        write_four(W, o + 4 * LANES, (m[4], m[5], m[6], m[7]))
        W[o + 8 * LANES] = m[8]


@jit
def move_states(scene, W, k, w):
    """Write the motion where the stages have the weights w into Y."""
    W = without_refcount(W)
    for j in range(k):
        W[Y + j], W[Y + LANES + j] = combine_stages(W, 0, j, w), combine_stages(W, 1, j, w)
        W[Y + 2 * LANES + j] = combine_stages(W, 2, j, w)
        W[Y + 3 * LANES + j] = combine_stages(W, 3, j, w)
        if len(scene) == 3:
            W[Y + 4 * LANES + j] = combine_stages(W, 4, j, w)
            W[Y + 5 * LANES + j] = combine_stages(W, 5, j, w)
            W[Y + 6 * LANES + j] = combine_stages(W, 6, j, w)
            W[Y + 7 * LANES + j] = combine_stages(W, 7, j, w)


@inline_numba
def read_motion(W, j):
    """Return the ideal motion that `move_cranks` has written of a lane."""
    o = MOTION + j
    a, b, c, d = read_four(W, o)
    e, f, g, h = read_four(W, o + 4 * LANES)
    return IdealMotion(a, b, c, d, e, f, g, h, W[o + 8 * LANES])


@inline_numba
def read_state(scene, W, j):
    """Return the motion that `move_states` has written of a lane, eight numbers."""
    a, b, c, d = read_four(W, Y + j)
    e, f, g, h = 0.0, 0.0, 0.0, 0.0
    if len(scene) == 3:
        e, f, g, h = read_four(W, Y + 4 * LANES + j)
    return a, b, c, d, e, f, g, h


@inline_numba
def write_rates(scene, W, o, y, d, q):
    """Write dz/dt into rows from o on: rates, accelerations, powers."""
    if len(scene) == 3:
        write_four(W, o, (y[4], y[5], y[6], y[7]))
        write_four(W, o + 4 * LANES, d)
        write_four(W, o + 8 * LANES, q)
    else:
        write_four(W, o, (y[2], y[3], d[0], d[3]))
        write_four(W, o + 4 * LANES, q)


@inline_numba
def write_columns(W, o, g):
    """Write the observed columns from ACCELERATION to GUIDE_MOMENT into rows from o on."""
    write_four(W, o, (g[0], g[1], g[2], g[3]))
    write_four(W, o + 4 * LANES, (g[4], g[5], g[6], g[7]))
    write_four(W, o + 8 * LANES, (g[8], g[9], g[10], g[11]))
    write_four(W, o + 12 * LANES, (g[12], g[13], g[14], g[15]))
    W[o + 16 * LANES], W[o + 17 * LANES] = g[16], g[17]


@jit
def stage_rates(scene, W, k, s):
    """Compute dz/dt at MOTION and Y as stage s."""
    W = without_refcount(W)
    for j in range(k):
        p, y = lane_record(scene, W, j), read_state(scene, W, j)
        now = evaluate(read_motion(W, j), y, np.int64(W[PHASE + j]), p)
        accelerations = deviation_accelerations(now, p)
        flows = powers(now, y, joint_forces(now, y, p), p)
        write_rates(scene, W, OUT + j, y, accelerations, flows)
    copy_rows(W, K + s * STATE * LANES, OUT, STATE if len(scene) == 3 else MAX_STATES)


@jit
def last_stage(scene, W, k):
    """Compute dz/dt at MOTION and Y, the steps' ends, as the last stage, and observe them."""
    W = without_refcount(W)
    for j in range(k):
        p, y = lane_record(scene, W, j), read_state(scene, W, j)
        now = evaluate(read_motion(W, j), y, np.int64(W[PHASE + j]), p)
        forces = joint_forces(now, y, p)
        flows = powers(now, y, forces, p)
        write_rates(scene, W, LAST_STAGE + j, y, deviation_accelerations(now, p), flows)
        write_columns(W, R4 + j, observed_columns(now, y, forces, p))
        W[R4 + 18 * LANES + j], W[R4 + 19 * LANES + j] = energies(now, y, p)


@jit
def observe_node(scene, W, k, i):
    """Write what is observed at MOTION and Y as node i of the steps; not their energies."""
    W = without_refcount(W)
    for j in range(k):
        p, y = lane_record(scene, W, j), read_state(scene, W, j)
        now = evaluate(read_motion(W, j), y, np.int64(W[PHASE + j]), p)
        write_columns(W, OBSERVED + j, observed_columns(now, y, joint_forces(now, y, p), p))
    copy_rows(W, NODE_ROWS + i * ROW, OBSERVED, OBSERVED_COUNT)


@jit
def finish_step(scene, W, k, w):
    """Write state and flows at the ends of the steps, and their error norms.

    The state is that of the last stage, in Y.
    """
    W = without_refcount(W)
    n = 8 if len(scene) == 3 else 4
    copy_rows(W, NEW, Y, n)
    for j in range(k):
        if len(scene) == 3:
            W[NEW + 8 * LANES + j] = combine_stages(W, 8, j, w)
            W[NEW + 9 * LANES + j] = combine_stages(W, 9, j, w)
            W[NEW + 10 * LANES + j] = combine_stages(W, 10, j, w)
            W[NEW + 11 * LANES + j] = combine_stages(W, 11, j, w)
        else:
            W[NEW + 4 * LANES + j] = combine_stages(W, 4, j, w)
            W[NEW + 5 * LANES + j] = combine_stages(W, 5, j, w)
            W[NEW + 6 * LANES + j] = combine_stages(W, 6, j, w)
            W[NEW + 7 * LANES + j] = combine_stages(W, 7, j, w)
    for j in range(k):
        e = add_error_square(W, 1, j, add_error_square(W, 0, j, 0.0))
        e = add_error_square(W, 3, j, add_error_square(W, 2, j, e))
        if len(scene) == 3:
            e = add_error_square(W, 5, j, add_error_square(W, 4, j, e))
            e = add_error_square(W, 7, j, add_error_square(W, 6, j, e))
        W[ERROR + j] = W[H + j] * square_root(e / n)


@inline_numba
def add_error_square(W, i, j, total):
    """Return a total and the square of number i's estimated error over tolerance and step."""
    u, w = LANES * i + j, ERROR_WEIGHTS
    e = fma(w[1], W[K + 12 * LANES + u], fma(w[0], W[K + u], 0.0))
    e = fma(w[3], W[K + 36 * LANES + u], fma(w[2], W[K + 24 * LANES + u], e))
    e = fma(w[5], W[K + 60 * LANES + u], fma(w[4], W[K + 48 * LANES + u], e))
    e = fma(w[6], W[K + 72 * LANES + u], e)
    e = error_share(e, W[Z + u], W[NEW + u], W[RTOL + j], W[ATOL + u])
    return fma(e, e, total)


@inline_numba
def weights_of(table, i):
    """Return the row i of a table of weights of the stages as a tuple."""
    return (
        table[i, 0], table[i, 1], table[i, 2], table[i, 3], table[i, 4], table[i, 5], table[i, 6]
    )  # fmt: skip


@jit
def observe_nodes(scene, W, k, nodes):
    """Write what is observed at some nodes of the steps."""
    for i in nodes:
        move_cranks(W, k, NODES[i])
        move_states(scene, W, k, weights_of(NODE_WEIGHTS, i))
        observe_node(scene, W, k, i)


@jit
def try_steps(scene, W, k):
    """Try a step in each lane: stages, error, and what is observed in its middle and at its end."""
    for s in range(1, STAGES - 1):
        move_cranks(W, k, FRACTIONS[s])
        move_states(scene, W, k, weights_of(STEP_WEIGHTS, s))
        stage_rates(scene, W, k, s)
    # the last two stages stand both at the step's end: its ideal motion is computed once
    move_states(scene, W, k, weights_of(STEP_WEIGHTS, STAGES - 1))
    last_stage(scene, W, k)
    finish_step(scene, W, k, weights_of(STEP_WEIGHTS, STAGES - 1))
    observe_nodes(scene, W, k, MIDDLE)

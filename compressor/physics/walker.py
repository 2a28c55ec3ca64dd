"""What a march carries from step to step: the walker, and the arrays that it works in."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from compressor.physics.observe import COLUMNS
from compressor.physics.record import zero
from compressor.physics.runge_kutta import FLOWS, STAGES, A, P, Pair
from compressor.physics.step_control import LEAST_ERROR, REST, Mode
from compressor.physics.tally import lobatto

NODES, WEIGHTS = lobatto(5)  # at which a step is observed
COARSE_WEIGHTS = np.zeros(NODES.size)  # at its ends and in its middle alone
COARSE_WEIGHTS[::2] = lobatto(3)[1]
# of the stages of each explicit pair, at these nodes: (pair, node, stage)
NODE_WEIGHTS = np.array([[P[pair] @ s ** np.arange(1, 5) for s in NODES] for pair in Pair])
NODE_WEIGHTS[:, -1] = A[:, -1]


class Status(IntEnum):
    """How a walker stands."""

    RUNNING = 0
    DONE = 1
    NON_FINITE = 2
    STEP_UNDERFLOW = 3
    PENETRATION_IMPLAUSIBLE = 4
    BEYOND_MODEL = 5  # as of `mechanism_rows.beyond_model`


# numba wants plain integers
RUNNING, DONE, NON_FINITE, STEP_UNDERFLOW, PENETRATION_IMPLAUSIBLE, BEYOND_MODEL = map(int, Status)

WALKER = np.dtype(
    [
        ("pair", "i8"),
        ("status", "i8"),
        ("t", "f8"),
        ("h", "f8"),  # the next step's length; 0: to be chosen
        ("error", "f8"),  # of the last accepted step: logarithm of its norm
        ("fresh", "i8"),  # whether dz/dt at t is still to be evaluated
        ("observed", "i8"),  # whether work.row holds what is observed at t, in this phase
        ("laid", "i8"),  # whether work.dense holds the step's interpolant
        ("landing", "f8"),  # length of the step that ends on the onset ahead, or 0
        ("landed", "i8"),  # whether the last step ended on an onset
        ("segment", "i8"),
        ("sample", "i8"),  # next output sample
        ("steps", "i8"),
        ("taken", "f8"),  # length of the last accepted step
        ("evaluations", "i8"),
        ("rejected", "i8"),
        ("onsets", "i8"),
        ("watch", "i8"),  # whether onsets of contact are watched
        ("mode", "i8"),  # Mode
        ("stiff", "i8"),  # whether the present step is the stiff partner's
        ("held", "i8"),  # explicit steps in a row that stability has held
        ("calm", "i8"),  # stiff steps in a row that an explicit method could have h
        ("rest", "i8"),  # steps until stiffness is tested again
        ("pause", "i8"),  # the rest after the last change back
        ("gain", "f8"),  # stable explicit steps' worth that stiff ones have saved since the change
        ("rtol", "f8"),
        ("settle", "f8"),
        ("contact_step", "f8"),  # s: a step that resolves the contact's own frequency
        ("deepest", "f8"),  # m: penetration beyond which the run stops
    ],
    align=True,
)


class Work(NamedTuple):
    """Arrays that a march works in; between calls the first row of `k` and `row` carry over."""

    k: np.ndarray  # (7, n + 4): stages of the explicit pair, or increments of the stiff partner
    new: np.ndarray  # (n + 4,)
    column: np.ndarray  # (n + 4,)
    jacobian: np.ndarray  # (n + 4, n)
    dense: np.ndarray  # (5, n): the step's interpolant
    weights: np.ndarray  # (7,): of the stages, at a fraction of the step
    y: np.ndarray  # (n,)
    rows: np.ndarray  # gauged at a step's nodes
    apart: np.ndarray  # (2,): share of the step without contact, by joint
    row: np.ndarray


def new_walker(mode):
    """Return a walker at the start of its first segment."""
    walker = zero(WALKER)
    walker["fresh"] = 1
    walker["error"] = LEAST_ERROR
    walker["mode"] = mode
    walker["pause"] = REST // 2
    walker["stiff"] = mode == Mode.STIFF
    return walker


def new_work(n):
    """Return the arrays for a motion of n numbers (positions and rates)."""
    size = n + FLOWS
    return Work(
        np.zeros((STAGES, size)), np.zeros(size), np.zeros(size), np.zeros((size, n)),
        np.zeros((5, n)), np.zeros(STAGES), np.zeros(n), np.zeros((NODES.size, COLUMNS)),
        np.zeros(2), np.zeros(COLUMNS),
    )  # fmt: skip

"""Where the numbers of runs that march side by side stand: rows of one flat array, a lane a run.

`W[row + j]` is a number of lane j; rows are LANES apart. LLVM makes vector code of a loop over
lanes where all its loads and stores are rows of one array at constant places, and where the record
of parameters is made of them in the loop, its choices being constants.
"""

from collections import namedtuple
from typing import Any

import numpy as np

from compressor.physics.record import RECORD, Load

LANES = 16
MOST = 8  # numbers of a motion
STATE = MOST + 4  # and energy flows
STAGE_COUNT = 7
SEEN_COUNT = 18  # columns from ACCELERATION to GUIDE_MOMENT, kinetic and potential energy
PEAKED = 7  # of these the first ones, of which the greatest size is kept
NODE_COUNT = 5

SPRING = int(Load.SPRING)

NAMES = RECORD.names or ()
# a record whose choices are constants; its fields are those of RECORD
LaneRecord: Any = namedtuple("LaneRecord", NAMES)  # type: ignore[misc]

_next = 0


def _rows(count=1):
    global _next
    first = _next * LANES
    _next += count
    return first


CHOICES = ("scene", "load", "law", "friction", "freedoms", "wide", "exponent", "corners",
           "hysteresis", "least_approach", "bristle_stiffness", "bristle_damping", "viscous",
           "laws")  # fmt: skip
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
ERROR, REMEMBERED = _rows(), _rows()
STEPS, REFUSED, BUDGET, REST, HELD, TOO_DEEP = (_rows() for _ in range(6))
ALIVE, PLAIN, NEAR, MEASURED, CALL = (_rows() for _ in range(5))
ATOL, SIZE = _rows(MOST), _rows(MOST)
Z = _rows(STATE)
NEW = _rows(STATE)
OUT = _rows(STATE)  # dz/dt of the stage at hand
K = _rows(STAGE_COUNT * STATE)
SEEN = _rows(SEEN_COUNT)
NODE_ROWS = _rows(NODE_COUNT * SEEN_COUNT)
# the tally
SECONDS, SQUARE_ACCELERATION, SQUARE_DEVIATION = _rows(), _rows(), _rows()
TORQUE_SUM, MOMENT_SUM = _rows(), _rows()
PEAK = _rows(PEAKED)
MAX_PENETRATION, LOSS_SECONDS, IMPACTS, RELEASES, TOUCHING, FLOWN = (_rows(2) for _ in range(6))
DEEPEST, ENERGY, IMBALANCE, PEAK_KINETIC = (_rows() for _ in range(4))
TOTAL = _next


def new_lanes():
    """Return the numbers of all lanes, at a boundary of 64 bytes."""
    raw = np.zeros(TOTAL * LANES + 8)
    skip = (-raw.ctypes.data // 8) % 8
    return raw[skip : skip + TOTAL * LANES]

"""How long a motion can be foretold: the time in which close twins part.

Beyond it two correct solutions differ by more than any error bar, so that a number that
depends on the course of the motion has none; statistics still have a meaning. Twins go in step
(`compressor.physics.march`), at a tolerance of their own: each step adds an error of about rtol,
which must be small beside the shift that is followed. Looser ones were measured to mislead: at
4e-6, explicit steps at the edge of stability part twins of a regular motion within a third of a
revolution; at 1e-11 one horizon of five was off by a third. At 1e-12 horizons agree with those at
1e-13, and with those of two separate runs, to a few thousandths (tests/solve/test_horizon.py).
"""

import math
import time
from typing import NamedTuple

import numpy as np

from compressor.cases import Case
from compressor.physics import (
    COLUMNS,
    FLOWS,
    Coordinate,
    Status,
    is_featured,
    march_twins,
    new_tally,
    new_work,
    segments,
)
from compressor.reasons import Reason
from compressor.solve.march_driver import check_march, chunks, prepare_stepper
from compressor.solve.request import Request, Stop, with_cuts
from compressor.solve.si_record import initial_state, is_ideal, natural_sizes, record

TWIN_DISTANCE = 1e-9  # of the clearance: how far from the motion its twin starts
PARTED_DISTANCE = 1e-2  # of the clearance: how far apart they are no longer one motion
TWINS_RTOL = 1e-12  # of the twins, whatever the case has


def predictability_horizon(
    case: Case, timeout: float = math.inf, rtol: float = TWINS_RTOL, close: float = TWIN_DISTANCE
) -> float:
    """Return the time (s) until a twin that starts 1e-9 of the clearance away is 1 % of it away.

    The journal of each joint with clearance is shifted, as much along x as along y; the distance
    is that of the eccentricities at the worse joint, seen at the end of each step. inf where the
    twins are still close at the end of the case, or the joints are ideal. Where their run stops
    before, as by `timeout` (s) or the case's max_steps, the time up to there: no more is known.
    The case's own method and tolerance do not count: the horizon belongs to the motion.
    """
    return follow_case_twins(case, case.duration, rtol, close, timeout).horizon


class Parting(NamedTuple):
    """Up to when (s) twins were followed, whether they parted there, or came to the end.

    `attempts`: of a step, by the first of the two.
    """

    time: float
    parted: bool
    whole: bool
    attempts: int = 0

    @property
    def horizon(self) -> float:
        """Return the time (s) up to which they stayed together; inf to the end."""
        return math.inf if self.whole else self.time


def follow_case_twins(
    case: Case, span: float, rtol: float, close: float, timeout: float
) -> Parting:
    """Follow twins over a span (s), `close` at its begin, within a wall time (s).

    As `predictability_horizon`, whose docstring says what counts as apart.
    """
    if is_ideal(case):
        return Parting(span, False, True)
    p = record(case)
    start = initial_state(case, p)
    twin_start = initial_state(case, p, close * p["clearance"][:, None] / math.sqrt(2.0))
    if is_featured(p) and p["tilting"]:
        twin_start[p["at"][Coordinate.GUIDE]] += close * p["guide_clearance"]
    ends = np.array([0.0, span])
    request = Request(p, start, ends, 0.0, rtol, "auto", case.solve.max_steps, timeout)
    return follow_twins(request, twin_start)


class Twins:
    """A motion and its twin, which takes the same steps, on their way through segments of time.

    request: of a compiled method; shifted: the twin's initial state. `ends`: the number of
    segments up to each of the request's cuts.
    """

    def __init__(self, request: Request, shifted: np.ndarray):
        self.request, self.deadline = request, time.monotonic() + request.timeout
        edges, phases = segments(request.p, float(request.times[-1]))
        self.edges, phases, self.ends = with_cuts(edges, phases, request.cuts)
        self.phases, self.twin_phases = phases.copy(), phases.copy()
        self.size = natural_sizes(request.p)
        n = self.size.size
        self.stepper, self.twin_stepper = (prepare_stepper(request, self.size) for _ in range(2))
        self.z, self.twin = (np.append(y, np.zeros(FLOWS)) for y in (request.start, shifted))
        self.work, self.twin_work = new_work(n), new_work(n)
        self.rows, self.tally = np.zeros((2, COLUMNS)), new_tally(request.p)
        self.states = np.empty((request.times.size, n))

    def advance(self, count: int, far: float) -> bool:
        """Advance through `count` segments; return whether the twins got `far` apart before.

        far: as a share of the clearance, at which they stop. Raises Stop.
        """
        request, stepper, twin_stepper = self.request, self.stepper, self.twin_stepper
        stepper.status = Status.RUNNING
        for attempts in chunks(request, stepper):
            march_twins(
                stepper, twin_stepper, request.p, self.z, self.twin, self.work, self.twin_work,
                request.rtol * self.size, self.size, self.edges[: count + 1], self.phases[:count],
                self.twin_phases[:count], request.times, self.states, self.tally, self.rows, far,
                attempts,
            )  # fmt: skip
            if twin_stepper.status == Status.DONE:
                return True
            if stepper.status != Status.DONE:
                self.check()
        return False

    def check(self) -> None:
        """Raise Stop where one of the two may go no further, or the time is up."""
        check_march(self.request, self.stepper, self.z, float(self.tally.deepest), self.deadline)
        if not np.isfinite(self.twin).all():
            raise Stop(Reason.NON_FINITE, "the twin is no longer finite")


def follow_twins(request: Request, shifted: np.ndarray, far: float = PARTED_DISTANCE) -> Parting:
    """Follow a motion and its twin until they are `far` apart, as a share of the clearance.

    request: of a compiled method; shifted: the twin's initial state.
    """
    twins = Twins(request, shifted)
    stepper, parted, whole = twins.stepper, False, False
    try:
        parted = twins.advance(twins.phases.size, far)
        whole = not parted
    except Stop:
        pass
    return Parting(float(stepper.t), parted, whole, int(stepper.steps + stepper.rejected))

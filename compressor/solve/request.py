"""What an integration is asked for, what it gives, and why it stops."""

import math
from dataclasses import dataclass, field

import numpy as np

from compressor.cases import IMPLAUSIBLE
from compressor.physics import Coordinate, elastic_form, is_featured
from compressor.reasons import Reason
from compressor.solve.turns import Cuts

LAST = 16  # attempts that a history keeps
NONE = -1  # in place of a number of the state
STALLED = 0.01  # of the steady speed: a crank that is slower has all but stopped


@dataclass
class Request:
    """What to integrate: a record (SI), the initial state, samples, span, settings and budgets.

    `cuts`: where the tally is cut into revolutions, if it is; the run's own tally is then of what
    follows the last one.
    """

    p: np.record
    start: np.ndarray
    times: np.ndarray  # output grid, s, shape (m,)
    settle: float  # s
    rtol: float
    method: str = "auto"
    max_steps: int = 5_000_000
    timeout: float = math.inf  # s
    cuts: Cuts | None = None


@dataclass
class History:
    """The last steps before a stop, each attempt one entry; error: over its tolerance."""

    times: list[float] = field(default_factory=list)  # s, where they begin
    steps: list[float] = field(default_factory=list)  # s
    errors: list[float] = field(default_factory=list)
    words: list[str] = field(default_factory=list)  # method, and what became of the step
    dominant: int = NONE  # number of the state that drove the last error, or went bad

    def add(self, time: float, step: float, error: float, words: str) -> None:
        """Append an attempt; more than LAST push out the first."""
        self.times.append(time)
        self.steps.append(step)
        self.errors.append(error)
        self.words.append(words)
        kept: list
        for kept in (self.times, self.steps, self.errors, self.words):
            del kept[:-LAST]


@dataclass
class Trajectory:
    """States on the output grid, the tally of the dense solution, and how the run ended.

    `states` has shape (m, k) and is nan from the sample at which an incomplete run stopped;
    `reason` is empty when the run is complete.
    """

    times: np.ndarray
    states: np.ndarray
    phases: np.ndarray
    tally: np.record
    reason: str = ""
    detail: str = ""
    stop_time: float = math.nan
    stop_state: np.ndarray = field(default_factory=lambda: np.empty(0))
    history: History = field(default_factory=History)  # the last steps before a stop
    steps: int = 0
    rejected: int = 0
    evaluations: int = 0
    seconds: float = 0.0


class Stop(Exception):
    """A run that cannot go on, by its named reason."""

    def __init__(self, reason: str, detail: str):
        self.reason, self.detail = reason, detail
        super().__init__(f"{reason}: {detail}")


def overdue(timeout: float) -> str:
    """What is wrong with a run that takes longer (s)."""
    return f"more than {timeout:g} s of wall time"


def check_speed(p: np.record, state: np.ndarray) -> None:
    """Raise Stop where a crank whose speed gives way has all but come to a stop."""
    if is_featured(p) and p["driven"] and state[p["at"][Coordinate.CRANK]] <= STALLED - 1.0:
        least = STALLED * p["omega"] * 30.0 / math.pi
        detail = (
            f"slower than {least:.3g} rpm: the motor gives {p['torque']:g} N m at full speed and "
            f"{p['torque_slope']:g} N m for each rad/s less, the flywheel has "
            f"{p['crank_inertia']:g} kg m2"
        )
        raise Stop(Reason.CRANK_STALLED, detail)


def greatest_depth(p: np.record) -> tuple[float, str]:
    """Penetration (m) beyond which a run stops, and what that is in words."""
    tenth = IMPLAUSIBLE * float(p["pin_radius"])
    joints = [j for j in zip(p["stiffness"], p["clearance"].tolist(), strict=True) if j[1] > 0.0]
    most = min((elastic_form(*joint, p).deepest for joint in joints), default=math.inf)
    if most < tenth:
        return most, "half the clearance, up to which contact.law: johnson holds"
    return tenth, "a tenth of the pin radius"


def too_deep(depth: float, p: np.record) -> str:
    """What is wrong with a penetration (m)."""
    return f"{depth * 1e3:.3g} mm, more than {greatest_depth(p)[1]}"

"""What an integration takes and gives, why it stops, and its tally by revolutions."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from compressor.cases import IMPLAUSIBLE
from compressor.physics import (
    FLOWS,
    STALLED,
    Coordinate,
    Fields,
    beyond_model,
    cut_tally,
    elastic_form,
    greatest_load,
    is_featured,
    read_fields,
)
from compressor.reasons import Reason

Metrics = dict[str, Any]  # by name: a number, or an array over joints (and axes)
SAME_TIME = 1e-12  # of the run: edges this near to each other are one


@dataclass
class Request:
    """What to integrate: a record (SI), the motion at the start, samples, settings and budgets.

    `cuts`: times (s) at which the tally is cut; the run's own one is then of what follows the last.
    `enough`: called at each of them with the run so far, which ends there once that is true.
    `has_rod_load`: whether the rod load is tallied.
    """

    p: np.record
    start: np.ndarray
    times: np.ndarray  # output grid, s, shape (m,)
    settle: float  # s
    rtol: float
    method: str = "auto"
    max_steps: int = 5_000_000
    timeout: float = math.inf  # s
    has_rod_load: bool = False
    cuts: Sequence[float] | np.ndarray = ()
    enough: "Callable[[Trajectory], bool] | None" = None

    @cached_property
    def fields(self) -> Fields:
        """Return `read_fields` of the record, for functions that read many of them."""
        return read_fields(self.p)


@dataclass
class Trajectory:
    """States on the output grid, the tally of the dense solution, and how the run ended.

    `states` is nan from the sample at which a run stopped; `phases`: of the load, by sample;
    `turns`: tallies between cuts; `turn_states`: the motion at each.
    """

    times: np.ndarray
    states: np.ndarray
    phases: np.ndarray
    tally: np.record
    reason: str = ""
    detail: str = ""
    stop_time: float = math.nan
    stop_state: np.ndarray = field(default_factory=lambda: np.empty(0))
    edges: np.ndarray = field(default_factory=lambda: np.empty(0))  # of segments, s, with cuts
    edge_phases: np.ndarray = field(default_factory=lambda: np.empty(0))  # as run through
    turns: list[np.record] = field(default_factory=list)
    turn_states: list[np.ndarray] = field(default_factory=list)
    steps: int = 0
    rejected: int = 0
    evaluations: int = 0
    seconds: float = 0.0

    @property
    def last_state(self) -> np.ndarray:
        """Return the motion, (k,), where the run ended or stopped."""
        return self.stop_state if self.reason and self.stop_state.size else self.states[-1]

    def at(self, times: np.ndarray) -> "Trajectory":
        """Return the run with the samples at some of its times (s) alone."""
        at = np.searchsorted(self.times, times)
        return replace(self, times=times, states=self.states[at], phases=self.phases[at])

    def cut(self, z: np.ndarray) -> None:
        """Put the tally since the last cut aside, and begin another; z: motion and flows there."""
        self.turn_states.append(z[:-FLOWS].copy())
        self.turns.append(cut_tally(self.tally))


def revolutions(begin: float, end: float, turn: float) -> np.ndarray:
    """Return the ends (s) of the whole revolutions between two times, (m,)."""
    return begin + turn * np.arange(1, int((end - begin) / turn * (1 + SAME_TIME)) + 1)


def split_segments(
    edges: np.ndarray, phases: np.ndarray, times: Sequence[float]
) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Return segments that end at some times (s), too, and these, an edge's where one is near."""
    exact = []
    for time in times:
        edge = float(edges[np.abs(edges - time).argmin()])
        exact.append(edge if abs(edge - time) <= SAME_TIME * edges[-1] else time)
        i = int(np.searchsorted(edges, exact[-1]))
        if i < edges.size and edges[i] != exact[-1]:
            edges = np.insert(edges, i, exact[-1])
            phases = np.insert(phases, i, phases[i - 1])
    return edges, phases, exact


def passed_time(p: np.record, times: Any, states: np.ndarray) -> Any:
    """Return the time (s) that has passed when the crank is where a steady one were at times."""
    driven = is_featured(p) and p["driven"]
    return times + states[..., p["at"][Coordinate.CRANK] - 1] if driven else times


class Stop(Exception):
    """A run that cannot go on, by its named reason."""

    def __init__(self, reason: str, detail: str):
        self.reason, self.detail = reason, detail
        super().__init__(f"{reason}: {detail}")


def check_state(p: np.record, state: np.ndarray) -> None:
    """Raise Stop where a state leaves what a mechanism with features can do."""
    beyond = beyond_model(state, p)
    if beyond == 1:
        least = STALLED * p["omega"] * 30.0 / math.pi
        detail = (
            f"slower than {least:.3g} rpm: the motor gives {p['torque']:g} N m at full speed and "
            f"{p['torque_slope']:g} N m for each rad/s less, the flywheel has "
            f"{p['crank_inertia']:g} kg m2"
        )
        raise Stop(Reason.CRANK_STALLED, detail)
    if beyond == 2:
        limit = IMPLAUSIBLE * 1e3 * min(p["guide_length"], p["guide_height"])
        detail = f"a corner of the crosshead is more than {limit:.3g} mm deep in its guide"
        raise Stop(Reason.GUIDE_IMPLAUSIBLE, f"{detail}, a tenth of half its smaller side")
    if beyond == 3:
        limit = IMPLAUSIBLE * 1e3 * p["rod_length"]
        detail = f"the rod is bent or pressed by more than {limit:.3g} mm, a tenth of its length"
        raise Stop(Reason.ROD_IMPLAUSIBLE, detail)


def greatest_depths(p: Fields) -> np.ndarray:
    """Return each joint's penetration (m, (2,)) beyond which a run stops; inf of an ideal one."""
    names, found = ("stiffness", "clearance", "pin_radius"), []
    for k, c, pin in zip(*(p[name].tolist() for name in names), strict=True):
        most = min(IMPLAUSIBLE * pin, elastic_form(k, c, p).deepest) if c > 0.0 else math.inf
        found.append(most)
    return np.array(found)


MAX_ENERGY = 100.0  # times the machine's: no motion brings a contact so far, a step too long does


def check_depth(depths: np.ndarray, p: np.record) -> None:
    """Raise Stop for penetrations (m, (2,)) beyond `greatest_depths`, by what let one come so."""
    limits = greatest_depths(p)
    joint = int(np.argmax(depths - limits))
    depth, most = float(depths[joint]), float(limits[joint])
    if depth <= most:
        return
    speed = p["crank_radius"] * p["omega"]
    kinetic = 0.5 * (p["rod_mass"] + p["reciprocating_mass"]) * speed**2
    present = kinetic + 2.0 * p["crank_radius"] * greatest_load(p)
    stiffness, clearance = (float(p[name][joint]) for name in ("stiffness", "clearance"))
    if elastic_form(stiffness, clearance, p).energy(most) > MAX_ENERGY * present:
        text = "a step went into a contact that is too stiff for it at this tolerance"
        raise Stop(Reason.CONTACT_UNDERRESOLVED, f"{depth * 1e3:.3g} mm: {text}")
    words = "a tenth of the pin radius"
    if most < IMPLAUSIBLE * p["pin_radius"][joint]:
        words = "half the clearance, up to which contact.law: johnson holds"
    raise Stop(Reason.PENETRATION_IMPLAUSIBLE, f"{depth * 1e3:.3g} mm, more than {words}")

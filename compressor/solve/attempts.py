"""One run of a case at one tolerance, and another one to estimate its errors by."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from compressor.cases import TIGHTEST, Case
from compressor.physics import COLUMNS, state_names
from compressor.solve.energy_audit import energy_residual
from compressor.solve.error_bars import (
    Companion,
    Metrics,
    bars,
    enlarged,
    longest,
    series_errors,
)
from compressor.solve.ideal_scene import closed_form
from compressor.solve.initial import initial_state
from compressor.solve.integrate import integrate
from compressor.solve.request import Request, Trajectory
from compressor.solve.rod_load import reversal, reversal_bars, reversal_times
from compressor.solve.series import (
    compared_times,
    distances,
    finer,
    journal_distance,
    take_samples,
)
from compressor.solve.si_record import is_ideal, record
from compressor.solve.sizes import length_and_speed
from compressor.solve.tallied import metrics
from compressor.solve.turns import Cuts, Turns, merged

PIECES = 32  # of the ideal scene's quadrature
FINER = 0.3  # power of the tolerance by which they become more
TIGHTER = 2.5  # times: the run that errors are estimated by
LOOSE = 2e-4  # tolerances from which on explicit steps may run over friction's fast modes
BLUNT = 0.02  # the same, of the journals' speed, over the speed at which friction turns about
STIFF_TIGHTER = 10.0  # the same at loose tolerances
LOOSER = 3.0  # times: the run that is asked as well where a motion enlarges errors


@dataclass
class Solution:
    """A case's motion and what is known of it.

    `rtol`: the tolerance it was integrated with; `metrics`: by name, empty where the run did not
    reach its end; `bars`, `series_errors`: an error of each metric and of each time series, empty
    where none was estimated; `samples`: observed rows at the times at which runs are compared;
    `reason` and `detail`: why the job failed, empty when it is ok; `promise`: whether what its
    accuracy promises was `kept`, or `none` was given; `horizon` (s): nan where none was looked for;
    `settle` (s): from where metrics count; `turns`: tallies of the settled revolutions, where they
    were asked for; `statistics`: of a chaotic motion; `regime`: of `Regime`, or "" where nothing is
    known; `period`, `settled` (rev): of a periodic motion, nan of others; `loads`: observed rows
    for the `reversal` of the rod load, none without signals, with its `reversal_bars`.
    """

    p: np.record
    trajectory: Trajectory
    rtol: float
    settle: float
    metrics: Metrics
    samples: np.ndarray
    reason: str
    detail: str
    bars: Metrics = field(default_factory=dict)
    series_errors: Metrics = field(default_factory=dict)
    promise: str = "none"
    horizon: float = math.nan
    turns: Turns = field(default_factory=list)
    statistics: Metrics = field(default_factory=dict)
    regime: str = ""
    period: float = math.nan
    settled: float = math.nan
    loads: np.ndarray = field(default_factory=lambda: np.empty((0, COLUMNS)))
    reversal: Metrics = field(default_factory=dict)
    reversal_bars: Metrics = field(default_factory=dict)

    def journals_apart(self, other: "Solution") -> float:
        """Return the greatest distance of the journals of two runs of a case, over their room."""
        return journal_distance(self.p, self.samples, other.samples)


Ahead = Mapping[float, Solution]  # attempts of a case that were made before, by tolerance
NOTHING_AHEAD: Ahead = {}


def attempt(
    case: Case, rtol: float, timeout: float, sampled: bool, cuts: Cuts | None = None,
    state: np.ndarray | None = None,
) -> Solution:  # fmt: skip
    """Return one run of a case at a tolerance, without errors, within a wall time (s).

    `sampled`: whether on the output grid; steps do not land on it, so that metrics are the same
    without. `cuts`: into revolutions; metrics are of all of them. `state`: the motion at the start,
    top dead centre (`physics.state_names`), in place of the case's own; no ideal scene has one.
    """
    p, times = record(case), times_of(case, sampled)
    if is_ideal(case):
        pieces = round(PIECES * (case.rtol / rtol) ** FINER)
        return concluded(rtol, p, times, closed_form(p, times.all, case.settle, pieces, timeout))
    asked = request(case, rtol, p, times, state)
    asked.timeout, asked.cuts = timeout, cuts
    trajectory = integrate(asked)
    turns = cuts.turns if cuts else []
    if turns:
        trajectory.tally = merged([*turns, trajectory.tally])
    made = concluded(rtol, p, times, trajectory)
    made.turns = turns
    return made


class Times(NamedTuple):
    """Times (s) of a run: settled; its output, its comparison, its rod load; all of them."""

    settle: float
    output: np.ndarray
    compared: np.ndarray
    loaded: np.ndarray
    all: np.ndarray


def times_of(case: Case, sampled: bool) -> Times:
    """Return the times at which a run of a case is sampled."""
    samples = finer(case) * round(case.steps) if sampled else 1
    output = case.duration * (np.arange(samples + 1) / samples)
    compared = compared_times(case) if case.wants_bars else output[:0]
    loaded = reversal_times(case)
    every = output
    for more in (compared, loaded):
        if more.size:
            every = np.union1d(every, more)
    return Times(case.settle, output, compared, loaded, every)


def request(
    case: Case, rtol: float, p: np.record, times: Times, state: np.ndarray | None = None
) -> Request:
    """Return what `attempt` asks to be integrated, without a limit in wall time."""
    how = case.solve
    if state is None:
        y = initial_state(case, p)
    else:
        y = np.zeros(len(state_names(p)))
        y[:] = state
    return Request(p, y, times.all, times.settle, rtol, how.method, how.max_steps)


def concluded(rtol: float, p: np.record, times: Times, trajectory: Trajectory) -> Solution:
    """Return what an attempt's trajectory tells."""
    loads = np.empty((0, COLUMNS))
    if times.loaded.size:
        stay = np.union1d(times.output, times.compared)
        loads = take_samples(p, trajectory, times.loaded, stay)
    taken = take_samples(p, trajectory, times.compared, times.output)
    reason, detail = trajectory.reason, trajectory.detail
    found = {} if reason else metrics(p, trajectory.tally)
    made = Solution(p, trajectory, rtol, times.settle, found, taken, reason, detail)
    made.loads = loads
    made.reversal = {} if reason else reversal(loads)
    return made


def companion_rtol(p: np.record, rtol: float) -> float | None:
    """Return the tolerance of a run's `companion`, if that is by the run's own method and
    tighter.
    """
    fits = rtol >= 0.99 * TIGHTER * TIGHTEST and not overruns_friction(p, rtol)
    return rtol / TIGHTER if fits else None


def overruns_friction(p: np.record, rtol: float) -> bool:
    """Return whether explicit steps may run over friction's fast modes, or over the turn of its
    sign.

    Then two explicit runs may agree on a force that friction never has.
    """
    if rtol > LOOSE:
        return True
    rubs = bool(p["friction"]) and bool(p["clearance"].any())
    return rubs and rtol * length_and_speed(p)[1] > BLUNT * p["stiction_velocity"]


def companion(
    case: Case, solution: Solution, timeout: float, ahead: Ahead = NOTHING_AHEAD
) -> Solution:
    """Return the run that a run's errors are estimated by, where no looser one is there: a tighter
    one.

    At the tightest tolerance, a looser one. Where explicit steps may run over friction, the stiff
    method is asked.
    """
    tighter = companion_rtol(solution.p, solution.rtol)
    if tighter is not None:
        return ahead.get(tighter) or attempt(case, tighter, timeout, False)
    if overruns_friction(solution.p, solution.rtol):
        stiff = replace(case, solve=replace(case.solve, method="RODAS"))
        return attempt(stiff, solution.rtol / STIFF_TIGHTER, timeout, False)
    return attempt(case, 10.0 * solution.rtol, timeout, False)


def witness(case: Case, solution: Solution, other: Solution, timeout: float) -> Solution | None:
    """Return a looser run, by which errors are estimated as well where the motion enlarges them.

    other: its `companion`. None where there is no need, or the run does not reach its end.
    """
    if other.reason or not enlarged(solution.rtol, distances(solution.samples, other.samples)):
        return None
    found = attempt(case, LOOSER * solution.rtol, timeout, False)
    return None if found.reason else found


def estimate_errors(solution: Solution, *others: Solution) -> None:
    """Give a run its error bars and the errors of its time series by other runs of its case.

    The longest by any of them; inf without one that reached its end.
    """
    residual = energy_residual(solution.trajectory.tally)
    known = [(by_run(solution, one), one.loads) for one in others if not one.reason]
    by: list[tuple[Companion | None, np.ndarray]] = [*known] or [(None, solution.loads[:0])]
    solution.bars = longest([bars(solution.metrics, one, residual) for one, _ in by])
    solution.series_errors = longest([series_errors(one) for one, _ in by])
    solution.reversal_bars = longest([reversal_bars(solution.loads, *one) for one in by])


def by_run(solution: Solution, other: Solution) -> Companion:
    """Return what another run that reached its end tells of a run."""
    apart = distances(solution.samples, other.samples)
    return Companion(other.metrics, other.rtol / solution.rtol, apart)

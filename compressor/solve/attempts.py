"""One run of a case at one tolerance, and another one to estimate its errors by."""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from compressor.cases import TIGHTEST, Case
from compressor.physics import COLUMNS, FREEDOMS, Scene, start
from compressor.solve.energy_audit import energy_residual
from compressor.solve.error_bars import Companion, Metrics, bars, series_errors
from compressor.solve.ideal_scene import closed_form
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
from compressor.solve.si_record import offsets, record, scene
from compressor.solve.tallied import metrics
from compressor.solve.turns import Cuts, Turns, merged

PIECES = 32  # of the ideal scene's quadrature
FINER = 0.3  # power of the tolerance by which they become more
TIGHTER = 2.5  # times: the run that errors are estimated by
LOOSE = 2e-4  # tolerances from which on explicit steps may run over friction's fast modes
STIFF_TIGHTER = 10.0  # the same at loose tolerances


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
        """Greatest distance of the journals of two runs of a case, over their room."""
        return journal_distance(self.p, self.samples, other.samples)


def attempt(
    case: Case, rtol: float, timeout: float, sampled: bool, cuts: Cuts | None = None,
    state: np.ndarray | None = None,
) -> Solution:  # fmt: skip
    """One run of a case at a tolerance, without errors, within a wall time (s).

    `sampled`: whether on the output grid; steps do not land on it, so that metrics are the same
    without. `cuts`: into revolutions; metrics are of all of them. `state`: the motion at the start,
    top dead centre (`physics.STATE_NAMES`), in place of the case's own; no ideal scene has one.
    """
    p = record(case)
    samples = finer(case) * round(case.steps) if sampled else 1
    times = case.duration * (np.arange(samples + 1) / samples)
    compared = compared_times(case) if case.wants_bars else times[:0]
    loaded = reversal_times(case)
    stay = np.union1d(times, compared)
    grid = np.union1d(stay, loaded)
    if scene(case) == Scene.IDEAL:
        pieces = round(PIECES * (case.rtol / rtol) ** FINER)
        trajectory = closed_form(p, grid, case.settle, pieces, timeout)
    else:
        y = np.zeros(2 * FREEDOMS[scene(case)])
        if state is None:
            start(offsets(case), y, p)
        else:
            y[:] = state
        how = case.solve
        trajectory = integrate(
            Request(p, y, grid, case.settle, rtol, how.method, how.max_steps, timeout, cuts)
        )
    turns = cuts.turns if cuts else []
    if turns:
        trajectory.tally = merged([*turns, trajectory.tally])
    loads = take_samples(p, trajectory, loaded, stay) if loaded.size else np.empty((0, COLUMNS))
    taken = take_samples(p, trajectory, compared, times)
    found = {} if trajectory.reason else metrics(p, trajectory.tally)
    reason, detail = trajectory.reason, trajectory.detail
    made = Solution(p, trajectory, rtol, case.settle, found, taken, reason, detail, turns=turns)
    made.loads = loads
    made.reversal = {} if reason else reversal(loads)
    return made


def companion(case: Case, solution: Solution, timeout: float) -> Solution:
    """The run that a run's errors are estimated by, where no looser one is there: a tighter one.

    At the tightest tolerance, a looser one. Where the tolerance is so loose that explicit steps
    may run over friction's fast modes, the stiff method is asked.
    """
    if solution.rtol > LOOSE:
        stiff = replace(case, solve=replace(case.solve, method="RODAS"))
        return attempt(stiff, solution.rtol / STIFF_TIGHTER, timeout, False)
    if solution.rtol < 0.99 * TIGHTER * TIGHTEST:
        return attempt(case, 10.0 * solution.rtol, timeout, False)
    return attempt(case, solution.rtol / TIGHTER, timeout, False)


def estimate_errors(solution: Solution, other: Solution | None) -> None:
    """Give a run its error bars and the errors of its time series; inf without another run."""
    by = None
    if other is not None and not other.reason:
        apart = distances(solution.samples, other.samples)
        by = Companion(other.metrics, other.rtol / solution.rtol, apart)
    residual = energy_residual(solution.trajectory.tally)
    solution.bars = bars(solution.metrics, by, residual)
    solution.series_errors = series_errors(by)
    loads = solution.loads[:0] if other is None else other.loads
    solution.reversal_bars = reversal_bars(solution.loads, by, loads)

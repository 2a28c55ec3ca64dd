"""A case solved: its run, its audit, the runs that its errors are estimated by, and its ladder."""

import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compressor.cases import LOOSEST, TIGHTEST, Case
from compressor.physics import FREEDOMS, Scene, start
from compressor.reasons import Reason
from compressor.solve.energy_audit import RUNGS, allowed, energy_residual
from compressor.solve.error_bars import (
    Metrics,
    OtherRun,
    bars,
    journal_distance,
    take_instants,
    unmet,
    with_instants,
)
from compressor.solve.horizon import predictability_horizon
from compressor.solve.ideal_scene import closed_form
from compressor.solve.integrate import integrate
from compressor.solve.request import Request, Trajectory
from compressor.solve.si_record import offsets, record, scene
from compressor.solve.tallied import metrics

NO_INSTANTS = np.zeros((1, 2, 2))  # of a run that is compared with no other, or has ideal joints
PIECES = 32  # of the ideal scene's quadrature; twice as many a rung
OUT_OF_BUDGET = (
    Reason.BUDGET_STEPS,
    Reason.BUDGET_SECONDS,
    Reason.STEP_UNDERFLOW,
)  # a tighter run may end so


@dataclass
class Solution:
    """A case's motion and what is known of it.

    `rtol`: the tolerance it was integrated with; `metrics`: by name, empty where the run did not
    reach its end; `bars`: an error bar of each metric, empty where none was made; `instants`:
    eccentricities (m) at a few times, by which runs are compared; `reason` and `detail`: why the
    job failed, empty when it is ok; `horizon` (s): nan where none was asked for.
    """

    p: np.record
    trajectory: Trajectory
    rtol: float
    metrics: Metrics
    bars: Metrics
    instants: np.ndarray
    reason: str
    detail: str
    horizon: float = math.nan


def solve(case: Case) -> Solution:
    """A case's motion, with error bars and the horizon where they are wanted."""
    began = time.monotonic()
    solution = climb(case) if case.targets else once(case)
    if case.solve.horizon and not solution.reason:
        left = case.solve.timeout_s - (time.monotonic() - began)
        solution.horizon = predictability_horizon(case, left)
        if solution.horizon < case.duration:
            beyond_horizon(case, solution)
    return solution


def beyond_horizon(case: Case, solution: Solution) -> None:
    """Withdraw the error bars of a motion that cannot be foretold to its end."""
    solution.bars = {name: np.full(np.shape(bar), math.inf) for name, bar in solution.bars.items()}
    if case.targets:
        solution.reason = Reason.ACCURACY_NOT_REACHED
        turns = solution.horizon / case.turn
        solution.detail = f"no error bar holds beyond the horizon, {turns:.3g} revolutions"


def once(case: Case) -> Solution:
    """A case's motion at its own tolerance, with error bars where they are wanted."""
    solution = audited(case, case.output.keep == "series")
    if case.wants_bars and not solution.reason:
        left = case.solve.timeout_s - solution.trajectory.seconds
        solution.bars = bars_of(solution, other_runs(case, solution, left))
    return solution


def other_runs(case: Case, solution: Solution, timeout: float) -> list[Solution]:
    """The runs that a run's errors are estimated by; none if the first of them fails.

    The first is ten times looser; or ten times tighter where the tolerance is so loose that
    explicit steps may run over friction's fast modes, then by the stiff partner, and where the
    looser run has failed its audit. A second one is a thousand times looser, if that is not too
    loose.
    """
    rung, retried = round(math.log10(case.rtol / solution.rtol)), solution.rtol < 0.5 * case.rtol
    stiff = replace(case, solve=replace(case.solve, method="RODAS"))
    loose = solution.rtol > LOOSEST
    tighter = loose or (retried and solution.rtol > 5.0 * TIGHTEST)
    near = attempt(stiff if loose else case, rung + (1 if tighter else -1), timeout, False)
    if near.reason or 1e3 * solution.rtol > LOOSEST:
        return [] if near.reason else [near]
    far = attempt(case, rung - 3, timeout - near.trajectory.seconds, False)
    return [near] if far.reason else [near, far]


def audited(case: Case, sampled: bool) -> Solution:
    """A run whose energy balances: at the case's tolerance, or up to RUNGS times ten tighter.

    Where no run passes the audit, the last whole one is a failed job.
    """
    left = case.solve.timeout_s
    best: Solution | None = None
    for rung in range(RUNGS + 1):
        solution = attempt(case, rung, left, sampled)
        if best and solution.reason in OUT_OF_BUDGET:
            return unbalanced(case, best, solution.reason, f"the next run: {solution.detail}")
        if solution.reason or balanced(case, solution):
            return solution
        left -= solution.trajectory.seconds
        best = solution
        if solution.rtol < 9.9 * TIGHTEST:
            break
    return unbalanced(case, solution, "", f"at rtol {solution.rtol:.2g}")


def balanced(case: Case, solution: Solution) -> bool:
    """Whether the energy of a whole run balances as well as the case asks for."""
    return energy_residual(solution.trajectory.tally) <= allowed(
        case.rtol, case.duration / case.turn
    )


def unbalanced(case: Case, best: Solution, reason: str, detail: str) -> Solution:
    """A whole run as a failed job: its series and energies are kept, its metrics are not."""
    residual = energy_residual(best.trajectory.tally)
    most = allowed(case.rtol, case.duration / case.turn)
    best.metrics, best.bars = {}, {}
    timed_out = reason == Reason.BUDGET_SECONDS
    best.reason = reason if timed_out else Reason.ENERGY_AUDIT_FAILED
    best.detail = f"energy residual {residual:.2g}, more than {most:.2g}; {detail}"
    return best


def climb(case: Case) -> Solution:
    """Ever tighter runs, until the bars of the metrics that accuracy is asked for are met.

    Each run is compared with the looser ones, so that bars cost nothing. A ladder that ends
    before keeps its last whole run, and says how far it came.
    """
    left = case.solve.timeout_s
    sampled = case.output.keep == "series"
    runs = [attempt(case, 0, left, sampled)]
    for rung in itertools.count(1):
        best = runs[-1]
        if best.reason:
            return best
        left -= best.trajectory.seconds
        if case.rtol / 10.0**rung < 0.99 * TIGHTEST:
            return short_of(case, best, Reason.ACCURACY_NOT_REACHED, "no run is tighter")
        solution = attempt(case, rung, left, sampled)
        if solution.reason in OUT_OF_BUDGET:
            reason = (
                solution.reason
                if solution.reason == Reason.BUDGET_SECONDS
                else Reason.ACCURACY_NOT_REACHED
            )
            return short_of(case, best, reason, f"the next run: {solution.detail}")
        if not solution.reason:
            solution.bars = bars_of(solution, [best, *runs[-3:-2]])
            trusted = balanced(case, best) and balanced(case, solution)
            if trusted and not unmet(case.targets, solution.metrics, solution.bars):
                return solution
        runs.append(solution)
    raise AssertionError("the ladder has an end")


def short_of(case: Case, best: Solution, reason: str, detail: str) -> Solution:
    """The best run of a ladder as a failed job that tells how far it came."""
    if not balanced(case, best):
        return unbalanced(case, best, reason, detail)
    best.bars = best.bars or bars_of(best, [])
    missed = unmet(case.targets, best.metrics, best.bars)
    best.reason = reason
    best.detail = "; ".join([*missed, f"at rtol {best.rtol:.2g}", detail])
    return best


def attempt(case: Case, rung: int, timeout: float, sampled: bool) -> Solution:
    """One run of a case, 10^rung times tighter than it asks for, without error bars.

    The ideal scene's quadrature gets twice the pieces a rung. `sampled`: whether on the output
    grid; steps do not land on it, so that metrics are the same without.
    """
    p, rtol = record(case), case.rtol / 10.0**rung
    samples = round(case.steps) if sampled else 1
    times = case.duration * (np.arange(samples + 1) / samples)
    if scene(case) == Scene.IDEAL:
        trajectory = closed_form(p, times, case.settle, round(PIECES * 2.0**rung), timeout)
        instants = NO_INSTANTS
    else:
        y = np.zeros(2 * FREEDOMS[scene(case)])
        start(offsets(case), y, p)
        how = case.solve
        grid = with_instants(times) if case.wants_bars else times
        trajectory = integrate(
            Request(p, y, grid, case.settle, rtol, how.method, how.max_steps, timeout)
        )
        instants = take_instants(p, trajectory, times) if case.wants_bars else NO_INSTANTS
    solution = {} if trajectory.reason else metrics(p, trajectory.tally)
    return Solution(
        p, trajectory, rtol, solution, {}, instants, trajectory.reason, trajectory.detail
    )


def bars_of(solution: Solution, others: Sequence[Solution]) -> Metrics:
    """The error bar of each metric by other runs of the case; unknown where there are none."""
    compared = [
        OtherRun(
            one.metrics, one.rtol, journal_distance(solution.p, solution.instants, one.instants)
        )
        for one in others
    ]
    return bars(
        solution.metrics, compared, solution.rtol, energy_residual(solution.trajectory.tally)
    )

"""Solve a case: ever tighter runs until energy balances and what accuracy promises holds."""

import math
from collections.abc import Iterator

from compressor.cases import TIGHTEST, Case
from compressor.metrics import METRICS
from compressor.outcome import Regime
from compressor.reasons import Reason
from compressor.solve.error_bars import (
    LOOSER_FACTOR,
    ORDER,
    TIGHTER_FACTOR,
    estimate_errors,
    is_amplified,
    make_comparison_run,
    ratio_of,
    relative_bar,
)
from compressor.solve.request import revolutions
from compressor.solve.run import Solution, is_sampled, run_at_tolerance
from compressor.solve.run_metrics import (
    allowed_residual,
    chaotic_bars,
    energy_residual,
    next_audit_rtol,
    statistics,
)
from compressor.solve.search import Search, find_span, predictability_horizon, repeats
from compressor.solve.series import distances

# a tighter run may end so
OUT_OF_BUDGET = Reason.BUDGET_STEPS, Reason.BUDGET_SECONDS, Reason.STEP_UNDERFLOW
LAST_RTOL = TIGHTER_FACTOR * TIGHTEST  # with a tighter run to compare it with
DOUBTFUL = 0.1  # of a number: an error from which on chaos is looked for
ERROR_AIM = 0.7  # of what is allowed: where the next run's error is aimed at
MIN_TIGHTENING, MAX_TIGHTENING = 10.0, 1000.0  # times tighter than a judge that a run may be


def refine_until_accurate(case: Case, search: Search, first: Solution | None = None) -> Solution:
    """Return the first run that keeps its promise, or the last whole one as a failed job.

    A first run is compared with one a little tighter, and both with the next, which is as much
    tighter as the errors need; later ones, with the run before and a tighter one. Where a first
    one's errors are as large as the numbers, chaos is looked for.
    """
    rtol, unsound = case.rtol, 0  # runs whose energy does not balance
    best: Solution | None = None  # the last whole run
    before: Solution | None = None  # the last one whose energy balances
    while True:
        now = first or run_at_tolerance(search.within_budget(), rtol, search.left, is_sampled(case))
        first = None
        if now.reason:
            if best is None or now.reason not in OUT_OF_BUDGET:
                return now
            words = search.limit_of(now.trajectory) or now.detail
            return fail(case, best, f"the next run: {words}", now)
        search.count(now.trajectory)
        is_sound = energy_balances(case, now)
        best = now if is_sound else before or now
        if not is_sound:
            # error bars compare runs: where both lack the same energy they would agree
            unsound += 1
            tighter = next_audit_rtol(rtol, unsound)
            if tighter is None:
                told = f"the next run's energy does not balance, at rtol {rtol:.2g}"
                return fail(case, best, told if before else f"at rtol {rtol:.2g}")
            rtol = tighter
            continue
        if not case.wants_bars:
            return now
        others: list[Solution] = []
        excess = 0.0
        for other in make_comparison_runs(case, now, before, search):
            others.append(other)
            estimate_errors(now, *others)
            excess = excess_over_promise(case, now)
            if excess > 1.0 and rtol >= 1.01 * LAST_RTOL:
                break  # more runs could only confirm it
        if excess <= 1.0:
            now.promise = "kept" if has_promise(case) else "none"
            return now
        is_far = now.series_errors["acceleration"] >= DOUBTFUL
        if before is None and is_far and search.parts(whole=False):
            return now
        if rtol < 1.01 * LAST_RTOL or all(one.reason for one in others):
            return fail(case, now, others[-1].detail or "no run is tighter")
        # the next run is compared with this one: farther away than one a little tighter was
        share = ERROR_AIM / excess * (1.0 if before else 1.0 - TIGHTER_FACTOR**-ORDER)
        before = now
        tightening = min(max(ratio_of(share), MIN_TIGHTENING), MAX_TIGHTENING)
        if tighter_companion(case, now):  # the next run needs none, and takes the place of its own
            tightening *= TIGHTER_FACTOR
        rtol = max(float(f"{rtol / tightening:.1e}"), LAST_RTOL)


def tighter_companion(case: Case, before: Solution) -> Solution | None:
    """Return the tighter run that has judged a run, if both may judge the next one.

    Not where its error is a tenth of the numbers or more: of the next one it would say too little.
    """
    errors = [before.series_errors["acceleration"]]
    errors += [relative_bar(before.metrics[name], before.bars[name]) for name, _ in case.targets]
    if max(errors) >= DOUBTFUL:
        return None
    return next((one for one in before.companions if one.rtol < before.rtol), None)


def make_comparison_runs(
    case: Case, now: Solution, before: Solution | None, search: Search
) -> Iterator[Solution]:
    """Yield the runs that tell of a run's errors: the one before it, and one beside either.

    For a first run a looser one where the motion enlarges errors: two may agree by chance.
    """
    beside = tighter_companion(case, before) if before else None  # read before it judges another
    if before:
        yield before
    # not for the last tolerance, nor across a run whose energy does not balance
    if beside and 0.99 * now.rtol > LAST_RTOL and beside.rtol < 1.1 * MAX_TIGHTENING * now.rtol:
        yield beside
        return
    tighter = make_comparison_run(case, now, search.left)
    search.count(tighter.trajectory)
    yield tighter
    if before or tighter.reason:
        return
    if is_amplified(now.rtol, distances(now.samples, tighter.samples)):
        rtol = LOOSER_FACTOR * now.rtol
        looser = run_at_tolerance(case, rtol, search.left, case.body is not None)
        search.count(looser.trajectory)
        yield looser


def has_promise(case: Case) -> bool:
    """Return whether a case's accuracy promises an error, and not only sets a tolerance."""
    return case.wants_bars and case.solve.rtol is None


def excess_over_promise(case: Case, solution: Solution) -> float:
    """Return the greatest estimated error over the promised one; 0 where none is promised."""
    if case.targets:
        return max(
            relative_bar(solution.metrics[name], solution.bars[name]) / target
            for name, target in case.targets
        )
    return solution.series_errors["acceleration"] / case.promise if has_promise(case) else 0.0


def energy_balances(case: Case, solution: Solution) -> bool:
    """Return whether the energy of a whole run balances as well as the case requires."""
    return energy_residual(solution.trajectory.tally) <= allowed_residual(
        case.rtol, case.duration / case.turn
    )


def fail(case: Case, best: Solution, detail: str, now: Solution | None = None) -> Solution:
    """Return a whole run as a failed job; now: the run that was stopped after it, if one was.

    Where its energy does not balance its series and energies are kept, its metrics are not; else it
    keeps its errors, which are larger than promised.
    """
    if energy_balances(case, best):
        best.reason = Reason.ACCURACY_NOT_REACHED
        told = [*missed_promises(case, best), f"at rtol {best.rtol:.2g}"]
    else:
        best.reason = Reason.ENERGY_AUDIT_FAILED
        best.metrics, best.bars, best.series_errors = {}, {}, {}
        residual = energy_residual(best.trajectory.tally)
        allowed = allowed_residual(case.rtol, case.duration / case.turn)
        told = [f"energy residual {residual:.2g}, more than {allowed:.2g}"]
    if now and now.reason == Reason.BUDGET_SECONDS:
        best.reason = now.reason
    best.detail = "; ".join([*told, detail])
    return best


def missed_promises(case: Case, solution: Solution) -> list[str]:
    """Return a message for each promise that a run does not keep."""
    if not case.targets:
        error = solution.series_errors["acceleration"]
        return [f"acceleration: its error may be {error:.2g} of it, not {case.promise:g}"]
    return [
        f"{name}: its error bar is {long:.2g} of it, not {target:g}"
        for name, target in case.targets
        if (long := relative_bar(solution.metrics[name], solution.bars[name])) > target
    ]


CHAOTIC_RTOL = 1e-6  # at the loosest, of the run that statistics are taken from


def solve(case: Case) -> Solution:
    """Return a case's motion, with errors, regime and horizon as far as they are wanted."""
    search = Search(case)
    first = find_span(search)
    case = search.case
    solution = refine_until_accurate(case, search, first)
    solution.settled = search.settled
    if solution.reason not in ("", Reason.ACCURACY_NOT_REACHED):
        return solution
    if case.solve.horizon is True:
        search.horizon = predictability_horizon(case, search.left)
    elif case.wants_bars and is_in_doubt(case, solution):
        search.parts(whole=True)
        if solution.reason and search.stopped:
            solution.detail += "; the search for chaos came to its limit"
    solution.horizon = search.horizon
    if solution.horizon < case.duration:
        return chaotic_solution(case, solution, search)
    if case.wants_bars:
        name_regime(case, solution, search)
    if search.unsettled and not solution.reason:
        solution.reason, solution.detail = Reason.NOT_SETTLED, search.unsettled
    return solution


def is_in_doubt(case: Case, solution: Solution) -> bool:
    """Return whether a motion may be chaotic, by its errors; shares and counts are left out.

    Not where the promise of a word is kept: two motions stayed together.
    """
    if math.isfinite(case.promise) and solution.promise == "kept":
        return False
    if solution.reason or solution.series_errors["acceleration"] >= DOUBTFUL:
        return True
    return any(
        relative_bar(solution.metrics[name], solution.bars[name]) >= DOUBTFUL
        for name, row in METRICS.items()
        if row.bar.relative
    )


def name_regime(case: Case, solution: Solution, search: Search) -> None:
    """Set the regime of a motion that is not chaotic: predictable, periodic or undecided."""
    in_doubt = is_in_doubt(case, solution)
    if in_doubt and search.horizon != math.inf:
        solution.regime = Regime.UNDECIDED
        return
    shortest, since = repeats(case, solution.samples, solution.series_errors)
    solution.period = float(shortest) if shortest and not in_doubt else search.period
    solution.regime = Regime.PREDICTABLE if math.isnan(solution.period) else Regime.PERIODIC
    if solution.regime == Regime.PERIODIC and math.isnan(solution.settled):
        solution.settled = since if shortest else case.settle / case.turn


def chaotic_solution(case: Case, solution: Solution, search: Search) -> Solution:
    """Run a motion that cannot be foretold once more, for statistics over its revolutions."""
    horizon, ends = search.horizon, revolutions(case.settle, case.duration, case.turn)
    loosest = min(CHAOTIC_RTOL, case.rtol)
    for rtol in sorted({loosest, min(loosest, solution.rtol)}, reverse=True):
        now = run_at_tolerance(case, rtol, search.left, is_sampled(case), cuts=ends)
        now.horizon, now.settled, now.regime = horizon, solution.settled, Regime.CHAOTIC
        if now.reason or energy_balances(case, now):
            break
    if now.reason:
        return now
    if not energy_balances(case, now):
        return fail(case, now, f"at rtol {now.rtol:.2g}")
    if case.wants_bars:
        estimate_errors(now)
        if turns := now.trajectory.turns:
            now.statistics = statistics(now.p, turns)
            now.bars |= chaotic_bars(now.p, turns, now.metrics)
        if excess_over_promise(case, now) > 1.0 and case.targets:
            reason = f"the motion is chaotic from {horizon / case.turn:.3g} revolutions on"
            return fail(case, now, reason)
    return now

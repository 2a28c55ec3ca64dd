"""A case solved: where it settles, its runs with their errors, and the regime that it is in."""

import math

from compressor.cases import Case
from compressor.outcome import Regime
from compressor.reasons import Reason
from compressor.solve.attempts import NOTHING_AHEAD, Ahead, Solution, attempt, estimate_errors
from compressor.solve.horizon import predictability_horizon
from compressor.solve.ladder import balanced, climb, lost, over_promise, short_of, unbalanced
from compressor.solve.regime import Search, doubtful, repeats
from compressor.solve.settling import with_span
from compressor.solve.statistics import chaotic_bars, statistics
from compressor.solve.turns import Cuts, revolutions

EVALUATION = 1e-7  # s, about, of an attempt made alone: it counts against timeout_s
UNTOLD = "the search for chaos came to its limit"
CHAOTIC_RTOL = 1e-6  # at the loosest, of the run that statistics are taken from


def solve(case: Case, ahead: Ahead = NOTHING_AHEAD) -> Solution:
    """Return a case's motion, with errors, regime and horizon as far as they are wanted.

    ahead: of its attempts those that `side_by_side` has made.
    """
    search = Search(case)
    for made in ahead.values():
        search.began -= made.trajectory.evaluations * EVALUATION
    settling = with_span(case, search)
    case = search.case = settling.case
    solution = climb(case, search, ahead)
    solution.settled = settling.settled
    if solution.reason not in ("", Reason.ACCURACY_NOT_REACHED):
        return solution
    find_horizon(case, solution, search)
    if solution.horizon < case.duration:
        return chaotic(case, solution, search)
    if case.wants_bars:
        name_regime(case, solution, search)
    if settling.detail and not solution.reason:
        solution.reason, solution.detail = Reason.NOT_SETTLED, settling.detail
    return solution


def find_horizon(case: Case, solution: Solution, search: Search) -> None:
    """The horizon of a motion, where it is asked for, or where errors are as large as numbers."""
    if case.solve.horizon is True:
        search.horizon = predictability_horizon(case, search.left)
    elif case.wants_bars and in_doubt(case, solution):
        search.look(whole=True)
        if solution.reason and search.stopped:
            solution.detail += f"; {UNTOLD}"
    solution.horizon = search.horizon


def in_doubt(case: Case, solution: Solution) -> bool:
    """Return whether a motion may be chaotic, by its errors.

    Not where the promise of a word is kept: two motions, a tolerance apart, stayed together.
    """
    if math.isfinite(case.promise) and solution.promise == "kept":
        return False
    return bool(solution.reason) or lost(solution) or doubtful(solution.metrics, solution.bars)


def name_regime(case: Case, solution: Solution, search: Search) -> None:
    """Say whether a motion that is not chaotic can be foretold, and whether it repeats itself."""
    if in_doubt(case, solution):
        whole = search.horizon == math.inf
        solution.regime = Regime.PREDICTABLE if whole else Regime.UNDECIDED
        return
    solution.regime = Regime.PREDICTABLE
    period, since = repeats(case, solution.samples, solution.series_errors)
    if period:
        solution.regime, solution.period = Regime.PERIODIC, float(period)
        if math.isnan(solution.settled):
            solution.settled = since


def chaotic(case: Case, solution: Solution, search: Search) -> Solution:
    """Return a motion that cannot be foretold: one more run, for statistics over its revolutions.

    No error of a single course is claimed; averages have their statistical one.
    """
    horizon, ends = search.horizon, revolutions(case.settle, case.duration, case.turn)
    loosest = min(CHAOTIC_RTOL, case.rtol)
    for rtol in sorted({loosest, min(loosest, solution.rtol)}, reverse=True):
        now = attempt(case, rtol, search.left, case.output.keep == "series", Cuts(ends))
        now.horizon, now.settled, now.regime = horizon, solution.settled, Regime.CHAOTIC
        if now.reason or balanced(case, now):
            break
    if now.reason:
        return now
    if not balanced(case, now):
        return unbalanced(case, now, f"at rtol {now.rtol:.2g}")
    if case.wants_bars:
        estimate_errors(now)
        if now.turns:
            now.statistics = statistics(now.p, now.turns)
            now.bars = chaotic_bars(now.statistics, now.metrics)
        if over_promise(case, now) > 1.0 and case.targets:
            what = f"the motion is chaotic from {horizon / case.turn:.3g} revolutions on"
            return short_of(case, now, what)
    return now

"""Ever tighter runs of a case, until energy balances and what accuracy promises is kept."""

from compressor.cases import TIGHTEST, Case
from compressor.reasons import Reason
from compressor.solve.attempts import (
    Ahead,
    Solution,
    attempt,
    companion,
    estimate_errors,
    witness,
)
from compressor.solve.energy_audit import RUNGS, allowed, energy_residual
from compressor.solve.error_bars import ORDER, beyond, closeness, ratio_of, unmet
from compressor.solve.regime import DOUBTFUL, Search

OUT_OF_BUDGET = (
    Reason.BUDGET_STEPS,
    Reason.BUDGET_SECONDS,
    Reason.STEP_UNDERFLOW,
)  # a tighter run may end so
AIM = 0.7  # of what is allowed: where the next run's error is aimed at
LEAST, MOST = 10.0, 1000.0  # times tighter that the next run may be


def climb(case: Case, search: Search, ahead: Ahead) -> Solution:
    """Return the first run that balances and keeps its promise, or the last whole one as a failed
    job.

    A first run is compared with one a little tighter, and with a looser one, too, where the motion
    enlarges errors. Each further one is as much tighter as its errors are expected to need. It is
    compared with the one before and, where it seems to keep the promise, with one a little tighter
    as well. Where errors are as large as the numbers, twins tell whether the motion is chaotic;
    that ends the climb, and so does the budget of the search.
    """
    rtol = case.rtol
    best: Solution | None = None  # the last whole run
    before: Solution | None = (
        None  # the tightest one that balances, which the next is compared with
    )
    unsound = 0  # runs that did not balance
    while True:
        now = ahead.get(rtol) or attempt(
            search.within_budget(case), rtol, search.left, case.output.keep == "series"
        )
        if now.reason:
            return cut_short(case, best, now, search)
        search.count(now.trajectory)
        best = now
        if not balanced(case, now):
            unsound += 1
            if unsound > RUNGS or rtol < 9.9 * TIGHTEST:
                return unbalanced(case, now, f"at rtol {rtol:.2g}")
            rtol /= 10.0
            continue
        if not case.wants_bars:
            return now
        if before is None:
            other = companion(case, now, search.left, ahead)
            search.count(other.trajectory)
        else:
            other = before
        estimate_errors(now, other)
        excess, third = over_promise(case, now), None
        if excess <= 1.0:
            excess, third = recheck(case, now, other, before is None, search)
        if excess <= 1.0:
            now.promise = "kept" if promises(case) else "none"
            return now
        if lost(now) and search.look(whole=before is not None):
            return now
        if other.reason or min(rtol, other.rtol) < 1.01 * TIGHTEST:
            return short_of(case, now, other.detail or "no run is tighter")
        worse = third or other
        before = tightest(case, now, other, worse)
        rtol = max(short(before.rtol / further(excess, worse.rtol / now.rtol)), TIGHTEST)


def tightest(case: Case, now: Solution, *others: Solution) -> Solution:
    """Return the tightest of some runs that balances, and than which one can be tighter."""
    fit = [one for one in others if one.rtol > 1.01 * TIGHTEST and balanced(case, one)]
    return min([now, *fit], key=lambda run: run.rtol)


def recheck(
    case: Case, now: Solution, other: Solution, first: bool, search: Search
) -> tuple[float, Solution | None]:
    """Compare a run that seems to keep its promise with a third one, too; two may agree by chance.

    first: the run is the case's first, which needs a third one only where the motion enlarges
    errors. Returns the error over what is promised by the worse of both comparisons, and the third
    run where it is by that.
    """
    if first:
        third = witness(case, now, other, search.left)
    else:
        third = companion(case, now, search.left)
        if third.reason or third.rtol == other.rtol:
            third = None
    excess = over_promise(case, now)
    if third is None:
        return excess, None
    search.count(third.trajectory)
    estimate_errors(now, other, third)
    more = over_promise(case, now)
    return more, third if more > excess else None


def promises(case: Case) -> bool:
    """Return whether a case's accuracy promises an error, and not only sets a tolerance."""
    return case.wants_bars and case.solve.rtol is None


def over_promise(case: Case, solution: Solution) -> float:
    """Return the greatest estimated error over what accuracy promises; 0 where it promises
    nothing.
    """
    if case.targets:
        return max(
            beyond(solution.metrics[name], solution.bars[name]) / target
            for name, target in case.targets
        )
    return solution.series_errors["acceleration"] / case.promise if promises(case) else 0.0


def lost(solution: Solution) -> bool:
    """Return whether a run's acceleration is as far from another's as chaotic motions are."""
    return solution.series_errors["acceleration"] >= DOUBTFUL


def further(excess: float, ratio: float) -> float:
    """Return how many times tighter than both of a pair the next run is to be.

    excess: of the pair's estimate over what is promised; ratio: of their tolerances.
    """
    error = excess * max(ratio, 1.0 / ratio) ** -ORDER / closeness(ratio)
    return min(max(ratio_of(AIM / error), LEAST), MOST)


def short(rtol: float) -> float:
    """Return a tolerance that is told in two digits."""
    return float(f"{rtol:.1e}")


def balanced(case: Case, solution: Solution) -> bool:
    """Return whether the energy of a whole run balances as well as the case asks for."""
    return energy_residual(solution.trajectory.tally) <= allowed(
        case.rtol, case.duration / case.turn
    )


def cut_short(case: Case, best: Solution | None, now: Solution, search: Search) -> Solution:
    """Return what is left of a case whose present run did not reach its end."""
    if best is None or now.reason not in OUT_OF_BUDGET:
        return now
    detail = f"the next run: {search.limit_of(now.trajectory) or now.detail}"
    if not balanced(case, best):
        return unbalanced(case, best, detail, now.reason)
    return short_of(case, best, detail, now.reason)


def unbalanced(case: Case, best: Solution, detail: str, reason: str = "") -> Solution:
    """Return a whole run as a failed job: its series and energies are kept, its metrics are not."""
    residual = energy_residual(best.trajectory.tally)
    most = allowed(case.rtol, case.duration / case.turn)
    best.metrics, best.bars, best.series_errors = {}, {}, {}
    best.reversal, best.reversal_bars = {}, {}
    timed_out = reason == Reason.BUDGET_SECONDS
    best.reason = reason if timed_out else Reason.ENERGY_AUDIT_FAILED
    best.detail = f"energy residual {residual:.2g}, more than {most:.2g}; {detail}"
    return best


def short_of(case: Case, best: Solution, detail: str, reason: str = "") -> Solution:
    """Return a run with its errors as a failed job, since they are larger than promised."""
    timed_out = reason == Reason.BUDGET_SECONDS
    best.reason = reason if timed_out else Reason.ACCURACY_NOT_REACHED
    best.detail = "; ".join([*missed(case, best), f"at rtol {best.rtol:.2g}", detail])
    return best


def missed(case: Case, solution: Solution) -> list[str]:
    """Return what a run promised and does not keep, a message each."""
    if case.targets:
        return unmet(case.targets, solution.metrics, solution.bars)
    error = solution.series_errors["acceleration"]
    return [f"acceleration: its error may be {error:.2g} of it, not {case.promise:g}"]

"""Judge a run that says ok: is any number of it wrong, and do its error bars say so?

A run states its error by its error bars; it has passed its energy audit, or it would not
say ok (`compressor.solve.error_bars`). A number is wrong in silence where it lies farther from a
judge's than ten times its bar and than what the tolerance lets one expect: a thousand times rtol,
but 5 % at most, and of the time without contact 1e-4 of the span at least. The judge is another
integrator at a hundredth of the tolerance, not below 1e-12. Judges are run until two give the
same: one that agrees settles a scene, two that do not make it wrong, and so does one alone where no
other reaches the end; two that contradict each other leave it unjudged.

Numbers are comparable only as long as the motion can be foretold: until a run, shifted by 1e-9 of
the clearance, is 1 % of it away. A run that goes on beyond is judged twice. Cut to that horizon (in
sixteenths of the span), with error bars of its own, it is judged like any other; the whole of it by
statistics, at a tenth of the tolerance: rms values within 50 %, time without contact within a
quarter of the span, or ten bars again. Where no judge reaches the end within its budget, the first
quarter or sixteenth is judged instead.

The numbers of impacts and releases are not judged: contact that grazes begins any number of times.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from compressor.cases import TIGHTEST, Case
from compressor.metrics import METRICS
from compressor.physics import Column
from compressor.solve import (
    COMPILED,
    Solution,
    energy_residual,
    predictability_horizon,
    run_at_tolerance,
    solve,
)

SILENT_FACTOR = 10.0  # times its bar: an error beyond it is silent
EXPECTED, MAX_EXPECTED = 1e3, 0.05  # times rtol: the relative error that nobody is surprised by
TIGHTER, TENTH = 1e-2, 0.1  # a judge's tolerance, of statistics
PARTS = 16  # of a span, in which horizons are counted
LENGTHS = (PARTS, PARTS // 4, 1)  # parts that are judged where the whole is too much
JUDGED = tuple(name for name, row in METRICS.items() if not row.counted)
ABSOLUTE = ("contact_loss_fraction",)  # is a share: errors are not relative
RESOLVED = 1e-4  # of the span: steps resolve the time without contact no better
STATISTICS = {
    "rms_acceleration": 0.5,
    "rms_acceleration_deviation": 0.5,
    "contact_loss_fraction": 0.25,
}
STIFF = 8.0  # evaluations a step: more are the stiff partner's
MAX_SCIPY_STEPS = 2000  # steps: such a run SciPy's methods can judge
MORE_STEPS, MOST_STEPS = 5, 10**12  # times the run's budget: a judge's, and what a case may have
SECONDS, SCIPY_SECONDS = 30.0, 5.0  # that a judge may take, a compiled one and one of SciPy's


class Excess(NamedTuple):
    """The metric that is farthest beyond what may be expected of it, and how far.

    `ratio`: of the error to the greatest that is no silent one; `error` and `bar` are relative.
    """

    ratio: float
    metric: str
    error: float
    bar: float


NOTHING = Excess(math.nan, "", math.nan, math.nan)
Compare = Callable[[Solution, Solution], Excess]


@dataclass
class StressFinding:
    """What is found of one scene.

    `verdict`: ok, failed, silent_wrong or unjudged; `reason`: why a run failed, or no judge could
    decide; `by`: the judges run, those that did not reach the end in parentheses; `horizon`: parts
    of the span that can be foretold, and `judged` those that were judged by number, of PARTS;
    `apart`: how far the journals came apart from the judge's (`compressor.solve.error_bars`).
    """

    found: Solution
    seconds: float  # of the run with its error bars
    residual: float  # of its energy
    verdict: str = "unjudged"
    reason: str = ""
    detail: str = ""
    by: list[str] = field(default_factory=list)
    horizon: int = 0
    judged: int = 0
    apart: float = math.nan
    worst: Excess = NOTHING
    beyond: Excess = NOTHING


def judge(case: Case) -> StressFinding:
    """Run a case with error bars, and judge what it says."""
    began = time.perf_counter()
    found = solve(case)
    seconds, residual = time.perf_counter() - began, energy_residual(found.trajectory.tally)
    result = StressFinding(found, seconds, residual, reason=str(found.reason), detail=found.detail)
    if found.reason:
        result.verdict = "failed"
        return result
    result.horizon = horizon(case)
    if result.horizon:
        by_numbers(case, result)
    if result.horizon < PARTS and result.verdict != "silent_wrong":
        by_statistics(case, result)
    return result


def by_numbers(case: Case, result: StressFinding) -> None:
    """Judge the numbers up to the horizon, or of as much of it as a judge can do."""
    for parts in sorted({min(share, result.horizon) for share in LENGTHS}, reverse=True):
        claim = shorten_case(case, parts)
        found = result.found if parts == PARTS else solve(claim)
        if found.reason:
            result.detail = f"{found.reason} when cut to {parts}/{PARTS} of its span"
            continue
        verdict, result.worst, other = agreed_verdict(claim, found, compare, result)
        if other is not None:
            result.verdict, result.judged = verdict, parts
            result.reason = "judges_disagree" if verdict == "unjudged" else ""
            result.apart = journal_distance(found.p, found.samples, other.samples)
            return
    result.reason = "judges_fail"


def journal_distance(p: np.record, ours: np.ndarray, theirs: np.ndarray) -> float:
    """Return the greatest distance of the eccentricities of two runs, over the journals' room.

    ours, theirs: observed rows at the same times. A journal's room is its clearance, or how far it
    came if that is more. 0 for ideal joints.
    """
    places = slice(Column.ECCENTRICITY, Column.ECCENTRICITY + 4)
    one, other = (rows[:, places].reshape(-1, 2, 2) for rows in (ours, theirs))
    has_clearance = p["clearance"] > 0
    distance = np.linalg.norm(one - other, axis=2).max(axis=0)
    room = np.maximum(p["clearance"], np.linalg.norm(one, axis=2).max(axis=0))
    return float((distance[has_clearance] / room[has_clearance]).max(initial=0.0))


def by_statistics(case: Case, result: StressFinding) -> None:
    """Judge the whole of a run that goes beyond its horizon.

    There any other tolerance makes another motion: a tenth will do, and even the stiff partner may
    judge itself, if no other reaches the end.
    """
    verdict, result.beyond, other = agreed_verdict(case, result.found, compare_statistics, result)
    if verdict == "silent_wrong" or not result.horizon:
        result.verdict = verdict
        if verdict == "unjudged":
            result.reason = "judges_fail" if other is None else "judges_disagree"


def agreed_verdict(
    claim: Case, found: Solution, measured: Compare, result: StressFinding
) -> tuple[str, Excess, Solution | None]:
    """Return the verdict of a run's judges, by how much, and the run of the one that counts."""
    agreed: list[tuple[Excess, Solution]] = []
    dissent: list[tuple[Excess, Solution]] = []
    statistics = measured is compare_statistics
    for method in judges(found, statistics):
        rtol = tolerance(found.rtol, TENTH if statistics else TIGHTER)
        other = run_judge(claim, method, rtol, result)
        if other is None:
            continue
        excess = measured(found, other)
        (agreed if excess.ratio <= 1.0 else dissent).append((excess, other))
        # the first judge decides if it agrees; against one that dissents it takes two
        if len(agreed) > min(len(dissent), 1):
            return ("ok", *agreed[0])
        if len(dissent) == 2:
            break
    if len(dissent) > len(agreed):
        return ("silent_wrong", *dissent[0])
    return ("unjudged", *dissent[0]) if dissent else ("unjudged", NOTHING, None)


def judges(found: Solution, statistics: bool = False) -> tuple[str, ...]:
    """Return the methods to judge a run by, those that are least like its own first.

    Compiled ones share our step loop, SciPy's only the equations.
    """
    steps = found.trajectory.steps + found.trajectory.rejected
    stiff = found.trajectory.evaluations > STIFF * steps
    if stiff:
        return ("TSIT5", "LSODA", "RODAS" if statistics else "Radau")
    return (
        ("DOP853", "RODAS", "TSIT5") if steps <= MAX_SCIPY_STEPS else ("RODAS", "DOP853", "TSIT5")
    )


def tolerance(rtol: float, share: float = TIGHTER) -> float:
    """Return the tolerance of who judges a run."""
    return max(share * rtol, TIGHTEST)


def judge_steps(case: Case) -> int:
    """Return the budget of steps of who judges a run of a case."""
    return min(MORE_STEPS * case.solve.max_steps, MOST_STEPS)


def run_judge(case: Case, method: str, rtol: float, result: StressFinding) -> Solution | None:
    """Return a judge's run of a case, if it reaches its end."""
    seconds = SECONDS if method in COMPILED else SCIPY_SECONDS
    settings = replace(
        case.solve, method=method, rtol=rtol, accuracy="standard",
        max_steps=judge_steps(case),
    )  # fmt: skip
    other = run_at_tolerance(replace(case, solve=settings), rtol, seconds, True)
    result.by.append(f"({method})" if other.reason else method)
    return None if other.reason else other


def shorten_case(case: Case, parts: int) -> Case:
    """Return a case over the first parts of its span."""
    whole = float(case.solve.duration_rev or 0.0)
    return replace(case, solve=replace(case.solve, duration_rev=whole * parts / PARTS))


def compare(found: Solution, other: Solution) -> Excess:
    """Return the metric whose error is farthest beyond what the run states."""
    expected = min(EXPECTED * found.rtol, MAX_EXPECTED)
    least = {name: max(expected, RESOLVED if name in ABSOLUTE else 0.0) for name in JUDGED}
    return max(excess(name, found, other, least[name]) for name in JUDGED)


def compare_statistics(found: Solution, other: Solution) -> Excess:
    """Return the statistic whose error is farthest beyond its bound."""
    return max(excess(name, found, other, bound) for name, bound in STATISTICS.items())


def excess(name: str, found: Solution, other: Solution, least: float) -> Excess:
    """Return how far a metric is from a judge's, in multiples of what is allowed.

    Allowed are ten bars, or the least that counts if that is more. Error and bar are relative to
    the judge's size of the metric.
    """
    one = size(name, other.metrics)
    error = float(np.abs(found.metrics[name] - np.asarray(other.metrics[name])).max()) / one
    bar = float(np.max(found.bars[name])) / one
    return Excess(error / max(SILENT_FACTOR * bar, least), name, error, bar)


def size(name: str, metrics: dict[str, Any]) -> float:
    """Return the size to which errors of a metric are relative.

    It is the greatest value over joints and axes, or 1 where errors are absolute.
    """
    return 1.0 if name in ABSOLUTE else float(np.abs(metrics[name]).max()) or 1.0


def horizon(case: Case) -> int:
    """Return the parts of the span in which a shifted run stays close, as far as known."""
    patient = replace(case, solve=replace(case.solve, max_steps=judge_steps(case)))
    seconds = predictability_horizon(patient, SECONDS)
    return PARTS if seconds == math.inf else int(PARTS * seconds / case.duration)

"""Which regime a motion is in, and from which revolution on its metrics count.

A run that keeps a promise is predictable: two runs at different tolerances, each a motion started a
little elsewhere, stayed together to its end. Where errors stay as large as the numbers, a shifted
run (`compressor.solve.horizon`) tells an unpredictable motion from one that needs a tighter run.

From which revolution on metrics count, where a case leaves that to the program. A run is followed
revolution by revolution until the metrics of several in a row agree within what accuracy promises:
each with the one before, or with the one a period earlier.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from compressor.cases import ACCURACY, Case
from compressor.metrics import METRICS
from compressor.physics import merge_tallies
from compressor.solve.horizon import Search
from compressor.solve.request import SAME_TIME, Metrics, Trajectory, revolutions
from compressor.solve.run import Solution, is_sampled, output_times, run_at_tolerance
from compressor.solve.run_metrics import metrics
from compressor.solve.series import compared_per_rev, compared_times, distances
from compressor.solve.si_record import is_ideal, record

SAME_REVOLUTION = 1e-9  # relative distance of revolutions that rounding makes


def find_repetition(
    count: int, most: int, is_same: Callable[[int, int], bool], least: int = 1, more: int = 0
) -> tuple[int, int] | None:
    """Return the revolution from which on a motion repeats itself, and its shortest period.

    count: revolutions of the motion; is_same: takes the number of a revolution and a period, and
    returns whether the one a period later is the same. As many revolutions as a period and `more`,
    and at least `least`, must be the same. None where no period up to `most` does.
    """
    for period in range(1, most + 1):
        first = count - period - max(least, period + more)
        if first >= 0 and all(is_same(k, period) for k in range(first, count - period)):
            return first, period
    return None


def repeats(
    case: Case, samples: np.ndarray, errors: Metrics
) -> tuple[int, float] | tuple[None, float]:
    """Return the period of a motion (rev), and the revolution from which on it repeats itself.

    samples: observed rows at the times of `compressor.solve.series.compared_times`. Revolutions
    are the same if no series is farther apart than both its errors. None and nan where the settled
    part is too short, or does not repeat itself.
    """
    per_rev = compared_per_rev(case)
    count = len(samples) // per_rev if per_rev else 0
    turns = [samples[k * per_rev : (k + 1) * per_rev] for k in range(count)]

    def is_same(k: int, period: int) -> bool:
        return all(
            (distance <= 2.0 * np.asarray(errors[name]) + SAME_REVOLUTION).all()
            for name, distance in distances(turns[k], turns[k + period]).items()
        )

    repetition = find_repetition(count, count // 2, is_same)
    if repetition is None:
        return None, math.nan
    first, period = repetition
    while first > 0 and is_same(first - 1, period):
        first -= 1
    return period, case.settle / case.turn + first


MEASURED_REV = 3  # revolutions after settling with `duration_rev: auto`: as the default's
MAX_PERIOD_REV = 4  # rev: period that is looked for
AGREEMENTS = 2  # revolutions in a row, at least, that are to agree with earlier ones
SAMPLED_REV = 6.001  # rev: of a motion that settles later the run is made again, with samples
LOOKED_AT = 2 * MAX_PERIOD_REV  # revolutions, the last ones, by which that is seen


def find_span(search: Search) -> Solution | None:
    """Give the search's case numbers for `settle_rev: auto` and `duration_rev: auto`.

    Within the case's wall time; what is known of where it settles is kept in the search. Return the
    run of the case by which that was found, if it is one.
    """
    case = search.case
    if case.solve.settle_rev != "auto":
        search.case = with_settle_rev(case, float(case.solve.settle_rev), 1)
        search.period = 1.0 if is_ideal(case) else math.nan
        return None
    if is_ideal(case):  # a function of the crank angle
        search.case, search.settled, search.period = with_settle_rev(case, 0.0, 1), 0.0, 1.0
        return None
    max_revolutions = int(case.duration / case.turn * (1 + 1e-12))
    ends_settled = case.solve.duration_rev == "auto"
    longest = with_settle_rev(case, 0.0, 1, float(max_revolutions) if ends_settled else None)
    p, within = record(case), least_promise(case)
    turns: list[Metrics] = []
    found: list[tuple[int, int]] = []

    def is_settled(run: Trajectory) -> bool:
        """Note the revolution that has ended, and where the last ones agree for the first time."""
        turns.append(metrics(p, run.turns[-1]))
        if not found and (last := steady(turns[-LOOKED_AT:], within)):
            found.append((last[0] + max(0, len(turns) - LOOKED_AT), last[1]))
        return bool(found) and ends_settled

    run = run_at_tolerance(
        longest, case.rtol, search.left, is_sampled(case),
        cuts=revolutions(0.0, longest.duration, case.turn), enough=is_settled,
        sampled_until=SAMPLED_REV * case.turn if ends_settled else math.inf,
    )  # fmt: skip
    if not found:
        half = float(max_revolutions // 2)
        search.case = with_settle_rev(case, half, 1, float(max_revolutions))
        search.unsettled = (
            f"in {max_revolutions} revolutions no {AGREEMENTS + 1} agree within {within:.2g}"
        )
        return None
    first, period = found[0]
    search.settled, search.period = float(first), float(period)
    search.case = with_settle_rev(case, search.settled, period)
    return settled_part(run, longest, search.case)


def settled_part(run: Solution, longest: Case, case: Case) -> Solution | None:
    """Return a run of the longest span as that of a case whose metrics count later.

    None where it is of other times than the case's, or stopped.
    """
    times, trajectory = output_times(case, is_sampled(case)), run.trajectory
    first, last = (round(time / case.turn) for time in (case.settle, case.duration))
    count, per_rev = times.size, compared_per_rev(case)
    output = trajectory.times[:count] if is_sampled(case) else times
    same = output.size == count and np.allclose(output, times, rtol=1e-12)
    ends_whole = abs(case.duration - last * case.turn) < SAME_TIME * case.duration
    if run.reason or not same or not ends_whole or per_rev != compared_per_rev(longest):
        return None
    states, phases = trajectory.states[:count].copy(), trajectory.phases[:count].copy()
    states[-1] = trajectory.turn_states[last - 1]
    segment = np.searchsorted(trajectory.edges, case.duration * (1.0 - SAME_TIME)) - 1
    phases[-1] = trajectory.edge_phases[segment]
    tally = merge_tallies(trajectory.turns[first:last])
    part = replace(trajectory, times=output, states=states, phases=phases, tally=tally, turns=[])
    begin = first * per_rev
    samples = run.samples[begin : begin + compared_times(case).size]
    numbers = metrics(run.p, tally)
    return replace(run, trajectory=part, settle=case.settle, metrics=numbers, samples=samples)


def with_settle_rev(case: Case, settle: float, period: int, duration: float | None = None) -> Case:
    """Return a case that settles at a number (rev), with a number also for `duration_rev: auto`.

    period (rev): whole ones are measured; duration (rev): in place of the case's.
    """
    if duration is None and case.solve.duration_rev == "auto":
        duration = settle + period * math.ceil(MEASURED_REV / period)
    if duration is None and settle == case.solve.settle_rev:
        return case
    settings = replace(case.solve, settle_rev=settle)
    if duration is not None:
        steps = case.steps * duration * case.turn / case.duration
        settings = replace(settings, duration_rev=duration, duration_s=None)
        if settings.output_step_s is None:
            settings = replace(settings, output_step_deg=360.0 * duration / round(steps))
    return replace(case, solve=settings)


def least_promise(case: Case) -> float:
    """Return the relative error that a case's accuracy promises: the least of several.

    Of a case that promises none it is that of `standard`.
    """
    if case.targets:
        return min(target for _, target in case.targets)
    return case.promise if math.isfinite(case.promise) else ACCURACY["standard"].promise


def steady(turns: Sequence[Metrics], within: float) -> tuple[int, int] | None:
    """Return the first of the last revolutions that agree, and their period (rev), or None.

    turns: metrics of each revolution; within: the relative difference that agreement allows.
    """

    def is_same(k: int, period: int) -> bool:
        return agree(turns[k], turns[k + period], within)

    return find_repetition(len(turns), MAX_PERIOD_REV, is_same, AGREEMENTS)


def agree(one: Metrics, other: Metrics, within: float) -> bool:
    """Return whether the metrics of two revolutions differ by less than a share.

    Forces by axis are compared with the joint's greatest.
    """
    for name, row in METRICS.items():
        if not row.bar.relative:
            continue
        difference, size = np.abs(np.subtract(one[name], other[name])), np.abs(one[name])
        if "axis" in row.dims:
            size = size.max(axis=-1, keepdims=True)
        if not (difference <= within * size).all():
            return False
    return True

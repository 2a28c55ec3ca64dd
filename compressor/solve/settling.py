"""From which revolution on metrics count, where a case leaves that to the program.

A run is followed revolution by revolution until the metrics of several in a row agree within what
accuracy promises: each with the one before, or with the one a period earlier.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compressor.cases import ACCURACY, Case
from compressor.metrics import METRICS
from compressor.solve.attempts import attempt
from compressor.solve.error_bars import Metrics
from compressor.solve.regime import Search
from compressor.solve.si_record import is_ideal, record
from compressor.solve.tallied import metrics
from compressor.solve.turns import Cuts, Turns, revolutions

MEASURED = 3  # revolutions after settling with `duration_rev: auto`: as the default's
LONGEST = 4  # rev: period that is looked for
AGREEMENTS = 2  # revolutions in a row, at least, that are to agree with earlier ones


@dataclass(frozen=True)
class Settling:
    """A case with numbers for its span, and what is known of where it settles.

    `settled` (rev): nan where it was not looked for, or not found; `detail`: why it was not found.
    """

    case: Case
    settled: float = math.nan
    detail: str = ""


def with_span(case: Case, search: Search) -> Settling:
    """Give numbers to `settle_rev: auto` and `duration_rev: auto`, within the case's wall time."""
    if case.solve.settle_rev != "auto":
        return Settling(spanned(case, float(case.solve.settle_rev), 1))
    if is_ideal(case):
        return Settling(spanned(case, 0.0, 1), 0.0)
    most = int(case.duration / case.turn * (1 + 1e-12))
    p, within = record(case), least_promise(case)

    def enough(turns: Turns) -> bool:
        return steady([metrics(p, turn) for turn in turns], within) is not None

    scout = spanned(case, 0.0, 1, float(most))
    scout = replace(scout, solve=replace(scout.solve, error_bars=False, accuracy="standard"))
    cuts = Cuts(revolutions(0.0, scout.duration, case.turn), enough)
    attempt(scout, case.rtol, search.left, False, cuts)
    each = [metrics(p, turn) for turn in cuts.turns]
    found = steady(each, within)
    if found is None:
        half = float(most // 2)
        text = f"in {most} revolutions no {AGREEMENTS + 1} agree within {within:.2g}"
        return Settling(spanned(case, half, 1, float(most)), math.nan, text)
    first, period = found
    return Settling(spanned(case, float(first), period), float(first))


def spanned(case: Case, settle: float, period: int, duration: float | None = None) -> Case:
    """Return a case with a number for where it settles (rev), and for its duration where that is a
    word.

    period (rev): of which whole ones are measured; duration (rev): in place of the case's.
    """
    if duration is None and case.solve.duration_rev == "auto":
        duration = settle + period * math.ceil(MEASURED / period)
    if duration is None and settle == case.solve.settle_rev:
        return case
    how = replace(case.solve, settle_rev=settle)
    if duration is not None:
        steps = case.steps * duration * case.turn / case.duration
        how = replace(how, duration_rev=duration, duration_s=None)
        if how.output_step_s is None:
            how = replace(how, output_step_deg=360.0 * duration / round(steps))
    return replace(case, solve=how)


def least_promise(case: Case) -> float:
    """Return the relative error that a case's accuracy promises; of one that promises none,
    standard's.
    """
    if case.targets:
        return min(target for _, target in case.targets)
    return case.promise if math.isfinite(case.promise) else ACCURACY["standard"].promise


def steady(turns: Sequence[Metrics], within: float) -> tuple[int, int] | None:
    """Return the first of the last revolutions that agree, and their period; None where they do
    not.
    """
    for period in range(1, LONGEST + 1):
        needed = max(AGREEMENTS, period)
        first = len(turns) - needed - period
        if first >= 0 and all(
            agree(turns[k], turns[k + period], within) for k in range(first, first + needed)
        ):
            return first, period
    return None


def agree(one: Metrics, other: Metrics, within: float) -> bool:
    """Return whether the metrics of two revolutions differ by less than a share; forces by the
    joint's.
    """
    for name, row in METRICS.items():
        if not row.bar.relative:
            continue
        away, size = np.abs(np.subtract(one[name], other[name])), np.abs(one[name])
        if "axis" in row.dims:
            size = size.max(axis=-1, keepdims=True)
        if not (away <= within * size).all():
            return False
    return True

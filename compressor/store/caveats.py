"""What stored numbers cannot say of themselves, a sentence each, from stored values alone.

Motions that were not seen to repeat, or settled after metrics began to count, clipped sensor
records, and cases outside the range that the program was judged on.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from compressor.cases import Case, Sensor, outside_judged, paper_notes, points, value_of
from compressor.outcome import Regime
from compressor.store.stored import Stored
from compressor.store.studies import StoredStudy

MAX_LOOKED_AT = 16  # stored jobs of a study, for what only their cases show: a millisecond each
UNREPEATED = (
    "the motion was not seen to repeat; a longer run may give other numbers, or be chaotic; "
    "solve: {settle_rev: auto, duration_rev: auto} waits for that"
)
LATE = (
    "the motion settled after solve.settle_rev, with start-up in the metrics; "
    "solve.settle_rev: auto leaves it out"
)
CLIPPED = "the sensor's record is clipped, {share} % of its samples: raise sensor.range_m_per_s2"


def study_caveats(stored: Stored, study: StoredStudy) -> list[str]:
    """Return what to know of a study's finished jobs beside their numbers, a sentence each."""
    positions = stored.find(study.keys)
    positions = positions[positions >= 0]
    some = np.linspace(0, positions.size - 1, min(MAX_LOOKED_AT, positions.size)).astype(int)
    cases = [case for at in positions[some].tolist() if (case := stored.case_at(at))]
    return [*run_caveats(stored, study), *_of_cases(cases)]


def run_caveats(stored: Stored, study: StoredStudy) -> list[str]:
    """Return the caveats of runs alone: of repetition, and of clipped sensor records."""
    fixed = value_of(study.fixed, "solve.settle_rev")
    begins = [point.get("solve.settle_rev", fixed) for point in points(study)]
    return _of_runs(stored, stored.find(study.keys), begins)


def job_caveats(stored: Stored, position: int) -> list[str]:
    """Return what to know of a job that is ok beside its numbers, a sentence each."""
    case = stored.case_at(position)
    if case is None:
        return []  # of another version of the program
    return [*_of_runs(stored, np.array([position]), [case.solve.settle_rev]), *_of_cases([case])]


def _of_runs(stored: Stored, positions: np.ndarray, begins: Sequence[Any]) -> list[str]:
    """Return the caveats of those of some jobs that are ok; begins: solve.settle_rev of each."""
    there = positions >= 0
    there[there] = stored.columns["status"][positions[there]] == b"ok"
    positions = positions[there]
    if not positions.size:
        return []
    numbers = stored.numbers(positions, ("settled_rev", "clipped_fraction"))
    begin = np.array([b if isinstance(b, int | float) else math.nan for b in begins], float)[there]
    regimes = stored.columns["regime"][positions].astype(str)
    return describe_runs(regimes, numbers["settled_rev"], begin, numbers["clipped_fraction"])


def describe_runs(
    regimes: np.ndarray, settled: np.ndarray, begin: np.ndarray, shares: np.ndarray
) -> list[str]:
    """Return what to know of runs that are ok, a sentence for those that it is true of.

    regimes, (jobs,) as all of these; settled: rev from which a motion repeats, also where `auto`
    found that; begin: rev from which metrics count; shares: of clipped samples. nan: not known.
    """
    clipped = shares >= Sensor.REPORTED
    worst = 100 * np.max(shares, where=clipped, initial=0.0)
    texts = (
        ((regimes == Regime.PREDICTABLE) & np.isnan(settled), UNREPEATED),
        ((regimes == Regime.PERIODIC) & (settled > begin), LATE),
        (clipped, CLIPPED.format(share=f"at worst {worst:.3g}")),
    )
    jobs = len(regimes)
    return [
        text if jobs == 1 else f"{some.sum()} of {jobs} jobs: {text}"
        for some, text in texts
        if some.any()
    ]


def _of_cases(cases: Iterable[Case]) -> list[str]:
    """Return what the paper and the judged ranges say of cases, each key once."""
    notes: dict[str, str] = {}
    outside: dict[str, str] = {}
    for case in cases:
        notes |= paper_notes(case)
        outside |= outside_judged(case.values())
    return [f"{key}: {text}" for key, text in (*notes.items(), *outside.items())]

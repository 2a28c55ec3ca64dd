"""What stored numbers cannot say of themselves, a sentence each, from stored values alone.

Motions that were not seen to repeat, settled after metrics began to count, or depend on how they
began; clipped sensor records, and cases outside the range that the program was judged on.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from compressor.cases import (
    CYLINDRICAL,
    READ_BY,
    Case,
    Sensor,
    outside_judged,
    paper_notes,
    points,
    value_of,
)
from compressor.outcome import Regime
from compressor.store.stored import Stored
from compressor.store.studies import StoredStudy

MAX_LOOKED_AT = 16  # stored jobs of a study, for what only their cases show: a millisecond each
UNREPEATED = (
    "the motion was not seen to repeat within its error bars, which finer accuracy narrows; a "
    "longer run may give other numbers, or be chaotic; solve: {settle_rev: auto, duration_rev: "
    "auto} waits for that"
)
LATE = (
    "the motion settled after solve.settle_rev, with start-up in the metrics; "
    "solve.settle_rev: auto leaves it out"
)
REMEMBERED = (
    "journal and bore never part after settling, so that contact.law damps by the speed of an "
    "impact of the start-up: numbers depend on how the run began (compare initial_offset_mm); "
    "contact.law: impact has no such memory"
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
    """Return the caveats of runs alone: of repetition, start-up and clipped sensor records."""
    fixed = {key: value_of(study.fixed, key) for key in READ_OF_CASE}
    each = [{**fixed, **{key: it for key, it in point.items() if key in fixed}}
            for point in points(study)]  # fmt: skip
    return _of_runs(stored, stored.find(study.keys), each)


def job_caveats(stored: Stored, position: int) -> list[str]:
    """Return what to know of a job that is ok beside its numbers, a sentence each."""
    case = stored.case_at(position)
    if case is None:
        return []  # of another version of the program
    values = {key: value_of(case, key) for key in READ_OF_CASE}
    return [*_of_runs(stored, np.array([position]), [values]), *_of_cases([case])]


# keys of a case that caveats of runs are by
READ_OF_CASE = ("solve.settle_rev", "contact.law", "contact.restitution")


def _of_runs(stored: Stored, positions: np.ndarray, each: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the caveats of those of some jobs that are ok; each: `READ_OF_CASE` of a job."""
    there = positions >= 0
    there[there] = stored.columns["status"][positions[there]] == b"ok"
    positions, each = positions[there], [one for one, ok in zip(each, there, strict=True) if ok]
    if not positions.size:
        return []
    names = ("settled_rev", "clipped_fraction", "contact_loss_fraction", "max_penetration")
    numbers = stored.numbers(positions, names)
    begins = [one["solve.settle_rev"] for one in each]
    begin = np.array([b if isinstance(b, int | float) else math.nan for b in begins], float)
    remembering = [has_memory(one["contact.law"], one["contact.restitution"]) for one in each]
    touches = (numbers["max_penetration"] > 0.0) & (numbers["contact_loss_fraction"] == 0.0)
    regimes = stored.columns["regime"][positions].astype(str)
    return describe_runs(
        regimes, numbers["settled_rev"], begin, numbers["clipped_fraction"],
        np.array(remembering) & touches.any(axis=1),
    )  # fmt: skip


def has_memory(law: str, restitution: float | None) -> bool:
    """Return whether a law of contact damps by the speed at which journal and bore last met."""
    is_elastic = law in CYLINDRICAL and restitution is None
    return law in READ_BY["contact"]["restitution"] and not is_elastic


def describe_runs(
    regimes: np.ndarray, settled: np.ndarray, begin: np.ndarray, shares: np.ndarray,
    remembering: np.ndarray,
) -> list[str]:  # fmt: skip
    """Return what to know of runs that are ok, a sentence for those that it is true of.

    regimes, (jobs,) as all of these; settled: rev from which a motion repeats, also where `auto`
    found that; begin: rev from which metrics count; shares: of clipped samples; remembering:
    whether a law damps by an impact before that. nan: not known.
    """
    clipped = shares >= Sensor.REPORTED
    worst = 100 * np.max(shares, where=clipped, initial=0.0)
    texts = (
        ((regimes == Regime.PREDICTABLE) & np.isnan(settled), UNREPEATED),
        ((regimes == Regime.PERIODIC) & (settled > begin), LATE),
        (remembering, REMEMBERED),
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
        outside |= outside_judged(case)
    return [f"{key}: {text}" for key, text in (*notes.items(), *outside.items())]

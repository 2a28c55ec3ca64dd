"""What stored numbers cannot say of themselves: how far to trust them, in sentences.

Of motions that were not seen to repeat, or settled after metrics began to count; of clipped sensor
records; of cases outside the range that the program was judged on. From stored values alone, so
that older stores answer as far as they have them.
"""

import copy
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from compressor.cases import (
    Case,
    CaseError,
    Sensor,
    outside_judged,
    points,
    stands_for,
    value_in,
)
from compressor.outcome import Regime
from compressor.store.rows import Rows
from compressor.store.studies import StoredStudy

AUTO = "solve: {settle_rev: auto, duration_rev: auto} waits for that"
LONGER = "a longer run may give other numbers, or be chaotic"


def study_caveats(rows: Rows, study: StoredStudy) -> list[str]:
    """Return what to know of a study's finished jobs beside their numbers, a sentence each."""
    return [
        *run_caveats(rows, study),
        *(f"{key}: {text}" for key, text in _outside_of_study(study).items()),
    ]


def run_caveats(rows: Rows, study: StoredStudy) -> list[str]:
    """Return what only a run can tell of a study: motions not seen to repeat, clipped records."""
    positions = rows.find(study.keys)
    there = positions >= 0
    there[there] = rows.words["status"][positions[there]] == "ok"
    positions = positions[there]
    if not positions.size:
        return []
    numbers, regimes = rows.course[positions], rows.words["regime"][positions]
    settle = np.array(_settle_revs(study), float)[there]
    unrepeated = is_unrepeated(regimes, numbers["settled_rev"])
    late = is_late(regimes, numbers["settled_rev"], settle)
    return [
        *_of_repetition(int(unrepeated.sum()), int(late.sum()), positions.size),
        *_of_clipping(numbers["clipped_fraction"]),
    ]


def is_unrepeated(regime: Any, settled: Any) -> Any:
    """Return whether motions were not seen to repeat; settled (rev): also where `auto` found it."""
    return (np.asarray(regime) == Regime.PREDICTABLE) & np.isnan(settled)


def is_late(regime: Any, settled: Any, settle: Any) -> Any:
    """Return whether periodic motions settled after metrics began to count, at `settle` (rev)."""
    return (np.asarray(regime) == Regime.PERIODIC) & (np.asarray(settled) > settle)


def job_caveats(numbers: Mapping[str, Any], attributes: Mapping[str, Any]) -> list[str]:
    """Return what to know of a job that is ok beside its numbers, a sentence each.

    numbers, attributes: as a row of a store has them.
    """
    regime = attributes.get("regime", "")
    settled, clipped = (
        float(numbers.get(name, math.nan)) for name in ("settled_rev", "clipped_fraction")
    )
    try:
        case = Case.from_attribute(attributes["case"])
    except (KeyError, CaseError):
        return []  # of another version of the program
    found = []
    begin = math.nan if case.solve.settle_rev == "auto" else float(case.solve.settle_rev)
    if is_unrepeated(regime, settled):
        within = "its settled revolutions"
        if case.solve.duration_rev != "auto":
            count = (case.duration - case.settle) / case.turn
            within = f"{count:.3g} settled revolution{'s' * (round(count, 9) != 1)}"
        found.append(f"the motion was not seen to repeat within {within}; {LONGER}; {AUTO}")
    if is_late(regime, settled, begin):
        found.append(
            f"the motion repeats from revolution {settled:g} on, and metrics count from "
            f"{begin:g} on: start-up is in them; solve.settle_rev: auto leaves it out"
        )
    if case.sensor and (text := case.sensor.report_clipping(clipped)):
        found.append(text)
    return [*found, *(f"{key}: {text}" for key, text in outside_judged(case.values()).items())]


def _of_repetition(unrepeated: int, late: int, jobs: int) -> Iterator[str]:
    """Yield what is said of motions that did not repeat, and of those that did too late."""
    parts = [f"{unrepeated} of {jobs} jobs were not seen to repeat"] if unrepeated else []
    if late:
        start = "" if unrepeated else f" of {jobs} jobs"
        parts.append(
            f"{late}{start} settled after solve.settle_rev, with start-up in their numbers"
        )
    if parts:
        yield f"{'; '.join(parts)}; {LONGER}; {AUTO}"


def _of_clipping(fractions: np.ndarray) -> Iterator[str]:
    """Yield what is said of sensor records of which a thousandth or more is clipped."""
    known = fractions[~np.isnan(fractions)]
    clipped = known[known >= Sensor.REPORTED]
    if clipped.size:
        yield (
            f"{clipped.size} of {known.size} sensor records are clipped, at worst "
            f"{100 * clipped.max():.3g} % of their samples: raise sensor.range_m_per_s2"
        )


def _settle_revs(study: StoredStudy) -> list[float]:
    """Return the revolution at which metrics of each job begin to count; nan where that is
    `auto`.
    """
    fixed = value_in(study.fixed, "solve.settle_rev")
    given = (point.get("solve.settle_rev", fixed) for point in points(study))
    return [float(v) if isinstance(v, int | float) else math.nan for v in given]


def _outside_of_study(study: StoredStudy) -> dict[str, str]:
    """Return the judged keys that a study leaves, each with a sentence: of fixed values and
    axes' ends.
    """
    base = copy.deepcopy(study.fixed)
    ends: list[tuple[str, Any]] = []
    for axis in study.axes:
        values = [v for v in axis.values if isinstance(v, int | float)]
        ends += [(axis.key, end) for end in ({min(values), max(values)} if values else ())]
        if axis.key == "joint":
            base["joint"] = next((v for v in axis.values if v != "none"), "none")
    found = outside_judged(base)
    for key, value in sorted(ends):
        for part in stands_for(key) or (key,):
            group, _, name = part.rpartition(".")
            if group:
                changed = {group: (base.get(group) or {}) | {name: value}}
                found |= outside_judged(base | changed)
    return found

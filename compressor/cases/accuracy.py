"""Accuracy as it may be asked for: in words that promise, or in numbers by metric.

Tolerances come from the measured trade of tests/results/accuracy.json (make accuracy), for
`method: auto`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from compressor.cases.parameter import Parameter, Problem
from compressor.metrics import METRICS


@dataclass(frozen=True)
class Tier:
    """What a word stands for: a relative tolerance, and the error of acceleration it promises.

    `promise` is a relative L2 error, `peak` that of the greatest acceleration; the nine paper
    cases keep them, and at least 95 % of the random cases of tests/campaigns/random_cases.py.
    """

    rtol: float
    promise: float
    peak: float


ACCURACY = {
    "draft": Tier(2e-5, 2e-2, 2e-2),
    "standard": Tier(4e-6, 5e-3, 5e-3),
    "fine": Tier(1e-8, 1e-4, 1e-4),
    "reference": Tier(5e-11, 1e-6, 1e-6),
}
# Accuracy by number: a ladder of runs, each ten times tighter than the one before. Bars at rtol
# are some ten rtol in the median of the random cases, so that a ladder which begins at the error
# asked for is likely to end at its second run; looser than its first rung no bar can be trusted.
LOOSEST, TIGHTEST = 2e-4, 1e-12

TARGET = Parameter("", "", None, 1e-9, 0.5, True, "", "", "number")

Targets = tuple[tuple[str, float], ...]  # (metric, greatest relative error), by name


def first_rung(targets: Targets) -> float:
    """The tolerance at which a ladder begins."""
    return min(LOOSEST, *(target for _, target in targets))


def checked_targets(key: str, value: Mapping[Any, Any], problems: list[Problem]) -> Targets:
    """Accuracy by number as a case holds it; what is wrong with it joins `problems`."""
    if not value:
        problems.append(Problem(key, "needs a metric, such as {peak_acceleration: 0.01}"))
    good = []
    for name, target in value.items():
        if name not in METRICS:
            near = get_close_matches(str(name), METRICS, n=1)
            hint = f"did you mean {near[0]}?" if near else "metrics are " + ", ".join(METRICS)
            problems.append(Problem(f"{key}.{name}", f"unknown metric; {hint}"))
        elif message := TARGET.check(target):
            problems.append(Problem(f"{key}.{name}", message))
        else:
            good.append((name, float(target)))
    return tuple(sorted(good))

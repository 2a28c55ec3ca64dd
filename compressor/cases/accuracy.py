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
    """What a word stands for: the error that it promises, and the tolerance of the first run.

    `promise`: relative L2 error of acceleration after settling. `rtol` decides what a run costs,
    not what it keeps.
    """

    rtol: float
    promise: float


ACCURACY = {
    "draft": Tier(1e-5, 2e-2),
    "standard": Tier(1e-6, 5e-3),
    "fine": Tier(1e-8, 1e-4),
    "reference": Tier(5e-11, 1e-6),
}
LOOSEST, TIGHTEST = 2e-4, 1e-12  # of first runs for accuracy by number, and of any run for it
FIRST = 0.01  # of the error asked for: the first tolerance. Bars are some 26 rtol in the median

TARGET = Parameter("", "", None, 1e-9, 0.5, True, "", "", "number")

Targets = tuple[tuple[str, float], ...]  # (metric, greatest relative error), by name


def first_rung(targets: Targets) -> float:
    """Return the tolerance of the first run where accuracy is asked for by number."""
    return min(LOOSEST, *(FIRST * target for _, target in targets))


def checked_targets(key: str, value: Mapping[Any, Any], problems: list[Problem]) -> Targets:
    """Return the accuracy by number as a case holds it; what is wrong with it joins `problems`."""
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

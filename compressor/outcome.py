"""What is known of a finished job, without physics or compiled code.

So that results are read without loading either; the numbers' names and units are those of
`compressor.metrics`.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from compressor.metrics import AXES, JOINTS, NUMBERS, QUANTILES, SEGMENTS, SIZES, THRESHOLDS
from compressor.program import PROGRAM

# a job's numbers as one structured scalar
ROW = np.dtype(
    [(name, "f8", tuple(SIZES[dim] for dim in row.dims)) for name, row in NUMBERS.items()]
)
ABSCISSAE = ("time", "crank_angle")  # stay double: their steps are what matters


def row() -> np.void:
    """Return a job's numbers, nan, to be written."""
    return np.full(1, math.nan, ROW)[0]


class Regime(StrEnum):
    """How far a motion is predictable, in `REGIME_WORDS`; a run that was not examined has none."""

    PREDICTABLE = "predictable"
    PERIODIC = "periodic"
    CHAOTIC = "chaotic"
    UNDECIDED = "undecided"


# the one source of what a regime means, wherever one is shown
REGIME_WORDS = {
    Regime.PERIODIC: "repeats within its error bars, or with auto within the accuracy target",
    Regime.PREDICTABLE: "errors do not grow up to the run's end; not seen to repeat",
    Regime.CHAOTIC: "close motions separate: averages are valid, single peaks are not",
    Regime.UNDECIDED: "errors are large, and the search for chaos reached its limit",
}


def regime_words(regime: str) -> str:
    """Return a regime with what it means, as `periodic (repeats ...)`; another word as it is."""
    return f"{regime} ({REGIME_WORDS[Regime(regime)]})" if regime in REGIME_WORDS else regime


@dataclass(frozen=True)
class Outcome:
    """How a job ended.

    `numbers`: a scalar of dtype ROW, metrics nan where the run did not reach its end; `reason`: a
    stable name, empty when ok; `attributes`: those of the job's Dataset, its `key` among them;
    `series`: the time series that are to be stored, {} where none are.
    """

    status: str
    reason: str
    numbers: np.void
    attributes: dict[str, Any]
    series: "dict[str, Variable]" = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Return the job's identity."""
        return str(self.attributes["key"])

    @property
    def detail(self) -> str:
        """Return what is known of a failure beyond its reason."""
        return str(self.attributes.get("detail", ""))

    def with_series(self, variables: Mapping[str, tuple], precision: str) -> "Outcome":
        """Return this outcome with time series to be stored, in single or double precision."""
        series = {}
        for name, (dims, values, attrs) in variables.items():
            is_exact = precision == "double" or "time" not in dims or name in ABSCISSAE
            series[name] = Variable(dims, np.asarray(values, float if is_exact else "f4"), attrs)
        return replace(self, series=series)

    def table(self, more: Mapping[str, tuple]) -> "dict[str, Variable]":
        """Return the variables of the job's Dataset: words, numbers, and more of them.

        What only some jobs have is absent where it is nan, as statistics of a motion that is not
        chaotic.
        """
        found: dict[str, tuple] = {
            name: ((), text, {"long_name": JOB_WORDS[name]}) for name, text in self.words().items()
        }
        for (name, metric), value in zip(NUMBERS.items(), self.numbers.item(), strict=True):
            if metric.is_given(np.asarray(value)):
                found[name] = (metric.dims, value, metric.attributes)
        found |= more
        found |= coordinates(dim for dims, _, _ in found.values() for dim in dims)
        return {
            name: Variable(dims, np.asarray(values), attrs)
            for name, (dims, values, attrs) in found.items()
        }

    def words(self) -> dict[str, str]:
        """Return what is said of the job in a word each, by `JOB_WORDS`."""
        ends = {"status": self.status, "reason": self.reason}
        return ends | {name: str(self.attributes.get(name, "")) for name in ("promise", "regime")}


# words on a job, as variables of its Dataset, with what they mean
JOB_WORDS = {
    "status": "ok, failed or missing",
    "reason": "why a run failed",
    "promise": "kept: the accuracy target was reached; none: no target, or a chaotic motion",
    "regime": "; ".join(map(regime_words, Regime)),
}


def without_run(attributes: Mapping[str, Any], reason: str, detail: str, **more: Any) -> Outcome:
    """Return the outcome of a job that has no run: it failed, and all its numbers are nan.

    `attributes`: those of its case (`Case.attributes`); `more`: other attributes.
    """
    whole = {**attributes, "complete": 0, "program": PROGRAM, "detail": detail} | more
    return Outcome("failed", str(reason), row(), whole)


class Variable(NamedTuple):
    """A variable as xarray has it: names of its dimensions, values, attributes."""

    dims: tuple[str, ...]
    values: np.ndarray
    attrs: dict[str, Any]


def coordinates(used: Iterable[Any] = SIZES) -> dict[str, tuple]:
    """Return the coordinates of joint, axis and the dimensions used, as xarray variables."""
    wanted = {"joint", "axis", *used}
    every = {
        "joint": (("joint",), list(JOINTS), {"long_name": "joint of the rod"}),
        "axis": (("axis",), list(AXES), {"long_name": "direction; x along the cylinder, y up"}),
        "quantile": (("quantile",), list(QUANTILES), {"long_name": "share of values below"}),
        "segment": (
            ("segment",), list(SEGMENTS),
            {"units": "deg", "long_name": "crank angle at which a segment of 10 degrees begins"},
        ),
        "threshold": (("threshold",), list(THRESHOLDS), {"long_name": "threshold of the sensor"}),
    }  # fmt: skip
    return {name: variable for name, variable in every.items() if name in wanted}

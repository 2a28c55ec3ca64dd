"""What is known of a finished job: names, dimensions, units and phrases of its numbers.

The one table of results, as `compressor.case` is of parameters. Without physics or compiled code,
so that results are read without loading either.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from compressor.parameter import JOINTS

AXES = ("x", "y")
SIZES = {"joint": len(JOINTS), "axis": len(AXES)}

# name: (dimensions, unit, long name)
METRICS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "peak_acceleration": ((), "m/s2", "greatest |acceleration|"),
    "rms_acceleration": ((), "m/s2", "root mean square of acceleration"),
    "rms_acceleration_deviation": ((), "m/s2", "rms of acceleration less the ideal machine's"),
    "peak_contact_force": (("joint",), "N", "greatest joint force on the rod"),
    "peak_contact_force_axis": (("joint", "axis"), "N", "greatest joint force along an axis"),
    "max_penetration": (("joint",), "m", "greatest penetration; negative: never touched"),
    "contact_loss_fraction": (("joint",), "1", "share of time without contact (F_N = 0)"),
    "impact_count": (("joint",), "1", "times that contact began"),
}
# energy flows and how the run went
LEDGER: dict[str, tuple[tuple[str, ...], str, str]] = {
    "crank_work": ((), "J", "work put in by the crank over the run"),
    "load_work": ((), "J", "work put in by the piston force over the run"),
    "contact_damping_loss": ((), "J", "energy lost to contact damping over the run"),
    "friction_loss": ((), "J", "energy lost to joint friction over the run"),
    "energy_residual": ((), "1", "worst energy imbalance relative to the contact's losses"),
    "steps": ((), "1", "accepted integration steps"),
    "rejected": ((), "1", "rejected steps; SciPy's methods do not tell"),
    "evaluations": ((), "1", "evaluations of the right-hand side"),
    "seconds": ((), "s", "wall time of the solution"),
}
NUMBERS = METRICS | LEDGER
# a job's numbers as one structured scalar: what workers send home and segments hold
ROW = np.dtype(
    [(name, "f8", tuple(SIZES[dim] for dim in dims)) for name, (dims, _, _) in NUMBERS.items()]
)


@dataclass(frozen=True)
class SeriesFile:
    """The file that holds a job's time series."""

    samples: int
    end: float  # last time, s
    precision: str  # double | single
    digest: str  # of the file's bytes, part of its name


@dataclass(frozen=True)
class Outcome:
    """How a job ended, without its time series.

    `numbers`: a scalar of dtype ROW, metrics nan unless `status` is "ok"; `reason`: a stable name,
    empty when ok; `attributes`: those of the job's Dataset, its `key` among them; `series`: where
    the time series are stored, if they are.
    """

    status: str
    reason: str
    numbers: np.void
    attributes: dict[str, Any]
    series: SeriesFile | None = None

    @property
    def key(self) -> str:
        """The job's identity."""
        return str(self.attributes["key"])

    @property
    def detail(self) -> str:
        """What is known of a failure beyond its reason."""
        return str(self.attributes.get("detail", ""))

    def variables(self) -> dict[str, tuple]:
        """Status, reason and numbers as xarray variables: (dims, values, attributes)."""
        named: dict[str, tuple] = {
            "status": ((), self.status, {"long_name": "ok or failed"}),
            "reason": ((), self.reason, {"long_name": "why a run failed, by a stable name"}),
        }
        for name, (dims, unit, phrase) in NUMBERS.items():
            named[name] = (dims, self.numbers[name], {"units": unit, "long_name": phrase})
        return named


class Variable(NamedTuple):
    """A variable as xarray has it: names of its dimensions, values, attributes."""

    dims: tuple[str, ...]
    values: np.ndarray
    attrs: dict[str, Any]


@dataclass(frozen=True)
class Table:
    """What a Dataset is made of; xarray takes half a second to load, which storing a job spares."""

    variables: dict[str, Variable]
    attrs: dict[str, Any]


def coordinates() -> dict[str, tuple]:
    """The coordinates of joint and axis as xarray variables."""
    return {
        "joint": (("joint",), list(JOINTS), {"long_name": "joint of the rod"}),
        "axis": (("axis",), list(AXES), {"long_name": "direction; x along the cylinder, y up"}),
    }

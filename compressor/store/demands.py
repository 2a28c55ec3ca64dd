"""What cases ask for without it being in their key, and whether a stored job has it.

Names of what is asked for, and kept: `bars` of errors, a `horizon`, `signals`, time `series`, and
these in `double` precision.
"""

from collections.abc import Set
from dataclasses import dataclass, replace

from compressor.cases import Case
from compressor.reasons import Reason

# of what is kept, where there are several rows of a job
WORTH = {"bars": 1, "horizon": 1, "signals": 1, "series": 4, "double": 4}
OF_THE_END = {"bars", "horizon"}  # what a failed job cannot have
FINAL = {  # reasons of jobs that would fail again
    Reason.INTERNAL_ERROR,
    Reason.WORKER_DIED,
    Reason.OUT_OF_MEMORY,
    Reason.INVALID_INPUT,
}


def asked_by(case: Case) -> set[str]:
    """Return what a case asks for."""
    with_series = case.output.keep == "series"
    asked = {
        "bars": case.wants_bars,
        "horizon": case.solve.horizon is True,
        "signals": case.output.signals,
        "series": with_series,
        "double": with_series and case.output.precision == "double",
    }
    return {name for name, is_asked in asked.items() if is_asked}


def asking(case: Case, more: Set[str]) -> Case:
    """Return a case that asks for more, too."""
    output = replace(case.output, signals=case.output.signals or "signals" in more)
    if "series" in (wanted := asked_by(case) | more):
        precision = "double" if "double" in wanted else "single"
        output = replace(output, keep="series", precision=precision)
    solve = replace(
        case.solve,
        error_bars=case.solve.error_bars or "bars" in more,
        horizon=True if "horizon" in more else case.solve.horizon,
    )
    return replace(case, solve=solve, output=output)


def serving_both(first: Case, second: Case) -> Case:
    """Return a case with all that two cases of one key ask for beside it."""
    found = asking(first, asked_by(second))
    solve = replace(
        found.solve,
        horizon=found.solve.horizon or second.solve.horizon,  # it may be auto
        timeout_s=max(first.solve.timeout_s, second.solve.timeout_s),
    )
    return replace(found, solve=solve)


@dataclass(frozen=True)
class JobStatus:
    """How a stored job ended, and what is kept of it."""

    status: str  # ok | failed
    reason: str  # a stable name; empty when ok
    samples: int  # of the time series; 0 where only metrics are kept
    kept: frozenset[str]

    def satisfies(self, case: Case) -> bool:
        """Return whether a case needs no new run."""
        if self.reason == Reason.BUDGET_SECONDS:
            return False  # a machine with more time to spare may do it
        if self.reason in FINAL:
            return True
        if self.reason == Reason.ACCURACY_NOT_REACHED and not case.wants_bars:
            return False  # nothing is promised without error bars
        if self.status == "ok":
            return asked_by(case) <= self.kept
        return case.output.keep == "metrics" or asked_by(case) - OF_THE_END <= self.kept

    def with_stored_outputs(self, case: Case) -> Case:
        """Return a case that, run again, has all that this job has, time series as exact."""
        return asking(case, self.kept if self.status == "ok" else self.kept - OF_THE_END)

"""Run one job in a worker, which needs no more of the program than this."""

from compressor.cases import Case
from compressor.outcome import Outcome
from compressor.program import ignore_warnings
from compressor.reasons import Reason


def run_job(case: Case) -> Outcome:
    """Simulate a case; return its outcome with the time series that are kept."""
    from compressor.solve import observe  # needs numba: only to simulate

    with ignore_warnings():  # a solver's remarks; what matters is in the result
        found, variables = observe(case)
    if case.output.keep == "metrics" or found.reason == Reason.INVALID_INPUT:
        return found
    return found.with_series(variables, case.output.precision)

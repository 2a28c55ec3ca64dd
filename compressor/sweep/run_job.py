"""Run one job in a worker, which needs no more of the program than this."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from compressor.cases import Case
from compressor.outcome import Outcome
from compressor.program import ignore_warnings
from compressor.reasons import Reason
from compressor.store import StoreError, series_file, write_series


class Carried(NamedTuple):
    """An outcome, and the bytes of the file with its time series, which is still to be stored."""

    outcome: Outcome
    data: bytes


def run_job(place: Path | None, case: Case) -> Outcome | Carried | StoreError:
    """Simulate a case and store its time series in a place, in a worker; the row is the Writer's.

    Without a place, what is to be stored comes back.
    A StoreError is returned, since it ends the sweep: an exception is a failure of the job alone.
    """
    from compressor.solve import observe  # needs numba: only to simulate

    with ignore_warnings():  # a solver's remarks; what matters is in the result
        found, variables = observe(case)
    if case.output.keep == "metrics" or found.reason == Reason.INVALID_INPUT:
        return found
    dataset = found.table(variables)
    if place is None:
        file, data = series_file(dataset, case.output)
        return Carried(replace(found, series=file), data)
    try:
        return replace(found, series=write_series(place, dataset, case.output))
    except StoreError as error:
        return error

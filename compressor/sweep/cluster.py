"""Run cases on the workers of a dask.distributed cluster.

Each worker of the cluster does its batches in processes of its own, as a run on one machine does
(`execution`).
"""

import contextlib
import logging
import os
import pickle
import threading
import uuid
from collections.abc import Callable, Generator, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from compressor.cases import Case
from compressor.outcome import Outcome
from compressor.store import StoreError, publish, store_series
from compressor.sweep.run_job import Carried, run_job
from compressor.sweep.sweep import GRACE, LazyCases
from compressor.sweep.versions import ClusterError, differences, unfitness, versions
from compressor.sweep.warm_up import Needs, load
from compressor.sweep.worker import JobLost, JobResult, Workers


def run_near(place: Path, token: Path, text: str, case: Case) -> Outcome | Carried | StoreError:
    """Run a case and store its time series in a place, if that is the same folder here."""
    return run_job(place if case.output.keep == "series" and sees(token, text) else None, case)


def sees(token: Path, text: str) -> bool:
    """Return whether a file of the run's is there, and others may be written beside it."""
    try:
        return token.read_text() == text and os.access(token.parent, os.W_OK)
    except OSError:
        return False


@contextlib.contextmanager
def visible(place: Path) -> Iterator[tuple[Path, str]]:
    """A file, and its text, by which a worker knows a place for ours, not one of the same name."""
    text = uuid.uuid4().hex
    token = place / "jobs" / f".{text}.tmp"
    publish(token, text.encode())
    try:
        yield token, text
    finally:
        with contextlib.suppress(OSError):
            token.unlink()


def receive_result(place: Path, result: Any) -> Any:
    """Return a result from a worker, its time series stored if they came with it."""
    if not isinstance(result, Carried):
        return result
    outcome, data = result
    assert outcome.series is not None
    try:
        store_series(place, outcome.key, outcome.series, data)
    except StoreError as error:
        return error
    return outcome


EXTRA = "--backend dask needs dask.distributed: pip install 'compsim[dask]'"
CONNECTING = 8.0  # s until a scheduler that does not answer counts as not there
CLOSING = 2.0  # s in which a scheduler may take leave
CHECKING = 60.0  # s in which workers may tell their versions before the jobs; later ones with them


class Cluster:
    """A dask cluster as a `compressor.sweep.sweep.Backend`; a context manager.

    Raises ClusterError: at entry where there is no scheduler, or a worker with other versions.
    """

    def __init__(self, address: str):
        self.address = address

    def __enter__(self) -> "Cluster":
        try:
            from distributed import Client
        except ImportError as error:
            raise ClusterError(EXTRA) from error
        for name in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # we speak for it
        dial = partial(Client, self.address, timeout=CONNECTING, set_as_default=False)
        try:
            self.client = within(CONNECTING + 1, dial)
        except Exception as error:
            remedy = "is one running there? `dask scheduler` starts one, and tells its address"
            raise ClusterError(f"{self.address}: no scheduler answers; {remedy}") from error
        try:
            self.check()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError, TimeoutError):  # the scheduler may be gone
            self.client.close(timeout=CLOSING)

    def check(self) -> None:
        """Compare the versions of all present workers with ours. Raises ClusterError."""
        ours, unfit = versions(), []
        with contextlib.suppress(TimeoutError):
            ask = partial(self.client.run, versions, on_error="return")
            for address, theirs in within(CHECKING, ask).items():
                known = isinstance(theirs, dict)
                why = differences(ours, theirs) if known else unfitness(theirs)
                unfit += [f"worker {address}: {why}"] if why else []
        if unfit:
            raise ClusterError("\n".join(unfit))

    def __call__(
        self,
        place: Path,
        cases: Sequence[Case],
        remark: Callable[[str], None],
        pulse: Callable[[], object],
    ) -> Generator[JobResult | JobLost, None, None]:
        """Run cases; `compressor.sweep.sweep.Backend` tells the rest."""
        from compressor.sweep.cluster_batches import Remote  # loads dask: only where one is used

        with visible(place) as (token, text):
            rules = Workers(prepare=partial(load, Needs.of(cases)), grace=GRACE)
            work = partial(run_near, place, token, text)
            remote = Remote(self.client, work, rules, LazyCases(cases))
            remote.remark = remark
            remote.decode = lambda result: receive_result(place, pickle.loads(result))
            yield from remote.ends(pulse)


def within(seconds: float, call: Callable[[], Any]) -> Any:
    """Return what a call gives that may wait for ever. Raises what it raises, and TimeoutError."""
    told: list[Any] = []

    def noted() -> None:
        try:
            told.extend((call(), None))
        except Exception as error:
            told.extend((None, error))

    thread = threading.Thread(target=noted, daemon=True)
    thread.start()
    thread.join(seconds)
    result, error = told or (None, TimeoutError())
    if error:
        raise error
    return result

"""Run cases on the workers of a dask.distributed cluster.

Each worker of the cluster does its batches in processes of its own, as a run on one machine does
(`execution`). A batch whose worker is lost runs elsewhere; if that happens again and again, it is
tried alone, then job by job.
"""

import contextlib
import logging
import math
import multiprocessing
import os
import pickle
import re
import threading
import time
import uuid
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from compressor.cases import Case
from compressor.outcome import Outcome
from compressor.reasons import Reason
from compressor.store import StoreError, publish, store_series
from compressor.sweep.execution import (
    FAILED_ALONE,
    MEMORY_SHARE,
    Batches,
    End,
    Input,
    Job,
    Local,
    WorkersFailed,
    cores,
    memory_share,
    pack_payloads,
)
from compressor.sweep.run_job import Carried, run_job
from compressor.sweep.sweep import GRACE, LazyCases
from compressor.sweep.versions import ClusterError, Unfit, differences, unfitness, versions
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
    """Yield a new file in a place, and its text, by which a worker knows the place for ours."""
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


POOL_LOCK = threading.Lock()  # one pool a process: threads take turns, each with all of it
IDLE_POOLS: dict[bytes, Local] = {}  # the pool that is kept for the next batch, by what it does


class Batch(NamedTuple):
    """What a worker of the cluster does in one go; jobs are named by their places in it."""

    versions: dict[str, str]  # that the worker must have
    work: Callable[[Any], Any]
    rules: Workers
    timeouts: list[float]  # of its jobs
    payloads: bytes  # theirs, which may be unpickled where versions agree


def on_worker(data: bytes) -> bytes:
    """Run a pickled Batch on a worker of the cluster; return its pickled ends. Raises Unfit."""
    from distributed import get_worker

    worker, batch = get_worker(), Batch(*pickle.loads(data))
    try:
        if different := differences(batch.versions, versions()):
            raise Unfit(different)
        # dask's workers are daemons, which may have no children lest they outlive them; ours die
        # with their parent
        multiprocessing.current_process().daemon = False
        limit = worker.memory_manager.memory_limit  # of all threads together; None: no limit
        count = worker.state.nthreads
        share = int(MEMORY_SHARE * limit / count) if limit else memory_share(max(cores(), count))
        rules = replace(batch.rules, count=count, memory=share)
        with POOL_LOCK:
            numbered = zip(pickle.loads(batch.payloads), batch.timeouts, strict=True)
            jobs = [Job(number, *job) for number, job in enumerate(numbered)]
            return in_processes(batch.work, rules, jobs)
    except (Unfit, WorkersFailed) as error:
        raise Unfit(f"{worker.address}: {error}") from error


def in_processes(work: Callable[[Any], Any], rules: Workers, jobs: list[Job]) -> bytes:
    """Return the pickled ends, in order, of jobs in processes that stay for the next batch."""
    key = pickle.dumps((work, rules))
    if key not in IDLE_POOLS:
        while IDLE_POOLS:
            end_local(IDLE_POOLS.popitem()[1])
        IDLE_POOLS[key] = Local(work, [], rules)
        IDLE_POOLS[key].decode = bytes  # results travel on as they are
    local = IDLE_POOLS[key]
    local.waiting.extend(jobs)
    try:
        ends = sorted(local.run_pending(lambda: None), key=lambda end: end.id)
    except BaseException:
        end_local(IDLE_POOLS.pop(key))
        raise
    return pickle.dumps(ends, pickle.HIGHEST_PROTOCOL)


def end_local(local: Local) -> None:
    """End the processes of a pool, and close the files of its batches."""
    local.stop()
    local.discard()


SECONDS_BETWEEN_COUNTS = 2.0  # s between two counts of the workers
MAX_BYTES = 100_000_000  # of results that may be on their way
SECONDS_TO_REMARK = 5.0  # s without a result before a remark on it
STARTING_REMARK = "the cluster's workers load, or compile, the equations (under a minute)"
WAITING_REMARK = "the cluster has no workers: waiting for the first"


class Remote(Batches):
    """Jobs on a cluster; all functions that workers call are found there by their names.

    What runs when it is stopped ends by itself, and is forgotten. Raises ClusterError where a
    worker has other versions, or the scheduler is lost.
    """

    def __init__(
        self,
        client: Any,
        work: Callable[[Any], Any],
        rules: Workers,
        jobs: Iterable[Input],
    ):
        super().__init__(jobs, rules.target_seconds, 1)
        self.client, self.work, self.rules = client, work, rules
        self.distant: dict[int, Any] = {}  # dask's future of each batch that is out
        self.versions = versions()
        self.remark: Callable[[str], None] = lambda text: None
        self.threads, self.census = -1, 0.0  # of all workers, when they were counted
        self.size = 0.0  # bytes of a result
        self.patience = time.monotonic() + SECONDS_TO_REMARK

    def next_batch(self) -> list[Job]:
        """Return the jobs of a batch; none while large results are on their way."""
        on_way = self.size * sum(map(len, [*self.out.values()]))
        return [] if on_way > MAX_BYTES else super().next_batch()

    def submit(self, number: int, batch: list[Job]) -> "Future[bytes]":
        timeouts = [job.timeout for job in batch]
        request = Batch(self.versions, self.work, self.rules, timeouts, pack_payloads(batch))
        data = pickle.dumps(request, pickle.HIGHEST_PROTOCOL)
        self.distant[number] = self.client.submit(on_worker, data, pure=False)
        ended: Future[bytes] = Future()
        self.distant[number].add_done_callback(partial(pass_on, ended))
        return ended

    def watch(self, now: float, news: bool) -> None:
        """Count the threads of all workers now and then; remark where there are none."""
        if now - self.census < SECONDS_BETWEEN_COUNTS:
            return
        try:
            threads = [*self.client.nthreads().values()]
        except (OSError, TimeoutError, ValueError) as error:
            raise describe_lost_scheduler(self.client) from error
        if not threads and self.threads:
            self.remark(WAITING_REMARK)
        self.threads, self.census, self.width = sum(threads), now, max(len(threads), 1)
        self.target_seconds = self.rules.target_seconds * max(sum(threads) / self.width, 1)
        if threads and not self.weight and now > self.patience:
            self.remark(STARTING_REMARK)
            self.patience = math.inf

    def ends_of(self, number: int, data: bytes) -> list[End]:
        self.distant.pop(number, None)  # None: the run has been stopped
        self.size = max(len(data) / len(self.out[number]), 0.9 * self.size)
        return pickle.loads(data)

    def fail(self, number: int, error: BaseException) -> Iterator[JobLost]:
        """Yield the jobs of a batch that lost its workers twice; it runs alone, then each job."""
        from distributed import KilledWorker

        if isinstance(error, CancelledError) or self.client.status != "running":
            raise describe_lost_scheduler(self.client) from error
        if not isinstance(error, KilledWorker):
            unfit = unfitness(error) or f"a batch failed: {type(error).__name__}: {error}"
            raise ClusterError(f"worker {unfit}") from error
        batch = self.out.pop(number)
        self.distant.pop(number, None)
        if self.alone and len(batch) == 1:
            how = f"{error.allowed_failures + 1} workers of the cluster died that had it"
            yield JobLost(batch[0].id, Reason.WORKER_DIED, f"{how}, {FAILED_ALONE}")
        else:
            self.suspects.extend([[job] for job in batch] if self.alone else [batch])

    def discard(self) -> None:
        """Do nothing: a suspect shares nothing, since no other batch is at work."""

    def end_pool(self) -> None:
        """Cancel what has not begun; what runs ends by itself."""
        with contextlib.suppress(OSError, TimeoutError, ValueError):  # the scheduler may be gone
            self.client.cancel([*self.distant.values()])
        self.distant.clear()


def pass_on(ended: "Future[bytes]", distant: Any) -> None:
    """Set what a future of dask's gives.

    Where its worker died with the result, dask does the batch again: its own executor
    (`Client.get_executor`) would raise a ValueError for that.
    """
    try:
        ended.set_result(distant.result())
    except BaseException as error:
        ended.set_exception(error)


def describe_lost_scheduler(client: Any) -> ClusterError:
    """Return the error of a scheduler that has gone."""
    address = client.scheduler.address if client.scheduler else "the scheduler"
    return ClusterError(f"{address}: the scheduler was lost; the same command goes on with another")


WITH_PORT = re.compile(r":\d+/?$|^inproc://")
EXTRA = "--backend dask needs dask.distributed: pip install 'compsim[dask]'"
CONNECT_SECONDS = 8.0  # s until a scheduler that does not answer counts as not there
CLOSE_SECONDS = 2.0  # s in which a scheduler may take leave
# s in which workers may send their versions before the jobs; later ones with them
CHECK_SECONDS = 60.0


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
        if not WITH_PORT.search(self.address):
            raise ClusterError(f"{self.address}: names no port; write tcp://host:8786")
        for name in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # we speak for it
        dial = partial(Client, self.address, timeout=CONNECT_SECONDS, set_as_default=False)
        try:
            self.client = within(CONNECT_SECONDS + 1, dial)
        except Exception as error:
            remedy = "is one running there? `dask scheduler` starts one, and prints its address"
            raise ClusterError(f"{self.address}: no scheduler answers; {remedy}") from error
        try:
            self.check()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError, TimeoutError):  # the scheduler may be gone
            self.client.close(timeout=CLOSE_SECONDS)

    def check(self) -> None:
        """Compare the versions of all present workers with ours. Raises ClusterError."""
        ours, unfit = versions(), []
        with contextlib.suppress(TimeoutError):
            ask = partial(self.client.run, versions, on_error="return")
            for address, theirs in within(CHECK_SECONDS, ask).items():
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
        """Yield how each case ended; `compressor.sweep.sweep.Backend` says the rest."""
        with visible(place) as (token, text):
            rules = Workers(prepare=partial(load, Needs.of(cases)), grace=GRACE)
            work = partial(run_near, place, token, text)
            remote = Remote(self.client, work, rules, LazyCases(cases))
            remote.remark = remark
            remote.decode = lambda result: receive_result(place, pickle.loads(result))
            yield from remote.run(pulse)


def within(seconds: float, call: Callable[[], Any]) -> Any:
    """Return what a call gives that may wait for ever. Raises what it raises, and TimeoutError."""
    answer: list[Any] = []

    def store_answer() -> None:
        try:
            answer.extend((call(), None))
        except Exception as error:
            answer.extend((None, error))

    thread = threading.Thread(target=store_answer, daemon=True)
    thread.start()
    thread.join(seconds)
    result, error = answer or (None, TimeoutError())
    if error:
        raise error
    return result

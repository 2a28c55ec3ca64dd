"""Run jobs on the workers of a dask.distributed cluster: the one door to `distributed`.

The scheduler gets batches as futures, a few for each thread of its workers, so that memory stays
bounded. What a batch's jobs do wrong is seen to where they run (`compressor.remote`). A batch whose
worker is lost runs elsewhere; if that happens again and again, it is tried alone, then job by job.
"""

import contextlib
import logging
import math
import os
import pickle
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from compressor import CompsimError
from compressor.cases import Case
from compressor.outcome import Outcome
from compressor.reasons import Reason
from compressor.remote import REMEDY, Batch, Broken, Unfit, do_batch, passport
from compressor.store import StoreError, publish, store_series
from compressor.sweep import GRACE, Carried, as_jobs, run_job, warm_up
from compressor.workers import AGAIN, MEMORY, MOST_BATCH, TICK, Done, Input, Lost

EXTRA = "--backend dask needs dask.distributed: pip install 'compsim[dask]'"
CONNECTING = 8.0  # s until a scheduler that does not answer counts as not there
CLOSING = 2.0  # s in which a scheduler may take leave
CHECKING = 60.0  # s in which workers may tell their versions before the jobs; later ones with them
CENSUS = 2.0  # s between two counts of the workers
A_THREAD = 3  # batches that a thread of a worker has at most: one at work, others on their way
MOST_BYTES = 100_000_000  # of results that may be on their way
POLL = 0.01  # s
PATIENCE = 5.0  # s without a result before a remark on it
STARTING = "the cluster's workers load, or compile, the equations (under a minute)"
WAITING = "the cluster has no workers: waiting for the first"
WARM: set[tuple[str, bool]] = set()  # methods, and horizons, that this process has loaded


class ClusterError(CompsimError):
    """A cluster that cannot be used: which, why, and what to do about it."""

    exit_code = 2


class Cluster:
    """A dask cluster as a `compressor.sweep.sweep.Backend`; a context manager.

    Raises ClusterError: at entry where there is no scheduler, or a worker with other versions.
    """

    def __init__(self, address: str):
        self.address = address

    def __enter__(self) -> "Cluster":
        try:
            import distributed
        except ImportError as error:
            raise ClusterError(EXTRA) from error
        logging.getLogger("distributed").setLevel(logging.CRITICAL)  # we speak for it
        self.client = self.dial(distributed.Client)
        try:
            self.check()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError, TimeoutError):  # the scheduler may be gone
            self.client.close(timeout=CLOSING)

    def dial(self, make: Callable[..., Any]) -> Any:
        """A client; in a thread, since it waits for ever for one that takes its call in silence."""
        made, failed = [], []

        def call() -> None:
            try:
                made.append(make(self.address, timeout=CONNECTING, set_as_default=False))
            except Exception as error:
                failed.append(error)

        thread = threading.Thread(target=call, daemon=True)
        thread.start()
        thread.join(CONNECTING + 1)
        if not made:
            remedy = "is one running there? `dask scheduler` starts one, and tells its address"
            cause = failed[0] if failed else None
            raise ClusterError(f"{self.address}: no scheduler answers; {remedy}") from cause
        return made[0]

    def check(self) -> None:
        """Compare the versions of all present workers with ours. Raises ClusterError."""
        ask, ours = partial(self.client.submit, on_worker, passport(), pure=False), []
        for worker in self.client.nthreads():
            ours.append(ask(b"", workers=[worker], allow_other_workers=False))
        until = time.monotonic() + CHECKING
        while any(f.status == "pending" for f in ours) and time.monotonic() < until:
            time.sleep(POLL)
        unfit = [unfitness(f.exception()) for f in ours if f.status == "error"]
        self.client.cancel(ours)
        if any(unfit):
            raise ClusterError("\n".join(filter(None, unfit)))

    def __call__(
        self,
        place: Path,
        cases: Sequence[Case],
        remark: Callable[[str], None],
        pulse: Callable[[], object],
    ) -> Generator[Done | Lost, None, None]:
        """Run cases; `compressor.sweep.sweep.Backend` tells the rest."""
        with visible(place) as (token, text):
            yield from run_batches(
                self.client,
                partial(run_near, place, token, text),
                as_jobs(cases),
                total=len(cases),
                grace=GRACE,
                prepare=load,
                receive=partial(received, place),
                remark=remark,
                pulse=pulse,
            )


# ---- what runs on workers -----------------------------------------------------------------------


def on_worker(ours: dict[str, str], batch: bytes) -> bytes:
    """Do a pickled Batch on a worker of the cluster (`remote.do_batch`), which an error names."""
    from distributed import get_worker

    worker = get_worker()
    try:
        memory = worker.memory_manager.memory_limit
        return do_batch(ours, batch, memory, worker.state.nthreads)
    except Unfit as error:
        raise Unfit(f"{worker.address}: {error}") from error
    except Broken as error:
        raise Broken(f"{worker.address}: {error}") from error


def load(cases: Sequence[Case]) -> None:
    """Load, or compile, what cases need, before a worker process is forked for them."""
    new = [case for case in cases if (case.solve.method, case.solve.horizon) not in WARM]
    if new:
        warm_up(new, lambda remark: None)
        WARM.update((case.solve.method, case.solve.horizon) for case in new)


def run_near(place: Path, token: Path, text: str, case: Case) -> Outcome | Carried | StoreError:
    """Run a case and store its time series in a place, if that is the same folder here."""
    return run_job(place if case.output.keep == "series" and sees(token, text) else None, case)


def sees(token: Path, text: str) -> bool:
    """Whether a file of the run's is there, and others may be written beside it."""
    try:
        return token.read_text() == text and os.access(token.parent, os.W_OK)
    except OSError:
        return False


# ---- here ---------------------------------------------------------------------------------------


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


def received(place: Path, result: Any) -> Any:
    """A result from a worker, its time series stored if they came with it."""
    if not isinstance(result, Carried):
        return result
    outcome, data = result
    assert outcome.series is not None
    try:
        store_series(place, outcome.key, outcome.series, data)
    except StoreError as error:
        return error
    return outcome


def unfitness(error: BaseException) -> str:
    """Why a worker's error means that none of its jobs can run; empty if it does not."""
    if isinstance(error, Unfit):
        return f"worker {error}"
    if isinstance(error, ImportError | AttributeError):
        return f"a worker has no compsim, or an old one ({error}); {REMEDY}"
    return ""


def run_batches(
    client: Any,
    work: Callable[[Any], Any],
    jobs: Iterable[Input],
    *,
    total: int,
    grace: float,
    prepare: Callable[[list[Any]], object],
    receive: Callable[[Any], Any] = lambda result: result,
    remark: Callable[[str], None] = lambda text: None,
    pulse: Callable[[], object] = lambda: None,
    target_seconds: float = 0.2,
) -> Generator[Done | Lost, None, None]:
    """Call work(payload) for each job on a cluster; as `workers.run_batches` does on one machine.

    `prepare` is called on a worker with the payloads of a batch, before its jobs; `receive` here,
    with each result. All functions that workers call are found there by their names. Closing the
    iterator cancels what has not begun; what runs ends by itself, and is forgotten.

    Raises ClusterError where a worker has other versions, or the scheduler is lost.
    """
    batch = partial(Batch, prepare, work, grace=grace)
    flight = Flight(client, batch, jobs, total, target_seconds, remark)
    try:
        while flight.launch():
            flight.land(TICK)
            pulse()
            while flight.ready:
                yield taken(flight.ready.popleft(), receive)
                pulse()
    except GeneratorExit:
        raise
    except BaseException:
        with contextlib.suppress(ClusterError):
            flight.land(0)
        for end in flight.ready:
            yield taken(end, receive)
        raise
    finally:
        flight.cancel()


def taken(end: Done | Lost, receive: Callable[[Any], Any]) -> Done | Lost:
    """An end, its result received."""
    return Done(end.id, receive(end.result), end.seconds) if isinstance(end, Done) else end


class Flight:
    """The batches of one call of `run_batches` that are on their way, and the jobs to come."""

    def __init__(
        self,
        client: Any,
        batch: Callable[[list[Input]], Batch],
        jobs: Iterable[Input],
        left: int,
        target_seconds: float,
        remark: Callable[[str], None],
    ):
        from distributed import as_completed

        self.client, self.batch, self.remark = client, batch, remark
        self.left, self.target_seconds = left, target_seconds
        self.source = iter(jobs)
        self.suspects: deque[list[Input]] = deque()  # batches that have lost their workers
        self.trial: Any = None  # future of the suspect that flies, and nothing else with it
        self.flying: dict[Any, list[Input]] = {}  # by future
        self.landed = as_completed(loop=client.loop, with_results=True, raise_errors=False)
        self.ready: deque[Done | Lost] = deque()
        self.mean, self.size, self.weight = 0.0, 0.0, 0  # seconds and bytes a job; jobs behind them
        self.threads, self.counted = -1, -math.inf  # of all workers, when
        self.patience = time.monotonic() + PATIENCE

    def launch(self) -> bool:
        """Send batches as long as there is room; whether any job is not finished.

        A worker that dies takes with it all that waits there: suspects are tried one by one.
        """
        self.count_workers()
        if self.trial or self.suspects:
            if not self.flying:
                self.trial = self.send(self.suspects.popleft())
            return True
        while len(self.flying) < max(A_THREAD * self.threads, 1) and self.room():
            batch = self.next_batch()
            if not batch:
                break
            self.send(batch)
        return bool(self.flying)

    def send(self, batch: list[Input]) -> Any:
        """Submit a batch; its future."""
        jobs: list[Input] = [(n, *job[1:]) for n, job in enumerate(batch)]
        data = pickle.dumps(self.batch(jobs), pickle.HIGHEST_PROTOCOL)
        key = f"compsim-{uuid.uuid4().hex}"
        future = self.client.submit(on_worker, passport(), data, key=key, pure=False)
        self.flying[future] = batch
        self.landed.add(future)
        return future

    def count_workers(self) -> None:
        """Count the threads of all workers now and then, and tell where there is none."""
        now = time.monotonic()
        if now - self.counted < CENSUS:
            return
        try:
            threads = sum(self.client.nthreads().values())
        except (OSError, TimeoutError) as error:
            raise lost(self.client) from error
        if not threads and self.threads:
            self.remark(WAITING)
        self.threads, self.counted = threads, now
        if threads and not self.weight and now > self.patience:
            self.remark(STARTING)
            self.patience = math.inf

    def room(self) -> bool:
        """Whether the results that are on their way leave memory for more."""
        return self.size * sum(map(len, self.flying.values())) <= MOST_BYTES

    def next_batch(self) -> list[Input]:
        """Jobs for about `target_seconds`: few at first, and towards the end."""
        size = 1.0
        if self.weight:
            size = self.target_seconds / max(self.mean, 1e-9)
            size = min(size, self.left / (2 * max(self.threads, 1)), MOST_BATCH)
        batch: list[Input] = []
        while len(batch) < size and (job := next(self.source, None)) is not None:
            batch.append(job)
        self.left -= len(batch)
        return batch

    def land(self, patience: float) -> None:
        """Take in the batches that have come; wait for the first at most `patience` seconds."""
        until = time.monotonic() + patience
        while not self.landed.has_ready() and time.monotonic() < until:
            time.sleep(POLL)
        while self.landed.has_ready():
            future, result = next(self.landed)
            batch, tried = self.flying.pop(future), future is self.trial
            self.trial = None if tried else self.trial
            if future.status == "finished":
                self.finish(batch, result)
            elif future.status == "error":
                self.fail(batch, tried, result[1])
            else:
                raise lost(self.client)

    def finish(self, batch: list[Input], result: bytes) -> None:
        """A batch has been done."""
        ends: list[Done | Lost] = pickle.loads(result)
        for end in ends:
            known = min(self.weight, MEMORY)
            if isinstance(end, Done):
                self.mean = (known * self.mean + end.seconds) / (known + 1)
                self.size = (known * self.size + len(result) / len(batch)) / (known + 1)
                self.weight = known + 1
            self.ready.append(replace(end, id=batch[end.id][0]))

    def fail(self, batch: list[Input], tried: bool, error: BaseException) -> None:
        """A batch has lost its workers: it is tried alone, then each of its jobs."""
        from distributed import KilledWorker

        if isinstance(error, KilledWorker):
            how = f"{error.allowed_failures + 1} workers of the cluster died that had it"
        elif isinstance(error, Broken):
            how = str(error)
        else:
            unfit = unfitness(error) or f"a batch of jobs failed: {type(error).__name__}: {error}"
            raise ClusterError(unfit) from error
        if not tried:
            self.suspects.append(batch)
        elif len(batch) > 1:
            self.suspects.extend([job] for job in batch)
        else:
            self.ready.append(Lost(batch[0][0], Reason.WORKER_DIED, f"{how}, {AGAIN}"))

    def cancel(self) -> None:
        """Have what has not begun never begin."""
        self.landed.clear()
        if self.client.status == "running":
            with contextlib.suppress(OSError, TimeoutError):
                self.client.cancel(list(self.flying), force=True)


def lost(client: Any) -> ClusterError:
    """The scheduler has gone."""
    address = client.scheduler.address if client.scheduler else "the scheduler"
    return ClusterError(f"{address}: the scheduler was lost; the same command goes on with another")

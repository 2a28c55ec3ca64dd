"""Batches of jobs for the workers of a dask cluster, by joblib's dask backend.

A batch whose worker is lost runs elsewhere; if that happens again and again, it is tried alone,
then job by job.
"""

import itertools
import math
import multiprocessing
import pickle
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

from joblib import Parallel, delayed
from joblib._dask import DaskDistributedBackend

from compressor.reasons import Reason
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
)
from compressor.sweep.versions import ClusterError, Unfit, differences, unfitness, versions
from compressor.sweep.worker import JobLost, Workers

POOL_LOCK = (
    threading.Lock()
)  # joblib has one pool a process: threads take turns, each with all of it
KEPT: dict[bytes, Local] = {}  # the pool that is kept for the next batch, by what it does


class Batch(NamedTuple):
    """What a worker of the cluster does in one go; jobs are named by their places in it."""

    versions: dict[str, str]  # that are asked for
    work: Callable[[Any], Any]
    rules: Workers
    jobs: list[Job]


def on_worker(number: int, data: bytes) -> tuple[int, bytes | Unfit]:
    """Do a pickled Batch on a worker of the cluster: its number, its pickled ends or why not."""
    from distributed import get_worker

    worker, batch = get_worker(), Batch(*pickle.loads(data))
    try:
        if different := differences(batch.versions, versions()):
            raise Unfit(different)
        # dask's workers are daemons, which may have no children lest they outlive them, and joblib
        # would do jobs without a process of their own; ours die with their parent
        multiprocessing.current_process()._config["daemon"] = False  # type: ignore[attr-defined]
        most = worker.memory_manager.memory_limit  # of all threads together; None: no limit
        count = worker.state.nthreads
        share = int(MEMORY_SHARE * most / count) if most else memory_share(max(cores(), count))
        rules = replace(batch.rules, count=count, memory=share)
        with POOL_LOCK:
            return number, in_processes(batch.work, rules, batch.jobs)
    except (Unfit, WorkersFailed) as error:
        return number, Unfit(f"{worker.address}: {error}")


def in_processes(work: Callable[[Any], Any], rules: Workers, jobs: list[Job]) -> bytes:
    """Do jobs in processes that stay for the next batch; their ends, in order, pickled."""
    key = pickle.dumps((work, rules))
    if key not in KEPT:
        while KEPT:
            KEPT.popitem()[1].stop()
        KEPT[key] = Local(work, [], rules)
        KEPT[key].decode = bytes  # results travel on as they are
    local = KEPT[key]
    local.waiting.extend(jobs)
    try:
        ends = sorted(local.done(lambda: None), key=lambda end: end.id)
    except BaseException:
        KEPT.pop(key).stop()
        raise
    return pickle.dumps(ends, pickle.HIGHEST_PROTOCOL)


CENSUS = 2.0  # s between two counts of the workers
A_THREAD = 3  # batches that a thread of a worker has at most: one at work, others on their way
MAX_BYTES = 100_000_000  # of results that may be on their way
SECONDS_TO_REMARK = 5.0  # s without a result before a remark on it
STARTING_REMARK = "the cluster's workers load, or compile, the equations (under a minute)"
WAITING = "the cluster has no workers: waiting for the first"


class Dask(DaskDistributedBackend):
    """joblib's dask backend, which tells of a batch at once, also of one that lost its workers.

    joblib waits for such a batch for ever: its `_collect` does not call back what has failed.
    """

    def __init__(self, client: Any, hand_over: Callable[[int, Any], None]):
        super().__init__(client=client, pure=False)
        self.hand_over, self.open = hand_over, set[Any]()

    def effective_n_jobs(self, n_jobs: int) -> int:
        return max(2, sum(self.client.nthreads().values()))  # a single one, joblib would do here

    def submit(self, func: Any, callback: Any = None) -> Any:
        number = func.items[0][1][0]
        future = super().submit(func, callback)
        self.open.add(future)
        future.add_done_callback(lambda ended: self.see(ended, number, callback))
        return future

    def see(self, ended: Any, number: int, callback: Any) -> None:
        """A batch has ended; of good ones joblib tells."""
        self.open.discard(ended)
        error = StopIteration() if ended.cancelled() else ended.exception()
        if error:
            callback((number, error))

    def retrieve_result_callback(self, out: Any) -> list[None]:
        found = out if isinstance(out, tuple) else super().retrieve_result_callback(out)[0]
        self.hand_over(*found)
        return [None]

    def end(self) -> None:
        """Wait for no batch any more."""
        self.abort_everything()
        for future in [*self.open]:
            future.cancel()


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
        self.asked = versions()
        self.remark: Callable[[str], None] = lambda text: None
        self.numbers = itertools.count()
        self.threads, self.census = -1, 0.0  # of all workers, when they were counted
        self.size, self.renew = 0.0, False  # bytes of a result; whether the round should end
        self.backend: Dask | None = None
        self.patience = time.monotonic() + SECONDS_TO_REMARK

    def begin(self) -> bool:
        self.renew = False
        return super().begin()

    def parallel(self) -> Parallel:
        """Return joblib's for a round: as many batches as the workers have threads for."""
        self.backend = Dask(self.client, self.hand_over)
        ahead = A_THREAD * self.width
        return Parallel(-1, self.backend, "generator_unordered", batch_size=1, pre_dispatch=ahead)

    def next_batch(self) -> list[Job]:
        """As ever, but a round ends when workers come or go, or large results wait."""
        on_way = sum(map(len, [*self.out.values()])) + self.arrived.qsize()
        return [] if self.renew or self.size * on_way > MAX_BYTES else super().next_batch()

    def call(self, batch: list[Job]) -> Any:
        number = next(self.numbers)
        self.out[number] = batch
        jobs = [Job(n, *job[1:3]) for n, job in enumerate(batch)]
        asked = Batch(self.asked, self.work, self.rules, jobs)
        return delayed(on_worker)(number, pickle.dumps(asked, pickle.HIGHEST_PROTOCOL))

    def watch(self, now: float, news: bool) -> None:
        """Count the threads of all workers now and then, and tell where there is none."""
        if now - self.census < CENSUS:
            return
        try:
            threads = [*self.client.nthreads().values()]
        except (OSError, TimeoutError, ValueError) as error:
            raise describe_lost_scheduler(self.client) from error
        if not threads and self.threads:
            self.remark(WAITING)
        self.renew = self.renew or sum(threads) != self.threads
        self.threads, self.census, self.width = sum(threads), now, max(len(threads), 1)
        self.target_seconds = self.rules.target_seconds * max(sum(threads) / self.width, 1)
        if threads and not self.weight and now > self.patience:
            self.remark(STARTING_REMARK)
            self.patience = math.inf

    def finish(self, batch: list[Job], found: Any) -> Iterator[End]:
        if isinstance(found, bytes):
            self.size = max(len(found) / len(batch), 0.9 * self.size)
            yield from super().finish(batch, pickle.loads(found))
        elif not self.stopped:
            yield from self.lost_batch(batch, found)

    def lost_batch(self, batch: list[Job], error: BaseException) -> Iterator[JobLost]:
        """Yield the jobs of a batch that lost its workers twice; it runs alone, then each job."""
        from distributed import KilledWorker

        if not isinstance(error, KilledWorker):
            unfit = unfitness(error) or f"a batch failed: {type(error).__name__}: {error}"
            raise ClusterError(f"worker {unfit}") from error
        if self.alone and len(batch) == 1:
            how = f"{error.allowed_failures + 1} workers of the cluster died that had it"
            yield JobLost(batch[0].id, Reason.WORKER_DIED, f"{how}, {FAILED_ALONE}")
        else:
            self.suspects.extend([[job] for job in batch] if self.alone else [batch])

    def fail(self, error: BaseException) -> Iterable[JobLost]:
        raise error if self.client.status == "running" else describe_lost_scheduler(self.client)

    def discard(self) -> None:
        """Nothing is shared with a suspect: no other batch is at work."""

    def stop(self) -> None:
        """Have what has not begun never begin."""
        self.stopped = True
        while self.round and not self.round.done():
            if self.backend:
                self.backend.end()
            time.sleep(0.01)
        self.thread.shutdown()


def describe_lost_scheduler(client: Any) -> ClusterError:
    """Return the error of a scheduler that has gone."""
    address = client.scheduler.address if client.scheduler else "the scheduler"
    return ClusterError(f"{address}: the scheduler was lost; the same command goes on with another")

"""Run cases on the workers of a dask.distributed cluster, by plain `submit` and `as_completed`.

A task runs a batch of cases in a worker of the cluster, and returns how they ended and the bytes of
the batch, which are stored here. A batch that fells its workers is tried job by job, each alone.
"""

import functools
import logging
import pickle
import re
import time
from collections.abc import Callable, Collection, Generator
from dataclasses import replace
from pathlib import Path
from typing import Any

from compressor.program import CompsimError
from compressor.reasons import Reason
from compressor.store import encode_batch, publish_batch
from compressor.sweep.pool import Batches, Input
from compressor.sweep.sweep import run_job
from compressor.sweep.versions import REMEDY, differences, versions
from compressor.sweep.wanted import JobEnd
from compressor.sweep.warm_up import Needs, load
from compressor.sweep.worker import End, JobLost, JobResult, attempt

WITH_PORT = re.compile(r":\d+/?$|^inproc://")
CONNECT_SECONDS = 8.0  # s until a scheduler that does not answer counts as not there
TARGET_SECONDS = 0.5  # of a batch
BATCHES_AHEAD = 3  # that a thread of the cluster has at most: one at work, others on their way
SECONDS_BETWEEN_COUNTS = 2.0  # of the cluster's threads
WAITING = "the cluster has no workers: waiting for the first"
STARTING = "the cluster's workers load, or compile, the equations first (under a minute)"


class ClusterError(CompsimError):
    """A cluster that cannot be used: which, why, and what to do about it."""

    exit_code = 2


class Unfit(Exception):
    """A worker whose results would not be the same to the bit: why."""


def run_cases(ours: dict[str, str], needs: Needs, cases: bytes) -> tuple[list[End], bytes]:
    """Return how pickled cases ended, and their encoded batch, on a worker. Raises Unfit."""
    if different := differences(ours, versions()):
        raise Unfit(different)
    load_once(needs)
    ends = [attempt(run_job, case) for case in pickle.loads(cases)]
    ran = [end.result for end in ends if isinstance(end, JobResult)]
    compress = any(compress for _, compress in ran)
    data = encode_batch([outcome for outcome, _ in ran], compress) if ran else b""
    return [
        replace(e, result=JobEnd.of(e.result[0])) if isinstance(e, JobResult) else e for e in ends
    ], data


load_once = functools.cache(load)  # in each process of the cluster, so that no job's time has it


class Cluster:
    """A dask cluster as a `compressor.sweep.sweep.Backend`; a context manager.

    Raises ClusterError where there is no scheduler, where it is lost, and where a worker has other
    versions.
    """

    def __init__(self, address: str):
        self.address = address
        self.counted, self.threads = -SECONDS_BETWEEN_COUNTS, 0

    def __enter__(self) -> "Cluster":
        try:
            from distributed import Client
        except ImportError as error:
            needs = "--scheduler needs dask.distributed: pip install 'compsim[dask]'"
            raise ClusterError(needs) from error
        if not WITH_PORT.search(self.address):
            raise ClusterError(f"{self.address}: names no port; write tcp://host:8786")
        for name in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # we speak for it
        try:
            self.client = Client(self.address, timeout=CONNECT_SECONDS, set_as_default=False)
        except Exception as error:
            remedy = "is one running there? `dask scheduler` starts one, and prints its address"
            raise ClusterError(f"{self.address}: no scheduler answers; {remedy}") from error
        return self

    def __exit__(self, *_: object) -> None:
        self.client.close(timeout=2)

    def __call__(
        self, folder: Path, jobs: Collection[Input], remark: Callable[[str], None]
    ) -> Generator[End, None, None]:
        """Yield how each job ended; `compressor.sweep.sweep.Backend` says the rest."""
        from distributed import KilledWorker, as_completed

        needs, batches = Needs.of(case for _, case, _ in jobs), Batches(jobs, TARGET_SECONDS, 1)
        out: dict[Any, list[Any]] = {}
        suspects: list[Any] = []  # jobs of batches that have felled their workers
        ready = as_completed(loop=self.client.loop)
        remark(STARTING if self.count_threads() else WAITING)
        try:
            while True:
                batches.width = max(1, self.count_threads())
                while len(out) < BATCHES_AHEAD * batches.width and (batch := batches.next()):
                    self.submit(out, ready, needs, batch)
                if alone := not out:
                    if not suspects:
                        return
                    self.submit(out, ready, needs, [suspects.pop()])
                future = next(ready)
                batch, error = out.pop(future), future.exception()
                if not isinstance(error, KilledWorker):
                    yield from self.take(folder, batch, future, batches)
                elif alone:
                    how = f"{error.allowed_failures + 1} workers of the cluster died that had it"
                    yield JobLost(batch[0].id, Reason.WORKER_DIED, f"{how} alone")
                else:
                    suspects += batch
        finally:
            self.client.cancel([*out])

    def submit(self, out: dict[Any, list[Any]], ready: Any, needs: Needs, batch: list[Any]) -> None:
        """Send a batch to the cluster."""
        cases = pickle.dumps([job.payload for job in batch])
        future = self.client.submit(run_cases, versions(), needs, cases, pure=False)
        out[future] = batch
        ready.add(future)

    def take(
        self, folder: Path, batch: list[Any], future: Any, batches: Batches
    ) -> Generator[End, None, None]:
        """Store a batch that has ended, and yield how its jobs did. Raises ClusterError."""
        error = future.exception()
        if future.cancelled() or self.client.status != "running":
            raise self.lost() from error
        if isinstance(error, Unfit):
            raise ClusterError(f"a worker of the cluster {error}") from error
        if isinstance(error, ImportError | AttributeError):
            text = f"a worker of the cluster has no compsim, or an old one ({error}); {REMEDY}"
            raise ClusterError(text) from error
        ends, data = future.result()
        if data:
            publish_batch(folder, data)
        for job, end in zip(batch, ends, strict=True):
            if isinstance(end, JobResult):
                batches.learn(end.seconds)
            yield replace(end, id=job.id)

    def count_threads(self) -> int:
        """Return how many threads the cluster has, or had a moment ago. Raises ClusterError."""
        if time.monotonic() - self.counted > SECONDS_BETWEEN_COUNTS:
            try:
                self.threads = sum(self.client.nthreads().values())
            except (OSError, TimeoutError, ValueError) as error:
                raise self.lost() from error
            self.counted = time.monotonic()
        return self.threads

    def lost(self) -> ClusterError:
        """Return the error of a scheduler that has gone."""
        text = "the scheduler was lost; the same command goes on with another"
        return ClusterError(f"{self.address}: {text}")

"""Run cases on the workers of a dask.distributed cluster, by plain `submit` and `as_completed`.

A task runs a batch of cases in a worker of the cluster, and returns how they ended and the bytes of
the batch, which are stored here. A batch that fells its workers is tried job by job, each alone.
"""

import functools
import logging
import os
import pickle
import platform
from collections.abc import Callable, Generator
from dataclasses import replace
from pathlib import Path
from typing import Any

from compressor.cases import MODEL_VERSION
from compressor.outcome import Outcome
from compressor.program import COMPILED, VERSION, CompsimError, library_versions, sources_hash
from compressor.reasons import Reason
from compressor.store import encode_batch, publish_batch
from compressor.sweep.pool import Batches, Job
from compressor.sweep.sweep import run_job
from compressor.sweep.wanted import JobEnd, RequestedJobs
from compressor.sweep.warm_up import Needs, load
from compressor.sweep.worker import End, JobLost, JobResult, attempt, store_results

CONNECT_SECONDS = 8.0  # s until a scheduler that does not answer counts as not there
TARGET_SECONDS = 0.5  # of a batch
BATCHES_AHEAD = 3  # that a thread of the cluster has at most: one at work, others on their way
WAITING = "the cluster has no workers: waiting for the first"
STARTING = "the cluster's workers load, or compile, the equations first (under a minute)"


class ClusterError(CompsimError):
    """A cluster that cannot be used: which, why, and what to do about it."""

    exit_code = 2


@functools.cache
def versions() -> dict[str, str]:
    """Return what decides the bits of a result: the programs here, and their versions."""
    return {
        "compsim": VERSION, "model": MODEL_VERSION, "COMPSIM_JIT": os.getenv("COMPSIM_JIT", "1"),
        "sources of compsim": sources_hash(COMPILED.parent), "machine": platform.machine(),
        "Python": platform.python_version(), "C library": " ".join(platform.libc_ver()),
    } | library_versions("numpy", "scipy", "numba", "llvmlite")  # fmt: skip


def run_cases(
    ours: dict[str, str], needs: Needs, cases: bytes
) -> str | tuple[list[End], list[bytes]]:
    """Return how pickled cases ended, and their batches, on a worker of the cluster.

    Return where its versions are others, if they are.
    """
    batches: list[bytes] = []

    def keep(outcomes: list[Outcome]) -> list[JobEnd]:
        batches.append(encode_batch(outcomes))
        return [JobEnd.of(outcome) for outcome in outcomes]

    theirs = versions()
    if theirs != ours:
        names = [name for name in ours if ours[name] != theirs[name]]
        return ", ".join(f"{name} {theirs[name]} in place of {ours[name]}" for name in names)
    load_once(needs)
    return store_results(keep, [attempt(run_job, case) for case in pickle.loads(cases)]), batches


load_once = functools.cache(load)  # in each process of the cluster, so that no job's time has it


class Cluster:
    """A dask cluster as a `compressor.sweep.sweep.Backend`; a context manager.

    Raises ClusterError where there is no scheduler, or it is lost, or a worker's programs differ.
    """

    def __init__(self, address: str):
        self.address = address

    def __enter__(self) -> "Cluster":
        try:
            from distributed import Client
        except ImportError as error:
            needs = "--scheduler needs dask.distributed: pip install 'compsim[dask]'"
            raise ClusterError(needs) from error
        for name in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # we speak for it
        try:
            self.client = Client(self.address, timeout=CONNECT_SECONDS, set_as_default=False)
        except Exception as error:
            remedy = "`dask scheduler` starts one, and prints its address, such as tcp://host:8786"
            raise ClusterError(f"{self.address}: no scheduler answers; {remedy}") from error
        return self

    def __exit__(self, *_: object) -> None:
        self.client.close(timeout=2)

    def __call__(
        self, folder: Path, jobs: RequestedJobs, remark: Callable[[str], None]
    ) -> Generator[End, None, None]:
        """Yield how each job ended; `compressor.sweep.sweep.Backend` says the rest."""
        from distributed import KilledWorker, as_completed

        needs, batches = Needs.of(jobs.cases()), Batches(jobs, TARGET_SECONDS, 1)
        out: dict[Any, list[Job]] = {}  # batches on their way, by dask's future
        suspects: list[Job] = []  # of batches that have felled their workers
        ready = as_completed(loop=self.client.loop)
        remark(STARTING if self.count_threads() else WAITING)

        def next_batch() -> list[Job]:
            if (batch := batches.next()) or out or not suspects:
                return batch
            return [suspects.pop()._replace(again=True)]  # alone on the cluster

        try:
            while True:
                batches.width = max(1, self.count_threads())
                while len(out) < BATCHES_AHEAD * batches.width and (batch := next_batch()):
                    cases = pickle.dumps([job.payload for job in batch])
                    future = self.client.submit(run_cases, versions(), needs, cases, pure=False)
                    out[future] = batch
                    ready.add(future)
                if not out:
                    return
                future = next(ready)
                batch, error = out.pop(future), future.exception()
                if not isinstance(error, KilledWorker):
                    yield from self.take(folder, batch, future, batches)
                elif batch[0].again:
                    how = f"{error.allowed_failures + 1} workers of the cluster that had it alone"
                    yield JobLost(batch[0].id, Reason.WORKER_DIED, f"it felled {how}")
                else:
                    suspects += batch
        finally:
            self.client.cancel([*out])

    def take(
        self, folder: Path, batch: list[Job], future: Any, batches: Batches
    ) -> Generator[End, None, None]:
        """Store a batch that has ended, and yield how its jobs did. Raises ClusterError."""
        error = future.exception()
        if future.cancelled() or self.client.status != "running":
            raise self.describe_lost_scheduler() from error
        problem = f"no compsim, or an old one ({error})" if error else future.result()
        if isinstance(problem, str):
            remedy = "have the same programs on all machines, then start its workers again"
            raise ClusterError(f"a worker of the cluster has {problem}; {remedy}") from error
        ends, written = future.result()
        for data in written:
            publish_batch(folder, data)
        for job, end in zip(batch, ends, strict=True):
            if isinstance(end, JobResult):
                batches.learn(end.seconds)
            yield replace(end, id=job.id)

    def count_threads(self) -> int:
        """Return how many threads the cluster has. Raises ClusterError."""
        try:
            return sum(self.client.nthreads().values())
        except (OSError, TimeoutError, ValueError) as error:
            raise self.describe_lost_scheduler() from error

    def describe_lost_scheduler(self) -> ClusterError:
        """Return the error of a scheduler that has gone."""
        text = "the scheduler was lost; the same command goes on with another"
        return ClusterError(f"{self.address}: {text}")

"""Run cases on the workers of a dask.distributed cluster, by plain `submit` and `as_completed`.

A task runs a batch of cases in a worker of the cluster, and returns how they ended and the bytes of
the batch, which are stored here. A batch that fells its workers is tried job by job, each alone.
"""

import contextlib
import functools
import logging
import os
import pickle
import platform
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

from compressor.cases import MODEL_VERSION
from compressor.outcome import Outcome
from compressor.program import COMPILED, VERSION, CompsimError, library_versions, sources_hash
from compressor.reasons import Reason
from compressor.store import encode_batch, publish_batch
from compressor.sweep.pool import Batches, Job
from compressor.sweep.sweep import Backend, JobEnd, RequestedJobs, run_job
from compressor.sweep.warm_up import Part, load, needed_parts
from compressor.sweep.worker import End, attempt, store_results

CONNECT_SECONDS = 8.0  # s until a scheduler that does not answer counts as not there
TARGET_SECONDS = 0.5  # of a batch
BATCHES_AHEAD = 3  # that a thread of the cluster has at most: one at work, others on their way
WAITING = "the cluster has no workers: waiting for the first"
STARTING = "the cluster's workers load, or compile, the equations first (under a minute)"
SAME = "have the same programs on all machines, then start its workers again"


class ClusterError(CompsimError):
    """A cluster that cannot be used: which, why, and what to do about it."""


@functools.cache
def versions() -> dict[str, str]:
    """Return what decides the bits of a result: the programs here, and their versions."""
    return {
        "compsim": VERSION, "model": MODEL_VERSION, "COMPSIM_JIT": os.getenv("COMPSIM_JIT", "1"),
        "sources of compsim": sources_hash(COMPILED.parent), "machine": platform.machine(),
        "Python": platform.python_version(), "C library": " ".join(platform.libc_ver()),
    } | library_versions("numpy", "scipy", "numba", "llvmlite")  # fmt: skip


load_once = functools.cache(load)  # in each process of the cluster, so that no job's time has it


def run_cases(
    ours: dict[str, str], parts: tuple[Part, ...], cases: bytes
) -> tuple[str, list[End], list[bytes]]:
    """Return how pickled cases ended, and their batches, on a worker of the cluster.

    Return where its versions are others, if they are.
    """
    theirs, batches = versions(), list[bytes]()
    if others := [name for name in ours if ours[name] != theirs[name]]:
        text = ", ".join(f"{name} {theirs[name]} in place of {ours[name]}" for name in others)
        return text, [], []

    def keep(outcomes: list[Outcome]) -> list[JobEnd]:
        batches.append(encode_batch(outcomes))
        return [JobEnd.of(outcome) for outcome in outcomes]

    load_once(parts)
    return "", store_results(keep, [attempt(run_job, one) for one in pickle.loads(cases)]), batches


@contextlib.contextmanager
def connect_cluster(address: str) -> Iterator[Backend]:
    """Yield a dask cluster as a backend. Raises ClusterError where no scheduler answers."""
    try:
        from distributed import Client
    except ImportError as error:
        needs = "--scheduler needs dask.distributed: pip install 'compsim[dask]'"
        raise ClusterError(needs) from error
    for name in ("distributed", "tornado"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # we speak for it
    try:
        client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
    except Exception as error:
        remedy = "`dask scheduler` starts one, and prints its address, such as tcp://host:8786"
        raise ClusterError(f"{address}: no scheduler answers; {remedy}") from error
    try:
        yield functools.partial(run_on_cluster, client, address)
    finally:
        client.close(timeout=2)


def run_on_cluster(
    client: Any, address: str, folder: Path, jobs: RequestedJobs, remark: Callable[[str], None]
) -> Generator[End, None, None]:
    """Yield how jobs ended on a cluster: a Backend, but for the client of dask and its address.

    Raises ClusterError where the scheduler is lost, or a worker's programs differ.
    """
    from distributed import KilledWorker, as_completed

    def count_threads() -> int:
        with contextlib.suppress(OSError, TimeoutError, ValueError):
            return sum(client.nthreads().values())
        raise lost_scheduler

    lost_scheduler = ClusterError(
        f"{address}: the scheduler was lost; the same command goes on with another"
    )
    parts, batches = needed_parts(jobs.cases()), Batches(jobs, TARGET_SECONDS, 1)
    out: dict[Any, list[Job]] = {}  # batches on their way, by dask's future
    suspects: list[Job] = []  # of batches that have felled their workers
    ready = as_completed(loop=client.loop)
    remark(STARTING if count_threads() else WAITING)
    try:
        while True:
            batches.width = max(1, count_threads())
            while len(out) < BATCHES_AHEAD * batches.width:
                batch = batches.next()
                if not batch and suspects and not out:
                    batch = [suspects.pop()._replace(again=True)]  # alone on the cluster
                if not batch:
                    break
                cases = pickle.dumps([job.payload for job in batch])
                future = client.submit(run_cases, versions(), parts, cases, pure=False)
                out[future] = batch
                ready.add(future)
            if not out:
                return
            future = next(ready)
            batch = out.pop(future)
            if future.cancelled() or client.status != "running":
                raise lost_scheduler
            try:
                problem, ends, written = future.result()
            except KilledWorker as death:
                how = f"{death.allowed_failures + 1} workers of the cluster that had it alone"
                if batch[0].again:
                    yield End(batch[0].id, reason=Reason.WORKER_DIED, detail=f"it felled {how}")
                else:
                    suspects += batch
                continue
            except Exception as error:  # such as that it cannot be found there
                if future.cancelled() or client.status != "running":
                    raise lost_scheduler from error
                problem = f"no compsim, or an old one ({error})"
            if problem:
                raise ClusterError(f"a worker of the cluster has {problem}; {SAME}")
            for data in written:
                publish_batch(folder, data)
            for job, end in zip(batch, ends, strict=True):
                if not end.reason:
                    batches.learn(end.seconds)
                yield end._replace(id=job.id)
    finally:
        client.cancel([*out])

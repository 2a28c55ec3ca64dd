"""Batches of jobs on a worker of a dask cluster, in processes that keep them away from it."""

import multiprocessing
import pickle
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

from compressor.sweep.batches import Job
from compressor.sweep.execution import MEMORY_SHARE, Local, WorkersFailed, cores, memory_share
from compressor.sweep.versions import Unfit, differences, versions
from compressor.sweep.worker import Workers

ONE = threading.Lock()  # joblib has one pool a process: threads take turns, each with all of it
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
        with ONE:
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

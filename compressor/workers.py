"""Run jobs in worker processes: one that crashes, hangs or eats memory costs itself only.

A batch of jobs goes to each worker and results come back while it runs. The job that was running
when a worker died is tried once more, alone in a fresh worker, before it counts as lost; the others
are simply done again. There are no threads, and no process outlives the parent.
"""

import contextlib
import math
import multiprocessing
import operator
import os
import pickle
import selectors
import time
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from compressor import CompsimError
from compressor.process import (
    Job,
    Worker,
    ending,
    memory_share,
    signals_blocked,
    start,
    start_method,
)
from compressor.reasons import Reason
from compressor.worker import NONE_YET, NOT_RUNNING, POSITION, SINCE, Answer, Rules, described

Input = tuple[Hashable, Any, float]  # id, payload, wall time that the job may take (s)

TICK = 0.25  # s between two looks at the clocks of the jobs
GRACE = 1.0  # s beyond its time in which a job may end by itself
MOST_BATCH = 1000  # jobs
MEMORY = 50  # jobs that a mean of their seconds rests on
MOST_READY = 1000  # results that wait to be taken before workers wait, too
BARREN = 10  # workers in a row that may die without any job beginning or ending
AGAIN = "also when it ran again alone"


class WorkersFailed(CompsimError):
    """Worker processes cannot be started, or die before they begin a job."""


@dataclass(frozen=True)
class Done:
    """A job that ended, its result, and the seconds that it took."""

    id: Any
    result: Any
    seconds: float


@dataclass(frozen=True)
class Lost:
    """A job that has no result.

    `reason`: WORKER_DIED, OUT_OF_MEMORY, BUDGET_SECONDS, or INTERNAL_ERROR, with a traceback,
    where the work raised an exception.
    """

    id: Any
    reason: str
    detail: str
    traceback: str = ""


def run_batches(
    work: Callable[[Any], Any],
    jobs: Iterable[Input],
    count: int,
    *,
    total: int | None = None,
    memory: int | None = None,
    grace: float = GRACE,
    target_seconds: float = 0.2,
    method: str | None = None,
    pulse: Callable[[], object] = lambda: None,
) -> Generator[Done | Lost, None, None]:
    """Call work(payload) for each job in `count` worker processes; yield how each one ended.

    `jobs` is read as workers need it, `total` (by default its length hint) lets batches shrink
    towards the end. `memory` is what a job may add to its worker, in bytes (`memory_share`). `work`
    opens its own files; what it raises makes its job Lost. `method` is `start_method()` or a name
    of multiprocessing's: with "spawn", `work` must be found by its name. `pulse` is called
    several times a second, whether or not jobs end.

    Closing the iterator kills the workers. Whatever is raised here, a signal's exception too, comes
    after the results that had arrived (`rest` does the same for what the caller raises). Raises
    WorkersFailed, and what `jobs` raises.
    """
    method = method or start_method()
    memory = memory or memory_share(count)
    rules = Rules(target_seconds, memory, os.getpid(), method == "fork")
    starter = partial(start, multiprocessing.get_context(method), work, rules)
    left = operator.length_hint(jobs, 0) if total is None else total
    crew = Crew(starter, jobs, count, rules, grace, left)
    try:
        crew.deploy()
        while crew.at_work() or crew.ready:
            crew.attend(0.0 if crew.ready else TICK)
            pulse()
            until = time.monotonic() + target_seconds / 20
            while crew.ready and (time.monotonic() < until or len(crew.ready) > MOST_READY):
                yield crew.ready.popleft()
    except GeneratorExit:
        raise
    except BaseException:
        crew.end()
        yield from crew.ready
        raise
    finally:
        crew.end()


def rest(ends: Generator[Done | Lost, None, None], error: BaseException) -> Iterator[Done | Lost]:
    """After an error in the loop over `run_batches`: what had arrived by then, then the error.

    The workers end at once.
    """
    with contextlib.suppress(StopIteration):
        yield ends.throw(error)
        yield from ends


class Crew:
    """The workers of one call of `run_batches`, and the jobs that are not finished."""

    def __init__(
        self,
        starter: Callable[[], Worker],
        jobs: Iterable[Input],
        count: int,
        rules: Rules,
        grace: float,
        left: int,
    ):
        self.starter, self.count, self.rules, self.grace = starter, count, rules, grace
        self.left, self.counted = left, left > 0  # jobs of the source; whether that is known
        self.source = iter(jobs)
        self.waiting: deque[Job] = deque()  # jobs to be done again
        self.suspects: deque[Job] = deque()
        self.workers: list[Worker] = []
        self.ready: deque[Done | Lost] = deque()
        self.selector = selectors.DefaultSelector()
        self.mean, self.weight = 0.0, 0  # seconds a job; how many jobs that rests on
        self.barren = 0

    # ---- jobs --------------------------------------------------------------------------------

    def next_batch(self) -> list[Job]:
        """Jobs for about `target_seconds`: few at first, and towards the end."""
        size = 1.0
        if self.weight and not self.barren:
            size = self.rules.target_seconds / max(self.mean, 1e-9)
            if self.counted:
                size = min(size, (self.left + len(self.waiting)) / (2 * self.count))
        batch: list[Job] = []
        while len(batch) < min(size, MOST_BATCH):
            job = self.waiting.popleft() if self.waiting else self.issue()
            if job is None:
                break
            batch.append(job)
        return batch

    def issue(self) -> Job | None:
        """The next job of the source, None at its end."""
        for name, payload, timeout in self.source:
            self.left = max(self.left - 1, 0)
            try:
                return Job(name, pickle.dumps(payload, pickle.HIGHEST_PROTOCOL), timeout)
            except Exception as error:
                self.ready.append(Lost(name, Reason.INTERNAL_ERROR, *described(error)))
        return None

    def finish(self, job: Job, answer: Answer, result: bytes) -> None:
        """A job has ended; one that had too little memory may try again, alone."""
        self.barren = 0
        known = min(self.weight, MEMORY)
        self.mean = (known * self.mean + answer.seconds) / (known + 1)
        self.weight = known + 1
        if answer.reason == Reason.OUT_OF_MEMORY:
            most = f"{self.rules.memory / 1e9:.3g} GB"
            self.suspect(job, answer.reason, f"needs more than the {most} that a worker may add")
        elif answer.reason:
            self.ready.append(Lost(job.id, answer.reason, answer.detail, answer.traceback))
        else:
            try:
                self.ready.append(Done(job.id, pickle.loads(result), answer.seconds))
            except Exception as error:
                self.ready.append(Lost(job.id, Reason.INTERNAL_ERROR, *described(error)))

    def suspect(self, job: Job, reason: str, detail: str) -> None:
        """Try a job once more, alone; a second time it is lost."""
        if job.suspect:
            self.ready.append(Lost(job.id, reason, f"{detail}, {AGAIN}"))
        else:
            self.suspects.append(replace(job, suspect=True))

    # ---- workers -----------------------------------------------------------------------------

    def at_work(self) -> bool:
        """Whether any job is not finished: while one waits, another is at work."""
        return bool(self.suspects) or not all(worker.idle for worker in self.workers)

    def deploy(self) -> None:
        """Give idle workers batches, and start new ones, each with a suspect if there is one."""
        for worker in self.workers:
            if worker.idle and (batch := self.next_batch()):
                self.assign(worker, batch)
        while len(self.workers) < self.count:
            batch = [self.suspects.popleft()] if self.suspects else self.next_batch()
            if not batch:
                break
            try:
                worker = self.start()
            except OSError as error:
                (self.suspects if batch[0].suspect else self.waiting).extendleft(reversed(batch))
                if not all(worker.idle for worker in self.workers):
                    break
                raise WorkersFailed(f"no worker process can be started: {error}") from error
            self.assign(worker, batch)

    def start(self) -> Worker:
        """Start a worker; what would end us in the meantime waits until it is on the list."""
        with signals_blocked():
            worker = self.starter()
            self.workers.append(worker)
            self.selector.register(worker.channel, selectors.EVENT_READ, worker)
        return worker

    def assign(self, worker: Worker, batch: list[Job]) -> None:
        """Hand a batch to a worker that has none."""
        worker.state[POSITION], worker.state[SINCE] = NONE_YET, NOT_RUNNING
        worker.batch, worker.idle = dict(enumerate(batch)), False
        payloads = [job.payload for job in batch]
        worker.outbox = memoryview(pickle.dumps(payloads, pickle.HIGHEST_PROTOCOL))
        self.send(worker)

    def send(self, worker: Worker) -> None:
        worker.send()
        writing = selectors.EVENT_WRITE if worker.outbox else 0
        self.selector.modify(worker.channel, selectors.EVENT_READ | writing, worker)

    def attend(self, patience: float) -> None:
        """Wait for workers, at most `patience` seconds, and do whatever has become necessary."""
        events = [(key.data, event) for key, event in self.selector.select(patience)]
        for worker, event in events:
            if event & selectors.EVENT_WRITE:
                self.send(worker)
            if event & selectors.EVENT_READ:
                alive = worker.receive()
                self.take(worker)
                if not alive:
                    self.bury(worker)
        now = time.monotonic()
        for worker in set(self.workers) - {worker for worker, _ in events}:
            if not worker.idle and worker.late(now, self.grace):
                worker.killed = now
                self.bury(worker)
        self.deploy()

    def take(self, worker: Worker) -> None:
        """Take in a worker's whole messages."""
        for answers, results, over in worker.messages():
            for answer, result in zip(answers, results, strict=True):
                self.finish(worker.batch.pop(answer.position), answer, result)
            if over:  # what it did not come to is given back
                self.waiting.extendleft(reversed(worker.batch.values()))
                worker.batch, worker.idle = {}, True

    def bury(self, worker: Worker) -> None:
        """End a worker, and see to its jobs: the one that began last may be why it died."""
        self.dismiss([worker])
        position, since = int(worker.state[POSITION]), worker.state[SINCE]
        job = worker.batch.pop(position, None)
        self.waiting.extendleft(reversed(worker.batch.values()))
        how = f"its worker ended by {ending(worker.process.exitcode)}"
        if position == NONE_YET:
            self.barren += 1
            if self.barren > BARREN:
                raise WorkersFailed(f"{self.barren} jobs could not even begin: {how}")
        elif job is None:
            return
        elif worker.killed == math.inf:
            self.suspect(job, Reason.WORKER_DIED, how)
        elif since != NOT_RUNNING and worker.killed - since > job.timeout:
            detail = f"more than {job.timeout:g} s of wall time; its worker was killed"
            self.ready.append(Lost(job.id, Reason.BUDGET_SECONDS, detail))
        else:
            self.suspect(job, Reason.WORKER_DIED, "its worker stood still and was killed")

    def dismiss(self, workers: list[Worker]) -> None:
        """Kill workers, wait for their ends, and take in what they had sent."""
        for worker in workers:
            worker.process.kill()
        for worker in workers:
            worker.process.join()
            worker.drain()
            self.take(worker)
            with signals_blocked():
                self.selector.unregister(worker.channel)
                worker.channel.close()
                self.workers.remove(worker)

    def end(self) -> None:
        """End all workers."""
        self.dismiss(list(self.workers))
        self.selector.close()

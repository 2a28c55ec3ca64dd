"""Jobs that are not finished, in batches for joblib, which waits for them in a thread."""

import contextlib
import itertools
import operator
import pickle
import queue
import time
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple

from joblib import Parallel

from compressor.reasons import Reason
from compressor.sweep.worker import Done, Lost, described

Input = tuple[Hashable, Any, float]  # id, payload, wall time that the job may take (s)
End = Done | Lost

TICK = 0.1  # s between two looks at the clocks of the jobs
MOST_BATCH = 200  # jobs
MOST_READY = 4  # batches a worker that wait to be taken before workers wait, too
MEMORY = 50  # jobs that a mean of their seconds rests on
AGAIN = "also when it ran again alone"


class Job(NamedTuple):
    """A job that is not finished; one that is retried runs alone."""

    id: Any
    payload: bytes
    timeout: float
    retried: bool = False


class Batches:
    """Jobs that are not finished, in batches as joblib takes them; what all its backends share.

    joblib waits in a thread of its own: it can do nothing else meanwhile, and an exception of a
    signal must not hit it.
    """

    parallel: Callable[[], Parallel]  # joblib's, for one round: called in the thread
    call: Callable[[list[Job]], Any]  # a batch as joblib takes it
    watch: Callable[[float, bool], None]  # called often: the time, whether something has arrived
    fail: Callable[[BaseException], Iterable[Lost]]  # a round ended by an error
    discard: Callable[[], None]  # ends what a job that is tried alone must not share with others
    stop: Callable[[], None]  # ends all workers; what had arrived stays

    def __init__(self, jobs: Iterable[Input], target_seconds: float, width: int):
        self.source, self.left = iter(jobs), operator.length_hint(jobs, 0)
        self.target_seconds, self.width = target_seconds, width  # width: batches at work at once
        self.waiting: deque[Job] = deque()  # to be done again
        self.suspects: deque[list[Job]] = deque()  # batches to be tried alone
        self.out: dict[int, list[Job]] = {}  # batches that joblib has, by number
        self.arrived: queue.SimpleQueue[Any] = queue.SimpleQueue()  # None: a round has ended
        self.mean, self.weight = 0.0, 0  # seconds a job; how many jobs that rests on
        self.most = MOST_BATCH
        self.stopped = self.alone = False  # alone: a suspect is tried
        self.round: Future[None] | None = None
        self.thread = ThreadPoolExecutor(1)
        self.decode: Callable[[bytes], Any] = pickle.loads

    def ends(self, pulse: Callable[[], object]) -> Generator[End, None, None]:
        """Yield how each job ended; workers end with the iterator."""
        try:
            yield from self.done(pulse)
        except GeneratorExit:
            raise
        except BaseException:
            self.stop()
            while not self.arrived.empty():
                if item := self.arrived.get():
                    yield from self.finish(*item)
            raise
        finally:
            self.stop()

    def done(self, pulse: Callable[[], object]) -> Iterator[End]:
        """Yield how each job ended; workers stay."""
        while self.round or self.begin() or not self.arrived.empty():
            item: Any = ()
            with contextlib.suppress(queue.Empty):
                item = self.arrived.get(timeout=TICK)
            self.watch(time.monotonic(), bool(item))
            if item:
                yield from self.finish(*item)
            elif item is None and self.round:
                error, self.round = self.round.exception(), None
                yield from self.fail(error) if error else ()
            pulse()

    def begin(self) -> bool:
        """Have joblib do what there is, or one suspect alone; False where all jobs are done."""
        batch = self.next_batch()
        batches = itertools.chain([batch], iter(self.next_batch, []))
        self.alone = not batch and bool(self.suspects)
        if self.alone:
            self.discard()
            batches = itertools.chain([self.suspects.popleft()])
        if batch or self.alone:
            self.round = self.thread.submit(self.run, batches)
        return self.round is not None

    def run(self, batches: Iterable[list[Job]]) -> None:
        """Have joblib do batches: in the thread. What they give arrives by `hand_over`."""
        begun = False

        def calls() -> Iterator[Any]:
            nonlocal begun
            for batch in batches:
                begun = True
                yield self.call(batch)

        try:
            for _ in self.parallel()(calls()):
                pass
        except BaseException:
            for batch in itertools.islice(batches, 0 if begun else 1):  # joblib has taken none
                if self.alone:
                    self.suspects.append(batch)
                else:
                    self.waiting.extendleft(reversed(batch))
            raise
        finally:
            self.arrived.put(None)

    def hand_over(self, number: int, found: Any) -> None:
        """A batch has ended: in joblib's thread."""
        self.arrived.put((self.out.pop(number), found))

    def next_batch(self) -> list[Job]:
        """Return the jobs for about `target_seconds`: few at first, and towards the end; none:
        that is all.
        """
        size = self.target_seconds / max(self.mean, 1e-9) if self.weight else 1.0
        if self.left:
            size = min(size, (self.left + len(self.waiting)) / (2 * self.width))
        batch: list[Job] = []
        while len(batch) < min(size, self.most):
            if self.stopped or self.arrived.qsize() > MOST_READY * self.width:
                break
            job = self.waiting.popleft() if self.waiting else self.issue()
            if job is None:
                break
            batch.append(job)
        return batch

    def issue(self) -> Job | None:
        """Return the next job of the source, None at its end."""
        for name, payload, timeout in self.source:
            self.left = max(self.left - 1, 0)
            try:
                return Job(name, pickle.dumps(payload, pickle.HIGHEST_PROTOCOL), timeout)
            except Exception as error:
                lost = Lost(None, Reason.INTERNAL_ERROR, *described(error))
                self.arrived.put(([Job(name, b"", timeout)], [lost]))
        return None

    def finish(self, batch: list[Job], found: Any) -> Iterator[End]:
        """Yield how the jobs of a batch ended; a rest that was given back waits again."""
        self.waiting.extendleft(reversed(batch[len(found) :]))
        for job, end in zip(batch, found, strict=False):
            if isinstance(end, Lost):
                again = end.reason == Reason.OUT_OF_MEMORY and AGAIN not in end.detail
                yield from self.lose(job, end, again)
                continue
            known = min(self.weight, MEMORY)
            self.mean, self.weight = (known * self.mean + end.seconds) / (known + 1), known + 1
            try:
                end = replace(end, id=job.id, result=self.decode(end.result))
            except Exception as error:
                end = Lost(job.id, Reason.INTERNAL_ERROR, *described(error))
            yield end

    def lose(self, job: Job, end: Lost, again: bool) -> Iterator[Lost]:
        """Yield a job is lost, or tried again, once and alone."""
        if again and not job.retried:
            self.suspects.append([job._replace(retried=True)])
        else:
            yield replace(end, id=job.id, detail=f"{end.detail}, {AGAIN}" if again else end.detail)

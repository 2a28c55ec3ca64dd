"""Run jobs in worker processes: one that crashes, hangs or eats memory costs itself only.

Starting, feeding and ending processes is the work of loky's executor of `concurrent.futures`, which
comes with joblib; on a cluster, of dask's client. Ours is what they cannot know: how many jobs make
a batch, which job was at work in a process that died or took too long, and what runs again.
"""

import contextlib
import copy
import itertools
import multiprocessing
import operator
import os
import pickle
import platform
import queue
import signal
import tempfile
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, NamedTuple

from joblib import cpu_count
from joblib.externals.loky import ProcessPoolExecutor
from joblib.externals.loky.backend import get_context

from compressor.program import THREAD_VARIABLES, CompsimError
from compressor.reasons import Reason
from compressor.sweep.worker import (
    ENDING,
    NOTE,
    JobLost,
    JobResult,
    Workers,
    describe_error,
    do_batch,
    init_worker,
)

Input = tuple[Hashable, Any, float]  # id, payload, wall time that the job may take (s)
End = JobResult | JobLost

TICK = 0.1  # s between two looks at the clocks of the jobs
MAX_BATCH = 200  # jobs
BATCHES_AHEAD = 3  # that a worker has at most: one at work, others on their way
MAX_JOBS_IN_MEAN = 50  # jobs that a mean of their seconds rests on
FAILED_ALONE = "also when it ran again alone"


class Job(NamedTuple):
    """A job that is not finished; one that is retried runs alone."""

    id: Any
    payload: Any
    timeout: float
    retried: bool = False


class Batches:
    """Jobs that are not finished, in batches for an executor; what both kinds of it share.

    Batches are sent in a thread: an exception of a signal must not hit an executor.
    """

    submit: Callable[[int, list[Job]], "Future[Any]"]  # a batch by number, to the executor
    watch: Callable[[float, bool], None]  # called often: the time, whether a batch has ended well
    ends_of: Callable[[int, Any], list[End]]  # what a batch gave: in order, but a rest given back
    fail: Callable[[int, BaseException], Iterable[JobLost]]  # a batch has ended by an error
    discard: Callable[[], None]  # ends what a job that is tried alone must not share with others
    end_pool: Callable[[], None]  # ends all workers; what had arrived stays

    def __init__(self, jobs: Iterable[Input], target_seconds: float, width: int):
        self.source, self.left = iter(jobs), operator.length_hint(jobs, 0)
        self.target_seconds, self.width = target_seconds, width  # width: batches at work at once
        self.waiting: deque[Job] = deque()  # to be done again
        self.suspects: deque[list[Job]] = deque()  # batches to be tried alone
        self.numbers = itertools.count()
        self.out: dict[int, list[Job]] = {}  # batches that the executor has, by number
        self.arrived: queue.SimpleQueue[tuple[int, Future[Any]]] = queue.SimpleQueue()
        self.mean, self.weight = 0.0, 0  # seconds a job; how many jobs that rests on
        self.most = MAX_BATCH
        self.drained = False  # no jobs are left in the source
        self.stopped = self.alone = False  # alone: a suspect is tried
        self.thread = ThreadPoolExecutor(1)
        self.decode: Callable[[bytes], Any] = pickle.loads

    def run(self, pulse: Callable[[], object]) -> Generator[End, None, None]:
        """Yield how each job ended; workers end with the iterator."""
        try:
            yield from self.run_pending(pulse)
        except GeneratorExit:  # a generator that is closed may yield nothing more
            raise
        except BaseException:
            self.stop()
            while not self.arrived.empty():
                yield from self.finish(*self.arrived.get())
            raise
        finally:
            self.stop()
            self.discard()

    def stop(self) -> None:
        """Send no more, and end all workers; what had arrived stays."""
        self.stopped = True
        self.thread.shutdown()
        self.end_pool()

    def run_pending(self, pulse: Callable[[], object]) -> Iterator[End]:
        """Yield how each job ended; workers stay."""
        self.sending = self.thread.submit(self.send)
        wait([self.sending], TICK)
        while True:
            if self.sending.done():
                self.sending.result()  # raises what jobs raise
                if self.drained and not (self.out or self.waiting or self.suspects):
                    return
                self.sending = self.thread.submit(self.send)
            item: Any = ()
            with contextlib.suppress(queue.Empty):
                item = self.arrived.get(timeout=TICK)
            self.watch(time.monotonic(), bool(item) and not error_of(item[1]))
            if item:
                yield from self.finish(*item)
            pulse()

    def send(self) -> None:
        """Send batches until enough are out; a suspect alone, once all others have ended."""
        while not self.alone and len(self.out) < BATCHES_AHEAD * self.width:
            if not (batch := self.next_batch()):
                break
            self.send_batch(batch)
        if self.suspects and not self.out and not self.stopped:
            self.alone = True
            self.discard()
            self.send_batch(self.suspects.popleft())

    def send_batch(self, batch: list[Job]) -> None:
        """Send a batch; however it ends, it arrives."""
        number = next(self.numbers)
        self.out[number] = batch
        try:
            ended = self.submit(number, batch)
        except Exception as error:  # the pool has broken, or cannot start
            ended = Future()
            ended.set_exception(error)
        ended.add_done_callback(lambda ended: self.arrived.put((number, ended)))

    def next_batch(self) -> list[Job]:
        """Return jobs for about `target_seconds`: few at first and towards the end; [] for none."""
        size = self.target_seconds / max(self.mean, 1e-9) if self.weight else 1.0
        if self.left:
            size = min(size, (self.left + len(self.waiting)) / (2 * self.width))
        batch: list[Job] = []
        while len(batch) < min(size, self.most) and not self.stopped:
            job = self.waiting.popleft() if self.waiting else self.issue()
            if job is None:
                break
            batch.append(job)
        return batch

    def issue(self) -> Job | None:
        """Return the next job of the source, None at its end."""
        for name, payload, timeout in self.source:
            self.left = max(self.left - 1, 0)
            return Job(name, payload, timeout)
        self.drained = True
        return None

    def finish(self, number: int, ended: "Future[Any]") -> Iterator[End]:
        """Yield how the jobs of a batch ended, if its pool was not given up before."""
        if number in self.out:
            if error := error_of(ended):
                wait([self.sending])
                yield from () if self.stopped else self.fail(number, error)
            else:
                found = self.ends_of(number, ended.result())
                yield from self.settle(self.out.pop(number), found)
        if self.alone and not self.out:
            wait([self.sending])  # or it might send the next suspect, which is then forgotten
            self.alone = False
            self.discard()

    def settle(self, batch: list[Job], found: list[End]) -> Iterator[End]:
        """Yield how jobs of a batch ended, by what it gave; the rest, given back, waits again."""
        self.waiting.extendleft(reversed(batch[len(found) :]))
        for job, end in zip(batch, found, strict=False):
            if isinstance(end, JobLost):
                again = end.reason == Reason.OUT_OF_MEMORY and FAILED_ALONE not in end.detail
                yield from self.lose(job, end, again)
                continue
            known = min(self.weight, MAX_JOBS_IN_MEAN)
            self.mean, self.weight = (known * self.mean + end.seconds) / (known + 1), known + 1
            try:
                end = replace(end, id=job.id, result=self.decode(end.result))
            except Exception as error:
                end = JobLost(job.id, Reason.INTERNAL_ERROR, *describe_error(error))
            yield end

    def lose(self, job: Job, end: JobLost, again: bool) -> Iterator[JobLost]:
        """Yield a job as lost where it has run again alone; else put it aside for that."""
        if again and not job.retried:
            self.suspects.append([job._replace(retried=True)])
        else:
            yield replace(
                end, id=job.id, detail=f"{end.detail}, {FAILED_ALONE}" if again else end.detail
            )


def pack_payloads(batch: list[Job]) -> bytes:
    """Return the pickled payloads of a batch, in which what jobs share stands once."""
    return pickle.dumps([job.payload for job in batch], pickle.HIGHEST_PROTOCOL)


def error_of(ended: "Future[Any]") -> BaseException | None:
    """Return what a batch raised, CancelledError where it never ran; None where it ended well."""
    return CancelledError() if ended.cancelled() else ended.exception()


STALL_SECONDS = 60.0  # s without any result, while no job runs, after which all workers are killed
# s that workers may take to begin: what they prepare may have to be compiled
MAX_START_SECONDS = 600.0
IDLE_SECONDS = 300.0  # after which a worker without a batch ends
FILES_PER_WORKER = 8  # of the run: its batches, and what loky opens for it
MAX_FRUITLESS = 10  # times in a row that workers may die without any job beginning or ending
ELSEWHERE = "run these jobs in a process of their own"
POOL = threading.Lock()
# BrokenPipeError: loky's own helper was killed
BROKEN_POOL_ERRORS = (BrokenProcessPool, BrokenPipeError)
MEMORY_SHARE = 0.75  # of the machine's memory, for all workers together
MEMORY_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


class WorkersFailed(CompsimError):
    """Worker processes cannot be started, or die before they begin a job."""


class UnsupportedSystem(CompsimError):
    """A system on which no jobs are run, such as Windows."""

    exit_code = 2


def require_posix() -> None:
    """Raise UnsupportedSystem where workers and store lack limits and locks: on Windows."""
    try:
        import fcntl  # noqa: F401
        import resource  # noqa: F401
    except ImportError as error:
        problem = f"{platform.system()} has no {error.name}, which a run needs"
        remedy = "run it under Linux, macOS or WSL, and open the folder of results here"
        raise UnsupportedSystem(f"{problem}: {remedy}") from error


def run_batches(
    work: Callable[[Any], Any],
    jobs: Iterable[Input],
    workers: Workers,
    pulse: Callable[[], object] = lambda: None,
) -> Generator[End, None, None]:
    """Yield how each job ended, for whose payload a worker process has called `work`.

    `jobs` is read as workers need it, in a thread; where it has a length, batches shrink towards
    the end. What `work` raises makes its job a JobLost. `pulse` is called several times a second,
    whether or not jobs end.

    Closing the iterator kills the workers. Whatever is raised here, a signal's exception too, comes
    after the results that had arrived (`drain` does the same for what the caller raises). Raises
    WorkersFailed, also where another call in this process has not ended, and what `jobs` raises.
    """
    if multiprocessing.current_process().daemon:
        raise WorkersFailed(f"a daemonic process may start no workers: {ELSEWHERE}")
    if not POOL.acquire(blocking=False):  # children() mixes the workers of two calls
        raise WorkersFailed(f"other jobs run in this process: wait until they end, or {ELSEWHERE}")
    try:
        yield from Local(work, jobs, workers).run(pulse)
    finally:
        POOL.release()


def drain(ends: Generator[End, None, None], error: BaseException) -> Iterator[End]:
    """Yield what had arrived when the loop over `run_batches` failed; then raise that error."""
    with contextlib.suppress(StopIteration):
        yield ends.throw(error)
        yield from ends


class Local(Batches):
    """Jobs in processes of this machine, on a pool that ends with any of its processes.

    Each batch has a file in memory that its worker shares. A note in it says which process is at
    which job, and since when: nothing else names the job in which a process died, hung in compiled
    code or stood still. Results come in it, too: through loky's pipe a worker that died amid a long
    message would leave loky reading the rest for ever.
    """

    def __init__(self, work: Callable[[Any], Any], jobs: Iterable[Input], rules: Workers):
        count = min(rules.count, operator.length_hint(jobs, 0) or rules.count)
        super().__init__(jobs, rules.target_seconds, count)
        self.rules = replace(rules, memory=rules.memory or memory_share(count))
        self.work = work
        self.files: dict[int, SharedFile] = {}  # of the batches that are out
        self.executor: ProcessPoolExecutor | None = None
        self.sender = 0  # the thread that sends batches
        self.processes: dict[int, Any] = {}
        self.late: set[int] = set()  # processes that were killed for taking too long
        self.fruitless, self.last_news = 0, 0.0  # last_news: when a batch was last sent, or ended
        self.begun = False  # whether a job of this pool has
        self.unprepared = 0  # answers in a row of workers that could not begin

    def start(self) -> ProcessPoolExecutor:
        """Return a new pool, of one process for a suspect."""
        import resource  # not on Windows, where nothing is run

        # helper processes remove what a SIGKILL of ours leaves, and are replaced: in silence
        os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker")
        warnings.filterwarnings("ignore", "resource_tracker")
        resource_tracker.ensure_running()  # before: Python 3.11 lets signals in as it starts this
        signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)  # in new workers, too, until they settle
        needed = FILES_PER_WORKER * self.width + 128
        limit, most = resource.getrlimit(resource.RLIMIT_NOFILE)
        if limit != resource.RLIM_INFINITY and limit < needed:
            with contextlib.suppress(ValueError, OSError):  # then as many as there may be
                resource.setrlimit(resource.RLIMIT_NOFILE, (needed, most))
        environment = dict.fromkeys(THREAD_VARIABLES, "1")
        environment["PYTHONFAULTHANDLER"] = ""  # or loky has a crash print where it was
        return ProcessPoolExecutor(
            1 if self.alone else self.width, timeout=IDLE_SECONDS, initializer=init_worker,
            initargs=(self.work, self.rules, os.getpid()), env=environment, context=self.context(),
        )  # fmt: skip

    def context(self) -> Any:
        """Return loky's context, which starts no process any more once the run is stopped.

        loky starts all processes of a pool in one call, which a signal would have to wait for. Its
        own thread, which replaces some, must not meet the exception.
        """
        context: Any = copy.copy(get_context("loky"))
        make_process = context.Process

        def make_unless_stopped(*arguments: Any, **named: Any) -> Any:
            if self.stopped and threading.get_ident() == self.sender:
                raise CancelledError
            return make_process(*arguments, **named)

        context.Process = make_unless_stopped
        return context

    def submit(self, number: int, batch: list[Job]) -> "Future[Any]":
        self.executor = self.executor or self.start()
        data = pack_payloads(batch)
        self.files[number] = file = SharedFile()
        self.last_news, self.sender = time.monotonic(), threading.get_ident()
        return self.executor.submit(do_batch, file.path, data, len(batch))

    def ends_of(self, number: int, problem: str) -> list[End]:
        """Return how jobs ended, from the file of their batch. Raises WorkersFailed."""
        if not problem:
            self.unprepared = 0
            return self.files.pop(number).read()
        self.files.pop(number).close()
        self.unprepared += 1
        if not self.stopped and (not self.weight or self.unprepared > MAX_FRUITLESS):
            raise WorkersFailed(f"jobs could not even begin: {problem}")
        return []

    def watch(self, now: float, news: bool) -> None:
        """Kill workers whose jobs take too long, and all of them where nothing moves any more.

        Where all have died and loky does not say so, its thread has died, too (joblib/loky#663):
        its batches would never end.
        """
        alive = {child.pid: child for child in children()}
        self.processes = self.processes | alive
        if news:
            self.last_news, self.fruitless, self.most = now, 0, MAX_BATCH
        latest, at_work = self.last_news, False
        for number, file in [*self.files.items()]:
            pid, position, since = file.note()
            latest, at_work = max(latest, abs(since)), at_work or (since > 0 and pid in alive)
            # compiled code looks at the clock itself: this is for jobs that hang outside of it
            if since > 0 and now - since > self.out[number][position].timeout + self.rules.grace:
                self.late.add(pid)
                kill([pid])
        self.begun = self.begun or latest > self.last_news
        dead = bool(self.processes) and not alive
        patience = STALL_SECONDS if self.begun or dead else MAX_START_SECONDS
        if self.out and not at_work and now - latest > patience:
            kill(alive)
            if dead:
                broken: Future[Any] = Future()
                broken.set_exception(BrokenProcessPool())
                self.arrived.put((max(self.out), broken))

    def fail(self, number: int, error: BaseException) -> Iterator[JobLost]:
        """Yield the jobs that are lost with a broken pool; the others wait to run again.

        A job that ran in the process that died may be the cause, and is tried alone.
        """
        if not isinstance(error, BROKEN_POOL_ERRORS):
            if isinstance(error, OSError) and not self.processes:
                raise WorkersFailed(f"no worker process can be started: {error}") from error
            raise error
        self.end_pool()
        # loky ends the whole pool with one process: the others die by SIGKILL, and their jobs are
        # no culprits, unless no process died by itself and so nobody can be named
        codes = {pid: child.exitcode for pid, child in self.processes.items()}
        died = {pid for pid, code in codes.items() if code not in (None, -signal.SIGKILL)}
        notes = {number: file.note() for number, file in self.files.items()}
        running = {number: pid for number, (pid, _, since) in notes.items() if since > 0}
        named = [number for number, pid in running.items() if pid in died | self.late]
        largest = max(map(len, self.out.values()), default=1)
        for number, batch in self.out.items():
            if number in (named or running):  # loky has killed the others, also by SIGKILL
                pid, position, _ = notes[number]
                yield from self.blame(batch.pop(position), pid in self.late, codes.get(pid))
            if batch and self.alone:
                self.suspects.append(batch)
            else:
                self.waiting.extendleft(reversed(batch))
        if not running:  # nobody is named: smaller batches will show
            self.fruitless, self.most = self.fruitless + 1, max(1, largest // 2)
            if self.fruitless > MAX_FRUITLESS:
                how = batch_ending(next((codes[pid] for pid in died), None))
                raise WorkersFailed(f"jobs could not even begin: {how}")
        self.discard()

    def blame(self, job: Job, late: bool, code: int | None) -> Iterator[JobLost]:
        """Yield a job whose process died, or was killed since the job took too long, as lost."""
        reason, text = Reason.WORKER_DIED, f"its worker ended by {batch_ending(code)}"
        if late:
            reason = Reason.BUDGET_SECONDS
            text = f"more than {job.timeout:g} s of wall time; its worker was killed"
        yield from self.lose(job, JobLost(None, reason, text), not late)

    def end_pool(self) -> None:
        """End all processes, if there are any; what had arrived stays."""
        if self.executor:
            ended = threading.Event()

            def kill_all() -> None:  # loky may start others in place of those that end
                while not ended.is_set():
                    kill(child.pid for child in children())
                    ended.wait(TICK)

            # not `kill_workers`: loky 3.6 forgets batches that its thread then looks for, which
            # dies of a KeyError and leaves threads and files open
            killer = threading.Thread(target=kill_all, daemon=True)
            killer.start()
            try:
                with contextlib.suppress(BrokenPipeError):
                    self.executor.shutdown()
            finally:
                ended.set()
                killer.join()
            for child in children():  # of a start that was cut short, which loky forgets
                kill([child.pid])
                child.join()
        self.executor = None

    def discard(self) -> None:
        """End all processes, and forget the batches that they had."""
        self.end_pool()
        self.processes, self.late, self.begun, self.out = {}, set(), False, {}
        while self.files:
            self.files.popitem()[1].close()


class SharedFile:
    """A file of a batch: a note, then results. In memory where it can be one, which ends with us.

    Python's own shared memory is removed by whichever process of it ends first, once the process
    that keeps count of it has been killed.
    """

    def __init__(self) -> None:
        try:
            self.number = os.memfd_create("a batch of compsim")
            self.path = f"/proc/{os.getpid()}/fd/{self.number}"
            if not os.path.exists(self.path):
                os.close(self.number)
                raise FileNotFoundError(self.path)
        except (AttributeError, OSError):  # not Linux, an old kernel, a sandbox, no /proc
            self.number, self.path = tempfile.mkstemp()
        os.truncate(self.number, NOTE.size)

    def note(self) -> tuple[int, int, float]:
        """Return the process and job of a batch, and since when the job runs, or minus its end.

        Zeros: none has begun.
        """
        pid, position, since = NOTE.unpack(os.pread(self.number, NOTE.size, 0))
        return int(pid), int(position), since

    def read(self) -> Any:
        """Return what the worker has left, and close the file."""
        with open(self.number, "rb", closefd=False) as file:
            file.seek(NOTE.size)
            found = pickle.load(file)
        self.close()
        return found

    def close(self) -> None:
        """Close the file, and remove it where it is one on disk."""
        os.close(self.number)
        with contextlib.suppress(OSError):
            os.unlink(self.path)


def children() -> list[Any]:
    """Return the processes that loky has started and that run."""
    return [c for c in multiprocessing.active_children() if c.name.startswith("LokyProcess")]


def kill(pids: Iterable[int]) -> None:
    """Send SIGKILL to processes; some may be gone."""
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def batch_ending(code: int | None) -> str:
    """Return how a process ended, from its exit code (less the signal's number)."""
    if code is None or code >= 0:
        return "an unknown cause" if code is None else f"exit code {code}"
    if code == -signal.SIGKILL:
        return "SIGKILL: out of memory, or killed from outside"
    return signal.Signals(-code).name


def cores() -> int:
    """Return how many cores this process may use, by its affinity and its container's quota."""
    return cpu_count()


def memory_share(count: int) -> int:
    """Return the bytes for each of `count` workers, of three quarters of the memory there is.

    That is the machine's, or the container's where it has a limit.
    """
    most = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    for path in MEMORY_LIMITS:
        with contextlib.suppress(OSError, ValueError):  # absent, or "max"
            most = min(most, int(Path(path).read_text()))
    return int(MEMORY_SHARE * most / count)

"""Run jobs in joblib's worker processes: one that crashes, hangs or eats memory costs itself only.

Starting, feeding and ending processes is joblib's work (its loky backend here, its dask backend in
`cluster`). Ours is what it cannot know: how many jobs make a batch, which job was at
work in a process that died or took too long, and what runs again.
"""

import contextlib
import itertools
import math
import mmap
import multiprocessing
import operator
import os
import pickle
import platform
import queue
import signal
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import replace
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, NamedTuple

from joblib import Parallel, cpu_count, delayed
from joblib.externals.loky import get_reusable_executor
from joblib.externals.loky.backend import resource_tracker as loky_tracker
from joblib.externals.loky.backend.process import LokyProcess
from joblib.externals.loky.process_executor import BrokenProcessPool
from joblib.parallel import LokyBackend

from compressor.program import CompsimError, ignore_warnings
from compressor.reasons import Reason
from compressor.sweep.worker import (
    ENDING,
    NOTE,
    WHY,
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
MAX_READY = 4  # batches a worker that wait to be taken before workers wait, too
MEMORY = 50  # jobs that a mean of their seconds rests on
FAILED_ALONE = "also when it ran again alone"


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
    fail: Callable[[BaseException], Iterable[JobLost]]  # a round ended by an error
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
        self.most = MAX_BATCH
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
        """Return the jobs for about `target_seconds`: few at first, and towards the end.

        None: that is all.
        """
        size = self.target_seconds / max(self.mean, 1e-9) if self.weight else 1.0
        if self.left:
            size = min(size, (self.left + len(self.waiting)) / (2 * self.width))
        batch: list[Job] = []
        while len(batch) < min(size, self.most):
            if self.stopped or self.arrived.qsize() > MAX_READY * self.width:
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
                lost = JobLost(None, Reason.INTERNAL_ERROR, *describe_error(error))
                self.arrived.put(([Job(name, b"", timeout)], [lost]))
        return None

    def finish(self, batch: list[Job], found: Any) -> Iterator[End]:
        """Yield how the jobs of a batch ended; a rest that was given back waits again."""
        self.waiting.extendleft(reversed(batch[len(found) :]))
        for job, end in zip(batch, found, strict=False):
            if isinstance(end, JobLost):
                again = end.reason == Reason.OUT_OF_MEMORY and FAILED_ALONE not in end.detail
                yield from self.lose(job, end, again)
                continue
            known = min(self.weight, MEMORY)
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


STALL = 60.0  # s without any result, while no job runs, after which all workers are killed
# s that workers may take to begin: what they prepare may have to be compiled
MAX_START_SECONDS = 600.0
UNSEEN = 3.0  # s that joblib may take to see that a worker died
FRUITLESS = 10  # times in a row that workers may die without any job beginning or ending
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
    """Call work(payload) for each job in worker processes; yield how each one ended.

    `jobs` is read as workers need it, in a thread; where it has a length, batches shrink towards
    the end. What `work` raises makes its job Lost. `pulse` is called several times a second,
    whether or not jobs end.

    Closing the iterator kills the workers. Whatever is raised here, a signal's exception too, comes
    after the results that had arrived (`rest` does the same for what the caller raises). Raises
    WorkersFailed, also where another call in this process has not ended, and what `jobs` raises.
    """
    if multiprocessing.current_process().daemon:
        raise WorkersFailed(f"a daemonic process may start no workers: {ELSEWHERE}")
    if not POOL.acquire(blocking=False):  # loky has one for the process: two would end each other's
        raise WorkersFailed(f"other jobs run in this process: wait until they end, or {ELSEWHERE}")
    try:
        yield from Local(work, jobs, workers).ends(pulse)
    finally:
        POOL.release()


def rest(ends: Generator[End, None, None], error: BaseException) -> Iterator[End]:
    """After an error in the loop over `run_batches`: what had arrived by then, then the error."""
    with contextlib.suppress(StopIteration):
        yield ends.throw(error)
        yield from ends


class Loky(LokyBackend):
    """joblib's loky backend, which tells of a batch at once, in its thread.

    What waits in joblib's generator would be lost, and run again, when a worker dies.
    """

    def __init__(self, hand_over: Callable[[int, Any], None]):
        super().__init__(inner_max_num_threads=1)
        self.hand_over = hand_over

    def retrieve_result_callback(self, out: Any) -> list[None]:
        self.hand_over(*super().retrieve_result_callback(out)[0])
        return [None]


class Local(Batches):
    """Jobs in processes of this machine, on a pool that ends with any of its processes.

    A note in shared memory tells of every batch which process is at which of its jobs, and since
    when. Nothing else names the job in which a process died, hung in compiled code or stood still:
    joblib knows batches alone, and fails all of them at once.
    """

    def __init__(self, work: Callable[[Any], Any], jobs: Iterable[Input], rules: Workers):
        super().__init__(jobs, rules.target_seconds, rules.count)
        self.rules = replace(rules, memory=rules.memory or memory_share(rules.count))
        self.places = 4 * max(rules.count, 2)  # for notes: more than joblib asks for
        self.shared, self.path = shared_file(self.places * NOTE.size + WHY)
        self.notes: Any = mmap.mmap(self.shared, 0)
        self.initargs = (work, self.rules, self.path, os.getpid())
        self.pool = self.executor = None  # type: Any
        self.heard = 0.0  # when a batch was last handed out, or ended
        self.died: float = math.inf  # when a process was first seen to have died
        self.fruitless, self.begun = 0, False  # begun: a job of this pool has
        self.discard()

    def parallel(self) -> Parallel:
        """Return the pool; a new one after a death, and for a suspect: in the thread.

        joblib would do a single job at a time in this process: it is told of two, loky of one.
        """
        # helper processes remove what a SIGKILL of ours leaves: in silence
        os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker")
        resource_tracker.ensure_running()  # before: Python 3.11 lets signals in as it starts this
        signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)  # in new workers, too, until they settle
        if self.pool is None:
            self.pool = Parallel(
                max(self.width, 2), Loky(self.hand_over), "generator_unordered", batch_size=1,
                pre_dispatch=2 * self.width, max_nbytes=None, temp_folder=tempfile.gettempdir(),
                initializer=init_worker, initargs=self.initargs,
            ).__enter__()  # fmt: skip
            self.executor = get_reusable_executor(1 if self.alone else self.width, reuse=True)
        return self.pool

    def call(self, batch: list[Job]) -> Any:
        place = self.free.popleft()
        NOTE.pack_into(self.notes, place * NOTE.size, 0, 0, 0)
        self.out[place], self.heard = batch, time.monotonic()
        return delayed(do_batch)(place, [job.payload for job in batch])

    def hand_over(self, number: int, found: Any) -> None:
        super().hand_over(number, found)
        self.free.append(number)

    def note(self, place: int) -> tuple[int, int, float]:
        """Return the process and job of a batch.

        Since when the job runs, or minus its end; 0: none yet.
        """
        pid, position, since = NOTE.unpack_from(self.notes, place * NOTE.size)
        return int(pid), int(position), since

    def watch(self, now: float, news: bool) -> None:
        """Kill workers whose jobs take too long, and all of them where nothing moves any more."""
        revive_tracker()
        self.processes |= {child.pid: child for child in children()}
        if news:
            self.heard, self.fruitless, self.most = now, 0, MAX_BATCH
        latest, at_work = self.heard, False
        for place, batch in list(self.out.items()):
            pid, position, since = self.note(place)
            latest, at_work = max(latest, abs(since)), at_work or since > 0
            # compiled code looks at the clock itself: this is for jobs that hang outside of it
            if since > 0 and now - since > batch[position].timeout + self.rules.grace:
                self.late.add(pid)
                kill([pid])
        dead = any(child.exitcode for child in self.processes.values())
        self.died = min(self.died, now) if dead else math.inf
        self.begun = self.begun or latest > self.heard
        if (
            self.round
            and not at_work
            and now - latest > (STALL if self.begun else MAX_START_SECONDS)
        ):
            kill(self.processes)
        if self.round and now - self.died > UNSEEN:
            self.unblock()

    def unblock(self) -> None:
        """Have joblib see that a worker died, which it should within milliseconds.

        One that died amid a message leaves joblib reading the rest of it for ever, since this
        process, too, could write there: loky keeps that end open.
        """
        kill(child.pid for child in children())
        results = getattr(self.executor, "_result_queue", None)
        if results and not children():  # loky will close it, perhaps at this moment
            with contextlib.suppress(OSError), open(os.devnull, "wb") as nobody:
                os.dup2(nobody.fileno(), results._writer.fileno())

    def fail(self, error: BaseException) -> Iterator[JobLost]:
        """Yield the jobs that are lost with a broken pool; the others wait to run again.

        A job that ran in the process that died may be the cause, and is tried alone.
        """
        if not isinstance(error, BROKEN_POOL_ERRORS):
            if isinstance(error, OSError) and not self.processes:
                raise WorkersFailed(f"no worker process can be started: {error}") from error
            raise error
        # loky ends the whole pool with one process: the others die by SIGKILL, and their jobs are
        # no culprits, unless no process died by itself and so nobody can be named
        codes = {pid: child.exitcode for pid, child in self.processes.items()}
        died = {pid for pid, code in codes.items() if code not in (None, -signal.SIGKILL)}
        notes = {place: self.note(place) for place in self.out}
        running = {place: pid for place, (pid, _, since) in notes.items() if since > 0}
        named = [place for place, pid in running.items() if pid in died | self.late]
        largest = max(map(len, self.out.values()), default=1)
        for place, batch in self.out.items():
            if place in (named or running):  # joblib has killed the others, also by SIGKILL
                pid, position, _ = notes[place]
                yield from self.blame(batch.pop(position), pid in self.late, codes.get(pid))
            if batch and self.alone:
                self.suspects.append(batch)
            else:
                self.waiting.extendleft(reversed(batch))
        if not running:  # nobody is named: smaller batches will tell
            self.fruitless, self.most = self.fruitless + 1, max(1, largest // 2)
            if self.fruitless > FRUITLESS:
                why = self.notes[-WHY:].rstrip(b"\0").decode(errors="replace")
                how = why or batch_ending(next((codes[pid] for pid in died), None))
                raise WorkersFailed(f"jobs could not even begin: {how}")
        self.discard()

    def blame(self, job: Job, late: bool, code: int | None) -> Iterator[JobLost]:
        """Yield a job whose process died, or was killed since the job took too long, as lost."""
        reason, text = Reason.WORKER_DIED, f"its worker ended by {batch_ending(code)}"
        if late:
            reason = Reason.BUDGET_SECONDS
            text = f"more than {job.timeout:g} s of wall time; its worker was killed"
        yield from self.lose(job, JobLost(None, reason, text), not late)

    def discard(self) -> None:
        """End the pool, if there is one."""
        if self.executor:
            with contextlib.suppress(BrokenPipeError):
                self.executor.terminate(kill_workers=True)
            kill(child.pid for child in children())
        self.pool = self.executor = None
        self.processes: dict[int, Any] = {}
        self.late: set[int] = set()  # processes that were killed for taking too long
        self.died, self.begun = math.inf, False
        self.out, self.free = {}, deque(range(self.places))

    def stop(self) -> None:
        self.stopped = True
        while self.round and not self.round.done():
            kill(child.pid for child in children())
            self.watch(time.monotonic(), False)
            wait([self.round], TICK)
        self.thread.shutdown()
        self.discard()
        if self.notes:
            self.notes = self.notes.close()
            os.close(self.shared)
            with contextlib.suppress(OSError):
                os.unlink(self.path)  # where it is a file on disk


def shared_file(size: int) -> tuple[int, str]:
    """Return a file that workers can map, and its path: where it can be one in memory, which ends
    with us.

    Python's own shared memory is removed by whichever process of it ends first, once the process
    that keeps count of it has been killed.
    """
    try:
        number = os.memfd_create("notes of compsim's workers")
        path = f"/proc/{os.getpid()}/fd/{number}"
        if not os.path.exists(path):
            os.close(number)
            raise FileNotFoundError(path)
    except (AttributeError, OSError):  # not Linux, an old kernel, a sandbox, no /proc
        number, path = tempfile.mkstemp()
    os.truncate(number, size)
    return number, path


def revive_tracker() -> None:
    """Start loky's helper again where it was killed, silent: it never knew the names it is told."""
    pid = loky_tracker._resource_tracker._pid
    if pid is None or sys.platform != "linux":
        return
    with contextlib.suppress(ChildProcessError):
        if os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
            return
    ours, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        with ignore_warnings():
            loky_tracker.ensure_running()
    finally:
        os.dup2(ours, 2)
        os.close(ours)
        os.close(nowhere)


def children() -> list[Any]:
    """Return the processes that loky has started and that run."""
    return [c for c in multiprocessing.active_children() if isinstance(c, LokyProcess)]


def kill(pids: Iterable[int]) -> None:
    """SIGKILL."""
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
    """Return the bytes for each of `count` workers: three quarters of the machine's, or the
    container's.
    """
    most = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    for path in MEMORY_LIMITS:
        with contextlib.suppress(OSError, ValueError):  # absent, or "max"
            most = min(most, int(Path(path).read_text()))
    return int(MEMORY_SHARE * most / count)

"""Run jobs in worker processes: one that crashes, hangs or eats memory costs itself only.

joblib gives threads, their queue and their results. Each thread uses one process at a time, with a
pipe that breaks if that dies: so a death names its own job, and costs no other process. All are
copies of one process, the loader, that has loaded the equations, which takes two seconds, and runs
no job; should that die, all are made anew.
"""

import contextlib
import itertools
import math
import operator
import os
import pickle
import platform
import signal
import socket
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator
from dataclasses import replace
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

from joblib import Parallel, cpu_count, delayed

from compressor.program import THREAD_VARIABLES, CompsimError
from compressor.reasons import Reason
from compressor.store import StoreError
from compressor.sweep.worker import NO_WORKER, End, Store, Workers, WorkersFailed

cores = cpu_count  # that this process may use, by its affinity and its container's quota
Input = tuple[Hashable, Any, float]  # id, payload, wall time that the job may take (s)

TICK = 0.1  # s between two looks at a worker that is silent
MAX_BATCH = 200  # jobs
MAX_JOBS_IN_MEAN = 50  # jobs that a mean of their seconds rests on
MAX_SILENCE = 600.0  # s in which a worker begins (compiling, maybe), or stores a batch
MAX_FRUITLESS = 10  # processes in a row that may die before any job begins
END_SECONDS = 1.0  # s in which processes that are not at work end
MEMORY_SHARE = 0.75  # of the machine's memory, for all workers together
MEMORY_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
START = (  # the loader's program, which has our path and not our main module
    "import gc, sys; gc.disable(); from multiprocessing.connection import Connection; "
    "pipe = Connection(int(sys.argv[1])); sys.path[:] = pipe.recv(); "
    "from compressor.sweep.worker import serve; serve(pipe)"
)


class UnsupportedSystem(CompsimError):
    """A system on which no jobs are run, such as Windows."""


class Job(NamedTuple):
    """A job that is not finished; one that is tried again runs alone."""

    id: Any
    payload: Any
    timeout: float
    again: bool = False


def require_posix() -> None:
    """Raise UnsupportedSystem where workers lack limits: on Windows."""
    try:
        import resource  # noqa: F401
    except ImportError as error:
        problem = f"{platform.system()} has no {error.name}, which a run needs"
        remedy = "run it under Linux, macOS or WSL, and open the folder of results here"
        raise UnsupportedSystem(f"{problem}: {remedy}") from error


def run_batches(
    work: Callable[[Any], Any], jobs: Iterable[Input], workers: Workers, store: Store | None = None
) -> Generator[End, None, None]:
    """Yield how each job ended, for whose payload a worker process has called `work`.

    jobs: read as workers need them; where they have a length, batches shrink towards the end.
    store: called with the results of a batch in the worker; returns what is sent home for each.
    Both functions must be found by name in another process. What `work` raises is why its job has
    no result, but a StoreError ends the call. Closing the iterator kills the workers. Raises
    StoreError, WorkersFailed, and what `jobs` raises.
    """
    pool = Pool(work, jobs, workers, store)
    ends: Iterator[list[End]] = iter(())
    with Parallel(pool.batches.width, "threading", "generator_unordered") as parallel:
        try:
            while pool.batches.waiting or not pool.batches.drained:  # given back by the last, too
                ends = parallel(delayed(pool.do)(batch) for batch in iter(pool.next_batch, []))
                for found in ends:
                    yield from found
        finally:
            pool.stop()
            with contextlib.suppress(Exception):  # others that had come, too
                deque(ends, 0)  # joblib would warn of what is not taken


class Batches:
    """Jobs that are not finished, in batches that take about `target_seconds`."""

    def __init__(self, jobs: Iterable[Input], target_seconds: float, width: int):
        self.source, self.left = iter(jobs), operator.length_hint(jobs, 0)
        self.target_seconds, self.width = target_seconds, width  # width: batches at work at once
        self.waiting: deque[list[Job]] = deque()  # to be run before what is left in the source
        self.drained = False  # no jobs are left in the source
        self.mean, self.weight = 0.0, 0  # seconds a job; how many jobs that rests on

    def next(self) -> list[Job]:
        """Return the next batch, of few jobs at first and towards the end; [] where none is left.

        Jobs may wait again after that.
        """
        size = self.target_seconds / max(self.mean, 1e-9) if self.weight else 1.0
        if self.left:  # an eighth is enough to end together, and leaves few small files
            size = max(size / 8, min(size, self.left / (2 * self.width)))
        count = min(max(1, math.ceil(size)), MAX_BATCH)
        if not self.waiting:
            new = [Job(*job) for job in itertools.islice(self.source, count)]
            self.left, self.drained = max(self.left - len(new), 0), len(new) < count
            return new
        batch = self.waiting.popleft()
        if batch[count:]:
            self.waiting.appendleft(batch[count:])
        return batch[:count]

    def learn(self, seconds: float) -> None:
        """Learn that a job has taken so long."""
        known = min(self.weight, MAX_JOBS_IN_MEAN)
        self.mean, self.weight = (known * self.mean + seconds) / (known + 1), known + 1


class Pool:
    """The workers of this machine, one for each thread that comes to `do` batches."""

    def __init__(
        self,
        work: Callable[[Any], Any],
        jobs: Iterable[Input],
        rules: Workers,
        store: Store | None = None,
    ):
        width = min(rules.count, operator.length_hint(jobs, 0) or rules.count)
        self.rules = replace(rules, memory=rules.memory or memory_share(width))
        self.batches = Batches(jobs, rules.target_seconds, width)
        self.setup = pickle.dumps((os.getpid(), work, store, self.rules))
        self.fruitless = 0  # times in a row that processes have died before any job began
        self.lock, self.stopped = threading.Lock(), False
        self.loader: Loader | None = None
        self.idle: list[Worker] = []

    def next_batch(self) -> list[Job]:
        """Return the next batch, [] where none is left or no more are to be run."""
        return [] if self.stopped else self.batches.next()

    def do(self, batch: list[Job]) -> list[End]:
        """Return how jobs of a batch ended in a worker; others wait to run again.

        Raises StoreError, and WorkersFailed.
        """
        try:
            worker = self.take_worker()
            answer = worker.ask(batch, self.rules.grace)
        except Death as death:
            return [] if self.stopped else self.lose(batch, death)
        if isinstance(answer, StoreError):
            raise answer
        self.idle.append(worker)
        self.fruitless = 0
        if rest := batch[len(answer) :]:
            self.batches.waiting.appendleft(rest)
        return [self.settle(job, end) for job, end in zip(batch, answer, strict=False)]

    def take_worker(self) -> "Worker":
        """Return a worker that is idle, or a new one. Raises Death, also when the pool is stopped.

        Raises WorkersFailed.
        """
        try:
            with self.lock:
                if self.stopped:
                    raise Death("the pool's end")
                if self.idle:
                    return self.idle.pop()
                if not self.loader or self.loader.process.poll() is not None:
                    self.loader = Loader(self.setup)
            return self.loader.start_worker()
        except OSError as error:
            raise WorkersFailed(NO_WORKER.format(error)) from error

    def settle(self, job: Job, end: End) -> End:
        """Return the end of a job with its id."""
        if end.reason in ("", Reason.INTERNAL_ERROR):
            self.batches.learn(end.seconds)
        elif end.reason == Reason.OUT_OF_MEMORY:
            most = f"{self.rules.memory / 1e9:.3g} GB that a worker may add"
            end = end._replace(detail=f"needs more than the {most}")
        return end._replace(id=job.id)

    def lose(self, batch: list[Job], died: "Death") -> list[End]:
        """Return the job that is lost with its worker, if any; the others wait to run again.

        A job that was at work when its worker died is tried again alone, since an outsider may have
        killed it. Raises WorkersFailed.
        """
        waiting, half = self.batches.waiting, len(batch) // 2
        if died.place is None:
            self.fruitless += 1
            if self.fruitless > MAX_FRUITLESS + self.batches.width:  # all wait for one loader
                raise WorkersFailed(f"jobs could not even begin: {died.how}")
            waiting.append(batch)
            return []
        if died.place == len(batch) > 1:  # amid storing: the half with the cause will show
            waiting.extend([batch[:half], batch[half:]])
            return []
        job = batch.pop(min(died.place, len(batch) - 1))
        if batch:
            waiting.appendleft(batch)
        if died.late:
            text = f"more than {job.timeout:g} s of wall time; its worker was killed"
            return [End(job.id, reason=Reason.BUDGET_SECONDS, detail=text)]
        if job.again:
            text = f"its worker ended by {died.how}, also when it ran again alone"
            return [End(job.id, reason=Reason.WORKER_DIED, detail=text)]
        waiting.append([job._replace(again=True)])
        return []

    def stop(self) -> None:
        """End all workers, and start no more."""
        with self.lock:
            self.stopped = True
        if self.loader:
            self.loader.end()


class Death(Exception):
    """How a process has ended amid a batch.

    place: of the job at work, the number of all while they are stored, None before; late: the job
    took too long.
    """

    def __init__(self, how: str, place: int | None = None, late: bool = False):
        super().__init__(how)
        self.how, self.place, self.late = how, place, late


class Loader:
    """The process of which workers are copies, from the outside; see `worker.serve`."""

    def __init__(self, setup: bytes):
        self.calls, theirs = Pipe()
        self.lock = threading.Lock()  # a call at a time
        with theirs:
            self.process = subprocess.Popen(
                [sys.executable, "-c", START, str(theirs.fileno())], pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL, env=os.environ | dict.fromkeys(THREAD_VARIABLES, "1"),
                process_group=0,  # its own, with its copies: Ctrl-C is for us alone
            )  # fmt: skip
        with contextlib.suppress(OSError):  # it has died, as a call will find
            self.calls.send(sys.path)
            self.calls.send_bytes(setup)

    def start_worker(self) -> "Worker":
        """Return a new worker, once all is loaded. Raises WorkersFailed, and Death."""
        pipe, theirs = Pipe()
        with theirs:
            answer = self.call(0, theirs)
        if isinstance(answer, WorkersFailed):
            raise answer
        return Worker(self, answer, pipe)

    def call(self, pid: int, pipe: Connection | None = None) -> Any:
        """Return the answer to a call (see `worker.serve`). Raises Death."""
        with self.lock, contextlib.suppress(EOFError, OSError):
            self.calls.send(pid)
            if pipe:
                kind = socket.AF_UNIX, socket.SOCK_STREAM
                with socket.fromfd(self.calls.fileno(), *kind) as carrier:
                    socket.send_fds(carrier, [b"1"], [pipe.fileno()])
            return receive(self.calls, MAX_SILENCE)
        self.end()
        raise Death(describe_ending(self.process.returncode))

    def end(self) -> None:
        """End the process, which ends its copies; where it is at work still, kill all."""
        if self.lock.acquire(blocking=False):  # nobody waits for an answer
            self.calls.close()
            self.lock.release()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(END_SECONDS)
        if self.process.poll() is None:
            with contextlib.suppress(ProcessLookupError, PermissionError):  # another was first
                os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


class Worker:
    """A worker process, from the outside; used by one thread at a time."""

    def __init__(self, loader: Loader, pid: int, pipe: Connection):
        self.loader, self.pid, self.pipe = loader, pid, pipe

    def ask(self, batch: list[Job], grace: float) -> Any:
        """Return a worker's answer to a batch. Raises Death."""
        place, seconds, is_late = None, MAX_SILENCE, False
        try:
            self.pipe.send([job.payload for job in batch])
            while isinstance(answer := receive(self.pipe, seconds), int):
                place = answer
                seconds = batch[place].timeout + grace if place < len(batch) else MAX_SILENCE
            return answer
        except TimeoutError:
            is_late = place is not None and place < len(batch)
        except (EOFError, OSError):
            pass
        raise Death(describe_ending(self.end()), place, is_late)

    def end(self) -> int:
        """Kill the process; return its exit code."""
        try:
            return int(self.loader.call(self.pid))
        except Death:  # which takes its copies along on Linux alone
            with contextlib.suppress(OSError):
                os.kill(self.pid, signal.SIGKILL)
            return -signal.SIGKILL


def receive(pipe: Connection, seconds: float) -> Any:
    """Return what comes through a pipe. Raises TimeoutError, and EOFError or OSError at its end.

    Ticks are counted, since time goes on while this process is stopped, as by Ctrl-Z.
    """
    for _ in range(math.ceil(min(seconds, 1e9) / TICK)):
        if pipe.poll(TICK):
            return pipe.recv()
    raise TimeoutError


def describe_ending(code: int) -> str:
    """Return how a process ended, from its exit code (less the signal's number)."""
    if code == -signal.SIGKILL:
        return "SIGKILL: out of memory, or killed from outside"
    return f"exit code {code}" if code >= 0 else signal.Signals(-code).name


def memory_share(count: int) -> int:
    """Return the bytes for each of `count` workers, of three quarters of the memory there is.

    That is the machine's, or the container's where it has a limit.
    """
    most = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    for path in MEMORY_LIMITS:
        with contextlib.suppress(OSError, ValueError):  # absent, or "max"
            most = min(most, int(Path(path).read_text()))
    return int(MEMORY_SHARE * most / count)

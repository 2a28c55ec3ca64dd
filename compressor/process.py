"""A worker process from the outside: its start, its messages, its lateness, its end."""

import contextlib
import math
import os
import pickle
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from compressor.worker import (
    ENDING,
    LENGTHS,
    NONE_YET,
    NOT_RUNNING,
    POSITION,
    SINCE,
    Answer,
    Rules,
    serve,
)

STALL = 60.0  # s in which a worker that has a batch must begin a job, or tell of one
MEMORY_SHARE = 0.75  # of the machine's memory, for all workers together
MEMORY_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def start_method() -> str:
    """ "fork" where it is safe, since such a worker starts in ten milliseconds; else "spawn"."""
    alone = threading.active_count() == 1
    return "fork" if sys.platform == "linux" and alone else "spawn"


def cores() -> int:
    """How many cores this process may use, by its affinity and its container's quota."""
    import joblib

    return joblib.cpu_count()


def memory_share(count: int) -> int:
    """Bytes for each of `count` workers: three quarters of the machine's, or the container's."""
    most = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    for path in MEMORY_LIMITS:
        with contextlib.suppress(OSError, ValueError):  # absent, or "max"
            most = min(most, int(Path(path).read_text()))
    return int(MEMORY_SHARE * most / count)


def one_thread_each() -> None:
    """Keep numeric libraries that load later, here or in workers, to one thread a process."""
    for name in THREADS:
        os.environ.setdefault(name, "1")


@dataclass
class Job:
    """A job that is not finished; a suspect was running when a worker died."""

    id: Any
    payload: bytes
    timeout: float
    suspect: bool = False


@dataclass(eq=False)
class Worker:
    """A worker process from the outside."""

    process: Any
    channel: socket.socket
    state: Any  # shared with it: see compressor.worker
    idle: bool = True  # it has told that its batch is over
    batch: dict[int, Job] = field(default_factory=dict)  # by position; those not told of
    inbox: bytearray = field(default_factory=bytearray)
    outbox: memoryview = field(default_factory=lambda: memoryview(b""))
    heard: float = 0.0  # when it last got or sent anything
    killed: float = math.inf  # when it was, for taking too long

    def send(self) -> None:
        """Pass on what the channel takes of the batch; a worker that died is seen when it reads."""
        with contextlib.suppress(BlockingIOError, ConnectionError):
            self.outbox = self.outbox[self.channel.send(self.outbox) :]
        self.heard = time.monotonic()

    def receive(self) -> bool:
        """Read some of what has come; False where the process has ended."""
        try:
            data = self.channel.recv(1 << 20)
        except ConnectionError:
            data = b""
        self.inbox += data
        self.heard = time.monotonic()
        return bool(data)

    def drain(self) -> None:
        """Read what a process that has ended left behind."""
        with contextlib.suppress(BlockingIOError):  # a process of its own may hold the channel
            while self.receive():
                pass

    def messages(self) -> Iterator[tuple[list[Answer], list[bytes], bool]]:
        """Whole messages: answers, their pickled results, whether the batch is over."""
        while len(self.inbox) >= LENGTHS.size:
            head, size = LENGTHS.unpack_from(self.inbox)
            body = LENGTHS.size + head
            if len(self.inbox) < body + size:
                return
            with memoryview(self.inbox) as view:
                rows, over = pickle.loads(view[LENGTHS.size : body])
                answers, results = [Answer(*row) for row in rows], []
                for answer in answers:
                    results.append(bytes(view[body : body + answer.size]))
                    body += answer.size
            del self.inbox[:body]
            yield answers, results, over

    def late(self, now: float, grace: float) -> bool:
        """Whether its job, or what lies between two jobs, takes longer than it may."""
        since, job = self.state[SINCE], self.batch.get(int(self.state[POSITION]))
        if since == NOT_RUNNING or job is None:
            return now - self.heard > STALL
        return now - since > job.timeout + grace


def start(context: Any, work: Callable[[Any], Any], rules: Rules) -> Worker:
    """Start a worker; signals should be blocked, or they could end it before it is known."""
    if not rules.forked:
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()  # which unblocks signals where it starts
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    state = context.RawArray("d", (NONE_YET, NOT_RUNNING))
    process = context.Process(target=serve, args=(theirs, state, work, rules), daemon=True)
    with theirs:
        process.start()
    return Worker(process, ours, state)


def ending(code: int | None) -> str:
    """How a process ended, from its exit code (less the signal's number)."""
    if code is None:
        return "an unknown cause"
    if code >= 0:
        return f"exit code {code}"
    if code == -signal.SIGKILL:
        return "SIGKILL: out of memory, or killed from outside"
    return signal.Signals(-code).name


@contextlib.contextmanager
def signals_blocked() -> Iterator[None]:
    """Have the signals that end a program wait, here and in processes that are started here."""
    old = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, old)

"""Worker processes from the inside: the loader that makes them, their limits, batches of jobs."""

import contextlib
import gc
import os
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

from compressor.program import CompsimError, die_with_parent
from compressor.reasons import Reason
from compressor.store import StoreError

MAX_OVERRUN = 2.0  # target_seconds after which a worker gives the rest of a batch back
MAX_TEXT = 20_000  # characters of a traceback
NO_WORKER = (
    "no worker process can be started: {}; allow more processes and files (ulimit -u, -n), or use "
    "fewer workers (-j)"
)

Store = Callable[[list[Any]], list[Any]]  # of results; returns what is sent home for each


class WorkersFailed(CompsimError):
    """Worker processes cannot be started, or die before they begin a job."""

    exit_code = 1


class End(NamedTuple):
    """How a job ended: its result and the seconds that it took, or why it has none.

    `reason`: "", or WORKER_DIED, OUT_OF_MEMORY, BUDGET_SECONDS, or INTERNAL_ERROR, with a
    traceback, where the work raised an exception.
    """

    id: Any = None
    result: Any = None
    seconds: float = 0.0
    reason: str = ""
    detail: str = ""
    traceback: str = ""


@dataclass(frozen=True)
class Workers:
    """Worker processes: how many, and the rules for them.

    `prepare` is called once in the loader, of which all are copies. `memory`: bytes that a
    job may add (by default `memory_share`). `grace`: s beyond its time in which a job may end by
    itself. `target_seconds`: of a batch.
    """

    count: int = 2
    prepare: Callable[[], object] = int
    memory: int = 0
    grace: float = 1.0
    target_seconds: float = 0.5


def serve(calls: Connection) -> None:
    """Load what jobs need, then make workers, which are copies of this process, and end them.

    What is called for comes through `calls`: 0 with the pipe of a new worker, or the process id of
    one that is to end. The answer is its process id, or its exit code; or WorkersFailed, with what
    keeps this process from making any. At the end of `calls` all workers are ended.
    """
    settle()
    try:
        parent, work, store, rules = calls.recv()
        if os.getppid() != parent:  # it died before `settle`
            return
        rules.prepare()  # without the collector, as from the start: none of that is garbage
        gc.freeze()  # what is there stays: looking at it took a thirtieth of short jobs' time
        gc.enable()
    except BaseException as error:
        with contextlib.suppress(OSError):  # nobody may listen
            calls.send(WorkersFailed(f"jobs could not even begin: {describe_error(error)[0]}"))
        return
    loader, pipe = os.getpid(), answer_calls(calls)
    if pipe:
        settle()
        if os.getppid() == loader:  # it is there still
            limit(rules.memory)
            serve_batches(pipe, work, store, rules.target_seconds)


def answer_calls(calls: Connection) -> Connection | None:
    """Make and end workers; return the pipe of one in its process, None at the end of `calls`."""
    workers: set[int] = set()
    with contextlib.suppress(EOFError, OSError, ValueError):  # of what was cut short, too
        while True:
            if pid := calls.recv():
                workers.discard(pid)
                os.kill(pid, signal.SIGKILL)
                calls.send(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
                continue
            with socket.fromfd(calls.fileno(), socket.AF_UNIX, socket.SOCK_STREAM) as carrier:
                _, (file,), _, _ = socket.recv_fds(carrier, 1, 1)
            try:
                pid = os.fork()
            except OSError as error:
                calls.send(WorkersFailed(NO_WORKER.format(error)))
                continue
            if not pid:
                calls.close()
                return Connection(file)
            os.close(file)
            workers.add(pid)
            calls.send(pid)
    for pid in workers:
        os.kill(pid, signal.SIGKILL)
    for pid in workers:
        os.waitpid(pid, 0)
    return None


def serve_batches(
    pipe: Connection, work: Callable[[Any], Any], store: Store | None, target_seconds: float
) -> None:
    """Run the batches that come through a pipe, until it is closed, also while one is at work.

    The place of each job goes home before it runs, and the number of all when they have run. An
    answer is a list of ends, without the rest that is given back, or StoreError.
    """
    with contextlib.suppress(EOFError, OSError):  # of the pipe alone: `attempt` has the job's
        while True:
            payloads, ends, began = pipe.recv(), [], time.monotonic()
            for place, payload in enumerate(payloads):
                pipe.send(place)
                ends.append(attempt(work, payload))
                if time.monotonic() - began > MAX_OVERRUN * target_seconds:
                    break
            pipe.send(len(payloads))
            try:
                pipe.send(store_results(store, ends) if store else ends)
            except StoreError as error:
                pipe.send(error)


def settle() -> None:
    """Make this process a worker: its end, signals and streams."""
    die_with_parent()
    # which are for the parent: it ends us; a terminal is to stop nobody who writes to it
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTTOU):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # ignored, exit codes would be lost
    with contextlib.suppress(OSError):  # there may be no stderr
        os.dup2(2, 1)  # stdout is for data


def limit(memory: int) -> None:
    """Limit what a job may allocate to `memory` bytes, and let no crash write a core file."""
    import resource  # not on Windows, where nothing is run

    _, most = resource.getrlimit(resource.RLIMIT_CORE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, most))
    if sys.platform != "linux":
        return
    try:
        with open("/proc/self/oom_score_adj", "w") as file:
            file.write("500")  # should memory run out, a worker is a better victim than its parent
        with open("/proc/self/statm") as file:
            present = int(file.read().split()[5]) * resource.getpagesize()
    except OSError:  # there is no /proc: only the system's own limits hold
        return
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = present + memory
    if most == resource.RLIM_INFINITY or wanted < most:
        resource.setrlimit(resource.RLIMIT_DATA, (wanted, most))


def attempt(work: Callable[[Any], Any], payload: Any) -> End:
    """Return what some work gives, or why it gives nothing. Raises StoreError."""
    start = time.monotonic()
    try:
        return End(result=work(payload), seconds=time.monotonic() - start)
    except StoreError:
        raise
    except MemoryError:
        text = "needs more memory than its worker may add"
        return End(reason=Reason.OUT_OF_MEMORY, detail=text)
    except (Exception, SystemExit) as error:  # work may even call sys.exit
        seconds, (text, traceback) = time.monotonic() - start, describe_error(error)
        return End(None, None, seconds, Reason.INTERNAL_ERROR, text, traceback)


def store_results(store: Store, ends: list[End]) -> list[End]:
    """Store the results of a batch in one go, one by one where that fails; return how jobs ended.

    What `store` gives takes the place of each result. Raises StoreError.
    """
    results = [end.result for end in ends if not end.reason]
    if not results:
        return ends
    stored = attempt(store, results)
    if not stored.reason:
        sent = iter(stored.result)
        return [end if end.reason else end._replace(result=next(sent)) for end in ends]
    if len(ends) == 1:
        return [stored]
    return [end for one in ends for end in store_results(store, [one])]


def describe_error(error: BaseException) -> tuple[str, str]:
    """Return an exception in a line, and its traceback."""
    what = traceback.format_exception_only(error)[-1].strip()
    return what[:MAX_TEXT], "".join(traceback.format_exception(error))[-MAX_TEXT:]

"""A worker process from the inside: its limits, and batches of jobs with a note of each job."""

import contextlib
import ctypes
import gc
import mmap
import os
import pickle
import signal
import struct
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from compressor.reasons import Reason
from compressor.store import StoreError, sync_later

MAX_OVERRUN = 2.0  # target_seconds after which a worker gives the rest of a batch back
MAX_TEXT = 20_000  # characters of a traceback
ENDING = [signal.SIGINT, signal.SIGTERM]
if hasattr(signal, "SIGHUP"):  # not on Windows
    ENDING.append(signal.SIGHUP)
PR_SET_PDEATHSIG = 1  # linux/prctl.h
NOTE = struct.Struct("ddd")  # process; job of the batch; since when it runs, or minus its end (s)
MAX_PROBLEM = 400  # characters of what keeps a worker from beginning: a message in one piece


@dataclass(frozen=True)
class JobResult:
    """A job that ended, its result, and the seconds that it took."""

    id: Any
    result: Any
    seconds: float


@dataclass(frozen=True)
class JobLost:
    """A job that has no result.

    `reason`: WORKER_DIED, OUT_OF_MEMORY, BUDGET_SECONDS, or INTERNAL_ERROR, with a traceback,
    where the work raised an exception.
    """

    id: Any
    reason: str
    detail: str
    traceback: str = ""


@dataclass(frozen=True)
class Workers:
    """Worker processes: how many, and the rules for them.

    `prepare` is called once in each, before its clocks and limits are set. `memory`: bytes that a
    job may add (by default `memory_share`). `grace`: s beyond its time in which a job may end by
    itself.
    """

    count: int = 2
    prepare: Callable[[], object] = int
    memory: int | None = None
    grace: float = 1.0
    target_seconds: float = 0.2


HERE: dict[str, Any] = {}  # what `init_worker` leaves for `do_batch`


def init_worker(work: Callable[[Any], Any], rules: Workers, parent: int) -> None:
    """Make a new process a worker: its end, signals and streams."""
    if sys.platform == "linux":  # die when the parent does, even amid compiled code
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it died before
        os._exit(0)
    for number in (signal.SIGINT, signal.SIGHUP):  # Ctrl-C reaches all: the parent ends us
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    with contextlib.suppress(OSError):  # there may be no stderr
        os.dup2(2, 1)  # stdout is for data
    gc.disable()  # until it is prepared: what is loaded is no garbage, and much to look at
    HERE.update(work=work, rules=rules, prepared=False)


def prepare() -> str:
    """Prepare this process for its first batch; return what prevents that, or ""."""
    rules = HERE["rules"]
    try:
        rules.prepare()
    except BaseException as error:
        return describe_error(error)[0][:MAX_PROBLEM]
    gc.freeze()  # what is there by now stays: looking at it took a thirtieth of short jobs' time
    gc.enable()
    limit(rules.memory)
    HERE["prepared"] = True
    return ""


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


def do_batch(path: str, data: bytes, count: int) -> str:
    """Run the jobs of a batch; return what keeps this process from any job, or "".

    data: their pickled payloads; count: how many they are. The file gets a note of who is at which
    job, and in the end how jobs ended, all but a rest that is given back.
    """
    if not HERE["prepared"] and (problem := prepare()):
        return problem
    with open(path, "r+b") as file, mmap.mmap(file.fileno(), NOTE.size) as note:
        found: list[JobResult | JobLost] = []
        began = time.monotonic()
        NOTE.pack_into(note, 0, os.getpid(), 0, began)
        jobs = read_jobs(data, count)
        try:
            with sync_later():  # or each job would wait for the disk
                for position, job in enumerate(jobs):
                    start = time.monotonic()
                    NOTE.pack_into(note, 0, os.getpid(), position, start)
                    found.append(perform(job, start))
                    if time.monotonic() - began > MAX_OVERRUN * HERE["rules"].target_seconds:
                        break
        except StoreError as error:  # no job's time series are known to be on disk
            found = [JobResult(None, pickle.dumps(error, pickle.HIGHEST_PROTOCOL), 0.0)]
        NOTE.pack_into(note, 0, os.getpid(), 0, -time.monotonic())
        file.seek(NOTE.size)
        pickle.dump(found, file, pickle.HIGHEST_PROTOCOL)
    return ""


def read_jobs(data: bytes, count: int) -> Sequence[Callable[[], Any]]:
    """Return for each job of a batch a function that returns the argument of its work."""
    try:
        return [partial(lambda job: job, job) for job in pickle.loads(data)]
    except MemoryError:  # each job by itself will need less, or fail alone
        return [partial(read_job, data, position) for position in range(count)]


def read_job(data: bytes, position: int) -> Any:
    """Return the argument of a job's work, of those of a batch."""
    return pickle.loads(data)[position]


def perform(job: Callable[[], Any], start: float) -> JobResult | JobLost:
    """Return the result of one job, pickled, or why it has none."""
    try:
        result = pickle.dumps(HERE["work"](job()), pickle.HIGHEST_PROTOCOL)
        return JobResult(None, result, time.monotonic() - start)
    except MemoryError:
        most = f"needs more than the {HERE['rules'].memory / 1e9:.3g} GB that a worker may add"
        return JobLost(None, Reason.OUT_OF_MEMORY, most)
    except BaseException as error:  # work may even call sys.exit
        return JobLost(None, Reason.INTERNAL_ERROR, *describe_error(error))


def describe_error(error: BaseException) -> tuple[str, str]:
    """Return an exception in a line, and its traceback."""
    what = traceback.format_exception_only(error)[-1].strip()
    return what[:MAX_TEXT], "".join(traceback.format_exception(error))[-MAX_TEXT:]

"""A worker process from the inside: it does batches of jobs, and ends when its parent does.

What goes wrong in a job is told to the parent, or seen by it: two numbers in shared memory say
which job of the batch began last and since when it runs, so that a death or a hang has a name.
"""

import contextlib
import ctypes
import faulthandler
import os
import pickle
import signal
import socket
import struct
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, NoReturn

from compressor.reasons import Reason

POSITION, SINCE = 0, 1  # the shared numbers: job of the batch that began last, since when (s)
NONE_YET = -1.0  # in place of a position
NOT_RUNNING = 0.0  # in place of a time: between two jobs
LENGTHS = struct.Struct("<QQ")  # a message's bytes: of its answers, of the results that follow

REPORT_SECONDS = 0.01  # between two messages of finished jobs, which cost about 0.1 ms
OVERRUN = 2.0  # target_seconds after which the rest of a batch is given back
LARGE = 1 << 20  # bytes of results that are sent piece by piece
MOST_TEXT = 20_000  # characters of a traceback

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
PR_SET_PDEATHSIG = 1  # linux/prctl.h


@dataclass(frozen=True)
class Rules:
    """What a worker is told once: seconds of a batch, bytes a job may add, the parent, the start.

    `forked`: open files of the parent are inherited and need to be let go.
    """

    target_seconds: float
    memory: int
    parent: int
    forked: bool


class Answer(NamedTuple):
    """How a job of a batch ended: bytes of its pickled result, or a failure's reason and text."""

    position: int
    seconds: float
    size: int
    reason: str = ""
    detail: str = ""
    traceback: str = ""


def serve(channel: socket.socket, state: Any, work: Callable[[Any], Any], rules: Rules) -> NoReturn:
    """Do batches until the parent closes the channel or ends; never returns to the caller.

    A batch is a pickled list of pickled payloads. A message back is LENGTHS, then (answers, whether
    the batch is over), pickled, then the pickled results. `state` is a shared array of two floats.
    """
    code = 1
    try:
        settle(channel, rules)
        with channel.makefile("rb") as batches:
            while do_batch(pickle.load(batches), channel, state, work, rules):
                pass
    except (EOFError, ConnectionError):
        code = 0
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
    finally:
        os._exit(code)  # neither the parent's buffers nor its exit handlers are ours to run


def settle(channel: socket.socket, rules: Rules) -> None:
    """Make an inherited process a worker: its end, its signals, its files, its memory."""
    end_with(rules.parent)
    if rules.forked:
        let_go(channel.fileno())
    for number in (signal.SIGINT, signal.SIGHUP):  # Ctrl-C reaches all: the parent ends us
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    faulthandler.disable()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    limit(rules.memory)


def end_with(parent: int) -> None:
    """Die when the parent does, even by SIGKILL and amid compiled code.

    Where there is no such call (Linux has it), a worker ends when it next needs the channel.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it died before
        os._exit(0)


def let_go(kept: int) -> None:
    """Let go of the parent's files: a lock or a pipe must not outlive it in us.

    The numbers stay taken, by /dev/null, since objects of the parent's may close them some day.
    Standard input is emptied, and what is printed goes to stderr: stdout is for data.
    """
    nothing = os.open(os.devnull, os.O_RDWR)
    inherited = {int(name) for name in os.listdir("/dev/fd")} - {1, 2, kept, nothing}
    for descriptor in inherited:
        os.dup2(nothing, descriptor, inheritable=False)
    with contextlib.suppress(OSError):  # there may be no stderr
        os.dup2(2, 1)


def limit(memory: int) -> None:
    """Have allocations fail once a job has added `memory` bytes, and no crash write a core file."""
    import resource

    _, most = resource.getrlimit(resource.RLIMIT_CORE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, most))
    if sys.platform != "linux":
        return
    with open("/proc/self/oom_score_adj", "w") as file:
        file.write("500")  # should memory run out, a worker is a better victim than its parent
    with open("/proc/self/statm") as file:
        inherited = int(file.read().split()[5]) * resource.getpagesize()
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = inherited + memory
    if most == resource.RLIM_INFINITY or wanted < most:
        resource.setrlimit(resource.RLIMIT_DATA, (wanted, most))


def do_batch(
    batch: Sequence[bytes],
    channel: socket.socket,
    state: Any,
    work: Callable[[Any], Any],
    rules: Rules,
) -> bool:
    """Do the jobs of a batch and tell of them; False when memory ran out, which ends a worker."""
    answers: list[Answer] = []
    results: list[bytes] = []
    began = told = now = time.monotonic()
    for position, payload in enumerate(batch):
        if position and now - began > OVERRUN * rules.target_seconds:
            break
        start = time.monotonic()
        state[POSITION], state[SINCE] = position, start
        result, *failure = perform(work, payload)
        state[SINCE] = NOT_RUNNING
        now = time.monotonic()
        answers.append(Answer(position, now - start, len(result), *failure))
        results.append(result)
        if failure and failure[0] == Reason.OUT_OF_MEMORY:
            tell(channel, answers, results, True)
            return False
        if now - told > REPORT_SECONDS:
            tell(channel, answers, results, False)
            answers, results, told = [], [], now
    tell(channel, answers, results, True)
    return True


def perform(work: Callable[[Any], Any], payload: bytes) -> tuple[Any, ...]:
    """Do one job: its pickled result, or b"" with reason, detail and traceback."""
    try:
        return (pickle.dumps(work(pickle.loads(payload)), pickle.HIGHEST_PROTOCOL),)
    except MemoryError:
        return b"", Reason.OUT_OF_MEMORY
    except BaseException as error:  # work may even call sys.exit
        return b"", Reason.INTERNAL_ERROR, *described(error)


def described(error: BaseException) -> tuple[str, str]:
    """An exception in a line, and its traceback."""
    what = traceback.format_exception_only(error)[-1].strip()
    return what[:MOST_TEXT], "".join(traceback.format_exception(error))[-MOST_TEXT:]


def tell(
    channel: socket.socket, answers: Sequence[Answer], results: Sequence[bytes], over: bool
) -> None:
    """Send a message to the parent; large results are not copied, since memory may be short."""
    head = pickle.dumps(([tuple(answer) for answer in answers], over), pickle.HIGHEST_PROTOCOL)
    size = sum(map(len, results))
    parts = [LENGTHS.pack(len(head), size), head, *results]
    for part in parts if size > LARGE else [b"".join(parts)]:
        channel.sendall(part)

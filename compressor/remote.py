"""Batches of jobs on a cluster's worker, in a process that keeps what they do away from it.

Every thread of a worker has a process of compsim beside it, which runs its batches as a run on one
machine does (`compressor.execution`): a job that crashes, hangs or eats memory costs itself only.
joblib alone cannot: workers of dask are daemons, in which it would run jobs without any process of
their own. Both processes end together.
"""

import functools
import hashlib
import os
import pickle
import platform
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import compressor
from compressor.case import MODEL_VERSION
from compressor.execution import (
    MEMORY_SHARE,
    Done,
    Local,
    Lost,
    Workers,
    cores,
    end_with,
    ending,
    memory_share,
)

LIBRARIES = ("numpy", "scipy", "numba", "llvmlite")
REMEDY = "have the same programs on all machines, then start the cluster's workers anew"
THREAD = threading.local()  # .process: the one beside this thread


class Unfit(Exception):
    """A machine where jobs cannot run, or would not end in the same bits: which, and why."""


class Broken(Exception):
    """The process that did a batch has died."""


class Batch(NamedTuple):
    """What a process does in one go; `work` and `prepare` are as for `execution.run_batches`."""

    versions: dict[str, str]  # that are asked for
    work: Callable[[Any], Any]
    prepare: Callable[[], object]
    grace: float
    jobs: list[tuple[int, bytes, float]]  # place in the batch, pickled payload, time (s)


@functools.cache
def versions() -> dict[str, str]:
    """What decides the bits of a result: the programs here, and their versions."""
    sources = hashlib.sha256()
    root = Path(compressor.__file__).parent
    for path in sorted(root.rglob("*.py")):
        sources.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return {
        "compsim": compressor.__version__,
        "model": str(MODEL_VERSION),
        "sources of compsim": sources.hexdigest()[:16],
        "Python": f"{sys.version_info[0]}.{sys.version_info[1]}",
        "machine": platform.machine(),
        "C library": " ".join(platform.libc_ver()),
        "COMPSIM_JIT": os.environ.get("COMPSIM_JIT", "1"),
    } | {name: metadata.version(name) for name in LIBRARIES}


def differences(ours: dict[str, str], theirs: dict[str, str]) -> str:
    """Where versions differ, and what to do about it; empty if they agree."""
    different = ", ".join(
        f"{name} {theirs.get(name, 'unknown')} in place of {ours.get(name, 'unknown')}"
        for name in ours | theirs
        if ours.get(name) != theirs.get(name)
    )
    return f"has {different}; {REMEDY}" if different else ""


def on_worker(number: int, batch: bytes) -> tuple[int, bytes | Exception]:
    """Do a pickled Batch beside a thread of the cluster's worker: its number, its pickled ends.

    In their place Unfit where versions differ, and Broken where the process died.
    """
    from distributed import get_worker

    worker = get_worker()
    most = worker.memory_manager.memory_limit  # of all threads together; None: no limit
    share = int(MEMORY_SHARE * most / worker.state.nthreads) if most else memory_share(cores())
    try:
        if not hasattr(THREAD, "process"):
            THREAD.process = beside(share)
        return number, ask(THREAD.process, batch)
    except (Broken, Unfit) as error:
        del THREAD.process  # the next batch has a new one, of what is installed then
        return number, type(error)(f"{worker.address}: {error}")


def beside(memory: int) -> "subprocess.Popen[bytes]":
    """Start the process of a thread; memory: bytes that a job may add."""
    call = [sys.executable, "-P", "-c", "from compressor.remote import serve; serve()"]
    paths = os.pathsep.join(path for path in sys.path if path)
    return subprocess.Popen(
        [*call, str(memory), str(os.getpid())],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": paths},
    )


def ask(process: "subprocess.Popen[bytes]", batch: bytes) -> bytes:
    """Have a process do a pickled Batch: its pickled ends. Raises Broken, and Unfit."""
    assert process.stdin
    assert process.stdout
    try:
        pickle.dump(batch, process.stdin)
        process.stdin.flush()
        done, answer = pickle.load(process.stdout)
    except (OSError, EOFError, pickle.UnpicklingError) as error:
        process.kill()
        raise Broken(f"its process ended by {ending(process.wait())}") from error
    if not done:
        process.kill()
        process.wait()
        raise Unfit(answer)
    return answer


def serve() -> None:
    """Do batches until the cluster's worker ends: in the process beside it."""
    memory, parent = map(int, sys.argv[1:])
    for number in (signal.SIGINT, signal.SIGHUP):  # the cluster's worker ends us
        signal.signal(number, signal.SIG_IGN)
    end_with(parent)
    with open(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # what is printed is no answer
        local = Local(int, [], Workers(1), 0)
        told = b""  # of the work that `local` does
        while True:
            try:
                batch: Batch = pickle.loads(pickle.load(sys.stdin.buffer))
                different = differences(batch.versions, versions())
                if not different and told != (told := pickle.dumps(batch[1:4])):
                    local.stop()
                    rules = Workers(1, batch.prepare, memory, batch.grace)
                    local = Local(batch.work, [], rules, 0)
                answer = (not different, different or done(local, batch))
            except EOFError:
                return local.stop()
            except Exception as error:
                answer = (False, f"cannot run jobs: {type(error).__name__}: {error}")
            pickle.dump(answer, out, pickle.HIGHEST_PROTOCOL)
            out.flush()


def done(local: Local, batch: Batch) -> bytes:
    """Do a batch in a process of ours, which stays for the next one; its pickled ends."""
    local.source, local.left = ((n, pickle.loads(p), s) for n, p, s in batch.jobs), len(batch.jobs)
    ends: list[Done | Lost] = sorted(local.done(lambda: None), key=lambda end: end.id)
    return pickle.dumps(ends, pickle.HIGHEST_PROTOCOL)

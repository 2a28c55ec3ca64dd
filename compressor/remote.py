"""Batches of jobs on a cluster's worker, in a process that keeps what they do away from it.

Every thread of a worker has a process of compsim beside it, which does its batches as a run on one
machine does (`compressor.workers`): a job that crashes, hangs or eats memory costs itself only, and
never the cluster's worker. Both end together.
"""

import functools
import hashlib
import json
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
from compressor.cases import MODEL_VERSION
from compressor.process import MEMORY_SHARE, THREADS, cores, ending, memory_share
from compressor.worker import end_with
from compressor.workers import GRACE, Input, run_batches

LIBRARIES = ("numpy", "scipy", "numba", "llvmlite")
REMEDY = "have the same programs on all machines, then start the cluster's workers anew"
BESIDE = threading.local()  # .process: the one of this thread


class Unfit(Exception):
    """A machine where jobs cannot run, or would not end in the same bits: which, and why."""


class Broken(Exception):
    """The process that did a batch has died."""


class Batch(NamedTuple):
    """What a process does in one go: `jobs` are named by their places in it.

    `prepare` is called with all payloads, before `work` is in the worker process that it forks.
    """

    prepare: Callable[[list[Any]], object]
    work: Callable[[Any], Any]
    jobs: list[Input]
    grace: float = GRACE


@functools.cache
def passport() -> dict[str, str]:
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
    """Where two passports differ; empty if they agree."""
    return ", ".join(
        f"{name} {theirs.get(name, 'unknown')} in place of {ours.get(name, 'unknown')}"
        for name in ours | theirs
        if ours.get(name) != theirs.get(name)
    )


# ---- in the cluster's worker --------------------------------------------------------------------


class Beside:
    """A process of compsim from the outside."""

    def __init__(self, memory: int):
        call = [sys.executable, "-P", "-c", "from compressor.remote import serve; serve()"]
        paths = os.pathsep.join(path for path in sys.path if path)
        self.process = subprocess.Popen(
            [*call, str(memory), str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=dict.fromkeys(THREADS, "1") | os.environ | {"PYTHONPATH": paths},
        )
        try:
            self.passport = json.loads(self.answer())
        except Broken as error:
            raise Unfit(f"cannot start compsim: {error}") from error

    def ask(self, batch: bytes) -> bytes:
        """Have a pickled Batch done: its ends, pickled. Raises Broken, and Unfit."""
        try:
            assert self.process.stdin is not None
            pickle.dump(batch, self.process.stdin)
            self.process.stdin.flush()
        except OSError:
            self.process.kill()
        return self.answer()

    def answer(self) -> bytes:
        """What the process sends next."""
        try:
            assert self.process.stdout is not None
            done, answer = pickle.load(self.process.stdout)
        except (OSError, EOFError, pickle.UnpicklingError) as error:
            self.process.kill()
            raise Broken(f"its process ended by {ending(self.process.wait())}") from error
        if not done:
            raise Unfit(answer)
        return answer


def do_batch(ours: dict[str, str], batch: bytes, memory: int | None, threads: int) -> bytes:
    """Do a pickled Batch: its ends, pickled, each with its place in the batch for a name.

    ours: the passport that is asked for; memory: bytes that the cluster gives its worker here, all
    its `threads` together; None: no limit. An empty batch only compares passports.

    Raises Unfit where they differ, and Broken where the process died, which the jobs cannot do.
    """
    if not hasattr(BESIDE, "process"):
        share = memory_share(cores()) if memory is None else int(MEMORY_SHARE * memory / threads)
        BESIDE.process = Beside(share)
    try:
        different = differences(ours, BESIDE.process.passport)
        if different:
            raise Unfit(f"has {different}; {REMEDY}")
        return BESIDE.process.ask(batch) if batch else b""
    except (Broken, Unfit):
        BESIDE.process.process.kill()
        BESIDE.process.process.wait()
        del BESIDE.process  # the next batch has a new one, of what is installed then
        raise


# ---- in the process beside it -------------------------------------------------------------------


def serve() -> None:
    """Tell the passport, then do batches until the cluster's worker ends."""
    memory, parent = map(int, sys.argv[1:])
    for number in (signal.SIGINT, signal.SIGHUP):  # the cluster's worker ends us
        signal.signal(number, signal.SIG_IGN)
    end_with(parent)
    with open(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # what is printed is no answer
        tell(out, True, json.dumps(passport()).encode())
        while True:
            try:
                batch = pickle.load(sys.stdin.buffer)
            except EOFError:
                return
            try:
                tell(out, True, done(batch, memory))
            except Exception as error:
                tell(out, False, f"cannot run jobs: {type(error).__name__}: {error}")


def tell(out: Any, well: bool, answer: bytes | str) -> None:
    """Send an answer, or why there is none."""
    pickle.dump((well, answer), out, pickle.HIGHEST_PROTOCOL)
    out.flush()


def done(data: bytes, memory: int) -> bytes:
    """Do a pickled Batch."""
    batch: Batch = pickle.loads(data)
    batch.prepare([payload for _, payload, _ in batch.jobs])
    ends = list(run_batches(batch.work, batch.jobs, 1, memory=memory, grace=batch.grace))
    return pickle.dumps(ends, pickle.HIGHEST_PROTOCOL)

"""What workers do in tests, good and bad: a module of its own, since worker processes import it."""

import math
import os
import signal
import sys
import time
from pathlib import Path

from compressor.store import StoreError

LEAST = 400_000_000  # bytes that a job may add
SECONDS = {"hang": 0.4, "stop": 0.4}  # that a job may take; others end by themselves


class Unprintable(Exception):
    """An exception that neither pickles nor prints."""

    def __init__(self):
        super().__init__(lambda: None)

    def __str__(self):
        raise ValueError("no text")


def fail():
    raise Unprintable


def hang():
    while True:
        pass


def swell():
    kept = []
    while True:
        kept.append(bytearray(20_000_000))


def unwind(depth):
    return unwind(depth + 1) if depth < 10**9 else depth


def stop():
    os.kill(os.getpid(), signal.SIGSTOP)


# by name: what a job does, why it is lost, and part of what is said of it
POISON = {
    "crash": (lambda: os.kill(os.getpid(), signal.SIGSEGV), "worker_died", "SIGSEGV"),
    "killed": (lambda: os.kill(os.getpid(), signal.SIGKILL), "worker_died", "out of memory, or"),
    "leave": (lambda: os._exit(3), "worker_died", "exit code 3"),
    "hang": (hang, "budget_seconds", " s of wall time"),
    "stop": (stop, "budget_seconds", "its worker was killed"),
    "bomb": (swell, "out_of_memory", "0.4 GB"),
    "raise": (fail, "internal_error", "Unprintable"),
    "exit": (lambda: sys.exit("over"), "internal_error", "SystemExit: over"),
    "deep": (lambda: unwind(0), "internal_error", "RecursionError"),
}


def work(payload):
    """Do what the payload's name says; numbers come back as they are."""
    return POISON[payload][0]() if payload in POISON else payload


def named(payloads):
    """Payloads as jobs of their own names."""
    return [(payload, payload, SECONDS.get(payload, math.inf)) for payload in payloads]


def look(name):
    """What a worker finds: an environment variable, or what its files are."""
    if name != "files":
        return os.environ.get(name)
    return [os.path.realpath(f"/dev/fd/{number}") for number in os.listdir("/dev/fd")]


def note(folder, name, text="x"):
    """Append to a file of a folder; return what it has then."""
    with open(Path(folder, str(name)), "a") as file:
        file.write(text)
    return Path(folder, str(name)).read_text()


def prepare(folder, seconds):
    """Take a while to begin."""
    time.sleep(seconds)
    note(folder, os.getpid())


def die_first(folder):
    """Be killed, but for the second time."""
    if not (mark := Path(folder, "died")).exists():
        mark.touch()
        time.sleep(0.3)  # in which all wait
        os.kill(os.getpid(), signal.SIGKILL)


def is_prepared(folder, _):
    """Whether the process of which this is a copy has taken its while."""
    return Path(folder, str(os.getppid())).exists()


def refuse():
    raise MemoryError("no room for machine code")


def crash_once(folder, at, payload):
    """Crash at the first try of a job, and count how often each has run."""
    if payload == at and note(folder, payload) == "x":
        os.kill(os.getpid(), signal.SIGSEGV)
    if payload != at:
        note(folder, payload)
    time.sleep(0.01)
    return payload


def store(folder, results):
    """Store a batch of results in one file; return what it is called, for each."""
    name = f"{os.getpid()}-{time.monotonic_ns()}"
    if "unstorable" in results:
        raise MemoryError
    if "deadly" in results:
        os.kill(os.getpid(), signal.SIGSEGV)
    if "full" in results:
        raise StoreError(folder, "No space left on device", "free some")
    for result in results:
        note(folder, name, f"{result}\n")
    return [name] * len(results)


def store_and_die(place, folder, outcomes):
    """Store a batch of outcomes; the first worker dies before it has told of them."""
    from compressor.sweep.sweep import store_outcomes  # workers of other tests need not load it

    ends = store_outcomes(folder, outcomes)
    if note(place, "stored", f"{len(outcomes)} ") == f"{len(outcomes)} ":
        os.kill(os.getpid(), signal.SIGKILL)
    return ends


def announced(payload, do=work):
    """Say which process this is, then do something with the payload."""
    os.write(2, f"{os.getpid()}\n".encode())
    return do(payload)


def harmful(case):
    """Run a case, but for four that do harm: in place of `run_job`."""
    from compressor.sweep.sweep import run_job

    match case.load, case.machine.rod_mass_kg:
        case "none", 4:
            return {}["the bug"]
        case "none", 5:
            os.kill(os.getpid(), signal.SIGSEGV)
        case "spring", 4:
            bytearray(10**15)
    if case.joint == "big_end" and abs(case.clearance_mm.big_end - 0.2) < 0.001:
        os.kill(os.getpid(), signal.SIGKILL)
    return run_job(case)


def run_harmful_cases(*arguments):
    """Do what a cluster's worker does, with `harmful` jobs."""
    from compressor.sweep import cluster

    cluster.run_job = harmful
    return cluster.run_cases(*arguments)

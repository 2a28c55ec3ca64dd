"""Jobs that do harm, by name: what each does, why it is lost, and part of what is said of it.

A module of its own, since worker processes import it.
"""

import math
import os
import signal
import sys
import time

LEAST = 400_000_000  # bytes that a job may add
SECONDS = {"hang": 1.0, "stop": 1.0}  # that a job may take; others end by themselves


class Unprintable(Exception):
    """An exception that neither pickles nor prints."""

    def __init__(self):
        super().__init__(lambda: None)

    def __str__(self):
        raise ValueError("no text")


class Unreadable:
    def __reduce__(self):
        return math.sqrt, (-1,)


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


POISON = {
    "crash": (lambda: os.kill(os.getpid(), signal.SIGSEGV), "worker_died", "SIGSEGV"),
    "killed": (lambda: os.kill(os.getpid(), signal.SIGKILL), "worker_died", "out of memory, or"),
    "leave": (lambda: os._exit(3), "worker_died", "exit code 3"),
    "hang": (hang, "budget_seconds", "more than 1 s of wall time"),
    "stop": (stop, "budget_seconds", "its worker was killed"),
    "bomb": (swell, "out_of_memory", "0.4 GB"),
    "raise": (fail, "internal_error", "Unprintable"),
    "exit": (lambda: sys.exit("over"), "internal_error", "SystemExit: over"),
    "deep": (lambda: unwind(0), "internal_error", "RecursionError"),
    "odd": (lambda: lambda: None, "internal_error", "pickle"),
    "unreadable": (Unreadable, "internal_error", "math domain error"),
}


def work(payload):
    """Do what the payload's name says; numbers come back as they are."""
    return POISON[payload][0]() if payload in POISON else payload


class Many:
    """Jobs that are listed nowhere, of which there may be a million."""

    def __init__(self, jobs):
        self.jobs = jobs

    def __iter__(self):
        return iter(self.jobs)

    def __length_hint__(self):
        return 10**6


def named(payloads):
    """Payloads as jobs of their own names."""
    return [(payload, payload, SECONDS.get(payload, math.inf)) for payload in payloads]


def sleep(payload):
    """Sleep for so long (s)."""
    time.sleep(payload)
    return payload

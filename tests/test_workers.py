"""Worker processes: a poison job costs itself only, and no process outlives its parent."""

import fcntl
import itertools
import math
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import threading
import time
from multiprocessing import resource_tracker
from pathlib import Path

import pytest

from compressor import process, workers
from compressor.worker import MOST_TEXT
from compressor.workers import Done, Lost, WorkersFailed, rest, run_batches

SECONDS = {"hang": 1.0, "stop": 1.0}  # that a job may take; others end by themselves
LEAST = 400_000_000  # bytes that a job may add


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


class Unreadable:
    def __reduce__(self):
        return math.sqrt, (-1,)


def stop():
    os.kill(os.getpid(), signal.SIGSTOP)


# name: what the job does, why it is lost, part of the detail
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


def named(payloads):
    return [(payload, payload, SECONDS.get(payload, math.inf)) for payload in payloads]


def results(ends):
    return {end.id: end.result for end in ends if isinstance(end, Done)}


def lost(ends):
    return {end.id: end for end in ends if isinstance(end, Lost)}


def is_running(pid):
    """Whether a process is there and is no zombie."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


def children():
    """Our own child processes, zombies too."""
    mine = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == os.getpid():
            mine.append(int(path.parent.name))
    return set(mine)


@pytest.fixture(autouse=True)
def no_child_is_left():
    before = children()
    yield
    assert children() <= before | {resource_tracker._resource_tracker._pid}


# ---- good jobs ----------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 3])
def test_every_job_is_done_once(count):
    ends = list(run_batches(work, named(range(500)), count, method="fork"))
    assert len(ends) == 500
    assert results(ends) == {n: n for n in range(500)}
    assert all(end.seconds >= 0 for end in ends)


def test_workers_that_start_anew_do_the_same():
    ends = list(run_batches(abs, named(range(-20, 0)), 2, method="spawn"))
    assert results(ends) == {n: -n for n in range(-20, 0)}


def test_no_jobs_need_no_workers():
    assert list(run_batches(work, [], 2)) == []


def test_many_jobs_are_never_listed():
    issued = itertools.count()
    ends = run_batches(work, ((n, n, 9.0) for n in issued), 2, method="fork")
    first = [end.id for end in itertools.islice(ends, 5000)]
    ends.close()
    assert len(set(first)) == 5000
    assert next(issued) < 5000 + 2 * workers.MOST_BATCH + 2 * workers.MOST_READY


def test_a_result_does_not_wait_for_its_batch():
    """A job that waits for the result of an earlier one of its batch to be taken ends."""
    taken = multiprocessing.get_context("fork").Event()

    def patient(payload):
        time.sleep(0.002)
        return payload != "last" or taken.wait(30)

    jobs = named([*range(100), "last"])
    ends = run_batches(patient, jobs, 1, method="fork", total=10**6, target_seconds=10.0)
    for end in ends:
        if end.id == 50:
            taken.set()
        assert end.result


def test_a_long_batch_gives_its_rest_back():
    def slow(payload):
        time.sleep(0.001 if payload < 30 else 0.2)
        return os.getpid()

    ends = results(run_batches(slow, named(range(50)), 2, method="fork", target_seconds=0.05))
    assert len({ends[n] for n in range(30, 50)}) == 2


def test_large_payloads_and_results_pass():
    jobs = [(n, bytes(30_000_000), 60.0) for n in range(3)]
    ends = results(run_batches(lambda data: data + b"1", jobs, 2, method="fork"))
    assert {len(result) for result in ends.values()} == {30_000_001}


def test_a_worker_has_none_of_our_files(tmp_path):
    """A lock that we hold would else outlive us in a worker; what it prints is no data."""
    with open(tmp_path / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)

        def look(_):
            return [os.path.realpath(f"/dev/fd/{name}") for name in os.listdir("/dev/fd")]

        (files,) = results(run_batches(look, named([0]), 1, method="fork")).values()
    assert not [name for name in files if "lock" in name]
    assert sum(name.startswith("/dev/null") for name in files) > 2


# ---- poison -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", POISON)
def test_a_poison_job_costs_itself_only(name):
    jobs = named([*range(60), name, *range(60, 120)])
    ends = list(run_batches(work, jobs, 2, method="fork", memory=LEAST, grace=0.3))
    assert len(ends) == 121
    assert results(ends) == {n: n for n in range(120)}
    (end,) = lost(ends).values()
    assert (end.id, end.reason) == (name, POISON[name][1])
    assert POISON[name][2] in end.detail
    assert (end.reason == "internal_error") == ("Traceback" in end.traceback)
    assert len(end.traceback) <= MOST_TEXT


def test_a_payload_that_does_not_pickle_is_a_lost_job():
    ends = list(run_batches(work, [*named([1]), ("odd", lambda: None, 9.0)], 1, method="fork"))
    assert results(ends) == {1: 1}
    assert lost(ends)["odd"].reason == "internal_error"


@pytest.mark.parametrize("seed", range(5))
def test_mixes_of_poison(seed):
    draw = random.Random(seed)
    bad = [(f"{n}", draw.choice(list(POISON))) for n in range(draw.randint(1, 5))]
    good = [(n, n) for n in range(draw.randint(1, 200))]
    mixed = draw.sample(bad + good, len(bad) + len(good))
    jobs = [(name, kind, SECONDS.get(kind, math.inf)) for name, kind in mixed]
    ends = list(run_batches(work, jobs, draw.randint(1, 3), method="fork", memory=LEAST, grace=0.3))
    assert len(ends) == len(jobs)
    assert results(ends) == dict(good)
    assert {name: end.reason for name, end in lost(ends).items()} == {
        name: POISON[kind][1] for name, kind in bad
    }


def test_a_job_may_succeed_when_it_is_tried_again(tmp_path):
    def flaky(payload):
        if payload == 20 and not (tmp_path / "tried").exists():
            (tmp_path / "tried").touch()
            os.kill(os.getpid(), signal.SIGSEGV)
        return payload

    ends = list(run_batches(flaky, named(range(40)), 2, method="fork"))
    assert (tmp_path / "tried").exists()
    assert results(ends) == {n: n for n in range(40)}


def test_a_worker_that_is_killed_while_idle_costs_nothing():
    def slow(payload):
        time.sleep(0.6 if payload == "slow" else 0)
        return os.getpid()

    ends = []
    for end in run_batches(slow, named(["quick", "slow"]), 2, method="fork"):
        ends.append(end)
        if end.id == "quick":
            os.kill(end.result, signal.SIGKILL)
    assert results(ends).keys() == {"quick", "slow"}


def test_workers_that_cannot_begin_end_the_call(monkeypatch):
    monkeypatch.setattr("compressor.worker.limit", lambda memory: os._exit(7))
    with pytest.raises(
        WorkersFailed, match="could not even begin: its worker ended by exit code 7"
    ):
        list(run_batches(work, named(range(100)), 2, method="fork"))


def test_no_room_for_workers_ends_the_call(monkeypatch):
    def refuse(*arguments):
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(workers, "start", refuse)
    with pytest.raises(WorkersFailed, match="no worker process can be started: no more processes"):
        list(run_batches(work, named(range(100)), 2, method="fork"))


# ---- ends ---------------------------------------------------------------------------------------


def test_closing_ends_the_workers():
    ends = run_batches(work, named([1, "hang", "stop"]), 3, method="fork")
    assert next(ends).id == 1
    assert len(children()) >= 2
    ends.close()
    assert list(ends) == []


def test_results_that_came_before_an_interruption_are_kept():
    """Ctrl-C while we wait: what had been sent by then still comes, then the exception."""

    def interrupting(payload):
        time.sleep(0.002)
        if payload == 50:
            os.kill(os.getppid(), signal.SIGINT)
            time.sleep(60)
        return payload

    ends, jobs = [], named(range(100))
    with pytest.raises(KeyboardInterrupt):
        ends.extend(run_batches(interrupting, jobs, 1, method="fork", target_seconds=1.0))
    assert results(ends).keys() >= set(range(30))
    assert len(ends) <= 50


def test_results_that_came_before_the_caller_failed_are_kept():
    def slow(payload):
        time.sleep(0.005)
        return payload

    running = run_batches(slow, named(range(100)), 1, method="fork")
    ends = [next(running)]
    time.sleep(0.5)
    with pytest.raises(LookupError, match="no more"):
        ends.extend(rest(running, LookupError("no more")))
    assert results(ends).keys() >= {0, 1, 2, 3}
    assert list(running) == []


def test_what_the_jobs_raise_comes_through():
    def jobs():
        yield from named(range(3))
        raise LookupError("no more")

    ends = []
    with pytest.raises(LookupError, match="no more"):
        ends.extend(run_batches(work, jobs(), 2, method="fork"))


PARENT = """
import os, signal, sys, time
from compressor.workers import run_batches

def work(payload):
    os.write(2, f"{os.getpid()}\\n".encode())
    if payload == "stop":
        os.kill(os.getpid(), signal.SIGSTOP)
    while True:
        pass

signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
list(run_batches(work, [(name, name, 1e9) for name in ("busy", "stop")], 2, method="fork"))
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_no_process_outlives_its_parent(number):
    parent = subprocess.Popen([sys.executable, "-c", PARENT], stderr=subprocess.PIPE, text=True)
    pids = [int(parent.stderr.readline()) for _ in range(2)]
    assert all(map(is_running, pids))
    parent.send_signal(number)
    parent.wait(5)
    deadline = time.monotonic() + 5
    while any(map(is_running, pids)) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(map(is_running, pids))
    parent.stderr.close()


# ---- settings -----------------------------------------------------------------------------------


def test_a_threaded_parent_does_not_fork():
    thread = threading.Timer(60, print)
    thread.start()
    assert process.start_method() == "spawn"
    thread.cancel()
    thread.join()


def test_memory_is_shared_among_workers(monkeypatch, tmp_path):
    (tmp_path / "most").write_text("8000000000\n")
    monkeypatch.setattr(process, "MEMORY_LIMITS", [tmp_path / "none", tmp_path / "most"])
    assert process.memory_share(2) == 3_000_000_000
    (tmp_path / "most").write_text("max\n")
    assert process.memory_share(1) > process.memory_share(4) > 0


def test_threads_are_left_alone_where_they_are_set(monkeypatch):
    for name in process.THREADS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    process.one_thread_each()
    assert os.environ["OMP_NUM_THREADS"] == "3"
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"

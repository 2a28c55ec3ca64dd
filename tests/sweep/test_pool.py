"""Worker processes: a bad job costs itself only, and no process outlives its parent."""

import fcntl
import itertools
import math
import os
import signal
import subprocess
import sys
import time
from functools import partial
from multiprocessing import Pipe
from pathlib import Path

import bad_jobs
import pytest
from bad_jobs import LEAST, POISON, named, work
from chaos.processes import members
from conftest import wait_for

from compressor.store import StoreError
from compressor.sweep import pool
from compressor.sweep.pool import WorkersFailed, run_batches
from compressor.sweep.worker import MAX_TEXT, Workers, serve_batches

RULES = {"memory": LEAST, "grace": 0.3}


def results(ends):
    return {end.id: end.result for end in ends if not end.reason}


def lost(ends):
    return {end.id: end for end in ends if end.reason}


def is_running(pid):
    """Whether a process is there and is no zombie."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


def children(of="self"):
    """The child processes of one, or our own, zombies too."""
    tasks = Path(f"/proc/{of}/task").glob("*/children")
    return {int(pid) for path in tasks for pid in path.read_text().split()}


@pytest.fixture(autouse=True)
def no_child_is_left():
    before = children()
    yield
    assert children() <= before


@pytest.fixture(autouse=True)
def nothing_is_said(capfd):
    """No message of ours, of joblib or of a dying worker."""
    yield
    assert capfd.readouterr() == ("", "")


def test_jobs_are_read_as_they_are_needed():
    issued = itertools.count()
    jobs = ((n, 0.01, 9.0) for n in issued)
    ends = run_batches(time.sleep, jobs, Workers(target_seconds=0.05))
    list(itertools.islice(ends, 20))
    assert next(issued) < 200
    ends.close()


def test_workers_are_few_with_none_of_our_files_and_one_thread(tmp_path, monkeypatch):
    """A lock that we hold would else outlive us in a worker; what it prints is no data."""
    started, start = [], pool.Worker.__init__
    monkeypatch.setattr(pool.Worker, "__init__", lambda *a: (started.append(1), start(*a))[1])
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    names = ["files", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"]
    with open(tmp_path / "lock", "w") as lock:
        os.set_inheritable(lock.fileno(), True)
        fcntl.flock(lock, fcntl.LOCK_EX)
        found = results(run_batches(bad_jobs.look, named(names), Workers(12)))
    files, *threads = (found[name] for name in names)
    assert not [name for name in files if "lock" in name]
    assert files[0] == os.devnull
    assert files[1] == files[2]
    assert threads == ["1", "1"]
    assert list(run_batches(work, [], Workers())) == []
    assert len(started) <= len(names)


def test_what_is_prepared_is_not_timed(tmp_path):
    jobs = [(n, n, 0.3) for n in range(4)]
    rules = Workers(2, partial(bad_jobs.prepare, tmp_path, 0.6), grace=0.2)
    ends = list(run_batches(partial(bad_jobs.is_prepared, tmp_path), jobs, rules))
    assert results(ends) == dict.fromkeys(range(4), True)


DEADLY = ("crash", "hang", "killed", "leave", "stop", "bomb")
RAISING = tuple(name for name, (_, reason, _) in POISON.items() if reason == "internal_error")


@pytest.mark.parametrize(
    ("names", "workers", "ignored"),  # one worker: joblib works in the calling thread
    [(DEADLY[:2], 1, signal.SIGCHLD), (DEADLY[2:] + RAISING, 2, signal.SIGHUP)],
)
def test_a_poison_job_costs_itself_only(names, workers, ignored):
    """SIGCHLD that our starter ignores is inherited, and would keep exit codes from us."""
    first, *others = names
    jobs = named([*range(60), first, *range(60, 90), *others, *range(90, 120)])
    former = signal.signal(ignored, signal.SIG_IGN)
    try:
        ends = list(run_batches(work, jobs, Workers(workers, **RULES)))
    finally:
        signal.signal(ignored, former)
    assert len(ends) == 120 + len(names)
    assert results(ends) == {n: n for n in range(120)}
    assert {*lost(ends)} == {*names}
    for name, end in lost(ends).items():
        assert end.reason == POISON[name][1]
        assert POISON[name][2] in end.detail
        assert (end.reason == "internal_error") == ("Traceback" in end.traceback)
        assert len(end.traceback) <= MAX_TEXT
        assert (end.reason == "worker_died") == ("also when it ran again alone" in end.detail)


def test_a_job_may_succeed_when_it_is_tried_again(tmp_path):
    """An outsider may have killed its worker; of the other batches no job runs twice."""
    crash_once = partial(bad_jobs.crash_once, tmp_path, 50)
    ends = list(run_batches(crash_once, named(range(100)), Workers(2, target_seconds=0.1)))
    assert results(ends) == {n: n for n in range(100)}
    runs = {n: len((tmp_path / str(n)).read_text()) for n in range(100)}
    assert runs[50] == 2
    again = [n for n, count in runs.items() if count > 1]
    assert max(runs.values()) == 2
    assert 50 - min(again) <= 20  # those of its batch before it


SCRIPT = """
import bad_jobs, functools, time
from compressor.sweep.pool import run_batches
from compressor.sweep.worker import Workers
"""


OURS = os.environ | {"PYTHONPATH": str(Path(__file__).parent)}


def started(folder, text):
    """A process group that runs two jobs of a script; the script, and the jobs' processes."""
    (folder / "script.py").write_text(SCRIPT + text)
    script = subprocess.Popen(
        [sys.executable, folder / "script.py"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True,
        env=OURS,
    )  # fmt: skip
    return script, [int(script.stderr.readline()) for _ in range(2)]


def test_a_worker_s_time_stands_still_with_ours(tmp_path):
    """All are stopped, as by a machine's sleep, for longer than the job may take."""
    running, _ = started(tmp_path, """
sleep = functools.partial(bad_jobs.announced, do=time.sleep)
for end in run_batches(sleep, [(n, 0.4, 0.6) for n in range(2)], Workers(2, grace=0.4)):
    print(end)
""")  # fmt: skip
    for number in (signal.SIGSTOP, signal.SIGCONT):
        for pid in members(running.pid):
            os.kill(pid, number)
        time.sleep(1.2)
    said, _ = running.communicate(timeout=60)
    assert said.count("reason=''") == 2


def test_a_terminal_stops_no_worker_that_writes_to_it(tmp_path):
    (tmp_path / "script.py").write_text(f"""{SCRIPT}
sleep = functools.partial(bad_jobs.announced, do=time.sleep)
for end in run_batches(sleep, [(n, 0.1, 5.0) for n in range(2)], Workers(2)):
    print(end)
""")
    line = f"stty tostop; exec {sys.executable} {tmp_path / 'script.py'}"
    spawn = [sys.executable, "-c", f"import pty; pty.spawn(['sh', '-c', {line!r}])"]
    said = subprocess.check_output(spawn, stdin=subprocess.DEVNULL, timeout=60, env=OURS)
    assert said.count(b"reason=''") == 2


@pytest.mark.parametrize(
    ("prepare", "why"),
    [(partial(os._exit, 7), "exit code 7"),
     (bad_jobs.refuse, "MemoryError: no room for machine code")],
)  # fmt: skip
def test_workers_that_cannot_begin_end_the_call_and_say_why(prepare, why, monkeypatch):
    monkeypatch.setattr(pool, "MAX_FRUITLESS", 0)
    with pytest.raises(WorkersFailed, match=f"jobs could not even begin: {why}"):
        list(run_batches(work, named(range(100)), Workers(1, prepare)))


@pytest.mark.parametrize("what", [(subprocess, "Popen"), (pool, "Pipe")])
def test_no_room_for_workers_ends_the_call(what, monkeypatch):
    def refuse(*arguments, **options):
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(*what, refuse)
    with pytest.raises(
        WorkersFailed, match="no worker process can be started: no more processes; allow"
    ):
        list(run_batches(work, named(range(100)), Workers()))


def stored(folder, payloads, **more):
    jobs = [(n, one, math.inf) for n, one in enumerate(payloads)]
    rules = Workers(1, **RULES, **more)
    return list(run_batches(work, jobs, rules, partial(bad_jobs.store, folder)))


def test_a_batch_is_stored_once_by_its_worker_and_what_cannot_be_costs_itself_only(tmp_path):
    """What jobs crash of it runs again, and is stored once."""
    numbers = [*range(220)]
    payloads = [*numbers[:100], "crash", *numbers[100:200], "unstorable", *numbers[200:210]]
    payloads += ["deadly", *numbers[210:]]
    ends = stored(tmp_path, payloads)
    assert {payloads[n]: end.reason for n, end in lost(ends).items()} == {
        "crash": "worker_died", "unstorable": "out_of_memory", "deadly": "worker_died",
    }  # fmt: skip
    assert sorted(payloads[n] for n in results(ends)) == numbers
    first = {n: name for n, name in results(ends).items() if n < 100}  # away from those others
    lines = [(int(n), path.name) for path in tmp_path.iterdir() for n in path.read_text().split()]
    assert sorted(line for line in lines if line[0] < 100) == sorted(first.items())
    assert len({*first.values()}) < 25


def test_a_disk_that_is_full_ends_the_call(tmp_path):
    with pytest.raises(StoreError, match="No space left on device"):
        stored(tmp_path, [*range(100), "full", *range(100)])


def test_closing_ends_the_workers():
    before = children()
    ends = run_batches(work, named([1, "hang", "stop"]), Workers(3, grace=60))
    assert next(ends).id == 1
    (loader,) = children() - before
    wait_for(lambda: len(children(loader)) >= 2)  # the first may have ended before the next began
    workers = children(loader)
    began = time.monotonic()
    ends.close()
    assert time.monotonic() - began < 5
    wait_for(lambda: not any(map(is_running, workers)))
    assert list(ends) == []


def test_workers_are_made_anew_where_their_loader_dies(tmp_path, monkeypatch):
    """While all wait for it, and later with its copies: what they had begun runs again."""
    monkeypatch.setattr(pool, "MAX_FRUITLESS", 2)
    rules = Workers(3, partial(bad_jobs.die_first, tmp_path), target_seconds=0.01)
    before, ends = children(), run_batches(work, named(range(300)), rules)
    found = [next(ends)]
    (loader,) = children() - before
    os.kill(loader, signal.SIGKILL)
    assert results([*found, *ends]) == {n: n for n in range(300)}


def test_no_process_outlives_its_parent(tmp_path):
    """A script without a guard: workers do not run the caller's main module."""
    parent, pids = started(tmp_path, """
jobs = [(name, name, 1e9) for name in ("hang", "stop")]
list(run_batches(bad_jobs.announced, jobs, Workers(2)))
""")  # fmt: skip
    assert all(map(is_running, pids))
    parent.kill()
    parent.wait(60)
    wait_for(lambda: not any(map(is_running, pids)))
    assert parent.communicate(timeout=60) == ("", "")  # until the last process of all has ended
    pipe, theirs = Pipe()
    theirs.send([1])
    theirs.close()
    serve_batches(pipe, work, None, 1.0)  # in silence, too, where its parent has just died


def test_memory_is_shared_among_workers(monkeypatch, tmp_path):
    (tmp_path / "most").write_text("8000000000\n")
    monkeypatch.setattr(pool, "MEMORY_LIMITS", [tmp_path / "none", tmp_path / "most"])
    assert pool.memory_share(2) == 3_000_000_000
    (tmp_path / "most").write_text("max\n")
    assert pool.memory_share(1) > pool.memory_share(4) > 0

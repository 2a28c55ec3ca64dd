"""Worker processes: a poison job costs itself only, and no process outlives its parent."""

import errno
import fcntl
import itertools
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
import traceback
from multiprocessing import resource_tracker
from pathlib import Path

import pytest
from bad_jobs import LEAST, POISON, Many, named, sleep, work
from compressor.sweep.execution import WorkersFailed, drain, run_batches
from joblib.externals.loky import process_executor
from joblib.externals.loky.backend import resource_tracker as loky_tracker
from joblib.externals.loky.backend.process import LokyProcess

from compressor.sweep import execution
from compressor.sweep.worker import MAX_TEXT, JobLost, JobResult, Workers

RULES = {"memory": LEAST, "grace": 0.3}
HERE = str(Path(__file__).parent)


def results(ends):
    return {end.id: end.result for end in ends if isinstance(end, JobResult)}


def lost(ends):
    return {end.id: end for end in ends if isinstance(end, JobLost)}


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
    trackers = {resource_tracker._resource_tracker._pid, loky_tracker._resource_tracker._pid}
    assert children() <= before | trackers


@pytest.fixture(autouse=True)
def nothing_is_said(capfd):
    """No message of ours, of joblib or of a dying worker."""
    yield
    assert capfd.readouterr() == ("", "")


def wait_for(condition, seconds=60.0):
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert condition()


# ---- good jobs ----------------------------------------------------------------------------------


def test_no_more_processes_start_than_there_are_jobs():
    started = []
    ends = run_batches(work, named(range(2)), Workers(12), lambda: started.append(children()))
    assert results(ends) == {0: 0, 1: 1}
    loky_processes = {pid for pids in started for pid in pids}
    assert len(loky_processes) <= 2 + 2  # with the trackers of Python and of loky


def test_workers_share_the_memory_by_how_many_start(monkeypatch):
    monkeypatch.setattr(execution, "memory_share", lambda count: 600 // count)
    assert execution.Local(work, named(range(2)), Workers(300)).rules.memory == 300
    assert execution.Local(work, named(range(9)), Workers(3)).rules.memory == 200
    assert execution.Local(work, iter(range(9)), Workers(3)).width == 3
    assert execution.Local(work, (n for n in range(9)), Workers(3)).width == 3  # no length


def test_a_stop_does_not_wait_until_all_workers_have_started(monkeypatch):
    """loky starts all processes of a pool in one call."""
    local = execution.Local(sleep, named(range(100)), Workers(40, memory=LEAST))
    started, start = [], LokyProcess.start

    def start_and_stop(process):
        start(process)
        started.append(process)
        local.stopped = len(started) >= 3  # as a signal would, meanwhile

    monkeypatch.setattr(LokyProcess, "start", start_and_stop)
    local.thread.submit(local.send).result()  # which blocks signals in its thread
    local.stop()
    local.discard()
    assert len(started) == 3
    assert not any(process.is_alive() for process in started)


def test_no_jobs_need_no_workers():
    assert list(run_batches(work, [], Workers())) == []


def test_a_slow_caller_is_waited_for():
    issued = itertools.count()
    ends = run_batches(work, Many((n, n, 9.0) for n in issued), Workers())
    list(itertools.islice(ends, 3000))
    time.sleep(1)  # in which workers could do many times as much
    assert next(issued) < 7000
    ends.close()


def test_a_long_batch_gives_its_rest_back():
    def slow(payload):
        time.sleep(0.001 if payload < 30 else 0.2)
        return os.getpid()

    ends = results(run_batches(slow, named(range(50)), Workers(target_seconds=0.05)))
    assert len({ends[n] for n in range(30, 50)}) == 2


def test_a_worker_has_none_of_our_files(tmp_path):
    """A lock that we hold would else outlive us in a worker; what it prints is no data."""
    with open(tmp_path / "lock", "w") as lock:
        os.set_inheritable(lock.fileno(), True)
        fcntl.flock(lock, fcntl.LOCK_EX)

        def look(_):
            return [os.path.realpath(f"/dev/fd/{name}") for name in os.listdir("/dev/fd")]

        (files,) = results(run_batches(look, named([0]), Workers(1))).values()
    assert not [name for name in files if "lock" in name]
    assert files[0] == os.devnull
    assert files[1] == files[2]


def test_numeric_libraries_have_one_thread_in_a_worker(monkeypatch):
    names = ["OMP_NUM_THREADS", "NUMBA_NUM_THREADS"]
    monkeypatch.setenv(names[0], "8")
    ends = run_batches(lambda name: os.environ.get(name), named(names), Workers(1))
    assert [*results(ends).values()] == ["1", "1"]


def test_what_is_prepared_is_not_timed(tmp_path):
    def prepare():
        time.sleep(1.5)
        (tmp_path / f"{os.getpid()}").touch()

    jobs = [(n, n, 0.5) for n in range(4)]
    rules = Workers(2, prepare, grace=0.2)
    ends = list(run_batches(lambda _: (tmp_path / f"{os.getpid()}").exists(), jobs, rules))
    assert results(ends) == dict.fromkeys(range(4), True)


# ---- poison -------------------------------------------------------------------------------------


DEADLY = ("killed", "stop", "bomb")
RAISING = tuple(name for name, (_, reason, _) in POISON.items() if reason == "internal_error")


@pytest.mark.parametrize("names", [DEADLY, RAISING], ids="-".join)
def test_a_poison_job_costs_itself_only(names):
    """Each kind; the workers of jobs that raise live on."""
    first, *others = names
    jobs = named([*range(60), first, *range(60, 90), *others, *range(90, 120)])
    ends = list(run_batches(work, jobs, Workers(2, **RULES)))
    assert len(ends) == 120 + len(names)
    assert results(ends) == {n: n for n in range(120)}
    assert {*lost(ends)} == {*names}
    for name, end in lost(ends).items():
        assert end.reason == POISON[name][1]
        assert POISON[name][2] in end.detail
        assert (end.reason == "internal_error") == ("Traceback" in end.traceback)
        assert len(end.traceback) <= MAX_TEXT


def test_a_job_may_succeed_when_it_is_tried_again(tmp_path):
    def flaky(payload):
        if payload == 20 and not (tmp_path / "tried").exists():
            (tmp_path / "tried").touch()
            os.kill(os.getpid(), signal.SIGSEGV)
        return payload

    ends = list(run_batches(flaky, named(range(40)), Workers()))
    assert (tmp_path / "tried").exists()
    assert results(ends) == {n: n for n in range(40)}


def test_results_that_arrived_are_not_computed_again(tmp_path):
    """Of the batches that had ended when a worker died, no job runs twice."""

    def counted(payload):
        with open(tmp_path / str(payload), "a") as file:
            file.write("x")
        time.sleep(0.02)
        if payload == 150:
            os._exit(3)
        return payload

    seen, again = {}, 0
    for end in run_batches(counted, named(range(200)), Workers(target_seconds=0.1)):
        seen[end.id] = (tmp_path / str(end.id)).read_text()
    for payload, text in seen.items():
        assert text == (tmp_path / str(payload)).read_text()  # not after it was handed over
        again += len(text) > 1
    assert len(seen) == 200
    assert again <= 25  # at most the batches that were with the two workers


def test_a_job_that_never_ends_is_named_without_a_search(tmp_path):
    """It begins once, not at each halving of its batch; others are not suspected."""

    def noted(payload):
        if payload == "hang":
            with open(tmp_path / "begun", "a") as file:
                file.write("x")
        return work(payload)

    ends = list(run_batches(noted, named([*range(100), "hang", *range(100, 200)]),
                            Workers(2, **RULES)))  # fmt: skip
    assert lost(ends)["hang"].reason == "budget_seconds"
    assert len(results(ends)) == 200
    assert (tmp_path / "begun").read_text() == "x"


def test_workers_that_die_between_jobs_are_replaced(tmp_path):
    """Nobody is named, so that batches are halved; nothing is lost."""

    def dying(payload):
        if payload % 25 == 0 and not (tmp_path / str(payload)).exists():
            (tmp_path / str(payload)).touch()
            threading.Timer(0.05, os._exit, (0,)).start()  # it may hit a job, or none
        return payload

    ends = list(run_batches(dying, named(range(100)), Workers()))
    assert results(ends) == {n: n for n in range(100)}


@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_worker_that_ends_amid_its_results_costs_nothing(tmp_path):
    """What is left half-written is read by nobody."""

    def end_amid_results():
        writing, main = False, threading.main_thread().ident
        while not writing:
            time.sleep(0.001)
            frames = traceback.walk_stack(sys._current_frames()[main])
            writing = not any(frame.f_code.co_name == "perform" for frame, _ in frames)
        time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGKILL)

    def large(payload):
        if payload == 3 and not (tmp_path / "tried").exists():
            (tmp_path / "tried").touch()
            threading.Thread(target=end_amid_results).start()
        return bytes(100_000_000) if payload == 3 else payload

    ends = list(run_batches(large, named(range(6)), Workers(1, memory=4 * 10**9)))
    assert len(results(ends)) == 6
    assert (tmp_path / "tried").exists()


def test_a_death_that_loky_does_not_report_is_seen(tmp_path, monkeypatch):
    """Its thread may die, too (joblib/loky#663): its futures would never end."""
    monkeypatch.setattr(execution, "STALL_SECONDS", 0.5)
    monkeypatch.setattr(
        process_executor._ExecutorManagerThread, "terminate_broken", lambda *_: None
    )
    deadline = time.monotonic() + 60

    def crash_once(payload):
        if payload == 3 and not (tmp_path / "tried").exists():
            (tmp_path / "tried").touch()
            os._exit(3)
        return payload

    def pulse():
        assert time.monotonic() < deadline

    ends = list(run_batches(crash_once, named(range(6)), Workers(1), pulse))
    assert results(ends) == {n: n for n in range(6)}


def test_workers_that_cannot_begin_end_the_call(monkeypatch):
    monkeypatch.setattr(execution, "MAX_FRUITLESS", 2)
    with pytest.raises(WorkersFailed, match="jobs could not even begin: exit code 7"):
        list(run_batches(work, named(range(100)), Workers(1, lambda: os._exit(7))))


def test_what_keeps_workers_from_beginning_is_told(monkeypatch):
    def prepare():
        raise MemoryError("no room for machine code")

    monkeypatch.setattr(execution, "MAX_FRUITLESS", 2)
    with pytest.raises(WorkersFailed, match="even begin: MemoryError: no room for machine code"):
        list(run_batches(work, named(range(10)), Workers(1, prepare)))


def test_no_memory_file_and_no_proc_cost_nothing_else(monkeypatch):
    def refuse(name):
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))

    monkeypatch.setattr(os, "memfd_create", refuse)
    assert len(results(run_batches(work, named(range(20)), Workers(1)))) == 20
    monkeypatch.undo()
    monkeypatch.setattr(os.path, "exists", lambda path: False)
    file = execution.SharedFile()
    assert Path(file.path).is_file()  # on disk
    file.close()
    assert not Path(file.path).is_file()


def test_no_room_for_workers_ends_the_call(monkeypatch):
    def refuse(*arguments, **options):
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(multiprocessing.process.BaseProcess, "start", refuse)
    with pytest.raises(WorkersFailed, match="no worker process can be started: no more processes"):
        list(run_batches(work, named(range(100)), Workers()))


def test_jobs_of_two_threads_do_not_mix():
    first = run_batches(sleep, named([0.01 + n / 1e6 for n in range(40)]), Workers(1))
    next(first)
    second = []

    def other():
        with pytest.raises(WorkersFailed, match="other jobs run in this process: wait") as error:
            list(run_batches(work, named(range(5)), Workers(1)))
        second.append(str(error.value))

    thread = threading.Thread(target=other)
    thread.start()
    thread.join()
    assert len(second) == 1
    assert len(results(first)) == 39
    assert len(results(run_batches(work, named(range(5)), Workers(1)))) == 5


def test_a_daemonic_process_is_told_that_it_may_start_no_workers(monkeypatch):
    monkeypatch.setitem(multiprocessing.current_process()._config, "daemon", True)
    with pytest.raises(WorkersFailed, match="a daemonic process may start no workers"):
        list(run_batches(work, named(range(5)), Workers(1)))


# ---- ends ---------------------------------------------------------------------------------------


def test_workers_that_loky_starts_while_we_close_are_ended_too():
    """It replaces one whose memory grew; what waited would be done first."""

    def grow(seconds):
        process_executor._MAX_MEMORY_LEAK_SIZE = -(10**12)
        process_executor._MEMORY_LEAK_CHECK_DELAY = -1
        time.sleep(seconds)

    ends = run_batches(grow, named([0.05, 0.05, 60.0, 60.0, 60.0]), Workers(1))
    next(ends), next(ends)
    began = time.monotonic()
    ends.close()
    assert time.monotonic() - began < 50  # not one of the long jobs was waited for


def test_closing_ends_the_workers():
    ends = run_batches(work, named([1, "hang", "stop"]), Workers(3, grace=60))
    assert next(ends).id == 1
    assert len(children()) >= 3
    began = time.monotonic()
    ends.close()
    assert time.monotonic() - began < 5
    assert list(ends) == []


def test_results_that_came_before_an_interruption_are_kept():
    """Ctrl-C while we wait: what had arrived by then still comes, then the exception."""
    ours = os.getpid()

    def interrupting(payload):
        time.sleep(0.002)
        if payload == 50:
            time.sleep(0.5)  # what was sent before arrives
            os.kill(ours, signal.SIGINT)
            time.sleep(60)
        return payload

    ends = []
    with pytest.raises(KeyboardInterrupt):
        ends.extend(run_batches(interrupting, named(range(100)), Workers(1, target_seconds=0.01)))
    assert results(ends).keys() >= set(range(30))
    assert len(ends) <= 50


def test_results_that_came_before_the_caller_failed_are_kept():
    running = run_batches(sleep, named([0.005 + n / 1e6 for n in range(100)]), Workers(1))
    ends = [next(running)]
    time.sleep(0.5)
    with pytest.raises(LookupError, match="no more"):
        ends.extend(drain(running, LookupError("no more")))
    assert len(results(ends)) >= 3
    assert list(running) == []


def test_what_the_jobs_raise_comes_through():
    def jobs():
        yield from named(range(30))
        raise LookupError("no more")

    ends = []
    with pytest.raises(LookupError, match="no more"):
        ends.extend(run_batches(work, jobs(), Workers()))


def test_the_pulse_beats_while_no_job_ends():
    beats = []
    list(run_batches(sleep, named([1.5]), Workers(1), pulse=lambda: beats.append(time.monotonic())))
    gaps = [after - before for before, after in itertools.pairwise(beats)]
    assert len(beats) > 6
    assert sorted(gaps)[len(gaps) // 2] < 0.3


PARENT = """
import os, signal, sys
from compressor.sweep.execution import run_batches
from compressor.sweep.worker import Workers

def work(payload):
    os.write(2, f"{os.getpid()}\\n".encode())
    if payload == "stop":
        os.kill(os.getpid(), signal.SIGSTOP)
    while True:
        pass

signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
list(run_batches(work, [(name, name, 1e9) for name in ("busy", "stop")], Workers(2)))
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_no_process_outlives_its_parent(number):
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    pids = [int(parent.stderr.readline()) for _ in range(2)]
    assert all(map(is_running, pids))
    parent.send_signal(number)
    parent.wait(60)
    wait_for(lambda: not any(map(is_running, pids)))
    said = parent.stderr.read()  # until the last process of all has ended
    parent.stderr.close()
    if number == signal.SIGTERM:
        assert said == ""
    assert not list(Path("/dev/shm").glob(f"*[-_]{parent.pid}[-_]*"))


HELPERS = """
import os, signal, threading, time
from pathlib import Path
from compressor.sweep.execution import children, run_batches
from compressor.sweep.worker import Workers

def work(payload):
    time.sleep(0.02)
    return payload

def end_helpers():
    while True:
        workers = {child.pid for child in children()}
        for path in Path(f"/proc/{os.getpid()}/task").glob("*/children"):
            for pid in set(map(int, path.read_text().split())) - workers:
                words = Path(f"/proc/{pid}/cmdline").read_text()
                if "resource_tracker" in words:
                    os.kill(pid, signal.SIGKILL)
                    print("ended", flush=True)
        time.sleep(0.01)

threading.Thread(target=end_helpers, daemon=True).start()
jobs = [(n, n, 9.0) for n in range(100)]
ends = list(run_batches(work, jobs, Workers(2)))
print(sorted(end.result for end in ends) == [*range(100)], flush=True)
os._exit(0)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_helpers_of_joblib_that_are_killed_cost_nothing():
    """Beside workers, loky and Python start processes that remove what is left behind."""
    words = [sys.executable, "-c", HELPERS]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    # two threads write: one word may stand behind another in a line
    assert "True" in done.stdout, done.stderr[-2000:]
    assert "ended" in done.stdout


STARTS = """
import signal
from joblib.externals.loky.backend import fork_exec
from compressor.sweep.execution import run_batches
from compressor.sweep.worker import ENDING, Workers

def start(*words, begin=fork_exec.fork_exec, **more):
    print(signal.pthread_sigmask(signal.SIG_BLOCK, ()) >= set(ENDING))
    return begin(*words, **more)

fork_exec.fork_exec = start
list(run_batches(int, [(n, n, 9.0) for n in range(2)], Workers(2)))
"""


def test_workers_start_with_signals_blocked():
    """Until they settle, Ctrl-C would end each with a traceback."""
    done = subprocess.run([sys.executable, "-c", STARTS], capture_output=True, text=True)
    assert done.stdout.splitlines() == ["True", "True"]


# ---- settings -----------------------------------------------------------------------------------


def test_memory_is_shared_among_workers(monkeypatch, tmp_path):
    (tmp_path / "most").write_text("8000000000\n")
    monkeypatch.setattr(execution, "MEMORY_LIMITS", [tmp_path / "none", tmp_path / "most"])
    assert execution.memory_share(2) == 3_000_000_000
    (tmp_path / "most").write_text("max\n")
    assert execution.memory_share(1) > execution.memory_share(4) > 0

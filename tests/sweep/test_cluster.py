"""A dask cluster does as one machine does, whatever becomes of its workers."""

import contextlib
import itertools
import json
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import distributed
import numpy as np
import pytest
from bad_jobs import Many, named
from bad_jobs import work as poisoned
from compsim.cli import main
from test_execution import is_running, lost, results, wait_for

from compressor.cases.case import MODEL_VERSION
from compressor.cases.load import load_studies
from compressor.store import reader as store
from compressor.store.files import StoreError
from compressor.store.status import verify
from compressor.sweep import cluster
from compressor.sweep.cluster import Cluster, Remote
from compressor.sweep.sweep import Options, sweep
from compressor.sweep.versions import ClusterError, differences, versions
from compressor.sweep.worker import JobResult, Workers

MEMORY = "800MB"  # of a worker, of which a job may add three quarters
TIMES = ("seconds",)  # what two runs of a job may differ in


@pytest.fixture(scope="module")
def living():
    """Gives a cluster of two worker processes on this machine.

    It is a new one where dask has not replaced a worker that a test has killed.
    """
    made = []

    def cluster_of_two():
        if made:
            with contextlib.suppress(TimeoutError):
                made[-1].wait_for_workers(2, timeout=15)
                return made[-1]
            made.pop().close()
        made.append(
            distributed.LocalCluster(
                n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0",
                memory_limit=MEMORY,
            )
        )  # fmt: skip
        made[-1].wait_for_workers(2, timeout=60)
        return made[-1]

    yield cluster_of_two
    for one in made:
        one.close()


@pytest.fixture
def dask(living):
    """A cluster of two worker processes on this machine."""
    return living()


@pytest.fixture
def client(dask):
    with Cluster(dask.scheduler_address) as made:
        yield made.client


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    """One study of many jobs without time series, one of few with."""
    folder = tmp_path_factory.mktemp("studies")
    solve = {"duration_rev": 2, "accuracy": "draft", "error_bars": False, "output_step_deg": 0.9}
    many = {"joint": "big_end", "output": {"keep": "metrics"}}
    for name, values in {
        "many": many | {"clearance_mm": {"linspace": [0.1, 0.3, 60]}},
        "few": {"joint": "small_end", "clearance_mm": {"linspace": [0.1, 0.3, 10]}},
    }.items():
        (folder / f"{name}.yaml").write_text(json.dumps(values | {"solve": solve}))
    return load_studies(folder / "many.yaml", folder / "few.yaml")


@pytest.fixture(scope="module")
def locally(studies, tmp_path_factory):
    """The store of the studies' jobs, run by a process of this machine."""
    folder = tmp_path_factory.mktemp("local")
    sweep(studies, folder, 1)
    return store.read_store(folder)


def assert_same(folder, expected):
    """Two stores hold the same jobs and bits, timings apart; no file of another is there."""
    found = store.read_store(folder)
    assert found.keys() == expected.keys()
    for key in expected.keys():  # noqa: SIM118
        ours, theirs = (s.outcome(s.position(key)) for s in (found, expected))
        assert (ours.status, ours.reason) == (theirs.status, theirs.reason)
        for name in set(ours.numbers.dtype.names) - {*TIMES}:
            assert ours.numbers[name].tobytes() == theirs.numbers[name].tobytes(), name
        if expected.rows.path(expected.position(key)):
            one, other = found.job(key), expected.job(key)
            assert set(one.variables) == set(other.variables)
            for name in set(one.variables) - {*TIMES}:
                np.testing.assert_array_equal(one[name].values, other[name].values)
    assert verify(folder) == []
    assert not list(Path(folder).glob("**/.*"))


def watched(backend, after, act):
    """A backend that calls act() when so many jobs have ended."""

    def run(*arguments):
        ends = backend(*arguments)
        for number, end in enumerate(ends, 1):
            if number == after:
                act()
            yield end

    return run


# ---- sweeps -------------------------------------------------------------------------------------


def test_a_worker_that_is_killed_costs_nothing(dask, studies, locally, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "store_series", lambda *_: pytest.fail("the folder is shared"))
    victim = dask.workers[0].process.pid
    with Cluster(dask.scheduler_address) as backend:
        killing = watched(backend, 8, lambda: os.kill(victim, signal.SIGKILL))
        summary = sweep(studies, tmp_path / "out", options=Options(backend=killing))
    assert (summary.run_now, summary.failed) == (70, ())
    assert_same(tmp_path / "out", locally)
    with pytest.raises(ProcessLookupError):
        os.kill(victim, 0)


def test_without_a_shared_folder_results_travel(dask, studies, locally, tmp_path, monkeypatch):
    @contextlib.contextmanager
    def elsewhere(place):
        yield tmp_path / "of another machine" / "token", "text"

    stored = []

    def noted(*arguments, real=cluster.store_series):
        stored.append(arguments)
        return real(*arguments)

    monkeypatch.setattr(cluster, "visible", elsewhere)
    monkeypatch.setattr(cluster, "store_series", noted)
    with Cluster(dask.scheduler_address) as backend:
        sweep(studies, tmp_path / "out", options=Options(backend=backend))
    assert len(stored) == 10
    assert_same(tmp_path / "out", locally)


def test_a_folder_is_shared_if_our_file_is_seen(tmp_path):
    with cluster.visible(tmp_path) as (token, text):
        assert cluster.sees(token, text)
        assert not cluster.sees(token, "of another run")
    assert not cluster.sees(token, text)


def test_a_result_that_cannot_be_stored_here_ends_the_sweep(dask, studies, tmp_path, monkeypatch):
    def full(place, *_):
        raise StoreError(place, "No space left on device", "free some")

    monkeypatch.setattr(cluster, "visible", lambda place: contextlib.nullcontext((place, "")))
    monkeypatch.setattr(cluster, "store_series", full)
    with (
        Cluster(dask.scheduler_address) as backend,
        pytest.raises(StoreError, match="No space left on device"),
    ):
        sweep(studies[1:], tmp_path / "out", options=Options(backend=backend))


# ---- jobs that fail -----------------------------------------------------------------------------


def remote(client, work, jobs, seconds=0.2, **more):
    """The ends of jobs on a cluster."""
    made = Remote(client, work, Workers(grace=0.3, target_seconds=seconds), jobs)
    vars(made).update(more)
    return made.run(lambda: None)


def run(client, work, payloads):
    return list(remote(client, work, named(payloads)))


def parent_of(pid):
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


def pids(_):
    return os.getpid()


def slow_pid(_):
    time.sleep(0.05)
    return os.getpid()


def felling(payload):
    """Kill the cluster's worker."""
    if payload == "worker":
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(60)
    return payload


def test_a_job_that_fells_workers_is_tried_alone_then_lost(dask, client, monkeypatch):
    monkeypatch.setattr(dask.scheduler, "allowed_failures", 0)
    ends = run(client, felling, [*range(4), "worker", *range(4, 8)])
    assert results(ends) == {n: n for n in range(8)}
    (end,) = lost(ends).values()
    assert (end.id, end.reason) == ("worker", "worker_died")
    assert "1 workers of the cluster died" in end.detail
    assert end.detail.endswith("also when it ran again alone")


def test_nothing_of_a_cluster_s_worker_outlives_it(dask, client):
    """Its processes die with it, though dask does not know of them."""
    pid, *_ = results(run(client, pids, range(4))).values()
    worker = parent_of(pid)
    os.kill(worker, signal.SIGKILL)
    wait_for(lambda: not is_running(pid) and not is_running(worker))


def test_threads_of_one_worker_share_its_processes():
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=True, dashboard_address=":0",
        memory_limit=MEMORY,
    ) as made, Cluster(made.scheduler_address) as backend:  # fmt: skip
        ends = run(backend.client, slow_pid, range(40))
        assert len({*results(ends).values()}) == 2
        ends = run(backend.client, poisoned, [*range(40), "crash", *range(40, 80)])
        assert results(ends) == {n: n for n in range(80)}
        assert lost(ends)["crash"].reason == "worker_died"


class DoneAtOnce:
    """A future of dask's that has its result."""

    def __init__(self, data):
        self.data = data

    def result(self):
        return self.data

    def add_done_callback(self, call):
        threading.Timer(0.01, call, [self]).start()


class ClientThatIsDone:
    """A client of dask's with three workers, whose batches are done as soon as they are sent."""

    status = "running"

    def submit(self, _, data, pure):
        jobs = range(len(cluster.Batch(*pickle.loads(data)).timeouts))
        return DoneAtOnce(pickle.dumps([JobResult(n, pickle.dumps(n), 0.01) for n in jobs]))

    def nthreads(self):
        return dict.fromkeys("abc", 1)

    def cancel(self, futures):
        pass


def test_results_that_wait_at_an_interruption_are_kept():
    run = Remote(ClientThatIsDone(), int, Workers(), [(n, n, 9.0) for n in range(40)])
    beats = itertools.count()

    def interrupt():
        if next(beats) == 2:
            time.sleep(0.3)
            raise KeyboardInterrupt

    found = []

    def collect():
        for end in run.run(interrupt):
            found.append(end.id)

    with pytest.raises(KeyboardInterrupt):
        collect()
    assert run.arrived.empty()
    assert len(found) == len({*found}) > 2


def large(payload):
    return bytes(payload)


def test_few_large_results_are_on_their_way(client, monkeypatch):
    monkeypatch.setattr(cluster, "MAX_BYTES", 3_000_000)
    issued = itertools.count()
    ends = remote(client, large, Many((n, 1_000_000, 9.0) for n in issued), 1e-9)
    for taken in range(1, 30):
        next(ends)
        assert next(issued) < 2 * taken + 15  # one of each two is ours
    ends.close()


# ---- versions -----------------------------------------------------------------------------------


def other_versions():
    return versions() | {"numpy": "1.0", "model": "none"}


def test_workers_with_other_versions_are_refused(dask, monkeypatch):
    monkeypatch.setattr(
        cluster, "differences", lambda ours, theirs: differences(other_versions(), theirs)
    )
    with pytest.raises(ClusterError) as told, Cluster(dask.scheduler_address):
        pass
    lines = str(told.value).splitlines()
    assert len(lines) == 2
    for line in lines:
        assert line.startswith("worker tcp://")
        assert f"numpy {np.__version__} in place of 1.0" in line
        assert "have the same programs on all machines" in line


def test_a_worker_with_other_versions_that_came_later_is_refused(client, monkeypatch):
    wrong = rf"worker tcp://.*: has model {MODEL_VERSION} in place of none, numpy"
    with pytest.raises(ClusterError, match=wrong):
        list(remote(client, abs, named(range(10)), versions=other_versions()))


def test_versions_tell_programs_apart():
    ours = versions()
    assert {"compsim", "model", "sources of compsim", "Python", "numpy", "numba"} <= ours.keys()
    assert differences(ours, ours) == ""
    without = {name: text for name, text in ours.items() if name != "numba"}
    assert differences(ours, without).startswith("has numba unknown in place of ")


# ---- schedulers ---------------------------------------------------------------------------------


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 1.0)


def test_a_scheduler_that_is_not_there_is_an_error(impatient):
    with socket.socket() as deaf:  # takes calls and never answers
        deaf.bind(("127.0.0.1", 0))
        deaf.listen()
        for port in (1, deaf.getsockname()[1]):
            with (
                pytest.raises(ClusterError, match=rf"127.0.0.1:{port}: no scheduler answers"),
                Cluster(f"tcp://127.0.0.1:{port}"),
            ):
                pass


@pytest.mark.parametrize("address", ["tcp://127.0.0.1", "localhost"])
def test_an_address_without_a_port_is_refused_before_it_is_called(address, monkeypatch):
    """It was called for a quarter of a minute, on a port that nobody had named."""
    monkeypatch.setattr(distributed, "Client", pytest.fail)
    with pytest.raises(ClusterError, match=f"^{address}: names no port; write tcp://host:8786$"):
        Cluster(address).__enter__()


def test_no_workers_are_told_and_a_lost_scheduler_is_an_error(studies, tmp_path):
    told = []
    with distributed.LocalCluster(
        n_workers=0, processes=False, dashboard_address=":0", silence_logs=50
    ) as empty, Cluster(empty.scheduler_address) as backend:  # fmt: skip

        def remark(done, total, text):
            told.append(text)
            if text == cluster.WAITING_REMARK:
                empty.close()

        with pytest.raises(ClusterError, match="the scheduler was lost; the same command goes on"):
            sweep(studies, tmp_path / "out", progress=remark, options=Options(backend=backend))
    assert told.count(cluster.WAITING_REMARK) == 1


def test_without_distributed_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ClusterError, match=r"pip install 'compsim\[dask\]'"), Cluster("tcp://a:1"):
        pass


# ---- the command line ---------------------------------------------------------------------------


def test_no_scheduler_is_a_mistake(studies, tmp_path, capsys, impatient):
    options = ["--scheduler", "tcp://127.0.0.1:1"]
    assert main(["run", studies[0].path, "-r", str(tmp_path / "out"), *options]) == 2
    assert "no scheduler answers" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_sigterm_keeps_what_is_finished_and_cancels_the_rest(dask, tmp_path):
    config = tmp_path / "long.yaml"
    sizes = {"linspace": [0.1, 0.3, 5000]}
    config.write_text(json.dumps({"joint": "big_end", "clearance_mm": sizes} | {
        "output": {"keep": "metrics"}}))  # fmt: skip
    out = tmp_path / "out"
    call = [sys.executable, "-m", "compsim", "run", str(config), "-r", str(out)]
    call += ["--scheduler", dask.scheduler_address]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    running = subprocess.Popen(call, stderr=subprocess.PIPE, text=True, env=environment)
    until = time.monotonic() + 60
    while not list(out.glob("rows/*.h5")) and time.monotonic() < until:
        time.sleep(0.05)
    running.send_signal(signal.SIGTERM)
    _, told = running.communicate(timeout=20)
    assert running.returncode == 143, told
    assert "interrupted by SIGTERM" in told
    assert 0 < len(store.read_store(out).keys()) < 5000
    assert not list(out.glob("jobs/.*"))
    until = time.monotonic() + 20
    while dask.scheduler.tasks and time.monotonic() < until:
        time.sleep(0.05)
    assert not dask.scheduler.tasks

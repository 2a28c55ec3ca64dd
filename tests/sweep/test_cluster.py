"""A dask cluster does as one machine does, whatever becomes of its workers."""

import os
import signal
import subprocess
import sys
from unittest.mock import MagicMock, Mock

import bad_jobs
import distributed
import numpy as np
import pytest
from compsim.cli import main
from conftest import jobs_here, wait_for, write_cases
from dask import config
from stores_compared import contents, differing

from compressor.cases.load import load_studies
from compressor.store import reader as store
from compressor.store.files import StoreError
from compressor.store.status import verify
from compressor.sweep import cluster
from compressor.sweep.cluster import ClusterError, connect_cluster
from compressor.sweep.sweep import RequestedJobs, sweep


@pytest.fixture(scope="module")
def dask():
    """Two worker processes with our path; of one that died results are waited for 3 s, not 30."""
    brief = config.set({"distributed.comm.timeouts.connect": "3s"})
    with brief, pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
        with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as made:
            made.wait_for_workers(2, timeout=60)
            yield made


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    """One study of many jobs without time series, one of few with."""
    folder = tmp_path_factory.mktemp("studies")
    solve = {"duration_rev": 2, "accuracy": "draft", "error_bars": False, "output_step_deg": 0.9}
    many = {"joint": "big_end", "output": {"keep": "metrics"}, "solve": solve,
            "clearance_mm": {"linspace": [0.1, 0.3, 31]}}  # fmt: skip
    few = {"joint": "small_end", "clearance_mm": {"linspace": [0.1, 0.3, 5]}, "solve": solve}
    return load_studies(*write_cases(folder, many=many, few=few))


def test_a_result_that_cannot_be_stored_here_ends_the_sweep(dask, studies, tmp_path, monkeypatch):
    def full(folder, data):
        raise StoreError(folder, "No space left on device", "free some")

    monkeypatch.setattr(cluster, "publish_batch", full)
    with (
        connect_cluster(dask.scheduler_address) as backend,
        pytest.raises(StoreError, match="No space left on device"),
    ):
        sweep(studies[1:], tmp_path / "out", backend=backend)


def test_workers_with_other_programs_are_refused(dask, studies, tmp_path, monkeypatch):
    others = cluster.versions() | {"numpy": "1.0"}
    monkeypatch.setattr(cluster, "versions", lambda: others)
    there = rf"worker of the cluster has numpy {np.__version__} in place of 1\.0; have the same"
    with (
        connect_cluster(dask.scheduler_address) as backend,
        pytest.raises(ClusterError, match=there),
    ):
        sweep(studies[1:], tmp_path / "out", backend=backend)


def test_no_workers_are_told_and_a_lost_scheduler_is_an_error(studies, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 1.0)
    told = []
    with distributed.LocalCluster(
        n_workers=0, processes=False, dashboard_address=":0", silence_logs=50
    ) as empty, connect_cluster(empty.scheduler_address) as backend:  # fmt: skip

        def remark(done, total, text):
            told.append(text)
            if text == cluster.WAITING:
                empty.close()

        with pytest.raises(ClusterError, match="the scheduler was lost; the same command goes on"):
            sweep(studies, tmp_path / "out", progress=remark, backend=backend)
    assert told.count(cluster.WAITING) == 1


def test_no_scheduler_is_a_mistake(studies, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.1)
    options = ["--scheduler", "tcp://127.0.0.1:1"]
    assert main(["run", studies[0].path, "-r", str(tmp_path / "out"), *options]) == 2
    assert "no scheduler answers" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_result_that_is_felled_with_its_worker_is_made_alone(studies, tmp_path, monkeypatch):
    """It ended the sweep: dask runs such a batch again, and may lose it where it is fetched."""

    def submit(do, *arguments, pure):
        future = Mock(**{"exception.return_value": None, "cancelled.return_value": False})
        future.result = Mock(side_effect=felled.pop() if felled else None)
        future.result.return_value = do(*arguments)
        return future

    felled = [distributed.scheduler.KilledWorker("a batch", None, 3)]
    client = Mock(status="running", submit=submit, **{"nthreads.return_value": {"worker": 1}})
    ready = MagicMock(add=(there := []).append)
    ready.__next__.side_effect = lambda: there.pop(0)
    monkeypatch.setattr(distributed, "as_completed", lambda loop: ready)
    (tmp_path / "batches").mkdir()
    jobs = RequestedJobs(studies[1:])
    ends = [*cluster.run_on_cluster(client, "an address", tmp_path, jobs, str)]
    assert {end.id: end.reason for end in ends} == dict.fromkeys(jobs.places, "")
    assert store.read_store(tmp_path).keys() == jobs.places.keys()


def test_sigterm_keeps_what_is_finished_and_cancels_the_rest(dask, tmp_path):
    values = {"joint": "big_end", "clearance_mm": {"linspace": [0.1, 0.3, 3000]},
              "output": {"keep": "metrics"}}  # fmt: skip
    (path,) = write_cases(tmp_path, long=values)
    out = tmp_path / "out"
    call = [sys.executable, "-m", "compsim", "run", str(path), "-r", str(out)]
    call += ["--scheduler", dask.scheduler_address]
    running = subprocess.Popen(call, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: list(out.glob("batches/*.h5")))
    running.send_signal(signal.SIGTERM)
    _, told = running.communicate(timeout=20)
    assert running.returncode == 143, told
    assert "interrupted by SIGTERM" in told
    assert 0 < len(store.read_store(out).keys()) < 3000
    assert not list(out.glob("batches/.*"))
    wait_for(lambda: not dask.scheduler.tasks)


def test_a_job_that_fells_its_worker_is_lost_alone(dask, studies, tmp_path, monkeypatch):
    """The last test, since it costs the workers, one of them amid jobs that run elsewhere then."""
    with jobs_here():
        sweep(studies, tmp_path / "local", 1)
    monkeypatch.setattr(dask.scheduler, "allowed_failures", 0)
    monkeypatch.setattr(cluster, "run_job", bad_jobs.harmful)
    monkeypatch.setattr(cluster, "run_cases", bad_jobs.run_harmful_cases)
    with connect_cluster(dask.scheduler_address) as backend:
        summary = sweep(studies, tmp_path / "out", backend=backend)
    assert summary.run_now == 36
    (lost,) = summary.failed
    assert lost.coordinates["clearance_mm"] == pytest.approx(0.2)
    assert lost.reason == "worker_died"
    assert lost.detail == "it felled 1 workers of the cluster that had it alone"
    found = tmp_path / "out"
    # to the bit, timings apart
    assert differing(contents(found), contents(tmp_path / "local")) == lost.key
    assert verify(found) == []
    assert not list(found.glob("**/.*"))

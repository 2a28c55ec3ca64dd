"""Fixtures that several test modules share; what is slow is made once for all test processes."""

import fcntl
import os
from pathlib import Path

import pytest

from compressor.analysis import paper_cases
from compressor.plan import load_studies
from compressor.simulation import simulate
from compressor.store import finished_keys, read_job, write_job, write_study

CONFIGS = sorted((Path(__file__).parent.parent / "configs").glob("*.yaml"))


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """Fill a folder once a session, whichever process comes first: once(name, fill) -> folder."""
    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base

    def made(name, fill):
        with open(base / f"{name}.lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not (base / f"{name}.done").exists():
                fill(base / name)
                (base / f"{name}.done").touch()
        return base / name

    return made


def store(folder, *paths, overrides=()):
    """Simulate the studies of case files into a store, as a sweep would; returns the studies."""
    studies = load_studies(*paths, overrides=overrides)
    for study in studies:
        write_study(folder, study, "compsim run")
        for case in study.cases:
            if case.key not in finished_keys(folder):
                write_job(folder, simulate(case))
    return studies


@pytest.fixture(scope="session")
def paper_store(once):
    """A results folder with the paper's eleven cases at draft accuracy."""
    return once("paper", lambda folder: store(folder, *CONFIGS, overrides=["solve.accuracy=draft"]))


@pytest.fixture(scope="session")
def paper_runs(paper_store):
    """The paper's eleven runs by label, at draft accuracy."""
    labels = {case.physics_key: label for label, case in paper_cases().items()}
    runs = {}
    for key in sorted(finished_keys(paper_store)):
        with read_job(paper_store, key) as run:
            runs[labels[run.attrs["physics_key"]]] = run.load()
    return runs

"""Chains on disk: they go on from where they were killed, and end in the same bits."""

import multiprocessing
import os
import signal
import time

import numpy as np
import pytest
from conftest import assert_same_bits

from compressor.store import read_dataset
from compressor.store.files import StoreError
from compressor.studies.follow import follow, motion
from compressor.studies.follow.follow import load_values, machines, read_over, read_rows, run_chain
from compressor.studies.follow.motion import ValuePlan, run_value

TEXT = """
joint: big_end
contact: {damping_N_s_per_mm: 0.336}
solve: {accuracy: draft, output_step_deg: 2}
"""
ALONG = read_over("clearance_mm=0.02:0.2:6", both=True, plan=ValuePlan(6, exponent=False))


@pytest.fixture(autouse=True)
def settle_soon(monkeypatch):
    monkeypatch.setattr(motion, "SETTLE_REV", 3)


@pytest.fixture(scope="module")
def chains(tmp_path_factory):
    path = tmp_path_factory.mktemp("chains") / "lively.yaml"
    path.write_text(TEXT, encoding="utf-8")
    (machine,) = machines(load_values(path, ALONG), ALONG)
    return machine.chains


@pytest.fixture(scope="module")
def whole(chains, tmp_path_factory):
    """The undisturbed chain, going down, and its folder."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(motion, "SETTLE_REV", 3)
        assert run_chain(chains[1], folder) is None
    return chains[1], folder


def test_a_chain_has_its_values_in_the_order_of_running(chains, whole):
    chain, folder = whole
    found = read_dataset(chain.path(folder))
    assert found["value"].values.tolist() == [*chain.values] == [*chains[0].values[::-1]]
    assert (found["status"] == "ok").all()
    assert found["section"].dims == ("value", "revolution", "joint", "coordinate")


def wait_for_values(process, path, count):
    """Wait until a chain's file has changed so often, or its process has ended."""
    seen = {path.stat().st_mtime_ns if path.exists() else 0}
    while process.is_alive() and len(seen) <= count:
        time.sleep(0.005)
        seen.add(path.stat().st_mtime_ns if path.exists() else 0)


@pytest.mark.slow
def test_a_killed_chain_goes_on_and_ends_in_the_same_bits(whole, tmp_path, monkeypatch):
    """SIGKILL at random, until the chain is whole; each process goes on from the last value."""
    chain, folder = whole
    monkeypatch.setattr(follow, "SECONDS_BETWEEN_WRITES", 0.0)
    monkeypatch.setattr(
        follow, "run_value", lambda *given: (time.sleep(0.03), run_value(*given))[1]
    )
    rng, stops = np.random.default_rng(7), []
    for _ in range(20):
        stops.append(len(read_rows(chain, tmp_path)))
        process = multiprocessing.get_context("fork").Process(
            target=run_chain, args=(chain, tmp_path)
        )
        process.start()
        wait_for_values(process, chain.path(tmp_path), rng.integers(1, 3))
        time.sleep(rng.uniform(0.0, 0.03))
        if process.is_alive():
            os.kill(process.pid, signal.SIGKILL)
        process.join()
        if process.exitcode == 0:
            break
    assert process.exitcode == 0
    assert len({*stops}) > 2
    assert_same_bits(read_dataset(chain.path(tmp_path)), read_dataset(chain.path(folder)))


def test_another_file_of_its_name_is_refused(whole, tmp_path):
    chain, folder = whole
    wrong = chain.path(tmp_path)
    wrong.parent.mkdir(parents=True)
    wrong.write_bytes(chain.path(folder).read_bytes()[:-9])
    with pytest.raises(StoreError, match="delete it"):
        run_chain(chain, tmp_path)

"""Chains on disk: they go on from where they were killed, and end in the same bits."""

import multiprocessing
import os
import signal
import sys
import time

import numpy as np
import pytest
from conftest import assert_same_bits

from compressor.cases.load import load_studies
from compressor.store.files import StoreError
from compressor.studies.regimes import chains
from compressor.studies.regimes.chains import (
    Chain,
    ChainTask,
    read_chain,
    read_kept_rows,
    run_chain,
)
from compressor.studies.regimes.run import chains_of

TEXT = """
joint: big_end
contact: {damping_N_s_per_mm: 0.336}
solve: {accuracy: draft, output_step_deg: 2}
regimes: {over: clearance_mm, from: 0.02, to: 0.2, n: 6, direction: both, settle_rev: 3,
          measure_rev: 6, section_deg: 30, exponent: false}
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("chains") / "lively.yaml"
    path.write_text(TEXT, encoding="utf-8")
    (study,) = load_studies(path)
    return study


@pytest.fixture(scope="module")
def whole(study, tmp_path_factory):
    """The undisturbed chain, going down, and its file."""
    folder = tmp_path_factory.mktemp("whole")
    chain = chains_of(study, 0)[1]
    assert run_chain(ChainTask(str(folder), chain)).values == 6
    return chain, chain.path(folder)


def test_a_chain_has_its_values_in_the_order_of_running(whole):
    chain, path = whole
    found = read_chain(path)
    assert found["value"].values.tolist() == chain.values == chain.request.values[::-1]
    assert (found["status"] == "ok").all()
    assert found["section"].dims == ("value", "revolution", "joint", "coordinate")
    for name in found.data_vars:
        assert found[name].attrs["long_name"]


def wait_for_values(process, path, count):
    """Wait until a chain's file has changed so often, or its process has ended."""
    seen = {path.stat().st_mtime_ns if path.exists() else 0}
    while process.is_alive() and len(seen) <= count:
        time.sleep(0.005)
        seen.add(path.stat().st_mtime_ns if path.exists() else 0)


@pytest.mark.slow
def test_a_killed_chain_goes_on_and_ends_in_the_same_bits(whole, tmp_path, monkeypatch):
    """SIGKILL at random, until the chain is whole; each process goes on from the last value."""
    chain, path = whole
    monkeypatch.setattr(chains, "SECONDS_BETWEEN_WRITES", 0.0)
    rng, stops = np.random.default_rng(7), []
    for _ in range(20):
        before = len(read_kept_rows(chain, chain.path(tmp_path)))
        stops.append(before)
        process = multiprocessing.get_context("fork").Process(
            target=run_chain, args=(ChainTask(str(tmp_path), chain),)
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
    assert_same_bits(read_chain(chain.path(tmp_path)), read_chain(path))


def test_each_value_begins_where_the_last_one_ended(whole, monkeypatch, tmp_path):
    chain, path = whole
    begun = []

    def run(case, state, asked):
        begun.append((case, state))
        return rows[len(begun) - 1]

    rows = read_kept_rows(chain, path)
    monkeypatch.setattr(chains, "run_value", run)
    run_chain(ChainTask(str(tmp_path), chain))
    assert [case for case, _ in begun] == [*chain.cases]
    assert begun[0][1] is None
    for (_, state), row in zip(begun[1:], rows, strict=False):
        np.testing.assert_array_equal(state, row["end_state"])
    assert_same_bits(read_chain(chain.path(tmp_path)), read_chain(path))


def test_a_chain_goes_on_past_a_failed_value_and_is_run_again_from_there(
    whole, monkeypatch, tmp_path
):
    chain, path = whole
    rows, states = read_kept_rows(chain, path), []

    def run(case, state, asked):
        number = chain.cases.index(case)
        states.append(state)
        row = dict(rows[number])
        if number == 2 and fails:
            row |= {"status": "failed", "reason": "budget_steps", "end_state": state}
        return row

    monkeypatch.setattr(chains, "run_value", run)
    fails = True
    end = run_chain(ChainTask(str(tmp_path), chain))
    assert (end.values, [one[0] for one in end.failed]) == (6, [chain.values[2]])
    np.testing.assert_array_equal(states[3], rows[1]["end_state"])
    assert run_chain(ChainTask(str(tmp_path), chain)) == end
    assert len(states) == 6
    fails = False
    assert run_chain(ChainTask(str(tmp_path), chain, True)).failed == ()
    assert len(states) == 10


def test_what_is_stored_is_not_run_again(whole, monkeypatch):
    chain, path = whole
    monkeypatch.setattr(sys.modules["compressor.studies.regimes.chains"], "run_value", pytest.fail)
    before = path.stat().st_mtime_ns
    assert run_chain(ChainTask(str(path.parents[2]), chain)).values == 6
    assert path.stat().st_mtime_ns == before


def test_a_chain_is_named_by_all_that_decides_its_numbers(study, whole):
    up, down = chains_of(study, 0)
    assert down.key == whole[0].key != up.key
    other = Chain.of("other", up.request, "up", up.cases)
    assert other.key == up.key
    shorter = Chain.of("lively", up.request, "up", up.cases[:-1])
    assert shorter.key != up.key


def test_another_file_of_its_name_is_refused(whole, tmp_path):
    chain, path = whole
    wrong = chain.path(tmp_path)
    wrong.parent.mkdir(parents=True)
    wrong.write_bytes(path.read_bytes()[:-9])
    found = run_chain(ChainTask(str(tmp_path), chain))
    assert isinstance(found, StoreError)
    assert "delete it" in str(found)

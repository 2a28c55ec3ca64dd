"""Chains on disk: they go on from where they ended, and end in the same bits."""

import pytest
from conftest import assert_same_bits

from compressor.store import read_dataset, write_dataset
from compressor.studies.follow import motion
from compressor.studies.follow.follow import load_values, machines, read_over
from compressor.studies.frame import make_rows, stored_rows

TEXT = """
joint: big_end
contact: {damping_N_s_per_mm: 0.336}
solve: {accuracy: draft, output_step_deg: 2}
"""
ALONG = read_over("clearance_mm=0.02:0.2:6", both=True, points=6, exponent=False)


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
        assert make_rows(chains[1], folder) is None
    return chains[1], folder


def test_a_chain_has_its_values_in_the_order_of_running(chains, whole):
    chain, folder = whole
    found = read_dataset(chain.path(folder))
    assert found["value"].values.tolist() == [*chain.values] == [*chains[0].values[::-1]]
    assert (found["status"] == "ok").all()
    assert found["section"].dims == ("value", "revolution", "joint", "coordinate")


def test_a_chain_goes_on_from_its_last_value_and_ends_in_the_same_bits(whole, tmp_path):
    """As after a kill: a file is whole or absent (tests/studies/test_wear.py)."""
    chain, folder = whole
    write_dataset(chain.path(tmp_path), chain.to_dataset(stored_rows(chain, folder)[:4]))
    make_rows(chain, tmp_path)
    assert_same_bits(read_dataset(chain.path(tmp_path)), read_dataset(chain.path(folder)))

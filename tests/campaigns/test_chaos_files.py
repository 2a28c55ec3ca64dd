"""A sample of the campaigns on files: refused calls, damage, power cuts."""

import faulthandler
import os
import time

import measure_chaos
import pytest
from chaos import common
from page_tables import kept


@pytest.mark.slow
@pytest.mark.parametrize("name", ["faults", "flips", "power"])
def test_nothing_fails_in_a_sample(name):
    found = measure_chaos.run(name, sample=True)
    if "skipped" in found:
        pytest.skip(found["skipped"])
    assert found["failures"] == []
    assert found["trials"] == measure_chaos.CAMPAIGNS[name][2]
    assert found["counts"].get("acknowledged results", 1) > 0


def test_a_crash_a_hang_and_an_exception_are_told_apart():
    assert common.forked(lambda: 1 + 1) == (2, "")
    assert "ZeroDivisionError" in common.forked(lambda: 1 // 0).death
    assert common.forked(faulthandler.is_enabled).result is False  # it would print the next death
    assert common.forked(os.abort).death == "SIGABRT"
    assert common.forked(lambda: os._exit(3)).death == "exit code 3"
    assert common.forked(lambda: time.sleep(60), 0.2).death == "hangs: 0 s"


def test_every_campaign_of_the_file_is_a_full_one():
    for name, found in kept("chaos.json")["campaigns"].items():
        assert not found["sample"], name
        assert found["trials"] > 0, name

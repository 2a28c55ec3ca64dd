"""A sample of the campaigns on files: refused calls, damage, power cuts."""

import faulthandler
import json
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


def test_a_partial_driver_keeps_the_other_campaigns(tmp_path, monkeypatch):
    target = tmp_path / "chaos.json"
    target.write_text('{"campaigns": {"power": {"trials": 7}, "flips": {"trials": 1}}}')
    found = {"what": "w", "trials": 2, "failed": 1, "counts": {}, "seconds": 0.1, "failures": ["x"]}
    monkeypatch.setattr(measure_chaos, "run", lambda name, sample: found)
    assert measure_chaos.main(target, ["flips"], False) == 1
    written = json.loads(target.read_text())["campaigns"]
    assert written["power"] == {"trials": 7}
    assert (written["flips"]["trials"], written["flips"]["failures"]) == (2, ["x"])
    assert list(written) == ["power", "flips"]


def test_every_campaign_of_the_file_is_a_full_one():
    for name, found in kept("chaos.json")["campaigns"].items():
        assert not found["sample"], name
        assert found["trials"] > 0, name

"""`make chaos`: a sample of flips, full disks and power cuts, and what would be seen."""

import faulthandler
import os
import time

import measure_chaos
import pytest
from chaos import common, power


@pytest.mark.slow
@pytest.mark.parametrize(("name", "trials"), [("faults", 1), ("flips", 5), ("power", 1)])
def test_nothing_fails_in_a_sample(name, trials, monkeypatch):
    monkeypatch.setattr(power, "JOBS", {"metrics": 100, "series": 3})
    monkeypatch.setattr(power, "MAX_SECONDS", 0.2)
    found = measure_chaos.run(name, trials)
    if "skipped" in found:
        pytest.skip(found["skipped"])
    assert found["failures"] == []
    assert found["trials"] == trials
    assert found["counts"].get("acknowledged results", 1) > 0


def test_a_crash_a_hang_and_an_exception_are_told_apart():
    assert common.forked(lambda: 1 + 1) == (2, "")
    assert "ZeroDivisionError" in common.forked(lambda: 1 // 0).death
    assert common.forked(faulthandler.is_enabled).result is False  # it would print the next death
    assert common.forked(os.abort).death == "SIGABRT"
    assert common.forked(lambda: os._exit(3)).death == "exit code 3"
    assert common.forked(lambda: time.sleep(60), 0.2).death == "hangs: 0 s"

"""`make chaos`: a sample of full disks and power cuts, and what would be seen if it happened."""

import faulthandler
import os
import signal
import time

import measure_chaos
import pytest
from chaos import common
from chaos.processes import Run, members


@pytest.mark.slow
@pytest.mark.parametrize("name", ["faults", "power"])
def test_nothing_fails_in_a_sample(name):
    found = measure_chaos.run(name, 1)
    if "skipped" in found:
        pytest.skip(found["skipped"])
    assert found["failures"] == []
    assert found["trials"] == 1
    assert found["counts"].get("acknowledged results", 1) > 0


def test_a_crash_a_hang_and_an_exception_are_told_apart():
    assert common.forked(lambda: 1 + 1) == (2, "")
    assert "ZeroDivisionError" in common.forked(lambda: 1 // 0).death
    assert common.forked(faulthandler.is_enabled).result is False  # it would print the next death
    assert common.forked(os.abort).death == "SIGABRT"
    assert common.forked(lambda: os._exit(3)).death == "exit code 3"
    assert common.forked(lambda: time.sleep(60), 0.2).death == "hangs: 0 s"


def test_an_orphan_is_seen_and_ended(tmp_path):
    def leave_one():
        if not os.fork():
            signal.pause()

    run = Run(["--version"], tmp_path, prepare=leave_one)
    assert run.finish(orphans=0.3) == "1 processes outlived it by 0.3 s"
    deadline = time.monotonic() + 60
    while members(run.pid) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not members(run.pid)

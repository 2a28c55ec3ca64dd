"""Samples of the campaigns with processes: kills, and what they see (`make chaos`: all)."""

import os
import signal
import time

from chaos import kill
from chaos.processes import Run, members

KILLED = 18  # the seed of a real command that is killed amid its jobs


def test_killed_sweeps_resume(tmp_path):
    found = kill.campaign(1, KILLED, tmp_path)
    assert found["failures"] == []
    assert sum(n for name, n in found["counts"].items() if name.startswith("killed")) == 1
    assert found["counts"]["real commands"] == 1


# ---- what the campaigns see ---------------------------------------------------------------------


def test_an_orphan_is_seen_and_ended(tmp_path):
    def leave_one():
        if not os.fork():
            signal.pause()

    run = Run(["--version"], tmp_path, prepare=leave_one)
    assert run.finish(orphans=0.3) == "1 processes outlived it by 0.3 s"
    deadline = time.monotonic() + 60
    while members(run.pid) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert members(run.pid) == {}

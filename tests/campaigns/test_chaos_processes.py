"""What the campaigns with processes see (`make chaos`)."""

import os
import signal
import time

from chaos.processes import Run, members


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

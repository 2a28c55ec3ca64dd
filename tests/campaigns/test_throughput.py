"""What `make throughput` calls of the program is there."""

import json

import measure_throughput
import pytest


@pytest.mark.compiled
@pytest.mark.parametrize("script", ["SOLVER", "CALLS"])
def test_each_call_is_timed(script, capsys):
    exec(getattr(measure_throughput, script).replace("range(60)", "range(2)"), {})
    found = json.loads(capsys.readouterr().out)
    assert len(found) >= 3
    assert min(found.values()) > 0

"""One source, compiled or not: the JIT switched off gives the same numbers."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from compressor.physics import _jit

PROBE = """
import json
import numpy as np
from compressor import Case, simulate
from compressor.physics import _jit
from compressor.physics.observe import COLUMNS, observe
from compressor.record import record

rows, rng = [], np.random.default_rng(7)
for joint in ("big_end", "small_end", "both"):
    p = record(Case.from_values({"joint": joint, "clearance_mm": 0.2}))
    for phase in range(4):
        y = rng.normal(size=8 if joint == "both" else 4) * 3e-4
        row = np.empty(COLUMNS)
        observe(0.01 + phase, y, phase, p, row)
        rows.append(row.tolist())
solve = {"duration_rev": 0.1, "settle_rev": 0, "output_step_deg": 1, "accuracy": "draft"}
for method in ("DOPRI5", "RODAS"):
    values = {"joint": "both", "clearance_mm": 0.2, "solve": {**solve, "method": method}}
    run = simulate(Case.from_values(values))
    rows.append(run.acceleration.values.tolist())
    rows.append([float(run.peak_acceleration), float(run.energy_residual), int(run.steps)])
print(json.dumps({"compiled": _jit.ENABLED, "rows": rows}))
"""


def probe(jit):
    environment = {**os.environ, "COMPSIM_JIT": jit}
    call = [sys.executable, "-c", PROBE]
    done = subprocess.run(call, env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.mark.slow
def test_compiled_and_pure_agree():
    compiled, pure = probe("1"), probe("0")
    assert (compiled["compiled"], pure["compiled"]) == (True, False)
    for one, other in zip(compiled["rows"], pure["rows"], strict=True):
        scale = np.abs(other).max()
        assert one == pytest.approx(other, rel=1e-7, abs=1e-9 * scale)


def test_machine_code_belongs_to_its_sources(tmp_path, monkeypatch):
    for name in ("_jit.py", "contact.py"):
        (tmp_path / name).write_text("K = 1\n", encoding="utf-8")
    monkeypatch.setattr(_jit, "HERE", tmp_path)
    first = _jit.cache_folder()
    first.mkdir(parents=True)
    assert _jit.cache_folder() == first
    (tmp_path / "contact.py").write_text("K = 2\n", encoding="utf-8")
    assert _jit.cache_folder() != first
    _jit.discard_old(first)
    assert first.exists()
    _jit.discard_old(_jit.cache_folder())
    assert not first.exists()

"""One source, compiled or not: the JIT switched off gives the same numbers."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from compressor import program
from compressor.physics import _jit

PROBE = """
import json
import numpy as np
from compressor import Case
from compressor.physics import _jit
from compressor.physics.observe import COLUMNS
from compressor.physics.systems import observe_at
from compressor.solve.si_record import record
from compressor.solve.simulate import observe

rows, runs, rng = [], [], np.random.default_rng(7)
for joint in ("big_end", "small_end", "both"):
    p = record(Case.from_values({"joint": joint, "clearance_mm": 0.2}))
    for phase in range(4):
        y = rng.normal(size=8 if joint == "both" else 4) * 3e-4
        row = np.empty(COLUMNS)
        observe_at(0.01 + phase, y, phase, p, row)
        rows.append(row.tolist())
solve = {"duration_rev": 0.005, "settle_rev": 0, "output_step_deg": 0.2, "error_bars": False}
for method in "TSIT5", "RODAS":
    how = {**solve, "method": method, "rtol": 1e-6}
    values = {"joint": "both", "clearance_mm": 0.2, "solve": how}
    run, series = observe(Case.from_values(values))
    numbers = [float(run.numbers[name]) for name in ("steps", "peak_acceleration")]
    runs.append([*numbers, *series["acceleration"][1].tolist()])
print(json.dumps({"compiled": _jit.ENABLED, "rows": rows, "runs": runs}))
"""


@pytest.mark.slow
def test_compiled_and_pure_agree(capsys):
    """To the bit, since both compute in the order written."""
    exec(PROBE, {})
    compiled = json.loads(capsys.readouterr().out)
    call = {"env": os.environ | {"COMPSIM_JIT": "0"}, "capture_output": True, "check": True}
    pure = json.loads(subprocess.run([sys.executable, "-c", PROBE], **call).stdout)
    assert (compiled.pop("compiled"), pure.pop("compiled")) == (True, False)
    assert compiled == pure


def test_machine_code_belongs_to_its_sources(tmp_path, monkeypatch):
    for name in ("_jit.py", "contact.py"):
        (tmp_path / name).write_text("K = 1\n", encoding="utf-8")
    monkeypatch.setattr(program, "COMPILED", tmp_path)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)  # where ours would go, too
    first = program.machine_code_folder()
    first.mkdir(parents=True)
    assert program.machine_code_folder() == first
    monkeypatch.setattr(program.metadata, "version", {"numba": "0.1"}.get)
    other = program.machine_code_folder()
    assert other != first
    for same in (first, other):  # which another environment may use
        _jit.discard_other_code(same)
        assert first.exists()
    (tmp_path / "contact.py").write_text("K = 2\n", encoding="utf-8")
    assert program.machine_code_folder() != first
    _jit.discard_other_code(program.machine_code_folder())
    assert not first.exists()


@pytest.mark.parametrize("kind", ["file", "proc"])
def test_a_named_folder_that_takes_no_file_is_refused(kind, tmp_path, monkeypatch):
    named = Path("/proc") if kind == "proc" else tmp_path / "named"
    if kind == "file":
        named.write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(named))
    told = f"to {named}, .*: set NUMBA_CACHE_DIR to a folder"
    with pytest.raises(program.CompsimError, match=told):
        program.machine_code_folder()

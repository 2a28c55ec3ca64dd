"""One source, compiled or not: the JIT switched off gives the same numbers."""

import gc
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from compressor import program
from compressor.physics import _jit
from compressor.physics._jit import dispatch_on_record, inline_llvm, jit, square_root
from compressor.physics.record import new_record

COMPRESSOR = Path(program.__file__).parent
PROBE = """
import json
import numpy as np
from compressor import Case, simulate
from compressor.physics import _jit
from compressor.physics.observe import COLUMNS
from compressor.physics.systems import observe_at
from compressor.solve.si_record import record

rows, runs, rng = [], [], np.random.default_rng(7)
for joint in ("big_end", "small_end", "both"):
    p = record(Case.from_values({"joint": joint, "clearance_mm": 0.2}))
    for phase in range(4):
        y = rng.normal(size=8 if joint == "both" else 4) * 3e-4
        row = np.empty(COLUMNS)
        observe_at(0.01 + phase, y, phase, p, row)
        rows.append(row.tolist())
solve = {"duration_rev": 0.025, "settle_rev": 0, "output_step_deg": 1, "error_bars": False}
for method, rtol in ("TSIT5", 1e-8), ("RODAS", 1e-6):
    how = {**solve, "method": method, "rtol": rtol}
    values = {"joint": "both", "clearance_mm": 0.2, "solve": how}
    run = simulate(Case.from_values(values))
    a = run.acceleration.values.tolist()
    runs.append([rtol, int(run.steps), [float(run.peak_acceleration), *a]])
print(json.dumps({"compiled": _jit.ENABLED, "rows": rows, "runs": runs}))
"""


def probe(jit):
    environment = {**os.environ, "COMPSIM_JIT": jit}
    call = [sys.executable, "-c", PROBE]
    done = subprocess.run(call, env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.mark.slow
def test_compiled_and_pure_agree():
    """To the bit, since both compute in the order written."""
    compiled, pure = probe("1"), probe("0")
    assert (compiled.pop("compiled"), pure.pop("compiled")) == (True, False)
    assert compiled == pure


def test_machine_code_belongs_to_its_sources(tmp_path, monkeypatch):
    for name in ("_jit.py", "contact.py"):
        (tmp_path / name).write_text("K = 1\n", encoding="utf-8")
    monkeypatch.setattr(program, "COMPILED", tmp_path)
    first = program.machine_code_folder()
    first.mkdir(parents=True)
    assert program.machine_code_folder() == first
    (tmp_path / "contact.py").write_text("K = 2\n", encoding="utf-8")
    assert program.machine_code_folder() != first
    _jit.discard_other_code(first)
    assert first.exists()
    _jit.discard_other_code(program.machine_code_folder())
    assert not first.exists()


@pytest.mark.parametrize("kind", ["file", "proc", "full disk"])
def test_a_named_folder_that_takes_no_file_is_replaced_with_a_remark(kind, tmp_path, monkeypatch):
    named = Path("/proc") if kind == "proc" else tmp_path / "named"
    if kind == "file":
        named.write_text("")
    elif kind == "full disk":

        def refuse(dir=None):
            if Path(dir).is_relative_to(named):
                raise OSError(28, "No space left on device")
            return made(dir=dir)

        made = program.tempfile.TemporaryFile
        monkeypatch.setattr(program.tempfile, "TemporaryFile", refuse)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(named))
    with pytest.warns(
        program.CompsimWarning, match=rf"{named} \(NUMBA_CACHE_DIR\): another folder"
    ):
        found = program.machine_code_folder()
    assert found.parent == program.COMPILED / "__pycache__"
    assert program.machine_code_folder() == found  # without a remark, also in workers


def test_a_user_without_a_home_may_name_a_folder(tmp_path, monkeypatch):
    for name in ("XDG_CACHE_HOME", "NUMBA_CACHE_DIR"):
        monkeypatch.setenv(name, "")  # so that it is put back, and then gone
        monkeypatch.delenv(name)
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)
    monkeypatch.setattr(program, "COMPILED", Path("/proc"))  # where nothing may be written
    monkeypatch.setattr(program, "sources_hash", lambda _: "0" * 16)  # processes come and go there
    with pytest.warns(program.CompsimWarning, match="again next time"):
        assert "compsim-" in str(program.machine_code_folder())
    assert not Path("~").exists()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert program.machine_code_folder().parent == tmp_path / "compsim"


@pytest.mark.compiled
def test_a_negative_number_has_no_square_root_either_way():
    numba = pytest.importorskip("numba")
    _jit.load_numba()

    @numba.njit
    def compiled(a):
        return square_root(a)

    for number in (-1.0, math.nan):
        assert math.isnan(compiled(number))
        assert math.isnan(square_root(number))  # from Python
    assert compiled(2.25) == square_root(2.25) == 1.5


@inline_llvm
def product(x, p):
    return x * p.omega


@inline_llvm
def of_no_field(x, p):
    return x + p.no_such_field


either = dispatch_on_record("viscosity", of_no_field, product)


@jit
def one_more(x, p):
    return either(x, p) + 1.0


def test_a_function_by_record_is_that_of_its_kind():
    """The other is not even compiled: it reads a field that no record has."""
    p = new_record()
    p["omega"] = 3.0
    assert (either(2.0, p), one_more(2.0, p)) == (6.0, 7.0)
    wrong = new_record(chosen=True)
    with pytest.raises(Exception, match="no_such_field"):
        one_more(2.0, wrong)


@pytest.mark.skipif(not _jit.ENABLED, reason="nothing is compiled")
def test_garbage_is_collected_seldom_while_numba_compiles_and_as_before_afterwards():
    import numba
    from numba.core.event import Event, EventStatus, broadcast

    before, during = gc.get_threshold(), []
    _jit.load_numba()
    compiling = [Event("numba:compile", status) for status in EventStatus]
    for event in (compiling[0], compiling[0]):  # a function, and one that it calls
        broadcast(event)
        during.append(gc.get_threshold())
    broadcast(compiling[1])
    during.append(gc.get_threshold())
    broadcast(compiling[1])
    assert during == [_jit.COLLECTING] * 3
    assert gc.get_threshold() == before
    with pytest.raises(numba.TypingError):
        jit(lambda x: x + "text")(1.0)
    assert gc.get_threshold() == before

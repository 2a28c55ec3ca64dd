"""What a program may import from `compressor`: its names, found lazily, and their types."""

import ast
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import compressor

ROOT = Path(__file__).parent.parent
SOURCE = (ROOT / "compressor" / "__init__.py").read_text(encoding="utf-8")

USER = """\
import compressor
from compressor import Case, CaseError, Machine, open_study

try:
    case = Case.from_values({"joint": "big_end", "clearance_mm": 0.2})
except CaseError as error:
    print([problem.key for problem in error.problems])
run = compressor.simulate(case)
machine: Machine = case.machine
speed: float = machine.speed_rpm * case.omega
peaks = {c.key: float(compressor.simulate(c).peak_acceleration) for c in compressor.load_cases("x")}
study = open_study("results", "big-end", trusted=True).sel(clearance_mm=0.2)
"""
# line of a mistaken program -> the code of what mypy must say about it
MISTAKEN = {
    "from compressor import simulat": "attr-defined",
    "import compressor": "",
    "compressor.open_studies('results')": "attr-defined",
    "case = compressor.Case.from_values(3)": "arg-type",
    "case.machine.rod_mass": "attr-defined",
    "name: str = case.machine.rod_mass_kg": "assignment",
    "case.machine.rod_mass_kg = 3.0": "misc",
    "compressor.simulate('big-end.yaml')": "arg-type",
    "compressor.load_cases(['big-end.yaml'])": "arg-type",
    "compressor.open_study('results', trusted='yes')": "arg-type",
    "compressor.Machine(rod_mass=3.0)": "call-arg",
}
# what is theirs is left out: reading the libraries' types takes mypy twice the time and more
SETTINGS = """\
[mypy]
strict = true
cache_dir = /dev/null
[mypy-xarray.*,numpy.*,scipy.*,h5py.*,h5netcdf.*,yaml.*,numba.*,pandas.*,joblib.*,distributed.*]
follow_imports = skip
follow_imports_for_stubs = true
[mypy-matplotlib.*,contourpy.*,PIL.*,jinja2.*,plotly.*,rich.*,IPython.*,click.*]
follow_imports = skip
follow_imports_for_stubs = true
"""


def test_dir_lists_the_public_names():
    assert dir(compressor) == compressor.__all__ == sorted(compressor.__all__)
    program = "import compressor, sys; dir(compressor); print('numpy' in sys.modules)"
    shown = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert shown.strip() == "False", "listing the names loads what they need"


def lazy_imports():
    """(module, name) of each import that type checkers alone see."""
    (block,) = [n for n in ast.parse(SOURCE).body if isinstance(n, ast.If) and not n.orelse
                and isinstance(n.test, ast.Name)]  # fmt: skip
    return [(str(line.module), alias.name) for line in block.body for alias in line.names]


@pytest.mark.parametrize(("module", "name"), lazy_imports())
def test_type_checkers_see_what_is_imported(module, name):
    assert name in compressor.__all__
    assert getattr(compressor, name) is getattr(import_module(module), name)


def test_type_checkers_see_every_name():
    here = {"__version__", "CompsimError", "CompsimWarning"}
    assert {name for _, name in lazy_imports()} | here == {*compressor.__all__}


def test_other_names_are_refused():
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        compressor.simulat  # noqa: B018


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """What mypy says of a user's programs, which find the package as an installed one."""
    place = tmp_path_factory.mktemp("user")
    (place / "user.py").write_text(USER)
    (place / "mistaken.py").write_text("\n".join(MISTAKEN))
    (place / "mypy.ini").write_text(SETTINGS)
    call = [
        sys.executable,
        "-m",
        "mypy",
        "--show-error-codes",
        "--no-pretty",
        "user.py",
        "mistaken.py",
    ]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(call, cwd=place, env=env, capture_output=True, text=True).stdout


@pytest.mark.slow
def test_a_right_program_is_accepted(said):
    assert [line for line in said.splitlines() if line.startswith("user.py")] == []


@pytest.mark.slow
def test_each_mistake_is_refused(said):
    told = {line: code for line, code in enumerate(MISTAKEN.values(), 1) if code}
    lines = [
        line for line in said.splitlines() if line.startswith("mistaken.py") and ": error:" in line
    ]
    assert {int(line.split(":")[1]): line.rpartition("[")[2].rstrip("]") for line in lines} == told

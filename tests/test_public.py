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

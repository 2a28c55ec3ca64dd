"""The table of studies: what each gives the program, and that the program does without each."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import test_layers

from compressor.studies import STUDIES, find_drawn

ROOT = Path(__file__).parent.parent.parent
FOLDERS = sorted(path.parent.name for path in (ROOT / "compressor/studies").glob("*/__init__.py"))
NAMES = [kind.name for kind in STUDIES]
OLD_PLACES = [place.rpartition(".")[2] for place in test_layers.OLD_PLACES]


def test_every_line_of_the_table_has_a_folder():
    assert {*NAMES} <= {*FOLDERS}


@pytest.mark.parametrize("kind", STUDIES, ids=NAMES)
def test_a_study_has_the_parts_that_its_line_names(kind):
    if kind.group:
        group = kind.module("group")
        assert {*group.NEEDED} <= {*group.ROWS}
        assert callable(group.read)
        assert group.ABOUT
    if kind.figures:
        assert callable(kind.module("plots").write)
        assert kind.files.result.endswith("*/study.json")
    assert hasattr(kind.module("page"), "add") if kind.has_page else not kind.page_folder


def test_of_a_folder_without_studies_nothing_is_drawn_by_one(tmp_path):
    assert find_drawn(tmp_path) == {}


def copy_without_studies(folder):
    """Copy the source, without the folders of all studies and their lines in the table."""
    ignore = shutil.ignore_patterns("__pycache__", ".compsim*")
    shutil.copytree(ROOT / "compressor", folder / "compressor", ignore=ignore)
    shutil.copytree(ROOT / "cmd", folder / "cmd", ignore=ignore)
    table = folder / "compressor/studies/__init__.py"
    for name in FOLDERS:
        shutil.rmtree(folder / "compressor/studies" / name)
    text, count = re.subn(r"^STUDIES = \(\n.*?^\)", "STUDIES: tuple = ()", table.read_text(),
                          flags=re.DOTALL | re.MULTILINE)  # fmt: skip
    assert count == 1
    table.write_text(text)
    for name in OLD_PLACES:
        (folder / f"compressor/{name}.py").unlink()
    return folder


def run_in(folder, code):
    """Run Python in a copy, which compiles nothing, and return what it prints."""
    begin = f"import sys; sys.path[:0] = [{str(folder)!r}, {str(folder / 'cmd')!r}]\n"
    done = subprocess.run(
        [sys.executable, "-c", begin + code], capture_output=True, text=True, cwd=folder,
        env=os.environ | {"COMPSIM_JIT": "0"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


EVERY_MODULE = """
import importlib, pathlib
import compressor
assert compressor.__file__.startswith(sys.path[0])
for top, root in (("compressor", "."), ("cmd/compsim", "cmd")):
    for path in sorted(pathlib.Path(top).rglob("*.py")):
        if path.stem not in ("__main__", "_jit"):
            parts = path.relative_to(root).with_suffix("").parts
            importlib.import_module(".".join(part for part in parts if part != "__init__"))
"""


ERROR = """
from compressor import CaseFileError
from compressor.cases.load import load_studies
try:
    load_studies("one.yaml")
except CaseFileError as error:
    print(error)
"""


MAIN_JOB = """
from pathlib import Path
from compsim import cli
Path("one.yaml").write_text(
    "clearance_mm: 0\\njoint: none\\nload: [spring, none]\\n"
    "solve: {duration_rev: 0.1, settle_rev: 0, accuracy: draft, output_step_deg: 1}\\n"
)
assert cli.main(["plan", "one.yaml"]) == 0
assert cli.main(["run", "one.yaml", "-j", "1", "--quiet"]) == 0
assert cli.main(["report"]) == 0
assert cli.main(["show", "one", "load=none"]) == 0
assert "Study one" in Path("report/index.html").read_text()
"""


def test_the_program_does_without_all_of_them(tmp_path):
    copy = copy_without_studies(tmp_path)
    run_in(copy, MAIN_JOB + EVERY_MODULE)
    (copy / "one.yaml").write_text("load: none\nregimes: {over: clearance_mm}\n")
    error = run_in(copy, ERROR)
    assert error.startswith("one.yaml:2:1: regimes: unknown key; a case file has name, ")
    assert "regimes" not in error.partition(";")[2]

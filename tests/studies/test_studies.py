"""The table of studies: what each gives the program, and that the program does without each."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
import test_layers

from compressor.studies import STUDIES, by_kind, find_drawn, verbs_by_heading

ROOT = Path(__file__).parent.parent.parent
FOLDERS = sorted(path.parent.name for path in (ROOT / "compressor/studies").glob("*/__init__.py"))
NAMES = [kind.name for kind in STUDIES]
OLD_PLACES = [place.rpartition(".")[2] for place in test_layers.OLD_PLACES]


def test_every_folder_is_in_the_table_and_the_other_way_round():
    assert sorted(NAMES) == FOLDERS


@pytest.mark.parametrize("kind", STUDIES, ids=NAMES)
def test_a_study_has_the_parts_that_its_line_names(kind):
    for verb in kind.verbs:
        assert isinstance(getattr(kind.module("command"), verb), click.Command)
    if kind.group:
        command = kind.module("command")
        for name in ("check_options", "run_studies", "ahead", "ahead_lines"):
            assert callable(getattr(command, name))
        group = kind.module("group")
        assert {*group.NEEDED} <= {*group.ROWS}
        assert callable(group.read)
        assert group.ABOUT
    if kind.figures:
        assert callable(kind.module("plots").write)
        assert kind.files.result.endswith("*/study.json")
    assert hasattr(kind.module("page"), "add") if kind.has_page else not kind.page_folder


def test_a_verb_belongs_to_one_study():
    names = [command.name for found in verbs_by_heading().values() for command in found]
    assert len({*names}) == len(names)
    assert {*names} >= {"claims", "dataset", "explain", "find", "identify", "stress", "tradeoff"}


def test_of_a_folder_without_studies_nothing_is_drawn_by_one(tmp_path):
    assert find_drawn(tmp_path) == {}
    assert by_kind([]) == {}


def copy_without(folder, names):
    """Copy the source, without the folders of some studies and their lines in the table."""
    ignore = shutil.ignore_patterns("__pycache__", ".compsim*")
    shutil.copytree(ROOT / "compressor", folder / "compressor", ignore=ignore)
    shutil.copytree(ROOT / "cmd", folder / "cmd", ignore=ignore)
    table = folder / "compressor/studies/__init__.py"
    text = table.read_text()
    for name in names:
        shutil.rmtree(folder / "compressor/studies" / name)
        text, count = re.subn(rf'^    StudyKind\(\s*"{name}".*?\),\n(?=\)|    StudyKind)', "", text,
                              flags=re.DOTALL | re.MULTILINE)  # fmt: skip
        assert count == 1
    table.write_text(text)
    for name in {*names} & {*OLD_PLACES}:
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
from compsim.cli import cli
print(*cli.commands)
"""


ERROR = """
from compressor import CaseFileError
from compressor.cases.load import load_studies
try:
    load_studies("one.yaml")
except CaseFileError as error:
    print(error)
"""


ADDED = """
from compsim import cli
from compressor.cases import case_schema, load_studies
load_studies("jobs.yaml")
assert not {"compressor.studies.added.group", "compressor.studies.regimes.group"} & {*sys.modules}
assert cli.main(["plan", "added.yaml"]) == 0
schema = case_schema()["properties"]
assert str(schema["added"]) == str(schema["regimes"])
"""


def test_a_study_with_a_group_is_a_folder_and_a_line(tmp_path):
    studies = copy_without(tmp_path, []) / "compressor/studies"
    shutil.copytree(studies / "regimes", studies / "added")
    for path in (studies / "added").glob("*.py"):
        text = path.read_text().replace("compressor.studies.regimes", "compressor.studies.added")
        path.write_text(text.replace('GROUP = "regimes"', 'GROUP = "added"'))
    table = (studies / "__init__.py").read_text()
    line = 'STUDIES = (\n    StudyKind("added", group="added"),'
    (studies / "__init__.py").write_text(table.replace("STUDIES = (", line))
    followed = "{over: clearance_mm, from: 0.1, to: 1, n: 3}\n"
    (tmp_path / "jobs.yaml").write_text("load: none\n")
    (tmp_path / "added.yaml").write_text(f"joint: big_end\nadded: {followed}")
    (tmp_path / "one.yaml").write_text(f"added: {followed}regimes: {followed}")
    assert "added  1 chain x 3 values" in run_in(tmp_path, ADDED)
    error = "one.yaml:2:1: regimes: stands in place of added: give one of the two\n"
    assert run_in(tmp_path, ERROR) == error


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
print("all modules:")
"""


def test_the_program_does_without_all_of_them(tmp_path):
    copy = copy_without(tmp_path, NAMES)
    left = run_in(copy, MAIN_JOB + EVERY_MODULE).partition("all modules:")[2].split()
    assert sorted(left) == ["completion", "export", "init", "plan", "plot", "report", "run",
                            "schema", "show", "status", "verify"]  # fmt: skip
    for group in {kind.group for kind in STUDIES if kind.group}:
        (copy / "one.yaml").write_text(f"load: none\n{group}: {{over: clearance_mm}}\n")
        error = run_in(copy, ERROR)
        assert error.startswith(f"one.yaml:2:1: {group}: unknown key; a case file has name, ")
        assert group not in error.partition(";")[2]

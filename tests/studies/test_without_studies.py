"""What studies give the program, and that the program does without all of them."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from compressor.studies import page_additions

ROOT = Path(__file__).parent.parent.parent
# of a folder or a file each; `frame` is what they share
STUDIES = sorted(
    path.parent if path.name == "__init__.py" else path
    for path in (ROOT / "compressor/studies").rglob("*.py")
    if (path.parent.name == "studies" and path.stem not in ("__init__", "frame"))
    or (path.parent.parent.name == "studies" and path.name == "__init__.py")
)


def test_studies_have_what_others_are_promised():
    assert [one.keywords["place"] for one in page_additions({"alarms": "mine"})] == ["", "mine"]


def copy_without_studies(folder):
    """Copy the source, without the folders of all studies and what they give to others."""
    ignore = shutil.ignore_patterns("__pycache__", ".compsim*")
    shutil.copytree(ROOT / "compressor", folder / "compressor", ignore=ignore)
    shutil.copytree(ROOT / "cmd", folder / "cmd", ignore=ignore)
    table = folder / "compressor/studies/__init__.py"
    for one in STUDIES:
        copied = folder / one.relative_to(ROOT)
        shutil.rmtree(copied) if copied.is_dir() else copied.unlink()
    lines = table.read_text().splitlines(keepends=True)
    left = [line for line in lines if not line.startswith("PAGES = ")]
    assert len(left) == len(lines) - 1
    table.write_text("".join([*left, "PAGES: dict[str, str] = {}\n"]))
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


MAIN_JOB = """
from pathlib import Path
from compressor.report.figures import pictures
from compsim import cli
pictures.render = lambda drawing: b"drawn"
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

"""Try the program with the oldest versions of its libraries that pyproject.toml allows.

`python3 tests/oldest.py` installs them and the program into a folder of its own, prints help, runs
one job and reports it. With `--tests` it runs a sample of the tests there, too. The bounds are
those of Python 3.11: other versions have no wheels of some of them, and there nothing is tried.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from release import ROOT, install, make_environment

NEEDED = ("pyproject.toml", "README.md", "cmd", "compressor")
BOUND = re.compile(r"([A-Za-z0-9_-]+)>=([0-9.]+)(,<.*)?")
SAMPLE = ("cases", "cmd", "report", "store", "sweep/test_sweep.py", "physics/test_march.py")
TOOLS = (
    "pytest", "pytest-xdist", "hypothesis", "jsonschema", "sympy", "distributed", "scikit-learn",
)  # fmt: skip
CASE = "{joint: big_end, clearance_mm: 0.2, solve: {duration_rev: 2, accuracy: draft}}"


def oldest_versions(requirements):
    """Return the lower bound of each requirement, as pip pins it; ValueError where one has none."""
    found = []
    for one in requirements:
        bound = BOUND.fullmatch(one)
        if not bound:
            raise ValueError(f"{one} has no lower bound")
        found.append(f"{bound[1]}=={bound[2]}")
    return found


def try_oldest(place, with_tests):
    """Install the program with its oldest libraries into a folder and run it; raises on failure."""
    with open(ROOT / "pyproject.toml", "rb") as file:
        pins = oldest_versions(tomllib.load(file)["project"]["dependencies"])
    source = place / "source"  # pip leaves files beside what it builds
    source.mkdir()
    for name in NEEDED:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, source / name)
    call = make_environment(place)
    install(call, *pins, *(TOOLS if with_tests else ()))
    install(call, "--no-deps", source)
    (place / "oldest.yaml").write_text(CASE, encoding="utf-8")
    for words in ("--version", "--help", "run oldest.yaml -j 1", "verify", "report"):
        call("compsim", *words.split())
    if with_tests:
        tests = [ROOT / "tests" / name for name in SAMPLE]
        call("python", "-m", "pytest", "-n", "2", *tests, cwd=ROOT)


if __name__ == "__main__":
    if sys.version_info[:2] != (3, 11):
        print("oldest versions: not tried, their bounds are those of Python 3.11")
        sys.exit()
    with tempfile.TemporaryDirectory() as folder:
        try:
            try_oldest(Path(folder), "--tests" in sys.argv[1:])
        except subprocess.CalledProcessError as error:
            sys.exit(f"oldest versions: {error}")

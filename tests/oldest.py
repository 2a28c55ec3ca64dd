"""Try the program with the oldest versions of its libraries that pyproject.toml allows.

`python3 tests/oldest.py` installs them and the program into a folder of its own, prints help and
runs one job. With `--tests` it runs a sample of the tests there, too. The bounds are those of
Python 3.11: other versions have no wheels of some of them, and there nothing is tried.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).parent.parent
NEEDED = ("pyproject.toml", "README.md", "cmd", "compressor")
BOUND = re.compile(r"([A-Za-z0-9_-]+)>=([0-9.]+)(,<.*)?")
SAMPLE = ("cases", "cmd", "report", "store", "sweep/test_sweep.py", "physics/test_march.py")
TOOLS = (
    "pytest", "pytest-xdist", "hypothesis", "jsonschema", "sympy", "distributed", "scikit-learn",
)  # fmt: skip
CASE = "{joint: big_end, clearance_mm: 0.2, solve: {duration_rev: 2, accuracy: draft}}"


def oldest_versions(requirements):
    """Return the lower bound of each requirement, as pip pins it.

    Raises ValueError where one has no bound.
    """
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
    venv.create(place / "env", with_pip=True)
    python = place / "env" / "bin" / "python"
    source = place / "source"  # pip leaves files beside what it builds
    source.mkdir()
    for name in NEEDED:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, source / name)

    def call(*words, **options):
        print("$", *words, flush=True)
        subprocess.run(words, check=True, **options)

    install = (python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    call(*install, *pins, *(TOOLS if with_tests else ()))
    call(*install, "--no-deps", str(source))
    compsim = place / "env" / "bin" / "compsim"
    (place / "oldest.yaml").write_text(CASE, encoding="utf-8")
    call(compsim, "--version", cwd=place)
    call(compsim, "--help", cwd=place)
    call(compsim, "run", "oldest.yaml", "-j", "1", cwd=place)
    call(compsim, "verify", cwd=place)
    if with_tests:
        tests = [str(ROOT / "tests" / name) for name in SAMPLE]
        call(python, "-m", "pytest", "-n", "2", *tests, cwd=ROOT)


if __name__ == "__main__":
    if sys.version_info[:2] != (3, 11):
        print("oldest versions: not tried, their bounds are those of Python 3.11")
        sys.exit()
    with tempfile.TemporaryDirectory() as folder:
        try:
            try_oldest(Path(folder), "--tests" in sys.argv[1:])
        except subprocess.CalledProcessError as error:
            sys.exit(f"oldest versions: {error}")

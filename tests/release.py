"""Try a built wheel as a user gets it: in an environment of its own, outside of the repository.

`make release` builds the folder that this is called with.
"""

import os
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def make_environment(place):
    """Make an environment `env` in a folder; returns how its programs are called from there."""
    venv.create(place / "env", with_pip=True)
    alone = {name: text for name, text in os.environ.items() if not name.startswith("PYTHON")}

    def call(program, *words, cwd=place):
        print("$", program, *words, flush=True)
        path = place / "env" / "bin" / program
        subprocess.run([path, *words], check=True, cwd=cwd, env=alone)

    return call


def install(call, *words):
    call("python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *words)


def data_files():
    """Yield what the program reads beside its Python: templates, examples, the marker of types."""
    tracked = subprocess.run(
        ["git", "ls-files", "compressor"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for name in tracked.stdout.split():
        if {"templates", "examples"} & {*Path(name).parts} or name.endswith("py.typed"):
            yield name


def try_wheel(wheel, place):
    """Look into a wheel, install it, and run the paper's cases; raises where anything fails."""
    packed = zipfile.ZipFile(wheel).namelist()
    missing = [name for name in data_files() if name not in packed]
    if missing:
        raise FileNotFoundError(f"not in {wheel.name}: {', '.join(missing)}")
    call = make_environment(place)
    install(call, wheel)
    for words in ("--version", "init paper", "run paper.yaml", "report", "verify"):
        call("compsim", *words.split())
    if not (place / "report" / "index.html").exists():
        raise FileNotFoundError("report/index.html")


if __name__ == "__main__":
    (built,) = Path(sys.argv[1]).resolve().glob("*.whl")
    with tempfile.TemporaryDirectory() as folder:
        try:
            try_wheel(built, Path(folder))
        except (OSError, subprocess.CalledProcessError) as error:
            sys.exit(f"release: {error}")
    print(f"release: {built.name} works by itself")

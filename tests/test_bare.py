"""The guard under which CI runs the tests: what it lets through, and what it does not."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from bare import KEPT, PROGRAMS, bare

SCRIPT = Path(__file__).parent / "bare.py"


@pytest.fixture
def environment(tmp_path, monkeypatch):
    for name in ("PYTHONUNBUFFERED", "PIP_INDEX_URL", "https_proxy"):
        monkeypatch.setenv(name, "1")
    return bare(tmp_path)


def test_nothing_but_what_pip_needs_is_left_of_the_environment(environment):
    assert environment.keys() >= {"HOME", "LANG", "PATH", "PIP_INDEX_URL", "https_proxy"}
    assert all(name == "PATH" or KEPT.fullmatch(name) for name in environment)
    assert "PYTHONUNBUFFERED" not in environment


def test_no_other_program_is_found(environment):
    names = set(os.listdir(environment["PATH"]))
    assert {"python3", "make", "git", "sh", "cp", "mktemp"} <= names <= {"python3", *PROGRAMS}


def test_a_virtual_environment_outlives_the_guard(tmp_path):
    words = [sys.executable, str(SCRIPT), "python3", "-m", "venv", "--without-pip", str(tmp_path)]
    subprocess.run(words, check=True)
    assert subprocess.run([tmp_path / "bin" / "python", "-c", ""]).returncode == 0


def test_a_command_s_exit_code_is_passed_on():
    for code in (0, 3):
        words = [sys.executable, str(SCRIPT), "python3", "-c", f"raise SystemExit({code})"]
        assert subprocess.run(words).returncode == code

"""On Windows results are read, planned and drawn; only a run needs what that system lacks."""

import json
import subprocess
import sys
import textwrap

import pytest
from conftest import part_of

# modules and signals that Python does not have on Windows, taken away before ours are imported
WITHOUT = """
import importlib.abc, signal, sys

class Absent(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name in ("fcntl", "resource"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

for name in ("fcntl", "resource"):
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Absent())
del signal.SIGHUP, signal.SIGPIPE
"""
CASE = {
    "joint": "big_end", "clearance_mm": [0.1, 0.2],
    "solve": {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9},
}  # fmt: skip


@pytest.fixture
def elsewhere(tmp_path):
    """Runs Python code without these modules; returns what it printed, as stdout and stderr."""
    (tmp_path / "two.yaml").write_text(json.dumps(CASE))

    def run(code):
        script = WITHOUT + textwrap.dedent(code)
        done = subprocess.run(
            [sys.executable, "-c", script], cwd=tmp_path,
            capture_output=True, text=True,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout, done.stderr

    return run


def commands(*lines):
    """Code that calls commands one after the other, and stops at the first that fails."""
    call = "assert cli.main([*line]) == 0, line"
    return f"from compsim import cli\nfor line in {lines!r}: {call}"


def test_the_library_reads_and_simulates(elsewhere, paper_store):
    out, _ = elsewhere(f"""
        import compressor
        study = compressor.open_study({str(paper_store)!r}, "big-end")
        run = compressor.simulate(compressor.load_cases("two.yaml")[0])
        print(study.sizes["clearance_mm"], run.status.item())
    """)
    assert out == "3 ok\n"


def test_commands_that_run_nothing_work(elsewhere, paper_store, tmp_path):
    results = str(paper_store)
    part_of(paper_store, tmp_path / "part", "typical")
    out, _ = elsewhere(
        commands(
            ("init", "wear", "-o", "mine.yaml"),
            ("plan", "two.yaml"),
            ("status", "-r", results),
            ("show", "big-end", "clearance_mm=0.2", "-r", results),
            ("export", "big-end", "-r", results, "-o", "x.csv"),
            ("plot", "big-end", "clearance_mm=0.2", "--what", "orbits", "-r", results),
            ("report", "-r", "part", "-o", "page"),
        )
    )
    assert (tmp_path / "mine.yaml").exists()
    assert "2 jobs" in out
    assert "big-end" in out
    assert (tmp_path / "page/index.html").exists()
    assert (tmp_path / "page/figure-03.png").exists()


def test_a_run_ends_with_one_clear_line(elsewhere):
    follow = ["follow", "two.yaml", "--over", "machine.speed_rpm=300:500:2"]
    commands = ["run", "two.yaml"], follow
    code = f"from compsim import cli\nprint(*(cli.main(words) for words in {commands}))"
    out, err = elsewhere(code)
    assert out == "2 2\n"
    assert err.count("has no resource, which a run needs: run it under Linux, macOS or WSL") == 2
    assert "Traceback" not in err
    assert "compiling" not in err

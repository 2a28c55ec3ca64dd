"""Streams that are closed, full or no longer read, and names that would steer a terminal."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from compsim import cli

ROOT = Path(__file__).parent.parent.parent
STORED = ["run", str(ROOT / "configs/big-end.yaml"), "--set", "solve.accuracy=draft", "-r"]


@pytest.fixture
def spawn(paper_store, tmp_path):
    """Run a command in a process of its own, on a store that has all its jobs."""

    def run(*words, **options):
        words = [str(paper_store) if word == "STORE" else word for word in words]
        call = [sys.executable, "-m", "compsim", *words]
        options = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, **options}
        return subprocess.run(call, cwd=tmp_path, text=True, timeout=100, **options)

    return run


@pytest.mark.parametrize(
    ("words", "code"),
    [(["status", "-r", "STORE"], 141), ([*STORED, "STORE"], 0)],  # 0: all was done before
)
def test_output_that_nobody_reads_ends_in_silence(words, code, spawn):
    reader, writer = os.pipe()
    os.close(reader)
    done = spawn(*words, stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    assert done.returncode == code
    assert all(
        line.startswith(("nothing to do", "next: ")) or "settle_rev: auto" in line
        for line in done.stderr.replace("\n  ", " ").splitlines()  # remarks are wrapped
    )


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
def test_output_that_does_not_fit_is_told_in_one_line(spawn):
    with open("/dev/full", "w") as full:
        done = spawn("--help", stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 5
    (line,) = done.stderr.splitlines()
    assert line.startswith("compsim: stdout: No space left on device; ")


def test_a_lack_of_memory_or_processes_is_told_in_one_line(capsys):
    unmapped = ImportError("numpy.so: failed to map segment from shared object")
    of_joblib = AttributeError("'DummyProcess' object has no attribute 'terminate'")
    of_joblib.__context__ = RuntimeError("can't start new thread")
    memory = MemoryError("8 GiB"), unmapped, OSError(12, "Cannot allocate memory")
    for error, option in (dict.fromkeys(memory, "-v") | {of_joblib: "-u"}).items():
        assert cli.report_error(error) == 1
        (said,) = capsys.readouterr().err.splitlines()
        assert said.endswith(f": allow more (ulimit {option}), or use fewer workers (-j)")


def test_a_path_that_cannot_be_read_is_named_in_one_line(capsys):
    for number in (errno.EACCES, errno.EIO, errno.ESTALE):
        assert cli.report_error(OSError(number, os.strerror(number), "/store/jobs")) == 5
        said = capsys.readouterr().err
        assert said.startswith(f"compsim: /store/jobs: {os.strerror(number)}; "), said
    with pytest.raises(FileNotFoundError) as caught:
        open("/no/such/file")  # such a path is a mistake of the program
    assert cli.report_error(caught.value) == 1
    assert "Traceback" in capsys.readouterr().err


def test_a_current_folder_that_was_removed_is_told_in_one_line(tmp_path, monkeypatch, compsim):
    monkeypatch.chdir(tmp_path)
    tmp_path.rmdir()
    said = compsim("init", "machine", code=2).err
    assert said == "compsim: the current folder was removed; cd to one that is there\n"


def test_ctrl_c_amid_an_import_leaves_no_traceback(tmp_path):
    begun = tmp_path / "begun"
    (tmp_path / "click.py").write_text(
        f"import pathlib, time\npathlib.Path({str(begun)!r}).touch()\ntime.sleep(60)\n",
        encoding="utf-8",
    )
    call = [sys.executable, "-m", "compsim", "status"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    running = subprocess.Popen(call, env=environment, stderr=subprocess.PIPE, text=True)
    while not begun.exists():
        assert running.poll() is None
        time.sleep(0.01)
    running.send_signal(signal.SIGINT)
    assert running.communicate(timeout=30)[1] == ""
    assert running.returncode == -signal.SIGINT


@pytest.mark.skipif(sys.platform != "linux", reason="other systems refuse such names")
def test_a_folder_whose_name_is_no_utf_8_holds_results(tmp_path, in_process):
    (tmp_path / "healthy.yaml").write_text(
        "solve: {duration_rev: 0.1, settle_rev: 0, accuracy: draft, output_step_deg: 1}\n"
    )
    folder = os.fsdecode(b"r\xff")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        assert cli.main(["run", "healthy.yaml", "-j", "1", "-r", folder]) == 0
        assert next(os.scandir(b"r\xff/batches")).is_file()
        for verb in ("status", "verify"):
            assert cli.main([verb, "-r", folder]) == 0


STEERING = "x\x1b]0;mine\x07\x1b[31m\u202e"


@pytest.mark.parametrize(
    "line", [["status", "-r"], ["verify", "-r"], STORED, ["show", "big-end", "-r"]]
)
def test_a_folder_s_name_cannot_steer_the_terminal(
    line, paper_store, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    Path(STEERING).symlink_to(paper_store)
    cli.main([*line, STEERING])
    shown = "".join(capsys.readouterr())
    if line == STORED:  # which names it
        assert "\\x1b]0;mine\\x07\\x1b[31m\\u202e" in shown
    assert not {"\x1b", "\x07", "\u202e"} & {*shown}

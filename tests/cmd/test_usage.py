"""Commands that there are not, and how mistakes are told in a line."""

import re
from importlib import metadata

import pytest
from compsim import cli

from compressor.cases import MODEL

LAST = "see compsim --help"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["rum"], "compsim: No such command 'rum'; did you mean run?"),
        (["Status"], "compsim: No such command 'Status'; did you mean status?"),
        (["xyzzy"], "compsim: No such command 'xyzzy'; there are init, plan, run, report, "),
        (["help"], "compsim: No such command 'help': compsim --help, or compsim COMMAND --help"),
        (["help", "show"], "compsim: No such command 'help': compsim show --help"),
        (["version"], "compsim: No such command 'version': compsim --version"),
        (
            ["my wear.yaml", "-j", "2"],
            "compsim: 'my wear.yaml' is a case file, and a command comes first: "
            "compsim run 'my wear.yaml' -j 2",
        ),
        (
            ["folder"],
            "compsim: 'folder' is a folder, and a command comes first: compsim status folder, or "
            "compsim report folder",
        ),
        (["status", "--jsn"], "compsim status: No such option '--jsn'; did you mean --json?"),
        (
            ["verify", "-o", "results"],
            "compsim verify: No such option '-o': the folder of results is an argument, "
            "compsim verify FOLDER",
        ),
        (["find", "-i", "results"], "compsim find: No such option '-i': the folder of results is "),
        (
            ["show"],
            "compsim show: Missing argument 'JOB | STUDY [AXIS=VALUE]...'; see compsim show",
        ),
    ],
)
def test_a_mistake_is_one_line(words, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    assert cli.main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith(told)


def test_alone_the_program_says_what_it_can_do(capsys):
    cli.main([])
    said = "".join(capsys.readouterr())
    assert "Work:" in said
    assert "To begin: compsim init." in said


def test_versions_are_one_line(capsys):
    assert cli.main(["--version"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    assert re.match(rf"compsim \d+\.\d+\.\d+, model {re.escape(MODEL)} \(Python 3", out)
    assert f"numba {metadata.version('numba')}" in out

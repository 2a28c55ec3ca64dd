"""Commands that there are not, and how mistakes are told in a line."""

import re
from importlib import metadata

import pytest
from compsim import cli

from compressor.cases import MODEL_VERSION


def test_alone_the_program_says_what_it_can_do(capsys):
    cli.main([])
    said = "".join(capsys.readouterr())
    assert "Work:" in said
    assert "To begin: compsim init." in said


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["run", "x.yaml", "-o", ""], "run: -o is given an empty word"),
        (["run", "x.yaml", "--output="], "run: --output is given an empty word"),
        (["report", "-i", ""], "report: -i is given an empty word"),
        (["plot", "results", ""], "plot: an argument is empty"),
        (["find", "x.yaml", "--first", ""], "find: --first is given an empty word"),
    ],
)
def test_a_shell_variable_that_is_not_set_is_no_word(words, what, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.yaml").write_text("joint: none\n")
    assert cli.main(words) == 2
    assert f"compsim {what}: is a shell variable not set?" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["x.yaml"]


def test_versions_are_one_line(capsys):
    assert cli.main(["--version"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    assert re.match(rf"compsim \d+\.\d+\.\d+, model {re.escape(MODEL_VERSION)} \(Python 3", out)
    assert f"numba {metadata.version('numba')}" in out

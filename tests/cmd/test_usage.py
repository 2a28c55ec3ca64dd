"""What the program says when it is called alone, and its versions."""

import re
from importlib import metadata

from compsim import cli

from compressor.cases import MODEL_VERSION


def test_alone_the_program_says_what_it_can_do(capsys):
    cli.main([])
    said = "".join(capsys.readouterr())
    assert "Work:" in said
    assert "To begin: compsim init." in said


def test_versions_are_one_line(capsys):
    assert cli.main(["--version"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    assert re.match(rf"compsim \d+\.\d+\.\d+, model {re.escape(MODEL_VERSION)} \(Python 3", out)
    assert f"numba {metadata.version('numba')}" in out

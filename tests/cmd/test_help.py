"""Help, versions, and what a shell completes."""

import re
import shlex
from importlib import metadata

import click
import pytest
from compsim.cli import cli, main

from compressor.cases import MODEL_VERSION

WIDTH = 78  # columns that click fills on a terminal of 80
VERBS = sorted(cli.commands)


def examples(name):
    """The commands in a verb's help, each with its lines joined; some follow a shell's name."""
    parent = click.Context(cli, info_name="compsim")
    context = click.Context(cli.commands[name], parent, name, terminal_width=WIDTH)
    text = context.get_help().partition("Options:")[0].replace("\\\n", " ")
    return re.findall(rf"^ +(?:\w+  )?(compsim {name}\b.*)$", text, re.MULTILINE)


@pytest.mark.parametrize("name", VERBS)
def test_every_verb_has_examples_that_it_understands(name):
    found = examples(name)
    assert found
    for line in found:
        words = shlex.split(line)
        words = words[2 : words.index(">") if ">" in words else None]
        cli.commands[name].make_context(name, words, click.Context(cli, info_name="compsim"))


def test_alone_the_program_says_what_it_can_do(capsys):
    main([])
    said = "".join(capsys.readouterr())
    assert "Work:" in said
    assert "To begin: compsim init." in said


def test_versions_are_one_line(capsys):
    assert main(["--version"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    assert re.match(rf"compsim \d+\.\d+\.\d+, model {re.escape(MODEL_VERSION)} \(Python 3", out)
    assert f"numba {metadata.version('numba')}" in out

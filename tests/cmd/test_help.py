"""Help, versions, and what a shell completes."""

import re
import shlex
from importlib import metadata

import click
import pytest
from click.shell_completion import BashComplete
from compsim.cli import VERBS as HEADINGS
from compsim.cli import cli, main

from compressor.cases import MODEL_VERSION

WIDTH = 78  # columns that click fills on a terminal of 80
VERBS = sorted(cli.commands)
FRAGMENTS = {"A", "An", "The", "Of", "No", "Its", "Where", "How", "Which", "Folder"}


def help_of(name=""):
    """The lines of `compsim [NAME] --help` on a terminal of 80 columns."""
    command = cli.commands[name] if name else cli
    parent = click.Context(cli, info_name="compsim")
    context = click.Context(command, parent if name else None, name or "compsim",
                            terminal_width=WIDTH)  # fmt: skip
    return command.get_help(context).splitlines()


def examples(name):
    """The commands in a verb's help, each with its lines joined; some follow a shell's name."""
    text = "\n".join(help_of(name)).partition("Options:")[0].replace("\\\n", " ")
    return re.findall(rf"^ +(?:\w+  )?(compsim {name}\b.*)$", text, re.MULTILINE)


def test_every_summary_is_whole_in_one_line():
    lines = help_of()
    for name, command in cli.commands.items():
        summary = command.help.partition("\n")[0]
        row = rf"  {name} +{re.escape(summary)}"
        assert [line for line in lines if re.fullmatch(row, line)], f"{name}: {summary}"
    assert max(map(len, lines)) <= WIDTH
    assert "..." not in "\n".join(lines[1:])


def test_every_verb_is_under_one_heading():
    listed = [name for names in HEADINGS.values() for name in names]
    assert sorted(listed) == VERBS
    headings = [line.rstrip(":") for line in help_of() if re.fullmatch(r"\w.*:", line)]
    assert headings == ["Options", *HEADINGS]


@pytest.mark.parametrize("name", VERBS)
def test_every_verb_has_examples_that_it_understands(name):
    found = examples(name)
    assert found
    for line in found:
        words = shlex.split(line)
        words = words[2 : words.index(">") if ">" in words else None]
        cli.commands[name].make_context(name, words, click.Context(cli, info_name="compsim"))


@pytest.mark.parametrize("name", VERBS)
def test_every_option_says_in_a_sentence_what_it_does(name):
    for parameter in cli.commands[name].params:
        if isinstance(parameter, click.Option):
            text = parameter.help or ""
            assert re.fullmatch(r"[A-Z].*\.", text), f"{parameter.opts}: {text!r}"
            assert text.split()[0] not in FRAGMENTS, f"{parameter.opts}: {text!r}"
            assert len(text.split()) > 2, f"{parameter.opts}: {text!r}"


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


@pytest.fixture
def complete(monkeypatch):
    """What bash is offered for the last of some words."""

    def run(*words):
        monkeypatch.setenv("COMP_WORDS", " ".join(["compsim", *words]))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        return BashComplete(cli, {}, "compsim", "_COMPSIM_COMPLETE").complete().splitlines()

    return run


def test_commands_choices_files_and_folders_are_completed(complete):
    assert complete("sta") == ["plain,status"]
    assert complete("export", "--format", "w") == ["plain,wav"]
    assert complete("run", "conf") == ["file,conf"]  # the shell goes on
    assert complete("status", "-r", "res") == ["dir,res"]
